"""The chart table with its glass orb, and the cockpit light that shines through it.

Lengths are metres; table and orb stand about the y axis.
"""

from __future__ import annotations

import numpy as np
from modelling.furniture import Parts, rod
from modelling.meshes import Mesh, lathe, sphere, surface

TABLE_HEIGHT = 0.86
ORB_RADIUS, ORB_FLATNESS, ORB_HEIGHT = 0.26, 0.85, 1.2
LOBES, LOBE_DEPTH, LOBE_TWIST = 5, 0.045, 0.8
"""The orb's equator swells in lobes; depth as a part of the radius, twist in radians."""

LAMP = np.array([0.0, 1.96, -0.8])
LAMP_TILT = 45.7  # degrees from pointing down towards +z: at the orb


def chart_table() -> Parts:
    """A round table on a flared foot; a cradle on it carries the glass orb."""
    h = TABLE_HEIGHT
    top = [(0, h - 0.05), (0.73, h - 0.05), (0.738, h - 0.045), (0.738, h - 0.006)]
    top += [(0.732, h), (0.73, h), (0.2, h), (0, h)]
    rim = [(0.74, h - 0.07), (0.78, h - 0.065), (0.795, h - 0.03), (0.78, h + 0.004)]
    rim += [(0.755, h + 0.008), (0.742, h + 0.004), (0.742, h - 0.02)]
    foot = [(0, 0.07), (0.52, 0.07), (0.53, 0.075), (0.53, 0.11), (0.5, 0.13), (0.3, 0.2)]
    foot += [(0.22, 0.34), (0.2, 0.5), (0.24, 0.66), (0.4, 0.77), (0.6, 0.808), (0, 0.808)]
    dais = [(0, 0.0), (1.12, 0.0), (1.12, 0.05), (1.1, 0.068), (1.09, 0.069), (0, 0.069)]
    ring = [(0.56, h + 0.0006), (0.575, h + 0.0006), (0.575, h + 0.0012), (0.56, h + 0.0012)]
    return {
        "table": [lathe(top, 64)],
        "steel": [lathe(rim, 64), *cradle()],
        "plastic": [lathe(foot, 48), lathe(ring, 64)],
        "dais": [lathe(dais, 64)],
    }


def cradle() -> list[Mesh]:
    """Three legs and two rings below the orb."""
    turn = 2 * np.pi * np.arange(49) / 48
    rings = [
        np.column_stack([r * np.cos(turn), np.full(49, y), r * np.sin(turn)])
        for r, y in ((0.15, ORB_HEIGHT - 0.195), (0.25, TABLE_HEIGHT + 0.012))
    ]
    legs = [(rings[0][i], rings[1][i]) for i in (8, 24, 40)]
    return [closed_tube(ring, 0.009) for ring in rings] + [rod(a, b, 0.008) for a, b in legs]


def closed_tube(ring: np.ndarray, radius: float) -> Mesh:
    """A round bar along a horizontal circle [n, 3] about the y axis, first point repeated."""
    angle = 2 * np.pi * np.arange(9) / 8
    outward = ring * np.array([1, 0, 1])
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    side = np.cos(angle)[:, None, None] * outward + np.sin(angle)[:, None, None] * [0, 1, 0]
    points = ring + radius * side
    points[:, -1], points[-1] = points[:, 0], points[0]
    return surface(points)


def orb() -> Mesh:
    """A solid glass body like a flattened, lobed and twisted ball."""
    latitude, longitude = np.meshgrid(
        np.linspace(0, np.pi, 61), np.append(np.linspace(0, 2 * np.pi, 121)[:-1], 0), indexing="ij"
    )
    phase = LOBES * (longitude + LOBE_TWIST * (latitude / np.pi - 0.5))
    radius = ORB_RADIUS * (1 + LOBE_DEPTH * np.sin(latitude) ** 2 * np.cos(phase))
    flat = radius * np.sin(latitude)
    flat[[0, -1]] = 0
    height = -ORB_FLATNESS * radius * np.cos(latitude)
    points = np.stack([flat * np.cos(longitude), height, -flat * np.sin(longitude)], axis=-1)
    return surface(points).moved(0, ORB_HEIGHT)


def lamp_housing() -> Parts:
    """The cockpit light's hood, in which the emitting disk sits, and its arm."""
    hood = [(0.1, -0.1), (0.104, -0.1), (0.104, -0.098), (0.104, 0.07), (0.08, 0.1), (0, 0.1)]
    lining = [(0.0985, -0.1), (0.0985, 0.002), (0.0985, 0.004), (0, 0.004)]
    shades = [lathe(p, 32).rotated("x", -LAMP_TILT).moved(*LAMP) for p in (hood, lining[::-1])]
    knuckle = LAMP + np.array([0, 0.105, -0.105])
    arm = rod(tuple(knuckle), (0, 2.6, -0.98), 0.022)
    fins = [
        lathe([(0.104, y), (0.118, y), (0.118, y + 0.006), (0.104, y + 0.006)], 32)
        .rotated("x", -LAMP_TILT)
        .moved(*LAMP)
        for y in (-0.09, -0.03, 0.0, 0.03)
    ]
    return {"plastic": shades, "steel": [arm, sphere(0.04, 16).moved(*knuckle), *fins]}
