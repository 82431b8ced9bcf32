"""Furniture and small things, as triangle meshes sorted by material.

Every piece stands on the plane y = 0 about the origin and faces +z. Lengths are metres. The feet
end `FOOT` above the floor, so that a rug (a rectangle a few millimetres up) can lie below them.
"""

from __future__ import annotations

from collections.abc import Collection
from itertools import pairwise
from pathlib import Path

import numpy as np
from modelling.meshes import Mesh, box, extruded, lathe, rounded_box, surface, tube, write_ply

Parts = dict[str, list[Mesh]]
"""The meshes of a piece of furniture, by the id of their material."""

FOOT = 0.005


def finished(mesh: Mesh, *, textured: bool) -> Mesh:
    """With normals; if textured, with texture coordinates in metres along the nearest plane.

    The image's u axis follows the longer side of the mesh in that plane, as the grain of wood does.
    """
    vertices, faces, normals = mesh.vertices, mesh.faces, mesh.normals
    if normals is None:
        corners = vertices[faces]
        flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
        split = np.concatenate([corners.reshape(-1, 3), np.repeat(flat, 3, axis=0)], axis=1)
        unique, faces = np.unique(np.round(split, 6), axis=0, return_inverse=True)
        vertices, normals, faces = unique[:, :3], unique[:, 3:], faces.reshape(-1, 3)
    if not textured:
        return Mesh(vertices, faces, normals)
    longest_first = np.argsort(-np.ptp(vertices, axis=0), kind="stable")
    across = np.argmax(np.abs(normals), axis=1)
    axes = np.array([[a for a in longest_first if a != axis] for axis in range(3)])[across]
    return Mesh(vertices, faces, normals, np.take_along_axis(vertices, axes, axis=1))


def placed(parts: Parts, x: float, y: float, z: float, turn: float = 0.0) -> Parts:
    """Turned about y by degrees, then moved."""
    return {k: [m.rotated("y", turn).moved(x, y, z) for m in v] for k, v in parts.items()}


def merged(*pieces: Parts) -> Parts:
    together: Parts = {}
    for piece in pieces:
        for material, meshes in piece.items():
            together.setdefault(material, []).extend(meshes)
    return together


def write_parts(
    folder: Path, name: str, parts: Parts, textured: Collection[str]
) -> list[tuple[str, str]]:
    """Writes one PLY per material; returns (file name, material id) of each.

    textured: the materials that need texture coordinates; an image covers a square metre.
    """
    written = []
    for material, meshes in parts.items():
        file = f"{name}_{material}.ply"
        write_ply(folder / file, [finished(m, textured=material in textured) for m in meshes])
        written.append((file, material))
    return written


def rod(start: tuple[float, ...], end: tuple[float, ...], *radii: float, segments: int = 8) -> Mesh:
    """A straight round bar; several radii are spread evenly from start to end."""
    path = np.linspace(start, end, max(len(radii), 2))
    return tube(path, np.array(radii if len(radii) > 1 else radii * 2), segments)


def splayed_legs(x: float, z: float, height: float, splay: float, radius: float) -> list[Mesh]:
    """Four tapered legs whose tops stand at (+-x, +-z)."""
    return [
        rod((a * x, height, b * z), (a * (x + splay), FOOT, b * (z + splay)), radius, 0.6 * radius)
        for a in (-1, 1)
        for b in (-1, 1)
    ]


def smooth_bar(points: list[tuple[float, float, float]], radius: float, steps: int = 14) -> Mesh:
    """A round bar along a Catmull-Rom curve through the points."""
    p = np.array([points[0], *points, points[-1]], dtype=float)
    path = []
    for i in range(1, len(p) - 2):
        t = np.arange(steps)[:, None] / steps
        a, b, c, d = p[i - 1 : i + 3]
        path.append(
            b
            + t
            * ((c - a) / 2 + t * (a - 2.5 * b + 2 * c - d / 2 + t * (1.5 * (b - c) + (d - a) / 2)))
        )
    return tube(np.concatenate([*path, p[-1:]]), radius, 8)


def spindle_armchair() -> Parts:
    """A lounge chair of turned wood: spindle back, bow arms, two cushions. 0.7 x 0.78 x 0.8."""
    wood = splayed_legs(0.27, 0.27, 0.36, 0.045, 0.02)
    wood += [box((-0.3, 0.33, z - 0.02), (0.3, 0.37, z + 0.02)) for z in (-0.26, 0.28)]
    wood += [box((x - 0.02, 0.331, -0.24), (x + 0.02, 0.369, 0.26)) for x in (-0.28, 0.28)]
    for side in (-1, 1):
        arm = [(side * 0.31, 0.6, 0.33), (side * 0.335, 0.6, 0.0), (side * 0.3, 0.62, -0.3)]
        wood.append(smooth_bar(arm, 0.018))
        wood.append(rod((side * 0.29, 0.36, 0.28), (side * 0.31, 0.6, 0.3), 0.016, 0.014))
        wood.append(rod((side * 0.27, 0.36, -0.26), (side * 0.285, 0.79, -0.385), 0.017, 0.014))
    wood.append(smooth_bar([(-0.31, 0.79, -0.37), (0.0, 0.81, -0.42), (0.31, 0.79, -0.37)], 0.019))
    for x in np.linspace(-0.22, 0.22, 9):
        bow = 0.045 * (1 - (x / 0.3) ** 2)
        wood.append(rod((0.95 * x, 0.37, -0.265), (x, 0.8, -0.372 - bow), 0.007, 0.009, 0.007))
    seat = rounded_box((-0.27, 0.375, -0.23), (0.27, 0.48, 0.33), 0.04)
    back = rounded_box((-0.25, 0.0, -0.05), (0.25, 0.3, 0.05), 0.045)
    return {"wood": wood, "armchair_fabric": [seat, back.rotated("x", -14).moved(0, 0.49, -0.2)]}


