"""The ship's hull: an eight-sided bridge, its windows, ribs and consoles along its walls.

Plans are paths of (x, z), walked so that the room lies to their left seen from below: from the
rear left corner along the left wall to the bow and back along the right wall. Lengths are metres.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from modelling.furniture import rod
from modelling.meshes import Mesh, box, rounded_box

PLAN = np.array(
    [
        (-2.3, 2.9),
        (-2.9, 2.2),
        (-2.9, -1.3),
        (-1.6, -3.0),
        (1.6, -3.0),
        (2.9, -1.3),
        (2.9, 2.2),
        (2.3, 2.9),
    ]
)
"""Where the walls are widest, at the windows' sill."""

SILL, LINTEL, CEILING = 0.98, 2.08, 2.6
SECTION = {0.0: 0.28, SILL: 0.0, LINTEL: 0.26, CEILING: 0.85}
"""How far inside the plan the walls stand, by height."""

WINDOWS = (2, 3, 4)  # sides of the plan
DESK = np.array([(-2.9, 1.35), (-2.9, -1.3), (-1.6, -3.0), (1.6, -3.0), (2.9, -1.3), (2.9, 1.35)])
DESK_PROFILE = [(0.5, 0.0), (0.5, 0.5), (0.84, 0.66), (0.86, 0.72), (0.42, 0.84), (0.03, 0.86)]
"""Distance inside of the walls' widest line, and height, of the consoles' surface."""
PANEL = (3, 4)  # the points of the profile between which the panels slope


def inset(path: np.ndarray, distance: float, *, closed: bool) -> np.ndarray:
    """The path [n, 2] moved inwards, with mitred corners; open ends move at right angles."""
    edge = np.roll(path, -1, axis=0) - path
    if not closed:
        edge[-1] = edge[-2]
    edge = edge / np.linalg.norm(edge, axis=1, keepdims=True)
    after = np.stack([-edge[:, 1], edge[:, 0]], axis=1)
    before = np.roll(after, 1, axis=0)
    if not closed:
        before[0] = after[0]
    mitre = (after + before) / (1 + np.einsum("ij,ij->i", after, before))[:, None]
    return path + distance * mitre


def wall_points(height: float, distance: float = 0.0) -> np.ndarray:
    """Corners [8, 3] of the hull at a height, moved inwards by a distance."""
    depth = np.interp(height, list(SECTION), list(SECTION.values())) + distance
    flat = inset(PLAN, float(depth), closed=True)
    return np.column_stack([flat[:, 0], np.full(len(flat), height), flat[:, 1]])


def quad(corners: np.ndarray, texture: np.ndarray | None = None) -> Mesh:
    """Two triangles through four corners [4, 3]; texture coordinates [4, 2] fill the image."""
    if texture is None:
        texture = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], dtype=float)
    return Mesh(np.array(corners), np.array([(0, 1, 2), (0, 2, 3)]), texture=texture)


def strip(low: np.ndarray, high: np.ndarray, sides: list[int], height: float) -> list[Mesh]:
    """Quads from one ring of corners to the next; texture coordinates in metres."""
    quads = []
    for side in sides:
        other = (side + 1) % len(low)
        width = np.linalg.norm(low[other] - low[side])
        rise = np.linalg.norm(high[side] - low[side])
        texture = np.array(
            [(0, height), (width, height), (width, height + rise), (0, height + rise)]
        )
        quads.append(quad([low[side], low[other], high[other], high[side]], texture))
    return quads


def fan(ring: np.ndarray) -> Mesh:
    """A flat convex polygon [n, 3] with texture coordinates (x, z) in metres."""
    faces = [(0, i, i + 1) for i in range(1, len(ring) - 1)]
    return Mesh(ring, np.array(faces), texture=ring[:, [0, 2]])


def panelling() -> list[Mesh]:
    """Walls, but for the windows, and ceiling."""
    rings = [wall_points(height) for height in SECTION]
    sides = list(range(len(PLAN)))
    closed = [side for side in sides if side not in WINDOWS]
    low = strip(rings[0], rings[1], sides, 0.0)
    middle = strip(rings[1], rings[2], closed, SILL)
    return low + middle + strip(rings[2], rings[3], sides, LINTEL) + [fan(rings[3])]


def panes() -> list[Mesh]:
    rings = wall_points(SILL, -0.004), wall_points(LINTEL, -0.004)
    return strip(*rings, list(WINDOWS), 0.0)


def stripes() -> list[Mesh]:
    """Painted bands: below the displays on the side walls, and above the windows."""
    bands = []
    for low, high, sides in ((1.04, 1.13, (1, 5)), (2.17, 2.23, range(len(PLAN)))):
        bands += strip(wall_points(low, 0.004), wall_points(high, 0.004), list(sides), 0.0)
    return bands


