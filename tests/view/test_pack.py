import json
import shutil

import pytest
import torch

from ngi.learn import checkpoint_bytes, read_checkpoint
from ngi.view.pack import main
from ngi.view.trained_run import TrainedRun
from tests.learn.command_line import run

AVERAGED = ("averaging=exponential", "budget.steps=6")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("packed")
    status, output = run(place, *AVERAGED, "run.folder=run")
    assert status == 0, output
    return place


def test_what_is_packed_shows_what_the_run_shows(folder, capsys) -> None:
    assert main([f"run={folder}/run", f"out={folder}/packed"]) == 0
    assert "step 6" in capsys.readouterr().out
    whole, packed = TrainedRun.open(folder / "run"), TrainedRun.open(folder / "packed")
    v = torch.rand(whole.renderer.dimensions, generator=torch.Generator().manual_seed(0))
    assert torch.equal(whole.radiance(v, resolution=24), packed.radiance(v, resolution=24))
    assert packed.step == 6


def test_it_says_where_it_is_from_and_holds_no_more(folder) -> None:
    assert main([f"run={folder}/run", f"out={folder}/small"]) == 0
    result = json.loads((folder / "small" / "result.json").read_text())
    assert {"commit", "metrics", "run_seconds", "scene_hash"} <= result.keys()
    assert {file.name for file in (folder / "small").iterdir()} == {
        *("last.ckpt", "result.json", "settings.json")
    }
    size = sum(file.stat().st_size for file in (folder / "small").iterdir())
    assert size < (folder / "run" / "last.ckpt").stat().st_size / 2


def test_weights_of_another_step_than_the_metrics_are_refused(folder, capsys) -> None:
    older = shutil.copytree(folder / "run", folder / "older")
    with checkpoint_bytes({**read_checkpoint(older / "last.ckpt"), "global_step": 4}) as view:
        (older / "previous.ckpt").write_bytes(view)
    (older / "last.ckpt").write_bytes(b"damaged")
    assert main([f"run={older}", f"out={folder}/wrong"]) == 2
    assert "a result.json of step 6, but its newest undamaged checkpoint" in capsys.readouterr().err
    assert not (folder / "wrong").exists()


def test_what_cannot_be_packed_is_named(folder, capsys) -> None:
    assert main([f"run={folder}/run", f"out={folder}/run"]) == 2
    assert f"out: {folder}/run is not empty" in capsys.readouterr().err
    (folder / "begun").mkdir()
    (folder / "begun" / "settings.json").write_text("{}")
    assert main([f"run={folder}/begun", f"out={folder}/new"]) == 2
    assert "is not finished, there is no result.json" in capsys.readouterr().err
    (folder / "begun" / "settings.json").write_text('{"path_tracing": {}}')
    (folder / "begun" / "result.json").write_text("{}")
    assert main([f"run={folder}/begun", f"out={folder}/new"]) == 2
    assert "has no network: it is a path tracing run" in capsys.readouterr().err
    assert not (folder / "new").exists()
