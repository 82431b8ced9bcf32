"""Triangle meshes: boxes, turned and swept bodies, smooth surfaces, and a binary PLY writer.

Lengths are metres, y points up. Faces are counter-clockwise seen from outside.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh, in metres.

    vertices: [n, 3]
    faces: [m, 3] indices, counter-clockwise seen from outside
    normals: [n, 3] of unit length, or None: Mitsuba computes them, per face if the XML says
        face_normals, else per vertex
    texture: [n, 2] texture coordinates, or None; the v axis of Mitsuba's bitmaps points down
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None = None
    texture: np.ndarray | None = None

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Mesh:
        return Mesh(self.vertices + np.array([x, y, z]), self.faces, self.normals, self.texture)

    def rotated(self, axis: str, degrees: float) -> Mesh:
        """Turned about the x, y or z axis through the origin, counter-clockwise."""
        a, b = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
        angle, matrix = np.radians(degrees), np.eye(3)
        matrix[[a, a, b, b], [a, b, a, b]] = (
            np.cos(angle),
            -np.sin(angle),
            np.sin(angle),
            np.cos(angle),
        )
        normals = None if self.normals is None else self.normals @ matrix.T
        return Mesh(self.vertices @ matrix.T, self.faces, normals, self.texture)

    def scaled(self, x: float, y: float, z: float) -> Mesh:
        """By positive factors."""
        factors, normals = np.array([x, y, z]), self.normals
        if normals is not None:
            normals = normals / factors
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return Mesh(self.vertices * factors, self.faces, normals, self.texture)


def write_ply(path: Path, parts: Sequence[Mesh]) -> None:
    """Writes all parts, which must carry the same attributes, as one binary mesh."""
    counts = np.cumsum([0] + [len(part.vertices) for part in parts])
    columns, names = [np.concatenate([part.vertices for part in parts])], ["x", "y", "z"]
    normals = [part.normals for part in parts if part.normals is not None]
    if normals:
        columns, names = [*columns, np.concatenate(normals)], [*names, "nx", "ny", "nz"]
    texture = [part.texture for part in parts if part.texture is not None]
    if texture:
        columns, names = [*columns, np.concatenate(texture)], [*names, "u", "v"]
    vertices = np.concatenate(columns, axis=1).astype("<f4")
    triangles = np.concatenate([p.faces + n for p, n in zip(parts, counts[:-1], strict=True)])
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, triangles
    header = "".join(
        [
            f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n",
            *(f"property float {name}\n" for name in names),
            f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n",
        ]
    )
    path.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())


def box(minimum: tuple[float, ...], maximum: tuple[float, ...]) -> Mesh:
    """An axis-aligned box."""
    corners = np.array([minimum, maximum])
    vertices = np.array(
        [
            [corners[a, 0], corners[b, 1], corners[c, 2]]
            for a in (0, 1)
            for b in (0, 1)
            for c in (0, 1)
        ]
    )
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    return Mesh(vertices, faces)


def box_frame(
    left: float, right: float, bottom: float, top: float, *, back: float, width: float, depth: float
) -> list[Mesh]:
    """Four boxes in the shape of a rectangular frame that lies on the plane z = back, facing +z."""
    front = back + depth
    return [
        box((left, bottom, back), (right, bottom + width, front)),
        box((left, top - width, back), (right, top, front)),
        box((left, bottom + width, back), (left + width, top - width, front)),
        box((right - width, bottom + width, back), (right, top - width, front)),
    ]


def turned(profile: list[tuple[float, float]], segments: int) -> Mesh:
    """A prism with the given (radius, height) from bottom to top, closed by flat ends."""
    angle = 2 * np.pi * (np.arange(segments) + 0.5) / segments
    ring = np.stack([np.cos(angle), np.zeros(segments), -np.sin(angle)], axis=-1)
    vertices = np.concatenate([ring * r + np.array([0, h, 0]) for r, h in profile])
    faces = []
    for level in range(len(profile) - 1):
        for a in range(segments):
            b = (a + 1) % segments
            low, high = level * segments, (level + 1) * segments
            faces += [(low + a, low + b, high + b), (low + a, high + b, high + a)]
    top = (len(profile) - 1) * segments
    for a in range(1, segments - 1):
        faces += [(0, a + 1, a), (top, top + a, top + a + 1)]
    return Mesh(vertices, np.array(faces))


def sweep(outline: np.ndarray, profile: list[tuple[float, float]]) -> Mesh:
    """A frame: the profile swept with mitred corners along a closed outline.

    outline: [n, 2] in the plane z = 0, counter-clockwise seen from +z, the frame's inner edge.
    profile: (outward, forward) distances from the inner edge, from the inside to the outside.
    """
    edge = np.roll(outline, -1, axis=0) - outline
    edge /= np.linalg.norm(edge, axis=1, keepdims=True)
    normal = np.stack([edge[:, 1], -edge[:, 0]], axis=1)  # outward, of the edge after a corner
    before = np.roll(normal, 1, axis=0)
    mitre = (normal + before) / (1 + np.einsum("ij,ij->i", normal, before))[:, None]
    rings = [
        np.concatenate([outline + out * mitre, np.full((len(outline), 1), forward)], axis=1)
        for out, forward in profile
    ]
    n, faces = len(outline), []
    for level in range(len(profile) - 1):
        for a in range(n):
            b = (a + 1) % n
            low, high = level * n, (level + 1) * n
            faces += [(low + a, high + a, high + b), (low + a, high + b, low + b)]
    return Mesh(np.concatenate(rings), np.array(faces))


def rectangle(corner: Sequence[float], along: Sequence[float], up: Sequence[float]) -> Mesh:
    """A parallelogram spanned from a corner, seen from along x up; its image stands upright."""
    start, u, v = np.array(corner, float), np.array(along, float), np.array(up, float)
    vertices = np.stack([start, start + u, start + u + v, start + v])
    texture = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], dtype=float)
    return Mesh(vertices, np.array([(0, 1, 2), (0, 2, 3)]), texture=texture)


def surface(points: np.ndarray) -> Mesh:
    """A smooth surface through a grid of points [rows, columns, 3], with normals and texture.

    Seen from columns x rows (the direction of growing columns crossed with that of growing rows).
    A first and last row or column at the same place close it without a seam. Texture coordinates
    grow from 0 to 1 with the columns and from 0 to 1 with the rows. Quads that collapse to a line
    (poles) give no triangles of zero area.
    """
    rows, columns = points.shape[:2]
    along, up = _differences(points, 1), _differences(points, 0)
    normals = np.cross(along, up)
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    # At a pole the columns meet: the neighbouring rows' mean normal points along the axis.
    for pole, ring in ((0, 1), (rows - 1, rows - 2)):
        if np.ptp(points[pole], axis=0).max() < 1e-9:
            normals[pole] = normals[ring].mean(axis=0)
            length[pole] = np.linalg.norm(normals[pole], axis=-1, keepdims=True)
    normals = normals / np.maximum(length, 1e-30)
    u, v = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows))
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    triangles = np.concatenate(
        [np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))]
    )
    flat = points.reshape(-1, 3)
    corner = flat[triangles]
    area = np.linalg.norm(
        np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1
    )
    texture = np.stack([u, v], axis=-1).reshape(-1, 2)
    return Mesh(flat, triangles[area > 1e-12], normals.reshape(-1, 3), texture)


def _differences(points: np.ndarray, axis: int) -> np.ndarray:
    """Central differences; across the seam where the first and last slice coincide."""
    grid = np.moveaxis(points, axis, 0)
    after, before = np.roll(grid, -1, axis=0), np.roll(grid, 1, axis=0)
    if np.allclose(grid[0], grid[-1]):
        after[-1], before[0] = grid[1], grid[-2]
    else:
        after[-1], before[0] = grid[-1], grid[0]
    return np.moveaxis(after - before, 0, axis)


def lathe(profile: Sequence[tuple[float, float]], segments: int = 48) -> Mesh:
    """A smooth body of revolution about y: (radius, height) from bottom to top, outside out.

    Points of the profile that lie close together make an edge; radius 0 closes an end.
    """
    angle = 2 * np.pi * np.arange(segments + 1) / segments
    ring = np.stack([np.cos(angle), np.zeros_like(angle), -np.sin(angle)], axis=-1)
    ring[-1] = ring[0]
    radius, height = np.array(profile, dtype=float).T
    points = ring[None] * radius[:, None, None]
    points[..., 1] = height[:, None]
    return surface(points)


def sphere(radius: float, segments: int = 32) -> Mesh:
    angle = np.pi * (np.arange(segments // 2 + 1) / (segments // 2) - 0.5)
    return lathe(
        [
            (radius * max(np.cos(a), 0.0) if abs(a) < 1.5707 else 0.0, radius * np.sin(a))
            for a in angle
        ],
        segments,
    )


def tube(path: np.ndarray, radius: float | np.ndarray, segments: int = 12) -> Mesh:
    """A round tube with closed ends along a path [n, 3] without sharp reversals."""
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.cross(tangent[0], np.eye(3)[np.argmin(np.abs(tangent[0]))])
    angle = 2 * np.pi * np.arange(segments + 1) / segments
    rings, radii = [], np.broadcast_to(radius, len(path))
    for centre, direction, r in zip(path, tangent, radii, strict=True):
        side = side - direction * (side @ direction)  # carried along without a twist
        side /= np.linalg.norm(side)
        other = np.cross(direction, side)
        rings.append(centre + r * (np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * other))
        rings[-1][-1] = rings[-1][0]
    ends = [np.broadcast_to(path[i], rings[0].shape) for i in (0, -1)]
    return surface(np.stack([ends[0], *rings, ends[1]]))


def rounded_box(
    minimum: Sequence[float], maximum: Sequence[float], radius: float, segments: int = 4
) -> Mesh:
    """A box whose edges and corners are rounded: a cushion, a mattress, a kettle's lid."""
    low, high = np.array(minimum, float) + radius, np.array(maximum, float) - radius
    bow = np.linspace(0, np.pi / 2, segments + 1)
    latitude = np.concatenate([bow - np.pi / 2, bow])  # the equator twice: bottom and top half
    y = np.repeat([low[1], high[1]], segments + 1) + radius * np.sin(latitude)
    longitude = -np.concatenate([bow + quarter * np.pi / 2 for quarter in range(4)])
    x_side = np.repeat([high[0], low[0], low[0], high[0]], segments + 1)
    z_side = np.repeat([low[2], low[2], high[2], high[2]], segments + 1)
    longitude, x_side, z_side = (np.append(a, a[0]) for a in (longitude, x_side, z_side))
    phi, theta = np.meshgrid(latitude, longitude, indexing="ij")
    normals = np.stack(
        [np.cos(phi) * np.cos(theta), np.sin(phi), np.cos(phi) * np.sin(theta)], axis=-1
    )
    rings = radius * normals
    rings[..., 0] += x_side
    rings[..., 1] = y[:, None]
    rings[..., 2] += z_side
    middle = (low + high) / 2
    ends = [np.broadcast_to((middle[0], h, middle[2]), rings[0].shape) for h in (y[0], y[-1])]
    mesh = surface(np.concatenate([ends[:1], rings, ends[1:]]))
    caps = [np.broadcast_to((0.0, h, 0.0), rings[0].shape) for h in (-1, 1)]
    smooth = np.concatenate([caps[:1], normals, caps[1:]]).reshape(-1, 3)
    return Mesh(mesh.vertices, mesh.faces, smooth, mesh.texture)


