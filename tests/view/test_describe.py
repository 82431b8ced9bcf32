"""The command that describes scenes: what varies, what is left out, and cameras in walls."""

import shutil

import pytest
import yaml

from ngi.machine.backend import activate, dr, llvm_problem
from ngi.scene import read_scene
from ngi.scene import starter as first_file
from ngi.scene.clearance import camera_problems, meeting_views
from ngi.scene.variable_scene import VariableScene
from ngi.view.describe import main
from tests.render.box import BOX
from tests.scene.stage import write_ply

ROOM = """<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="3"/></integrator>
<sensor type="perspective" id="camera"><transform name="to_world">
  <lookat origin="0,1,2" target="0,1,0" up="0,1,0"/></transform>
  <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
</sensor>
<bsdf type="twosided" id="paint"><bsdf type="diffuse">
  <rgb name="reflectance" value="0.5"/></bsdf></bsdf>
<bsdf type="diffuse" id="grey"/>
<shape type="rectangle" id="floor"><transform name="to_world"><scale value="4"/>
  <rotate x="1" angle="-90"/></transform><ref id="paint"/></shape>
<shape type="sphere" id="ball"><float name="radius" value="0.5"/><ref id="paint"/></shape>
<shape type="rectangle" id="lamp"><transform name="to_world"><rotate x="1" angle="90"/>
  <translate y="4"/></transform><emitter type="area"/>
  <bsdf type="diffuse" id="shade"><rgb name="reflectance" value="0.5"/></bsdf></shape>
</scene>"""


@pytest.fixture
def room(tmp_path):
    def make(*variables):
        (tmp_path / "scene.xml").write_text(ROOM)
        entries = ",\n".join(variables)
        (tmp_path / "scene.yaml").write_text(
            "{name: room, scene: scene.xml, samples_per_pixel: 1, max_depth: 3,\n"
            f"bounds: {{minimum: [-4, 0, -4], maximum: [4, 4, 4]}}, variables: [{entries}]}}"
        )
        return tmp_path

    return make


def look_from(low, high):
    return (
        f"{{object: camera, property: look_at, minimum: [{low}, 0,1,0], maximum: [{high}, 0,1,0]}}"
    )


FREE = look_from("-1,0.8,1.5", "1,2,3")
PATH = "{object: camera, property: camera_path, keys: [[-2,1,0, 0,1,-3], [2,HEIGHT,0, 0,1,-3]]}"
MOVE_BALL = "{object: ball, property: translation, minimum: [0,0,0], maximum: [0,1,2]}"
MOVE_FLOOR = "{object: floor, property: translation, minimum: [0,0,0], maximum: [0,2,0]}"
PAINT = "{object: paint, property: albedo, minimum: [0,0,0], maximum: [1,1,1]}"

CAMERAS = {
    "a box in free air": ([FREE], None),
    "a fixed camera": ([PAINT], None),
    "a box with the ball in it": ([look_from("-1,0.1,-1", "1,0.9,3")], "reaches into the camera's"),
    "a box that a moving ball enters": ([FREE, MOVE_BALL], "reaches into the camera's range"),
    "a box that ends below the floor": ([look_from("-1,-0.2,1.5", "1,2,3")], "reaches into"),
    "a box inside the ball": ([look_from("-0.1,0,0", "0.1,0,0")], "inside an object"),
    "a box along the floor": ([look_from("1,0.003,1.5", "2,0.004,3")], "only 0.00"),
    "a fixed camera that the floor passes": ([MOVE_FLOOR], "only"),
    "a path through free air": ([PATH.replace("HEIGHT", "1.2")], None),
    "a path through the ball": ([PATH.replace("HEIGHT", "-0.5")], "reaches into"),
}


@pytest.mark.parametrize("name", CAMERAS)
def test_cameras(room, name) -> None:
    activate("scalar")
    variables, expected = CAMERAS[name]
    problems = camera_problems(VariableScene(read_scene(room(*variables))))
    if expected is None:
        assert problems == []
    elif name == "a fixed camera that the floor passes":
        assert problems == [], "at no single v does it stand exactly in the floor"
    else:
        assert problems
        assert any(expected in problem for problem in problems), problems


