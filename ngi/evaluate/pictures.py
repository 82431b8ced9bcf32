"""Pictures of predictions: prediction | reference | error map, as PNG."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
import torch
from PIL import Image, ImageDraw, ImageFont
from PIL.PngImagePlugin import PngInfo
from torch import Tensor

from ngi.evaluate.metrics import tone_map

ERROR_RANGE = 0.5
"""Relative error shown as the brightest colour, the same in every picture."""

COLOUR_MAP = "inferno"
NON_FINITE = (0, 255, 255)
"""Colour of pixels that are NaN or Inf: it occurs neither in the colour map nor in most scenes."""

PANEL = 256
"""Pixels a triptych's panels are enlarged to, by a whole factor, where they are smaller."""

WHITE, BLACK = (255, 255, 255), (0, 0, 0)

_MARGIN = 12
_TOP = 2 * _MARGIN + 14
_BAR_WIDTH = 14


@dataclass(frozen=True)
class Panels:
    """A frame's pictures, all of one size."""

    prediction: Image.Image
    reference: Image.Image
    error: Image.Image

    @classmethod
    def of(
        cls, prediction: Tensor, reference: Tensor, *, epsilon: float, exposure: float
    ) -> Panels:
        """prediction, reference: [H, W, 3] linear radiance"""
        return cls(
            srgb_picture(prediction, exposure),
            srgb_picture(reference, exposure),
            Image.fromarray(error_picture(prediction, reference, epsilon)),
        )

    def write(self, folder: Path, name: str, *, epsilon: float, mape: float) -> None:
        """Writes `{name}_prediction.png`, `_reference.png`, `_error.png`, and the triptych.

        epsilon, mape: of the error map, whose PNG carries as text what it shows ("scale"), its
        "colour_map", and the "maximum" where that ends
        """
        folder.mkdir(parents=True, exist_ok=True)
        scale = PngInfo()
        shown = f"|prediction - reference| / (reference + {epsilon:g}), mean of RGB"
        scale.add_text("scale", shown)
        scale.add_text("colour_map", COLOUR_MAP)
        scale.add_text("maximum", f"{ERROR_RANGE:g}")
        for kind, picture in vars(self).items():
            picture.save(folder / f"{name}_{kind}.png", pnginfo=scale if kind == "error" else None)
        self.triptych(mape=mape).save(folder / f"{name}.png")

    def triptych(self, *, mape: float, name: str = "") -> Image.Image:
        """Side by side under labels, then the error map's colour bar. name: of the frame"""
        labels = (
            f"{name}: prediction" if name else "prediction",
            "reference",
            f"relative error (MAPE {mape:.3f})",
        )
        sheet = side_by_side(list(vars(self).values()), labels, room=_BAR_WIDTH + 48)
        _draw_colour_bar(sheet, left=sheet.width - _BAR_WIDTH - 48, top=_TOP)
        return sheet


def stacked(rows: Sequence[Image.Image]) -> Image.Image:
    """Pictures of one width, one below the other."""
    sheet = Image.new("RGB", (rows[0].width, sum(row.height for row in rows)), "white")
    top = 0
    for row in rows:
        sheet.paste(row, (0, top))
        top += row.height
    return sheet


def error_picture(prediction: Tensor, reference: Tensor, epsilon: float) -> np.ndarray:
    """[H, W, 3] uint8: colour-mapped |prediction - reference| / (reference + epsilon).

    Mean over the channels, linear from 0 to `ERROR_RANGE`, clipped; non-finite pixels in cyan.
    """
    error = ((prediction - reference).abs() / (reference + epsilon)).mean(dim=-1).cpu().numpy()
    with_alpha = matplotlib.colormaps[COLOUR_MAP](np.nan_to_num(error) / ERROR_RANGE, bytes=True)
    coloured: np.ndarray = with_alpha[..., :3].copy()
    coloured[~np.isfinite(error)] = NON_FINITE
    return coloured


def error_colours(length: int, thickness: int) -> np.ndarray:
    """[thickness, length, 3] uint8: the colours of `error_picture` from 0 to `ERROR_RANGE`."""
    levels = np.tile(np.linspace(0, 1, length), (thickness, 1))
    return matplotlib.colormaps[COLOUR_MAP](levels, bytes=True)[..., :3]


def srgb_picture(radiance: Tensor, exposure: float) -> Image.Image:
    """Linear radiance [H, W, 3] as a picture; non-finite pixels in cyan."""
    return Image.fromarray(eight_bit(tone_map(radiance, exposure)))


def eight_bit(picture: Tensor) -> np.ndarray:
    """[H, W, 3] uint8 of values in [0, 1]; NaN in cyan."""
    levels = (picture.cpu().nan_to_num() * 255).round().to(torch.uint8).numpy()
    levels[picture.isnan().any(dim=-1).cpu().numpy()] = NON_FINITE
    return levels


def side_by_side(
    pictures: Sequence[Image.Image],
    labels: Sequence[str],
    *,
    room: int = 0,
    paper: tuple[int, int, int] = WHITE,
    ink: tuple[int, int, int] = BLACK,
) -> Image.Image:
    """The pictures, all of one size, each under its label, and `room` pixels to their right.

    Smaller ones than `PANEL` are enlarged by a whole factor; labels that are too long are cut.
    paper, ink: colours of what is around the pictures, and of the labels
    """
    factor = max(1, PANEL // pictures[0].height)
    size = (pictures[0].width * factor, pictures[0].height * factor)
    width = (size[0] + _MARGIN) * len(pictures) + _MARGIN + room
    sheet = Image.new("RGB", (width, _TOP + size[1] + _MARGIN), paper)
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.truetype(_font_file(), 15)
    for column, (picture, label) in enumerate(zip(pictures, labels, strict=True)):
        left = _MARGIN + column * (size[0] + _MARGIN)
        end = left + size[0] + (room if column == len(pictures) - 1 else 0)
        draw.text((left, _MARGIN), _cut(label, font, end - left), fill=ink, font=font)
        sheet.paste(picture.resize(size, Image.Resampling.NEAREST), (left, _TOP))
    return sheet


def _cut(label: str, font: ImageFont.FreeTypeFont, width: int) -> str:
    if font.getlength(label) <= width:
        return label
    kept = next(n for n in reversed(range(len(label))) if font.getlength(label[:n] + "…") <= width)
    return label[:kept] + "…"


def _draw_colour_bar(sheet: Image.Image, *, left: int, top: int) -> None:
    height = sheet.height - top - _MARGIN
    colours = np.rot90(error_colours(height, _BAR_WIDTH))  # 0 at the bottom
    sheet.paste(Image.fromarray(np.ascontiguousarray(colours)), (left, top))
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.truetype(_font_file(), 12)
    for fraction in (0.0, 0.5, 1.0):
        y = top + (1 - fraction) * (height - 1)
        label = f"{fraction * ERROR_RANGE:g}"
        if fraction == 1.0:
            label = f"≥ {label}"
        draw.line((left + _BAR_WIDTH, y, left + _BAR_WIDTH + 4, y), fill="black")
        draw.text((left + _BAR_WIDTH + 8, y), label, fill="black", font=font, anchor="lm")


def _font_file() -> str:
    """A font with every sign the labels need, which matplotlib always brings."""
    return str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf")
