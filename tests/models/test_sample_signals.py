import copy

import pytest
import torch
from torch import nn
from torch.func import grad, vmap

from ngi.models import (
    L1Dssim,
    PatchLinear,
    adam_step,
    output_gradient_norm,
    sample_step_norm,
    step_norms_in_backward,
)

from .conftest import Batch, plain_forward

LOSS = L1Dssim(l1_weight=1, dssim_weight=1, window_size=5)


def adam(model, **options) -> torch.optim.Adam:
    return torch.optim.Adam(model.parameters(), lr=1e-3, betas=(0.8, 0.95), **options)


def train(model, optimizer, batch, steps) -> None:
    for _ in range(steps):
        optimizer.zero_grad()
        LOSS(model(batch.buffers, batch.scene_vector), batch.target).mean().backward()
        optimizer.step()
    optimizer.zero_grad()


def step_norms(model, optimizer, batch, loss=LOSS):
    return sample_step_norm(
        model, loss, optimizer, (batch.buffers, batch.scene_vector), batch.target
    )


def watched_layers(model) -> list[nn.Module]:
    return [module for module in model.modules() if getattr(module, "watcher", None) is not None]


def real_step_norms(model, optimizer, batch):
    """Lets a copy of model and optimiser take the step, for each sample alone."""
    norms = []
    for i in range(len(batch.target)):
        twin, stepper = copy.deepcopy((model, optimizer))
        loss = LOSS(
            twin(batch.buffers[i : i + 1], batch.scene_vector[i : i + 1]), batch.target[i : i + 1]
        )
        loss.sum().backward()
        stepper.step()
        squares = [
            (a - b).square().sum()
            for a, b in zip(twin.parameters(), model.parameters(), strict=True)
        ]
        norms.append(sum(squares).sqrt())
    return torch.stack(norms).detach()


@pytest.mark.parametrize("history", [0, 1, 7])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"position_preconditioning": False},
        {"scene_dimensions": 0},
        {"names": ("position", "albedo"), "hidden_layers": 1},
    ],
)
def test_is_the_norm_of_the_step_that_adam_takes(make_model, make_batch, options, history) -> None:
    model = make_model(**options).double()
    batch = make_batch(model)
    optimizer = adam(model)
    train(model, optimizer, batch, history)
    losses, norms = step_norms(model, optimizer, batch)
    torch.testing.assert_close(norms, real_step_norms(model, optimizer, batch), rtol=1e-9, atol=0)
    expected = LOSS(model(batch.buffers, batch.scene_vector), batch.target)
    torch.testing.assert_close(losses, expected.detach())


def test_parameter_groups_have_their_own_rates(make_model, make_batch) -> None:
    model = make_model().double()
    batch = make_batch(model)
    groups = [
        {"params": list(model.hidden.parameters()), "lr": 0.1, "eps": 1e-2},
        {"params": [*model.input_layer.parameters(), *model.output_layer.parameters()]},
    ]
    optimizer = torch.optim.Adam(groups, lr=1e-4)
    train(model, optimizer, batch, 2)
    _, norms = step_norms(model, optimizer, batch)
    torch.testing.assert_close(norms, real_step_norms(model, optimizer, batch), rtol=1e-9, atol=0)


def test_agrees_with_gradients_per_sample_of_the_plain_network(make_model, make_batch) -> None:
    model = make_model().double()
    batch = make_batch(model)
    optimizer = adam(model)
    train(model, optimizer, batch, 3)

    def sample_loss(parameters, buffers, scene_vector, target):
        output = plain_forward(model, parameters, buffers[None], scene_vector[None])
        return LOSS(output, target[None])[0]

    parameters = {name: p.detach() for name, p in model.named_parameters()}
    gradients = vmap(grad(sample_loss), in_dims=(None, 0, 0, 0))(
        parameters, batch.buffers, batch.scene_vector, batch.target
    )
    squares = torch.zeros(3, dtype=torch.float64)
    for name, p in model.named_parameters():
        state, g = optimizer.state[p], gradients[name]
        step = state["step"].item() + 1
        m = (0.8 * state["exp_avg"] + 0.2 * g) / (1 - 0.8**step)
        v = (0.95 * state["exp_avg_sq"] + 0.05 * g * g) / (1 - 0.95**step)
        squares += (1e-3 * m / (v.sqrt() + 1e-8)).square().flatten(1).sum(1)
    _, norms = step_norms(model, optimizer, batch)
    torch.testing.assert_close(norms, squares.sqrt(), rtol=1e-9, atol=0)