def test_a_scene_folder(capsys) -> None:
    assert main([str(BOX), "backend=scalar"]) == 0
    text = capsys.readouterr().out
    assert "box: 10 dimensions" in text
    assert "v[3:6]  ball.translation (x, y, z): -0.4, -0.2, -0.4 ... 0.4, 0.6, 0.4" in text
    assert "outgoing  kept: it differs from pixel to pixel" in text
    assert "roughness  kept: a variable changes it" in text
    assert "moves: ball, figure\n" in text
    assert "camera:  in free space" in text


def test_a_camera_in_geometry_is_an_error(room, capsys) -> None:
    folder = room(look_from("-1,0.1,-1", "1,0.9,3"))
    assert main([str(folder), "backend=scalar"]) == 1
    assert "error: at v = [0.0, 0.0, 0.0]: geometry reaches into" in capsys.readouterr().out


def test_a_camera_that_can_look_nowhere_is_an_error(room, capsys) -> None:
    folder = room(look_from("-1,0.8,0", "1,2,3"))
    assert main([str(folder), "backend=scalar"]) == 1
    text = capsys.readouterr().out
    assert "camera.look_at: origin and target can meet, for example at [0.0, 1.0, 0.0]" in text


@pytest.mark.parametrize(("low", "high", "meet"), [("0,0,0", "2,2,2", 1), ("0,1,0", "2,2,2", 0)])
def test_a_linked_camera_meets_its_target_where_both_are_at_once(room, low, high, meet) -> None:
    """From there to (1, 1, 1) and back for the target: in the middle, or never."""
    linked = (
        f"{{object: camera, property: look_at, minimum: [{low}, 1,1,1], "
        f"maximum: [{high}, 1,1,1], linked: true}}"
    )
    lines = meeting_views(read_scene(room(linked)))
    assert len(lines) == meet
    assert all("for example at [1.0, 1.0, 1.0]" in line for line in lines)


def test_the_rays_of_the_check_are_recorded_once(room, monkeypatch) -> None:
    """Wherever NumPy's memory happens to lie."""
    if llvm_problem() is not None:
        pytest.skip(str(llvm_problem()))
    activate("llvm")
    scene = VariableScene(read_scene(room(FREE)))
    frozen = []
    freeze = dr.freeze
    monkeypatch.setattr(dr, "freeze", lambda f: frozen.append(freeze(f)) or frozen[-1])
    assert camera_problems(scene) == []
    assert [function.n_recordings for function in frozen] == [1]


def test_geometry_out_of_bounds_is_noted(room, capsys) -> None:
    upwards = MOVE_BALL.replace("[0,1,2]", "[0,9,2]").replace("minimum: [0,0", "minimum: [0,0.5")
    assert main([str(room(FREE, upwards)), "backend=scalar"]) == 1  # it meets the camera
    text = capsys.readouterr().out
    assert "note: 'ball' reaches 5.5 out of bounds" in text
    assert text.count("note:") == 1


def test_what_is_hidden_or_a_part_of_what_moves_is_in_bounds(room, capsys) -> None:
    hide = "{object: ball, property: visibility}"
    up = "{object: ball, property: translation, minimum: [0,0.5,0], maximum: [0,0.6,0]}"
    turn = (
        "{object: box, property: rotation, axis: [0,1,0], pivot: [0,2,0], minimum: 0, maximum: 90}"
    )
    folder = room(FREE, hide, up, turn)
    text = (folder / "scene.xml").read_text()
    box = """<shape type="shapegroup" id="box_group"><shape type="cube" id="part">
        <transform name="to_world"><translate x="90"/><scale value="0.1"/></transform></shape>
        </shape><shape type="instance" id="box"><transform name="to_world">
        <translate x="DISTANCE"/><translate y="2"/></transform><ref id="box_group"/></shape>"""
    notes = {}
    for distance in ("-9", "-3"):
        placed = box.replace("DISTANCE", distance)
        (folder / "scene.xml").write_text(text.replace("</scene>", placed + "</scene>"))
        assert main([str(folder), "backend=scalar"]) == 0
        notes[distance] = [line for line in capsys.readouterr().out.splitlines() if "note:" in line]
    assert notes["-9"] == []
    assert ["'box' reaches" in line for line in notes["-3"]] == [True]


