"""The study of what a choice of patches could gain, on closed formulas."""

import json
from pathlib import Path

import pandas as pd
import pytest
import torch
from omegaconf import DictConfig

from ngi.config.configuration import composed
from ngi.explore import Importance
from ngi.files.code_versions import code_version
from ngi.studies.ceiling import campaign, choices, runs
from ngi.studies.ceiling.choices import Oracle, Predicted, errors_of
from ngi.studies.ceiling.runs import Run, plan
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
    with pytest.raises(ValueError, match="made with another study"):
        campaign.run_all(configuration(tmp_path / "a", "ceiling.rounds=4"))
    with pytest.raises(ValueError, match="made with another configuration"):
        campaign.run_all(configuration(tmp_path / "a", "model.hidden_layers=4"))
    with pytest.raises(ValueError, match="made with another protocol"):
        campaign.run_all(configuration(tmp_path / "a", f"{PROTOCOL}.resolution=48"))
    with pytest.raises(ValueError, match="made with another choice oracle_weighted"):
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
    with pytest.raises(ValueError, match="made with another scene"):
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


class Recorder:
    """A training that trains nothing, and is the more wrong the larger the patch."""

    def __init__(self) -> None:
        self.added: list[torch.Tensor] = []
        self.weights: list[torch.Tensor] = []
        self.steps: list[int] = []

    def add(self, patches, weights) -> None:
        self.added.append(patches)
        self.weights.append(weights)

    def train(self, steps: int) -> None:
        self.steps.append(steps)

    def errors(self, patches, truth):
        return (patches - truth).abs()

    predict = None


class NoEvaluator:
    def evaluate(self, predict) -> None:  # noqa: ARG002
        return None


@pytest.fixture
def recorded(monkeypatch: pytest.MonkeyPatch):
    """Does a run on a pool of numbers, whose true errors are these numbers."""
    for module in (runs, choices):
        monkeypatch.setattr(module, "chosen", lambda pool, indices: pool[indices])
    monkeypatch.setattr(runs, "measured", lambda _: {"hard_error": 1.0})

    def do(choice: Importance, *, seed: int = 0) -> Recorder:
        training = Recorder()
        pool = torch.arange(1000.0)
        run = Run(patches=50, steps=90, choice="any", seed=seed)
        row = runs.do(
            run,
            training,
            pool=pool,
            truth=torch.zeros(1000),
            choice=Oracle(choice, training=training, pool=pool, truth=torch.zeros(1000)),
            rounds=4,
            evaluator=NoEvaluator(),
        )
        left = set(range(1000)) - set(torch.cat(training.added).int().tolist())
        worst = sorted(left)[-48:]  # 5 % of 950, rounded up
        share = sum(worst) / sum(left)
        assert row == {**run._asdict(), "hard_error": 1.0, "worst_share": pytest.approx(share)}
        return training

    return do


def test_patches_and_steps_come_in_equal_rounds_and_no_patch_twice(recorded) -> None:
    training = recorded(Importance(uniform_share=0.0))
    assert [len(part) for part in training.added] == [12, 13, 12, 13]
    assert training.steps == [22, 23, 22, 23]
    assert len(set(torch.cat(training.added).tolist())) == 50


def test_choices_of_one_seed_begin_with_the_same_patches(recorded) -> None:
    uniform, oracle = (recorded(Importance(uniform_share=share)) for share in (1.0, 0.0))
    assert torch.equal(uniform.added[0], oracle.added[0])
    assert not torch.equal(uniform.added[1], oracle.added[1])
    other = recorded(Importance(uniform_share=1.0), seed=1)
    assert not torch.equal(uniform.added[0], other.added[0])


def test_the_oracle_draws_in_proportion_to_the_true_error(recorded) -> None:
    """Over 0 … 999 the mean is 499.5 for uniform draws and 666 in proportion to the error."""
    means = {
        share: torch.cat(
            [
                torch.cat(recorded(Importance(uniform_share=share), seed=s).added[1:])
                for s in range(8)
            ]
        )
        .mean()
        .item()
        for share in (1.0, 0.0)
    }
    assert means[1.0] == pytest.approx(499.5, abs=4 * 289 / 304**0.5)
    assert means[0.0] == pytest.approx(666, abs=4 * 236 / 304**0.5)


def test_weights_go_with_their_patches(recorded) -> None:
    training = recorded(Importance(uniform_share=0.2, weighted=True))
    assert training.weights[0].tolist() == [1.0] * 12
    for errors, weights in zip(training.added[1:], training.weights[1:], strict=True):
        assert torch.equal(errors.argsort(descending=True), weights.argsort())
        assert weights.max() <= 5


def test_true_errors_are_those_of_the_patches_named() -> None:
    def errors(patches, truth):
        return (patches.scene_vector[:, 0] - truth).abs()

    from ngi.patches import BufferLayout, Patches
    from ngi.reuse import CompactPatches

    layout = BufferLayout(("position",))
    blank = Patches.blank(6, layout=layout, dimensions=1, patch_size=4)
    blank.scene_vector[:, 0] = torch.arange(6.0)
    pool = CompactPatches.compress(blank, layout)
    truth = torch.tensor([0.0, 0, 0, 0, 1, 1])
    found = errors_of(torch.tensor([5, 2]), errors, pool=pool, truth=truth)
    assert found.tolist() == [4, 2]


