"""What the file says of specular bounces and caustics in the buffers that the network is given."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from ngi.files.resources import root
from ngi.view.run_settings import make_renderer, read_settings
from ngi.view.trained_run import TrainedRun

FOLDER = root() / "scenes" / "sphere-caustic" / "network"
CAUSTICS = {"traced": "caustics are not in it", "with_caustics": "caustics are in it"}


@pytest.fixture(scope="module")
def ours() -> TrainedRun:
    pytest.importorskip("onnx", reason="the extra 'export' is missing")
    pytest.importorskip("onnxruntime", reason="the extra 'export' is missing")
    return TrainedRun.open(FOLDER)


def told_by(run: TrainedRun) -> tuple[dict[str, str], dict[str, str]]:
    """The metadata, and in it what each buffer means."""
    from ngi.view.network_file import network_metadata

    told = network_metadata(run, 0)
    return told, {buffer["name"]: buffer["meaning"] for buffer in json.loads(told["buffers"])}


def changed(run: TrainedRun, folder: Path, **options: str) -> TrainedRun:
    """A run of the same network whose settings of specular bounces and direct light are these."""
    settings = read_settings(run.folder)
    kept = {k: v for k, v in settings["renderer"].items() if k not in ("specular", "direct")}
    settings["renderer"] = kept | options
    (folder / "settings.json").write_text(json.dumps(settings))
    return replace(run, folder=folder, renderer=make_renderer(folder, settings, run.description))


def test_a_network_of_ours_says_where_specular_bounces_lead(
    ours: TrainedRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ngi.render.specular.SPECULAR_ROUGHNESS", 0.125)
    monkeypatch.setattr("ngi.render.specular.MAX_SPECULAR_BOUNCES", 77)
    monkeypatch.setattr("ngi.render.caustics.MAX_BOUNCES", 66)
    assert ours.description is not None
    told, meanings = told_by(ours)
    assert (told["renderer.specular"], told["renderer.direct"]) == ("traced", "with_caustics")
    assert "alpha <= 0.125 at the hit" in told["specular"]
    fewer = ours.description.max_depth - 1
    assert f"after 77 bounces, or {fewer} (max_depth - 1) if" in told["specular"]
    assert "stronger branch" in told["specular"]
    assert "where the specular bounces end" in meanings["position"]
    assert "last segment" in meanings["outgoing"]
    assert "times the throughput" in meanings["emission"]
    assert "weaker branch" in meanings["emission"]
    assert CAUSTICS["with_caustics"] in meanings["direct"]
    assert "alpha <= 0.125 (> 0 for light without extent) throw" in meanings["direct"]
    assert "rough surface shows is in 'direct'" in meanings["emission"]
    assert f"at most 66 bounces, or {fewer - 1} (max_depth - 2) if" in meanings["direct"]


def test_without_limit_of_paths_there_is_that_of_bounces_alone(ours: TrainedRun) -> None:
    assert ours.description is not None
    told, _ = told_by(replace(ours, description=replace(ours.description, max_depth=-1)))
    assert "bounces, whatever is hit then" in told["specular"]
    assert "(max_depth - 1)" not in told["specular"]


@pytest.mark.parametrize("direct", ["learned", *CAUSTICS])
def test_without_traced_bounces_the_buffers_are_of_the_first_hit(
    ours: TrainedRun, tmp_path: Path, direct: str
) -> None:
    told, meanings = told_by(changed(ours, tmp_path, specular="learned", direct=direct))
    assert (told["renderer.specular"], told["renderer.direct"]) == ("learned", direct)
    assert "specular" not in told
    assert meanings["position"].startswith("world position p of the hit: ")
    assert "towards the camera" in meanings["outgoing"]
    assert meanings["emission"].endswith("emitted radiance x of the pixel, linear RGB")
    assert ("direct" in meanings) == (direct != "learned")
    assert [text in meanings.get("direct", "") for text in CAUSTICS.values()] == [
        direct == name for name in CAUSTICS
    ]


def test_emitters_on_the_weaker_branch_count_where_direct_light_is_traced(
    ours: TrainedRun, tmp_path: Path
) -> None:
    told, meanings = told_by(changed(ours, tmp_path, specular="traced", direct="learned"))
    assert told["renderer.specular"] == "traced"
    assert "times the throughput" in meanings["emission"]
    assert "weaker branch" not in meanings["emission"]


def test_a_run_of_before_there_was_either_traces_neither(ours: TrainedRun, tmp_path: Path) -> None:
    told, _ = told_by(changed(ours, tmp_path))
    assert (told["renderer.specular"], told["renderer.direct"]) == ("learned", "learned")
    assert "specular" not in told