def test_what_is_hidden_within_a_group_is_in_bounds(room, capsys) -> None:
    folder = room(FREE, "{object: part, property: visibility}")
    text = (folder / "scene.xml").read_text()
    box = """<shape type="shapegroup" id="box_group"><shape type="sphere" id="part">
        <float name="radius" value="0.1"/></shape></shape>
        <shape type="instance" id="box"><transform name="to_world"><translate y="3"/></transform>
        <ref id="box_group"/></shape>"""
    (folder / "scene.xml").write_text(text.replace("</scene>", box + "</scene>"))
    assert main([str(folder), "backend=scalar"]) == 0
    assert "'box' reaches" not in capsys.readouterr().out


def test_what_turns_reaches_no_farther_than_it_does(room, capsys) -> None:
    """The corners of its box would; and instances need no id."""
    points = [[x, 0, z] for x, z in ((3.9, 0), (0, 3.9), (-3.9, 0), (0, -3.9))]
    points += [[0, 1, 0], [0, 2, 0]]
    turn = "{object: plate, property: rotation, axis: [0,1,0], minimum: 0, maximum: 90}"
    hide = "{object: ball, property: visibility}"
    up = "{object: ball, property: translation, minimum: [0,0.5,0], maximum: [0,0.6,0]}"
    folder = room(FREE, turn, hide, up)
    write_ply(folder / "plate.ply", points, [(0, 1, 4), (1, 2, 4), (2, 3, 5), (3, 0, 5)])
    more = """<shape type="ply" id="plate"><string name="filename" value="plate.ply"/></shape>
        <shape type="shapegroup" id="group"><shape type="rectangle"/></shape>
        <shape type="instance"><transform name="to_world"><translate x="OUT" y="3" z="-3"/>
        </transform><ref id="group"/></shape></scene>"""
    text = (folder / "scene.xml").read_text()
    for out, expected in (("-2", []), ("-6", ["reaches 3 out of bounds"])):
        (folder / "scene.xml").write_text(text.replace("</scene>", more.replace("OUT", out)))
        main([str(folder), "backend=scalar"])
        notes = [line for line in capsys.readouterr().out.splitlines() if "note:" in line]
        assert [part in note for part, note in zip(expected, notes, strict=True)] == [True] * len(
            expected
        )


@pytest.mark.parametrize("given", ["scene.xml", "."])
def test_a_plain_file_becomes_a_variable_scene(room, given, capsys) -> None:
    folder = room(FREE)
    (folder / "scene.yaml").unlink()
    assert main([str(folder / given), "backend=scalar"]) == 0
    text = capsys.readouterr().out
    assert "camera: look_at" in text
    assert "paint: albedo" in text
    assert "shade: albedo" in text, "it stands inside its shape"
    assert "grey" not in text, "its reflectance is no colour"
    assert "ball: translation, rotation, scale, visibility" in text
    assert "lamp: translation, rotation, scale, intensity" in text
    starter = (folder / "scene.yaml").read_text()
    description = read_scene(folder)
    assert description.component_names == tuple(
        f"camera.look_at.{name}"
        for name in ("origin_x", "origin_y", "origin_z", "target_x", "target_z")
    )
    assert len(description.hard_frames) == 10
    # Every candidate is an entry that works once its # is gone.
    lines = [line.replace("  # - ", "  - ") for line in starter.splitlines()]
    (folder / "scene.yaml").write_text("\n".join(lines))
    everything = read_scene(folder)
    entries = yaml.safe_load((folder / "scene.yaml").read_text())["variables"]
    assert len(everything.variables) == len(entries) > 10
    VariableScene(everything).apply([0.5] * everything.dimensions)
    before = (folder / "scene.yaml").read_text()
    assert main([str(folder / "scene.xml"), "backend=scalar"]) == 0
    assert (folder / "scene.yaml").read_text() == before, "an existing scene.yaml was overwritten"


OPEN = """<scene version="3.0.0"><integrator type="path"/>
<sensor type="perspective" id="camera"><transform name="to_world">
  <lookat origin="0,-3,1" target="0,0,1" up="0,0,1"/></transform>
  <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
</sensor>
<emitter type="sunsky" id="sky"/>
<shape type="rectangle" id="ground"/>
<shape type="rectangle" id="screen"><emitter type="area"><texture type="checkerboard"
  name="radiance"/></emitter></shape>
</scene>"""


