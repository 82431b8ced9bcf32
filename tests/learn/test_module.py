from contextlib import nullcontext
from types import SimpleNamespace

import pytest
import torch
from torch.func import grad

from ngi.explore import Loss, LossTimesOutputGradient, LossTimesStep, Target
from ngi.learn import Batch, IlluminationModule, PhaseClock, patch_example, seeded
from ngi.models import L1Dssim, PixelGenerator, exponential_average, sample_step_norm
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


def module(target: Target) -> IlluminationModule:
    network = seeded(PixelGenerator, seed=3)(
        layout=LAYOUT, scene_dimensions=2, hidden_features=8, hidden_layers=2
    ).double()
    made = IlluminationModule(
        network=network,
        loss=LOSS,
        optimizer=lambda parameters: torch.optim.Adam(parameters, lr=1e-2),
        target=target,
        clock=PhaseClock(),
        example=patch_example,
    )
    optimizer = made.configure_optimizers()
    made.optimizers = lambda **_: optimizer  # type: ignore[method-assign]
    made._trainer = SimpleNamespace(global_step=0)  # type: ignore[assignment]
    return made


def direct_scores(made: IlluminationModule, target: Target, samples: Patches) -> torch.Tensor:
    """The definition of each target density, sample by sample."""
    output = made.network(samples.buffers, samples.scene_vector).detach()
    losses = LOSS(output, samples.log_radiance)
    if isinstance(target, Loss):
        return losses
    if isinstance(target, LossTimesStep):
        _, norms = sample_step_norm(
            made.network,
            LOSS,
            made.optimizers(),  # type: ignore[arg-type]
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


@pytest.mark.parametrize("target", [Loss(), LossTimesStep(), LossTimesOutputGradient()])
def test_proposed_and_current_are_scored_under_the_same_weights(target: Target) -> None:
    made = module(target)
    optimizer = made.optimizers()
    for step in range(3):
        batch = Batch(patches(4, 2 * step), torch.arange(4), True, patches(4, 2 * step + 1))
        expected = [
            direct_scores(made, target, p) for p in (batch.patches, batch.current) if p is not None
        ]
        answer = made.training_step(batch, step)
        optimizer.zero_grad()  # type: ignore[union-attr]
        answer["loss"].backward()
        optimizer.step()  # type: ignore[union-attr]
        feedback = answer["feedback"]
        torch.testing.assert_close(feedback.target_proposed().double(), expected[0])
        torch.testing.assert_close(feedback.target_current.double(), expected[1])
        torch.testing.assert_close(answer["loss"], feedback.losses.mean())


def test_scoring_does_not_change_the_gradient() -> None:
    gradients = []
    for current in (None, patches(4, 9)):
        made = module(LossTimesStep())
        made.training_step(Batch(patches(4, 0), torch.arange(4), True, current), 0)[
            "loss"
        ].backward()
        gradients.append([p.grad for p in made.network.parameters()])
    for a, b in zip(*gradients, strict=True):
        torch.testing.assert_close(a, b, rtol=1e-10, atol=1e-14)


def test_weights_scale_what_each_sample_does_and_not_what_is_said_of_it() -> None:
    made, samples = module(Loss()), patches(4, 0)
    weights = torch.tensor([1.0, 0.25, 0.5, 0.0])
    step = made.training_step(Batch(samples, torch.arange(4), False, None, weights), 0)
    plain = made.training_step(Batch(samples, torch.arange(4), False, None), 0)
    assert torch.equal(step["feedback"].losses, plain["feedback"].losses)
    parameters = list(made.parameters())
    found = torch.autograd.grad(step["loss"], parameters)
    losses = LOSS(made.network(samples.buffers, samples.scene_vector), samples.log_radiance)
    mean = sum(w * loss for w, loss in zip(weights.tolist(), losses, strict=True)) / 4
    for ours, expected in zip(found, torch.autograd.grad(mean, parameters), strict=True):
        torch.testing.assert_close(ours, expected)


def test_after_each_step_the_average_follows_and_is_what_predicts() -> None:
    made = module(Loss())
    made.averaged = exponential_average(made.network, decay=0.98)
    reference = exponential_average(made.network, decay=0.98)
    batch = Batch(patches(4, 0), torch.arange(4), False, None)

    def closure() -> torch.Tensor:
        loss = made.training_step(batch, 0)["loss"]
        loss.backward()
        return loss

    made._trainer = SimpleNamespace(  # type: ignore[assignment]
        precision_plugin=SimpleNamespace(forward_context=nullcontext)
    )
    for step in range(3):
        made.optimizer_step(0, step, made.optimizers(), closure)
        reference.update_parameters(made.network)
    for ours, expected in zip(made.averaged.parameters(), reference.parameters(), strict=True):
        assert torch.equal(ours, expected)
    inputs = (batch.patches.buffers[0], batch.patches.scene_vector[0])
    expected = reference.module.render(*inputs).float()
    assert torch.equal(made.predict(*inputs), expected)
    assert not torch.equal(made.network.render(*inputs).float(), expected)


def test_initial_weights_depend_on_the_seed_alone() -> None:
    def weights(seed: int) -> torch.Tensor:
        torch.rand(7)  # whatever the global generator did before
        made = seeded(PixelGenerator, seed=seed)(layout=LAYOUT, scene_dimensions=2)
        return made.output_layer.weight

    before = torch.random.get_rng_state()
    assert torch.equal(weights(1), weights(1))
    assert not torch.equal(weights(1), weights(2))
    torch.rand(7 * 4)
    torch.random.set_rng_state(before)
