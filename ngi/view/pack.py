"""What is left of a run where only its network is wanted: `python -m ngi.view.pack --help`."""

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ngi.config.options import option, run_tool

KEPT_OF_RESULT = (
    *("scene_hash", "commit", "dirty", "versions", "machine", "seed", "label"),
    *("clock", "run_seconds", "steps", "patches_traced", "paths_traced", "protocol", "metrics"),
)
"""Where the network is from and how good it is; frames, logs and identities stay behind."""


@dataclass
class PackOptions:
    """Writes a folder that holds only the network of a finished run.

    python -m ngi.view.pack run=outputs/demo/sphere-caustic/method=ours/seed=0 out=networks/sphere

    view, render, video and export can open it, if the scene is known by its name or given as
    scene=FOLDER. It has the averaged weights if the run has any. It cannot be trained further.
    """

    run: str = option("a finished run's folder")
    out: str = option("folder to write")


def pack(options: PackOptions) -> None:
    """Writes the folder; ValueError or OSError for what is wrong."""
    from ngi.files.durable import write_atomically
    from ngi.files.run_folder import LAST
    from ngi.learn import checkpoint_bytes
    from ngi.view.run_settings import read_settings
    from ngi.view.trained_run import NETWORK, newest_checkpoint, trained_weights

    run, out = Path(options.run), Path(options.out)
    settings = read_settings(run)
    result = run / "result.json"
    if not result.exists():
        raise ValueError(f"run: {run} is not finished, there is no {result.name}")
    if out.exists() and any(out.iterdir()):
        raise ValueError(f"out: {out} is not empty")
    checkpoint = newest_checkpoint(run, settings)
    origin: dict[str, Any] = json.loads(result.read_text())
    if checkpoint["global_step"] != origin.get("steps"):
        raise ValueError(
            f"run: {run} has a {result.name} of step {origin.get('steps')}, but its newest "
            f"undamaged checkpoint is of step {checkpoint['global_step']}"
        )
    weights = trained_weights(checkpoint["state_dict"])
    content = {
        "global_step": checkpoint["global_step"],
        "state_dict": {NETWORK + name: value for name, value in weights.items()},
    }
    out.mkdir(parents=True, exist_ok=True)
    with checkpoint_bytes(content) as view:
        write_atomically(out / LAST, view)
    for name, kept in (
        ("settings.json", settings),
        ("result.json", {key: origin[key] for key in KEPT_OF_RESULT if key in origin}),
    ):
        write_atomically(out / name, f"{json.dumps(kept, indent=2, sort_keys=True)}\n".encode())
    size = sum(file.stat().st_size for file in out.iterdir())
    print(f"{out}: {size / 1e6:.2f} MB, step {checkpoint['global_step']:,}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `python -m ngi.view.pack`."""
    return run_tool(pack, PackOptions, "ngi.view.pack", arguments)


if __name__ == "__main__":
    sys.exit(main())
