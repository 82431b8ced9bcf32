"""What samplers are told of patches before their paths are traced."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from ngi.explore import Importance, PredictedFromBuffers, PredictedLoss
from ngi.learn import Description, PatchSamples, Samples, TrainingStream, features
from ngi.learn.glimpses import PIXELS_APART, glimpsed_buffers
from ngi.render import AnalyticRenderer
from ngi.reuse import Epochs
from tests.learn.comparison import assert_same
from tests.learn.moving_camera import MovingCamera
from tests.learn.small_stream import CHAINS, make, steps

SIDE = 40


class Counting(AnalyticRenderer):
    """How often the scene is set up for buffers."""

    calls = 0

    def pixel_buffers(self, scene_vector: Tensor, pixels: Tensor, *, resolution: int) -> Tensor:
        self.calls += 1
        return super().pixel_buffers(scene_vector, pixels, resolution=resolution)


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

    with pytest.raises(ValueError, match="Others makes samples of another kind"):
        Others().glimpses(states(2), resolution=SIDE)


def test_features_are_mean_and_deviation_of_each_channel() -> None:
    buffers = torch.rand(5, 4, 4, 3, generator=torch.Generator().manual_seed(2))
    vectors, disagreement = torch.rand(5, 2), torch.rand(5)
    flat = buffers.numpy().reshape(5, 16, 3)
    expected = [flat.mean(1), flat.std(1, ddof=1), vectors.numpy(), disagreement[:, None].numpy()]
    found = features(buffers.to(torch.bfloat16), vectors, disagreement)
    np.testing.assert_allclose(found.numpy(), np.concatenate(expected, axis=1), atol=0.01)
    assert found.dtype == torch.float32


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_disagreement_counts_relative_to_its_mean(scale: float) -> None:
    given = torch.tensor([1.0, 2.0, 6.0])
    description = Description(
        samples=PatchSamples(renderer=renderer()), disagreement=lambda *_: scale * given
    )
    found = description(states(3), SIDE)
    torch.testing.assert_close(found[:, -1], given / 3)


def test_weights_that_agree_everywhere_tell_nothing() -> None:
    """As before the first step: no NaN."""
    description = Description(
        samples=PatchSamples(renderer=renderer()), disagreement=lambda *_: torch.zeros(3)
    )
    assert description(states(3), SIDE)[:, -1].tolist() == [1.0, 1.0, 1.0]


def stream(folder: Path, *, described: bool = True) -> TrainingStream:
    """Whose disagreement is told by a buffer."""
    made = renderer()
    sampler = (PredictedFromBuffers if described else PredictedLoss)(
        chains=CHAINS,
        candidates=16,
        importance=Importance(uniform_share=0.0, power=4.0),
        memory=64,
        trees=8,
        depth=4,
        smallest_leaf=1,
    )
    found = make(folder, sampler=sampler, renderer=made, rule=Epochs())
    found.describe = Description(
        samples=PatchSamples(renderer=made),
        disagreement=lambda buffers, _: buffers.mean(dim=(1, 2, 3)),
    )
    return found


def test_the_sampler_is_told_of_its_candidates_at_their_resolution(tmp_path: Path) -> None:
    asked: list[Any] = []
    found = stream(tmp_path)
    inner = found.describe

    def describe(looked_at: Tensor, resolution: int) -> Tensor:
        asked.append((looked_at, resolution))
        return inner(looked_at, resolution)

    found.describe = describe
    generated = [batch for batch in steps(found, 20) if batch.generated]
    assert len(asked) == found.counters.proposed_batches >= len(generated)
    for batch, (looked_at, resolution) in zip(generated, asked, strict=False):
        assert resolution == 24
        assert looked_at[:, :-2].unique(dim=0).shape[0] == 4
        chosen = torch.cat([batch.patches.scene_vector, batch.patches.position], dim=1)
        assert all((looked_at == state).all(dim=1).any() for state in chosen)


def test_a_sampler_that_does_not_ask_is_told_nothing(tmp_path: Path) -> None:
    found = stream(tmp_path, described=False)
    found.describe = lambda *_: pytest.fail("asked")
    assert sum(batch.generated for batch in steps(found, 12)) > 2


def test_without_anybody_who_tells_a_run_ends_at_once(tmp_path: Path) -> None:
    found = stream(tmp_path)
    found.describe = make(tmp_path / "other").describe
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
    assert whole.chains.seen.shape[1] == 2 * renderer().layout.channels + 3 + 1  # type: ignore[attr-defined]