def test_an_oracle_of_relative_errors_does_not_prefer_what_is_bright(recorded) -> None:  # noqa: ARG001
    class Shares(Recorder):
        def relative_errors(self, patches, truth):
            return self.errors(patches, truth) / patches.clamp(min=1)

    training, pool, truth = Shares(), torch.arange(1000.0), torch.zeros(1000)
    for relative, expected in ((False, [1, 10, 900]), (True, [1, 1, 1])):
        oracle = Oracle(
            Importance(uniform_share=0.0),
            relative=relative,
            training=training,
            pool=pool,
            truth=truth,
        )
        values = oracle.values(torch.tensor([1, 10, 900]), 1, torch.Generator())
        assert values.tolist() == expected


class Disagreeing(Recorder):
    """Whose patches are numbers; what is known of them tells their losses, or nothing."""

    def __init__(self, *, tells: bool) -> None:
        super().__init__()
        self.tells = tells

    def described(self, patches):
        told = patches if self.tells else torch.zeros(len(patches))
        return torch.stack([told, torch.ones(len(patches))], dim=1)

    def losses(self, patches):
        assert not self.added or not set(self.added[-1].tolist()) & set(patches.tolist())
        return (patches > 900).float() + 0.01


def predicted(
    training: Disagreeing, pool: torch.Tensor, *, per_patch: int, uniform_first: int = 0
) -> Predicted:
    return Predicted(
        importance=Importance(uniform_share=0.0),
        uniform_first=uniform_first,
        candidates_per_patch=per_patch,
        trees=16,
        depth=4,
        smallest_leaf=1,
        training=training,
        pool=pool,
        truth=torch.zeros(1000),
    )


@pytest.mark.parametrize("tells", [True, False])
@pytest.mark.usefixtures("recorded")
def test_predictions_find_what_was_lost_where_something_tells_of_it(tells: bool) -> None:
    """A tenth of all numbers is lost on; of those that are drawn after the first round, a third."""
    training = Disagreeing(tells=tells)
    pool = torch.arange(1000.0)
    choice = predicted(training, pool, per_patch=1000)
    runs.do(
        Run(patches=120, steps=4, choice="any", seed=0),
        training,
        pool=pool,
        truth=torch.zeros(1000),
        choice=choice,
        rounds=4,
        evaluator=NoEvaluator(),
    )
    later = torch.cat(training.added[1:])
    share = (later > 900).float().mean().item()
    assert len(set(later.tolist())) == 90
    assert (share > 0.25) if tells else (share < 0.15)


@pytest.mark.usefixtures("recorded")
def test_what_is_not_looked_at_is_not_chosen() -> None:
    training, pool = Disagreeing(tells=True), torch.arange(1000.0)
    choice = predicted(training, pool, per_patch=8)
    choice.chose(torch.arange(0, 1000, 50))
    values = choice.values(torch.arange(500), 5, torch.Generator().manual_seed(0))
    assert (values > 0).sum() == 40
    again = choice.values(torch.arange(500), 5, torch.Generator().manual_seed(1))
    assert ((values > 0) & (again > 0)).sum() < 15


@pytest.mark.usefixtures("recorded")
def test_at_first_all_are_as_likely() -> None:
    training, pool = Disagreeing(tells=True), torch.arange(1000.0)
    choice = predicted(training, pool, per_patch=8, uniform_first=25)
    generator = torch.Generator().manual_seed(0)
    choice.chose(torch.arange(0, 1000, 50))
    assert choice.values(torch.arange(500), 5, generator).tolist() == [1] * 500
    choice.chose(torch.arange(5))
    assert len(choice.values(torch.arange(500), 5, generator).unique()) > 1


@pytest.mark.usefixtures("recorded")
def test_what_was_looked_at_is_remembered_as_it_was_seen_and_lost_in_its_round() -> None:
    """Eight are looked at for each of five, and described once; losses of any size are alike."""
    training, pool = Disagreeing(tells=True), torch.arange(1000.0)
    asked: list[int] = []

    def described(patches: torch.Tensor) -> torch.Tensor:
        asked.append(len(patches))
        return Disagreeing.described(training, patches)

    training.described = described
    choice = predicted(training, pool, per_patch=8)
    first = torch.arange(0, 1000, 50)
    choice.chose(first)
    values = choice.values(torch.arange(500), 5, torch.Generator().manual_seed(0))
    drawn = values.nonzero().flatten()[:5]
    training.losses = lambda patches: 1000 + patches
    choice.chose(drawn)
    assert asked == [20, 40]
    seen, losses = choice.remembered
    assert seen[:, 0].tolist() == [*first, *drawn]
    assert losses[:20].mean().item() == pytest.approx(1)
    assert losses[20:].mean().item() == pytest.approx(1)


def test_without_averaged_weights_there_is_nothing_to_disagree_with(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="give averaging=exponential"):
        campaign.run_all(configuration(tmp_path, "averaging=none"))
