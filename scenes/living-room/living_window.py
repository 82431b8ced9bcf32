"""The window side of the living room: wall with its opening, blind, balcony and curtains.

The wall lies in the plane x = LEFT and faces +x; the blind hangs within the wall's thickness and
is pulled up into a slot above the opening, so that it moves as one rigid body.
"""

from __future__ import annotations

import numpy as np
from living_things import faceted, leaf, noise, smooth
from modelling.meshes import Mesh, box, rectangle, surface

LEFT, BACK, FRONT, HEIGHT = -2.9, -2.5, 2.5, 2.6
"""The window wall's x, the z of the walls it meets, and the room's height."""

OPENING_Z, OPENING_Y = (-1.3, 0.9), (0.85, 2.2)
OUTSIDE = -3.12
"""The facade's x."""

BLIND_X, SLOT_HALF = -2.99, 0.04
SLOT_TOP = 3.62
SLAT_WIDTH, SLAT_PITCH, SLAT_TILT = 0.058, 0.056, 38.0
"""Metres, metres between slats, and degrees; the outer edge is the lower one, against the sun."""


def _facing(x: float, z: tuple[float, float], y: tuple[float, float], sign: int) -> Mesh:
    """A rectangle in a plane of constant x that faces +x (sign 1) or -x (sign -1)."""
    start, along = (z[1], z[0] - z[1]) if sign > 0 else (z[0], z[1] - z[0])
    return rectangle((x, y[0], start), (0, 0, along), (0, y[1] - y[0], 0))


def _around_opening(x: float, z: tuple[float, float], y: tuple[float, float], sign: int) -> list:
    """Four rectangles that leave the opening free."""
    return [
        _facing(x, (z[0], OPENING_Z[0]), y, sign),
        _facing(x, (OPENING_Z[1], z[1]), y, sign),
        _facing(x, OPENING_Z, (y[0], OPENING_Y[0]), sign),
        _facing(x, OPENING_Z, (OPENING_Y[1], y[1]), sign),
    ]


def window_wall() -> list[Mesh]:
    """The wall, the sides of the opening, and the slot above it that takes the blind."""
    (z0, z1), (y0, y1) = OPENING_Z, OPENING_Y
    depth, width = LEFT - OUTSIDE, z1 - z0
    slot_outer, slot_inner = BLIND_X - SLOT_HALF, BLIND_X + SLOT_HALF
    slot = (y1, SLOT_TOP)
    return [
        *_around_opening(LEFT, (BACK, FRONT), (0, HEIGHT), 1),
        rectangle((OUTSIDE, y0, z0), (depth, 0, 0), (0, y1 - y0, 0)),
        rectangle((LEFT, y0, z1), (-depth, 0, 0), (0, y1 - y0, 0)),
        rectangle((OUTSIDE, y1, z0), (slot_outer - OUTSIDE, 0, 0), (0, 0, width)),
        rectangle((slot_inner, y1, z0), (LEFT - slot_inner, 0, 0), (0, 0, width)),
        _facing(slot_outer, OPENING_Z, slot, 1),
        _facing(slot_inner, OPENING_Z, slot, -1),
    ]


def window_frame() -> list[Mesh]:
    """Two casements and the window sill; white."""
    (z0, z1), (y0, y1) = OPENING_Z, OPENING_Y
    x0, x1, middle = -3.11, -3.06, (z0 + z1) / 2
    bars = [box((LEFT + 0.001, 0.815, z0 - 0.06), (-2.77, 0.85, z1 + 0.06))]
    bars.append(box((OUTSIDE, 0.815, z0), (LEFT, 0.85, z1)))
    bars.append(box((x0 - 0.005, y0, middle - 0.03), (x1 + 0.01, y1, middle + 0.03)))
    for a, b in ((z0, middle - 0.03), (middle + 0.03, z1)):
        bars += [box((x0, y0, a), (x1, y0 + 0.06, b)), box((x0, y1 - 0.06, a), (x1, y1, b))]
        bars += [box((x0, y0 + 0.06, c), (x1, y1 - 0.06, c + 0.05)) for c in (a, b - 0.05)]
    return bars


def blind() -> list[Mesh]:
    """Closed, down to the window sill: slats, the rail below them, and the tapes that hold them."""
    z0, z1 = OPENING_Z[0] + 0.012, OPENING_Z[1] - 0.012
    bottom, top = OPENING_Y[0] + 0.012, OPENING_Y[1] + 0.03
    parts = []
    for y in np.arange(bottom + 0.055, top, SLAT_PITCH):
        across = np.linspace(-1, 1, 5)
        bow = 0.005 * (1 - across**2)
        angle = np.radians(SLAT_TILT)
        x = across * SLAT_WIDTH / 2 * np.cos(angle) - bow * np.sin(angle)
        rise = across * SLAT_WIDTH / 2 * np.sin(angle) + bow * np.cos(angle)
        ends = [np.stack([BLIND_X + x, y + rise, np.full(5, z)], axis=-1) for z in (z1, z0)]
        slat = surface(np.stack(ends))
        parts.append(smooth(slat))
    rails = [box((BLIND_X - 0.02, bottom, z0), (BLIND_X + 0.02, bottom + 0.025, z1))]
    for z in np.linspace(z0 + 0.25, z1 - 0.25, 3):
        for x in (-0.026, 0.024):
            rails.append(
                box((BLIND_X + x, bottom + 0.026, z - 0.004), (BLIND_X + x + 0.002, top, z + 0.004))
            )
    return parts + [faceted(rail) for rail in rails]


def balcony() -> list[Mesh]:
    """The facade, a floor and a parapet outside; they hide where the sky ends."""
    return [
        *_around_opening(OUTSIDE, (-4.0, 4.0), (-0.2, SLOT_TOP), -1),
        rectangle((-4.3, -0.2, 4.0), (1.2, 0, 0), (0, 0, -8.0)),
        box((-4.4, -0.2, -4.0), (-4.3, 0.92, 4.0)),
        box((-4.42, 0.921, -4.0), (-4.28, 0.96, 4.0)),
        box((-4.27, 0.6, -2.6), (-4.05, 0.9, 1.4)),
    ]


def curtain(z0: float, z1: float, folds: float) -> Mesh:
    """Cloth in soft folds before the wall, from a rod to the floor."""
    t, h = np.meshgrid(np.linspace(0, 1, 61), np.linspace(0, 1, 9))
    spread = 1 + 0.05 * (1 - h) ** 2
    phase = 2 * np.pi * folds * (t + 0.012 * np.sin(9 * h + 5 * t))
    x = LEFT + 0.085 + (0.034 + 0.012 * (1 - h)) * np.sin(phase)
    z = (z0 + z1) / 2 + (0.5 - t) * (z1 - z0) * spread + 0.008 * np.sin(2 * phase)
    mesh = surface(np.stack([x, 0.02 + 2.28 * h, z], axis=-1))
    return smooth(mesh)


def balcony_plants() -> list[Mesh]:
    """Leaves above the planter on the balcony, seen against the sky."""
    leaves = []
    for i in range(70):
        length = 0.1 + 0.08 * noise(i, 61)
        blade = leaf(length, 0.3 * length, 0.9).rotated("z", 25 + 60 * noise(i, 62))
        blade = blade.rotated("y", 360 * noise(i, 63))
        z = -2.5 + 3.8 * (i + 0.6 * noise(i, 64)) / 70
        height = 0.05 + 0.26 * noise(i // 3, 65) * noise(i, 66)
        leaves.append(blade.moved(-4.16 + 0.06 * noise(i, 67), 0.88 + height, z))
    return leaves
