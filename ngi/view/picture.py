"""One configuration of a scene as a trained network shows it: `ngi render --help`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from ngi.config.options import check_output, option, run_tool

if TYPE_CHECKING:
    from torch import Tensor

    from ngi.render import Renderer
    from ngi.view.screen import Pixels

SUFFIXES = (".png", ".exr")

SEEDS = 4
"""That a reference is rendered with at most until all of its pixels are finite."""


@dataclass
class PictureOptions:
    """Renders one configuration of a scene with a trained network.

    ngi render run=outputs/demo/sphere-caustic/method=uniform/seed=0 hard_frame=3
    ngi render run=FOLDER v=[0.5,0.2,0.9] resolution=512 out=picture.exr
    ngi render run=FOLDER reference=1024
    """

    run: str = option("a run's folder, finished or not")
    out: str = option("file to write: .png or .exr (linear radiance)", "picture.png")
    v: list[float] | None = option("configuration: one number from 0 to 1 per component", None)
    hard_frame: int = option("index of the scene's hard frame to render if v is not given", 0)
    resolution: int = option("pixels a side", 256)
    exposure: float = option("in stops, for PNG files", 0.0)
    tone_mapping: str = option("for PNG files: sRGB, filmic or linear", "sRGB")
    reference: int = option(
        "samples per pixel of a path-traced picture to compare with; 0: none", 0
    )
    supersampled_edges: bool = option(
        "evaluate the network four times per pixel at edges: less error, slower", False
    )
    scene: str | None = option("folder of the scene, if it is one of the paper's authors", None)


def write_picture(options: PictureOptions) -> None:
    """Writes the picture, and where a reference is asked for that and the error map beside it.

    Prints every file's name, and the metrics.

    Raises ValueError or OSError, naming key and value, before anything is rendered.
    """
    from ngi.evaluate import Lpips, error_picture, image_metrics
    from ngi.view.screen import CURVES
    from ngi.view.trained_run import TrainedRun

    out = Path(options.out)
    check_output(out, *SUFFIXES)
    if not options.resolution >= 1 or not options.reference >= 0:
        raise ValueError("resolution has to be at least 1, reference at least 0")
    if options.tone_mapping not in CURVES:
        raise ValueError(
            f"tone_mapping: '{options.tone_mapping}': choose one of {', '.join(CURVES)}"
        )
    run = TrainedRun.open(
        Path(options.run),
        scene_path=options.scene,
        supersampled_edges=options.supersampled_edges,
    )
    with closing(run.renderer):
        if options.reference and options.resolution < run.protocol.smallest_resolution:
            raise ValueError(
                f"resolution: {options.resolution}: the metrics that a reference is compared by "
                f"take at least {run.protocol.smallest_resolution}"
            )
        weights = os.environ.get("NGI_LPIPS_WEIGHTS")
        lpips = Lpips(weights=weights) if options.reference else None
        v = _scene_vector(options, run.renderer)
        begin = perf_counter()
        radiance = run.radiance(v, resolution=options.resolution)
        took = perf_counter() - begin
        _write(out, radiance, options)
        print(f"step {run.step}, {1e3 * took:.0f} ms; {out}")
        if options.reference == 0:
            return
        reference = _traced(options, run.renderer, v)
    beside, error = _beside(out, "reference"), _beside(out, "error").with_suffix(".png")
    _write(beside, reference, options)
    _write_png(error, error_picture(radiance, reference, run.protocol.epsilon))
    print(f"{beside}, {error}")
    measured = image_metrics(radiance, reference, protocol=run.protocol, lpips=lpips)
    print(", ".join(f"{name} {value:.4g}" for name, value in measured.items() if value is not None))


def _scene_vector(options: PictureOptions, renderer: Renderer) -> Tensor:
    from ngi.view.scene_vectors import given_vector, hard_frame

    if options.v is None:
        return hard_frame(renderer, options.hard_frame)
    return given_vector(options.v, dimensions=renderer.dimensions, name="v")


def _traced(options: PictureOptions, renderer: Renderer, v: Tensor) -> Tensor:
    """The reference, [H, W, 3]. Pixels that a path made NaN or Inf are another seed's."""
    import torch

    def traced(seed: int) -> Tensor:
        return renderer.render_image(
            v, resolution=options.resolution, samples_per_pixel=options.reference, seed=seed
        ).cpu()

    picture = traced(seed=0)
    for seed in range(1, SEEDS):
        finite = picture.isfinite().all(dim=-1, keepdim=True)
        if finite.all():
            break
        picture = torch.where(finite, picture, traced(seed))
    return picture


def _write(path: Path, radiance: Tensor, options: PictureOptions) -> None:
    from ngi.evaluate.pictures import eight_bit
    from ngi.render.exr import write_exr
    from ngi.view.screen import shown

    if path.suffix == ".exr":
        write_exr(path, radiance)
    else:
        toned = shown(radiance, curve=options.tone_mapping, exposure=options.exposure)
        _write_png(path, eight_bit(toned))


def _write_png(path: Path, pixels: Pixels) -> None:
    from PIL import Image

    from ngi.files.durable import write_atomically

    picture = BytesIO()
    Image.fromarray(pixels).save(picture, "png")
    write_atomically(path, picture.getvalue())


def _beside(path: Path, what: str) -> Path:
    return path.with_name(f"{path.stem}_{what}{path.suffix}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi render`."""
    return run_tool(write_picture, PictureOptions, "ngi render", arguments)
