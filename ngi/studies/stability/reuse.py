"""The self-tuning policy and the store where losses, weights and sizes are extreme."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import torch
from torch import Tensor

from ngi.patches import BufferLayout, Patches
from ngi.reuse import PatchStore, SelfTuning
from ngi.reuse.policies import PolicyState
from ngi.studies.stability.case import Case, Conditions, Outcome

LAYOUT = BufferLayout(("position",))
DRAWS = 40_000


def _policy() -> SelfTuning:
    return SelfTuning(bootstrap_batches=0, beta=4.6, ema_coefficient=0.9)


def _probability(state: PolicyState) -> float:
    return _policy().probability(state, generated_batches=200, store_size=16, store_capacity=100)


def _averages_apart(_: Conditions, *, existing: float, new: float, expected: float) -> Outcome:
    probability = _probability(PolicyState(200, existing_loss=existing, new_loss=new))
    return Outcome(
        finite=math.isfinite(probability),
        error=abs(probability - expected),
        limit=1e-12,
        done=f"p_s = {probability:.3g}, without overflow",
    )


def _spike(_: Conditions) -> Outcome:
    """One new batch of loss 1e4 among losses of 0.1: after how many batches reuse is back."""
    policy, large = _policy(), torch.ones(16, dtype=torch.bool)
    state = PolicyState(200, existing_loss=0.1, new_loss=0.1)
    before = _probability(state)
    state = policy.update(state, reused=False, losses=torch.full((16,), 1e4), large_step=large)
    at_once, batches = _probability(state), 0
    while _probability(state) < 0.5 * before and batches < 1000:
        state = policy.update(state, reused=False, losses=torch.full((16,), 0.1), large_step=large)
        batches += 1
    # The average falls below beta, 4.6, after n with 0.9^n · 1000 = 4.6.
    expected = math.ceil(math.log(4.6 / 1e3) / math.log(0.9))
    return Outcome(
        finite=True,
        error=abs(batches - expected),
        limit=1,
        done=f"p_s falls to {at_once:.2g} and is back after {batches} new batches",
    )


def _without_losses(_: Conditions) -> Outcome:
    """Batches in which no loss is finite, or no sample a large step, change no average."""
    policy = _policy()
    state = PolicyState(200, existing_loss=0.1, new_loss=0.2)
    nan, one = torch.full((16,), math.nan), torch.ones(16)
    large, small = torch.ones(16, dtype=torch.bool), torch.zeros(16, dtype=torch.bool)
    after = policy.update(state, reused=True, losses=nan, large_step=large)
    after = policy.update(after, reused=True, losses=one, large_step=small)
    return Outcome(finite=True, done="averages stay", as_expected=after == state)


def _store(losses: Tensor, capacity: int | None = None) -> PatchStore:
    store = PatchStore(capacity=capacity or len(losses), layout=LAYOUT)
    patches = Patches.blank(len(losses), layout=LAYOUT, dimensions=1, patch_size=2)
    store.update(store.add(patches), losses)
    return store


def _draws(_: Conditions, *, losses: Callable[[], Tensor], done: str) -> Outcome:
    """Draws in proportion to the weights: the largest deviation, in standard errors."""
    weights = losses()
    store = _store(weights)
    ids = store.draw(DRAWS, torch.Generator().manual_seed(0))
    found = torch.bincount(ids, minlength=len(weights)).double() / DRAWS
    weights = weights.double().nan_to_num(0, 0)
    even = torch.full_like(weights, 1 / len(weights))
    expected = weights / weights.sum() if weights.sum() > 0 else even
    deviation = (expected * (1 - expected) / DRAWS).sqrt().clamp_min(1 / DRAWS)
    return Outcome(
        finite=bool(found.isfinite().all()),
        error=float(((found - expected).abs() / deviation).max()),
        limit=4.5,
        done=done,
    )


def _one_dominates() -> Tensor:
    return torch.cat([torch.tensor([1e30]), torch.full((999,), 1e-30)])


def _some_not_finite() -> Tensor:
    return torch.cat([torch.tensor([math.nan, math.inf]), torch.ones(8)])


def _small_capacity(_: Conditions) -> Outcome:
    """A store that a batch does not fit into."""
    try:
        _store(torch.ones(16), capacity=8).add(
            Patches.blank(16, layout=LAYOUT, dimensions=1, patch_size=2)
        )
    except (ValueError, IndexError) as error:
        return Outcome(finite=True, done=f"refused: {error}", as_expected="capacity" in str(error))
    return Outcome(finite=True, done="accepted", as_expected=False)


CASES = (
    *(
        Case(
            f"averages {existing:g} and {new:g}",
            partial(_averages_apart, existing=existing, new=new, expected=expected),
            {},
        )
        for existing, new, expected in (
            (1e300, 0.0, 1.0),
            (0.0, 1e300, 0.0),
            (1e308, 1e308, 1 / (1 + math.exp(-4.6))),
            (0.0, 0.0, 1 / (1 + math.exp(-4.6))),
        )
    ),
    Case("a new batch of loss 1e4", _spike, {}),
    Case("no usable loss in a batch", _without_losses, {}),
    Case(
        "all weights equal",
        partial(_draws, losses=lambda: torch.full((50,), 0.3), done="drawn evenly"),
        {},
    ),
    Case(
        "all weights zero",
        partial(_draws, losses=lambda: torch.zeros(50), done="drawn evenly"),
        {},
    ),
    Case(
        "weights of 1e-320",
        partial(
            _draws,
            losses=lambda: torch.full((50,), 1e-320, dtype=torch.float64),
            done="drawn evenly",
        ),
        {},
    ),
    Case(
        "one weight dominates by 1e60",
        partial(_draws, losses=_one_dominates, done="drawn every time"),
        {},
    ),
    Case(
        "NaN and Inf among the weights",
        partial(_draws, losses=_some_not_finite, done="weight 0, counted"),
        {},
    ),
    Case(
        "store of one patch",
        partial(_draws, losses=lambda: torch.ones(1), done="drawn every time"),
        {},
    ),
    Case("capacity below a batch", _small_capacity, {}),
)
