from contextlib import nullcontext
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import torch
from torch.func import grad

from ngi.clock.counters import Counters
from ngi.explore import Loss, LossTimesOutputGradient, LossTimesStep, Target
from ngi.learn import (
    Batch,
    Feedback,
    IlluminationModule,
    PhaseClock,
    StepGuard,
    patch_example,
    seeded,
    training_step,
)
from ngi.models import (
    Averaging,
    EncodedGenerator,
    L1Dssim,
    PixelGenerator,
    exponential_average,
    no_average,
    sample_step_norm,
)
from ngi.patches import BufferLayout, Patches

LAYOUT = BufferLayout()
LOSS = L1Dssim(l1_weight=1.0, dssim_weight=1.0)


def patches(count: int, seed: int, dtype: torch.dtype = torch.float64) -> Patches:
    generator = torch.Generator().manual_seed(seed)

    def rand(*shape: int) -> torch.Tensor:
        return torch.rand(*shape, generator=generator, dtype=torch.float64).to(dtype)

    return Patches(
        scene_vector=rand(count, 2),
        position=rand(count, 2),
        resolution=torch.full((count,), 64),
        large_step=torch.ones(count, dtype=torch.bool),
        buffers=rand(count, 12, 12, LAYOUT.channels),
        log_radiance=rand(count, 12, 12, 3),
    )


NETWORKS = {
    "the paper's": PixelGenerator,
    "ours": partial(EncodedGenerator, octaves=1, directions=True),
}


class Answered:
    """In the stream's place: what it was told of each step."""

    def __init__(self, target: Target) -> None:
        self.sampler = SimpleNamespace(target=target)
        self.clock = PhaseClock()
        self.counters = Counters()
        self.feedbacks: list[Feedback] = []

    def feedback(self, feedback: Feedback) -> None:
        self.feedbacks.append(feedback)


def module(
    target: Target, network_name: str = "the paper's", averaging: Averaging = no_average
) -> IlluminationModule:
    network = seeded(NETWORKS[network_name], seed=3)(
        layout=LAYOUT, scene_dimensions=2, hidden_features=8, hidden_layers=2
    ).double()
    stream: Any = Answered(target)
    return IlluminationModule(
        network=network,
        loss=LOSS,
        optimizer=lambda parameters: torch.optim.Adam(parameters, lr=1e-2),
        example=patch_example,
        stream=stream,
        guard=StepGuard(stream=stream, folder=Path()),
        averaging=averaging,
    )


def one_step(made: IlluminationModule, batch: Batch) -> Feedback:
    """What the stream is told of a first step; the gradients stay."""
    training_step(batch, made.learner, optimizer=made.configure_optimizers())
    return made.learner.stream.feedbacks[-1]  # type: ignore[attr-defined]


def direct_scores(
    made: IlluminationModule, target: Target, samples: Patches, optimizer: torch.optim.Optimizer
) -> torch.Tensor:
    """The definition of each target density, sample by sample."""
    output = made.network(samples.buffers, samples.scene_vector).detach()
    losses = LOSS(output, samples.log_radiance)
    if isinstance(target, Loss):
        return losses
    if isinstance(target, LossTimesStep):
        _, norms = sample_step_norm(
            made.network,
            LOSS,
            optimizer,
            (samples.buffers, samples.scene_vector),
            samples.log_radiance,
        )
        return losses * norms
    norms = torch.stack(
        [
            grad(lambda o, i=i: LOSS(o[None], samples.log_radiance[i : i + 1])[0])(output[i]).norm()
            for i in range(len(samples))
        ]
    )
    return losses * norms


@pytest.mark.parametrize("network", NETWORKS)
@pytest.mark.parametrize("target", [Loss(), LossTimesStep(), LossTimesOutputGradient()])
def test_proposed_and_current_are_scored_under_the_same_weights(
    target: Target, network: str
) -> None:
    made = module(target, network)
    optimizer = made.configure_optimizers()
    for step in range(3):
        proposed, current = patches(4, 2 * step), patches(4, 2 * step + 1)
        expected = [direct_scores(made, target, p, optimizer) for p in (proposed, current)]
        batch = Batch(proposed, torch.arange(4), True, current)
        loss = training_step(batch, made.learner, optimizer=optimizer).outcome.loss
        feedback = made.learner.stream.feedbacks[-1]  # type: ignore[attr-defined]
        torch.testing.assert_close(feedback.target_proposed.double(), expected[0])
        torch.testing.assert_close(feedback.target_current.double(), expected[1])
        assert loss == pytest.approx(feedback.losses.mean().item())


