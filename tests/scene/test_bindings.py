"""What scene.yaml asks of a loaded scene that cannot be done is said when it is loaded."""

import copy
from xml.etree import ElementTree

import numpy as np
import pytest
import torch
from PIL import Image

from ngi.machine.backend import activate, mi
from ngi.render.exr import write_exr
from ngi.scene import read_scene
from ngi.scene.variable_scene import VariableScene
from tests.scene.stage import curtain, find, write_ply

RADIANCE = {"property": "radiance", "minimum": [0, 0, 0], "maximum": [1, 1, 1]}
ALBEDO = {"property": "albedo", "minimum": [0, 0, 0], "maximum": [1, 1, 1]}
TURN = {"property": "rotation", "axis": [0, 1, 0], "minimum": 0, "maximum": 9}
MOVE = {"property": "translation", "minimum": [0, 0, 0], "maximum": [1, 1, 1]}
AIM = {"property": "direction", "minimum": [0, 10], "maximum": [90, 80]}
LOOK = {"property": "look_at", "minimum": [0, 1, 4, 0, 1, 0], "maximum": [1, 2, 5, 1, 2, 1]}
WIDE = {"property": "fov", "minimum": 20, "maximum": 60}
CONE = {"property": "cone", "minimum": [20, 5], "maximum": [40, 15]}
HIDE = {"property": "visibility"}
FIELD = {"scene": "field"}
TEXELS = {"property": "texels", "minimum": 0, "maximum": 1}


def key_frames(object_id, *files):
    return {"object": object_id, "property": "key_frames", "files": list(files)}


def material(object_id, *choices):
    return {"object": object_id, "property": "material", "choices": list(choices)}


def texture(*choices):
    return {"object": "picture", "property": "texture", "choices": list(choices)}


def second_instance(root) -> None:
    instance = root.makeelement("shape", {"type": "instance", "id": "wedge_2"})
    instance.append(root.makeelement("ref", {"id": "wedge_group"}))
    root.append(instance)


def bumpy(root) -> None:
    back = find(root, "back")
    back.remove(back.find("ref"))
    bump = ElementTree.fromstring(
        """<bsdf type="bumpmap"><float name="scale" value="2"/><bsdf type="diffuse"/>
        <texture type="bitmap" name="arbitrary"><string name="filename" value="plain.png"/>
        </texture></bsdf>"""
    )
    back.append(bump)


def second_camera(root) -> None:
    other = copy.deepcopy(find(root, "camera"))
    other.set("id", "other")
    root.append(other)


def two_sides(root) -> None:
    other = copy.deepcopy(find(root, "blue"))
    del other.attrib["id"]
    find(root, "white").append(other)


def plastic(diffuse, coat):
    """The edit that gives `clay` these reflectances."""

    def edit(root) -> None:
        clay = find(root, "clay")
        clay.remove(clay.find("rgb"))
        clay.extend(map(ElementTree.fromstring, (diffuse, coat)))

    return edit


WHITE = '<rgb name="{}_reflectance" value="1, 1, 1"/>'
WOOD = (
    '<texture type="bitmap" name="{}_reflectance"><string name="filename" value="plain.png"/>'
    "</texture>"
)
CHEQUERED = '<texture type="checkerboard" name="diffuse_reflectance"/>'
WOODEN = plastic(WOOD.format("diffuse"), WHITE.format("specular"))
GRAINED_COAT = plastic(WHITE.format("diffuse"), WOOD.format("specular"))


def nameless(root) -> None:
    second_camera(root)
    del find(root, "camera").attrib["id"]


@pytest.fixture
def load(make_scene):
    def load_with(entry, *, scene="stage", edit=None, files=None):
        count = np.prod(entry.get("size", np.size(entry.get("minimum", 0))))
        folder = make_scene(scene, [entry], dimensions=int(count), edit=edit)
        if files is not None:
            files(folder)
        activate("scalar")
        return VariableScene(read_scene(folder))

    return load_with


def large_image(folder) -> None:
    Image.new("RGB", (7, 4)).save(folder / "dots.png")


def grey_image(folder) -> None:
    Image.new("L", (6, 4)).save(folder / "dots.png")


def linear_image(folder) -> None:
    activate("scalar")
    write_exr(folder / "linear.exr", torch.zeros(4, 6, 3))


def broken_mesh(folder) -> None:
    (folder / "curtain_1.ply").write_text("ply\nnonsense\n")


def other_mesh(folder) -> None:
    points, triangles, _ = curtain(0.1)
    write_ply(folder / "curtain_1.ply", points, triangles[::-1])


