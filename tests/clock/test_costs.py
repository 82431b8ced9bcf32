"""Costs by component, their file, and the clock that counts with them."""

import json
import statistics
from functools import cache
from multiprocessing import get_context
from pathlib import Path

import pytest
import torch

from ngi.clock.costs import NOT_AVERAGED
from ngi.clock.counters import Counters
from ngi.clock.phase_clock import PAUSES, PHASES
from ngi.config.build import run_components
from ngi.explore import Greedy, NormalPerturbation
from ngi.learn import Component, CostFile, ModelClock
from ngi.machine.backend import VARIANTS
from ngi.patches import MovingPoints
from ngi.render import AnalyticRenderer
from tests.config.command_line import CONF
from tests.learn.composition import run_config

MEASURED_BY = {"commit": "abc", "machine": {"processor": "abacus"}}


def component(name: str = "training", **settings: object) -> Component:
    return Component(name, {"model": {"layers": 3}, **settings})


def parts(*overrides: str, dimensions: int = 3) -> list[Component]:
    config = run_config(*overrides)
    renderer = AnalyticRenderer(
        dimensions=dimensions,
        patch_size=config.renderer.patch_size,
        samples_per_pixel=config.renderer.get("samples_per_pixel", 1),
        halves=config.renderer.get("halves", False),
    )
    return run_components(config, renderer=renderer)


@cache
def keys(*overrides: str, dimensions: int = 3) -> dict[str, str]:
    return {part.name: part.key for part in parts(*overrides, dimensions=dimensions)}


def test_what_a_sampler_looks_at_is_not_counted_and_that_is_said() -> None:
    with pytest.raises(ValueError, match=r"budget\.clock=wall"):
        keys("method=ours_predicted_from_buffers")


def test_samples_of_several_images_are_rendered_and_trained_on_at_a_price_of_their_own() -> None:
    image = ("renderer.patch_size=16", "resolution.start=16")
    patches = keys("method=uniform", *image)
    sets = keys("method=uniform", "data=observation_sets", *image)
    fewer = keys("method=uniform", "data=observation_sets", "data.observations=2", *image)
    for component in ("training", "exploring", "rendering"):
        assert len({patches[component], sets[component], fewer[component]}) == 3


def test_samples_of_a_class_of_one_s_own_have_a_price_of_their_own() -> None:
    shipped = keys("method=uniform")
    own = keys("method=uniform", "data._target_=theirs.TwoRenderings")
    for component in ("training", "exploring", "rendering"):
        assert shipped[component] != own[component]


def test_the_clock_counts_steps_times_costs() -> None:
    counters = Counters(iteration=10, generated_batches=4, scored_batches=3)
    costs = {
        "training": {"reuse": 1.0, "train": 2.0, "other": 0.25},
        "exploring": {"explore": 0.5, "reuse": 0.125},
        "rendering": {"render": 8.0},
        "scoring": {"score": 16.0},
    }
    clock = ModelClock(costs=costs, counters=lambda: counters)
    expected = {
        "explore": 4 * 0.5,
        "render": 4 * 8,
        "reuse": 10 * 1 + 4 * 0.125,
        "score": 3 * 16,
        "train": 10 * 2,
        "other": 10 * 0.25,
        **dict.fromkeys(PAUSES, 0),
    }
    assert clock.seconds == expected
    assert clock.run_seconds == 115
    counters.iteration += 1
    assert clock.run_seconds == 118.25
    assert set(clock.seconds) == {*PHASES, *PAUSES}
    counters.batches_refused += 2  # which were proposed and rendered for nothing
    assert clock.run_seconds == 118.25 + 2 * (0.5 + 0.125 + 8)


def test_methods_share_what_they_have_in_common() -> None:
    exploration, uniform = keys("method=active_exploration"), keys("method=uniform")
    assert set(exploration) == {"training", "exploring", "rendering", "scoring"}
    assert "scoring" not in uniform
    assert exploration.items() > uniform.items()
    assert keys("method=metropolis") == exploration
    loss = keys("method=loss_target")
    assert {name for name in loss if loss[name] != exploration[name]} == {"scoring"}


@pytest.mark.parametrize(
    ("override", "changed"),
    [
        ("seed=4", set()),
        ("optimizer.lr=0.5", set()),
        ("reuse.policy.beta=1", set()),
        ("resolution=constant", set()),
        ("budget.seconds=7", set()),
        ("model.hidden_features=16", {"training", "scoring"}),
        ("trainer=bf16", {"training", "scoring"}),
        ("optimizer=muon", {"training", "scoring"}),
        ("averaging=exponential", {"training", "scoring"}),
        ("schedule=warmup_stable_decay", set()),
        ("+renderer.samples_per_pixel=9", {"rendering"}),
        ("+renderer.direct=traced", {"rendering"}),
        ("sampler.chains=8", {"training", "exploring", "rendering", "scoring"}),
    ],
)
def test_a_cost_is_known_by_what_it_depends_on(override: str, changed: set[str]) -> None:
    before, after = keys(), keys(override)
    assert {name for name in before if before[name] != after[name]} == changed


