"""A contact sheet of every scene, to be looked at: `ngi gallery`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import torch
from PIL import Image, ImageDraw
from torch import Tensor
from tqdm import tqdm

from ngi.config.options import option, run_tool
from ngi.evaluate.pictures import srgb_picture
from ngi.scene.folder import read_scene, scenes

if TYPE_CHECKING:
    from ngi.render.mitsuba_renderer import MitsubaRenderer

COLUMNS = 6
CAPTION, GAP = 14, 4


@dataclass
class GalleryOptions:
    """Makes a contact sheet of every scene: random configurations, hard frames and buffers.

    ngi gallery mirror salon configurations=4
    """

    scenes: list[str] | None = option("names; none: all scenes", None)
    folder: str = option("where to", "outputs/gallery")
    configurations: int = option("random v per scene", 8)
    resolution: int = option("pixels a side", 160)
    samples_per_pixel: int = option("of every picture", 64)
    backend: str = option("auto, cuda, llvm or scalar", "auto")


def write_sheets(options: GalleryOptions) -> None:
    """A picture per scene; ValueError for an unknown one, before anything is rendered."""
    from ngi.render.mitsuba_renderer import MitsubaRenderer

    known = scenes()
    names = options.scenes or sorted(known)
    if unknown := set(names) - set(known):
        raise ValueError(f"no scene {sorted(unknown)}; there are {sorted(known)}")
    if options.configurations < 1:
        raise ValueError(f"configurations: {options.configurations}: give at least 1")
    folder = Path(options.folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name in tqdm(names, desc="scenes"):
        scene = read_scene(**known[name])
        with closing(MitsubaRenderer(scene=scene, backend=options.backend)) as renderer:
            sheet(renderer, options).save(folder / f"{name}.jpg", quality=85)
        tqdm.write(f"{folder / name}.jpg")


def sheet(renderer: MitsubaRenderer, options: GalleryOptions) -> Image.Image:
    """Random v, the hard frames, and all buffers of the first of each.

    Radiance is shown in sRGB; a picture darker or brighter than usual is not adapted.
    """
    generator = torch.Generator().manual_seed(0)
    random = torch.rand(options.configurations, renderer.dimensions, generator=generator)
    hard = renderer.hard_frames()
    tiles: list[tuple[str, Image.Image]] = []
    for title, frames in (("random", random), ("hard frame", hard)):
        for index, v in enumerate(tqdm(frames, desc=title, leave=False)):
            image = renderer.render_image(
                v,
                resolution=options.resolution,
                samples_per_pixel=options.samples_per_pixel,
                seed=index,
            )
            tiles.append((f"{title} {index}", srgb_picture(image, 0.0)))
    for title, v in (("random 0", random[0]), ("hard frame 0", hard[0])):
        buffers = renderer.image_buffers(v, resolution=options.resolution).cpu()
        for name in renderer.layout.names:
            picture = buffer_picture(name, buffers[..., renderer.layout.slice(name)])
            tiles.append((f"{name}, {title}", picture))
    return _grid(tiles, options.resolution)


def buffer_picture(name: str, buffer: Tensor) -> Image.Image:
    """A buffer [H, W, 1 or 3] as colours: directions from [-1, 1], the rest from [0, 1]."""
    if name == "outgoing":
        buffer = buffer / 2 + 0.5
    colours = buffer.clamp(0, 1).expand(*buffer.shape[:2], 3)
    if name in ("albedo", "direct", "emission", "throughput"):
        return srgb_picture(colours, 0.0)
    return Image.fromarray((colours * 255).to(torch.uint8).numpy())


def _grid(tiles: list[tuple[str, Image.Image]], size: int) -> Image.Image:
    rows = -(-len(tiles) // COLUMNS)
    image = Image.new("RGB", (COLUMNS * (size + GAP), rows * (size + CAPTION + GAP)), "white")
    draw = ImageDraw.Draw(image)
    for index, (caption, picture) in enumerate(tiles):
        x, y = index % COLUMNS * (size + GAP), index // COLUMNS * (size + CAPTION + GAP)
        draw.text((x + 2, y), caption, fill="black")
        image.paste(picture, (x, y + CAPTION))
    return image


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi gallery`."""
    return run_tool(write_sheets, GalleryOptions, "ngi gallery", arguments)