@pytest.mark.parametrize("samples", [1, 2])
def test_chunks_change_nothing(make_model, make_batch, monkeypatch, samples) -> None:
    model = make_model().double()
    batch = make_batch(model)
    optimizer = adam(model)
    _, expected = step_norms(model, optimizer, batch)
    monkeypatch.setattr(adam_step, "gradients_per_chunk", lambda _: samples)
    torch.testing.assert_close(step_norms(model, optimizer, batch)[1], expected)


def test_bfloat16_is_close_to_float32(make_model, make_batch) -> None:
    model = make_model(hidden_features=64)
    batch = make_batch(model, height=16, width=16)
    optimizer = adam(model)
    train(model, optimizer, batch, 5)
    losses, norms = step_norms(model, optimizer, batch)
    with torch.autocast("cpu", torch.bfloat16):
        rounded_losses, rounded_norms = step_norms(model, optimizer, batch)
    assert norms.dtype == rounded_norms.dtype == torch.float32
    torch.testing.assert_close(rounded_losses, losses, rtol=0.02, atol=0)
    torch.testing.assert_close(rounded_norms, norms, rtol=0.03, atol=0)


def test_leaves_everything_as_it_was(make_model, make_batch) -> None:
    model = make_model()
    batch = make_batch(model)
    optimizer = adam(model)
    before = copy.deepcopy((model.state_dict(), optimizer.state_dict()))
    with torch.no_grad():
        losses, norms = step_norms(model, optimizer, batch)
    assert not losses.requires_grad
    assert not norms.requires_grad
    assert all(p.grad is None for p in model.parameters())
    assert not watched_layers(model)
    assert len(optimizer.state) == 0
    for a, b in zip(before[0].values(), model.state_dict().values(), strict=True):
        assert torch.equal(a, b)


def test_nothing_watches_after_an_error(make_model, make_batch) -> None:
    model = make_model()
    batch = make_batch(model, height=4)
    with pytest.raises(ValueError, match="smaller than the SSIM window"):
        step_norms(model, adam(model), batch)
    assert not watched_layers(model)


@pytest.mark.parametrize("option", ["weight_decay", "amsgrad", "maximize"])
def test_unsupported_options_of_adam_are_named(make_model, make_batch, option) -> None:
    model = make_model()
    value = 0.1 if option == "weight_decay" else True
    with pytest.raises(ValueError, match=f"optimizer.{option} is {value}"):
        step_norms(model, adam(model, **{option: value}), make_batch(model))


def test_other_optimisers_and_models_are_refused(make_model, make_batch) -> None:
    model = make_model()
    batch = make_batch(model)
    with pytest.raises(TypeError, match="SGD"):
        step_norms(model, torch.optim.SGD(model.parameters(), lr=1), batch)
    with pytest.raises(ValueError, match="does not hold every parameter"):
        step_norms(model, torch.optim.Adam(model.hidden.parameters()), batch)
    model.extra = nn.Linear(2, 2)
    with pytest.raises(TypeError, match=r"'extra.weight' belongs to neither a PatchLinear"):
        step_norms(model, adam(model), batch)


def test_output_gradient_norm_is_that_of_each_sample_alone(make_model, make_batch) -> None:
    model = make_model().double()
    batch = make_batch(model)
    prediction = model(batch.buffers, batch.scene_vector)
    norms = output_gradient_norm(prediction, batch.target, LOSS)
    for i in range(3):
        output = prediction[i : i + 1].detach().requires_grad_()
        (gradient,) = torch.autograd.grad(LOSS(output, batch.target[i : i + 1]).sum(), output)
        torch.testing.assert_close(norms[i], gradient.norm())
    assert all(p.grad is None for p in model.parameters())
    prediction.sum().backward()  # the graph of the training pass is still there


def test_output_gradient_norm_of_l1_in_closed_form() -> None:
    prediction, target = torch.zeros(4, 12, 12, 3), torch.ones(4, 12, 12, 3)
    loss = L1Dssim(l1_weight=2, dssim_weight=0)
    with torch.no_grad():
        norms = output_gradient_norm(prediction, target, loss)
    torch.testing.assert_close(norms, torch.full((4,), 2 / (12 * 12 * 3) ** 0.5))