def test_scoring_does_not_change_the_gradient() -> None:
    gradients = []
    for current in (None, patches(4, 9)):
        made = module(LossTimesStep())
        one_step(made, Batch(patches(4, 0), torch.arange(4), True, current))
        gradients.append([p.grad for p in made.network.parameters()])
    for a, b in zip(*gradients, strict=True):
        torch.testing.assert_close(a, b, rtol=1e-10, atol=1e-14)


def test_weights_scale_what_each_sample_does_and_not_what_is_said_of_it() -> None:
    samples, weights = patches(4, 0), torch.tensor([1.0, 0.25, 0.5, 0.0])
    weighted, plain, reference = module(Loss()), module(Loss()), module(Loss())
    told = one_step(weighted, Batch(samples, torch.arange(4), False, None, weights))
    told_plain = one_step(plain, Batch(samples, torch.arange(4), False, None))
    assert torch.equal(told.losses, told_plain.losses)
    network = reference.network
    losses = LOSS(network(samples.buffers, samples.scene_vector), samples.log_radiance)
    mean = sum(w * loss for w, loss in zip(weights.tolist(), losses, strict=True)) / 4
    gradients = torch.autograd.grad(mean, list(network.parameters()))
    for parameter, expected in zip(weighted.network.parameters(), gradients, strict=True):
        torch.testing.assert_close(parameter.grad, expected)


def test_after_each_step_the_average_follows_and_is_what_predicts() -> None:
    made = module(Loss(), averaging=partial(exponential_average, decay=0.98))
    reference = exponential_average(made.network, decay=0.98)
    batch = Batch(patches(4, 0), torch.arange(4), False, None)
    optimizer = made.configure_optimizers()
    for _ in range(3):
        training_step(batch, made.learner, optimizer=optimizer)
        reference.update_parameters(made.network)
    assert made.averaged is not None
    for ours, expected in zip(made.averaged.parameters(), reference.parameters(), strict=True):
        assert torch.equal(ours, expected)
    made._trainer = SimpleNamespace(  # type: ignore[assignment]
        precision_plugin=SimpleNamespace(forward_context=nullcontext)
    )
    inputs = (batch.patches.buffers[0], batch.patches.scene_vector[0])
    expected = reference.module.render(*inputs).float()
    assert torch.equal(made.predict(*inputs), expected)
    assert not torch.equal(made.network.render(*inputs).float(), expected)


def test_answers_are_those_of_present_and_of_averaged_weights() -> None:
    """Which are the same before the first step."""
    made = module(Loss(), averaging=partial(exponential_average, decay=0.98))
    made._trainer = SimpleNamespace(  # type: ignore[assignment]
        precision_plugin=SimpleNamespace(forward_context=nullcontext)
    )
    batch = Batch(patches(4, 0), torch.arange(4), False, None)
    inputs, _ = patch_example(batch.patches)
    present, averaged = made.answers(*inputs)
    assert torch.equal(present, averaged)
    optimizer = made.configure_optimizers()
    for _ in range(3):
        training_step(batch, made.learner, optimizer=optimizer)
    assert made.averaged is not None
    for found, network in zip(
        made.answers(*inputs), (made.network, made.averaged.module), strict=True
    ):
        assert found.dtype == torch.float32
        expected = torch.stack([network.render(*one) for one in zip(*inputs, strict=True)])
        torch.testing.assert_close(found, expected.detach().float(), rtol=1e-4, atol=1e-6)


def test_without_averaged_weights_nothing_is_answered_by_them() -> None:
    inputs, _ = patch_example(patches(2, 0))
    with pytest.raises(ValueError, match="averaging=exponential"):
        module(Loss()).answers(*inputs)


def test_initial_weights_depend_on_the_seed_alone() -> None:
    def weights(seed: int) -> torch.Tensor:
        torch.rand(7)  # whatever the global generator did before
        before = torch.random.get_rng_state()
        made = seeded(PixelGenerator, seed=seed)(layout=LAYOUT, scene_dimensions=2)
        assert torch.equal(torch.random.get_rng_state(), before)
        return made.output_layer.weight

    assert torch.equal(weights(1), weights(1))
    assert not torch.equal(weights(1), weights(2))


def test_a_target_of_what_no_network_says_is_refused() -> None:
    class Brightness(Loss):
        requires = frozenset({"loss", "brightness"})

    with pytest.raises(ValueError, match=r"Brightness requires \['brightness'\]; known .*'loss'"):
        module(Brightness())
