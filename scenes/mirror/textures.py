"""Procedural textures: floor boards and three painted landscapes."""

from __future__ import annotations

import numpy as np

BOARD_WIDTH, BOARD_LENGTH = 0.14, 1.7  # metres
WALNUT = np.array([150.0, 108.0, 74.0])  # sRGB

PALETTES = (  # sRGB: sky above, sky at the horizon, far hills, near hills, sun
    ((92, 138, 170), (246, 208, 160), (120, 128, 150), (40, 66, 76), (255, 240, 205)),
    ((214, 120, 84), (250, 214, 150), (176, 96, 92), (84, 44, 62), (255, 236, 190)),
    ((120, 170, 160), (240, 232, 196), (110, 150, 120), (44, 84, 62), (250, 250, 230)),
)


def hash_noise(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A number in [0, 1) for every pair of integers; the same on every machine."""
    bits = x.astype(np.uint32) * np.uint32(0x9E3779B1) ^ y.astype(np.uint32) * np.uint32(0x85EBCA77)
    bits = (bits ^ bits >> np.uint32(15)) * np.uint32(0x2C1B3C6D)
    bits = (bits ^ bits >> np.uint32(12)) * np.uint32(0x297A2D39)
    return (bits ^ bits >> np.uint32(15)).astype(np.float64) / 2.0**32


def value_noise(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Smoothly interpolated `hash_noise`, in [0, 1)."""
    column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    s, t = x - column, y - row
    s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)
    near = hash_noise(column, row) * (1 - s) + hash_noise(column + 1, row) * s
    far = hash_noise(column, row + 1) * (1 - s) + hash_noise(column + 1, row + 1) * s
    return near * (1 - t) + far * t


def floor_boards(extent: tuple[float, float], size: tuple[int, int]) -> np.ndarray:
    """Boards along y with staggered joints over `extent` metres, [height, width, 3] uint8 sRGB.

    extent: metres along x and y; size: pixels along x and y.
    """
    x = (np.arange(size[0]) + 0.5) / size[0] * extent[0] / BOARD_WIDTH
    y = (np.arange(size[1]) + 0.5) / size[1] * extent[1] / BOARD_LENGTH
    x, y = np.meshgrid(x, y)
    row = np.floor(x).astype(np.int64)
    y = y + 10 + hash_noise(row, np.full_like(row, 7))
    board = np.floor(y).astype(np.int64)
    across, along = x - row, y - board

    tone = hash_noise(row, board)
    figure = value_noise(along * 9 + 60 * tone, across * 4 + 40 * tone)
    grain = value_noise(along * 24 + 60 * tone, across * 16 + 90 * tone)
    brightness = 0.84 + 0.22 * tone + 0.16 * (figure - 0.5) + 0.10 * (grain - 0.5)
    edge = np.minimum(
        np.minimum(across, 1 - across) * BOARD_WIDTH, np.minimum(along, 1 - along) * BOARD_LENGTH
    )
    brightness = brightness * np.where(edge < 0.004, 0.6, 1.0)
    return np.clip(WALNUT * brightness[..., None], 0, 255).astype(np.uint8)


def landscape(index: int, size: int) -> np.ndarray:
    """A sky with a low sun over five ranges of hills, [size, size, 3] uint8 sRGB."""
    zenith, horizon, far, near, sun = (np.array(c, dtype=float) for c in PALETTES[index])
    x, y = np.meshgrid((np.arange(size) + 0.5) / size, (np.arange(size) + 0.5) / size)
    height = np.clip((0.62 - y) / 0.62, 0, 1)[..., None]
    image = horizon * (1 - height) + zenith * height
    image += 10 * (value_noise(x * 5 + 9 * index, y * 22) - 0.5)[..., None]
    distance = np.hypot(x - (0.32, 0.6, 0.7)[index], y - 0.36)
    image = np.where((distance < 0.085)[..., None], sun, image)
    for layer in range(5):
        nearness = layer / 4
        scale = 2.2 + 0.7 * layer
        ridge = value_noise(x * scale + 17 * layer + 5 * index, np.full_like(x, 3.5 + layer))
        ridge = ridge + 0.25 * value_noise(x * 4 * scale + 3 * layer, np.full_like(x, 0.5 + index))
        hill = far * (1 - nearness) + near * nearness
        strokes = 14 * (value_noise(x * 30 + 40 * ridge, y * 60 + layer) - 0.5)[..., None]
        image = np.where(
            (y > 0.5 + 0.1 * layer - 0.17 * (ridge - 0.5))[..., None], hill + strokes, image
        )
    return np.clip(image, 0, 255).astype(np.uint8)
