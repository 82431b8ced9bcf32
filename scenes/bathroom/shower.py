"""The shower in its corner: frosted panels, chrome, and the coloured things behind the glass.

Given in the room's coordinates: x from LEFT to SIDE, z from BACK to FRONT.
"""

from __future__ import annotations

import numpy as np
from modelling.furniture import Parts, rod, smooth_bar
from modelling.meshes import Mesh, box, lathe, rounded_box, sphere, surface
from modelling.ornaments import rounded_profile

LEFT, SIDE, BACK, FRONT = -1.7, 0.1, -1.8, -0.85
BOTTOM, TOP, GLASS = 0.11, 2.06, 0.004  # glass: half its thickness
MIDDLE = -0.78  # where fixed panel and door meet

BOTTLES = (  # material, x, height, radius
    ("red", -0.62, 0.24, 0.034),
    ("yellow", -0.5, 0.18, 0.042),
    ("blue", -0.38, 0.27, 0.036),
    ("green", -0.26, 0.16, 0.04),
    ("red", -0.15, 0.2, 0.03),
)


def panels() -> list[Mesh]:
    """Three slabs of glass: a fixed panel and the door in front, one at the side."""
    low, high = BOTTOM + 0.03, TOP - 0.03
    return [
        box((LEFT + 0.025, low, FRONT - GLASS), (MIDDLE - 0.012, high, FRONT + GLASS)),
        box((MIDDLE + 0.012, low, FRONT - GLASS), (SIDE - 0.02, high, FRONT + GLASS)),
        box((SIDE - GLASS, low, BACK + 0.025), (SIDE + GLASS, high, FRONT - 0.02)),
    ]


def frame() -> list[Mesh]:
    """Posts and rails around the panels, and the door's handle."""
    bars, w = [], 0.012
    for low, high in ((BOTTOM, BOTTOM + 0.026), (TOP - 0.026, TOP)):
        bars.append(box((LEFT + 0.001, low, FRONT - w), (SIDE + w, high, FRONT + w)))
        bars.append(box((SIDE - w, low, BACK + 0.001), (SIDE + w, high, FRONT - w)))
    low, high = BOTTOM + 0.026, TOP - 0.026
    for x in (LEFT + 0.012, SIDE):
        bars.append(box((x - w + 0.001, low, FRONT - w), (x + w, high, FRONT + w)))
    bars.append(box((SIDE - w, low, BACK + 0.001), (SIDE + w, high, BACK + 0.023)))
    bars.append(box((MIDDLE - 0.008, low, FRONT - w), (MIDDLE + 0.008, high, FRONT + w)))
    handle = [rod((-0.04, 0.95, FRONT + 0.045), (-0.04, 1.35, FRONT + 0.045), 0.011, segments=14)]
    handle += [rod((-0.04, y, FRONT + GLASS), (-0.04, y, FRONT + 0.045), 0.008) for y in (1.0, 1.3)]
    return bars + handle


def fittings() -> list[Mesh]:
    """Mixer, riser, rain head and hand shower on the back wall, and the bottles' shelf."""
    x, z = -0.86, BACK + 0.07
    arm = [(x, 1.95, z), (x, 2.1, z), (x, 2.16, z + 0.06), (x, 2.16, z + 0.3), (x, 2.14, z + 0.36)]
    head = lathe([(0, 0), (0.12, 0), (0.125, 0.006), (0.12, 0.013), (0.02, 0.02), (0, 0.03)], 40)
    hose = [
        (x, 1.04, z),
        (x + 0.02, 0.85, z + 0.03),
        (x + 0.12, 0.78, z + 0.04),
        (x + 0.16, 1.0, z + 0.03),
        (x + 0.12, 1.45, z + 0.02),
    ]
    return [
        rod((x, 1.08, z), (x, 1.98, z), 0.012, segments=14),
        smooth_bar(arm, 0.012, 8),
        head.moved(x, 2.11, z + 0.37),
        rod((x - 0.15, 1.08, z), (x + 0.15, 1.08, z), 0.026, segments=18),
        *(rod((x + s * 0.08, 1.08, BACK + 0.002), (x + s * 0.08, 1.08, z), 0.02) for s in (-1, 1)),
        smooth_bar(hose, 0.007, 8),
        rod((x + 0.12, 1.45, z + 0.02), (x + 0.12, 1.62, z + 0.06), 0.014, 0.012, segments=12),
        lathe([(0, 0), (0.045, 0), (0.05, 0.01), (0.02, 0.03), (0, 0.032)], 24)
        .rotated("x", 70)
        .moved(x + 0.12, 1.64, z + 0.075),
        rod((-1.55, 1.72, z), (-1.05, 1.72, z), 0.01, segments=12),
        *(rod((x_, 1.72, BACK + 0.002), (x_, 1.72, z), 0.008) for x_ in (-1.53, -1.07)),
    ]


