"""Textures of the living room: the table's wood, the rug, pictures and the spines of books."""

from __future__ import annotations

import numpy as np
from modelling.textures import fractal_noise, hash_noise, pixel_grid, value_noise

OAK = np.array([222.0, 170.0, 112.0])  # sRGB
PICTURES = 4
BOOKS = 16


def table_wood(extent: tuple[float, float], size: tuple[int, int]) -> np.ndarray:
    """Four glued boards with bold cathedral grain along y, [height, width, 3] sRGB in 0 to 255."""
    x, y = pixel_grid(extent, size)
    width = extent[0] / 4
    board = np.floor(x / width).astype(np.int64)
    tone = hash_noise(board, np.full_like(board, 5))
    across = x / width - board - 0.2 - 0.6 * tone
    wave = fractal_noise(x * 2 + 30 * tone, y * 1.6 + 50 * tone) - 0.5
    ripple = fractal_noise(x * 12 + 13 * tone, y * 5 + 80 * tone) - 0.5
    # A plane cut through a slightly conical trunk: nested parabolas.
    rings = 16 * np.sqrt(across**2 + 0.02) + 5 * y + 20 * tone + 6 * wave + 0.9 * ripple
    phase = rings - np.floor(rings)
    late = np.where(phase < 0.86, (phase / 0.86) ** 2.5, (1 - phase) / 0.14)
    fibre = value_noise(x * 420 + 90 * tone, y * 7) - 0.5
    cloud = fractal_noise(x * 7, y * 1.5 + 20 * tone) - 0.5
    pores = (value_noise(x * 560, y * 22 + 70 * tone) > 0.78) * (0.35 + 0.65 * late)
    brightness = 0.98 + 0.18 * (tone - 0.5) - 0.3 * late + 0.22 * fibre + 0.2 * cloud - 0.2 * pores
    seam = np.abs(x / width - np.round(x / width)) * width < 0.0008
    brightness = np.maximum(brightness * np.where(seam, 0.65, 1.0), 0.05)
    return OAK * brightness[..., None] ** np.array([1.0, 1.14, 1.3])


def rug(size: tuple[int, int]) -> np.ndarray:
    """A woven rug with a border and rows of lozenges, [height, width, 3] sRGB in 0 to 255."""
    x, y = pixel_grid((24.0, 22.0), size)
    cream, blue, rust, sand = (
        np.array(c, float) for c in ((226, 214, 192), (62, 84, 104), (170, 92, 62), (196, 172, 136))
    )
    u, v = np.abs((x / 3) % 1 - 0.5), np.abs((y / 2.75) % 1 - 0.5)
    lozenge = u + v
    odd = (np.floor(x / 3) + np.floor(y / 2.75)) % 2 < 0.5
    image = np.where((lozenge < 0.42)[..., None], np.where(odd[..., None], blue, sand), cream)
    image = np.where((lozenge < 0.26)[..., None], cream, image)
    image = np.where((lozenge < 0.13)[..., None], rust, image)
    edge = np.minimum(np.minimum(x, 24 - x), np.minimum(y, 22 - y))
    teeth = edge < 1.25 + 0.35 * np.abs(((x + y) * 1.25) % 1 - 0.5)
    for limit, colour in ((1.75, cream), (None, blue), (0.75, cream), (0.55, rust), (0.2, cream)):
        image = np.where((teeth if limit is None else edge < limit)[..., None], colour, image)
    weave = 0.9 + 0.2 * hash_noise(np.floor(x * 12).astype(int), np.floor(y * 22).astype(int))
    return image * (weave * (0.92 + 0.16 * fractal_noise(x, y)))[..., None]


def pictures(size: int) -> np.ndarray:
    """Square pictures side by side, [size, PICTURES * size, 3] sRGB in 0 to 255."""
    return np.concatenate([_hills(size), _arches(size), _circles(size), _leaf(size)], axis=1)


