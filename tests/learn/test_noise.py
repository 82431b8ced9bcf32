"""How noisy a patch is, told by its two halves, and its loss without that."""

from dataclasses import replace
from itertools import islice
from pathlib import Path

import pytest
import torch
from scipy import ndimage, stats
from torch import Tensor

from ngi.explore import Importance, PredictedLoss
from ngi.learn import training_step
from ngi.learn.batch import Batch, Feedback
from ngi.learn.noise import noise_loss, without_noise
from ngi.models import L1Dssim, SampleLoss
from ngi.patches import Patches
from ngi.render import AnalyticRenderer, PocketRenderer
from ngi.reuse import Epochs
from tests.learn.small_stream import make
from tests.learn.test_step import module

COUNT = 200
BOTH: SampleLoss = L1Dssim(l1_weight=1.0, dssim_weight=1.0, window_size=7)


def renderer(noise: float, *, halves: bool = False) -> PocketRenderer:
    """noise: of each half, or of the whole where there are none"""
    return PocketRenderer(
        dimensions=3,
        volume=0.1,
        pockets=1,
        sharpness=0.0,
        patch_size=16,
        samples_per_pixel=2 if halves else 1,
        halves=halves,
        noise=noise,
    )


def states() -> Tensor:
    return torch.rand(COUNT, 5, generator=torch.Generator().manual_seed(0))


def rendered(noise: float) -> tuple[Batch, Tensor]:
    """Patches traced in two halves, and the truth [n, P, P, 3]."""
    found = renderer(noise, halves=True).render_patches(states(), resolution=24, seed=3)
    truth = renderer(0.0).render_patches(states(), resolution=24, seed=3).log_radiance
    patches = Patches(
        scene_vector=states()[:, :-2],
        position=states()[:, -2:],
        resolution=torch.full((COUNT,), 24),
        large_step=torch.ones(COUNT, dtype=torch.bool),
        buffers=found.buffers,
        log_radiance=found.log_radiance,
    )
    ids = torch.arange(COUNT)
    return Batch(patches, ids, generated=True, current=None, first_half=found.first_half), truth


def predicted() -> PredictedLoss:
    return PredictedLoss(
        chains=4,
        candidates=8,
        importance=Importance(uniform_share=0.5),
        memory=64,
        trees=1,
        depth=1,
        smallest_leaf=1,
    )


def squared(prediction: Tensor, target: Tensor) -> Tensor:
    return (prediction - target).square().mean(dim=(1, 2, 3))


def test_a_patch_is_the_mean_of_its_halves() -> None:
    """Half of the variance of one rendering, twice its paths."""
    batch, truth = rendered(0.2)
    single = renderer(0.2).render_patches(states(), resolution=24, seed=3)
    assert batch.first_half is not None
    assert torch.equal(batch.first_half, single.log_radiance)
    ratio = squared(batch.patches.log_radiance, truth) / squared(single.log_radiance, truth)
    assert ratio.median().item() == pytest.approx(0.5, abs=0.03)
    whole = renderer(0.2, halves=True).render_patches(states(), resolution=24, seed=3)
    assert whole.paths == 2 * single.paths
    with pytest.raises(ValueError, match=r"samples_per_pixel is 3; renderer\.halves=true needs"):
        AnalyticRenderer(dimensions=1, patch_size=8, samples_per_pixel=3, halves=True)


@pytest.mark.parametrize("offset", [0.0, 0.1])
def test_squared_errors_without_noise_have_no_bias(offset: float) -> None:
    """Whatever the network answers: the truth, or too bright and too dark by the same.

    Noise darkens the mean of a logarithm, by its variance; of both signs that cancels out.
    """
    batch, truth = rendered(0.1)
    target = batch.patches.log_radiance
    measured = (squared(truth + offset, target) + squared(truth - offset, target)) / 2
    error = measured - noise_loss(squared, batch) - offset**2
    assert error.mean().abs().item() < 4 * error.std().item() / COUNT**0.5
    assert error.mean().abs().item() < 0.05 * (measured.mean().item() - offset**2)


@pytest.mark.parametrize("noise", [0.3, 1.0])
def test_the_noise_is_what_the_truth_would_lose_or_a_little_more(noise: float) -> None:
    batch, truth = rendered(noise)
    lost = BOTH(truth, batch.patches.log_radiance).mean().item()
    assert lost < noise_loss(BOTH, batch).mean().item() < 1.08 * lost