def bottle(height: float, radius: float) -> tuple[Mesh, Mesh]:
    """A bottle and its cap."""
    r, h = radius, height
    body = [(0, 0), (r, 0), (r, 0.04 * h), (r, 0.72 * h), (0.9 * r, 0.8 * h), (0.4 * r, 0.85 * h)]
    cap = [(0, 0.86 * h), (0.48 * r, 0.86 * h), (0.48 * r, 0.99 * h), (0.42 * r, h), (0, h)]
    return lathe(rounded_profile([*body, (0.4 * r, 0.86 * h)], 2), 28), lathe(cap, 24)


def towel(width: float, front: float, back: float) -> Mesh:
    """A towel over a bar of radius 0.01 along x at y = 0, hanging front and back metres down."""
    drop, arc = 0.018, np.pi * 0.018
    length = front + arc + back
    s, u = np.meshgrid(np.linspace(0, length, 46), np.linspace(-1, 1, 25), indexing="ij")
    angle = np.clip((s - back) / drop, 0, np.pi)
    y = drop * np.sin(angle) + np.minimum(s - back, 0) - np.maximum(s - back - arc, 0)
    below = np.clip(-y, 0, None)
    fold = (0.004 + 0.016 * np.clip(below / 0.5, 0, 1)) * np.sin(7.5 * u + 0.8 * below)
    side = -np.cos(angle)
    z = side * (drop + 0.012 * np.clip(below / 0.3, 0, 1)) + fold * np.where(s > back, 1, 0.2)
    x = u * width / 2 * (1 - 0.05 * np.clip(below / 0.6, 0, 1))
    return surface(np.stack([x, y, z], axis=-1))


def stool() -> Parts:
    """A round stool of oak, 0.42 high."""
    top = lathe(
        [(0, 0.385), (0.15, 0.385), (0.16, 0.395), (0.16, 0.41), (0.152, 0.42), (0, 0.42)], 40
    )
    legs = [
        rod((0.1 * c, 0.385, 0.1 * s), (0.14 * c, 0.001, 0.14 * s), 0.017, 0.012, segments=12)
        for c, s in ((1, 1), (1, -1), (-1, 1), (-1, -1))
    ]
    return {"oak": [top, *legs]}


def duck() -> Parts:
    """A bath duck of 0.12, swimming along +x on y = 0."""
    body = sphere(1, 24).scaled(0.062, 0.042, 0.048).moved(0, 0.04, 0)
    tail = sphere(1, 16).scaled(0.022, 0.016, 0.02).rotated("z", 45).moved(-0.052, 0.066, 0)
    head = sphere(0.031, 20).moved(0.034, 0.103, 0)
    beak = sphere(1, 16).scaled(0.018, 0.007, 0.014).moved(0.068, 0.1, 0)
    eyes = [sphere(0.0045, 10).moved(0.054, 0.114, side * 0.021) for side in (-1, 1)]
    return {"yellow": [body, tail, head], "red": [beak], "black": eyes}


def things() -> Parts:
    """Shelf with bottles, and tray."""
    z = BACK + 0.075
    tray = rounded_box(
        (LEFT + 0.002, 0.0, BACK + 0.002), (SIDE + 0.03, 0.108, FRONT + 0.03), 0.012, 2
    )
    parts: Parts = {
        "ceramic": [tray],
        "oak": [rounded_box((-0.7, 1.15, BACK + 0.002), (-0.06, 1.175, BACK + 0.14), 0.004, 1)],
        "white": [],
    }
    for material, x, height, radius in BOTTLES:
        body, cap = bottle(height, radius)
        parts.setdefault(material, []).append(body.moved(x, 1.176, z))
        parts["white"].append(cap.moved(x, 1.176, z))
    return parts
