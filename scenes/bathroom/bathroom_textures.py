"""Tiles and towels: pictures in sRGB, 0 to 255, [height, width, 3]."""

from __future__ import annotations

import numpy as np
from modelling.textures import fractal_noise, hash_noise, pixel_grid, value_noise

JOINT = np.array([178.0, 174, 164])


def mixed(image: np.ndarray, colour: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """A picture [..., 3] with as much of a colour [3] as the weight [...] in [0, 1] says."""
    return image + weight[..., None] * (colour - image)


def jointed(
    image: np.ndarray, s: np.ndarray, t: np.ndarray, tile: tuple[float, float], joint: float
) -> np.ndarray:
    """Draws joints around tiles; s, t in [0, 1) within a tile, tile and joint in metres."""
    edge = np.minimum(np.minimum(s, 1 - s) * tile[0], np.minimum(t, 1 - t) * tile[1])
    shade = np.clip((edge - joint / 2) / (1.5 * joint), 0, 1)
    image = image * (0.86 + 0.14 * shade)[..., None]
    return mixed(image, JOINT, np.clip((joint / 2 - edge) / (0.3 * joint) + 0.5, 0, 1))


def metro_tiles(columns: int, rows: int, size: tuple[int, int]) -> np.ndarray:
    """White glazed tiles, 10 cm wide and 20 cm high, in columns shifted by half; it repeats."""
    tile = (0.1, 0.2)
    x, y = pixel_grid((columns * tile[0], rows * tile[1]), size)
    column = np.floor(x / tile[0]).astype(int)
    shifted = y / tile[1] + 0.5 * (column % 2)
    row = np.floor(shifted).astype(int) % rows
    tone = hash_noise(column, row)
    glaze = 0.95 + 0.06 * tone + 0.03 * (fractal_noise(x * 30 + 50 * tone, y * 12, 3) - 0.5)
    image = np.array([228.0, 226, 216]) * glaze[..., None]
    return jointed(image, x / tile[0] - column, shifted % 1, tile, 0.003)


def shower_tiles(extent: tuple[float, float], size: tuple[int, int], seed: int) -> np.ndarray:
    """Handmade 12 cm tiles in sea colours with a few coral and ochre ones."""
    tile = 0.12
    x, y = pixel_grid(extent, size)
    column, row = np.floor(x / tile).astype(int), np.floor(y / tile).astype(int)
    choice, tone = hash_noise(column + seed, row + 5), hash_noise(column + 31, row + seed)
    palette = np.array(
        [
            (24, 92, 104),
            (60, 142, 146),
            (140, 190, 182),
            (226, 228, 214),
            (216, 106, 78),
            (222, 170, 74),
        ],
        dtype=float,
    )
    index = np.searchsorted([0.38, 0.68, 0.86, 0.97, 0.985], choice)
    pool = fractal_noise(x * 22 + 60 * tone, y * 22 + 90 * tone, 3) - 0.5
    image = palette[index] * (0.88 + 0.24 * tone + 0.3 * pool)[..., None]
    return jointed(image, x / tile - column, y / tile - row, (tile, tile), 0.004)


def floor_tiles(count: tuple[int, int], size: tuple[int, int]) -> np.ndarray:
    """Cement tiles of 20 cm: a star of eight points, and quarter circles that join at corners."""
    tile = 0.2
    x, y = pixel_grid((count[0] * tile, count[1] * tile), size)
    column, row = np.floor(x / tile).astype(int), np.floor(y / tile).astype(int)
    s, t = x / tile - column, y / tile - row
    tone = hash_noise(column, row)
    u, v = np.abs(s - 0.5), np.abs(t - 0.5)
    pale, slate, blue = (
        np.array([218.0, 214, 202]),
        np.array([62.0, 76, 88]),
        np.array([122.0, 150, 162]),
    )

    def inside(distance: np.ndarray) -> np.ndarray:
        return np.clip(-distance * tile / 0.0016 + 0.5, 0, 1)

    image = np.broadcast_to(pale, (*x.shape, 3))
    corner = np.hypot(0.5 - u, 0.5 - v)
    image = mixed(image, blue, inside(corner - 0.27))
    image = mixed(image, pale, inside(corner - 0.21))
    image = mixed(image, slate, inside(corner - 0.13))
    star = np.minimum(np.maximum(u, v) - 0.17, (u + v) / np.sqrt(2) - 0.17)
    image = mixed(image, slate, inside(star))
    image = mixed(image, pale, inside(np.hypot(u, v) - 0.09))
    image = mixed(image, blue, inside(np.hypot(u, v) - 0.05))
    worn = 0.94 + 0.1 * tone + 0.16 * (fractal_noise(x * 9, y * 9, 4) - 0.5)
    return jointed(image * worn[..., None], s, t, (tile, tile), 0.003)


def towel_stripes(size: tuple[int, int]) -> np.ndarray:
    """Terry cloth with broad stripes across, for a towel whose image runs along its length."""
    x, y = pixel_grid((1.0, 1.0), size)
    ground, stripe = np.array([232.0, 222, 200]), np.array([214.0, 84, 62])
    bands = np.zeros_like(y)
    for low, high in (
        (0.05, 0.09),
        (0.11, 0.19),
        (0.21, 0.25),
        (0.75, 0.79),
        (0.81, 0.89),
        (0.91, 0.95),
    ):
        bands = np.maximum(bands, ((y > low) & (y < high)).astype(float))
    loops = 0.84 + 0.3 * (value_noise(x * 190, y * 260) - 0.5)
    return mixed(np.broadcast_to(ground, (*x.shape, 3)), stripe, bands) * loops[..., None]