@pytest.mark.parametrize(
    ("noise", "offset", "left"),
    [
        *((0.3, 0.0, 0.1), (0.3, 0.05, 0.15), (0.3, 0.2, 0.45), (0.3, 0.8, 0.75)),
        *((1.0, 0.0, 0.1), (1.0, 0.05, 0.1), (1.0, 0.2, 0.1), (1.0, 0.8, 0.5)),
    ],
)
def test_losses_without_noise_are_closer_to_those_of_the_truth(
    noise: float, offset: float, left: float
) -> None:
    """left: of what noise adds, at most; the larger the error, the less it adds"""
    batch, truth = rendered(noise)
    without = BOTH(truth + offset, truth)
    measured = BOTH(truth + offset, batch.patches.log_radiance)
    corrected = without_noise(measured, noise_loss(BOTH, batch))
    assert (corrected - without).mean().abs() < left * (measured - without).mean().abs()


@pytest.mark.parametrize(
    ("error", "apart"), [(0.0, 1e-6), (0.5, 0.17), (1.5, 0.17), (5.0, 0.07), (20.0, 0.02)]
)
def test_a_mean_absolute_error_is_right_where_it_is_none_or_far_above_the_noise(
    error: float, apart: float
) -> None:
    """Under Gaussian noise of the deviation 1 it has the mean of a folded normal distribution."""
    measured, noise = (torch.tensor([stats.foldnorm.mean(d)]) for d in (error, 0.0))
    assert without_noise(measured, noise).item() == pytest.approx(error, abs=apart)


@pytest.mark.parametrize(("side", "window"), [(8, 5), (3, 3), (1, 1)])
def test_a_small_patch_is_blurred_over_no_more_than_itself(side: int, window: int) -> None:
    mean, half = torch.rand(2, 2, side, side, 3, generator=torch.Generator().manual_seed(1))
    layout = AnalyticRenderer(dimensions=1, patch_size=side).layout
    blank = Patches.blank(2, layout=layout, dimensions=1, patch_size=side)
    batch = Batch(
        replace(blank, log_radiance=mean),
        torch.arange(2),
        generated=True,
        current=None,
        first_half=half,
    )
    compared: list[Tensor] = []

    def loss(*images: Tensor) -> Tensor:
        compared.extend(images)
        return torch.zeros(2)

    noise_loss(loss, batch)
    blurred, noisy = compared
    expected = ndimage.uniform_filter(mean.numpy(), size=(1, window, window, 1), mode="nearest")
    torch.testing.assert_close(blurred, torch.from_numpy(expected))
    torch.testing.assert_close(noisy - blurred, half - mean)


def test_a_loss_below_the_noise_is_none() -> None:
    found = without_noise(torch.tensor([0.5, 0.5, 0.3]), torch.tensor([0.3, 0.6, 0.0]))
    assert found.tolist() == pytest.approx([0.4, 0.0, 0.3])


def test_a_step_on_patches_in_two_halves_tells_their_noise(tmp_path: Path) -> None:
    """The network learns from the mean, the stream hears of the noise; stored patches have none."""
    told: list[Feedback] = []
    small = AnalyticRenderer(
        dimensions=3, patch_size=8, samples_per_pixel=2, halves=True, noise=0.3
    )
    stream = make(tmp_path, sampler=predicted(), rule=Epochs(), renderer=small)
    feedback = stream.feedback
    stream.feedback = lambda given: (told.append(given), feedback(given))[1]  # type: ignore[method-assign, assignment, func-returns-value]
    learner = module(stream, tmp_path)
    optimizer = learner.configure_optimizers()
    batches = []
    for batch in islice(stream, 12):
        batches.append(batch)
        training_step(batch, learner.learner, optimizer=optimizer)
    assert {batch.generated for batch in batches} == {True, False}
    for batch, given in zip(batches, told, strict=True):
        assert (given.noise is not None) == batch.generated
        if given.noise is not None:
            assert torch.equal(given.noise, noise_loss(learner.loss, batch))


def test_the_sampler_is_told_the_losses_without_noise(tmp_path: Path) -> None:
    stream = make(tmp_path, sampler=predicted(), rule=Epochs())
    next(iter(stream))
    losses, noise = torch.tensor([0.5, 0.6, 1.0, 0.2]), torch.tensor([0.3, 0.0, 0.6, 0.3])
    stream.feedback(Feedback(losses, None, None, noise))
    without = pytest.approx([0.4, 0.6, 0.8, 0.0])
    assert stream.chains.loss.tolist() == without  # type: ignore[attr-defined]
    assert stream.new_losses.state_dict() == without
