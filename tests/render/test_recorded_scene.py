"""What recorded kernels are given of a scene is all that they read, and not more than once."""

import logging
import subprocess
import sys

import pytest
import torch

from ngi.machine.backend import activate, llvm_problem
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.render.recorded_scene import RecordedScene
from ngi.scene import read_scene, scenes
from ngi.scene.jit_variables import variables_of
from ngi.scene.variable_scene import VariableScene
from tests.docs.pages import ROOT

pytestmark = pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))

SCENES = ("mirror", "archviz")
"""Whose variables move instances, lamps and cameras, and give shapes other materials."""


def renderer_of(name: str) -> MitsubaRenderer:
    return MitsubaRenderer(
        scene=read_scene(**scenes()[name]),
        backend="llvm",
        patch_size=8,
        samples_per_pixel=2,
        specular="traced",
        direct="traced",
    )


def numbers(renderer: MitsubaRenderer) -> torch.Tensor:
    """Of patches of several v, all channels."""
    generator = torch.Generator().manual_seed(0)
    states = torch.rand(4, renderer.dimensions + 2, generator=generator)
    patches = renderer.render_patches(states, resolution=32, seed=0)
    return torch.cat([patches.buffers, patches.log_radiance], dim=-1)


ALONE = """
import sys
from tests.render.test_recorded_scene import RecordedScene, logging, numbers, renderer_of, torch

logging.basicConfig(level=logging.DEBUG, stream=sys.stdout, format="asked again: %(name)s")
logging.getLogger().setLevel(logging.WARNING)
logging.getLogger("ngi.render.jit_tracer").setLevel(logging.DEBUG)
given = numbers(renderer_of(sys.argv[1]))
RecordedScene.parts = RecordedScene.whole
print(torch.equal(given, numbers(renderer_of(sys.argv[1]))))
"""


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_and_what_is_given_of_it_trace_the_same(name: str) -> None:
    """In a process of its own: Dr.Jit asks for scenes of other tests, too, where they are there."""
    ran = subprocess.run(
        [sys.executable, "-c", ALONE, name], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert ran.stdout.split("\n") == ["True", ""]


def test_what_is_missing_is_looked_for_in_the_whole_scene(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    expected = numbers(renderer_of("mirror"))
    monkeypatch.setattr(RecordedScene, "parts", lambda _: [])
    caplog.set_level(logging.DEBUG, logger="ngi.render.jit_tracer")
    assert torch.equal(numbers(renderer_of("mirror")), expected)
    assert {record.levelname for record in caplog.records} == {"DEBUG"}


@pytest.mark.parametrize("name", ["archviz", "bedroom", "salon-25"])
def test_what_can_change_is_not_the_scene_s_own(name: str) -> None:
    """That is looked at once; a colour in there would stay what it was."""
    activate("llvm")
    scene = VariableScene(read_scene(**scenes()[name]))
    own, *_ = RecordedScene(scene).parts()
    numbers = {variable.index for variable in own}
    assert len(numbers) == len(own) > 0
    changing = {v.index for node in scene.changing for v in variables_of(node)}
    assert numbers.isdisjoint(changing)
    scene.apply([0.1] * scene.description.dimensions)
    scene.apply([0.9] * scene.description.dimensions)
    assert {v.index for v in RecordedScene(scene).parts()[0]} == numbers
