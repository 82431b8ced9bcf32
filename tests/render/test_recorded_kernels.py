"""Kernels that Dr.Jit records, and scenes of which it cannot."""

import dataclasses
import gc
import logging
import sys
from collections import Counter
from types import FrameType

import numpy as np
import pytest
import torch
from PIL import Image

from ngi.machine.backend import dr, llvm_problem
from ngi.render.first_hit import FirstHit
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene
from ngi.studies.benchmark.measure import counted_kernels

SCENE = """<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="4"/></integrator>
<sensor type="perspective" id="camera"><transform name="to_world">
  <lookat origin="0,1,4" target="0,0.5,0" up="0,1,0"/></transform>
  <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
</sensor>
<bsdf type="diffuse" id="paint"><rgb name="reflectance" value="0.5, 0.4, 0.3"/></bsdf>
<shape type="rectangle" id="floor"><transform name="to_world"><scale value="3"/>
  <rotate x="1" angle="-90"/></transform><ref id="paint"/></shape>
<shape type="sphere" id="ball"><float name="radius" value="0.5"/><ref id="paint"/></shape>
<shape type="rectangle" id="screen"><transform name="to_world"><translate y="1" z="-1"/></transform>
  <emitter type="area"><texture type="bitmap" name="radiance">
    <string name="filename" value="screen.png"/></texture></emitter></shape>
</scene>"""


pytestmark = pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))


@pytest.fixture
def renderer_of_a_screen(tmp_path):
    pixels = np.random.default_rng(0).integers(0, 255, (8, 8, 3), dtype=np.uint8)
    Image.fromarray(pixels).save(tmp_path / "screen.png")
    (tmp_path / "scene.xml").write_text(SCENE)
    (tmp_path / "scene.yaml").write_text(
        "{name: screen, scene: scene.xml, samples_per_pixel: 64, max_depth: 4,\n"
        "bounds: {minimum: [-3, 0, -3], maximum: [3, 3, 3]}, variables: [{object: ball,\n"
        "property: translation, minimum: [0, 0, 0], maximum: [1, 0, 0]}]}"
    )
    gc.collect()
    return lambda: MitsubaRenderer(scene=read_scene(tmp_path), backend="llvm", patch_size=8)


V = torch.tensor([0.3])
STATES = torch.cat([V, torch.zeros(2)]).expand(4, 3)


def test_a_textured_emitter_is_recorded(renderer_of_a_screen, caplog) -> None:
    renderer = renderer_of_a_screen()
    with caplog.at_level(logging.WARNING):
        renderer.warm_up()
    assert not caplog.text
    with counted_kernels() as kernels:
        patches = [renderer.render_patches(STATES, resolution=8, seed=seed) for seed in range(4)]
    assert kernels.compiled == 0
    mean = torch.stack([p.log_radiance.expm1() for p in patches]).mean(dim=(0, 1))
    image = renderer.render_image(V, resolution=8, samples_per_pixel=1024, seed=9)
    assert image.max() > 0.2, "the screen is in view"
    torch.testing.assert_close(mean, image, atol=0.02, rtol=0.1)


def test_python_traces_each_size_of_an_image_once(renderer_of_a_screen, monkeypatch) -> None:
    traced, channels = [], FirstHit.channels

    def counted(*arguments):
        traced.append(arguments)
        return channels(*arguments)

    monkeypatch.setattr(FirstHit, "channels", counted)
    renderer = renderer_of_a_screen()
    sizes = [(8, 16), (16, 16), (16, 4)]
    images = [
        [renderer.image_buffers(torch.tensor([v]), resolution=n, samples=rays) for n, rays in sizes]
        for v in (0.2, 0.8, 0.5)
    ]
    # Where scenes of other tests are still there, what is given of this one is not enough at first.
    assert len(traced) in (len(sizes), len(sizes) + 1)
    for image, (n, rays) in zip(images[-1], sizes, strict=True):
        fresh = renderer_of_a_screen()  # which traces this alone
        expected = fresh.image_buffers(torch.tensor([0.5]), resolution=n, samples=rays)
        assert torch.equal(image, expected)


@pytest.mark.parametrize("raised", [KeyboardInterrupt, SystemExit])
def test_who_interrupts_a_recording_is_heard(
    renderer_of_a_screen, monkeypatch, caplog, raised: type[BaseException]
) -> None:
    """As a handler of SIGINT or SIGTERM does, at whatever moment."""

    def interrupted(*_):
        raise raised

    renderer = renderer_of_a_screen()
    with monkeypatch.context() as patch:
        patch.setattr(FirstHit, "channels", interrupted)
        with pytest.raises(raised):
            renderer.image_buffers(V, resolution=8)
    with caplog.at_level(logging.DEBUG, logger="ngi.render.jit_tracer"):
        found = renderer.image_buffers(V, resolution=8)
    assert torch.equal(found, renderer_of_a_screen().image_buffers(V, resolution=8))
    assert "WARNING" not in {record.levelname for record in caplog.records}


def test_what_cannot_be_recorded_is_traced_each_time(
    renderer_of_a_screen, caplog, monkeypatch
) -> None:
    expected = renderer_of_a_screen().render_patches(STATES, resolution=8, seed=1)

    def fails(*_):
        raise RuntimeError("record(): not this one")

    monkeypatch.setattr(dr, "freeze", lambda _function, **_options: fails)
    renderer = renderer_of_a_screen()
    with caplog.at_level(logging.WARNING):
        patches = renderer.render_patches(STATES, resolution=8, seed=1)
        renderer.render_patches(STATES, resolution=8, seed=2)
    said = "pictures of this scene take longer: record(): not this one"
    assert caplog.messages == [said, said], "once for the radiance, once for the buffers"
    assert torch.equal(patches.log_radiance, expected.log_radiance)
    assert torch.equal(patches.buffers, expected.buffers)


def test_a_replay_does_not_walk_through_the_materials(renderer_of_a_screen) -> None:
    renderer = renderer_of_a_screen()
    renderer.render_patches(STATES, resolution=8, seed=0)
    walked = Counter()

    def count(frame: FrameType, event: str, _argument: object) -> None:
        if event == "call" and frame.f_code is dataclasses.fields.__code__:
            walked[frame.f_locals["class_or_instance"].__name__] += 1

    sys.setprofile(count)
    try:
        renderer.render_patches(STATES, resolution=8, seed=1)
    finally:
        sys.setprofile(None)
    assert walked.keys() == {"_View"}
