"""Muon and Adam as one optimiser, against PyTorch's own two, stepped separately."""

import copy
import io

import numpy as np
import pytest
import torch
from torch import nn

from ngi.models import MuonAdam
from ngi.models.batched_muon import BatchedMuon, orthogonalised

SHAPES = {  # shape -> who steps it
    (24, 16): "muon",
    (16,): "adam",
    (3, 24): "adam",
    (500, 8): "adam",
    (9, 9): "muon",
    (2, 12, 12): "adam",
    (1, 4, 16, 16): "adam",
}


def parameters(seed: int = 0) -> list[nn.Parameter]:
    generator = torch.Generator().manual_seed(seed)
    return [nn.Parameter(torch.randn(shape, generator=generator)) for shape in SHAPES]


def give_gradients(parameters: list[nn.Parameter], step: int, size: float = 1.0) -> None:
    generator = torch.Generator().manual_seed(100 + step)
    for p in parameters:
        p.grad = size * torch.randn(p.shape, generator=generator)


def torchs_own(parameters: list[nn.Parameter]) -> list[torch.optim.Optimizer]:
    of = {rule: [] for rule in ("muon", "adam")}
    for p, rule in zip(parameters, SHAPES.values(), strict=True):
        of[rule].append(p)
    muon = torch.optim.Muon(
        of["muon"], lr=0.01, momentum=0.9, weight_decay=0, adjust_lr_fn="match_rms_adamw"
    )
    return [muon, torch.optim.Adam(of["adam"], lr=0.003)]


def ours(parameters: list[nn.Parameter], clip_norm: float = 2.0) -> MuonAdam:
    return MuonAdam(parameters, lr=0.01, adam_lr=0.003, momentum=0.9, clip_norm=clip_norm)


@pytest.fixture
def bfloat16(monkeypatch: pytest.MonkeyPatch) -> None:
    """PyTorch's Muon works in it on every processor, ours on those with units for it."""
    monkeypatch.setattr("ngi.models.batched_muon.multiplies_bfloat16", lambda _: True)


@pytest.mark.usefixtures("bfloat16")
@pytest.mark.parametrize("size", [1e-3, 1.0])
def test_steps_as_muon_and_adam_do_each_on_their_own(size: float) -> None:
    mine, theirs = parameters(), parameters()
    optimizer, others = ours(mine), torchs_own(theirs)
    for step in range(5):
        for p in (mine, theirs):
            give_gradients(p, step, size)
        optimizer.step()
        nn.utils.clip_grad_norm_([p for o in others for p in o.param_groups[0]["params"]], 2.0)
        for other in others:
            other.step()
        for a, b, rule in zip(mine, theirs, SHAPES.values(), strict=True):
            assert torch.equal(a, b) if rule == "adam" else alike(a, b, 0.01), step
    optimizer.zero_grad()
    assert all(p.grad is None for p in mine)
    before = [p.detach().clone() for p in mine]
    optimizer.step()  # nothing to do
    assert all(torch.equal(a, b) for a, b in zip(mine, before, strict=True))


def alike(a: torch.Tensor, b: torch.Tensor, lr: float) -> bool:
    """To a fiftieth of a step: Muon works in bfloat16, and processors round differently."""
    step = 0.2 * lr * max(a.shape) ** 0.5 * min(a.shape) ** 0.5
    return bool((a - b).norm() <= 0.02 * step)


@pytest.mark.usefixtures("bfloat16")
def test_matrices_of_one_shape_step_together_as_each_on_its_own() -> None:
    generator = torch.Generator().manual_seed(2)
    shapes = [(24, 24), (40, 16), (24, 24), (16, 40), (40, 16), (24, 24)]
    mine = [nn.Parameter(torch.randn(shape, generator=generator)) for shape in shapes]
    theirs = [nn.Parameter(p.detach().clone()) for p in mine]
    options = {"lr": 0.01, "weight_decay": 0, "adjust_lr_fn": "match_rms_adamw"}
    optimizers = BatchedMuon(mine, **options), torch.optim.Muon(theirs, **options)
    for _ in range(4):
        for a, b in zip(mine[:-1], theirs[:-1], strict=True):  # the last one has no gradient
            a.grad = torch.randn(a.shape, generator=generator)
            b.grad = a.grad.clone()
        for optimizer in optimizers:
            optimizer.step()
    assert all(alike(a, b, 0.01) for a, b in zip(mine, theirs, strict=True))
    momenta = (
        [o.state[p]["momentum_buffer"] for p in o.param_groups[0]["params"][:-1]]
        for o in optimizers
    )
    assert all(torch.equal(a, b) for a, b in zip(*momenta, strict=True))


