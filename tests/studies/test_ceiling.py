"""The study of what a choice of patches could gain, on closed formulas."""

import json
from pathlib import Path

import pandas as pd
import pytest
from omegaconf import DictConfig

from ngi.config.configuration import composed
from ngi.files.code_versions import code_version
from ngi.studies.ceiling import campaign
from ngi.studies.ceiling.runs import plan
from ngi.studies.provenance import claim

PROTOCOL = "evaluation.evaluator.protocol"

SMALL = (
    *("renderer=pockets", "data=patches", "renderer.patch_size=16", "renderer.dimensions=2"),
    *("~renderer.direct", "~renderer.specular", "budget=smoke", "trainer=fp32"),
    "model.hidden_features=16",
    "model.directions=false",
    *("resolution.start=32", "sampler.chains=4", f"{PROTOCOL}.resolution=32"),
    *("ceiling.pool=64", "ceiling.sizes=[{patches: 16, steps: 8}]", "ceiling.rounds=2"),
    *("ceiling.teacher_steps=4", "ceiling.seeds=1", "ceiling.choices.predicted.uniform_first=8"),
)


def configuration(folder: Path, *overrides: str) -> DictConfig:
    return composed(
        "experiment=ceiling",
        *SMALL,
        f"run.folder={folder}",
        f"run.references={folder}/references",
        *overrides,
    )


def test_every_run_of_a_small_study_is_done_once_and_repeats(tmp_path: Path) -> None:
    first = pd.read_csv(campaign.run_all(configuration(tmp_path / "a")))
    assert list(first["choice"]) == [
        *("uniform", "oracle", "oracle_cubed", "oracle_relative", "predicted"),
        *("oracle_weighted", "uniform"),
    ]
    assert list(first["patches"]) == [*[16] * 6, 64]
    assert (first[["hard_error", "uniform_error", "hard_tail"]] > 0).all(axis=None)
    assert first["hard_error"].nunique() == 6  # of errors so much alike cubes choose the same
    assert (first["hard_relmse"] > 0).all()  # there is no noise, and much to learn
    files = sorted((tmp_path / "a" / "runs").iterdir())
    before = [file.stat().st_mtime_ns for file in files]
    files[1].unlink()
    again = pd.read_csv(campaign.run_all(configuration(tmp_path / "a")))
    pd.testing.assert_frame_equal(first, again)
    assert [file.stat().st_mtime_ns for file in files[2:]] == before[2:]
    with pytest.raises(ValueError, match="made with a different study"):
        campaign.run_all(configuration(tmp_path / "a", "ceiling.rounds=4"))
    with pytest.raises(ValueError, match="made with a different configuration"):
        campaign.run_all(configuration(tmp_path / "a", "model.hidden_layers=4"))
    with pytest.raises(ValueError, match="made with a different protocol"):
        campaign.run_all(configuration(tmp_path / "a", f"{PROTOCOL}.resolution=48"))
    with pytest.raises(ValueError, match="made with a different choice oracle_weighted"):
        campaign.run_all(
            configuration(tmp_path / "a", "ceiling.choices.oracle_weighted.uniform_share=0.5")
        )


def test_who_renders_a_scene_and_where_it_lies_makes_no_other_study(tmp_path: Path) -> None:
    settings = ("scene=mirror", "renderer.samples_per_pixel=8")
    here = composed("experiment=ceiling", *settings)
    elsewhere = composed("experiment=ceiling", *settings, "renderer.workers=3")
    elsewhere.renderer.scene = {**here.renderer.scene, "folder": "/elsewhere/mirror"}
    for config in (here, elsewhere):
        campaign.claim(tmp_path, config, scene="a hash", backend="a backend")
    found = json.loads((tmp_path / "provenance.json").read_text())
    assert "scene" not in found["configuration"]["renderer"]
    with pytest.raises(ValueError, match="made with a different scene"):
        campaign.claim(tmp_path, here, scene="another hash", backend="a backend")


def test_a_study_that_goes_on_with_other_code_says_so_once_and_keeps_both(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def versions() -> list[str]:
        claim(tmp_path, {"scene": "a hash"}, backend="a backend", option="run.folder")
        kept = json.loads((tmp_path / "provenance.json").read_text())["commits"]
        return [entry["code"] for entry in kept]

    now = code_version()["code"]
    assert versions() == versions() == [now]
    assert not caplog.records
    other = {**code_version(), "code": "another"}
    monkeypatch.setattr("ngi.studies.provenance.code_version", lambda: other)
    assert versions() == versions() == [now, "another"]
    (record,) = caplog.records
    assert "give another run.folder" in record.getMessage()


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("ceiling.sizes=[{patches: 64, steps: 8}]", "leave no choice"),
        ("ceiling.pool=40", "multiple of 32"),
        ("reuse=by_loss", "reuse: .* reuse=by_samples"),
    ],
)
def test_what_makes_no_study_is_refused_before_anything_is_rendered(
    override: str, named: str, tmp_path: Path
) -> None:
    folder = tmp_path / "a"
    with pytest.raises(ValueError, match=named):
        campaign.run_all(configuration(folder, override))
    assert not folder.exists()


def test_a_store_that_does_not_hold_the_pool_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"a store of 40 patches does not hold the pool of 64"):
        campaign.run_all(configuration(tmp_path / "a", "reuse.store.capacity=40"))
    assert not (tmp_path / "a").exists()


def test_with_the_whole_pool_there_is_no_choice() -> None:
    sizes = [{"patches": 8, "steps": 5}, {"patches": 16, "steps": 9}]
    found = list(plan(pool=64, sizes=sizes, rounds=8, choices=["a", "b"], seeds=2))
    assert len(found) == len(set(found)) == 2 * (2 * 2 + 2)
    assert {(run.patches, run.steps) for run in found} == {(8, 5), (16, 9), (64, 5), (64, 9)}
    assert [run.choice for run in found if run.patches == 64] == ["a"] * 4
    assert [run.seed for run in found] == sorted(run.seed for run in found)
    sizes.append({"patches": 16, "steps": 5})  # as long as another: with the whole pool the same
    found = list(plan(pool=64, sizes=sizes, rounds=8, choices=["a", "b"], seeds=1))
    assert len(found) == len(set(found)) == 3 * 2 + 2


@pytest.mark.parametrize(
    ("sizes", "named"),
    [
        ([{"patches": 64, "steps": 5}], "64 patches of a pool of 64"),
        ([{"patches": 65, "steps": 5}], "65 patches of a pool of 64"),
        ([{"patches": 8, "steps": 5}] * 2, "'patches': 8, 'steps': 5} is given twice"),
        ([{"patches": 7, "steps": 5}], "7 patches do not come in 8 rounds"),
    ],
)
def test_sizes_that_make_no_study_are_refused(sizes: list[dict[str, int]], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        list(plan(pool=64, sizes=sizes, rounds=8, choices=["a"], seeds=1))


def test_without_averaged_weights_there_is_nothing_to_disagree_with(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="give averaging=exponential"):
        campaign.run_all(configuration(tmp_path, "averaging=none"))
