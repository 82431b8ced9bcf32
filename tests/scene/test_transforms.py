"""Matrices against SciPy's rotations and Mitsuba's own transforms."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from ngi.machine.backend import activate, mi
from ngi.scene import transforms

points = arrays(np.float64, 3, elements=st.floats(-10, 10, width=32))
directions = points.filter(lambda vector: np.linalg.norm(vector) > 1e-3)


def at(matrix, point):
    return (matrix @ [*point, 1])[:3]


@given(axis=directions, degrees=st.floats(-720, 720))
def test_rotation_is_scipys(axis, degrees) -> None:
    unit = axis / np.linalg.norm(axis)
    expected = Rotation.from_rotvec(np.radians(degrees) * unit).as_matrix()
    matrix = transforms.rotation(axis, degrees)
    np.testing.assert_allclose(matrix[:3, :3], expected, atol=1e-12)
    np.testing.assert_array_equal(matrix[3], [0, 0, 0, 1])
    assert not matrix[:3, 3].any()


def test_rotation_is_counter_clockwise_seen_against_the_axis() -> None:
    # Seen from above, z is towards the viewer's bottom: x turns into -z.
    turned = at(transforms.rotation(np.array([0.0, 1, 0]), 90), [1, 0, 0])
    np.testing.assert_allclose(turned, [0, 0, -1], atol=1e-15)


@given(pivot=points, axis=directions, degrees=st.floats(-180, 180), factor=st.floats(0.1, 10))
def test_about_leaves_the_pivot_where_it_is(pivot, axis, degrees, factor) -> None:
    for matrix in (transforms.rotation(axis, degrees), transforms.scale(factor)):
        moved = transforms.about(pivot, matrix)
        np.testing.assert_allclose(at(moved, pivot), pivot, atol=1e-9)
        np.testing.assert_array_equal(moved[:3, :3], matrix[:3, :3])


@given(offset=points, point=points, factor=st.floats(0.1, 10))
def test_translation_and_scale(offset, point, factor) -> None:
    np.testing.assert_array_equal(at(transforms.translation(offset), point), point + offset)
    np.testing.assert_allclose(at(transforms.scale(factor), point), factor * point)


@given(origin=points, target=points, up=directions)
def test_look_at_is_mitsubas(origin, target, up) -> None:
    forward = target - origin
    assume(np.linalg.norm(forward) > 0.1)
    sine = np.linalg.norm(np.cross(forward, up)) / np.linalg.norm(forward) / np.linalg.norm(up)
    assume(sine > 0.01)
    activate("scalar")
    arguments = (mi.ScalarPoint3f(origin), mi.ScalarPoint3f(target), mi.ScalarVector3f(up))
    expected = mi.ScalarTransform4f().look_at(*arguments).matrix
    np.testing.assert_allclose(
        transforms.look_at(origin, target, up), np.array(expected).reshape(4, 4), atol=2e-3
    )


@given(origin=points, target=points, up=directions)
def test_look_at_is_a_rotation_wherever_the_target_is(origin, target, up) -> None:
    matrix = transforms.look_at(origin, target, up)
    R = matrix[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(R) == pytest.approx(1)
    np.testing.assert_array_equal(matrix[:3, 3], origin)


@pytest.mark.parametrize(
    ("up", "forward", "top"),
    [
        ([0, 1, 0], [0, 1, 0], [0, 0, 1]),
        ([0, 1, 0], [0, -2, 0], [0, 0, 1]),
        ([0, 0, 3], [0, 0, 1], [1, 0, 0]),
        ([1, 0, 0], [-1, 0, 0], [0, 1, 0]),
    ],
)
def test_straight_up_and_down(up, forward, top) -> None:
    up, forward = np.array(up, dtype=float), np.array(forward, dtype=float)
    matrix = transforms.look_at(np.ones(3), 1 + forward, up)
    np.testing.assert_allclose(matrix[:3, 2], forward / np.linalg.norm(forward))
    np.testing.assert_allclose(matrix[:3, 1], top, atol=1e-12)


def test_straight_along_a_slanted_up() -> None:
    matrix = transforms.look_at(np.zeros(3), np.ones(3), np.ones(3))
    assert np.isfinite(matrix).all()


def test_target_at_the_origin() -> None:
    matrix = transforms.look_at(np.ones(3), np.ones(3), np.array([0.0, 1, 0]))
    np.testing.assert_array_equal(matrix[:3, 2], [0, 0, 1])
