"""The scene.yaml that a plain Mitsuba scene starts with."""

from pathlib import Path

import pytest

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