def _canvas(size: int, colour: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    x, y = pixel_grid((1.0, 1.0), (size, size))
    grain = 0.95 + 0.1 * fractal_noise(x * 60, y * 60)
    return x, y, np.array(colour, float) * grain[..., None]


def _paint(image: np.ndarray, mask: np.ndarray, colour: tuple[int, int, int]) -> np.ndarray:
    return np.where(mask[..., None], np.array(colour, float), image)


def _hills(size: int) -> np.ndarray:
    x, y, image = _canvas(size, (233, 214, 178))
    image = _paint(image, np.hypot(x - 0.68, (y - 0.36) * 0.6) < 0.1, (214, 110, 58))
    colours = ((150, 168, 164), (102, 134, 138), (60, 96, 106), (32, 60, 72))
    for i, colour in enumerate(colours):
        ridge = 0.45 + 0.13 * i + 0.2 * (fractal_noise(x * (2 + i) + 9 * i, x * 0 + i) - 0.5)
        image = _paint(image, y > ridge, colour)
    return image


def _arches(size: int) -> np.ndarray:
    x, y, image = _canvas(size, (238, 230, 216))
    rings = ((0.38, (190, 96, 62)), (0.28, (226, 170, 110)), (0.18, (238, 230, 216)))
    for radius, colour in (*rings, (0.1, (70, 96, 92))):
        inside = np.where(y < 0.52, np.hypot(x - 0.5, y - 0.52), np.abs(x - 0.5)) < radius
        image = _paint(image, inside & (y < 0.88), colour)
    return image


def _circles(size: int) -> np.ndarray:
    x, y, image = _canvas(size, (226, 222, 212))
    image = _paint(image, np.hypot(x - 0.4, y - 0.4) < 0.24, (208, 160, 66))
    image = _paint(image, np.hypot(x - 0.62, y - 0.6) < 0.2, (46, 74, 92))
    return _paint(image, np.abs(x + y - 1.0 + 0.35 * (x - y)) < 0.008, (40, 36, 34))


def _leaf(size: int) -> np.ndarray:
    x, y, image = _canvas(size, (240, 236, 226))
    for i in range(9):
        height = 0.2 + 0.075 * i
        for side in (-1, 1):
            u, v = side * (x - 0.5), y - height + side * (x - 0.5) * 0.7
            blade = (u > 0) & (u < 0.32) & (np.abs(v) < 0.03 * np.sin(np.pi * u / 0.32))
            image = _paint(image, blade, (58, 92, 66))
    return _paint(image, (np.abs(x - 0.5) < 0.006) & (y > 0.16) & (y < 0.93), (58, 92, 66))


def book_spines(size: tuple[int, int]) -> np.ndarray:
    """One column per book, spine upright, [height, width, 3] sRGB in 0 to 255."""
    colours = np.array(
        [
            (168, 62, 48), (44, 72, 100), (222, 208, 176), (62, 92, 74),
            (210, 148, 58), (98, 50, 58), (230, 226, 216), (52, 52, 58),
            (126, 150, 156), (188, 106, 74), (84, 110, 134), (148, 138, 92),
            (236, 220, 190), (120, 44, 40), (36, 88, 92), (200, 178, 140),
        ],
        dtype=float,
    )  # fmt: skip
    x, y = pixel_grid((BOOKS, 1.0), size)
    column = np.floor(x).astype(np.int64)
    image = colours[column]
    ink = np.where(image.mean(axis=-1, keepdims=True) > 130, 50.0, 225.0)
    start = 0.12 + 0.12 * hash_noise(column, np.full_like(column, 3))
    title = (y > start) & (y < start + 0.4) & (np.abs(x - column - 0.5) < 0.16)
    letters = hash_noise(column, np.floor(y * 60).astype(int)) > 0.25
    band = (np.abs(y - 0.88) < 0.012) | (np.abs(y - 0.06) < 0.008)
    inked = ((title & letters) | band)[..., None]
    return np.where(inked, 0.45 * image + 0.55 * ink, image)
