"""How far one sample moves the network under Muon: closed forms, and Muon's own steps."""

import math

import pytest
import torch
from torch import nn

from ngi.models import L1Dssim, MuonAdam, sample_step_norm, step_norms_in_backward
from ngi.models.adam_step import AdamStep
from ngi.models.muon_step import MuonStep

LOSS = L1Dssim(l1_weight=1, dssim_weight=1, window_size=5)
LR, BETA = 0.01, 0.9
ROWS, COLUMNS = 12, 20
LENGTH = 0.2 * LR * math.sqrt(ROWS * COLUMNS)


def random(*shape: int, seed: int = 0) -> torch.Tensor:
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def muon_step(momentum: torch.Tensor | None) -> MuonStep:
    state = {} if momentum is None else {"momentum_buffer": momentum}
    return MuonStep.of(random(ROWS, COLUMNS), {"lr": LR, "momentum": BETA}, state)


def norms(step: MuonStep, *gradients: torch.Tensor) -> list[float]:
    return step.squared_norm(torch.stack(gradients)).sqrt().tolist()


def test_closed_forms() -> None:
    b = random(ROWS, COLUMNS)
    across = random(ROWS, COLUMNS, seed=1)
    across -= b * (across * b).sum() / b.square().sum()
    across *= b.norm() / across.norm()
    found = norms(muon_step(b), b, 0 * b, 11 * b, -b * 0.81 / 0.19, 4 * across)
    assert found == pytest.approx(
        [
            LENGTH,  # U(B) = B
            LENGTH * 0.81,
            LENGTH * (0.81 + 0.19 * 11),
            0,  # a gradient that would undo the momentum
            LENGTH * math.hypot(0.81, 0.19 * 4),
        ],
        abs=1e-12,
    )


def test_what_is_normalised_by_itself_says_nothing_and_this_does() -> None:
    """The reason for its being: Muon's true steps for gradients of any size, and ours."""
    weight = random(ROWS, COLUMNS)
    true, found = [], []
    for size in (1.0, 30.0):
        parameter = nn.Parameter(weight.clone())
        optimizer = MuonAdam([parameter], lr=LR, momentum=BETA, clip_norm=math.inf)
        for seed in range(20):
            parameter.grad = random(ROWS, COLUMNS, seed=seed)
            optimizer.step()
        before, gradient = parameter.detach().clone(), size * random(ROWS, COLUMNS, seed=99)
        (group,) = optimizer.param_groups
        step = MuonStep.of(parameter, group, optimizer.state[parameter])
        found += norms(step, gradient)
        parameter.grad = gradient
        optimizer.step()
        true.append((parameter - before).norm().item())
    assert true[1] == pytest.approx(true[0], rel=0.15)
    assert true == pytest.approx([LENGTH] * 2, rel=0.3)
    assert found[1] > 5 * found[0]


def test_a_sample_like_the_recent_average_has_the_length_of_muons_true_step() -> None:
    parameter = nn.Parameter(random(ROWS, COLUMNS))
    optimizer = MuonAdam([parameter], lr=LR, momentum=BETA, clip_norm=math.inf)
    gradient = random(ROWS, COLUMNS, seed=1)
    for _ in range(200):  # until the momentum is the gradient
        parameter.grad = gradient.clone()
        optimizer.step()
    before = parameter.detach().clone()
    (group,) = optimizer.param_groups
    (found,) = norms(MuonStep.of(parameter, group, optimizer.state[parameter]), gradient)
    parameter.grad = gradient.clone()
    optimizer.step()
    assert found == pytest.approx((parameter - before).norm().item(), rel=0.2)
    assert found == pytest.approx(LENGTH, rel=1e-6)


def test_before_the_first_step_every_sample_has_the_length_of_the_true_one() -> None:
    g = random(ROWS, COLUMNS)
    for step in (muon_step(None), muon_step(torch.zeros_like(g))):
        assert norms(step, g, 100 * g, 0 * g) == pytest.approx([LENGTH, LENGTH, 0])


