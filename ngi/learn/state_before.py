"""Weights and moments as they were before a step that turns out to be none."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import torch
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel


class StateBefore:
    """Copies of all that the optimiser's step changes, made where it is: a GPU is not waited for.

    These are the weights, their average, the optimiser's state and learning rates.

    network, averaged: see `ngi.learn.Learner`
    optimizer: of the network's parameters, without Lightning around it, which counts steps
    """

    def __init__(
        self,
        *,
        network: nn.Module,
        averaged: AveragedModel | None,
        optimizer: torch.optim.Optimizer,
    ) -> None:
        self.optimizer = optimizer
        self.restorations = 0
        """How often it was gone back to so far."""
        self._network = network
        self._averaged = averaged
        self._copied: list[Tensor] = []
        self._copies: list[Tensor] = []
        self._stepped: list[Tensor] = []
        self._rates: list[float] = []

    def keep(self) -> None:
        """Copies what there is, in the place of what was kept before."""
        present = self._present()
        if list(map(id, present)) != list(map(id, self._copied)):
            self._copied = present
            self._copies = [torch.empty_like(tensor) for tensor in present]
        _copy(present, self._copies)
        self._stepped = [*self.optimizer.state]
        self._rates = [group["lr"] for group in self.optimizer.param_groups]

    @contextmanager
    def restored(self) -> Iterator[None]:
        """All is again as it was kept. The learning rates are so within only."""
        rates = [group["lr"] for group in self.optimizer.param_groups]
        for parameter in [*self.optimizer.state][len(self._stepped) :]:
            del self.optimizer.state[parameter]  # that was its first step
        _copy(self._copies, self._present())
        self._set(self._rates)
        self.restorations += 1
        yield
        self._set(rates)

    def _present(self) -> list[Tensor]:
        states = self.optimizer.state.values()
        moments = [t for state in states for t in state.values() if isinstance(t, Tensor)]
        average = self._averaged
        averages = [] if average is None else [*average.parameters(), average.n_averaged]
        return [*self._network.parameters(), *averages, *moments]

    def _set(self, rates: list[float]) -> None:
        for group, rate in zip(self.optimizer.param_groups, rates, strict=True):
            group["lr"] = rate


@torch.no_grad()
def _copy(source: Sequence[Tensor], into: Sequence[Tensor]) -> None:
    """In one call per device: PyTorch would copy tensors of both one by one."""
    for on_cpu in (True, False):
        copies, originals = ([t for t in ts if t.is_cpu is on_cpu] for ts in (into, source))
        if copies:
            torch._foreach_copy_(copies, originals)
