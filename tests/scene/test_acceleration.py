"""Shapes moved in Embree's structure directly, against the structure that Mitsuba builds."""

import gc

import numpy as np
import pytest
import torch

from ngi.machine.backend import activate, llvm_problem, mi
from ngi.scene import read_scene, scenes
from ngi.scene.acceleration import EmbreeScene
from ngi.scene.variable_scene import VariableScene

pytestmark = pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))


def hits(scene) -> np.ndarray:
    """Distances at which random rays through the scene's middle hit it."""
    generator = np.random.default_rng(0)
    origin, target = generator.uniform([[-1], [0], [-1]], [[1], [2], [1]], (2, 3, 5000))
    direction = (target - origin) / np.linalg.norm(target - origin, axis=0)
    ray = mi.Ray3f(mi.Point3f(origin), mi.Vector3f(direction))
    return np.array(scene.ray_intersect(ray).t)


def scene_of(name: str) -> VariableScene:
    activate("llvm")
    gc.collect()
    return VariableScene(read_scene(**scenes()[name]))


@pytest.mark.parametrize("name", ["cornell-box", "sphere-caustic", "chess"])
def test_rays_hit_what_they_hit_where_mitsuba_builds(name) -> None:
    scene = scene_of(name)
    generator = torch.Generator().manual_seed(0)
    before = None
    for _ in range(3):
        scene.apply(torch.rand(scene.description.dimensions, generator=generator))
        moved = hits(scene.scene)
        assert before is None or not np.array_equal(moved, before), "nothing moved"
        scene.scene.parameters_changed([])  # every moved shape is dirty still: builds all anew
        np.testing.assert_array_equal(moved, hits(scene.scene))
        before = moved


def test_nothing_is_built_anew(monkeypatch) -> None:
    scene = scene_of("cornell-box")
    told = []
    monkeypatch.setattr(mi.Scene, "parameters_changed", lambda _scene, keys=(): told.append(keys))
    for value in (0.2, 0.7):
        scene.apply(np.full(scene.description.dimensions, value))
    assert not told


@pytest.mark.parametrize("what_differs", ["library", "function", "handle"])
def test_mitsuba_builds_where_embree_is_not_as_expected(monkeypatch, what_differs) -> None:
    module = "ngi.scene.acceleration"
    if what_differs == "library":
        monkeypatch.setattr(f"{module}._LIBRARY", "libembree99.so")
    elif what_differs == "function":
        monkeypatch.setattr(f"{module}._PREFIX", "_ZN6embree")
    else:
        monkeypatch.setattr(f"{module}._INTERSECT", ())
    scene = scene_of("cornell-box")
    assert EmbreeScene.of(scene.scene) is None
    monkeypatch.undo()
    assert EmbreeScene.of(scene.scene) is not None
    scene.apply(np.full(12, 0.3))
    moved = hits(scene.scene)
    scene.scene.parameters_changed([])
    np.testing.assert_array_equal(moved, hits(scene.scene))


def test_other_variants_are_left_to_mitsuba() -> None:
    activate("scalar")
    assert EmbreeScene.of(mi.load_dict({"type": "scene", "shape": {"type": "sphere"}})) is None