@pytest.mark.parametrize(
    ("entry", "message", "arguments"),
    [
        (
            {"object": "sky", **RADIANCE},
            r"radiance of 'sky': it holds 1 number\(s\), not a colour",
            {"scene": "field"},
        ),
        ({"object": "ball", **RADIANCE}, "'ball' .* name an emitter", {}),
        (
            {"object": "back", "property": "intensity", "minimum": 0, "maximum": 2},
            "back.*scale of 'back' is not an emitter's; name an emitter",
            {"edit": bumpy},
        ),
        ({"object": "picture", **ALBEDO}, "name a BSDF whose reflectance is given as <rgb>", {}),
        ({"object": "clay", **ALBEDO}, "'clay' .* name a BSDF whose", {"edit": WOODEN}),
        (
            {"object": "clay", **ALBEDO},
            "'clay' .* name a BSDF whose",
            {"edit": plastic(CHEQUERED, WHITE.format("specular"))},
        ),
        (
            {"object": "clay", "size": [4, 6], **TEXELS},
            "'clay' .* name a BSDF whose .* is one bitmap",
            {"edit": GRAINED_COAT},
        ),
        (
            {**texture("stripes.png", "dots.png"), "object": "clay"},
            "'clay' .* name a BSDF whose .* is one bitmap",
            {"edit": GRAINED_COAT},
        ),
        (
            {"object": "white", **ALBEDO},
            r"'white' \(TwoSided.*\) has several .*brdf_0.*brdf_1.*; give an id to the part",
            {"edit": two_sides},
        ),
        ({"object": "paint", **TURN}, "'paint' .* its place cannot vary", {}),
        (
            {"object": "wedge_mesh", **MOVE},
            "wedge_mesh.* a group that an instance turns or scales .*; name the instances",
            {},
        ),
        ({"object": "light", **HIDE}, "an emitter cannot be hidden", {}),
        ({"object": "globe", **HIDE}, "an emitter cannot be hidden", {}),
        (
            {"object": "sky", **HIDE},
            "an emitter cannot be hidden",
            {"scene": "field"},
        ),
        ({"object": "sky", **AIM}, r"'sky' is a EnvironmentMapEmitter; name one of \['Dir", FIELD),
        ({"object": "lamp", **MOVE}, "'lamp' .* to move a lamp, name its shape", {}),
        ({"object": "sky", **MOVE}, "'sky' .* infinitely far away.*vary its rotation", FIELD),
        (
            {"object": "sky", "property": "scale", "minimum": 1, "maximum": 2},
            "'sky' .* infinitely far away",
            FIELD,
        ),
        (
            {"object": "other", **LOOK},
            "'other' is not rendered: only the first sensor of the file, 'camera', is",
            {"edit": second_camera},
        ),
        ({"object": "other", **WIDE}, "the first sensor of the file is; name", {"edit": nameless}),
        ({"object": "other", **WIDE}, "'other' is not rendered", {"edit": second_camera}),
        (
            {"object": "ball", **LOOK},
            r"'ball' is a Sphere; name one of \['PerspectiveCamera'\]",
            {},
        ),
        ({"object": "ball", **WIDE}, "'ball' .*no parameter x_fov.* camera", {}),
        ({"object": "lamp", **CONE}, "'lamp' .*no parameter cutoff_angle.*name a spot light", {}),
        (
            key_frames("curtain", "curtain_0.ply", "curtain_1.ply"),
            r"/curtain_1\.ply: Mitsuba cannot load it: failed to instantiate",
            {"files": broken_mesh},
        ),
        (material("camera", "paint", "blue"), "'camera' has no shape whose material", {}),
        (material("ball", "paint", "board"), "'board' is no BSDF, so 'ball' can't have it", {}),
        (material("ball", "paint", "pain"), "no object has the id 'pain' .* nearest: paint", {}),
        (
            material("wedge", "paint", "blue"),
            r"instances \['wedge', 'wedge_2'\] share the group 'wedge_group'.* name the group",
            {"edit": second_instance},
        ),
        (
            texture("stripes.png", "dots.png"),
            r"dots.png: an image of 7 x 4 pixels and 3 8-bit .*has 6 x 4 pixels and 3 8-bit",
            {"files": large_image},
        ),
        (
            texture("stripes.png", "dots.png"),
            r"dots.png: an image of 6 x 4 pixels and 1 8-bit",
            {"files": grey_image},
        ),
        (
            texture("stripes.png", "linear.exr"),
            r"linear.exr: an image of 6 x 4 pixels and 3 (32|16)-bit",
            {"files": linear_image},
        ),
        (
            {"object": "picture", "size": [6, 4], **TEXELS},
            r"texels of size \[6, 4\], but the bitmap picture.* has \[4, 6\] rows and columns",
            {},
        ),
        ({"object": "paint", "size": [4, 6], **TEXELS}, "name a BSDF whose .* is one bitmap", {}),
        (
            key_frames("ball", "curtain_0.ply", "curtain_1.ply"),
            "'ball' is not a mesh that comes from a file",
            {},
        ),
        (
            key_frames("wedge", "wedge.ply", "globe.ply"),
            "'wedge' is not a mesh that comes from a file",
            {},
        ),
        (
            key_frames("curtain", "curtain_0.ply", "wedge.ply"),
            "wedge.ply: its triangles are not those of the mesh 'curtain'",
            {},
        ),
        (
            key_frames("curtain", "curtain_0.ply", "curtain_1.ply"),
            "curtain_1.ply: its triangles are not those",
            {"files": other_mesh},
        ),
        (
            key_frames("curtan", "curtain_0.ply", "curtain_1.ply"),
            "no object has the id 'curtan' .* nearest: curtain",
            {},
        ),
    ],
)
def test_what_cannot_vary(load, entry, message, arguments) -> None:
    with pytest.raises(ValueError, match=message):
        load(entry, **arguments)


