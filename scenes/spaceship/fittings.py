"""What stands on the bridge: seats, and things on the consoles.

Pieces are sorted by material and stand on the floor about the origin; lengths are metres.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from hull import DESK, LINTEL, SILL, WINDOWS, between, on_panel, on_panels, quad, wall_points
from modelling.furniture import Parts, merged, placed, rod
from modelling.meshes import Mesh, box, lathe, rounded_box, sphere
from modelling.textures import hash_noise


def seat() -> Parts:
    """A pilot's seat that faces -z: padded cushions in a hard shell, on a pedestal."""
    cushion = partial(rounded_box, segments=3)
    back = [
        cushion((-0.2, 0.0, -0.06), (0.2, 0.34, 0.03), 0.03).moved(0, 0.06),
        cushion((-0.2, 0.35, -0.055), (0.2, 0.56, 0.03), 0.03).moved(0, 0.06),
        cushion((-0.27, 0.08, -0.12), (-0.195, 0.56, 0.02), 0.03),
        cushion((0.195, 0.08, -0.12), (0.27, 0.56, 0.02), 0.03),
        cushion((-0.14, 0.66, -0.075), (0.14, 0.84, 0.02), 0.035),
    ]
    shell = [
        cushion((-0.26, 0.0, 0.032), (0.26, 0.62, 0.07), 0.018),
        cushion((-0.11, 0.6, 0.03), (0.11, 0.82, 0.06), 0.014),
        cushion((-0.18, 0.12, 0.0705), (0.18, 0.5, 0.095), 0.012),
    ]
    leather = [mesh.rotated("x", 9).moved(0, 0.5, 0.24) for mesh in back] + [
        cushion((-0.2, 0.44, -0.28), (0.2, 0.54, 0.2), 0.04),
        cushion((-0.275, 0.45, -0.27), (-0.202, 0.575, 0.2), 0.032),
        cushion((0.202, 0.45, -0.27), (0.275, 0.575, 0.2), 0.032),
        cushion((-0.36, 0.7, -0.2), (-0.29, 0.745, 0.16), 0.02),
        cushion((0.29, 0.7, -0.2), (0.36, 0.745, 0.16), 0.02),
    ]
    hard = [mesh.rotated("x", 9).moved(0, 0.5, 0.24) for mesh in shell]
    hard += [cushion((-0.27, 0.4, -0.27), (0.27, 0.438, 0.27), 0.018)]
    arms = [rod((x, 0.42, 0.1), (x, 0.705, 0.04), 0.018) for x in (-0.325, 0.325)]
    arms += [rod((x, 0.42, 0.1), (0.8 * x, 0.42, 0.1), 0.018) for x in (-0.325, 0.325)]
    column = [(0, 0.003), (0.27, 0.003), (0.27, 0.03), (0.1, 0.06), (0.06, 0.1), (0.06, 0.32)]
    column += [(0.14, 0.38), (0.14, 0.4), (0, 0.4)]
    return {"leather": leather, "shell": hard, "steel": [*arms, lathe(column, 28)]}


def seats() -> Parts:
    pilots = [placed(seat(), x, 0, -1.72, turn) for x, turn in ((-0.82, 4), (0.82, -4))]
    return merged(*pilots, placed(seat(), -1.62, 0, 0.3, 82), placed(seat(), 1.62, 0, 0.1, -97))


SCREENS = ((0, 0.42, 4), (0, 0.72, 3), (1, 0.3, 5), (1, 0.72, 1), (2, 0.2, 0), (2, 0.5, 7))
SCREENS += ((2, 0.8, 2), (3, 0.28, 6), (3, 0.7, 4), (4, 0.28, 5), (4, 0.58, 1))
"""Displays in the consoles: side of the desk, place along it, number of the image."""


def tile(number: int) -> np.ndarray:
    """Texture coordinates of a display's corners, from the lower left counter-clockwise."""
    left, top = number % 4 / 4, number // 4 / 2
    return np.array([(left, top + 0.5), (left + 0.25, top + 0.5), (left + 0.25, top), (left, top)])


