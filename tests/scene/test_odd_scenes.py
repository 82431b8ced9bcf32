"""Scenes that few people write, each of which once went wrong."""

from pathlib import Path

import numpy as np
import pytest
import torch

from ngi.machine.backend import activate, mi
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene
from ngi.scene.arrangement import arranged
from ngi.scene.loading import load
from ngi.scene.variable_scene import VariableScene
from ngi.view.describe import main

ROOM = """<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="3"/>
</integrator><sensor type="perspective" id="camera"><transform name="to_world">
<lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform><film type="hdrfilm">
<integer name="width" value="32"/><integer name="height" value="32"/></film></sensor>{}</scene>"""
YAML = """{{name: odd, scene: scene.xml, samples_per_pixel: 1, max_depth: 3,
bounds: {{minimum: [-9, -9, -9], maximum: [9, 9, 9]}}, variables: [{}]}}"""
TRIANGLE = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nvn 0 0 {}\nf 1//1 2//1 3//1\n"
MESH = '<shape type="obj" id="{}"><string name="filename" value="a.obj"/>{}</shape>'
MOVED = "{{object: {}, property: translation, minimum: [0, 0, 0], maximum: [1, 0, 0]}}"
TURNED = "{{object: {}, property: rotation, axis: [0, 0, 1], minimum: 0, maximum: 90}}"


def folder(path: Path, shapes: str, *variables: str) -> Path:
    path.mkdir(exist_ok=True)
    (path / "scene.xml").write_text(ROOM.format(shapes))
    (path / "scene.yaml").write_text(YAML.format(", ".join(variables)))
    (path / "a.obj").write_text(TRIANGLE.format(1))
    (path / "b.obj").write_text(TRIANGLE.format(-1))
    return path


GROUP = """<shape type="shapegroup" id="group"><shape type="sphere" id="ball"/></shape>
<shape type="instance" id="shown"><ref id="group"/></shape>"""
SCALED = "{object: shown, property: scale, minimum: 1, maximum: 2}"


@pytest.mark.parametrize("other", [TURNED.format("shown"), SCALED])
@pytest.mark.parametrize("first", [True, False])
def test_what_is_in_a_group_does_not_move_while_its_instance_turns(
    tmp_path: Path, other: str, first: bool
) -> None:
    activate("scalar")
    entries = (other, MOVED.format("ball"))
    scene = read_scene(folder(tmp_path, GROUP, *(entries if first else entries[::-1])))
    with pytest.raises(ValueError, match=r"an instance turns or scales .*; name the instances"):
        VariableScene(scene)
    VariableScene(read_scene(folder(tmp_path, GROUP, MOVED.format("ball"), MOVED.format("shown"))))


METER, LIGHT = '<sensor type="irradiancemeter" id="x"/>', '<emitter type="area" id="x"/>'


@pytest.mark.parametrize("carried", [METER, LIGHT])
@pytest.mark.parametrize("named", [True, False])
@pytest.mark.parametrize("moved", ["m", "other"])
def test_a_mesh_that_carries_a_sensor_or_an_emitter_stands_in_no_group(
    tmp_path: Path, carried: str, named: bool, moved: str
) -> None:
    activate("scalar")
    carrier = MESH.format("m", '<ref id="x"/>' if named else carried)
    shapes = (carried if named else "") + carrier + MESH.format("other", "")
    scene = read_scene(folder(tmp_path, shapes, MOVED.format(moved)))
    document = arranged(scene.document, scene.variables, worthwhile=0)
    (found,) = [shape for shape in load(document).shapes() if shape.id() == "m"]
    assert found.class_name() == "OBJMesh"


def test_an_apostrophe_in_an_id_is_a_sign_like_others(tmp_path: Path) -> None:
    activate("scalar")
    lamp = MESH.format("bob's lamp", '<emitter type="area"/>')
    scene = VariableScene(read_scene(folder(tmp_path, lamp, TURNED.format('"bob\'s lamp"'))))
    scene.apply([1.0])
    assert scene.scene.ray_intersect(mi.Ray3f([-0.9, 0, 4], [0, 0, -1])).is_valid()


