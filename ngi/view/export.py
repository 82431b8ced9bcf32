"""A trained network as one file for other programs: `ngi export --help`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from ngi.options import option, run_tool

if TYPE_CHECKING:
    from torch import Tensor

    from ngi.models import PixelGenerator
    from ngi.view.trained_run import TrainedRun

SUFFIX = ".onnx"
PACKAGES = ("onnx", "onnxscript", "onnxruntime")
"""Of the extra 'export'."""
TOLERANCE = 1e-4
"""Largest difference between file and network that is let through, relative to 1 + |radiance|."""
RANDOM_PIXELS = 1000


@dataclass
class ExportOptions:
    """Writes a trained network as an ONNX file, which runs without this program and PyTorch.

    ngi export run=outputs/demo/sphere-caustic/method=uniform/seed=0

    Inputs: buffers [N, C] of any N pixels, and v [D] in [0, 1]. Output: radiance [N, 3], linear
    RGB, negative where the network says so. All in float32. The file's metadata says what each
    channel and each component of v is. Before it is written, ONNX Runtime runs it beside the
    network, on random numbers and on the scene's first hard frame.
    """

    run: str = option("a run's folder, finished or not")
    out: str = option("file to write: .onnx", "network.onnx")
    scene: str | None = option("of a run of the authors' files: their folder", None)


def export(options: ExportOptions) -> None:
    """Writes the file; ValueError or OSError for what is wrong, and then nothing is written."""
    out = Path(options.out)
    if out.suffix != SUFFIX:
        raise ValueError(f"out: '{out}' does not end with {SUFFIX}")
    if not out.parent.is_dir():
        raise ValueError(f"out: there is no folder {out.parent}")
    if missing := [name for name in PACKAGES if find_spec(name) is None]:
        raise ValueError(f"{', '.join(missing)} missing: pip install -e .[export]")
    from ngi.durable import write_atomically
    from ngi.models import PixelGenerator
    from ngi.view.network_file import network_file
    from ngi.view.network_metadata import network_metadata
    from ngi.view.trained_run import TrainedRun

    run = TrainedRun.open(
        Path(options.run), scene_path=None if options.scene is None else Path(options.scene)
    )
    with closing(run.renderer):
        if not isinstance(run.network, PixelGenerator):
            raise ValueError(
                f"run: its network is a {type(run.network).__name__}, which needs more of a frame "
                "than buffers and v; a PixelGenerator can be exported"
            )
        content = network_file(run.network, network_metadata(run))
        differences = _checked(content, run.network, run)
    write_atomically(out, content)
    print(f"step {run.step}, {len(content) / 2**20:.1f} MiB; {out}")
    print(f"largest difference from the network, relative to 1 + radiance: {differences}")


def _checked(content: bytes, network: PixelGenerator, run: TrainedRun) -> str:
    """The largest differences between file and network; ValueError where one is too large."""
    from ngi.view.network_file import largest_difference

    shown = []
    for name, (buffers, v) in _inputs(run).items():
        difference = largest_difference(content, network, buffers, v)
        if not difference <= TOLERANCE:  # NaN is too large
            raise ValueError(
                f"the exported network differs from the one of the run by {difference:.2g} of "
                f"1 + radiance on {name}, more than {TOLERANCE:g}; nothing was written"
            )
        shown.append(f"{difference:.1e} on {name}")
    return ", ".join(shown)


def _inputs(run: TrainedRun) -> dict[str, tuple[Tensor, Tensor]]:
    """Buffers [N, C] and v [D] to compare on, by name."""
    import torch

    generator = torch.Generator().manual_seed(0)
    pixels = torch.rand(RANDOM_PIXELS, run.renderer.layout.channels, generator=generator)
    v = torch.rand(run.renderer.dimensions, generator=generator)
    hard = run.renderer.hard_frames()[0]
    frame = run.renderer.image_buffers(hard, resolution=run.protocol.resolution).cpu()
    size = f"{run.protocol.resolution} × {run.protocol.resolution}"
    return {
        f"{RANDOM_PIXELS} random pixels": (pixels, v),
        f"hard frame 0 at {size}": (frame.flatten(0, 1), hard),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi export`."""
    return run_tool(export, ExportOptions, "ngi export", arguments)
