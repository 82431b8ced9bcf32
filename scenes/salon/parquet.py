"""The salon's parquet, its walnut and its painting."""

from __future__ import annotations

import numpy as np
from modelling.textures import fractal_noise, hash_noise, pixel_grid, value_noise

COLUMN, BOARD = 0.4, 0.14  # metres: width of a column, length of a board's cut edge
OAK = np.array([190.0, 141.0, 92.0])  # sRGB
WALNUT_DARK, WALNUT_LIGHT = np.array([82.0, 52.0, 34.0]), np.array([150.0, 102.0, 66.0])  # sRGB


def chevron(extent: tuple[float, float], size: tuple[int, int]) -> np.ndarray:
    """Boards at 45 degrees that meet along columns; [height, width, 3] in 0 to 255, sRGB.

    extent: metres, an even number of columns by a whole number of boards, so that it can be tiled.
    """
    x, y = pixel_grid(extent, size)
    column = np.floor(x / COLUMN).astype(np.int64)
    across = x - column * COLUMN
    slanted = y + np.where(column % 2 == 0, across, COLUMN - across)
    row = np.floor(slanted / BOARD).astype(np.int64)
    board = row % round(extent[1] / BOARD)
    tone = hash_noise(column + 3, board)
    hue = hash_noise(column + 40, board) - 0.5

    along = np.where(column % 2 == 0, across - y, COLUMN - across - y) + 11 * tone
    beside = slanted - row * BOARD + 5 * tone
    figure = fractal_noise(along * 6, beside * 45 + 90 * tone, 3)
    pores = value_noise(along * 25, beside * 420)
    brightness = 0.78 + 0.34 * tone + 0.34 * (figure - 0.5) + 0.12 * (pores - 0.5)
    seam = np.minimum(slanted - row * BOARD, (row + 1) * BOARD - slanted) / np.sqrt(2)
    seam = np.minimum(seam, np.minimum(across, COLUMN - across))
    brightness = brightness * np.where(seam < 0.0022, 0.5, 1.0)
    tint = np.stack([1 + 0.06 * hue, np.ones_like(hue), 1 - 0.14 * hue], axis=-1)
    return OAK * brightness[..., None] * tint


def walnut(size: int) -> np.ndarray:
    """A metre of veneer with the grain along x; [size, size, 3] in 0 to 255, sRGB."""
    x, y = pixel_grid((1.0, 1.0), (size, size))
    bent = y + 0.06 * fractal_noise(x * 1.5, y * 3, 3) + 0.01 * value_noise(x * 4, y * 14)
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (bent * 16 + 1.5 * fractal_noise(x, bent * 7, 2)))
    fibre = value_noise(x * 14, y * 300)
    share = np.clip(0.25 + 0.45 * rings**1.5 + 0.5 * (fibre - 0.5), 0, 1)[..., None]
    return WALNUT_DARK * (1 - share) + WALNUT_LIGHT * share


def painting(size: tuple[int, int]) -> np.ndarray:
    """An abstract harbour at dusk in palette-knife strokes; [height, width, 3], sRGB."""
    x, y = pixel_grid((size[0] / size[1], 1.0), size)
    x, y = (
        x + 0.04 * (fractal_noise(x * 9, y * 9) - 0.5),
        y + 0.05 * (fractal_noise(x * 7, y * 7 + 9) - 0.5),
    )
    stops = np.array([0, 0.3, 0.47, 0.52, 0.56, 0.75, 1])
    colours = np.array([(38, 58, 84), (120, 130, 140), (232, 178, 112), (244, 214, 150),
                        (74, 92, 100), (46, 74, 88), (24, 40, 56)], dtype=float)  # fmt: skip
    image = np.stack([np.interp(y, stops, colours[:, k]) for k in range(3)], axis=-1)
    sun = np.hypot(x - 0.95, (y - 0.43) * 1.1) < 0.075
    glitter = (
        (np.abs(x - 0.95) < 0.03 + 0.12 * (y - 0.5))
        & (y > 0.55)
        & (value_noise(x * 14, y * 60) > 0.52)
    )
    image[sun | glitter] = (250, 226, 176)
    for left, width, top in (
        (0.12, 0.1, 0.3),
        (0.27, 0.07, 0.38),
        (0.5, 0.13, 0.26),
        (1.16, 0.09, 0.34),
    ):
        sail = (
            (y > top)
            & (y < 0.57)
            & (np.abs(x - left - 0.5 * width) < 0.5 * width * (y - top) / (0.57 - top))
        )
        image[sail] = (222, 210, 190) if left != 0.27 else (176, 70, 48)
    strokes = 34 * (fractal_noise(x * 10, y * 70, 2) - 0.5)
    return image + strokes[..., None]
