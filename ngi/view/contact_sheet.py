"""Many pictures of a scene on one sheet, and buffers as colours."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import torch
from PIL import Image, ImageDraw
from torch import Tensor
from tqdm import tqdm

from ngi.evaluate.pictures import srgb_picture
from ngi.patches import LOG_RADIANCE

if TYPE_CHECKING:
    from ngi.render.mitsuba_renderer import MitsubaRenderer

COLUMNS = 6
CAPTION, GAP = 14, 4


def contact_sheet(
    renderer: MitsubaRenderer, *, configurations: int, resolution: int, samples_per_pixel: int
) -> Image.Image:
    """Random v, the hard frames, and all buffers of the first of each.

    configurations: how many random v. resolution: pixels a side of every picture. Radiance is
    shown in sRGB; a picture darker or brighter than usual is not adapted.
    """
    shown = partial(srgb_picture, exposure=0.0)
    generator = torch.Generator().manual_seed(0)
    random = torch.rand(configurations, renderer.dimensions, generator=generator)
    hard = renderer.hard_frames()
    tiles: list[tuple[str, Image.Image]] = []
    for title, frames in (("random", random), ("hard frame", hard)):
        for index, v in enumerate(tqdm(frames, desc=title, leave=False)):
            image = renderer.render_image(
                v,
                resolution=resolution,
                samples_per_pixel=samples_per_pixel,
                seed=index,
            )
            tiles.append((f"{title} {index}", shown(image)))
    for title, v in (("random 0", random[0]), ("hard frame 0", hard[0])):
        buffers = renderer.image_buffers(v, resolution=resolution).cpu()
        for name in renderer.layout.names:
            picture = buffer_picture(name, buffers[..., renderer.layout.slice(name)], shown)
            tiles.append((f"{name}, {title}", picture))
    return _grid(tiles, resolution)


def buffer_picture(
    name: str, buffer: Tensor, shown: Callable[[Tensor], Image.Image]
) -> Image.Image:
    """A buffer [H, W, 1 or 3] as colours: directions from [-1, 1], the rest from [0, 1].

    shown: how light is, linear radiance [H, W, 3]
    """
    if name in LOG_RADIANCE:
        return shown(buffer.expm1())
    if name == "outgoing":
        buffer = buffer / 2 + 0.5
    colours = buffer.clamp(0, 1).expand(*buffer.shape[:2], 3)
    if name in ("albedo", "throughput"):
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
