"""Procedural textures: noise that is the same on every machine, wood, and a JPEG writer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

BOARD_WIDTH, BOARD_LENGTH = 0.14, 1.7  # metres
WALNUT = np.array([150.0, 108.0, 74.0])  # sRGB
COLUMNS, ROWS = np.uint32(0x9E3779B1), np.uint32(0x85EBCA77)  # of `hash_noise`
BLOCK = 2**14


def hash_noise(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A number in [0, 1) for every pair of integers; the same on every machine."""
    return _mixed(x.astype(np.uint32) * COLUMNS ^ y.astype(np.uint32) * ROWS)


def _mixed(bits: np.ndarray) -> np.ndarray:
    """Numbers in [0, 1), all of whose digits depend on every bit; `bits` is overwritten."""
    bits ^= bits >> np.uint32(15)
    bits *= np.uint32(0x2C1B3C6D)
    bits ^= bits >> np.uint32(12)
    bits *= np.uint32(0x297A2D39)
    bits ^= bits >> np.uint32(15)
    return bits / 2.0**32


def value_noise(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Smoothly interpolated `hash_noise`, in [0, 1)."""
    shape = np.broadcast(x, y).shape
    x, y = (np.broadcast_to(values, shape).ravel() for values in (x, y))
    noise = np.empty(x.size)
    for start in range(0, x.size, BLOCK):
        block = slice(start, start + BLOCK)
        noise[block] = _interpolated(x[block], y[block])
    return noise.reshape(shape)


def _interpolated(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """`value_noise` of so few points that all of this stays in the processor's cache."""
    column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    s, t = x - column, y - row
    s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)
    left, lower = column.astype(np.uint32) * COLUMNS, row.astype(np.uint32) * ROWS
    right, upper = left + COLUMNS, lower + ROWS
    near = _mixed(left ^ lower) * (1 - s) + _mixed(right ^ lower) * s
    far = _mixed(left ^ upper) * (1 - s) + _mixed(right ^ upper) * s
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


def fractal_noise(x: np.ndarray, y: np.ndarray, octaves: int = 4) -> np.ndarray:
    """Octaves of `value_noise`, each of half the size and weight, in [0, 1)."""
    total, weight = np.zeros(np.broadcast(x, y).shape), 0.0
    for octave in range(octaves):
        total += value_noise(x * 2**octave + 17 * octave, y * 2**octave + 31 * octave) / 2**octave
        weight += 1 / 2**octave
    return total / weight


def pixel_grid(extent: tuple[float, float], size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates x and y [height, width] of pixel centres over `extent` metres; y points down."""
    x = (np.arange(size[0]) + 0.5) / size[0] * extent[0]
    y = (np.arange(size[1]) + 0.5) / size[1] * extent[1]
    return tuple(np.meshgrid(x, y))


def save_jpeg(path: Path, image: np.ndarray, *, shrink: int = 1, quality: int = 85) -> None:
    """Writes sRGB [height, width, 3] in 0 to 255, averaged over shrink x shrink pixels."""
    picture = Image.fromarray(np.clip(image, 0, 255).astype(np.uint8))
    size = (picture.width // shrink, picture.height // shrink)
    picture.resize(size, Image.Resampling.BOX).save(path, quality=quality)


def planed_wood(
    extent: tuple[float, float],
    size: tuple[int, int],
    colour: np.ndarray = WALNUT,
    board: float = 0.16,
) -> np.ndarray:
    """Glued boards with the grain along y, [height, width, 3] sRGB in 0 to 255.

    extent: metres along x and y; size: pixels along x and y; board: width in metres.
    """
    x, y = pixel_grid(extent, size)
    number = np.floor(x / board).astype(np.int64)
    tone = hash_noise(number, np.full_like(number, 11))
    bow = fractal_noise(x * 5 + 40 * tone, y * 0.8 + 90 * tone)
    rings = np.sin(2 * np.pi * (x * 14 + 7 * bow)) * np.sin(np.pi * bow)
    fibre = fractal_noise(x * 240 + 70 * tone, y * 6)
    pores = value_noise(x * 420, y * 22 + 30 * tone) > 0.86
    brightness = 0.86 + 0.2 * tone + 0.09 * rings + 0.26 * (fibre - 0.5) - 0.1 * pores
    warmth = 1 + np.array([0.0, 0.03, 0.05]) * rings[..., None]
    return colour * brightness[..., None] * warmth
