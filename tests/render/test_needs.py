"""What a scene does not need is left out, and what is left is the same as with everything."""

import numpy as np
import pytest
import torch

from ngi.machine.backend import activate, llvm_problem
from ngi.patches import BUFFER_CHANNELS
from ngi.render.materials import collect_materials
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.render.needs import buffer_needs, buffers_are_static, needed_layout
from ngi.scene import read_scene
from ngi.scene.variable_scene import VariableScene
from tests.render.box import windows_of_buffers

SCENE = """<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="3"/></integrator>
<sensor type="perspective" id="camera"><float name="fov" value="40"/>
  <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
  <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
</sensor>
<bsdf type="diffuse" id="paint"><rgb name="reflectance" value="0.5, 0.4, 0.3"/></bsdf>
<shape type="sphere" id="ball"><float name="radius" value="0.5"/><ref id="paint"/></shape>
<shape type="rectangle" id="wall">
  <transform name="to_world"><scale value="3"/><translate z="-1"/></transform>
  <ref id="paint"/></shape>
<shape type="rectangle" id="lamp">
  <transform name="to_world"><rotate y="1" angle="180"/><translate z="LAMP"/></transform>
  <ref id="paint"/><emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>
</scene>"""
INTENSITY = "{object: lamp, property: intensity, minimum: 0.5, maximum: 2}"
BEHIND, IN_FRONT = "6", "2.5"


@pytest.fixture
def scene(tmp_path):
    def make(variable=INTENSITY, lamp=BEHIND, xml=SCENE):
        (tmp_path / "scene.xml").write_text(xml.replace("LAMP", lamp))
        (tmp_path / "scene.yaml").write_text(
            "{name: wall, scene: scene.xml, samples_per_pixel: 4, max_depth: 3,\n"
            "bounds: {minimum: [-3, -3, -1], maximum: [3, 3, 6]},\n"
            f"variables: [{variable}], camera_path: [[0]], hard_frames: [[1]]}}"
        )
        return read_scene(tmp_path)

    return make


def needs(description):
    activate("scalar")
    loaded = VariableScene(description)
    return {n.buffer: n for n in buffer_needs(loaded, collect_materials(loaded.bsdfs()))}


def is_static(description):
    activate("scalar")
    loaded = VariableScene(description)
    needed = needed_layout(buffer_needs(loaded, collect_materials(loaded.bsdfs())))
    return buffers_are_static(loaded, needed)


def left_out(description):
    return {name for name, need in needs(description).items() if not need.needed}


def test_constant_and_absent_buffers_are_left_out(scene) -> None:
    found = needs(scene())
    assert found.keys() == BUFFER_CHANNELS.keys()
    assert left_out(scene()) == {"albedo", "roughness", "emission"}
    assert found["albedo"].why.startswith("it is (0.5, 0.4")
    assert found["roughness"].why == "it is 1.0 everywhere"
    assert found["emission"].why == "all emitters lie outside of the camera's view"


VARIABLES = {
    "{object: camera, property: look_at, minimum: [0,0,4,0,0,0], maximum: [1,0,4,0,0,0]}": {
        "emission"
    },
    "{object: camera, property: translation, minimum: [0,0,0], maximum: [1,0,0]}": {"emission"},
    "{object: paint, property: albedo, minimum: [0,0,0], maximum: [1,0,0]}": {"albedo"},
    "{object: lamp, property: translation, minimum: [0,0,0], maximum: [0,0,1]}": {"emission"},
    "{object: ball, property: visibility}": set(),
}


@pytest.mark.parametrize("variable", VARIABLES)
def test_what_a_variable_changes_is_kept(scene, variable) -> None:
    always_left_out = {"albedo", "roughness", "emission"}
    assert left_out(scene(variable)) == always_left_out - VARIABLES[variable]


def test_what_differs_between_surfaces_is_kept(scene) -> None:
    metal = (
        '<bsdf type="roughconductor"><float name="alpha" value="0.2"/>'
        '<rgb name="specular_reflectance" value="0.9"/></bsdf></shape>'
    )
    mixed = SCENE.replace('value="0.5"/><ref id="paint"/></shape>', f'value="0.5"/>{metal}')
    assert mixed != SCENE
    assert left_out(scene(xml=mixed)) == {"emission"}


def test_emitters_in_view_and_environments_are_kept(scene) -> None:
    assert "emission" not in left_out(scene(lamp=IN_FRONT))
    sky = SCENE.replace("</scene>", '<emitter type="constant"/></scene>')
    assert "emission" not in left_out(scene(xml=sky))


def test_only_light_that_changes_leaves_the_buffers_static(scene) -> None:
    assert is_static(scene())
    assert not any(is_static(scene(v, lamp=IN_FRONT)) for v in (*VARIABLES, INTENSITY))


@pytest.mark.parametrize("backend", ["llvm", "scalar"])
def test_same_patches_as_with_everything(scene, backend, monkeypatch) -> None:
    if backend == "llvm" and (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    arguments = {"backend": backend, "patch_size": 8, "buffer_samples": 2}
    description = scene()
    needed = MitsubaRenderer(scene=description, **arguments)
    everything = MitsubaRenderer(scene=description, needed_only=False, **arguments)
    assert everything.layout.names == tuple(BUFFER_CHANNELS)
    states = torch.rand(3, 3, generator=torch.Generator().manual_seed(1))
    expected = everything.render_patches(states, resolution=20, seed=4)
    traced = windows_of_buffers(needed, monkeypatch)
    for _ in range(2):
        patches = needed.render_patches(states, resolution=20, seed=4)
    assert len(traced) == 1
    torch.testing.assert_close(patches.log_radiance, expected.log_radiance, rtol=0, atol=0)
    for name in needed.layout.names:
        np.testing.assert_allclose(
            patches.buffers[..., needed.layout.slice(name)],
            expected.buffers[..., everything.layout.slice(name)],
            atol=1e-5,
        )
    needed.render_patches(states, resolution=24, seed=4)
    assert len(traced) == 2


def test_the_albedo_of_glass_is_the_transmittance_that_a_variable_sets(scene) -> None:
    glass = SCENE.replace(
        '<shape type="sphere" id="ball"><float name="radius" value="0.5"/><ref id="paint"/>',
        '<bsdf type="roughdielectric" id="glass"><float name="alpha" value="0.1"/>'
        '<rgb name="specular_transmittance" value="0.9, 0.9, 0.9"/></bsdf>'
        '<shape type="sphere" id="ball"><float name="radius" value="0.5"/><ref id="glass"/>',
    )
    assert glass != SCENE
    tinted = "{object: glass, property: albedo, minimum: [0.2, 1, 1], maximum: [0.8, 1, 1]}"
    renderer = MitsubaRenderer(scene=scene(tinted, xml=glass), backend="scalar", buffer_samples=1)
    buffers = renderer.image_buffers(torch.tensor([0.5]), resolution=9)
    albedo = buffers[4, 4, renderer.layout.slice("albedo")]
    torch.testing.assert_close(albedo, torch.tensor([0.5, 1.0, 1.0]))


def test_a_scene_of_sky_alone_has_no_materials_to_tell_of(scene) -> None:
    sky = '<emitter type="constant" id="sky"/></scene>'
    xml = SCENE[: SCENE.index("<bsdf")] + sky
    found = needs(scene("{object: sky, property: intensity, minimum: 0.5, maximum: 2}", xml=xml))
    assert found["albedo"].why == "there is no surface"
    assert not found["albedo"].needed
    assert found["emission"].needed
