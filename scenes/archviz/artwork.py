"""Pictures, rugs, woods, marble and the sky of the living room, all [height, width, 3] sRGB."""

from __future__ import annotations

import numpy as np
from modelling.textures import fractal_noise, hash_noise, pixel_grid, value_noise

PALETTES = np.array(
    [
        [(236, 226, 206), (196, 92, 58), (34, 62, 80), (226, 172, 92)],
        [(228, 222, 214), (60, 92, 82), (206, 150, 120), (30, 36, 40)],
        [(240, 232, 220), (214, 178, 60), (90, 60, 90), (40, 90, 120)],
        [(222, 206, 190), (120, 40, 44), (70, 96, 110), (236, 200, 160)],
    ],
    dtype=float,
)
"""Ground and three colours of each picture, in 0 to 255."""


def shapes_picture(index: int, size: tuple[int, int]) -> np.ndarray:
    """Three overlapping arches and discs, screen-printed."""
    aspect = size[0] / size[1]
    x, y = pixel_grid((aspect, 1.0), size)
    wobble = 0.006 * (fractal_noise(x * 30, y * 30 + 7 * index) - 0.5)
    ground, *inks = PALETTES[index]
    image = np.broadcast_to(ground, (*x.shape, 3)).copy()
    for i, ink in enumerate(inks):
        a, b, c = hash_noise(np.full(3, 11 * index + 3), 3 * i + np.arange(3))
        cx, cy, r = aspect * (0.3 + 0.4 * a), 0.3 + 0.42 * b, aspect * (0.17 + 0.16 * c)
        disc = np.hypot(x - cx, y - cy) + wobble < r
        arch = (np.abs(x - cx) + wobble < r) & (y > cy) & (y < cy + 0.32)
        image[disc | arch if (index + i) % 2 else disc] = ink
    margin = np.minimum(np.minimum(x, aspect - x), np.minimum(y, 1 - y)) < 0.06
    image[margin] = (244, 240, 232)
    return image + 10 * (value_noise(x * 200, y * 200) - 0.5)[..., None]


def hills_picture(index: int, size: tuple[int, int]) -> np.ndarray:
    """Layers of hills in one hue below a pale sky."""
    aspect = size[0] / size[1]
    x, y = pixel_grid((aspect, 1.0), size)
    near = np.array([(28, 56, 74), (92, 46, 38), (40, 62, 44)][index], dtype=float)
    sky = np.array([(224, 226, 220), (246, 220, 186), (226, 232, 210)][index], dtype=float)
    image = np.broadcast_to(sky, (*x.shape, 3)) - 30 * y[..., None]
    sun = np.hypot(x - aspect * (0.3 + 0.2 * index), y - 0.28) < 0.09
    image = np.where(sun[..., None], np.array([236, 150, 96]), image)
    for layer in range(6):
        ridge = fractal_noise(x * (1.6 + 0.5 * layer) + 13 * layer, np.full_like(x, 5.0 * index), 3)
        share = ((layer + 1) / 6) ** 0.8
        land = (y > 0.42 + 0.09 * layer - 0.28 * (ridge - 0.35))[..., None]
        image = np.where(land, sky * (1 - share) + near * share, image)
    return image + 14 * (fractal_noise(x * 60, y * 60, 2) - 0.5)[..., None]


def rug(index: int, size: tuple[int, int]) -> np.ndarray:
    """Bordered lozenges, bold stripes, or pale tufted lines; woven."""
    aspect = size[0] / size[1]
    x, y = pixel_grid((aspect, 1.0), size)
    edge = np.minimum(np.minimum(x, aspect - x), np.minimum(y, 1 - y))
    wool = np.array([214.0, 204.0, 186.0])
    if index == 0:
        u, v = np.abs((x / aspect * 6) % 1 - 0.5), np.abs((y * 4) % 1 - 0.5)
        image = np.where((np.abs(u + v - 0.5) < 0.07)[..., None], np.array([60, 58, 60]), wool)
        image = np.where((u + v < 0.2)[..., None], np.array([176, 84, 56]), image)
        image = np.where((edge < 0.09)[..., None], np.array([52, 64, 74]), image)
    elif index == 1:
        colours = np.array([(36, 66, 84), (214, 204, 186), (186, 140, 70), (120, 60, 50)], float)
        image = colours[np.floor(x / aspect * 16).astype(int) * 7 % 4]
    else:
        lines = np.abs((y + 0.12 * np.sin(5 * x) + 0.1 * fractal_noise(x * 3, y * 3)) * 9 % 1 - 0.5)
        image = np.where((lines < 0.06)[..., None], np.array([110, 104, 98]), wool)
    image = np.where((edge < 0.02)[..., None], 0.7 * image, image)
    weave = 0.88 + 0.24 * hash_noise(np.floor(x * 240).astype(int), np.floor(y * 240).astype(int))
    return image * weave[..., None] * (0.94 + 0.12 * value_noise(x * 9, y * 9))[..., None]


