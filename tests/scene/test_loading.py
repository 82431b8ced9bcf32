"""What Mitsuba does not take is said with file, line and element that the user wrote."""

import re
from pathlib import Path

import pytest

from ngi.backend import activate
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

WRONG = [
    ('<float name="wobble" value="1"/>', 4, "<shape type='sphere' id='ball'>: Found 1 unref"),
    ('<wobble name="a"/>', 5, "<wobble name='a'>: encountered an unsupported XML element"),
    ('<bsdf type="difuse" id="m"/>', 5, "<bsdf type='difuse' id='m'>: failed to instantiate"),
]


@pytest.fixture(autouse=True)
def scalar() -> None:
    activate("scalar")


@pytest.mark.parametrize(("wrong", "line", "message"), WRONG)
def test_the_user_s_line_and_element_are_named(tmp_path: Path, wrong, line, message) -> None:
    file = tmp_path / "scene.xml"
    file.write_text(SCENE.format(wrong=wrong))
    with pytest.raises(ValueError, match=re.escape(f"{file}, line {line}: {message}")) as error:
        load(read_scene_file(file))
    assert "col " not in str(error.value)


def test_in_an_included_file_too(tmp_path: Path) -> None:
    (tmp_path / "scene.xml").write_text(
        '<scene version="3.0.0">\n<include filename="part.xml"/></scene>'
    )
    (tmp_path / "part.xml").write_text(SCENE.format(wrong="<wobble/>"))
    with pytest.raises(ValueError, match=r"part\.xml, line 5: <wobble>: encountered"):
        load(read_scene_file(tmp_path / "scene.xml"))


def test_where_this_program_has_rearranged_the_scene(tmp_path: Path) -> None:
    file = tmp_path / "scene.xml"
    file.write_text(SCENE.format(wrong='<float name="wobble" value="1"/>'))
    document = arranged(
        read_scene_file(file), (Translation(("ball",), (0, 0, 0), (1, 1, 1)),), worthwhile=0
    )
    with pytest.raises(ValueError, match=re.escape(f"{file}, line 4: <shape type='sphere'")):
        load(document)


def test_in_a_tagged_file_too(tmp_path: Path) -> None:
    file = tmp_path / "scene.xml"
    file.write_text(
        """<scene version="2.0.0">
  <integrator type="path"><integer name="max_depth" value="4"/></integrator>
  <sensor type="perspective" id="camera">
    <sampler type="independent"><integer name="sample_count" value="8"/></sampler>
    <film type="hdrfilm"><integer name="width" value="16"/>
      <integer name="height" value="16"/></film>
  </sensor>
  <shape type="sphere" id="var_ball"><float name="wobble" value="1"/></shape>
</scene>"""
    )
    description = read_release(tmp_path)
    with pytest.raises(ValueError, match=re.escape(f"{file}, line 8: <shape type='sphere' id=")):
        load(description.document)
