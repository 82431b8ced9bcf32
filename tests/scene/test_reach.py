"""Suns and skies cast shadows of what moves far out of the scene as it was loaded."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from ngi.machine.backend import activate, llvm_problem, mi
from ngi.render.exr import write_exr
from ngi.scene import read_scene
from ngi.scene.variable_scene import VariableScene

SUN = '<emitter type="directional"><vector name="direction" value="0, -1, 0"/></emitter>'
SKY = '<emitter type="constant"/>'
PICTURE = '<emitter type="envmap"><string name="filename" value="sky.exr"/></emitter>'
SCENE = """<scene version="3.0.0"><integrator type="path"/><sensor type="perspective"/>{}
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/></transform></shape>
<shape type="{}" id="cloud"><transform name="to_world"><translate y="1"/></transform></shape>
</scene>"""
YAML = """{name: far, scene: scene.xml, samples_per_pixel: 1, max_depth: -1,
bounds: {minimum: [-40, 0, -40], maximum: [40, 101, 40]}, variables: [
{object: cloud, property: translation, minimum: [0, 0, 0], maximum: [0, 60, 0]},
{object: cloud, property: scale, minimum: 1, maximum: 40}]}"""
SAMPLES = np.stack(np.meshgrid(*[(np.arange(6) + 0.5) / 6] * 2), -1).reshape(-1, 2).tolist()


def shadows(scene: mi.Scene) -> tuple[list[bool], list[bool]]:
    """Of directions towards the emitter from the floor: what is in the way of a ray without an
    end, and of the one that Mitsuba's path tracer follows.
    """
    spot = scene.ray_intersect(mi.Ray3f([0.1, 0.5, 0.1], [0, -1, 0]))
    hidden, dark = [], []
    for sample in SAMPLES:
        towards, _ = scene.sample_emitter_direction(spot, mi.Point2f(sample), False)
        if np.ravel(towards.d)[1] > 0.1:  # not from below
            hidden.append(bool(np.all(scene.ray_test(spot.spawn_ray(towards.d)))))
            dark.append(bool(np.all(scene.ray_test(spot.spawn_ray_to(towards.p)))))
    return hidden, dark


@pytest.mark.parametrize(
    ("backend", "kind", "emitter"),
    [
        *(("scalar", kind, each) for kind in ("sphere", "cube") for each in (SUN, SKY, PICTURE)),
        *(("llvm", "sphere", SUN), ("llvm", "cube", PICTURE)),  # kernels take seconds
    ],
)
def test_what_moves_far_away_casts_a_shadow(tmp_path: Path, backend, kind, emitter) -> None:
    if backend == "llvm" and (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    activate(backend)
    write_exr(tmp_path / "sky.exr", torch.ones(4, 8, 3))
    (tmp_path / "scene.xml").write_text(SCENE.format(emitter, kind))
    (tmp_path / "scene.yaml").write_text(YAML)
    scene = VariableScene(read_scene(tmp_path))
    for v in ([0.0, 0.0], [1.0, 1.0]):
        scene.apply(v)
    hidden, dark = shadows(scene.scene)
    assert any(hidden)
    assert dark == hidden
