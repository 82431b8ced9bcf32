"""Whether the next batch is generated or reused (paper, Sec. 6.1)."""

# ruff: noqa: ARG002 - a policy is told more than it need look at

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import Any, Protocol, Self

from torch import Tensor


@dataclass(frozen=True)
class PolicyState:
    """What a policy knows; checkpointed, and logged at every step.

    generated_batches: how many generated batches `update` has been told of
    existing_loss: L_exist, moving average of the loss of reused samples; None before there is one
    new_loss: L_new, the same of newly generated samples
    """

    generated_batches: int = 0
    existing_loss: float | None = None
    new_loss: float | None = None

    def state_dict(self) -> dict[str, Any]:
        """Plain data, for a checkpoint."""
        return asdict(self)

    @classmethod
    def from_state_dict(cls, state: dict[str, Any]) -> Self:
        """The inverse of `state_dict`."""
        return cls(**state)


class ReusePolicy(Protocol):
    """Decides whether the next batch is a reused one."""

    by_loss: bool = True  # whether it depends on the losses; if not, a GPU need not wait for them
    stored_alone: float = 0.0  # the last share of a run's steps, in which no batch is new

    def init(self) -> PolicyState:
        """The state at the start of a run."""
        return PolicyState()

    def probability(
        self, state: PolicyState, *, generated_batches: int, store_size: int, store_capacity: int
    ) -> float:
        """p_s in [0, 1]; 0 as long as the store is empty.

        generated_batches: number of batches generated so far
        store_size, store_capacity: in patches
        """
        ...

    def reuses(
        self, probability: float, *, draw: float, batches: int, generated_batches: int
    ) -> bool:
        """Whether the next batch is reused: by the paper with that probability.

        draw: uniform in [0, 1)
        batches, generated_batches: number of batches so far, and of those that were generated
        """
        return draw < probability

    def update(
        self, state: PolicyState, *, reused: bool, losses: Tensor, large_step: Tensor
    ) -> PolicyState:
        """The state after a batch was trained on: a policy without averages only counts.

        reused: whether the batch was reused or generated
        losses: [n], before the optimiser's step; large_step: [n] bool, as stored with the patches
        """
        return replace(state, generated_batches=state.generated_batches + (not reused))


class Never(ReusePolicy):
    """Generates every batch: the paper's test of the samples' distribution (Sec. 5.1)."""

    by_loss = False

    def probability(
        self, state: PolicyState, *, generated_batches: int, store_size: int, store_capacity: int
    ) -> float:
        return 0.0


class UntilFull(ReusePolicy):
    """Generates until the store is full and reuses from then on: a fixed data set.

    Patches are trained on as they are generated, which is the first epoch. Were the data set made
    before any training, that epoch would end after as many steps and as much run time; only the
    weights in between, which evaluations and checkpoints see, would still be untrained.
    """

    by_loss = False

    def probability(
        self, state: PolicyState, *, generated_batches: int, store_size: int, store_capacity: int
    ) -> float:
        return 1.0 if store_size >= store_capacity else 0.0


CLEANEST = 512
"""Samples per pixel from which on patches are not trained on any more often: 94 times, as the rule
would have it at 1,800, has more error than 50 times (docs/exploration-ceiling)."""


class FixedProbability(ReusePolicy):
    """Reuses one share of batches, once `bootstrap_batches` batches were generated.

    Generated batches come at even distances, not by chance: were they drawn, one run would have a
    fifth more patches than another of as many steps, and that is not what samplers differ by.

    stored_alone: share of a run's steps, the last ones, that are on stored patches alone
        (`ngi.learn.Progress`). A patch that comes late is hardly trained on
    """

    by_loss = False

    def __init__(
        self, *, bootstrap_batches: int, probability: float, stored_alone: float = 0.0
    ) -> None:
        _check_bootstrap(bootstrap_batches)
        if not 0 <= probability <= 1:
            raise ValueError(f"probability: {probability}: give a number in [0, 1]")
        if not 0 <= stored_alone < 1:
            raise ValueError(f"stored_alone: {stored_alone}: give a number in [0, 1)")
        self.stored_alone = stored_alone
        self._bootstrap_batches = bootstrap_batches
        self._probability = probability

    @classmethod
    def by_samples(
        cls,
        *,
        bootstrap_batches: int,
        times_at_32: float,
        samples_per_pixel: int,
        stored_alone: float = 0.0,
    ) -> Self:
        """So that a patch is trained on the more often the less noise it has (ours, docs/learner).

        times_at_32: how often one of 32 samples per pixel is, on average, at least once. Others
            are in proportion to √(samples per pixel), to which noise is inversely proportional,
            up to `CLEANEST`; noisier ones as often
        stored_alone: so much more comes before, that it is as much in all

        Raises ValueError where times_at_32 is not a finite number above 0.
        """
        if not 0 < times_at_32 < math.inf:
            raise ValueError(f"times_at_32: {times_at_32}: give a finite number above 0")
        times = times_at_32 * math.sqrt(min(max(samples_per_pixel, 32), CLEANEST) / 32)
        steps = times * (1 - stored_alone)  # from one new batch to the next, while there are any
        return cls(
            bootstrap_batches=bootstrap_batches,
            probability=1 - 1 / steps if steps > 1 else 0.0,
            stored_alone=stored_alone,
        )

    def probability(
        self, state: PolicyState, *, generated_batches: int, store_size: int, store_capacity: int
    ) -> float:
        if store_size == 0 or generated_batches < self._bootstrap_batches:
            return 0.0
        return self._probability

    def reuses(
        self, probability: float, *, draw: float, batches: int, generated_batches: int
    ) -> bool:
        if probability == 0:
            return False
        due = (batches + 1 - self._bootstrap_batches) * (1 - probability)
        return generated_batches - self._bootstrap_batches >= math.floor(due + 0.5)


