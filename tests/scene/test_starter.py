"""The scene.yaml that a plain Mitsuba scene starts with."""

from pathlib import Path

import numpy as np
import pytest

from ngi.machine.backend import activate, mi
from ngi.scene.starter import candidates
from ngi.view.describe import main

PLAIN = """<scene version="3.0.0"><integrator type="path"/><sensor type="perspective"{}/>
<shape type="sphere"/></scene>"""


def test_a_scene_whose_objects_have_no_ids_has_nothing_to_start_with(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document = tmp_path / "scene.xml"
    document.write_text(PLAIN.format(""))
    assert main([str(document), "backend=scalar"]) == 2
    said = f"{document}: no object with an id can vary; give ids to its objects\n"
    assert capsys.readouterr().err == said
    assert not (tmp_path / "scene.yaml").exists()
    document.write_text(PLAIN.format(' id="camera"'))
    assert main([str(document), "backend=scalar"]) == 0
    assert "- {object: camera, property: look_at" in (tmp_path / "scene.yaml").read_text()


RGB = '<rgb name="{}" value="0.5, 0.4, 0.3"/>'
WOOD = '<texture type="bitmap" name="{}"><string name="filename" value="wood.png"/></texture>'
DIFFUSE, COAT = "diffuse_reflectance", "specular_reflectance"


@pytest.mark.parametrize(
    ("reflectances", "offered"),
    [
        (WOOD.format(DIFFUSE) + RGB.format(COAT), ["texture"]),
        (RGB.format(DIFFUSE) + WOOD.format(COAT), ["albedo"]),
        (RGB.format(COAT), []),
    ],
)
def test_the_coat_of_a_plastic_is_not_its_albedo(tmp_path: Path, reflectances, offered) -> None:
    activate("scalar")
    mi.Bitmap(np.full((4, 4, 3), 128, np.uint8)).write(str(tmp_path / "wood.png"))
    document = tmp_path / "scene.xml"
    document.write_text(
        f"""<scene version="3.0.0"><sensor type="perspective"/><shape type="sphere">
        <bsdf type="twosided" id="table"><bsdf type="plastic">{reflectances}</bsdf></bsdf>
        </shape></scene>"""
    )
    found, _ = candidates(mi.load_file(str(document), optimize=False))
    assert [c.property for c in found if c.object == "table"] == offered
