import math
from dataclasses import fields, replace
from pathlib import Path

import pytest
import torch

from ngi.render import PocketRenderer
from ngi.studies.exploration_map import training
from ngi.studies.exploration_map.plan import OUR_LEARNER, PLANS, Plan
from ngi.studies.exploration_map.setting import METHODS, Method, Setting
from ngi.studies.exploration_map.test_set import TestSet
from ngi.studies.exploration_map.training import configuration, train

AVERAGED = "averaging=exponential"
SMALL = Plan(settings=(), steps=12, evaluations=3, frames=20)
SETTING = Setting(volume=0.1, dimensions=2, active=2, hidden_features=8)


def rows(method: Method, *, seed: int = 0, plan: Plan = SMALL, setting: Setting = SETTING):
    return list(train(setting, method, seed, plan, folder=Path()))


def test_uniform_samples_are_lit_as_often_as_the_volume_says() -> None:
    plan = Plan(settings=(), steps=150, evaluations=3, frames=20)
    setting = Setting(volume=0.3, dimensions=2, active=2, sharpness=1.0, hidden_features=4)
    for row in rows(Method("uniform", reuse=False), plan=plan, setting=setting):
        deviation = (0.3 * 0.7 / (row["step"] * 16)) ** 0.5
        assert abs(row["lit"] - 0.3) < 4 * deviation


def test_batches_are_counted() -> None:
    """Without reuse every batch is new; the first has no current states to be scored."""
    last = rows(Method("loss_greedy", reuse=False))[-1]
    assert (last["step"], last["generated_batches"], last["scored_batches"]) == (12, 12, 11)
    assert rows(Method("uniform", reuse=False))[-1]["scored_batches"] == 0


def test_stored_patches_are_used_again() -> None:
    plan = Plan(settings=(), steps=60, evaluations=1, frames=20)
    (row,) = rows(Method("uniform", reuse=True), plan=plan)
    assert 20 <= row["generated_batches"] < 40  # 20 in the bootstrap


def test_evaluations_are_spread_evenly_and_runs_repeat() -> None:
    method = Method("output_gradient_metropolis", reuse=True)
    first = rows(method)
    assert [row["step"] for row in first] == [4, 8, 12]
    assert first == rows(method)
    assert first != [{**row, "seed": 0} for row in rows(method, seed=1)]