BRIGHT = {"property": "intensity", "minimum": 0, "maximum": 2}
ROUGH = {"property": "roughness", "minimum": 0.1, "maximum": 0.5}


def name_what_is_inside(root) -> None:
    find(root, "metal").find("bsdf").set("id", "inner")


@pytest.mark.parametrize(
    ("entries", "what"),
    [
        ([{"object": "lamp", **BRIGHT}, {"object": "light", **BRIGHT}], "the intensity of light"),
        ([{"object": "lamp", **RADIANCE}, {"object": "light", **RADIANCE}], "the colour of light"),
        ([{"object": "metal", **ROUGH}, {"object": "inner", **ROUGH}], "metal.*alpha.value"),
        (
            [material("wedge", "paint", "blue"), material("wedge_group", "paint", "blue")],
            "the material of 'wedge_mesh'",
        ),
    ],
)
def test_two_variables_may_not_set_the_same_thing(make_scene, entries, what) -> None:
    """By two names, of which the last to change would win."""
    activate("scalar")
    count = sum(np.size(entry.get("minimum", 0)) for entry in entries)
    folder = make_scene("stage", entries, dimensions=count, edit=name_what_is_inside)
    first, second = (f"{entry['object']}.{entry['property']}" for entry in entries)
    with pytest.raises(ValueError, match=f"{second}: it sets {what}.*, which {first} sets too"):
        VariableScene(read_scene(folder))


def test_materials_of_two_nameless_shapes_may_vary(make_scene) -> None:
    activate("scalar")

    def edit(root) -> None:
        del find(root, "wedge_mesh").attrib["id"]  # the cube has none

    entries = [material("wedge_group", "paint", "blue"), material("cube_group", "blue", "paint")]
    scene = VariableScene(read_scene(make_scene("stage", entries, dimensions=2, edit=edit)))
    for v, names in (([0, 1], ["paint", "paint"]), ([1, 0], ["blue", "blue"])):
        scene.apply(v)
        assert [shape.bsdf().id() for shape, instance in scene.placed() if instance] == names


def test_a_group_and_what_is_in_it_are_moved_as_one(make_scene) -> None:
    """So that the way to a v makes no difference."""
    activate("scalar")
    move = {**MOVE, "maximum": [1, 0, 0]}
    entries = [{"object": name, **move} for name in ("ball", "ball_group")]

    def edit(root) -> None:
        ball, group = find(root, "ball"), ElementTree.SubElement(root, "shape", type="shapegroup")
        group.set("id", "ball_group")
        root.remove(ball)
        group.append(ball)
        instance = ElementTree.SubElement(root, "shape", type="instance", id="shown")
        place = ElementTree.SubElement(instance, "transform", name="to_world")
        ElementTree.SubElement(place, "translate", x="0.5")  # along the same axes
        ElementTree.SubElement(instance, "ref", id="ball_group")

    scene = VariableScene(read_scene(make_scene("stage", entries, dimensions=2, edit=edit)))
    places = []
    for v in ([0, 0], [1, 0], [1, 1], [1, 0]):
        scene.apply(v)
        ball = next(shape for shape in scene.shapes if shape.id() == "ball")
        places.append(round(float(np.ravel(ball.bbox().center())[0]), 4))
    assert places == [0, 1, 2, 1]