@pytest.mark.parametrize(("units", "error"), [(True, 0.02), (False, 1e-4)])
@pytest.mark.parametrize("shape", [(24, 16), (16, 24), (12, 12)])
def test_singular_values_go_through_the_polynomials_and_vectors_stay(
    units: bool, error: float, shape: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ngi.models.batched_muon.multiplies_bfloat16", lambda _: units)
    matrices = torch.randn((3, *shape), generator=torch.Generator().manual_seed(4))
    coefficients = a, b, c = 3.4445, -4.775, 2.0315
    found = orthogonalised(matrices, coefficients=coefficients, steps=5, epsilon=1e-7)
    left, values, right = np.linalg.svd(matrices.double().numpy(), full_matrices=False)
    values /= np.linalg.norm(values, axis=1, keepdims=True)
    for _ in range(5):
        values = a * values + b * values**3 + c * values**5
    expected = (left * values[:, None]) @ right
    assert found.dtype == (torch.bfloat16 if units else torch.float32)
    deviation = np.linalg.norm(found.double().numpy() - expected) / np.linalg.norm(expected)
    assert deviation < error


def test_clipping_is_of_the_gradient_of_all_parameters_together() -> None:
    mine = parameters()
    give_gradients(mine, 0)
    before = [p.grad.clone() for p in mine]
    norm = torch.cat([g.flatten() for g in before]).norm()
    ours(mine, clip_norm=0.5).step()
    for p, g in zip(mine, before, strict=True):
        torch.testing.assert_close(p.grad, g * 0.5 / norm)


@pytest.mark.parametrize("way", ["state_dict", "deepcopy"])
def test_a_saved_or_copied_optimiser_goes_on_bit_for_bit(way: str) -> None:
    mine = parameters()
    optimizer = ours(mine)
    for step in range(3):
        give_gradients(mine, step)
        optimizer.step()
    if way == "deepcopy":
        twins, twin = copy.deepcopy((mine, optimizer))
    else:
        buffer = io.BytesIO()
        torch.save(optimizer.state_dict(), buffer)
        buffer.seek(0)
        twins = [nn.Parameter(p.detach().clone()) for p in mine]
        twin = ours(twins)
        twin.load_state_dict(torch.load(buffer, weights_only=True))
    for step in range(3, 6):
        for stepper, p in ((optimizer, mine), (twin, twins)):
            give_gradients(p, step)
            stepper.step()
        assert all(torch.equal(a, b) for a, b in zip(mine, twins, strict=True)), step
    assert {frozenset(state) for state in twin.state.values()} == {
        frozenset({"momentum_buffer"}),
        frozenset({"step", "exp_avg", "exp_avg_sq"}),
    }


@pytest.mark.parametrize("loaded", [False, True])
def test_schedulers_of_pytorch_reach_both_parts(loaded: bool) -> None:
    mine = parameters()
    optimizer = ours(mine)
    if loaded:
        optimizer.load_state_dict(optimizer.state_dict())
    scheduler = torch.optim.lr_scheduler.LambdaLR(optimizer, lambda step: 0.0 if step else 1.0)
    assert [group["lr"] for group in optimizer.param_groups] == [0.01, 0.003]
    give_gradients(mine, 0)
    optimizer.step()
    scheduler.step()
    before = [p.detach().clone() for p in mine]
    give_gradients(mine, 1)
    optimizer.step()
    assert all(torch.equal(a, b) for a, b in zip(mine, before, strict=True))


def test_a_closure_is_called_with_gradients_on() -> None:
    weight = nn.Parameter(torch.ones(10, 10))
    optimizer = MuonAdam([weight])

    def closure() -> torch.Tensor:
        loss = weight.square().sum()
        loss.backward()
        return loss

    assert optimizer.step(closure) == 100
    assert not torch.equal(weight, torch.ones(10, 10))


@pytest.mark.parametrize("shape", [(12, 12), (3,)])
def test_one_part_may_have_nothing_to_do(shape: tuple[int, ...]) -> None:
    weight = nn.Parameter(torch.ones(shape))
    weight.grad = torch.ones(shape)
    MuonAdam([weight]).step()
    assert (weight < 1).all()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"momentum": 1.0}, "optimizer.momentum: 1.0"),
        ({"momentum": -0.1}, "optimizer.momentum: -0.1"),
        ({"clip_norm": 0.0}, "optimizer.clip_norm: 0.0"),
        ({"clip_norm": float("nan")}, "optimizer.clip_norm: nan"),
        ({"lr": -1.0}, "optimizer.lr: -1.0; expected at least 0"),
        ({"adam_lr": float("nan")}, "optimizer.adam_lr: nan"),
    ],
)
def test_numbers_out_of_range_are_named(options: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        MuonAdam(parameters(), **options)


def test_no_parameters_are_refused() -> None:
    with pytest.raises(ValueError, match="empty"):
        MuonAdam([])