def test_its_steps_are_guarded_as_those_of_every_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gradient above the average is scaled down to it, where that is what the guard says."""
    method = Method("uniform", reuse=False)
    without = rows(method)
    monkeypatch.setattr("ngi.learn.step_guard.OUTLIER", 1.0)
    assert rows(method)[0]["error_uniform"] != without[0]["error_uniform"]


def test_learning_lowers_the_error() -> None:
    plan = Plan(settings=(), steps=150, evaluations=10, frames=20)
    setting = Setting(volume=1e-3, dimensions=2, active=2, hidden_features=16)
    found = rows(Method("uniform", reuse=False), plan=plan, setting=setting)
    assert found[-1]["error_uniform"] < 0.5 * found[0]["error_uniform"]


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_methods_are_what_their_names_say(method: Method) -> None:
    config = configuration(method)
    names = {
        "uniform": ("ConstantTarget", "Always"),
        "loss_greedy": ("Loss", "Greedy"),
        "loss_metropolis": ("Loss", "Metropolis"),
        "loss_step_greedy": ("LossTimesStep", "Greedy"),
        "loss_step_metropolis": ("LossTimesStep", "Metropolis"),
        "output_gradient_greedy": ("LossTimesOutputGradient", "Greedy"),
        "output_gradient_metropolis": ("LossTimesOutputGradient", "Metropolis"),
    }
    target, acceptance = names[method.sampler]
    assert config.sampler.target._target_ == f"ngi.explore.{target}"
    assert config.sampler.acceptance._target_ == f"ngi.explore.{acceptance}"
    assert config.reuse.policy._target_.endswith("SelfTuning" if method.reuse else "Never")


@pytest.mark.parametrize("plan", PLANS.values(), ids=PLANS.keys())
def test_every_plan_can_be_composed(plan: Plan) -> None:
    for method in plan.methods:
        made = training.plain_configuration(method, plan)
        assert made.keys() >= {"data", "sampler", "reuse", "renderer"}


def test_the_long_plan_reuses_as_ours_does_and_knows_the_noise() -> None:
    plan = PLANS["ours_long"]
    for method in plan.methods:
        made = training.plain_configuration(method, plan)
        policy = "FixedProbability.by_samples" if method.reuse else "Never"
        assert made["reuse"]["policy"]["_target_"].endswith(policy)
        assert made["renderer"]["halves"] is True
    (last,) = rows(Method("predicted", reuse=True), plan=replace(plan, steps=12, evaluations=1))
    assert last["generated_batches"] < 12


def test_by_loss_differs_from_the_long_plan_in_what_stored_patches_are_drawn() -> None:
    by_loss, long = PLANS["ours_by_loss"], PLANS["ours_long"]
    assert set(by_loss.methods) == {method for method in long.methods if method.reuse}
    for method in by_loss.methods:
        made, other = (training.plain_configuration(method, plan) for plan in (by_loss, long))
        rule = made["reuse"]["store"].pop("rule")
        assert rule["_target_"] == "ngi.reuse.ByImportance"
        assert rule["importance"].items() >= {"uniform_share": 0.9, "largest_ratio": 8.0}.items()
        assert other["reuse"]["store"].pop("rule")["_target_"] == "ngi.reuse.Epochs"
        assert made == other
    assert replace(by_loss, methods=long.methods, reuse=long.reuse) == long


def test_eager_predictions_differ_in_how_states_are_drawn_from_them() -> None:
    plan = PLANS["ours_eager"]
    predicted, eager = Method("predicted", reuse=True), Method("eager", reuse=True)
    assert plan == replace(PLANS["ours_by_loss"], methods=(eager,))
    made, other = (training.plain_configuration(method, plan) for method in (eager, predicted))
    draws, usual = (each["sampler"].pop("importance") for each in (made, other))
    assert made == other
    assert draws["largest_ratio"] > usual["largest_ratio"]
    assert draws["uniform_share"] < usual["uniform_share"]


def test_chains_with_larger_steps_differ_in_nothing_else() -> None:
    plan = PLANS["ours_chains"]
    assert replace(plan, methods=PLANS["ours_long"].methods) == PLANS["ours_long"]
    for usual, large in zip(plan.methods[::2], plan.methods[1::2], strict=True):
        made, other = (training.plain_configuration(method, plan) for method in (large, usual))
        steps, small_steps = (
            each["sampler"]["proposal"].pop("large_step_probability") for each in (made, other)
        )
        assert (steps, small_steps) == (0.7, 0.3)
        assert made == other
        assert made["sampler"]["target"]["_target_"] == "ngi.explore.Loss"
        assert made["sampler"]["acceptance"]["_target_"] == "ngi.explore.Greedy"
    assert {method.reuse for method in plan.methods} == {False, True}


@pytest.mark.parametrize("sampler", ["predicted", "eager"])
def test_predictions_are_counted_as_scores_are(sampler: str) -> None:
    """One per new batch, also where chains would have nothing to be compared with yet."""
    method = Method(sampler, reuse=False)
    last = rows(method)[-1]
    assert configuration(method).sampler._target_ == "ngi.explore.PredictedLoss"
    assert (last["generated_batches"], last["scored_batches"]) == (12, 12)


def test_our_learner_follows_its_schedule_and_tests_averaged_weights(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    uniform = Method("uniform", reuse=False)
    config = configuration(uniform, OUR_LEARNER)
    assert config.optimizer._target_.endswith("MuonAdam")
    rates: list[list[float]] = []

    def noted(*arguments, optimizer, **others):
        rates.append([group["lr"] for group in optimizer.param_groups])
        return training_step(*arguments, optimizer=optimizer, **others)

    training_step = training.learn.training_step
    monkeypatch.setattr(training.learn, "training_step", noted)
    decaying = replace(SMALL, learner=("schedule=cosine", "schedule.warmup_steps=0"))
    found = rows(uniform, plan=decaying)
    expected = [0.02 + 0.98 * (1 + math.cos(math.pi * step / 12)) / 2 for step in range(12)]
    assert [rate / 2e-3 for (rate,) in rates] == pytest.approx(expected)
    averaged = rows(uniform, plan=replace(decaying, learner=(*decaying.learner, AVERAGED)))
    assert averaged[-1]["lit"] == found[-1]["lit"]
    assert averaged[-1]["error_uniform"] != found[-1]["error_uniform"]


def test_there_are_fourteen_methods_and_every_knob_is_varied() -> None:
    assert len({method.name for method in METHODS}) == 14
    settings = PLANS["full"].settings
    assert len({setting.name for setting in settings}) == len(settings)
    for field in fields(Setting):
        values = {getattr(setting, field.name) for setting in settings}
        assert len(values) >= 2, field.name
    for plan in PLANS.values():
        assert plan.steps % plan.evaluations == 0


class Shifted(torch.nn.Module):
    """Wrong by a constant that grows with v's first component."""

    def __init__(self, renderer: PocketRenderer) -> None:
        super().__init__()
        self.renderer = renderer
        self.shifts: list[float] = []

    def forward(self, buffers: torch.Tensor, scene_vector: torch.Tensor) -> torch.Tensor:
        _, radiance = self.renderer.shade(scene_vector, buffers[..., :2])
        self.shifts = scene_vector[:, 0].tolist()
        return radiance.log1p() + scene_vector[:, 0, None, None, None]


