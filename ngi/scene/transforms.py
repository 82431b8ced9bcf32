"""4 x 4 matrices of column vectors, as Mitsuba has them."""

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


def translation(offset: NDArray[np.float64]) -> Matrix:
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def scale(factor: float) -> Matrix:
    return np.diag([factor, factor, factor, 1.0])


def rotation(axis: NDArray[np.float64], degrees: float) -> Matrix:
    """About an axis through the origin, counter-clockwise seen against it (Rodrigues)."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return matrix


def about(pivot: NDArray[np.float64], matrix: Matrix) -> Matrix:
    """The same with another fixed point than the origin."""
    return translation(pivot) @ matrix @ translation(-pivot)


def mirrors(matrix: Matrix) -> bool:
    """Whether it turns left into right."""
    return bool(np.linalg.det(matrix[:3, :3]) < 0)


def mirroring(mirrored: bool) -> Matrix:
    """Turns left and right of a camera's picture round where `mirrored`."""
    return np.diag([-1.0 if mirrored else 1.0, 1.0, 1.0, 1.0])


def look_at(
    origin: NDArray[np.float64], target: NDArray[np.float64], up: NDArray[np.float64]
) -> Matrix:
    """Mitsuba's: local z towards the target, local y up, local x to the left.

    Straight up and down, where `up` says nothing, the image's top is +z (or +x for up = z); a
    target at the origin is taken to lie in +z.
    """
    forward = target - origin
    length = np.linalg.norm(forward)
    forward = forward / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
    left = np.cross(up, forward)
    if np.linalg.norm(left) < 1e-6 * np.linalg.norm(up):
        left = np.cross(np.roll(np.eye(3)[np.argmax(np.abs(up))], 1), forward)
    left /= np.linalg.norm(left)
    matrix = np.eye(4)
    matrix[:3, :] = np.column_stack([left, np.cross(forward, left), forward, origin])
    return matrix


def thickened(
    low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A box with corners [3], thicker by a thousandth of its diagonal where it is flat."""
    diagonal = np.linalg.norm(high - low)
    flat = 5e-4 * diagonal * (high - low < 1e-6 * diagonal)
    return low - flat, high + flat