def test_what_a_proposal_of_one_s_own_costs_is_known_by_all_its_settings() -> None:
    """What it does with them nobody here knows; of ours, none takes longer by its settings."""
    step = "sampler.proposal.standard_deviation"
    assert keys(f"{step}=0.1") == keys(f"{step}=0.2")
    own = "sampler.proposal._target_=tests.clock.test_costs.Mine"
    few, many = keys(own, f"{step}=0.1"), keys(own, f"{step}=0.2")
    assert {name for name in few if few[name] != many[name]} == {"exploring"}
    accepting = "sampler.acceptance._target_=tests.clock.test_costs.Accepting"
    strict, equal = (
        keys(accepting, f"sampler.acceptance.accept_equal={x}") for x in ("false", "true")
    )
    assert {name for name in strict if strict[name] != equal[name]} == {"exploring"}


class Mine(NormalPerturbation):
    """A proposal of one's own."""


class Accepting(Greedy):
    """So it is with what accepts."""


def test_halves_have_costs_of_their_own_and_without_them_all_is_called_as_before() -> None:
    even = "+renderer.samples_per_pixel=2"
    whole, halves = keys(even), keys(even, "+renderer.halves=true")
    assert keys(even, "+renderer.halves=false") == whole
    assert not {*whole.values()} & {*halves.values()}


def test_the_loss_whose_noise_halves_tell_is_part_of_the_price() -> None:
    even, changed = "+renderer.samples_per_pixel=2", "loss.dssim_weight=0.5"
    for halves, same in (("false", True), ("true", False)):
        words = (even, f"+renderer.halves={halves}")
        assert (keys(*words)["exploring"] == keys(*words, changed)["exploring"]) is same


def test_patches_of_one_scene_are_rendered_at_a_price_of_their_own() -> None:
    """Their scene is set up once; trained on they are as others."""
    each, of_four = (keys(f"sampler={name}") for name in ("sobol", "sobol_quarters"))
    assert {name for name in each if each[name] != of_four[name]} == {"rendering", "exploring"}


def test_a_scene_for_each_patch_is_called_as_before_there_were_others() -> None:
    samplers = {file.stem for file in (CONF / "sampler").glob("*.yaml")}
    others = samplers - {"sobol_quarters", "predicted_from_buffers"}  # this one is not counted
    assert {keys(f"sampler={name}")["rendering"] for name in others} == {keys()["rendering"]}
    [rendering] = [part for part in parts() if part.name == "rendering"]
    assert "patches_per_vector" not in rendering.settings


def test_what_a_network_is_given_of_the_scene_has_a_price() -> None:
    """Points that move, and what of v only places the camera, where its method makes use of it."""
    plain, still = keys("method=ours"), keys("method=active_exploration")

    def components(method: str, points: int, camera: slice) -> dict[str, str]:
        config = run_config(f"method={method}")
        renderer = AnalyticRenderer(dimensions=3, patch_size=config.renderer.patch_size)
        renderer.samples_per_pixel = config.renderer.get("samples_per_pixel", 1)
        renderer.moving_points = MovingPoints(
            torch.zeros(points, 3, 3), torch.zeros(points, 3), torch.ones(3)
        )
        renderer.camera_part = camera
        return {part.name: part.key for part in run_components(config, renderer=renderer)}

    nothing = slice(0, 0)
    assert components("ours", 0, nothing) == plain
    found = [components("ours", 1, nothing), components("ours", 2, nothing)]
    found.append(components("ours", 0, slice(1, 2)))
    assert len({each["training"] for each in [plain, *found]}) == 4
    assert all(each["rendering"] == plain["rendering"] for each in found)
    assert components("active_exploration", 2, slice(1, 2)) == still


def test_how_fast_and_how_far_back_is_no_question_of_cost() -> None:
    learner = ("optimizer=muon", "averaging=exponential")
    changed = ("optimizer.lr=0.5", "optimizer.adam_lr=0.5", "averaging.decay=0.5")
    assert keys(*learner) == keys(*learner, *changed)


def test_how_emission_is_added_costs_nothing() -> None:
    alone = keys("method=ours", "model=encoded_generator_emitters_alone")
    assert keys("method=ours") == alone != keys("method=ours", "model=pixel_generator")


def test_how_edges_are_shown_costs_no_step_anything() -> None:
    assert keys("method=ours") == keys("method=ours_supersampled")


def test_where_patches_are_costs_no_step_anything() -> None:
    assert keys("method=ours") == keys("method=ours_without/centred_patches")


def test_without_an_average_a_cost_is_called_as_before_there_were_any() -> None:
    assert run_config().averaging["_target_"] == NOT_AVERAGED


