"""A trained network as one file for other programs: `ngi export --help`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from ngi.config.options import check_output, option, run_tool
from ngi.files.extras import install_command

if TYPE_CHECKING:
    from torch import Tensor

    from ngi.view.network_file import ImageNetwork
    from ngi.view.trained_run import TrainedRun

SUFFIX = ".onnx"
PACKAGES = ("onnx", "onnxscript", "onnxruntime")
"""Of the extra 'export'."""
TOLERANCE = 1e-4
"""Largest difference between file and network that is let through, relative to 1 + |radiance|."""
RANDOM_PIXELS = 1000


@dataclass
class ExportOptions:
    """Writes a trained network as an ONNX file, which needs neither this program nor PyTorch.

    ngi export run=outputs/demo/sphere-caustic/method=uniform/seed=0

    Inputs: buffers [N, C] of any N pixels, and v [D] in [0, 1]. Output: radiance [N, 3], linear
    RGB, which may be slightly negative. All are float32. The file's metadata describes each channel
    and each component of v. Before writing it, the command compares ONNX Runtime's output with the
    network's, on random numbers and on the scene's first hard frame.
    """

    run: str = option("a run's folder, finished or not")
    out: str = option("file to write: .onnx", "network.onnx")
    scene: str | None = option("folder of the scene, if it is one of the paper's authors", None)


def export(options: ExportOptions) -> None:
    """Writes the file; ValueError or OSError for what is wrong, and then nothing is written."""
    out = Path(options.out)
    check_output(out, SUFFIX)
    if missing := [name for name in PACKAGES if find_spec(name) is None]:
        raise ValueError(f"{', '.join(missing)} missing: {install_command('export')}")
    from ngi.files.durable import write_atomically
    from ngi.view.network_file import ImageNetwork, network_file, network_metadata
    from ngi.view.trained_run import TrainedRun

    run = TrainedRun.open(Path(options.run), scene_path=options.scene)
    with closing(run.renderer):
        if not isinstance(run.network, ImageNetwork):
            raise ValueError(
                f"run: its network is a {type(run.network).__name__}, which needs more of a frame "
                "than buffers and v; a PixelGenerator or an EncodedGenerator can be exported"
            )
        hard = run.renderer.hard_frames()[0]
        frame = run.renderer.image_buffers(hard, resolution=run.protocol.resolution).cpu()
        shown = _shown_difference(run, frame, hard)
        content = network_file(run.network, network_metadata(run, shown))
        differences = _checked(content, run.network, _inputs(run, frame, hard))
    write_atomically(out, content)
    print(f"step {run.step}, {len(content) / 2**20:.1f} MiB; {out}")
    print(f"largest difference from the network, relative to 1 + radiance: {differences}")


def _checked(
    content: bytes, network: ImageNetwork, inputs: dict[str, tuple[Tensor, Tensor]]
) -> str:
    """The largest differences between file and network; ValueError where one is too large."""
    from ngi.view.network_file import largest_difference

    shown = []
    for name, (buffers, v) in inputs.items():
        difference = largest_difference(content, network, buffers, v)
        if not difference <= TOLERANCE:  # NaN is too large
            raise ValueError(
                f"the exported network differs from the run's by {difference:.2g} (relative to "
                f"1 + radiance) on {name}, more than {TOLERANCE:g}; nothing was written"
            )
        shown.append(f"{difference:.1e} on {name}")
    return ", ".join(shown)


def _inputs(run: TrainedRun, frame: Tensor, v: Tensor) -> dict[str, tuple[Tensor, Tensor]]:
    """Buffers [N, C] and what the network is given of v to compare on, by name.

    frame: [H, W, C] at v [D]
    """
    import torch

    generator = torch.Generator().manual_seed(0)
    pixels = torch.rand(RANDOM_PIXELS, frame.shape[-1], generator=generator)
    (seen,) = run.samples.test_inputs(v, frame, preview=True)
    size = f"{len(frame)} × {len(frame)}"
    return {
        f"{RANDOM_PIXELS} random pixels": (pixels, torch.rand(len(seen), generator=generator)),
        f"hard frame 0 at {size}": (frame.flatten(0, 1), seen),
    }


def _shown_difference(run: TrainedRun, frame: Tensor, v: Tensor) -> float:
    """How far `ngi render` and the viewer, in the precision of training, are from float32."""
    from ngi.view.network_file import FLOAT32, relative_difference

    shown, exact = (
        replace(run, precision=precision).predict(frame, v, preview=True).expm1()
        for precision in (run.precision, FLOAT32)
    )
    return relative_difference(shown, exact)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi export`."""
    return run_tool(export, ExportOptions, "ngi export", arguments)