def test_of_a_flat_scene_under_the_sky_every_candidate_works(tmp_path) -> None:
    """The sky turns and has no intensity, nor has what glows by a texture; z is up."""
    document = tmp_path / "scene.xml"
    document.write_text(OPEN)
    assert main([str(document), "backend=scalar"]) == 0
    starter = (tmp_path / "scene.yaml").read_text()
    assert "object: sky, property: rotation" in starter
    assert "intensity" not in starter
    (tmp_path / "scene.yaml").write_text(starter.replace("  # - ", "  - "))
    scene = VariableScene(read_scene(tmp_path))
    scene.apply([0.5] * scene.description.dimensions)
    (view,) = [v for v in scene.description.variables if v.kind == "look_at"]
    assert view.minimum[5] == view.maximum[5]
    assert view.minimum[4] < view.maximum[4]


def test_a_scene_yaml_is_its_folder(room, capsys) -> None:
    folder = room(FREE)
    outputs = []
    for given in (folder, folder / "scene.yaml"):
        assert main([str(given), "backend=scalar"]) == 0
        outputs.append(capsys.readouterr().out)
    assert outputs[0] == outputs[1]


def test_a_name_with_var_in_it_makes_no_file_the_authors(room, capsys) -> None:
    folder = room(FREE)
    (folder / "scene.yaml").unlink()
    document = folder / "scene.xml"
    document.write_text(document.read_text().replace('id="paint"', 'id="oak_var_2"'))
    assert main([str(document), "backend=scalar"]) == 0
    assert "oak_var_2: albedo" in capsys.readouterr().out


def test_numbers_of_large_scenes_are_numbers_to_yaml() -> None:
    values = [1e4, -12345.0, 1e-5, 0.0, 1e20, 0.123456]
    written = yaml.safe_load(first_file._list(values))
    assert [float(f"{x:.4g}") for x in values] == written
    assert all(isinstance(x, int | float) for x in written)


@pytest.mark.parametrize("name", ["2024", "a: b", "yes", "#3", "it's, {odd}"])
def test_names_that_yaml_takes_for_something_else_are_quoted(room, name) -> None:
    folder = room(FREE)
    (folder / "scene.yaml").unlink()
    text = (folder / "scene.xml").read_text()
    assert '"ball"' in text
    (folder / "scene.xml").write_text(text.replace('"ball"', f'"{name}"'))
    moved = folder.rename(folder.parent / name)
    assert main([f"scene={moved / 'scene.xml'}", "backend=scalar"]) == 0
    starter = (moved / "scene.yaml").read_text().replace("  # - ", "  - ")
    (moved / "scene.yaml").write_text(starter)
    described = read_scene(moved)
    assert described.name == name
    assert any(name in variable.objects for variable in described.variables)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda folder: (folder / "scene.yaml").write_text("name: ["), "broken YAML"),
        (lambda folder: (folder / "scene.xml").unlink(), "names 'scene.xml', which does not exist"),
        (lambda folder: shutil.rmtree(folder), "no scene of this name"),
    ],
)
def test_errors_are_one_line(room, capsys, edit, message) -> None:
    folder = room(FREE)
    edit(folder)
    assert main([str(folder), "backend=scalar"]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


MASKED = """<bsdf type="mask" id="grey"><float name="opacity" value="0.5"/>
<bsdf type="diffuse"/></bsdf>"""


def test_what_no_renderer_takes_is_said_before_anything_is_trained(room, capsys) -> None:
    folder = room(PAINT)
    text = ROOM.replace('<integer name="width" value="8"/>', '<integer name="width" value="16"/>')
    (folder / "scene.xml").write_text(text)
    assert main([str(folder)]) == 2
    assert "the film is 16 x 8; make width and height equal" in capsys.readouterr().err
    shown = text.replace('<bsdf type="diffuse" id="grey"/>', MASKED)
    ball = '<float name="radius" value="0.5"/><ref id='
    shown = shown.replace(f'{ball}"paint"/>', f'{ball}"grey"/>')
    (folder / "scene.xml").write_text(shown)
    assert main([str(folder / "scene.xml")]) == 0
    told = capsys.readouterr().out
    assert "cannot be trained on as it is" in told
    assert "the film is 16 x 8" in told
    assert "MaskBSDF" in told
