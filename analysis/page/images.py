"""Figures and pictures as data URIs, so that the page holds them itself."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

from analysis.plots import figure_bytes

LARGEST_PICTURE = 320
"""Pixels per side; larger pictures are shrunk to this in the page, not on disk."""

WEBP_QUALITY = 82

CSS_PIXELS_PER_INCH = 96

_MEDIA = {".svg": "image/svg+xml", ".png": "image/png"}


@dataclass(frozen=True)
class Illustration:
    """An image of the page: its data URI, its size in CSS pixels, and what it shows in words."""

    uri: str
    width: int
    height: int
    alt: str


def from_figure(figure: Figure, alt: str) -> Illustration:
    """A matplotlib figure as SVG, in its size on paper."""
    width, height = figure.get_size_inches() * CSS_PIXELS_PER_INCH
    return Illustration(
        _uri(figure_bytes(figure, "svg"), _MEDIA[".svg"]), *_size(width, height), alt
    )


def from_files(png: Path, svg: Path, alt: str) -> Illustration:
    """A figure that was saved as PNG and SVG: the smaller file of the two."""
    with Image.open(png) as image:
        dots_per_inch = image.info["dpi"][0]
        size = [side / dots_per_inch * CSS_PIXELS_PER_INCH for side in image.size]
    smaller = min(svg, png, key=lambda file: file.stat().st_size)
    return Illustration(_uri(smaller.read_bytes(), _MEDIA[smaller.suffix]), *_size(*size), alt)


def from_picture(picture: Image.Image, alt: str) -> Illustration:
    """An RGB picture as WebP, at most `LARGEST_PICTURE` pixels wide and high."""
    shrunk = picture.copy()
    shrunk.thumbnail((LARGEST_PICTURE, LARGEST_PICTURE), Image.Resampling.BOX)
    stream = BytesIO()
    shrunk.save(stream, "WEBP", quality=WEBP_QUALITY, method=6)
    return Illustration(_uri(stream.getvalue(), "image/webp"), *shrunk.size, alt)


def _uri(data: bytes, media_type: str) -> str:
    return f"data:{media_type};base64,{base64.b64encode(data).decode()}"


def _size(width: float, height: float) -> tuple[int, int]:
    return round(width), round(height)