def gradients(model, batch) -> list[torch.Tensor]:
    with torch.autocast("cpu", torch.bfloat16, enabled=model.input_layer.weight.dtype.itemsize < 8):
        output = model(batch.buffers, batch.scene_vector)
        losses = LOSS(output, batch.target)
    inputs = [x for x in (batch.buffers, batch.scene_vector) if x.requires_grad]
    return [output, *torch.autograd.grad(losses.mean(), [*model.parameters(), *inputs])]


@pytest.mark.parametrize("options", [{}, {"position_preconditioning": False}])
def test_a_watched_step_has_the_gradients_of_a_plain_one(make_model, make_batch, options) -> None:
    model = make_model(**options).double()
    batch = make_batch(model)
    batch.buffers.requires_grad_()
    batch.scene_vector.requires_grad_()
    plain = gradients(model, batch)
    with step_norms_in_backward(model, adam(model)):
        watched = gradients(model, batch)
    again = gradients(model, batch)
    assert torch.equal(watched[0], plain[0])
    torch.testing.assert_close(watched, plain, rtol=1e-12, atol=1e-15)
    assert all(torch.equal(a, b) for a, b in zip(again, plain, strict=True))


def test_a_watched_bfloat16_step_is_as_exact_as_a_plain_one(make_model, make_batch) -> None:
    model = make_model(hidden_features=64)
    batch = make_batch(model, height=16, width=16)
    plain = gradients(model, batch)
    with step_norms_in_backward(model, adam(model)):
        watched = gradients(model, batch)
    model.double()
    exact = gradients(model, Batch(*(x.double() for x in vars(batch).values())))
    assert torch.equal(watched[0], plain[0])
    for a, b, truth in zip(watched[1:], plain[1:], exact[1:], strict=True):
        assert (a - truth).norm() <= 1.1 * (b - truth).norm() + 1e-6 * truth.norm()


def test_positions_keep_their_precision_in_a_watched_bfloat16_step() -> None:
    layer = PatchLinear(pixel_features=[3, 2], scene_dimensions=1, out_features=4)
    generator = torch.Generator().manual_seed(5)
    features = torch.rand(2, 6, 3, generator=generator).bfloat16()
    positions, v = torch.rand(2, 6, 2, generator=generator), torch.rand(2, 1, generator=generator)
    seen: list[torch.Tensor] = []
    layer.watcher = lambda _, gradients: seen.append(gradients)
    with torch.autocast("cpu", torch.bfloat16):
        output = layer((features, positions), v)
    output[:, 0].sum().backward()  # of the first pixel alone: its inputs are the gradients
    expected = torch.cat([features[:, 0].float(), positions[:, 0], v], dim=1)[:, None].expand(
        2, 4, 6
    )
    torch.testing.assert_close(seen[0], expected, rtol=2**-15, atol=0)
    torch.testing.assert_close(seen[1], torch.ones(2, 4))


def test_a_training_step_measures_its_own_samples(make_model, make_batch) -> None:
    model = make_model().double()
    batch = make_batch(model)
    optimizer = adam(model)
    train(model, optimizer, batch, 3)
    _, expected = step_norms(model, optimizer, batch)
    with step_norms_in_backward(model, optimizer, gradient_scale=len(batch.target)) as norms:
        losses = LOSS(model(batch.buffers, batch.scene_vector), batch.target)
    losses.mean().backward()
    torch.testing.assert_close(norms(), expected)
    optimizer.step()
    torch.testing.assert_close(norms(), expected)


def test_a_part_that_is_called_twice_is_refused() -> None:
    """Its gradients would be sums over both calls, in which samples are no more told apart."""

    class Twice(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.layer = PatchLinear(pixel_features=[3], scene_dimensions=2, out_features=3)

        def forward(self, buffers, scene_vector):
            once = self.layer([buffers.flatten(1, 2)], scene_vector)
            return self.layer([once], scene_vector).view(buffers.shape)

    model, generator = Twice(), torch.Generator().manual_seed(0)
    images = torch.rand(2, 2, 8, 8, 3, generator=generator)
    batch = Batch(images[0], torch.rand(2, 2, generator=generator), images[1])
    with pytest.raises(RuntimeError, match="called twice"):
        step_norms(model, adam(model), batch)
