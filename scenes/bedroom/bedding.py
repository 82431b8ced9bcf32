"""The bed and what lies on it: mattress, draped covers, pillows, headboard. It faces +z.

The mattress is 1.6 m by 2 m, about x = 0, from z = 0 (headboard) to z = 2; its top is at y = TOP.
"""

from __future__ import annotations

import numpy as np
from modelling.furniture import Parts
from modelling.meshes import Mesh, box, rounded_box, surface
from modelling.textures import fractal_noise

HALF_WIDTH, LENGTH, TOP = 0.8, 2.0, 0.54
KNIT = 0.25  # metres of cloth that the image of the knit covers


def draped(
    across: tuple[float, float], along: tuple[float, float], lift: float, counts: tuple[int, int]
) -> Mesh:
    """A cover over the mattress, hanging down at its sides and foot.

    across, along: extent of the cloth in metres, measured on the cloth, x from the middle and z
    from the head; lift: distance from the mattress; counts: points across and along.
    """
    u, v = np.meshgrid(np.linspace(*across, counts[0]), np.linspace(*along, counts[1]))
    x, z = np.clip(u, -HALF_WIDTH, HALF_WIDTH), np.minimum(v, LENGTH)
    over_x, over_z = u - x, v - z
    over = np.hypot(over_x, over_z)
    turn = over / np.maximum(over, 1e-9)
    side_x, side_z = over_x / np.maximum(over, 1e-9), over_z / np.maximum(over, 1e-9)

    bend = 0.06  # radius of the edge it bends around
    angle = np.minimum(over / bend, np.pi / 2)
    out = bend * np.sin(angle) + turn * lift
    down = bend * (1 - np.cos(angle)) + np.maximum(over - bend * np.pi / 2, 0)
    corner = np.minimum(np.abs(over_x), np.abs(over_z))  # the cloth is doubled there: it falls wide
    around = 7 * (x + z) + 9 * np.arctan2(over_x, over_z)
    folds = 0.012 * np.sin(2.2 * around) + 0.009 * np.sin(3.7 * around + 1.3)
    out = out + np.clip(down / 0.2, 0, 1) * (0.022 + folds + 0.18 * corner)

    soft = fractal_noise(u * 2.3 + 40, v * 2.3 + 7, 3) - 0.5
    creases = np.abs(fractal_noise(u * 3.1 + v + 11, v * 2.2 - 0.6 * u + 23, 3) - 0.5)
    plump = 0.07 * soft - 0.11 * np.maximum(0.07 - creases, 0)
    y = TOP + 0.035 + lift + (1 - turn) * lift + plump * np.exp(-4 * down) - down
    cloth = surface(np.stack([-(x + side_x * out), y, z + side_z * out], axis=-1))
    texture = np.stack([u, v], axis=-1).reshape(-1, 2) / KNIT
    return Mesh(cloth.vertices, cloth.faces, cloth.normals, texture)


def pillow(width: float, height: float, thickness: float) -> Mesh:
    """A pillow standing on its long side about the origin, facing +z."""
    u, v = np.meshgrid(np.linspace(-1, 1, 25), np.linspace(-1, 1, 17))
    pinch_x = 1 - 0.06 * (1 - v**2) * np.abs(u) ** 5
    pinch_y = 1 - 0.10 * (1 - u**2) * np.abs(v) ** 5
    x, y = u * width / 2 * pinch_x, v * height / 2 * pinch_y
    z = thickness / 2 * ((1 - u**6) * (1 - v**4)) ** 0.45
    wrinkles = 1 + 0.22 * (fractal_noise(u * 2 + width * 31, v * 2 + 5, 3) - 0.5)
    front, back = (surface(np.stack([s * x, y, s * z * wrinkles], axis=-1)) for s in (1, -1))
    count = len(front.vertices)
    return Mesh(
        np.concatenate([front.vertices, back.vertices]),
        np.concatenate([front.faces, back.faces + count]),
        np.concatenate([front.normals, back.normals]),
    )


def headboard(width: float, bottom: float, top: float, channels: int) -> Mesh:
    """Upholstery in upright channels, a relief before the plane z = 0, open at the back."""
    u, v = np.meshgrid(np.linspace(0, 1, 10 * channels + 1), np.linspace(0, 1, 25))
    bulge = np.abs(np.sin(np.pi * channels * u)) ** 0.6
    rim = np.minimum(1, 12 * np.minimum(v, 1 - v)) ** 0.5
    depth = rim * (0.05 + 0.035 * bulge) * np.minimum(1, 60 * np.minimum(u, 1 - u)) ** 0.5
    return surface(np.stack([(u - 0.5) * width, bottom + v * (top - bottom), depth], axis=-1))


def bed() -> Parts:
    mattress = rounded_box((-0.79, 0.3, 0.02), (0.79, TOP, LENGTH - 0.01), 0.05)
    frame = [box((-0.83, 0.14, 0.0), (0.83, 0.29, LENGTH))]
    frame += [
        box((x - 0.03, 0, z - 0.03), (x + 0.03, 0.14, z + 0.03))
        for x in (-0.7, 0.7)
        for z in (1.9,)
    ]
    back = [
        pillow(0.74, 0.5, 0.2).rotated("x", -24).moved(x, TOP + 0.23, 0.24) for x in (-0.39, 0.39)
    ]
    front = [
        pillow(0.66, 0.44, 0.2).rotated("x", -34).moved(x, TOP + 0.21, 0.43) for x in (-0.41, 0.38)
    ]
    accent = pillow(0.5, 0.32, 0.15).rotated("x", -40).rotated("y", 5).moved(-0.04, TOP + 0.2, 0.6)
    return {
        "walnut": frame,
        "linen": [mattress, draped((-1.1, 1.1), (0.55, 2.3), 0.004, (84, 68)), *front],
        "blush": [draped((-1.04, 1.04), (0.5, 0.86), 0.018, (72, 14)), *back],
        "throw": [draped((-1.16, 1.16), (1.38, 1.92), 0.016, (84, 22))],
        "velvet": [headboard(1.76, 0.18, 1.18, 11).moved(0, 0, -0.13), accent],
    }
