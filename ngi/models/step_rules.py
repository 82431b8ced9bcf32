"""How far an optimiser's step for a gradient would go, parameter by parameter."""

from collections.abc import Mapping
from typing import Any, Protocol, Self

import torch
from torch import Tensor

from ngi.models.adam_step import AdamStep, check_adam
from ngi.models.muon import MuonAdam
from ngi.models.muon_step import MuonStep


class Step(Protocol):
    """The next step of one parameter, as a function of its gradient."""

    @classmethod
    def of(cls, parameter: Tensor, group: Mapping[str, Any], state: Mapping[str, Any]) -> Self:
        """From the optimiser's parameter group and state, which is empty before the first step."""
        ...

    def scaled(self, factor: float) -> Self:
        """The step for `factor` times the gradient, as a function of the gradient."""
        ...

    def squared_norm(self, gradients: Tensor) -> Tensor:
        """‖step(g_i)‖² of n gradients [n, *parameter.shape], [n]."""
        ...


STEPS: dict[str, type[Step]] = {"muon": MuonStep, "adam": AdamStep}
"""By the entry `rule` of a parameter group."""


class StepRules:
    """The next steps of all parameters of an optimiser, `torch.optim.Adam` or `MuonAdam`.

    Raises TypeError for another optimiser, ValueError for Adam's weight_decay, amsgrad or maximize.
    """

    def __init__(self, optimizer: torch.optim.Optimizer) -> None:
        if not isinstance(optimizer, torch.optim.Adam | MuonAdam):
            raise TypeError(
                f"the norm of a step is unknown for {type(optimizer).__name__}: choose "
                "torch.optim.Adam (optimizer=adam) or ngi.models.MuonAdam (optimizer=muon), or a "
                "target that needs no step norm"
            )
        for group in optimizer.param_groups:
            if group.get("rule", "adam") == "adam":
                check_adam(group)
        self._optimizer = optimizer
        self._groups = {p: group for group in optimizer.param_groups for p in group["params"]}

    def __contains__(self, parameter: Tensor) -> bool:
        return parameter in self._groups

    def step(self, parameter: Tensor) -> Step:
        """From the optimiser's present state."""
        group = self._groups[parameter]
        kind = STEPS[group.get("rule", "adam")]
        return kind.of(parameter, group, self._optimizer.state.get(parameter, {}))
