"""The figure: a sitting hare, an implicit surface of smoothly blended ellipsoids."""

from __future__ import annotations

import numpy as np
from modelling.meshes import Mesh
from skimage.measure import marching_cubes


def ellipsoid(
    points: np.ndarray,
    centre: tuple[float, float, float],
    radii: tuple[float, float, float],
    *,
    tilt: float = 0.0,
    lean: float = 0.0,
) -> np.ndarray:
    """Approximate signed distance [...] of points [..., 3] to an ellipsoid.

    tilt, lean: degrees it is turned about x, then about z.
    """
    x, y, z = np.moveaxis(points - np.array(centre), -1, 0)
    a, b = np.radians(lean), np.radians(tilt)
    x, y = x * np.cos(a) + y * np.sin(a), -x * np.sin(a) + y * np.cos(a)
    y, z = y * np.cos(b) + z * np.sin(b), -y * np.sin(b) + z * np.cos(b)
    scaled = np.stack([x, y, z], axis=-1) / np.array(radii)
    length = np.linalg.norm(scaled, axis=-1)
    gradient = np.linalg.norm(scaled / np.array(radii), axis=-1)
    return length * (length - 1) / np.maximum(gradient, 1e-9)


def blend(first: np.ndarray, second: np.ndarray, radius: float) -> np.ndarray:
    """Union of two signed distances with a fillet of about the given radius."""
    h = np.maximum(radius - np.abs(first - second), 0) / radius
    return np.minimum(first, second) - h**3 * radius / 6


def hare_distance(points: np.ndarray) -> np.ndarray:
    """Signed distance [...] of the sitting hare at points [..., 3]; it faces -z, feet at y = 0."""
    x, y, z = np.moveaxis(points, -1, 0)
    mirrored = np.stack([np.abs(x), y, z], axis=-1)  # all but the ears is symmetric
    d = ellipsoid(points, (0, 0.27, 0.07), (0.19, 0.25, 0.21), tilt=12)  # body
    d = blend(d, ellipsoid(points, (0, 0.43, -0.05), (0.13, 0.19, 0.12), tilt=-10), 0.10)  # chest
    d = blend(d, ellipsoid(points, (0, 0.64, -0.09), (0.115, 0.125, 0.135)), 0.06)  # head
    d = blend(d, ellipsoid(mirrored, (0.055, 0.60, -0.165), (0.06, 0.055, 0.06)), 0.05)  # cheeks
    d = blend(d, ellipsoid(points, (0, 0.625, -0.215), (0.035, 0.03, 0.03)), 0.03)  # nose
    haunch = ellipsoid(mirrored, (0.15, 0.17, 0.06), (0.09, 0.16, 0.17), tilt=-15)
    d = blend(d, haunch, 0.05)
    foot = ellipsoid(mirrored, (0.15, 0.035, -0.12), (0.06, 0.045, 0.14))
    d = blend(d, foot, 0.03)
    arm = ellipsoid(mirrored, (0.085, 0.24, -0.14), (0.05, 0.20, 0.055), tilt=-6)
    d = blend(d, arm, 0.04)
    d = blend(d, ellipsoid(mirrored, (0.08, 0.04, -0.18), (0.05, 0.042, 0.07)), 0.03)  # paws
    d = blend(d, ellipsoid(points, (0, 0.13, 0.27), (0.075, 0.075, 0.075)), 0.03)  # tail
    for side, lean, tilt in ((1, -12, 6), (-1, -16, 14)):
        along = np.stack([side * x, y, z], axis=-1)
        ear = ellipsoid(along, (0.09, 0.92, -0.05), (0.056, 0.22, 0.04), lean=lean, tilt=tilt)
        hollow = ellipsoid(along, (0.09, 0.93, -0.098), (0.036, 0.16, 0.034), lean=lean, tilt=tilt)
        d = blend(d, -blend(-ear, hollow, 0.02), 0.04)
    eye = ellipsoid(mirrored, (0.082, 0.675, -0.168), (0.02, 0.024, 0.02))
    d = np.minimum(d, eye)
    return np.maximum(d, -y)


def hare() -> Mesh:
    """The hare's surface by marching cubes, with the distance field's gradient as normals."""
    minimum, step = np.array([-0.30, -0.03, -0.34]), 0.0168
    counts = np.ceil((np.array([0.30, 1.20, 0.40]) - minimum) / step).astype(int)
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"), axis=-1)
    distance = hare_distance(minimum + step * grid)
    vertices, faces, _, _ = marching_cubes(distance, 0.0, spacing=(step,) * 3)
    vertices = vertices + minimum
    offsets = 1e-3 * np.eye(3)
    normals = np.stack(
        [hare_distance(vertices + o) - hare_distance(vertices - o) for o in offsets], axis=-1
    )
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    corners = vertices[faces]
    sides = corners[:, 1:] - corners[:, :1]
    outward = np.einsum("ij,ij->i", np.cross(sides[:, 0], sides[:, 1]), normals[faces[:, 0]]) > 0
    faces = np.where(outward.mean() > 0.5, faces, faces[:, ::-1])
    return Mesh(vertices, faces, normals=normals)