def test_scenes_of_other_dimensions_share_nothing() -> None:
    assert not {*keys().values()} & {*keys(dimensions=4).values()}


def test_costs_with_a_gpu_are_not_those_without(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    without = keys.__wrapped__()
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "get_device_name", lambda: "Some GPU")
    assert all(key != without[name] for name, key in keys.__wrapped__().items())


def test_costs_without_llvm_are_not_those_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    usual = keys.__wrapped__()
    monkeypatch.setattr(AnalyticRenderer, "description", f"Mitsuba 3, {VARIANTS['scalar']}")
    scalar = keys.__wrapped__()
    assert {name for name, key in scalar.items() if key != usual[name]} == {"rendering"}


def test_the_file_keeps_medians_and_quartiles(tmp_path: Path) -> None:
    file = CostFile(tmp_path / "new" / "costs.json")
    train, reuse = [5.0, 1.0, 2.0, 8.0, 4.0], [0.5, 0.25, 0.75, 0.125, 1.0]
    file.add(component(), {"train": train, "reuse": reuse}, measured_by=MEASURED_BY)
    assert file.costs([component()]) == {"training": {"train": 4.0, "reuse": 0.5}}
    entry = json.loads(file.path.read_text())["components"][component().key]
    lower, _, upper = statistics.quantiles(train, n=4, method="inclusive")
    assert entry["quartiles"]["train"] == [lower, upper]
    assert entry["samples"] == 5
    assert entry["settings"] == component().settings
    assert entry["machine"] == {"processor": "abacus"}


def test_what_is_there_stays(tmp_path: Path) -> None:
    file = CostFile(tmp_path / "costs.json")
    assert file.missing([component()]) == [component()]
    file.add(component(), {"train": [1.0]}, measured_by=MEASURED_BY)
    file.add(component(), {"train": [2.0]}, measured_by=MEASURED_BY)
    assert file.costs([component()]) == {"training": {"train": 1.0}}
    assert file.missing([component(), component(more=1)]) == [component(more=1)]


def add_many(path: Path, writer: int) -> None:
    for number in range(20):
        file, own = CostFile(path), component(writer=writer, number=number)
        file.add(own, {"train": [writer + number / 32]}, measured_by={})


def test_two_processes_share_a_file(tmp_path: Path) -> None:
    path = tmp_path / "costs.json"
    context = get_context("fork")
    writers = [context.Process(target=add_many, args=(path, writer)) for writer in (1, 2)]
    for process in writers:
        process.start()
    for process in writers:
        process.join()
    for writer in (1, 2):
        for number in range(20):
            [cost] = CostFile(path).costs([component(writer=writer, number=number)]).values()
            assert cost == {"train": writer + number / 32}


def test_a_missing_component_is_named_with_the_remedy(tmp_path: Path) -> None:
    file = CostFile(tmp_path / "costs.json")
    file.add(component(), {"train": [1.0]}, measured_by={})
    rendering = Component("rendering", {"scene": {"name": "attic"}})
    with pytest.raises(ValueError, match=r"costs\.json lacks 'rendering-.*attic.*ngi costs"):
        file.costs([component(), rendering])


@pytest.mark.parametrize("other", [{"cores": 1}, {"processor": "loom"}])
def test_costs_measured_on_different_machines_are_not_added_up(
    tmp_path: Path, other: dict[str, object]
) -> None:
    file = CostFile(tmp_path / "costs.json")
    training, rendering, scoring = map(component, ("training", "rendering", "scoring"))
    here = {"cores": 2, "processor": "abacus"}
    for part, machine in ((training, here), (rendering, {**here, **other}), (scoring, here)):
        file.add(part, {"train": [1.0]}, measured_by={"machine": machine})
    assert set(file.costs([training, scoring])) == {"training", "scoring"}
    told = f"{other.get('cores', 2)} cores of {other.get('processor', 'abacus')}"
    pattern = rf"costs\.json.*machines: .*rendering-\w+': '{told}'.*ngi costs"
    with pytest.raises(ValueError, match=pattern):
        file.costs([training, rendering, scoring])


@pytest.mark.parametrize(
    "content",
    [
        "{",
        "[]",
        '{"components": 3}',
        '{"components": {"a": {}}}',
        '{"components": {"a": {"seconds": {"train": -1}}}}',
        '{"components": {"a": {"seconds": {"train": "1"}}}}',
        '{"components": {"a": {"seconds": {"train": NaN}}}}',
    ],
)
def test_a_damaged_file_is_named(tmp_path: Path, content: str) -> None:
    file = CostFile(tmp_path / "costs.json")
    file.path.write_text(content)
    with pytest.raises(ValueError, match=r"costs\.json is damaged"):
        file.costs([])
    with pytest.raises(ValueError, match=r"costs\.json is damaged"):
        file.add(component(), {"train": [1.0]}, measured_by={})
    assert file.path.read_text() == content
