from torch import Tensor

from ngi.clock.phase_clock import PHASES
from ngi.learn import PatchSamples
from ngi.render import AnalyticRenderer, PatchJob
from ngi.studies.step_costs import TimedStep, rendering_seconds, step_seconds


def step(*, generated: bool = False, scored: bool = False, **seconds: float) -> TimedStep:
    return TimedStep(generated, scored, {**dict.fromkeys(PHASES, 0.0), **seconds})


GENERATED = step(generated=True, explore=1, render=100, reuse=6, train=10, other=3)
REUSED = step(explore=2, reuse=4, train=11, other=5)
SCORED = step(generated=True, scored=True, explore=1, render=50, reuse=9, train=12, score=30)
SECOND_REUSED = step(reuse=2, train=13, other=1)


def test_costs_are_differences_between_kinds_of_steps() -> None:
    measured = step_seconds([[GENERATED, REUSED, SCORED, SECOND_REUSED]])
    assert measured == {
        "training": {"reuse": [3.0], "train": [12.0], "other": [3.0]},
        "exploring": {"explore": [3.0], "reuse": [2.0]},
        "scoring": {"score": [(1 + 9 + 12 + 30) - (1 + 6 + 10)]},
    }


def test_without_scored_steps_there_is_no_cost_of_scoring() -> None:
    measured = step_seconds([[GENERATED, REUSED], [GENERATED, SECOND_REUSED]])
    assert set(measured) == {"training", "exploring"}
    assert measured["training"]["train"] == [11.0, 13.0]
    assert measured["exploring"]["explore"] == [3.0, 1.0]


def test_what_tells_noise_from_two_halves_is_counted_once() -> None:
    generated = step(generated=True, explore=1, train=10, score=7)
    scored = step(generated=True, scored=True, explore=1, train=10, score=37)
    measured = step_seconds([[generated, REUSED, scored, SECOND_REUSED]])
    assert measured["exploring"]["score"] == [7.0]
    assert measured["scoring"] == {"score": [30.0]}


def test_a_disturbed_step_gives_no_negative_cost() -> None:
    slow = step(generated=True, reuse=50, train=500)
    measured = step_seconds([[slow, REUSED, SCORED, REUSED], [GENERATED, SECOND_REUSED]])
    assert measured["scoring"] == {"score": [0.0]}
    stored_late = step(reuse=60)
    assert step_seconds([[GENERATED, stored_late]])["exploring"]["reuse"] == [0.0]


class Watched(PatchSamples):
    """Keeps what is asked for."""

    def __init__(self) -> None:
        super().__init__(renderer=AnalyticRenderer(dimensions=2, patch_size=8))
        self.asked: list[tuple[Tensor, int]] = []

    def start_patches(self, states: Tensor, *, resolution: int, seed: int) -> PatchJob:
        self.asked.append((states, resolution))
        return super().start_patches(states, resolution=resolution, seed=seed)


def test_rendering_is_timed_at_new_states_of_the_whole_scene() -> None:
    samples = Watched()
    seconds = rendering_seconds(samples, count=4, patches_per_vector=1, seconds=0.0)
    asked = samples.asked
    assert len(seconds["render"]) == 3
    assert len(asked) == 4, "the first is no timing"
    assert all(states.shape == (4, 4) and resolution == 32 for states, resolution in asked)
    numbers = {float(number) for states, _ in asked for number in states.flatten()}
    assert len(numbers) == 64
    assert min(numbers) < 0.1
    assert max(numbers) > 0.9


def test_patches_of_one_scene_are_timed_one_after_the_other() -> None:
    samples = Watched()
    rendering_seconds(samples, count=8, patches_per_vector=4, seconds=0.0)
    for states, _ in samples.asked:
        vectors, patches = states[:, :-2].unique_consecutive(dim=0, return_counts=True)
        assert (len(vectors), patches.tolist()) == (2, [4, 4])
        assert len(states[:, -2:].unique(dim=0)) == 8, "each at a place of its own"
    assert len({float(number) for states, _ in samples.asked for number in states[:, 0]}) == 8
