"""What components of v stand for, kind by kind, without Mitsuba."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import KroghInterpolator

from ngi.scene import KINDS
from ngi.scene.description import component_names
from ngi.scene.kinds import (
    Albedo,
    CameraPath,
    Intensity,
    Rotation,
    Shape,
    Texels,
    Translation,
    Visibility,
)
from ngi.scene.yaml_keys import YamlKeys

KEYS = [[0, 1, 4, 0, 1, 0], [1, 1.5, 3, 0, 1, 0], [1.5, 2, 2, 0.5, 0.5, 0], [0, 3, 3, 0, 1, 0]]

ENTRIES = {
    "albedo": ({"minimum": [0, 0.25, 0.5], "maximum": [1, 0.75, 0.5]}, ["r", "g"]),
    "roughness": ({"minimum": 0.1, "maximum": 0.5}, [""]),
    "intensity": ({"minimum": 0, "maximum": 4}, [""]),
    "radiance": ({"minimum": [1, 2, 3], "maximum": [3, 2, 9]}, ["r", "b"]),
    "translation": ({"minimum": [-1, 0, 2], "maximum": [1, 0, 4]}, ["x", "z"]),
    "rotation": ({"axis": [0, 1, 0], "minimum": -90, "maximum": 180}, [""]),
    "scale": ({"minimum": 0.5, "maximum": 2}, [""]),
    "look_at": (
        {"minimum": [0, 1, 2, 3, 4, 5], "maximum": [1, 1, 4, 7, 4, 9]},
        ["origin_x", "origin_z", "target_x", "target_z"],
    ),
    "direction": ({"minimum": [0, 10], "maximum": [360, 80]}, ["azimuth", "elevation"]),
    "fov": ({"minimum": 20, "maximum": 60}, [""]),
    "cone": ({"minimum": [20, 5], "maximum": [40, 15]}, ["cutoff_angle", "beam_width"]),
    "metallic": ({"minimum": 0.2, "maximum": 0.7}, [""]),
    "color0": ({"minimum": [0, 0.25, 0.5], "maximum": [1, 0.75, 0.5]}, ["r", "g"]),
}
"""Entries of the kinds with a minimum and a maximum, and the components that vary."""


def read(kind, entry, objects=("a",)):
    return KINDS[kind].read(objects, YamlKeys(Path("scene.yaml"), "variables[0].", entry))


@pytest.mark.parametrize("kind", ENTRIES)
def test_ranges(kind) -> None:
    entry, components = ENTRIES[kind]
    variable = read(kind, entry)
    assert list(variable.components) == components
    low, high = np.atleast_1d(entry["minimum"]), np.atleast_1d(entry["maximum"])
    for u in (0, 0.5, 1):
        value = variable.value(np.full(len(components), float(u)))
        np.testing.assert_allclose(value, low + u * (high - low), rtol=1e-15)


@pytest.mark.parametrize("kind", ENTRIES)
def test_linked_numbers_take_one_component(kind) -> None:
    entry, _ = ENTRIES[kind]
    low, high = np.atleast_1d(entry["minimum"]), np.atleast_1d(entry["maximum"])
    if len(low) == 1:
        return
    variable = read(kind, {**entry, "linked": True})
    assert variable.components == ("",)
    for u in (0, 0.25, 1):
        np.testing.assert_allclose(variable.value(np.array([u])), low + u * (high - low))


def test_nothing_varies_where_all_is_fixed() -> None:
    fixed = {"minimum": [1, 2, 3], "maximum": [1, 2, 3]}
    assert read("translation", fixed).components == ()
    assert read("translation", {**fixed, "linked": True}).components == ()
    np.testing.assert_array_equal(read("translation", fixed).value(np.empty(0)), [1, 2, 3])


@given(
    ranges=st.lists(
        st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)).map(sorted), min_size=3, max_size=3
    ),
    u=st.lists(st.floats(0, 1), min_size=3, max_size=3),
)
def test_values_stay_in_their_ranges_and_fixed_numbers_where_they_are(ranges, u) -> None:
    low, high = np.array(ranges).T
    variable = Translation(("a",), tuple(low), tuple(high))
    value = variable.value(np.array(u)[: len(variable.components)])
    slack = 1e-9 * np.maximum(np.abs(low), np.abs(high))
    assert (value >= low - slack).all()
    assert (value <= high + slack).all()
    np.testing.assert_array_equal(value[low == high], low[low == high])


@given(n=st.integers(2, 50), u=st.floats(0, 1))
def test_choices_have_equal_parts(n, u) -> None:
    variable = Shape(("a",), tuple(map(str, range(n))))
    (index,) = variable.value(np.array([u]))
    assert index == min(int(np.floor(u * n)), n - 1)
    assert 0 <= index < n


@pytest.mark.parametrize(
    ("u", "index"), [(0, 0), (0.25, 0), (0.3333, 0), (0.3334, 1), (0.5, 1), (0.7, 2), (1, 2)]
)
@pytest.mark.parametrize("kind", ["shape", "material", "texture"])
def test_choices(kind, u, index) -> None:
    variable = read(kind, {"choices": ["x", "y", "z"]})
    assert variable.components == ("",)
    np.testing.assert_array_equal(variable.value(np.array([u])), [index])
    assert variable.files == (("x", "y", "z") if kind == "texture" else ())


@pytest.mark.parametrize(("u", "index"), [(0, 0), (0.49, 0), (0.5, 1), (1, 1)])
def test_visible_from_one_half(u, index) -> None:
    np.testing.assert_array_equal(Visibility(("a",)).value(np.array([u])), [index])


@pytest.mark.parametrize(("u", "place"), [(0, 0), (0.25, 0.5), (0.5, 1), (1, 2)])
def test_key_frames(u, place) -> None:
    variable = read("key_frames", {"files": ["a.ply", "b.ply", "c.ply"]})
    assert variable.components == ("",)
    assert variable.files == ("a.ply", "b.ply", "c.ply")
    np.testing.assert_allclose(variable.value(np.array([u])), [place])


@given(u=st.floats(0, 1))
def test_camera_path_of_four_views_is_lagranges_polynomial(u) -> None:
    variable = read("camera_path", {"keys": KEYS})
    polynomial = KroghInterpolator(np.linspace(0, 1, 4), np.array(KEYS))
    np.testing.assert_allclose(variable.value(np.array([u])), polynomial(u), atol=1e-9)


@pytest.mark.parametrize("count", [2, 3, 4, 7])
def test_camera_path_meets_its_views(count) -> None:
    keys = np.random.default_rng(0).normal(size=(count, 6))
    variable = CameraPath(("camera",), tuple(map(tuple, keys)))
    for u, view in zip(np.linspace(0, 1, count), keys, strict=True):
        np.testing.assert_allclose(variable.value(np.array([u])), view, atol=1e-12)
    if count == 2:
        np.testing.assert_allclose(
            variable.value(np.array([0.25])), 0.75 * keys[0] + 0.25 * keys[1]
        )


def test_texels_are_rows_of_the_picture() -> None:
    variable = Texels(("a",), (2, 3), 0.2, 0.6)
    assert variable.components == ("0_0", "0_1", "0_2", "1_0", "1_1", "1_2")
    value = variable.value(np.array([0, 0.5, 1, 0.25, 0.75, 1]))
    np.testing.assert_allclose(value, [[0.2, 0.4, 0.6], [0.3, 0.5, 0.6]])


def test_component_names() -> None:
    variables = (
        Translation(("a", "b"), (0.0, 0.0, 0.0), (1.0, 0.0, 1.0)),
        Albedo(("a",), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), linked=True),
        Rotation(("a",), (0.0,), (1.0,)),
        Intensity(("a",), (0.0,), (1.0,)),
        Rotation(("a",), (0.0,), (1.0,), axis=(1.0, 0.0, 0.0)),
        Rotation(("a",), (0.0,), (1.0,), axis=(0.0, 0.0, 1.0)),
        Rotation(("b",), (0.0,), (1.0,)),
        Shape(("seat",), ("x", "y")),
    )
    assert component_names(variables) == (
        "a+b.translation.x",
        "a+b.translation.z",
        "a.albedo",
        "a.rotation",
        "a.intensity",
        "a.rotation_2",
        "a.rotation_3",
        "b.rotation",
        "seat.shape",
    )


def test_every_kind_has_its_own_name() -> None:
    assert all(kind.kind == name for name, kind in KINDS.items())
    assert len(KINDS) == 33
    assert {"camera"} == KINDS["look_at"].affects == KINDS["camera_path"].affects