def test_a_group_of_several_shapes_does_not_move_as_one(load) -> None:
    """One of them would walk away."""

    def edit(root) -> None:
        ball, group = find(root, "ball"), ElementTree.SubElement(root, "shape", type="shapegroup")
        group.set("id", "balls")
        second = copy.deepcopy(ball)
        second.set("id", "second")
        root.remove(ball)
        group.extend([ball, second])
        instance = ElementTree.SubElement(root, "shape", type="instance", id="shown")
        ElementTree.SubElement(instance, "ref", id="balls")

    with pytest.raises(ValueError, match=r"'balls' is a group of several shapes.*instances"):
        load({"object": "balls", **MOVE}, edit=edit)


def own_material(bsdf):
    """The edit that gives the curtain a BSDF of its own, without an id."""

    def edit(root) -> None:
        mesh = find(root, "curtain")
        mesh.remove(mesh.find("ref"))
        mesh.append(ElementTree.fromstring(bsdf))

    return edit


def test_a_mesh_that_moves_has_its_other_properties_by_its_id(make_scene) -> None:
    activate("scalar")
    entries = [{"object": "curtain", **ALBEDO}, {"object": "curtain", **MOVE}]
    plain = own_material(f'<bsdf type="diffuse">{WHITE.format("").replace("_", "")}</bsdf>')
    scene = VariableScene(read_scene(make_scene("stage", entries, dimensions=6, edit=plain)))
    scene.apply([0.25, 0.5, 0.75, 1, 0, 0])
    (shape,) = [shape for shape in scene.shapes if shape.id() == "ngi_mesh_curtain"]
    reflectance = mi.traverse(shape.bsdf())["reflectance.value"]
    np.testing.assert_allclose(np.ravel(reflectance), [0.25, 0.5, 0.75], atol=1e-6)
    coat = f"{WOOD.format('diffuse')}{WHITE.format('specular')}"
    wooden = own_material(f'<bsdf type="plastic">{coat}</bsdf>')
    with pytest.raises(ValueError, match=r"'curtain' \(PLYMesh\) .* name a BSDF whose reflectance"):
        VariableScene(read_scene(make_scene("stage", entries, dimensions=6, edit=wooden)))


def test_two_cameras_may_be_led_together(load) -> None:
    scene = load({"object": ["camera", "other"], **LOOK}, edit=second_camera)
    scene.apply(np.ones(6))
    for sensor in scene.scene.sensors():
        place = np.array(mi.traverse(sensor)["to_world"].matrix).reshape(4, 4)[:3, 3]
        np.testing.assert_allclose(place, [1, 2, 5], atol=1e-6)


def test_a_scene_without_a_camera_loads(load) -> None:
    scene = load({"object": "paint", **ALBEDO}, edit=lambda root: root.remove(find(root, "camera")))
    scene.apply([1, 0.5, 0])
    reflectance = mi.traverse(scene.scene)["paint.reflectance.value"]
    np.testing.assert_allclose(np.ravel(reflectance), [1, 0.5, 0], atol=1e-6)


def test_two_variables_may_set_two_things_of_one_object(make_scene) -> None:
    activate("scalar")
    entries = [{"object": "lamp", **BRIGHT}, {"object": "light", **RADIANCE}]
    scene = VariableScene(read_scene(make_scene("stage", entries, dimensions=4)))
    scene.apply([0.25, 1, 0.5, 0])
    radiance = mi.traverse(scene.scene)["light.emitter.radiance.value"]
    np.testing.assert_allclose(np.ravel(radiance), [0.5, 0.25, 0], atol=1e-6)


def test_frames_are_those_of_the_mesh_in_its_place(load) -> None:
    scene = load(key_frames("curtain", "curtain_0.ply", "curtain_1.ply"))
    scene.apply([1])
    points, _, _ = curtain(0.6)
    vertices = np.array(mi.traverse(scene.scene)["curtain.vertex_positions"]).reshape(-1, 3)
    np.testing.assert_allclose(vertices, 0.8 * points + [0.1, 1, -0.5], atol=1e-6)


def test_default_pivot_is_where_the_object_stands(load) -> None:
    for object_id, origin in (
        ("globe", [-0.6, 0.6, 0.2]),
        ("light", [0, 2.2, 0]),
        ("ball", [0, 0.4, 0]),
        ("wedge", [0.5, 0.3, 0]),
        ("curtain", [0.1, 1, -0.5]),
    ):
        scene = load({"object": object_id, **TURN})
        placement = scene._parameters.placement(object_id)
        np.testing.assert_allclose(placement.origin, origin, atol=1e-6)