def club_chair() -> Parts:
    """A low armchair with a padded shell on thin legs. 0.78 x 0.72 x 0.78."""
    shell = [
        rounded_box((-0.39, 0.16, -0.36), (-0.25, 0.58, 0.36), 0.06),
        rounded_box((0.25, 0.16, -0.36), (0.39, 0.58, 0.36), 0.06),
        rounded_box((-0.248, 0.17, -0.39), (0.248, 0.76, -0.25), 0.06),
        rounded_box((-0.248, 0.16, -0.248), (0.248, 0.29, 0.34), 0.03),
        rounded_box((-0.246, 0.292, -0.245), (0.246, 0.43, 0.37), 0.05),
    ]
    return {"armchair_fabric": shell, "metal": splayed_legs(0.28, 0.27, 0.17, 0.03, 0.013)}


def sofa(width: float, seats: int) -> Parts:
    """0.92 deep and 0.8 high."""
    half, arm = width / 2, 0.17
    fabric = [
        rounded_box((-half, 0.15, -0.46), (-half + arm, 0.6, 0.44), 0.05),
        rounded_box((half - arm, 0.15, -0.46), (half, 0.6, 0.44), 0.05),
        rounded_box((-half + arm, 0.15, -0.458), (half - arm, 0.7, -0.26), 0.05),
        rounded_box((-half + arm, 0.15, -0.258), (half - arm, 0.3, 0.42), 0.02),
    ]
    for left, right in _bays(-half + arm, half - arm, seats):
        fabric.append(rounded_box((left, 0.302, -0.25), (right, 0.45, 0.455), 0.045))
        back = rounded_box((left, 0.0, -0.08), (right, 0.36, 0.08), 0.06)
        fabric.append(back.rotated("x", -12).moved(0, 0.462, -0.165))
    return {"sofa_fabric": fabric, "wood": splayed_legs(half - 0.1, 0.36, 0.16, 0.02, 0.022)}


def _bays(left: float, right: float, count: int, gap: float = 0.008) -> list[tuple[float, float]]:
    edges = np.linspace(left, right, count + 1)
    return [(a + gap / 2, b - gap / 2) for a, b in pairwise(edges)]


def cushion(size: float) -> Mesh:
    """A square scatter cushion about the origin, plump in the middle, facing +-z."""
    u, v = np.meshgrid(np.linspace(-1, 1, 13), np.linspace(-1, 1, 13))
    pinch = 1 - 0.09 * (1 - u**2) * v**4 - 0.09 * (1 - v**2) * u**4
    thick = 0.17 * size * ((1 - u**4) * (1 - v**4)) ** 0.4
    half = size / 2
    front = surface(np.stack([u * half * pinch, v * half * pinch, thick], axis=-1))
    back = surface(np.stack([-u * half * pinch, v * half * pinch, -thick], axis=-1))
    count = len(front.vertices)
    return Mesh(
        np.concatenate([front.vertices, back.vertices]),
        np.concatenate([front.faces, back.faces + count]),
        np.concatenate([front.normals, back.normals]),
    )


def slat_chair() -> Parts:
    """A dining chair of wood with a ladder back. 0.46 x 0.86 x 0.5."""
    wood = [rod((x, 0.44, 0.19), (1.06 * x, FOOT, 0.21), 0.018, 0.013) for x in (-0.19, 0.19)]
    wood += [rod((x, FOOT, -0.23), (x, 0.86, -0.235), 0.014, 0.018, 0.013) for x in (-0.19, 0.19)]
    wood.append(rounded_box((-0.225, 0.43, -0.205), (0.225, 0.465, 0.23), 0.012, 2))
    for y in (0.55, 0.65, 0.75):
        x = np.linspace(-0.19, 0.19, 9)
        bow = -0.228 - 0.03 * (1 - (x / 0.19) ** 2)
        lower, upper = (np.stack([x, np.full(9, h), bow], axis=-1) for h in (y, y + 0.055))
        outer = np.array([0, 0, -0.014])
        grid = np.stack([lower, upper, upper + outer, lower + outer, lower])
        wood.append(surface(grid))
    return {"wood": wood}