def screens() -> list[Mesh]:
    """Displays that glow: in the consoles and on the side walls."""
    glowing = []
    for side, along, number in SCREENS:
        half = 0.16 / np.linalg.norm(DESK[side + 1] - DESK[side])
        corners = [(-half, 0.18), (half, 0.18), (half, 0.88), (-half, 0.88)]
        points = [on_panel(side, along + a, slope, 0.006) for a, slope in corners]
        glowing.append(quad(np.array(points), tile(number)))
    for side, bays in (
        (1, ((0.4, 0.66, 6), (0.74, 0.95, 7))),
        (5, ((0.05, 0.32, 3), (0.4, 0.66, 0))),
    ):
        low, high = wall_points(SILL + 0.22, 0.05), wall_points(LINTEL - 0.22, 0.05)
        for a, b, number in bays:
            points = [
                between(ring, side, t) for ring, t in ((low, a), (low, b), (high, b), (high, a))
            ]
            glowing.append(quad(np.array(points), tile(number)))
    return glowing


def screen_frames() -> list[Mesh]:
    """Bezels of the displays in the consoles, and backs of those on the walls."""
    bezels = []
    for side, along, _ in SCREENS:
        for part in (
            box((-0.185, 0, -0.17), (0.185, 0.012, -0.162)),
            box((-0.185, 0, 0.147), (0.185, 0.012, 0.155)),
            box((-0.185, 0, -0.162), (-0.165, 0.012, 0.147)),
            box((0.165, 0, -0.162), (0.185, 0.012, 0.147)),
        ):
            bezels.append(on_panels(part, side, along, 0.53, 0.0005))
    return bezels


def controls() -> Parts:
    """Keys, knobs and levers between the displays."""
    parts: Parts = {"red_key": [], "amber_key": [], "pale_key": [], "steel": []}
    kinds = ("pale_key", "pale_key", "amber_key", "red_key", "pale_key")
    bays = [(0, 0.24), (0, 0.57), (0, 0.87), (1, 0.5), (1, 0.11), (1, 0.9), (2, 0.35), (2, 0.65)]
    bays += [(2, 0.06), (2, 0.94), (3, 0.49), (3, 0.1), (3, 0.9), (4, 0.12), (4, 0.43), (4, 0.75)]
    for bay, (side, along) in enumerate(bays):
        for row in range(4):
            for column in range(5):
                chance = hash_noise(np.array([5 * row + column]), np.array([bay]))[0]
                if chance < 0.18:
                    continue
                key = box((-0.014, 0, -0.01), (0.014, 0.012, 0.01))
                key = key.moved(0.042 * (column - 2), 0, 0.035 * (row - 0.5))
                kind = kinds[int(chance * 997) % 5]
                parts[kind].append(on_panels(key, side, along, 0.45, 0.001))
        knob = lathe([(0, 0), (0.022, 0), (0.018, 0.022), (0, 0.024)], 12)
        for x in (-0.06, 0.0, 0.06):
            parts["steel"].append(on_panels(knob.moved(x, 0, -0.1), side, along, 0.45, 0.001))
    for along in (0.28, 0.72):
        stick = [
            rod((0, 0, 0), (0, 0.13, -0.02), 0.012, 0.009),
            sphere(0.026, 14).moved(0, 0.15, -0.024),
        ]
        parts["steel"].append(on_panels(stick[0], 2, along, 0.12, 0.001))
        parts["red_key"].append(on_panels(stick[1], 2, along, 0.12, 0.001))
    return parts


def window_rail() -> list[Mesh]:
    """A grab rail below the windows and pipes along the ceiling's edge."""
    rail = wall_points(SILL + 0.07, 0.1)
    bars = [rod(rail[side], rail[side + 1], 0.016) for side in WINDOWS]
    for height, distance, radius in ((2.46, 0.06, 0.035), (2.38, 0.07, 0.022)):
        ring = wall_points(height, distance)
        bars += [rod(ring[s], ring[(s + 1) % len(ring)], radius) for s in range(len(ring))]
    return bars
