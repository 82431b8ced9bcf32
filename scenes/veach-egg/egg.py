"""The glass egg, its cup and the spotlight of Veach Egg. Lengths are metres."""

from __future__ import annotations

import numpy as np
from modelling.meshes import Mesh, lathe, tube

EGG_HEIGHT, EGG_RADIUS = 0.29, 0.106
EGG_BOTTOM = 0.012
"""Height of the egg's lowest point in its cup."""
CUP_RIM = 0.036
GAP = 0.0015
"""Between the glass and the cup."""

HEAD_HEIGHT = 1.65
"""Of the bulb's centre above the floor."""


def egg_outline(count: int) -> np.ndarray:
    """(radius, height) [count, 2] from the blunt bottom to the pointed top."""
    angle = np.linspace(0, np.pi, count)
    radius = EGG_RADIUS * np.sin(angle) * (1 + 0.14 * np.cos(angle)) / 1.01
    radius[[0, -1]] = 0
    return np.stack([radius, EGG_BOTTOM + EGG_HEIGHT * (1 - np.cos(angle)) / 2], axis=1)


def egg() -> Mesh:
    return lathe([tuple(point) for point in egg_outline(65)], 96)


def cup() -> Mesh:
    """A footed cup about the y axis, whose inside follows the egg."""
    shape = egg_outline(200)
    tangent = np.gradient(shape, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    inside = shape + GAP * np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    inside = inside[inside[:, 1] < CUP_RIM]
    inside[0] = 0, EGG_BOTTOM - GAP
    rim = inside[-1]
    foot = [(0, 0), (0.056, 0), (0.0585, 0.001), (0.06, 0.004), (0.055, 0.009), (0.055, 0.013)]
    lip = rim + np.array([(0.0075, -0.008), (0.0055, -0.001), (0.003, 0.0015)])
    profile = [*foot, (0.061, 0.019), *lip, *inside[::-8], inside[0]]
    return lathe([(float(r), float(h)) for r, h in profile], 64)


def aimed(mesh: Mesh, direction: np.ndarray) -> Mesh:
    """Turned so that +y comes to point along a direction."""
    x, y, z = direction / np.linalg.norm(direction)
    return mesh.rotated("x", np.degrees(np.arccos(y))).rotated("y", np.degrees(np.arctan2(x, z)))


def spotlight(direction: np.ndarray) -> tuple[list[Mesh], list[Mesh]]:
    """Outside and inside of a lamp on a stand; the bulb's centre is (0, HEAD_HEIGHT, 0)."""
    shell = [
        (0, -0.1),
        (0.02, -0.098),
        (0.04, -0.085),
        (0.055, -0.05),
        (0.06, -0.02),
        (0.074, 0.03),
    ]
    shell += [(0.09, 0.115), (0.094, 0.118), (0.094, 0.126), (0.09, 0.128), (0.087, 0.126)]
    lining = [(0.087, 0.126), (0.071, 0.03), (0.057, -0.012), (0.04, -0.022), (0, -0.024)]
    head, reflector = lathe(shell, 48), lathe(lining, 48)
    flat = np.array([direction[0], 0, direction[2]]) / np.hypot(direction[0], direction[2])
    foot = -0.05 * flat
    neck = foot + np.array([-0.1 * foot, [0, -0.05, 0], [0, 0.02 - HEAD_HEIGHT + 0.04, 0]])
    neck[:, 1] += HEAD_HEIGHT - 0.04
    base = [
        (0, 0.002),
        (0.13, 0.002),
        (0.135, 0.006),
        (0.13, 0.014),
        (0.05, 0.02),
        (0.016, 0.034),
        (0, 0.035),
    ]
    collar = [(0, 0), (0.014, 0), (0.015, 0.004), (0.015, 0.046), (0.014, 0.05), (0, 0.05)]
    stand = [tube(neck, np.array([0.009, 0.009, 0.011])), lathe(base, 48).moved(*foot)]
    stand.append(lathe(collar, 24).moved(foot[0], 0.72, foot[2]))
    shells = [aimed(part, direction).moved(y=HEAD_HEIGHT) for part in (head, reflector)]
    return [shells[0], *stand], [shells[1]]