def shell_chair() -> Parts:
    """A dining chair: a moulded shell (one sheet, seen from both sides) on a wire base."""
    t, u = np.meshgrid(np.linspace(0, 1, 17), np.linspace(-1, 1, 13), indexing="ij")
    z = np.interp(t, [0, 0.1, 0.45, 0.6, 1], [0.24, 0.22, -0.12, -0.19, -0.25])
    y = np.interp(t, [0, 0.1, 0.45, 0.6, 1], [0.42, 0.445, 0.425, 0.49, 0.82])
    width = np.interp(t, [0, 0.2, 0.5, 0.75, 0.92, 1], [0.2, 0.235, 0.245, 0.22, 0.19, 0.13])
    wing = 0.1 * u**4 * np.interp(t, [0, 0.3, 0.6, 1], [0.1, 0.4, 1, 0.4])
    points = np.stack([-u * width, y + 0.5 * wing, z + 0.9 * wing], axis=-1)
    for _ in range(3):  # rounds the creases of the piecewise linear section
        points[1:-1] = (points[:-2] + 2 * points[1:-1] + points[2:]) / 4
    metal = [
        rod((a * 0.09, 0.42, b * 0.08), (a * 0.2, FOOT, b * 0.2), 0.009, 0.009)
        for a in (-1, 1)
        for b in (-1, 1)
    ]
    metal += [rod((-0.14, 0.22, b * 0.135), (0.14, 0.22, b * 0.135), 0.005, 0.005) for b in (-1, 1)]
    return {"shell": [surface(points)], "metal": metal}


def padded_chair() -> Parts:
    """A dining chair with a padded seat and back on wooden legs. 0.48 x 0.84 x 0.52."""
    back = rounded_box((-0.21, 0.0, -0.035), (0.21, 0.34, 0.035), 0.033).rotated("x", -9)
    posts = [rod((x, 0.4, -0.2), (x, 0.62, -0.242), 0.013, 0.013) for x in (-0.15, 0.15)]
    return {
        "chair_fabric": [
            rounded_box((-0.235, 0.41, -0.22), (0.235, 0.5, 0.245), 0.04),
            back.moved(0, 0.53, -0.205),
        ],
        "wood": posts + splayed_legs(0.18, 0.17, 0.42, 0.03, 0.017),
    }


def round_table(radius: float, height: float) -> Parts:
    """A thin round top with a soft edge on three splayed legs and a lower ring."""
    top = [
        (0, height - 0.03),
        (radius - 0.025, height - 0.03),
        (radius - 0.02, height - 0.029),
        (radius, height - 0.01),
        (radius, height - 0.006),
        (radius - 0.004, height - 0.001),
        (radius - 0.008, height),
        (0, height),
    ]
    angles = np.radians([90, 210, 330])
    feet = [(np.cos(a), np.sin(a)) for a in angles]
    legs = [
        rod(
            (0.55 * radius * x, height - 0.03, 0.55 * radius * z),
            (0.88 * radius * x, FOOT, 0.88 * radius * z),
            0.02,
            0.012,
        )
        for x, z in feet
    ]
    return {"table_top": [lathe(top, 64)], "wood": legs}


def long_table(length: float, depth: float, height: float) -> Parts:
    """A dining table along x: a bevelled top, an apron set back, tapered legs."""
    x, z, bevel = length / 2, depth / 2, 0.012
    top = rounded_box((-x, height - 0.035, -z), (x, height, z), bevel, 2)
    apron = [
        box(
            (-x + 0.1, height - 0.11, s * (z - 0.1) - 0.01),
            (x - 0.1, height - 0.036, s * (z - 0.1) + 0.01),
        )
        for s in (-1, 1)
    ]
    apron += [
        box(
            (s * (x - 0.1) - 0.01, height - 0.11, -z + 0.11),
            (s * (x - 0.1) + 0.01, height - 0.036, z - 0.11),
        )
        for s in (-1, 1)
    ]
    legs = splayed_legs(x - 0.12, z - 0.12, height - 0.036, 0.04, 0.035)
    return {"table_top": [top], "wood": apron + legs}


def sideboard(width: float, height: float, doors: int) -> Parts:
    """0.44 deep; fluted doors within a wooden frame, on thin legs. The back lies at z = -0.22."""
    half, low = width / 2, 0.16
    wood = [
        box((-half, height - 0.025, -0.22), (half, height, 0.22)),
        box((-half, low, -0.22), (half, low + 0.025, 0.22)),
        box((-half, low + 0.025, -0.22), (-half + 0.025, height - 0.025, 0.22)),
        box((half - 0.025, low + 0.025, -0.22), (half, height - 0.025, 0.22)),
    ]
    fronts, metal = [], splayed_legs(half - 0.12, 0.15, low, 0.015, 0.014)
    for left, right in _bays(-half + 0.027, half - 0.027, doors):
        fronts.append(box((left, low + 0.028, -0.2), (right, height - 0.028, 0.19)))
        flutes = _bays(left, right, max(round((right - left) / 0.028), 1), 0.009)
        fronts += [
            extruded(
                [(a, low + 0.03), (b, low + 0.03), (b, height - 0.03), (a, height - 0.03)],
                0.204,
                0.19,
            )
            for a, b in flutes
        ]
    return {"wood": wood, "lacquer": fronts, "metal": metal}