def test_a_gradient_that_is_not_finite_gives_no_finite_norm() -> None:
    g = random(ROWS, COLUMNS)
    for step in (muon_step(None), muon_step(g)):
        assert not math.isfinite(norms(step, g * math.nan)[0])


def test_scaled_is_the_step_for_the_larger_gradient() -> None:
    b, g = random(ROWS, COLUMNS), random(ROWS, COLUMNS, seed=1)
    assert norms(muon_step(b).scaled(16), g) == pytest.approx(norms(muon_step(b), 16 * g))


def gradients(model, batch) -> list[list[torch.Tensor]]:
    """Of each sample alone, parameter by parameter."""
    found = []
    for i in range(len(batch.target)):
        loss = LOSS(
            model(batch.buffers[i : i + 1], batch.scene_vector[i : i + 1]), batch.target[i : i + 1]
        )
        found.append(torch.autograd.grad(loss.sum(), list(model.parameters())))
    return found


def trained(model, batch, steps: int) -> MuonAdam:
    optimizer = MuonAdam(model.parameters(), lr=LR, adam_lr=1e-3, momentum=BETA)
    for _ in range(steps):
        optimizer.zero_grad()
        LOSS(model(batch.buffers, batch.scene_vector), batch.target).mean().backward()
        optimizer.step()
    optimizer.zero_grad()
    return optimizer


def expected_norms(model, batch, optimizer) -> torch.Tensor:
    """By the definition, from gradients that autograd gives sample by sample."""
    groups = {p: group for group in optimizer.param_groups for p in group["params"]}
    squares = []
    for of_sample in gradients(model, batch):
        square = torch.zeros((), dtype=torch.float64)
        for p, g in zip(model.parameters(), of_sample, strict=True):
            group, state = groups[p], optimizer.state[p]
            if p.ndim == 2 and min(p.shape) > 8:
                b = state["momentum_buffer"]
                update = BETA**2 * b + (1 - BETA**2) * g
                norm = 0.2 * LR * math.sqrt(p.numel()) * update.norm() / b.norm()
            else:
                norm = AdamStep.of(p, group, state).squared_norm(g[None]).sqrt()[0]
            square = square + norm**2
        squares.append(square)
    return torch.stack(squares).sqrt().detach()


def test_the_network_moves_by_the_steps_of_both_parts(make_model, make_batch) -> None:
    model = make_model().double()
    batch = make_batch(model)
    optimizer = trained(model, batch, 4)
    inputs = (batch.buffers, batch.scene_vector)
    _, found = sample_step_norm(model, LOSS, optimizer, inputs, batch.target)
    torch.testing.assert_close(found, expected_norms(model, batch, optimizer), rtol=1e-9, atol=0)
    assert found.max() > 1.01 * found.min(), "it tells samples apart"


def test_a_training_step_measures_its_own_samples(make_model, make_batch) -> None:
    model = make_model().double()
    batch = make_batch(model)
    optimizer = trained(model, batch, 4)
    expected = expected_norms(model, batch, optimizer)
    with step_norms_in_backward(model, optimizer, gradient_scale=len(batch.target)) as found:
        losses = LOSS(model(batch.buffers, batch.scene_vector), batch.target)
    losses.mean().backward()
    torch.testing.assert_close(found(), expected)
    optimizer.step()
    torch.testing.assert_close(found(), expected)


def test_bfloat16_is_close_to_float32(make_model, make_batch) -> None:
    model = make_model(hidden_features=64)
    batch = make_batch(model, height=16, width=16)
    optimizer = trained(model, batch, 5)
    inputs = (batch.buffers, batch.scene_vector)
    _, exact = sample_step_norm(model, LOSS, optimizer, inputs, batch.target)
    with torch.autocast("cpu", torch.bfloat16):
        _, rounded = sample_step_norm(model, LOSS, optimizer, inputs, batch.target)
    assert rounded.dtype == torch.float32
    # Processors sum bfloat16 in their own ways; this was 3.1 % off on one without AMX.
    torch.testing.assert_close(rounded, exact, rtol=0.05, atol=0)
