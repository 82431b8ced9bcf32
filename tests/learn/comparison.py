"""Exact comparison of what checkpoints and finished runs hold."""

from pathlib import Path
from typing import Any

import pandas as pd
import torch

from ngi.learn.checkpoint import STEP_GUARD, STREAM
from ngi.machine.memory import COLUMNS


def assert_same(a: Any, b: Any, path: str = "") -> None:
    if isinstance(a, dict):
        assert a.keys() == b.keys(), path
        for key in a:
            assert_same(a[key], b[key], f"{path}.{key}")
    elif isinstance(a, list | tuple):
        assert len(a) == len(b), path
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            assert_same(x, y, f"{path}[{i}]")
    elif isinstance(a, torch.Tensor):
        assert torch.equal(a, b), path
    else:
        assert a == b, path


def final_state(folder: Path) -> dict[str, Any]:
    """All that a run goes on from, and the store with its patches, however it was saved."""
    checkpoint = torch.load(folder / "last.ckpt", weights_only=True)
    parts = ("state_dict", "optimizer_states", STREAM, STEP_GUARD, "global_step")
    state = {part: checkpoint[part] for part in parts}
    store = state[STREAM]["store"]
    names = [segment["name"] for segment in store.pop("segments")]
    segments = [torch.load(folder / "patches" / name, weights_only=True) for name in names]
    patches = {key: torch.cat([segment[key] for segment in segments]) for key in segments[0]}
    stored = torch.isin(patches["ids"], store["ids"])
    return {**state, "patches": {key: value[stored] for key, value in patches.items()}}


def assert_same_run(folder: Path, other: Path) -> None:
    """Two finished runs are the same bit for bit, apart from seconds and what the machine gave."""
    assert_same(final_state(folder), final_state(other))
    assert (folder / "chains.bin").read_bytes() == (other / "chains.bin").read_bytes()
    for name in ("steps.csv", "metrics.csv"):
        tables = [pd.read_csv(f / name) for f in (folder, other)]
        ours, theirs = (t[[c for c in t if not _of_machine(c)]] for t in tables)
        pd.testing.assert_frame_equal(ours, theirs, check_exact=True)
    assert (folder / "result.json").exists()
    assert (other / "result.json").exists()
    assert not [*folder.rglob("*.partial")]


def _of_machine(column: str) -> bool:
    return column.endswith("seconds") or column in COLUMNS
