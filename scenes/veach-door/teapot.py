"""A round teapot of lathe bodies and tubes: thin-walled for glass, or with a closed body.

Lengths are metres. The pot stands on y = 0 about the y axis, its spout points to +x.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from modelling.meshes import Mesh, lathe, surface, tube
from scipy.interpolate import CubicSpline

WALL = 0.004
"""Thickness of the glass."""

BODY = [(0.07, 0.001), (0.098, 0.022), (0.119, 0.068), (0.118, 0.1), (0.1, 0.136), (0.064, 0.162)]
LID = [(0.066, 0.165), (0.058, 0.174), (0.036, 0.186), (0.013, 0.191)]
KNOB = [(0.009, 0.197), (0.0165, 0.208), (0.016, 0.219), (0.007, 0.226)]
"""Outer profiles, (radius, height) from bottom to top, points of a smooth curve."""

SPOUT = [(0.116, 0.066), (0.147, 0.074), (0.168, 0.108), (0.181, 0.146), (0.203, 0.166)]
HANDLE = [(-0.112, 0.118), (-0.152, 0.134), (-0.188, 0.11), (-0.182, 0.066), (-0.145, 0.038)]
HANDLE_END = (-0.1, 0.026)
"""Centre lines (x, y) in the plane z = 0; both end within the wall of the body."""


def spline(points: Sequence[Sequence[float]], count: int) -> np.ndarray:
    """A smooth curve [count, 2] through the points."""
    knots = np.array(points, dtype=float)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
    return CubicSpline(length, knots)(np.linspace(0, length[-1], count))


def inset(curve: np.ndarray, distance: float) -> np.ndarray:
    """The curve [n, 2], moved to its left, which is inwards for a profile from bottom to top."""
    tangent = np.gradient(curve, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    moved = curve + distance * np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    return np.maximum(moved, [0.0, -np.inf])


def turned_smoothly(*pieces: Sequence[Sequence[float]]) -> Mesh:
    """A body of revolution whose profile is made of these pieces."""
    return lathe([tuple(p) for p in np.concatenate([np.asarray(p, float) for p in pieces])], 56)


def pipe(centre: np.ndarray, radius: np.ndarray, wall: float, sides: int = 20) -> Mesh:
    """An open tube with a wall, in the plane z = 0: centre line [n, 2], outer radii [n]."""
    tangent = np.gradient(centre, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    angle = 2 * np.pi * np.arange(sides + 1) / sides
    angle[-1] = 0

    def rings(radii: np.ndarray) -> np.ndarray:
        flat = centre[:, None] + radii[:, None, None] * (normal[:, None] * np.cos(angle)[:, None])
        depth = radii[:, None] * np.sin(angle)
        return np.concatenate([flat, depth[..., None]], axis=-1)

    outer, inner = rings(radius), rings(radius - wall)
    return surface(np.concatenate([outer, inner[::-1], outer[:1]]))


def fittings(wall: float) -> list[Mesh]:
    """Spout and handle."""
    radius = np.interp(np.linspace(0, 1, 22), [0, 0.12, 0.5, 1], [0.026, 0.024, 0.016, 0.011])
    grip = spline([*HANDLE, HANDLE_END], 26)
    path = np.concatenate([grip, np.zeros((len(grip), 1))], axis=1)
    return [pipe(spline(SPOUT, 22), radius, wall), tube(path, 0.0085)]


def closed_teapot() -> list[Mesh]:
    """For metal and clay: nobody looks inside."""
    body = turned_smoothly(
        [(0, 0), (0.064, 0), (0.0685, 0.0002)], spline(BODY, 26), spline(LID, 9), spline(KNOB, 10),
        [(0, 0.2275)],
    )  # fmt: skip
    return [body, *fittings(0.003)]


def glass_teapot() -> list[Mesh]:
    """Walls, bottom and lid are shells of glass with two sides; the knob is solid."""
    outer = spline(BODY, 26)
    inner = inset(outer, WALL)
    inner[0, 1] = WALL
    body = turned_smoothly(
        [(0, 0), (0.064, 0), (0.0685, 0.0002)], outer, [outer[-1] + [-0.002, 0.0015]],
        inner[::-1], [(inner[0, 0] - 0.004, WALL), (0, WALL)],
    )  # fmt: skip
    dome = spline(LID, 9)
    under = inset(dome, WALL)
    lid = turned_smoothly(
        [(0, under[-1, 1] - 0.001)], under[::-1], dome, spline(KNOB, 10), [(0, 0.2275)]
    )
    return [body, lid, *fittings(0.003)]