def extruded(outline: Sequence[Sequence[float]], front: float, back: float) -> Mesh:
    """A board between z = back and front: a convex outline [n, 2], counter-clockwise from +z."""
    flat = np.array(outline, dtype=float)
    n = len(flat)
    vertices = np.concatenate([np.column_stack([flat, np.full(n, z)]) for z in (front, back)])
    faces = [(0, i, i + 1) for i in range(1, n - 1)]
    faces += [(n, n + i + 1, n + i) for i in range(1, n - 1)]
    for a in range(n):
        b = (a + 1) % n
        faces += [(a, n + a, n + b), (a, n + b, b)]
    return Mesh(vertices, np.array(faces))


def grained(mesh: Mesh, grain: str, size: float = 1.0) -> Mesh:
    """A mesh of flat faces with texture coordinates of wood whose grain runs along an axis.

    Every face gets its own corners (and no normals). v is the position along the axis `grain`
    ("x", "y" or "z"), u the position along that other axis which the face is not perpendicular to;
    both in units of `size` metres, the extent of the image.
    """
    along = "xyz".index(grain)
    corners = mesh.vertices[mesh.faces]
    normals = np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    normals[:, along] = -1
    facing = np.argmax(normals, axis=1)
    across = 3 - along - facing
    u = np.take_along_axis(corners, across[:, None, None], axis=2)[..., 0]
    texture = np.stack([u, corners[..., along]], axis=-1).reshape(-1, 2) / size
    faces = np.arange(3 * len(mesh.faces)).reshape(-1, 3)
    return Mesh(corners.reshape(-1, 3), faces, texture=texture)