class SelfTuning(ReusePolicy):
    """Reuses with probability p_s = sigmoid(L_exist - L_new + beta) (paper, Sec. 6.1, Eq. 5).

    When the network does better on what it has seen than on what is new, p_s falls.

    bootstrap_batches: number of batches that are generated first (paper: 100)
    beta: the paper's 4.6 makes p_s 0.99 where both losses are equal
    ema_coefficient: weight of the average's old value, in [0, 1); the paper gives none, the
        release has 0.9

    L_exist and L_new are exponential moving averages of a batch's mean loss over its large-step
    samples; NaN and infinite losses are left out, and a batch that has no sample left changes
    nothing. As in the release both start at the loss at the end of the bootstrap: during it they
    are the latest batch's loss. Until there is a loss at all, p_s is 0.
    """

    by_loss = True

    def __init__(self, *, bootstrap_batches: int, beta: float, ema_coefficient: float) -> None:
        _check_bootstrap(bootstrap_batches)
        if not math.isfinite(beta):
            raise ValueError(f"beta: {beta}: give a finite number")
        if not 0 <= ema_coefficient < 1:
            raise ValueError(f"ema_coefficient: {ema_coefficient}: give a number in [0, 1)")
        self._bootstrap_batches = bootstrap_batches
        self._beta = beta
        self._ema_coefficient = ema_coefficient

    def probability(
        self, state: PolicyState, *, generated_batches: int, store_size: int, store_capacity: int
    ) -> float:
        if store_size == 0 or generated_batches < self._bootstrap_batches:
            return 0.0
        if state.existing_loss is None or state.new_loss is None:
            return 0.0
        return _sigmoid(state.existing_loss - state.new_loss + self._beta)

    def update(
        self, state: PolicyState, *, reused: bool, losses: Tensor, large_step: Tensor
    ) -> PolicyState:
        """Raises ValueError where losses and large_step differ in shape."""
        if losses.shape != large_step.shape:
            raise ValueError(
                f"large_step: shape {list(large_step.shape)}: give one per loss, "
                f"{list(losses.shape)}"
            )
        state = replace(state, generated_batches=state.generated_batches + (not reused))
        losses = losses.detach().double().cpu()
        losses = losses[large_step.cpu() & losses.isfinite()]
        if len(losses) == 0:
            return state
        loss = losses.mean().item()
        bootstrapping = not reused and state.generated_batches <= self._bootstrap_batches
        if bootstrapping or state.existing_loss is None or state.new_loss is None:
            return replace(state, existing_loss=loss, new_loss=loss)
        if reused:
            return replace(state, existing_loss=self._average(state.existing_loss, loss))
        return replace(state, new_loss=self._average(state.new_loss, loss))

    def _average(self, old: float, loss: float) -> float:
        return self._ema_coefficient * old + (1 - self._ema_coefficient) * loss


def _sigmoid(x: float) -> float:
    """1 / (1 + exp(-x)), without overflow."""
    if x >= 0:
        return 1 / (1 + math.exp(-x))
    return math.exp(x) / (1 + math.exp(x))


def _check_bootstrap(bootstrap_batches: int) -> None:
    if bootstrap_batches < 0:
        raise ValueError(f"bootstrap_batches: {bootstrap_batches}: give at least 0")
