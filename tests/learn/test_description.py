"""What samplers are told of patches before their paths are traced."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from ngi.explore import Importance, PredictedFromBuffers
from ngi.learn import Description, PatchSamples, Samples, TrainingStream, distances, features
from ngi.learn.description import DARK
from ngi.learn.glimpses import PIXELS_APART, RAYS, glimpsed_buffers
from ngi.patches import Patches
from ngi.render import AnalyticRenderer
from ngi.reuse import Epochs
from tests.learn.comparison import assert_same
from tests.learn.moving_camera import MovingCamera
from tests.learn.small_stream import CHAINS, make, steps

SIDE = 40


class Counting(AnalyticRenderer):
    """How often the scene is set up for buffers, and for how many rays."""

    calls = 0
    rays = 0

    def pixel_buffers(self, *arguments: Any, **options: Any) -> Tensor:
        assert not options["caustics"]
        self.rays = options["samples"]
        self.calls += 1
        return super().pixel_buffers(*arguments, **options)


def renderer() -> Counting:
    return Counting(dimensions=3, patch_size=16)


def states(count: int, *, positions: int = 1) -> Tensor:
    """`positions` of each v, and corners of the image among the positions."""
    found = torch.rand(count, 5, generator=torch.Generator().manual_seed(0))
    found[0, -2:], found[-1, -2:] = 0.0, 1.0
    vectors = found[::positions, :-2].repeat_interleave(positions, dim=0)
    return torch.cat([vectors, found[:, -2:]], dim=1)


def test_a_glimpse_is_of_the_pixels_that_the_patch_will_have() -> None:
    looked_at = states(6)
    patches = renderer().render_patches(looked_at, resolution=SIDE, seed=0)
    found = glimpsed_buffers(looked_at, renderer(), resolution=SIDE)
    assert found.shape[:3] == (6, 4, 4)
    assert torch.equal(found, patches.buffers[:, ::PIXELS_APART, ::PIXELS_APART])


@pytest.mark.parametrize(("rays_of_patches", "rays"), [(16, RAYS), (2, 2)])
def test_a_glimpse_has_few_rays(rays_of_patches: int, rays: int) -> None:
    counting = renderer()
    counting.buffer_samples = rays_of_patches
    glimpsed_buffers(states(1), counting, resolution=SIDE)
    assert counting.rays == rays


def test_patches_of_one_scene_vector_are_looked_at_together() -> None:
    """The same, too, when groups are not equally large."""
    looked_at = states(12, positions=4)[1:]
    together, alone = renderer(), renderer()
    found = glimpsed_buffers(looked_at, together, resolution=SIDE)
    one_by_one = [glimpsed_buffers(state[None], alone, resolution=SIDE) for state in looked_at]
    assert torch.equal(found, torch.cat(one_by_one))
    assert (together.calls, alone.calls) == (3, 11)


def test_of_the_scene_vector_it_shows_what_the_network_is_given() -> None:
    moving = MovingCamera(patch_size=16)
    looked_at = torch.rand(3, 6, generator=torch.Generator().manual_seed(1))
    samples = PatchSamples(renderer=moving, camera=False)
    _, vectors = samples.glimpses(looked_at, resolution=SIDE)
    assert torch.equal(vectors, looked_at[:, samples.components])
    assert len(samples.components) == 2


def test_samples_that_are_no_patches_say_so() -> None:
    class Others(Samples):
        pass

    with pytest.raises(ValueError, match="Others does not make patches"):
        Others().glimpses(states(2), resolution=SIDE)


def test_features_are_mean_and_deviation_of_each_channel_and_of_the_answer() -> None:
    generator = torch.Generator().manual_seed(2)
    buffers = torch.rand(5, 4, 4, 3, generator=generator)
    radiance = torch.rand(5, 4, 4, 3, generator=generator)
    vectors, other = torch.rand(5, 2), torch.rand(5, 4, 4, 3, generator=generator)
    answer, other_answer = (np.log(lit.numpy() + DARK) for lit in (radiance, other))
    flat = np.concatenate([buffers.numpy(), answer], axis=-1).reshape(5, 16, 6)
    disagreement = np.abs(other_answer - answer).mean((1, 2, 3))[:, None]
    expected = [flat.mean(1), flat.std(1, ddof=1), vectors.numpy(), disagreement]
    found = features(buffers.to(torch.bfloat16), vectors, other.log1p(), radiance.log1p())
    np.testing.assert_allclose(found.numpy(), np.concatenate(expected, axis=1), atol=0.01)
    assert found.dtype == torch.float32


@pytest.mark.parametrize(
    ("radiance", "answer", "expected"),
    [
        (0.0, 0.001, 0.01),  # in units of 0.1, where it is dark
        (100.0, 101.0, 0.01),  # and of the radiance, where it is bright
        (0.0, -0.5, 0.0),  # there is no radiance below 0
    ],
)
def test_errors_count_by_their_share_where_it_is_bright(
    radiance: float, answer: float, expected: float
) -> None:
    one, other = (torch.full((2, 3, 3, 3), value).log1p() for value in (radiance, answer))
    assert distances(one, other).tolist() == pytest.approx([expected] * 2, rel=0.01)


def test_answers_of_a_network_gone_astray_are_compared_too() -> None:
    """A radiance that no float32 holds: differences are those of its logarithm."""
    one, other = (torch.full((1, 3, 3, 3), value) for value in (200.0, 150.0))
    assert distances(one, other).tolist() == [50.0]


@pytest.mark.parametrize("scale", [0.01, 1.0, 8.0])
def test_disagreement_counts_relative_to_its_mean(scale: float) -> None:
    given = torch.tensor([1.0, 2.0, 6.0])
    found = description(scale * given).at(SIDE)(states(3))
    torch.testing.assert_close(found[:, -1], given / 3, rtol=1e-3, atol=0)


def test_weights_that_agree_everywhere_tell_nothing() -> None:
    """As before the first step: no NaN."""
    assert description(torch.zeros(3)).at(SIDE)(states(3))[:, -1].tolist() == [1.0, 1.0, 1.0]


def test_of_the_two_answers_the_averaged_one_describes_a_state() -> None:
    generator = torch.Generator().manual_seed(3)
    present, averaged = (torch.rand(3, 4, 4, 3, generator=generator) for _ in range(2))
    describe = Description(
        samples=PatchSamples(renderer=renderer()),
        answers=lambda *_: (present.log1p(), averaged.log1p()),
    ).at(SIDE)
    found = describe(states(3))
    logarithms = np.log(averaged.numpy() + DARK).reshape(3, 16, 3)
    channels = renderer().layout.channels
    means, deviations = found[:, : channels + 3], found[:, channels + 3 : 2 * (channels + 3)]
    np.testing.assert_allclose(means[:, channels:], logarithms.mean(1), rtol=1e-4)
    np.testing.assert_allclose(deviations[:, channels:], logarithms.std(1, ddof=1), rtol=1e-4)


def test_errors_are_those_of_the_averaged_weights_at_few_pixels() -> None:
    """An answer that is too high by a constant of each patch, whatever the other weights say."""
    patches = make_patches(states(3))
    sparse = patches.log_radiance[:, ::PIXELS_APART, ::PIXELS_APART]
    too_high = torch.tensor([0.5, -2.0, 0.0])

    def answers(buffers: Tensor, vectors: Tensor) -> tuple[Tensor, Tensor]:
        assert torch.equal(buffers, patches.buffers[:, ::PIXELS_APART, ::PIXELS_APART])
        assert torch.equal(vectors, patches.scene_vector)
        return torch.full_like(sparse, 7.0), sparse + too_high[:, None, None, None]

    found = Description(samples=PatchSamples(renderer=renderer()), answers=answers).errors(patches)
    lit = sparse.numpy().astype(np.float64)
    answered = np.maximum(lit + too_high.numpy()[:, None, None, None], 0.0)
    ratio = (np.expm1(answered) + DARK) / (np.expm1(lit) + DARK)
    np.testing.assert_allclose(found, np.abs(np.log(ratio)).mean((1, 2, 3)), rtol=1e-4, atol=1e-6)
    assert found[0] > 0.1


def make_patches(looked_at: Tensor) -> Patches:
    rendered = renderer().render_patches(looked_at, resolution=SIDE, seed=0)
    return Patches(
        scene_vector=looked_at[:, :-2],
        position=looked_at[:, -2:],
        resolution=torch.full((len(looked_at),), SIDE),
        large_step=torch.ones(len(looked_at), dtype=torch.bool),
        buffers=rendered.buffers,
        log_radiance=rendered.log_radiance,
    )


def description(disagreement: Tensor) -> Description:
    """Of weights that disagree by so much on each of [n] images, which are dark by the averaged."""

    def answers(buffers: Tensor, _: Tensor) -> tuple[Tensor, Tensor]:
        averaged = torch.zeros(*buffers.shape[:3], 3)
        radiance = DARK * disagreement.expm1()
        return averaged + radiance.log1p()[:, None, None, None], averaged

    return Description(samples=PatchSamples(renderer=renderer()), answers=answers)


def stream(folder: Path) -> TrainingStream:
    """Whose weights disagree where a buffer says so."""
    made = renderer()
    sampler = PredictedFromBuffers(
        seed=1,
        chains=CHAINS,
        candidates=16,
        importance=Importance(uniform_share=0.0, power=4.0),
        memory=64,
        uniform_first=2 * CHAINS,
        trees=8,
        depth=4,
        smallest_leaf=1,
    )
    found = make(folder, sampler=sampler, renderer=made, rule=Epochs())
    found.description = Description(
        samples=PatchSamples(renderer=made),
        answers=lambda buffers, _: (buffers[..., :3], torch.zeros_like(buffers[..., :3])),
    )
    return found


def test_the_sampler_is_told_of_its_candidates_at_their_resolution(tmp_path: Path) -> None:
    asked: list[Any] = []

    class Asked(PatchSamples):
        def glimpses(self, states: Tensor, *, resolution: int) -> tuple[Tensor, ...]:
            asked.append((states, resolution))
            return super().glimpses(states, resolution=resolution)

    found = stream(tmp_path)
    found.description = Description(
        samples=Asked(renderer=renderer()),
        answers=lambda buffers, _: (buffers[..., :3], torch.zeros_like(buffers[..., :3])),
    )
    batches = list(steps(found, 20))
    generated = [batch for batch in batches if batch.generated]
    under_way = not batches[-1].generated
    assert len(asked) - under_way == found.counters.proposed_batches == len(generated) > 5
    for batch, (looked_at, resolution) in zip(generated, asked, strict=False):
        assert resolution == 24
        assert looked_at[:, :-2].unique(dim=0).shape[0] == 4
        chosen = torch.cat([batch.patches.scene_vector, batch.patches.position], dim=1)
        assert all((looked_at == state).all(dim=1).any() for state in chosen)


def test_the_sampler_learns_from_errors_in_place_of_training_losses(tmp_path: Path) -> None:
    found = stream(tmp_path)
    assert found.description is not None
    generated = [batch.patches for batch in steps(found, 12) if batch.generated]
    expected = torch.cat([found.description.errors(patches) for patches in generated])
    assert torch.equal(found.chains.loss, expected)  # type: ignore[attr-defined]


def test_without_anybody_who_tells_a_run_ends_at_once(tmp_path: Path) -> None:
    found = stream(tmp_path)
    found.description = None
    with pytest.raises(RuntimeError, match="nobody said what by"):
        next(iter(found))


def test_what_was_known_outlasts_an_interruption(tmp_path: Path) -> None:
    whole = stream(tmp_path / "whole")
    for _ in steps(whole, 21):
        pass
    state = whole.state_dict()
    again = stream(tmp_path / "whole")
    again.load_state_dict(state)
    for first, second in itertools.zip_longest(steps(whole, 25), steps(again, 25)):
        assert_same(vars(first.patches), vars(second.patches))
    assert torch.equal(whole.chains.seen, again.chains.seen)  # type: ignore[attr-defined]
    assert whole.chains.seen.shape[1] == 2 * (renderer().layout.channels + 3) + 3 + 1  # type: ignore[attr-defined]
