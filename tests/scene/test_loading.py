"""What Mitsuba does not take is said with file, line and element that the user wrote."""

import re
from pathlib import Path

import pytest
from PIL import Image

from ngi.machine.backend import activate
from ngi.scene.arrangement import arranged
from ngi.scene.kinds import Translation
from ngi.scene.loading import load
from ngi.scene.release import read_release
from ngi.scene.scene_files import read_scene_file

SCENE = """<scene version="3.0.0">
    <default name="depth" value="4"/>
    <integrator type="path"><integer name="max_depth" value="$depth"/></integrator>
    <shape type="sphere" id="ball">
        {wrong}
    </shape>
</scene>
"""

BALL = " in <shape type='sphere' id='ball'>: "

WRONG = [
    ('<float name="wobble" value="1"/>', f"<float name='wobble' value='1'>{BALL}a <shape"),
    (
        '<vector name="speed" value="1, 2, 3"/>',
        f"<vector name='speed' value='1, 2, 3'>{BALL}a <shape",
    ),
    ('<transform name="toWorld"/>', f"<transform name='toWorld'>{BALL}a <shape"),
    ('<wobble name="a"/>', f"<wobble name='a'>{BALL}encountered an unsupported XML element"),
    ('<bsdf type="difuse" id="m"/>', "<bsdf type='difuse' id='m'>: failed to instantiate"),
    ('<bsdf type="difuse"/>', f"<bsdf type='difuse'>{BALL}failed to instantiate"),
    ('<ref id="bal"/>', "<ref id='bal'>: no object has this id (did you mean 'ball'?)"),
    ('<float name="radius" value="x"/>', f"<float name='radius' value='x'>{BALL}could not"),
    ('<float value="1"/>', f"<float value='1'>{BALL}missing required attribute"),
]


@pytest.fixture(autouse=True)
def scalar() -> None:
    activate("scalar")


@pytest.mark.parametrize(("wrong", "message"), WRONG)
def test_the_user_s_line_and_element_are_named(tmp_path: Path, wrong, message) -> None:
    file = tmp_path / "scene.xml"
    file.write_text(SCENE.format(wrong=wrong))
    with pytest.raises(ValueError, match=re.escape(f"{file}, line 5: {message}")) as error:
        load(read_scene_file(file))
    assert "col " not in str(error.value)


def test_both_places_of_what_is_there_twice(tmp_path: Path) -> None:
    file = tmp_path / "scene.xml"
    radius = '<float name="radius" value="1"/>'
    file.write_text(SCENE.format(wrong=f"{radius}\n{radius}"))
    with pytest.raises(ValueError, match=rf"line 6: .*{file}, line 5 has the same name"):
        load(read_scene_file(file))
    file.write_text(SCENE.format(wrong='<bsdf type="diffuse" id="ball"/>'))
    with pytest.raises(ValueError, match=r"duplicate ID: .ball.") as error:
        load(read_scene_file(file))
    places = re.findall(rf"{file}, line (\d)", str(error.value))
    assert sorted(places) == ["4", "5"]
    assert "col " not in str(error.value)


def test_in_an_included_file_too(tmp_path: Path) -> None:
    (tmp_path / "scene.xml").write_text(
        '<scene version="3.0.0">\n<include filename="part.xml"/></scene>'
    )
    (tmp_path / "part.xml").write_text(SCENE.format(wrong="<wobble/>"))
    with pytest.raises(
        ValueError, match=r"part\.xml, line 5: <wobble> in <shape type=.sphere. id=.ball.>: enc"
    ):
        load(read_scene_file(tmp_path / "scene.xml"))


def test_where_this_program_has_rearranged_the_scene(tmp_path: Path) -> None:
    file = tmp_path / "scene.xml"
    file.write_text(SCENE.format(wrong='<float name="wobble" value="1"/>'))
    document = arranged(
        read_scene_file(file), (Translation(("ball",), (0, 0, 0), (1, 1, 1)),), worthwhile=0
    )
    with pytest.raises(ValueError, match=re.escape(f"{file}, line 5: <float name='wobble'")):
        load(document)


TAGGED = """<scene version="2.0.0">
  <integrator type="path"><integer name="max_depth" value="4"/></integrator>
  <sensor type="perspective" id="camera">
    <sampler type="independent"><integer name="sample_count" value="8"/></sampler>
    <film type="hdrfilm"><integer name="width" value="16"/>
      <integer name="height" value="16"/></film>
  </sensor>
  <shape type="sphere" id="var_ball">{0}</shape>
  <shape type="rectangle">
    <bsdf type="diffuse" id="var_page"><integer name="num_parameters" value="1"/>
      <texture type="bitmap" name="reflectance"><string name="filename" value="a.png"/></texture>
      <texture type="bitmap" name="reflectance"><string name="filename" value="a.png"/>
        {1}</texture>
    </bsdf>
  </shape>
</scene>"""
WOBBLE = '<float name="wobble" value="1"/>'


@pytest.mark.parametrize(
    ("places", "message"),
    [
        ((WOBBLE, ""), "line 8: <float name='wobble' value='1'> in <shape type='sphere' id='var_b"),
        (("<wobble/>", ""), "line 8: <wobble> in <shape type='sphere' id='var_ball'>: encount"),
        # In the second BSDF, which this program has made of the only one.
        (("", WOBBLE), "line 13: <float name='wobble' value='1'> in <bsdf type='diffuse' id="),
    ],
)
def test_in_a_tagged_file_too(tmp_path: Path, places, message) -> None:
    file = tmp_path / "scene.xml"
    file.write_text(TAGGED.format(*places))
    Image.new("RGB", (2, 2)).save(tmp_path / "a.png")
    description = read_release(tmp_path)
    with pytest.raises(ValueError, match=re.escape(f"{file}, {message}")) as error:
        load(description.document)
    assert "col " not in str(error.value)
