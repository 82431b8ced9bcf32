"""Bathtub, toilet, washbasin and their taps. Each stands about the origin on y = 0 and faces +z."""

from __future__ import annotations

import numpy as np
from modelling.furniture import Parts, rod, smooth_bar
from modelling.meshes import Mesh, box, lathe, rounded_box, surface
from modelling.ornaments import rounded_profile

Ring = tuple[float, float, float, float, float]
"""Height, centre z, half width along x, half length along z, exponent (2: an ellipse)."""


def lofted(rings: list[Ring], segments: int = 48) -> Mesh:
    """A smooth body through superellipses from bottom to top; back down inside for a bowl."""
    angle = 2 * np.pi * np.arange(segments + 1) / segments
    c, s = np.cos(angle), -np.sin(angle)
    loops = []
    for height, centre, half_x, half_z, exponent in rings:
        x = half_x * np.sign(c) * np.abs(c) ** (2 / exponent)
        z = centre + half_z * np.sign(s) * np.abs(s) ** (2 / exponent)
        loops.append(np.stack([x, np.full_like(x, height), z], axis=-1))
        loops[-1][-1] = loops[-1][0]
    return surface(np.stack(loops))


def bathtub() -> Mesh:
    """Free-standing, 0.74 by 1.64 along z, 0.58 high, hollow."""
    return lofted(
        [
            (0.0, 0, 0.24, 0.66, 2.6),
            (0.02, 0, 0.27, 0.70, 2.6),
            (0.2, 0, 0.31, 0.75, 2.6),
            (0.4, 0, 0.335, 0.785, 2.6),
            (0.55, 0, 0.36, 0.81, 2.6),
            (0.57, 0, 0.37, 0.82, 2.6),
            (0.58, 0, 0.365, 0.815, 2.6),
            (0.58, 0, 0.34, 0.79, 2.6),
            (0.57, 0, 0.33, 0.78, 2.6),
            (0.45, 0, 0.31, 0.75, 2.6),
            (0.25, 0, 0.28, 0.68, 2.6),
            (0.14, 0, 0.22, 0.58, 2.6),
            (0.12, 0, 0.1, 0.4, 2.4),
            (0.12, 0, 0.0, 0.0, 2.0),
        ],
        56,
    )


def tub_tap() -> list[Mesh]:
    """A floor-standing spout and hand shower; the spout reaches 0.3 forward at y = 0.8."""
    spout = [(0, 0.68, 0), (0, 0.78, 0.0), (0, 0.83, 0.05), (0, 0.84, 0.2), (0, 0.78, 0.27)]
    return [
        rod((0, 0, 0), (0, 0.68, 0), 0.018, segments=16),
        lathe([(0, 0), (0.05, 0), (0.05, 0.01), (0.02, 0.018), (0, 0.018)], 24),
        smooth_bar(spout, 0.016, 8),
        rod((-0.09, 0.66, 0), (0.09, 0.66, 0), 0.022, segments=16),
        smooth_bar(
            [(0.09, 0.66, 0), (0.14, 0.68, 0), (0.14, 0.75, 0.0), (0.14, 0.9, 0.01)], 0.011, 6
        ),
    ]


def toilet() -> Parts:
    """Seat 0.43 high; the cistern's back lies at z = 0, the bowl reaches to z = 0.66."""
    bowl = lofted(
        [
            (0.0, 0.36, 0.11, 0.2, 2.4),
            (0.03, 0.36, 0.105, 0.195, 2.4),
            (0.18, 0.36, 0.11, 0.2, 2.4),
            (0.3, 0.38, 0.15, 0.24, 2.3),
            (0.37, 0.4, 0.178, 0.255, 2.3),
            (0.395, 0.4, 0.18, 0.257, 2.3),
            (0.4, 0.4, 0.175, 0.25, 2.3),
            (0.4, 0.4, 0.0, 0.0, 2.0),
        ]
    )
    lid = lofted(
        [
            (0.404, 0.41, 0.175, 0.245, 2.4),
            (0.408, 0.41, 0.185, 0.255, 2.4),
            (0.43, 0.41, 0.185, 0.255, 2.4),
            (0.44, 0.41, 0.175, 0.245, 2.4),
            (0.443, 0.41, 0.0, 0.0, 2.0),
        ]
    )
    cistern = rounded_box((-0.19, 0.4, 0.002), (0.19, 0.78, 0.16), 0.02)
    cover = rounded_box((-0.2, 0.782, 0.002), (0.2, 0.81, 0.17), 0.01)
    neck = rounded_box((-0.1, 0.0, 0.002), (0.1, 0.398, 0.2), 0.03)
    button = lathe([(0, 0.81), (0.03, 0.81), (0.03, 0.815), (0.026, 0.818), (0, 0.818)], 24)
    return {"ceramic": [bowl, lid, cistern, cover, neck], "chrome": [button.moved(0, 0, 0.085)]}


def vanity(width: float) -> Parts:
    """A wall-hung cabinet with two drawers below a stone top at 0.82; its back lies at z = 0."""
    half = width / 2
    wood = [box((-half, 0.4, 0.002), (half, 0.78, 0.44))]
    chrome = []
    for low in (0.405, 0.595):
        wood.append(
            rounded_box((-half + 0.004, low, 0.441), (half - 0.004, low + 0.18, 0.46), 0.004, 1)
        )
        y = low + 0.15
        chrome.append(rod((-0.16, y, 0.485), (0.16, y, 0.485), 0.007, segments=12))
        chrome += [rod((x, y, 0.46), (x, y, 0.485), 0.005) for x in (-0.14, 0.14)]
    top = rounded_box((-half - 0.01, 0.782, 0.002), (half + 0.01, 0.82, 0.48), 0.006, 2)
    return {"oak": wood, "chrome": chrome, "stone": [top]}


def vessel_basin() -> Mesh:
    """A round bowl of radius 0.21 and height 0.13 to stand on a top."""
    profile = [
        (0, 0),
        (0.1, 0),
        (0.13, 0.01),
        (0.185, 0.07),
        (0.21, 0.128),
        (0.207, 0.134),
        (0.198, 0.128),
        (0.17, 0.07),
        (0.11, 0.025),
        (0, 0.018),
    ]
    return lathe(rounded_profile(profile, 2), 56)


def basin_tap() -> list[Mesh]:
    """A tall tap for a vessel basin: the spout reaches 0.16 forward at y = 0.24."""
    spout = [(0, 0.2, 0), (0, 0.27, 0), (0, 0.3, 0.05), (0, 0.29, 0.12), (0, 0.24, 0.16)]
    return [
        lathe([(0, 0), (0.028, 0), (0.028, 0.008), (0.018, 0.014), (0.018, 0.2), (0, 0.2)], 28),
        smooth_bar(spout, 0.012, 8),
        rod((0.018, 0.13, 0), (0.065, 0.15, 0), 0.006, 0.005, segments=12),
    ]
