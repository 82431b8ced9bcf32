"""Pictures of the bedroom: woven carpet, wallpaper, knitted throw, print, and the sky outside."""

from __future__ import annotations

import numpy as np
from modelling.textures import fractal_noise, hash_noise, pixel_grid, value_noise

CREAM, RUST, INDIGO = (
    np.array([206.0, 192, 166]),
    np.array([166.0, 76, 48]),
    np.array([46.0, 62, 92]),
)

WINDOW_ANGLE = 1.5 * np.pi  # where -x lies in the panorama


def mixed(base: np.ndarray, colour: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """A picture [..., 3] with as much of a colour [3] as the weight [...] in [0, 1] says."""
    return base + weight[..., None] * (colour - base)


def carpet(extent: tuple[float, float], size: tuple[int, int]) -> np.ndarray:
    """A flat weave of diamonds with a striped border, sRGB [height, width, 3].

    Every knot is a cell of 1.2 cm by 0.8 cm: the diamonds have steps, and the weft shades it.
    """
    x, y = pixel_grid(extent, size)
    knot_x, knot_y = 0.012, 0.008
    column, row = np.floor(x / knot_x), np.floor(y / knot_y)
    across, along = x / knot_x - column, y / knot_y - row
    cx, cy = (column + 0.5) * knot_x, (row + 0.5) * knot_y

    cell = 0.4
    u, v = np.abs(cx / cell % 1 - 0.5), np.abs(cy / (1.25 * cell) % 1 - 0.5)
    distance = u + v  # 0 in the middle of a diamond, 0.5 on its edge
    image = np.broadcast_to(CREAM, (*x.shape, 3))
    for low, high, colour in (
        (0.44, 0.53, INDIGO),
        (0.3, 0.36, RUST),
        (0.16, 0.2, INDIGO),
        (0, 0.09, RUST),
    ):
        image = mixed(image, colour, ((distance >= low) & (distance < high)).astype(float))
    edge = np.minimum(np.minimum(cx, extent[0] - cx), np.minimum(cy, extent[1] - cy))
    for low, high, colour in (
        (0, 0.2, CREAM),
        (0.015, 0.06, INDIGO),
        (0.085, 0.105, RUST),
        (0.17, 0.2, INDIGO),
    ):
        image = mixed(image, np.array(colour), ((edge >= low) & (edge < high)).astype(float))
    zigzag = np.abs((cx + cy) / 0.06 % 1 - 0.5) < 0.17
    image = mixed(image, RUST, (zigzag & (edge >= 0.115) & (edge < 0.16)).astype(float))

    thread = np.sin(np.pi * along) ** 0.7 * (0.72 + 0.28 * np.sin(np.pi * across) ** 0.5)
    worn = 0.12 * (fractal_noise(x * 3, y * 3, 3) - 0.5)
    dye = 0.22 * (hash_noise(column.astype(int), row.astype(int)) - 0.5)
    return image * (0.55 + 0.5 * thread + worn + dye)[..., None]


def wallpaper(extent: tuple[float, float], size: tuple[int, int]) -> np.ndarray:
    """Twigs with pairs of leaves in staggered rows over a dusty green, [height, width, 3]."""
    x, y = pixel_grid(extent, size)
    ground, pale, gold = (
        np.array([150.0, 170, 158]),
        np.array([190.0, 202, 182]),
        np.array([196.0, 170, 118]),
    )
    image = ground * (1 + 0.08 * (fractal_noise(x * 40, y * 7) - 0.5))[..., None]
    pitch, rise = 0.24, 0.4
    column = np.floor(x / pitch)
    s = x - (column + 0.5) * pitch
    t = (y + rise / 2 * (column % 2)) % rise
    stem = s - 0.018 * np.sin(2 * np.pi * t / rise)
    image = mixed(image, gold, np.clip(1.6 - np.abs(stem) / 0.0022, 0, 1))
    for i in range(6):
        side = 1 if i % 2 else -1
        centre_t = rise * (i + 0.5) / 6
        root = 0.018 * np.sin(2 * np.pi * centre_t / rise)
        a, b = side * (s - root), centre_t - t
        along, across = 0.8 * a + 0.6 * b, -0.6 * a + 0.8 * b
        u = along / 0.085
        half = 0.021 * np.sqrt(np.clip(u * (1 - u) * 4, 0, 1)) * (1.25 - 0.6 * u)
        inside = np.clip((half - np.abs(across)) / 0.0015 + 0.5, 0, 1) * ((u > 0) & (u < 1))
        vein = np.clip(1 - np.abs(across) / 0.0012, 0, 1) * inside
        image = mixed(mixed(image, pale, 0.9 * inside), ground, 0.8 * vein)
    berry = np.hypot(s, t - rise / 2)
    return mixed(image, gold, np.clip((0.009 - berry) / 0.0015 + 0.5, 0, 1))


def knit(size: int) -> np.ndarray:
    """Cable rows of stitches, repeating, [size, size, 3]; to be laid over 0.25 m."""
    x, y = pixel_grid((16.0, 16.0), (size, size))
    column = np.floor(x)
    s, t = x - column - 0.5, (y + 0.35 * np.abs(2 * (x - column) - 1)) % 1
    yarn = np.sin(np.pi * t) ** 0.6 * (1 - 1.5 * s**2)
    rib = 0.12 * (column % 4 == 0)
    fluff = 0.14 * (value_noise(x * 9 % 144, y * 9 % 144) - 0.5)
    return np.array([196.0, 142, 62]) * (0.5 + 0.52 * yarn - rib + fluff)[..., None]


def abstract_print(index: int, size: tuple[int, int]) -> np.ndarray:
    """An arched sun above hills, on paper with a wide margin, [height, width, 3]."""
    x, y = pixel_grid((1.0, size[1] / size[0]), size)
    tall = size[1] / size[0]
    paper = np.array([236.0, 230, 216])
    image = paper * (1 + 0.03 * (fractal_noise(x * 90, y * 90, 2) - 0.5))[..., None]
    palettes = (
        ((206, 120, 72), (58, 84, 96), (226, 176, 96), (150, 70, 50)),
        ((94, 128, 124), (196, 140, 60), (232, 206, 170), (46, 62, 84)),
    )
    sun, far, near, last = (np.array(c, dtype=float) for c in palettes[index])
    disc = np.hypot(x - 0.5 - 0.12 * (index - 0.5), y - 0.38 * tall)
    image = mixed(image, sun, np.clip((0.2 - disc) / 0.004 + 0.5, 0, 1))
    for i, colour in enumerate((far, near, last)):
        wave = 0.07 * np.sin(2 * np.pi * (x * (0.7 + 0.25 * i) + 0.31 * i + 0.4 * index))
        ridge = tall * (0.56 + 0.12 * i) + wave
        grain = colour * (1 + 0.2 * (fractal_noise(x * 30 + 9 * i, y * 60, 3) - 0.5))[..., None]
        weight = np.clip((y - ridge) / 0.004 + 0.5, 0, 1)
        image = image + weight[..., None] * (grain - image)
    border = np.minimum(np.minimum(x, 1 - x), np.minimum(y, tall - y))
    return np.where((border < 0.12)[..., None], paper, image)


def panorama(size: tuple[int, int]) -> np.ndarray:
    """Blue sky with thin clouds above wooded hills and meadows, [height, width, 3]; it closes.

    Only the half that the window faces is lit, so that the renderer draws no samples in vain.
    """
    angle, v = pixel_grid((2 * np.pi, 1.0), size)
    elevation = 90 - 180 * v
    up = np.clip(elevation / 90, 0, 1)[..., None]
    ring_x, ring_y = 40 + 9 * np.cos(angle), 40 + 9 * np.sin(angle)
    sky = (
        np.array([196.0, 216, 234])
        + (np.array([84.0, 140, 214]) - np.array([196, 216, 234])) * up**0.45
    )
    spread = 1 / np.maximum(np.sin(np.radians(np.maximum(elevation, 4))), 0.07)
    veil = fractal_noise(50 + 2 * spread * np.cos(angle), 50 + 2 * spread * np.sin(angle), 5)
    sky = mixed(sky, np.array([250.0, 250, 248]), np.clip((veil - 0.48) * 3.2, 0, 0.85))
    image = sky
    hills = ((9, 1.2, (150, 172, 186)), (5.5, 2.0, (112, 140, 128)), (2.5, 3.5, (74, 104, 70)))
    for crest, scale, colour in hills:
        ridge = crest * (fractal_noise(ring_x * scale, ring_y * scale, 4) - 0.12)
        image = mixed(
            image, np.array(colour, float), np.clip((ridge - elevation) * 1.5 + 0.5, 0, 1)
        )
    meadow = (
        np.array([120.0, 132, 84])
        * (0.85 + 0.3 * fractal_noise(ring_x * 3, elevation, 4))[..., None]
    )
    image = image + np.clip(-elevation / 2 - 0.3, 0, 1)[..., None] * (meadow - image)
    return np.where((np.abs(angle - WINDOW_ANGLE) < np.pi / 2)[..., None], image, 0)
