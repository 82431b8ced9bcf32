"""Three painted landscapes, for the wall opposite the mirror."""

from __future__ import annotations

import numpy as np
from modelling.textures import value_noise

PALETTES = (  # sRGB: sky above, sky at the horizon, far hills, near hills, sun
    ((92, 138, 170), (246, 208, 160), (120, 128, 150), (40, 66, 76), (255, 240, 205)),
    ((214, 120, 84), (250, 214, 150), (176, 96, 92), (84, 44, 62), (255, 236, 190)),
    ((120, 170, 160), (240, 232, 196), (110, 150, 120), (44, 84, 62), (250, 250, 230)),
)


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
