"""The step that Adam would take for a gradient, without taking it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import torch
from torch import Tensor

UNSUPPORTED = ("weight_decay", "amsgrad", "maximize")


@dataclass(frozen=True)
class AdamStep:
    """What Adam would do next to one parameter, as a function of its gradient g.

    With m and v the moments so far and t the number of the step,

        step(g) = −learning_rate · (first + first_gain·g) / (√(second + second_gain·g²) + epsilon),
        first  = β₁·m / (1 − β₁ᵗ),  first_gain  = (1 − β₁) / (1 − β₁ᵗ),
        second = β₂·v / (1 − β₂ᵗ),  second_gain = (1 − β₂) / (1 − β₂ᵗ).
    """

    first: Tensor
    second: Tensor
    first_gain: float
    second_gain: float
    epsilon: float
    learning_rate: float

    @classmethod
    def of(cls, parameter: Tensor, group: Mapping[str, Any], state: Mapping[str, Any]) -> Self:
        """From the optimiser's parameter group and state, which is empty before the first step."""
        beta1, beta2 = group["betas"]
        step = float(state["step"]) + 1 if state else 1.0
        correction1, correction2 = 1 - beta1**step, 1 - beta2**step
        zero = torch.zeros_like(parameter, requires_grad=False)
        return cls(
            first=state.get("exp_avg", zero) * (beta1 / correction1),
            second=state.get("exp_avg_sq", zero) * (beta2 / correction2),
            first_gain=(1 - beta1) / correction1,
            second_gain=(1 - beta2) / correction2,
            epsilon=group["eps"],
            learning_rate=float(group["lr"]),
        )

    def scaled(self, factor: float) -> Self:
        """The step for `factor` times the gradient, as a function of the gradient."""
        return replace(
            self,
            first_gain=self.first_gain * factor,
            second_gain=self.second_gain * factor**2,
        )

    def squared_norm(self, gradients: Tensor) -> Tensor:
        """‖step(g_i)‖² of n gradients [n, *parameter.shape], [n]."""
        chunks = gradients.split(gradients_per_chunk(self.first))
        norm = self.learning_rate * torch.cat([self._norm(g) for g in chunks])
        return norm * norm

    def _norm(self, g: Tensor) -> Tensor:
        denominator = torch.addcmul(self.second, g, g, value=self.second_gain)
        denominator.sqrt_().add_(self.epsilon)
        step = torch.add(self.first, g, alpha=self.first_gain).div_(denominator)
        norms: Tensor = torch.linalg.vector_norm(step.flatten(1), dim=1)
        return norms


def gradients_per_chunk(parameter: Tensor) -> int:
    """How many gradients to treat at a time: on a CPU as many as stay in its cache."""
    elements = 2**20 if parameter.device.type == "cpu" else 2**26
    return max(1, elements // max(1, parameter.numel()))


def check_adam(group: Mapping[str, Any]) -> None:
    """Raises ValueError for a parameter group with weight_decay, amsgrad or maximize."""
    for option in UNSUPPORTED:
        if group[option]:
            raise ValueError(
                f"optimizer.{option} is {group[option]}, which the norm of an Adam step does "
                "not support: switch it off, or choose a target that needs no step norm"
            )
