"""Temporal error and flicker against values that are known."""

from math import pi, sqrt

import pytest
import torch
from torch import Tensor

from ngi.evaluate.metrics import tone_map
from ngi.evaluate.temporal import Flicker, TemporalError

EPSILON = 0.01
FRAMES = 6


def noise(*shape: int, seed: int) -> Tensor:
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed))


def moving() -> Tensor:
    """[T, H, W, 3]: every pixel changes all the time, within what can be shown."""
    return 0.5 + 0.05 * noise(FRAMES, 5, 7, 3, seed=0).clamp(-3, 3)


def temporal_error(frames: Tensor, half_a: Tensor, half_b: Tensor) -> dict[str, float]:
    error = TemporalError(epsilon=EPSILON, exposure=0.0)
    for pictures in zip(frames, half_a, half_b, strict=True):
        error.add(*pictures)
    return error.result()


def flicker(frames: Tensor, exposure: float = 0.0) -> dict[str, float]:
    measure = Flicker(epsilon=EPSILON, exposure=exposure)
    for frame in frames:
        measure.add(frame)
    return measure.result()


def test_the_reference_has_no_error_against_itself() -> None:
    reference = moving()
    assert temporal_error(reference, reference, reference) == {
        "srgb": 0,
        "relative": 0,
        "mean_square": 0,
    }


def test_an_error_that_stays_the_same_costs_nothing() -> None:
    reference = moving()
    assert temporal_error(reference + 0.25, reference, reference)["relative"] < 1e-6
    still = reference[:1].repeat(FRAMES, 1, 1, 1)
    assert temporal_error(still + 0.25, still, still)["srgb"] == 0


@pytest.mark.parametrize("amplitude", [0.01, 0.1])
def test_an_error_that_alternates_costs_twice_its_amplitude(amplitude: float) -> None:
    reference = moving()
    sign = torch.tensor([1.0, -1.0]).repeat(FRAMES // 2).view(-1, 1, 1, 1)
    measured = temporal_error(reference + amplitude * sign, reference, reference)
    brightness = (reference[1:] + reference[:-1]) / 2 + EPSILON
    assert measured["relative"] == pytest.approx(2 * amplitude * (1 / brightness).mean().item())
    grey = torch.full((FRAMES, 4, 4, 3), 0.5)
    low, high = tone_map(torch.tensor([[0.5 - amplitude] * 3, [0.5 + amplitude] * 3]))[:, 0]
    measured = temporal_error(grey + amplitude * sign, grey, grey)
    assert measured["srgb"] == pytest.approx((high - low).item(), rel=1e-5)
    assert measured["mean_square"] == pytest.approx((high - low).item() ** 2, rel=1e-5)
    assert flicker(grey + amplitude * sign) == pytest.approx(
        {"srgb": (high - low).item(), "relative": 2 * amplitude / (0.5 + EPSILON)}, rel=1e-5
    )


def test_half_a_scores_what_a_perfect_network_would() -> None:
    truth = torch.full((FRAMES, 64, 64, 3), 0.4)
    half_a, half_b = (truth + 0.02 * noise(*truth.shape, seed=seed) for seed in (1, 2))
    perfect, floor = (temporal_error(x, half_a, half_b) for x in (truth, half_a))
    for name in ("srgb", "relative"):
        assert floor[name] == pytest.approx(perfect[name], rel=0.01)
    assert floor["relative"] == pytest.approx(2 / sqrt(pi) * 0.02 / sqrt(2) / 0.41, rel=0.01)


def test_the_mean_square_does_not_see_the_noise_of_the_reference() -> None:
    truth = torch.full((FRAMES, 64, 64, 3), 0.4)
    frames = truth + 0.01 * noise(*truth.shape, seed=3)
    halves = [truth + 0.02 * noise(*truth.shape, seed=seed) for seed in (1, 2)]
    clean, noisy = (temporal_error(frames, *pair) for pair in ((truth, truth), halves))
    assert noisy["mean_square"] == pytest.approx(clean["mean_square"], rel=0.05)
    assert noisy["srgb"] > 1.5 * clean["srgb"]


def test_flicker_of_normal_noise() -> None:
    frames = 0.5 + 0.01 * noise(FRAMES, 64, 64, 3, seed=4)
    assert flicker(frames)["relative"] == pytest.approx(2 / sqrt(pi) * 0.01 / 0.51, rel=0.01)
    assert flicker(frames[:1].repeat(3, 1, 1, 1)) == {"srgb": 0, "relative": 0}


def test_flicker_where_a_network_is_slightly_below_black() -> None:
    """Relative to black, not to what would change its sign."""
    frames = torch.tensor([-0.0105, -0.0101]).reshape(2, 1, 1, 1).expand(2, 4, 4, 3)
    assert flicker(frames)["relative"] == pytest.approx(0.0004 / EPSILON, rel=1e-3)


def test_exposure_counts_for_what_is_shown_only() -> None:
    frames = 0.2 + 0.01 * noise(FRAMES, 8, 8, 3, seed=5)
    brighter = flicker(frames, exposure=1.0)
    assert brighter["srgb"] == pytest.approx(flicker(2 * frames)["srgb"], rel=1e-5)
    assert brighter["relative"] == flicker(frames)["relative"]


def test_pixels_that_are_not_finite_are_not_hidden() -> None:
    reference = moving()
    frames = reference.clone()
    frames[2, 0, 0, 0] = float("nan")
    measured = [*temporal_error(frames, reference, reference).values(), *flicker(frames).values()]
    assert all(value != value for value in measured)