def wood(size: int, dark: tuple[int, ...], light: tuple[int, ...]) -> np.ndarray:
    """A metre of veneer with the grain along x."""
    x, y = pixel_grid((1.0, 1.0), (size, size))
    bent = y + 0.07 * fractal_noise(x * 1.2, y * 3, 3)
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (bent * 14 + 1.5 * fractal_noise(x, bent * 7, 2)))
    share = np.clip(0.3 + 0.4 * rings**1.5 + 0.5 * (value_noise(x * 12, y * 280) - 0.5), 0, 1)
    return np.array(dark) * (1 - share[..., None]) + np.array(light) * share[..., None]


def marble(size: int) -> np.ndarray:
    """A metre of white marble with grey veins."""
    x, y = pixel_grid((1.0, 1.0), (size, size))
    bend = fractal_noise(x * 3, y * 3, 5)
    vein = 1 - np.abs(2 * fractal_noise(x * 2.5 + 3 * bend, y * 2.5 + 2 * bend, 5) - 1)
    cloud = fractal_noise(x * 4 + 9, y * 4, 4)
    shade = 232 - 16 * cloud - 90 * np.clip(vein - 0.9, 0, 1) / 0.1 * (0.4 + 0.6 * bend)
    return shade[..., None] * np.array([1.0, 0.985, 0.96])


def planks(extent: tuple[float, float], size: tuple[int, int]) -> np.ndarray:
    """Wide pale boards along x with staggered joints; tiled if 0.2 m divides the extent in y."""
    x, y = pixel_grid(extent, size)
    row = np.floor(y / 0.2).astype(np.int64)
    along = x / extent[0] + hash_noise(row, np.full_like(row, 5))
    board = np.floor(along * 2).astype(np.int64) % 2
    tone = hash_noise(row + 9, board)
    across, joint = y - 0.2 * row, (along * 2) % 1 * extent[0] / 2
    bent = across + 0.02 * fractal_noise(x * 2 + 40 * tone, across * 9 + 30 * tone, 3)
    figure = 0.5 + 0.5 * np.sin(2 * np.pi * (bent * 26 + 4 * tone))
    fibre = value_noise(x * 16 + 90 * tone, y * 330)
    shade = 0.86 + 0.14 * tone + 0.08 * figure + 0.14 * (fibre - 0.5)
    seam = np.minimum(np.minimum(across, 0.2 - across), np.minimum(joint, extent[0] / 2 - joint))
    shade = shade * np.where(seam < 0.0025, 0.55, 1.0)
    return np.array([186.0, 152.0, 116.0]) * shade[..., None]


def garden(size: tuple[int, int]) -> np.ndarray:
    """Sky, trees and lawn all around, dark on the side of the house (left half)."""
    x, y = pixel_grid((1.0, 1.0), size)
    angle = 2 * np.pi * x
    ring = [3 * np.cos(angle) + 5, 3 * np.sin(angle) + 5]  # noise on a circle has no seam
    high = np.clip((0.5 - y) * 2, 0, 1)[..., None]
    sky = np.array([236.0, 240.0, 244.0]) * (1 - high) + np.array([120.0, 168.0, 226.0]) * high
    cloud = np.clip(fractal_noise(ring[0] * 2, ring[1] * 2 + y * 14, 4) - 0.45, 0, 1)[..., None]
    image = sky + (250 - sky) * np.minimum(3 * cloud, 0.9)
    tops = 0.47 - 0.075 * fractal_noise(ring[0] * 3, ring[1] * 3, 5)
    foliage = fractal_noise(x * 90, y * 60, 4)[..., None]
    image = np.where((y > tops)[..., None], np.array([84.0, 98.0, 72.0]) * (0.5 + foliage), image)
    lawn = np.array([136.0, 146.0, 108.0]) * (0.85 + 0.3 * foliage)
    image = np.where((y > 0.515)[..., None], lawn, image)
    facing = np.clip(1.15 * np.cos(angle - 2 * np.pi * 0.75), 0.1, 1)[..., None]
    return image * facing * (1 - 0.7 * high)
