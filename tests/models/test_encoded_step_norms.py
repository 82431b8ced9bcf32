"""How far each sample alone would move our network, against gradients that autograd gives."""

import math

import pytest
import torch
import torch.nn.functional as F
from torch.func import grad, vmap

from ngi.models import (
    EncodedGenerator,
    L1Dssim,
    MuonAdam,
    sample_step_norm,
    step_norms_in_backward,
)
from ngi.models.known_light import add_known_light
from ngi.models.pixel_mlp import NEGATIVE_SLOPE
from ngi.patches import BufferLayout

LAYOUT = BufferLayout().adding(["direct"])
LOSS = L1Dssim(l1_weight=1, dssim_weight=1, window_size=5)
LR, ADAM_LR, MOMENTUM, BETAS = 0.01, 1e-3, 0.9, (0.8, 0.95)


def random(*shape: int, seed: int = 0) -> torch.Tensor:
    return torch.rand(*shape, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def make_network(**options) -> EncodedGenerator:
    sizes = {"scene_dimensions": 4, "hidden_features": 12, "hidden_layers": 3}
    with torch.random.fork_rng():
        torch.manual_seed(0)
        network = EncodedGenerator(
            **{"layout": LAYOUT, "octaves": 2, "directions": True, **sizes, **options}  # type: ignore[arg-type]
        )
    return network.double()


def make_batch(network: EncodedGenerator, samples: int = 3) -> list[torch.Tensor]:
    """Buffers, v and target."""
    return [
        random(samples, 6, 7, network.layout.channels),
        random(samples, network.scene_dimensions, seed=1),
        random(samples, 6, 7, 3, seed=2),
    ]


def plain_output(network: EncodedGenerator, parameters, buffers, v) -> torch.Tensor:
    """One sample, [H, W, C] and [D] to [H, W, 3], by PyTorch's own layers."""
    pixels = network.encoding(buffers, v, torch.float64)
    inputs = torch.cat([pixels, v.expand(*pixels.shape[:-1], -1)], dim=-1)
    names = {name.removeprefix("mlp."): p for name, p in parameters.items()}
    first = torch.cat([names["weights.0"], names["patch_weight"]], dim=1)
    x = F.linear(inputs, first, names["patch_bias"])
    for number in range(1, len(network.mlp.weights)):
        x = F.leaky_relu(x, NEGATIVE_SLOPE)
        x = torch.cat([x, pixels], dim=-1) if number == network.mlp.skip else x
        x = F.linear(x, names[f"weights.{number}"], names[f"biases.{number - 1}"])
    return add_known_light(x, buffers, network.layout)


def sample_gradients(network: EncodedGenerator, batch) -> dict[str, torch.Tensor]:
    def sample_loss(parameters, buffers, v, target):
        output = plain_output(network, parameters, buffers, v)
        return LOSS(output[None], target[None])[0]

    parameters = {name: p.detach() for name, p in network.named_parameters()}
    return vmap(grad(sample_loss), in_dims=(None, 0, 0, 0))(parameters, *batch)


def trained(network, optimizer, batch, steps: int = 3):
    for _ in range(steps):
        optimizer.zero_grad()
        LOSS(network(*batch[:2]), batch[2]).mean().backward()
        optimizer.step()
    optimizer.zero_grad()
    return optimizer


def adam(network, batch) -> torch.optim.Adam:
    return trained(network, torch.optim.Adam(network.parameters(), lr=LR, betas=BETAS), batch)


def muon(network, batch) -> MuonAdam:
    optimizer = MuonAdam(network.parameters(), lr=LR, adam_lr=ADAM_LR, momentum=MOMENTUM)
    return trained(network, optimizer, batch)


def adam_squares(state, g, lr: float, betas) -> torch.Tensor:
    step = state["step"].item() + 1
    m = (betas[0] * state["exp_avg"] + (1 - betas[0]) * g) / (1 - betas[0] ** step)
    v = (betas[1] * state["exp_avg_sq"] + (1 - betas[1]) * g * g) / (1 - betas[1] ** step)
    return (lr * m / (v.sqrt() + 1e-8)).square().flatten(1).sum(1)


def expected_norms(network, optimizer, batch) -> torch.Tensor:
    """By the definitions: Adam's step, and for Muon's matrices 0.2·lr·√(numel)·‖U(g)‖/‖B‖."""
    squares = torch.zeros(len(batch[2]), dtype=torch.float64)
    gradients = sample_gradients(network, batch)
    for name, p in network.named_parameters():
        state, g = optimizer.state[p], gradients[name]
        if isinstance(optimizer, torch.optim.Adam):
            squares += adam_squares(state, g, LR, BETAS)
        elif "momentum_buffer" in state:
            b = state["momentum_buffer"]
            update = (MOMENTUM**2 * b + (1 - MOMENTUM**2) * g).flatten(1).norm(dim=1)
            squares += (0.2 * LR * math.sqrt(p.numel()) * update / b.norm()).square()
        else:
            squares += adam_squares(state, g, ADAM_LR, (0.9, 0.999))
    return squares.sqrt()


@pytest.mark.parametrize("make_optimizer", [adam, muon])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"scene_dimensions": 0},
        {"scene_dimensions": 11},  # enough for Muon to step the columns of v
        {"hidden_layers": 1},
        {"octaves": 0, "directions": False, "layout": BufferLayout(("position", "albedo"))},
    ],
)
def test_norms_are_those_of_the_steps_of_single_samples(options, make_optimizer) -> None:
    network = make_network(**options)
    batch = make_batch(network)
    optimizer = make_optimizer(network, batch)
    losses, norms = sample_step_norm(network, LOSS, optimizer, tuple(batch[:2]), batch[2])
    torch.testing.assert_close(norms, expected_norms(network, optimizer, batch), rtol=1e-9, atol=0)
    torch.testing.assert_close(losses, LOSS(network(*batch[:2]), batch[2]).detach())
    assert norms.max() > 1.001 * norms.min(), "it tells samples apart"


def test_a_training_step_measures_its_own_samples_with_the_gradients_of_a_plain_one() -> None:
    network = make_network()
    batch = make_batch(network)
    optimizer = muon(network, batch)
    expected = expected_norms(network, optimizer, batch)
    LOSS(network(*batch[:2]), batch[2]).mean().backward()
    plain = [p.grad for p in network.parameters()]
    optimizer.zero_grad()
    with step_norms_in_backward(network, optimizer, gradient_scale=3) as norms:
        losses = LOSS(network(*batch[:2]), batch[2])
    assert network.mlp.watcher is None
    losses.mean().backward()
    torch.testing.assert_close(norms(), expected)
    for p, g in zip(network.parameters(), plain, strict=True):
        torch.testing.assert_close(p.grad, g, rtol=1e-12, atol=1e-15)
    optimizer.step()
    torch.testing.assert_close(norms(), expected)


def test_bfloat16_is_close_to_float32() -> None:
    network = make_network(hidden_features=64).float()
    batch = [tensor.float() for tensor in make_batch(network)]
    optimizer = muon(network, batch)
    _, exact = sample_step_norm(network, LOSS, optimizer, tuple(batch[:2]), batch[2])
    with torch.autocast("cpu", torch.bfloat16):
        _, rounded = sample_step_norm(network, LOSS, optimizer, tuple(batch[:2]), batch[2])
    assert rounded.dtype == torch.float32
    torch.testing.assert_close(rounded, exact, rtol=0.03, atol=0)
