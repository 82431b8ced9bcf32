"""Triangle meshes: boxes, turned bodies, mitred frames, and a binary PLY writer."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh, in metres.

    vertices: [n, 3]
    faces: [m, 3] indices, counter-clockwise seen from outside
    normals: [n, 3] of unit length, or None: Mitsuba computes one per face
    texture: [n, 2] texture coordinates, or None
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None = None
    texture: np.ndarray | None = None


def write_ply(path: Path, parts: list[Mesh]) -> None:
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
