"""Shapes that stay are put behind one instance; the picture stays the same."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from ngi.machine.backend import activate, mi
from ngi.scene import read_scene
from ngi.scene.arrangement import arranged
from ngi.scene.kinds import KeyFrames, Material, Shape, Translation, Visibility
from ngi.scene.loading import load
from ngi.scene.scene_files import SceneFile, read_scene_file
from ngi.scene.variable_scene import VariableScene
from tests.render.box import BOX
from tests.scene.stage import moved, set_value

XML = """<scene version="3.0.0">
<emitter type="area" id="light"/>
<shape type="rectangle" id="floor"/>
<shape type="cube" id="table"><transform name="to_world"><translate y="1"/></transform></shape>
<shape type="ply" id="curtain"/>
<shape type="shapegroup" id="chair_group"><shape type="cube" id="seat"/></shape>
<shape type="instance" id="chair"><ref id="chair_group"/></shape>
<shape type="rectangle" id="lamp"><emitter type="area"/></shape>
<shape type="sphere" id="bulb"><ref id="light"/></shape>
</scene>"""


def document(xml=XML):
    return SceneFile(Path("scene.xml"), ElementTree.fromstring(xml))


def top_level(scene):
    return {(shape.get("type"), shape.get("id")) for shape in scene.root.findall("shape")}


def move(*names):
    return Translation(names, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


@pytest.mark.parametrize("variables", [[], [Material(("floor",), ("a", "b"))], [move("camera")]])
def test_nothing_is_arranged_where_no_shape_moves(variables) -> None:
    scene = document()
    assert arranged(scene, variables, worthwhile=0) is scene


@pytest.mark.parametrize(
    "variable", [move("chair"), Visibility(("chair",)), Shape(("any",), ("chair", "other"))]
)
def test_what_stays_is_one_instance_but_for_emitters(variable) -> None:
    scene = document()
    result = arranged(scene, [variable], worthwhile=0)
    assert top_level(result) == {
        ("shapegroup", "chair_group"),
        ("instance", "chair"),
        ("rectangle", "lamp"),
        ("sphere", "bulb"),
        ("shapegroup", "ngi_static_group"),
        ("instance", "ngi_static"),
    }
    group = result.root.find("shape[@id='ngi_static_group']")
    assert [shape.get("id") for shape in group] == ["floor", "table", "curtain"]
    assert top_level(scene) == top_level(document()), "the document itself was changed"


def test_a_mesh_that_moves_becomes_an_instance_with_its_place() -> None:
    activate("scalar")
    result = arranged(document(), [move("table")], worthwhile=0)
    instance = result.root.find("shape[@id='table']")
    assert instance.get("type") == "instance"
    assert instance.find("transform/translate").get("y") == "1"
    group = result.root.find(f"shape[@id='{instance.find('ref').get('id')}']")
    assert [shape.get("type") for shape in group.findall("shape")] == ["cube"]
    assert group.find("shape/transform") is None


def test_spheres_emitters_and_key_framed_meshes_move_as_they_are() -> None:
    frames = KeyFrames(("curtain",), ("a.ply", "b.ply"))
    result = arranged(document(), [move("bulb"), move("lamp"), move("floor"), frames], worthwhile=0)
    assert {
        ("sphere", "bulb"),
        ("rectangle", "lamp"),
        ("rectangle", "floor"),
        ("ply", "curtain"),
    } <= (top_level(result))


def test_the_picture_is_the_same() -> None:
    activate("scalar")
    description = read_scene(BOX)
    plain = load(description.document)
    behind = load(arranged(description.document, description.variables, worthwhile=0))
    assert len(behind.shapes()) < len(plain.shapes())
    images = [np.array(mi.render(scene, spp=4, seed=1)) for scene in (plain, behind)]
    # A path may take another turn where rounding differs.
    assert np.isclose(*images, rtol=1e-3, atol=1e-4).mean() > 0.99


def test_a_moved_mesh_turns_about_its_authored_origin(tmp_path) -> None:
    activate("scalar")
    (tmp_path / "scene.xml").write_text(
        """<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="3"/>
        </integrator><sensor type="perspective" id="camera"/>
        <shape type="cube" id="table"><transform name="to_world"><translate x="5"/></transform>
        </shape></scene>"""
    )
    (tmp_path / "scene.yaml").write_text(
        """{name: turn, scene: scene.xml, samples_per_pixel: 1, max_depth: 3,
        bounds: {minimum: [-9, -9, -9], maximum: [9, 9, 9]}, variables: [{object: table,
        property: rotation, axis: [0, 1, 0], minimum: 0, maximum: 90}]}"""
    )
    scene = VariableScene(read_scene(tmp_path))
    scene.apply([0.5])
    hit = scene.scene.ray_intersect(mi.Ray3f([5, 5, 0], [0, -1, 0]))
    assert hit.t == pytest.approx(4, abs=1e-4)
    corner = scene.scene.ray_intersect(mi.Ray3f([5 + 1.4, 5, 0], [0, -1, 0]))
    assert corner.is_valid(), "a cube turned by 45 degrees about its middle reaches to sqrt(2)"
    assert not scene.scene.ray_intersect(mi.Ray3f([5.95, 5, 0.95], [0, -1, 0])).is_valid()


@pytest.mark.parametrize(
    ("file", "factors", "origin"),
    [
        ("curtain_0.ply", {"x": -1.0}, [-0.1, 1, -0.5]),  # Mitsuba turns it inside out
        ("sheet_1.ply", {"z": 0.2}, [0.1, 1, -0.1]),  # Mitsuba makes up its smooth normals
    ],
)
def test_a_mesh_that_moves_is_the_authored_one(make_scene, file, factors, origin) -> None:
    """As it is at rest, where its to_world is that of its vertices."""
    activate("scalar")

    def edit(root) -> None:
        set_value(root, "curtain", "filename", file)
        moved("curtain", ("scale", factors))(root)

    entry = {
        "object": "curtain",
        "property": "rotation",
        "axis": [0, 1, 0],
        "minimum": 0,
        "maximum": 90,
    }
    description = read_scene(make_scene("stage", [entry], dimensions=1, edit=edit))
    plain, arranged_one = load(description.document), VariableScene(description)
    arranged_one.apply([0.0])
    for x in (-0.6, -0.2, 0.1, 0.4):
        ray = mi.Ray3f([x, 1.05, 3], [0, 0, -1])
        at_rest, moving = (s.ray_intersect(ray) for s in (plain, arranged_one.scene))
        assert at_rest.is_valid()
        np.testing.assert_allclose(moving.p, at_rest.p, atol=1e-5)
        np.testing.assert_allclose(moving.n, at_rest.n, atol=1e-5)
        np.testing.assert_allclose(moving.sh_frame.n, at_rest.sh_frame.n, atol=1e-5)
    placement = arranged_one._parameters.placement("curtain")
    np.testing.assert_allclose(placement.origin, origin, atol=1e-6)


@pytest.mark.parametrize("kind", ["linearcurve", "bsplinecurve"])
def test_a_curve_that_moves_is_as_thick_as_authored(tmp_path, kind) -> None:
    """Its radii are no part of its to_world."""
    activate("scalar")
    (tmp_path / "curve.txt").write_text("".join(f"{i} 0 0 0.1\n" for i in range(4)))
    (tmp_path / "scene.xml").write_text(
        f"""<scene version="3.0.0"><shape type="{kind}" id="hair">
        <string name="filename" value="curve.txt"/><transform name="to_world"><scale value="0.1"/>
        <translate x="2"/></transform></shape></scene>"""
    )
    document = read_scene_file(tmp_path / "scene.xml")
    for scene in (load(document), load(arranged(document, [move("hair")]))):
        hits = [scene.ray_intersect(mi.Ray3f([2.15, y, 5], [0, 0, -1])) for y in (0.09, 0.11)]
        assert [hit.is_valid() for hit in hits] == [True, False]


@pytest.mark.parametrize(
    ("mistake", "message"),
    [
        ('<transform name="to_world"><translate x="abc"/></transform>', r'value "abc"'),
        ('<transform name="to_world"><translat/></transform>', "translat"),
    ],
)
def test_a_mistake_in_the_place_of_what_moves_is_told_with_its_line(
    make_scene, mistake, message
) -> None:
    activate("scalar")

    def edit(root) -> None:
        curtain = root.find(".//*[@id='curtain']")
        curtain.remove(curtain.find("transform"))
        curtain.append(ElementTree.fromstring(mistake))

    entry = {"object": "curtain", "property": "translation", "minimum": [0, 0, 0]}
    folder = make_scene("stage", [{**entry, "maximum": [1, 0, 0]}], dimensions=1, edit=edit)
    with pytest.raises(ValueError, match=rf"scene\.xml.*line.*{message}|{message}.*line"):
        VariableScene(read_scene(folder))


def test_an_id_with_a_quotation_mark_may_move(make_scene) -> None:
    activate("scalar")

    def edit(root) -> None:
        root.find(".//*[@id='curtain']").set("id", "cur'tain")

    entry = {"object": "cur'tain", "property": "translation", "minimum": [0, 0, 0]}
    folder = make_scene("stage", [{**entry, "maximum": [1, 0, 0]}], dimensions=1, edit=edit)
    scene = VariableScene(read_scene(folder))
    scene.apply([0.5])
    instances = [instance for _, instance in scene.placed() if instance is not None]
    (instance,) = [instance for instance in instances if instance.id() == "cur'tain"]
    place = np.array(mi.traverse(instance)["to_world"].matrix).reshape(4, 4)[:3, 3]
    np.testing.assert_allclose(place, [0.6, 1, -0.5], atol=1e-6)


def test_small_scenes_keep_their_shapes_and_large_ones_do_not(tmp_path) -> None:
    named = XML.replace(
        '<shape type="ply" id="curtain"/>',
        '<shape type="ply" id="curtain"><string name="filename" value="curtain.ply"/></shape>',
    )
    assert named != XML
    (tmp_path / "curtain.ply").write_bytes(bytes(1000))
    scene = SceneFile(tmp_path / "scene.xml", ElementTree.fromstring(named))
    small = arranged(scene, [move("chair")], worthwhile=1001)
    assert top_level(small) == top_level(scene)
    large = arranged(scene, [move("chair")], worthwhile=1000)
    assert ("instance", "ngi_static") in top_level(large)
    assert ("ply", "curtain") not in top_level(large)