def test_between_opposite_normals_there_are_those_of_the_nearer_key_frame(tmp_path: Path) -> None:
    activate("scalar")
    entry = "{object: m, property: key_frames, files: [a.obj, b.obj]}"
    scene = VariableScene(read_scene(folder(tmp_path, MESH.format("m", ""), entry)))
    for u, z in ((0.0, 1), (0.4, 1), (0.5, -1), (0.9, -1)):
        scene.apply([u])
        normals = np.array(mi.traverse(scene.scene)["m.vertex_normals"]).reshape(-1, 3)
        np.testing.assert_allclose(normals, [[0, 0, z]] * 3, atol=1e-6)


def test_a_camera_without_a_target_looks_where_its_rays_go(tmp_path: Path) -> None:
    activate("scalar")
    view = """{object: camera, property: look_at, minimum: [0, 0, 1, 0, 0, 1],
    maximum: [0, 0, 2, 0, 0, 3]}"""
    scene = read_scene(folder(tmp_path, MESH.format("m", ""), view))
    v = np.array([[0.0, 0.0], [1.0, 1.0]])
    for camera, at in zip(scene.cameras(v), v, strict=True):
        np.testing.assert_allclose(camera[3:], scene.camera_to_world(at)[:3, 2], atol=1e-12)


def test_a_file_without_shapes_has_nothing_to_start_with(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document = tmp_path / "scene.xml"
    document.write_text(ROOM.format('<emitter type="constant" id="sky"/>'))
    assert main([str(document), "backend=scalar"]) == 2
    said = f"{document}: it has no shape, so that there is nothing to see\n"
    assert capsys.readouterr().err == said
    assert not (tmp_path / "scene.yaml").exists()


def test_a_tiny_scene_is_given_ranges_that_vary(tmp_path: Path) -> None:
    document = tmp_path / "scene.xml"
    ball = '<shape type="sphere" id="ball"><float name="radius" value="0.001"/></shape>'
    document.write_text(ROOM.format(ball))
    assert main([str(document), "backend=scalar"]) == 0
    starter = tmp_path / "scene.yaml"
    moved = "- {object: ball, property: translation"
    text = starter.read_text()
    assert f"# {moved}" in text
    starter.write_text(text.replace(f"# {moved}", moved))
    (variable,) = [v for v in read_scene(tmp_path).variables if v.objects == ("ball",)]
    np.testing.assert_allclose(np.subtract(variable.maximum, variable.minimum)[0], 7e-4, rtol=0.1)


def test_a_material_of_an_unknown_kind_is_told_with_its_file(tmp_path: Path) -> None:
    leaf = '<bsdf type="mask" id="leaf"><bsdf type="diffuse"/></bsdf>'
    scene = read_scene(folder(tmp_path, MESH.format("m", leaf), MOVED.format("m")))
    with pytest.raises(ValueError, match=r"scene\.xml: BSDF 'leaf' is a MaskBSDF"):
        MitsubaRenderer(scene=scene, backend="scalar", patch_size=8)


@pytest.mark.parametrize(("low", "high"), [(0.01, 0.5), (0.5, 0.01)])
def test_a_metal_that_is_smooth_somewhere_is_followed(
    tmp_path: Path, low: float, high: float
) -> None:
    metal = '<bsdf type="roughconductor" id="metal"><float name="alpha" value="0.3"/></bsdf>'
    rough = f"{{object: metal, property: roughness, minimum: {min(low, high)}, maximum: 0.5}}"
    scene = read_scene(folder(tmp_path, MESH.format("m", metal), rough))
    (variable,) = scene.variables
    reversed_ = type(variable)(variable.objects, (low,), (high,))
    object.__setattr__(scene, "variables", (reversed_,))  # as releases may have it
    renderer = MitsubaRenderer(scene=scene, backend="scalar", patch_size=8, specular="traced")
    assert "throughput" in renderer.layout.names
    for u in (0.0, 1.0):
        assert renderer.image_buffers(torch.tensor([u]), resolution=8).isfinite().all()
