"""Images of Veach Door: the checkered floor, a seascape and two botanical prints.

All are [height, width, 3], sRGB in 0 to 255.
"""

from __future__ import annotations

import numpy as np
from modelling.textures import fractal_noise, hash_noise, pixel_grid

TILE = 0.4
"""Metres."""


def checkered_tiles(extent: tuple[float, float], size: tuple[int, int]) -> np.ndarray:
    """Polished light and dark stone over `extent` metres, `size` pixels."""
    x, y = pixel_grid(extent, size)
    column, row = np.floor(x / TILE).astype(np.int64), np.floor(y / TILE).astype(np.int64)
    tone = hash_noise(column, row)
    dark = (column + row) % 2 == 1
    shift = 30 * tone
    cloud = fractal_noise(x * 3 + shift, y * 3 - shift, 3)
    vein = np.abs(fractal_noise(x * 2.2 + 2 * shift, y * 2.2 + shift, 4) - 0.5)
    veins = np.clip(1 - vein / 0.022, 0, 1)
    light = np.array([214.0, 203, 184]) * (0.86 + 0.16 * cloud + 0.06 * tone)[..., None]
    light *= 1 - 0.16 * veins[..., None]
    deep = np.array([52.0, 44, 40]) * (0.7 + 0.6 * cloud + 0.2 * tone)[..., None]
    deep += 60 * veins[..., None]
    image = np.where(dark[..., None], deep, light)
    edge = np.minimum(np.abs(x / TILE - np.round(x / TILE)), np.abs(y / TILE - np.round(y / TILE)))
    return np.where((edge * TILE < 0.0025)[..., None], 96.0, image)


def seascape(width: int, height: int) -> np.ndarray:
    """Sunset behind a headland."""
    x, y = pixel_grid((width / height, 1.0), (width, height))
    x = x + 0.012 * (fractal_noise(x * 30, y * 30) - 0.5)
    clouds = fractal_noise(x * 3 + 5, y * 9, 5)
    height_over_sea = np.clip((0.58 - y) / 0.58, 0, 1)[..., None]
    low, high = np.array([246.0, 172, 96]), np.array([58.0, 92, 128])
    sky = low * (1 - height_over_sea**0.6) + high * height_over_sea**0.6
    sky += (np.clip(clouds - 0.5, 0, 1) * 2)[..., None] * np.array([90.0, 20, 0])
    sun = np.hypot(x - 0.85, y - 0.47)
    sky += (170 * np.exp(-((sun / 0.05) ** 4)) + 70 * np.exp(-sun / 0.16))[..., None]
    depth = np.clip((y - 0.58) / 0.42, 0, 1)
    waves = fractal_noise(x * 7 / (0.15 + depth), 9 / (0.1 + depth), 4)
    sea = np.array([40.0, 84, 104]) * (0.7 + 0.7 * waves - 0.25 * depth)[..., None]
    glitter = np.exp(-(((x - 0.85) / (0.05 + 0.2 * depth)) ** 2)) * (waves > 0.5)
    image = np.where((y < 0.58)[..., None], sky, sea + glitter[..., None] * [150.0, 100, 50])
    ridge = 0.58 - 0.3 * np.clip(0.62 - x, 0, 1) ** 0.8 - 0.07 * fractal_noise(x * 6, 0 * x + 3)
    land = (y > ridge) & (y < 0.6 + 0.06 * (0.6 - x)) & (x < 0.66)
    earth = np.array([46.0, 42, 44]) * (0.7 + 0.6 * fractal_noise(x * 12, y * 12))[..., None]
    return np.where(land[..., None], earth, image)


def leaf_print(width: int, height: int, seed: float) -> np.ndarray:
    """A stem with leaves on aged paper."""
    x, y = pixel_grid((width / height, 1.0), (width, height))
    paper = (
        np.array([226.0, 214, 188]) * (0.93 + 0.1 * fractal_noise(x * 6 + seed, y * 6))[..., None]
    )
    middle = width / height / 2
    bend = middle + 0.03 * np.sin(3 * y + seed)
    stem = (np.abs(x - bend) < 0.004) & (y > 0.14) & (y < 0.9)
    image = np.where(stem[..., None], [70.0, 80, 50], paper)
    for i, foot in enumerate(np.linspace(0.82, 0.2, 9)):
        side, size = (-1) ** i, 0.15 * (1 - 0.05 * i)
        along = (x - middle - 0.03 * np.sin(3 * foot + seed)) * side * 0.8 - (y - foot) * 0.6
        across = (x - middle - 0.03 * np.sin(3 * foot + seed)) * side * 0.6 + (y - foot) * 0.8
        inside = np.clip(along / size, 0, 1)
        blade = np.abs(across) < 0.26 * size * np.sin(np.pi * inside**0.8)
        shade = 0.8 + 0.35 * (across > 0) + 0.15 * np.sin(along * 400)
        colour = np.array([74.0 + 20 * np.sin(seed), 104, 62]) * shade[..., None]
        image = np.where(blade[..., None], colour, image)
    return image