def test_errors_are_means_over_the_frames() -> None:
    renderer = PocketRenderer(**SETTING.scene, patch_size=8)
    network = Shifted(renderer)
    errors = TestSet(renderer, frames=40).errors(network)
    everywhere, inside = network.shifts[:36], network.shifts[36:]
    worst = sorted(network.shifts)[-2:]
    assert errors["error_uniform"] == pytest.approx(sum(everywhere) / 36, abs=1e-5)
    assert errors["error_pocket"] == pytest.approx(sum(inside) / 4, abs=1e-5)
    assert errors["error_tail"] == pytest.approx(sum(worst) / 2, abs=1e-5)


def test_errors_where_nothing_is_lit() -> None:
    """Too bright there by v's first component, which is as large as it is dark elsewhere."""
    renderer = PocketRenderer(**SETTING.scene, patch_size=8)
    seen = []
    network = Shifted(renderer)

    def dimmed(buffers: torch.Tensor, scene_vector: torch.Tensor) -> torch.Tensor:
        seen.append(scene_vector)
        answer = network(buffers, scene_vector)
        lit = renderer.weights(scene_vector).sum(dim=1) > 0
        return answer - 2 * (lit * scene_vector[:, 0])[:, None, None, None]

    errors = TestSet(renderer, frames=40).errors(dimmed)
    everywhere = seen[0][:36]
    dark = renderer.weights(everywhere).sum(dim=1) == 0
    assert 0 < dark.sum() < 36
    expected = everywhere[dark, 0].sum().item() / 36
    assert errors["error_dark"] == pytest.approx(expected, abs=1e-5)
    assert errors["false_light"] == pytest.approx(expected, abs=1e-5)
    assert errors["error_uniform"] == pytest.approx(everywhere[:, 0].mean().item(), abs=1e-5)


def test_a_tenth_of_the_frames_is_in_the_pockets() -> None:
    renderer = PocketRenderer(**{**SETTING.scene, "volume": 1e-4, "sharpness": 1.0}, patch_size=8)
    seen = []
    TestSet(renderer, frames=40).errors(lambda buffers, v: seen.append(v) or buffers[..., :3])
    lit = renderer.weights(seen[0]).sum(dim=1) > 0
    assert lit.tolist() == [False] * 36 + [True] * 4


def test_longer_plans_are_of_what_four_thousand_steps_do_not_teach() -> None:
    uniform, eager = PLANS["ours_longer"], PLANS["ours_eager_longer"]
    assert uniform.steps == eager.steps == 4 * PLANS["ours_long"].steps
    assert set(uniform.settings) == set(eager.settings) < set(PLANS["ours_long"].settings)
    assert {(setting.dimensions, setting.volume) for setting in uniform.settings} == {
        (32, 0.01),
        (8, 0.001),
    }
    assert replace(eager, steps=4000, settings=PLANS["ours_eager"].settings) == PLANS["ours_eager"]
    assert uniform.reuse == PLANS["ours_long"].reuse