def between(ring: np.ndarray, side: int, along: float) -> np.ndarray:
    return ring[side] * (1 - along) + ring[(side + 1) % len(ring)] * along


def ribs() -> list[Mesh]:
    """Beams up every corner and between, along sill, lintel and ceiling."""
    rings = [wall_points(height, 0.01) for height in SECTION]
    beams = []
    stations = [(side, 0.0) for side in range(len(PLAN))]
    stations += [(side, t) for side in (1, 5) for t in (0.36, 0.7)]
    for side, along in stations:
        points = [between(ring, side, along) for ring in rings]
        beams += [rod(a, b, 0.065, segments=6) for a, b in pairwise(points)]
    for ring, radius in ((rings[1], 0.05), (rings[2], 0.06), (rings[3], 0.06)):
        beams += [
            rod(ring[side], between(ring, side, 1.0), radius, segments=6)
            for side in range(len(PLAN))
        ]
    mullions = [(2, 0.5), (3, 0.3), (3, 0.7), (4, 0.5)]
    return beams + [
        rod(between(rings[1], side, t), between(rings[2], side, t), 0.035, segments=6)
        for side, t in mullions
    ]


def desk_rings() -> list[np.ndarray]:
    """The consoles' profile points along the walls, [6, 3] each."""
    rings = []
    for distance, height in DESK_PROFILE:
        flat = inset(DESK, distance, closed=False)
        rings.append(np.column_stack([flat[:, 0], np.full(len(flat), height), flat[:, 1]]))
    return rings


def consoles() -> list[Mesh]:
    """The body of the consoles with closed ends."""
    rings, sides = desk_rings(), list(range(len(DESK) - 1))
    body = [q for a, b in pairwise(rings) for q in strip(a, b, sides, 0.0)]
    for end in (0, -1):
        x = np.sign(DESK[end, 0]) * (2.9 - 0.03)
        # A hub on the edge at the wall, and the foot of that edge: all corners can be seen from
        # the hub, so that a fan fills the concave outline.
        edge = np.array([(x, 0.5, DESK[end, 1]), (x, 0.0, DESK[end, 1])])
        corners = np.concatenate([edge, [ring[end] for ring in rings]])
        faces = [(0, i, i + 1) for i in range(1, len(corners) - 1)]
        body.append(Mesh(corners, np.array(faces), texture=corners[:, :2]))
    return body


def on_panel(side: int, along: float, slope: float, height: float = 0.0) -> np.ndarray:
    """A point on the sloping panels: along a side and up its slope, both in [0, 1].

    height: metres above the panel.
    """
    rings = desk_rings()
    low, high = rings[PANEL[0]], rings[PANEL[1]]
    a = low[side] * (1 - along) + low[side + 1] * along
    b = high[side] * (1 - along) + high[side + 1] * along
    normal = np.cross(low[side + 1] - low[side], high[side] - low[side])
    normal *= np.sign(normal[1]) / np.linalg.norm(normal)
    return a * (1 - slope) + b * slope + height * normal


def panel_frame(side: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit vectors along a side's panel, up its slope and off it."""
    along = on_panel(side, 1, 0.5) - on_panel(side, 0, 0.5)
    up = on_panel(side, 0.5, 1) - on_panel(side, 0.5, 0)
    along, up = along / np.linalg.norm(along), up / np.linalg.norm(up)
    return along, up, np.cross(along, up)


def on_panels(part: Mesh, side: int, along: float, slope: float, height: float) -> Mesh:
    """A part about the origin (x along, y off the panel, -z up the slope), set in place."""
    right, up, out = panel_frame(side)
    matrix = np.stack([right, out, -up], axis=1)
    vertices = part.vertices @ matrix.T + on_panel(side, along, slope, height)
    normals = None if part.normals is None else part.normals @ matrix.T
    return Mesh(vertices, part.faces, normals, part.texture)


def rear_bulkhead() -> dict[str, list[Mesh]]:
    """A sliding door with its frame, and lockers, on the rear wall."""
    door = [
        rounded_box((-0.56, 0.02, 2.5), (-0.004, 1.98, 2.56), 0.02),
        rounded_box((0.004, 0.02, 2.5), (0.56, 1.98, 2.56), 0.02),
    ]
    frame = [
        box((-0.72, 0, 2.44), (-0.57, 2.1, 2.9)),
        box((0.57, 0, 2.44), (0.72, 2.1, 2.9)),
        box((-0.57, 1.99, 2.44), (0.57, 2.1, 2.9)),
    ]
    return {"plastic": door, "steel": frame}
