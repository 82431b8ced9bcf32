"""The choices of the study of what a choice of patches could gain."""

import pytest
import torch

from ngi.explore import Importance
from ngi.studies.ceiling import choices, runs
from ngi.studies.ceiling.choices import Oracle, Predicted, errors_of
from ngi.studies.ceiling.runs import Run


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
        *_, part = worst = sorted(left, reverse=True)[:48]  # 5 % of 950 are 47.5
        share = (sum(worst) - part / 2) / sum(left)
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
