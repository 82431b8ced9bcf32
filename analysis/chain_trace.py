"""What the Markov chains of a run did, from its file chains.bin."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from analysis.records import read_records
from analysis.runs import Run


@dataclass(frozen=True)
class ChainTrace:
    """T generated batches of n chains; arrays are [T, n] if nothing else is said.

    step: [T] training step, as in steps.csv
    position: [T, n, S] the proposals, scene variables and then patch position; None in scenes of
        very many variables
    accepted, large_step, initialised: bool; the last where a chain held no state before
    target_proposed, target_current: target density of the proposal and of the state before, under
        that step's weights; NaN where it was not computed
    """

    step: np.ndarray
    position: np.ndarray | None
    accepted: np.ndarray
    large_step: np.ndarray
    initialised: np.ndarray
    target_proposed: np.ndarray
    target_current: np.ndarray

    @cached_property
    def entered(self) -> np.ndarray:
        """Record at which a chain entered the state that it holds after each batch, -1 for none."""
        records = np.arange(len(self.step))[:, None]
        return np.maximum.accumulate(np.where(self.accepted, records, -1), axis=0)

    @cached_property
    def state(self) -> np.ndarray | None:
        """[T, n, S] where the chains stand after each batch; NaN for one that holds no state."""
        if self.position is None:
            return None
        chain = np.arange(self.accepted.shape[1])
        there = self.position[self.entered, chain]
        return np.where(self.entered[..., None] >= 0, there, np.nan)

    @property
    def state_target(self) -> np.ndarray:
        """Target density of the state that a chain holds after each batch."""
        return np.where(self.accepted, self.target_proposed, self.target_current)

    def acceptance_rate(self, *, large_step: bool | None = None) -> float:
        """Accepted part of the proposals, or of the large or small steps; NaN where there is none.

        A chain's first state is not compared with anything and does not count.
        """
        selected = ~self.initialised
        if large_step is not None:
            selected = selected & (self.large_step == large_step)
        return float(self.accepted[selected].mean()) if selected.any() else float("nan")

    def lifetimes(self) -> scipy.stats.CensoredData:
        """Of every state, the proposals made from it, that which was accepted included.

        States that chains still hold at the end live longer than is known: they are censored.
        """
        complete, censored = [], []
        for accepted in self.accepted.T:
            entries = np.flatnonzero(accepted)
            complete.append(np.diff(entries))
            censored.append(len(accepted) - 1 - entries[-1:])
        alive = np.concatenate(censored)
        lengths = np.concatenate([*complete, alive[alive > 0]])
        unfinished = np.arange(len(lengths)) >= len(lengths) - int((alive > 0).sum())
        return scipy.stats.CensoredData.right_censored(lengths, unfinished)

    def survival(self) -> tuple[np.ndarray, np.ndarray]:
        """Lifetimes, ascending, and the part of the states that outlive each (Kaplan and Meier)."""
        curve = scipy.stats.ecdf(self.lifetimes()).sf
        return curve.quantiles, curve.probabilities

    def median_lifetime(self) -> float:
        """Proposals after which half of the states are left; NaN where more than half last."""
        lifetimes, alive = self.survival()
        return float(lifetimes[alive <= 0.5].min()) if (alive <= 0.5).any() else float("nan")


def read_chain_trace(run: Run) -> ChainTrace | None:
    """None for a run that left no trace. Raises ValueError where the file is damaged."""
    path = run.folder / "chains.bin"
    records = read_records(path)
    if records is None or not len(records):
        return None
    fields: dict[str, Any] = {name: records[name] for name in records.dtype.names or ()}
    try:
        return ChainTrace(**{"position": None, **fields})
    except TypeError as error:
        raise ValueError(f"{path} was written by another version ({error})") from error
