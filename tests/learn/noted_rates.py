"""At which learning rates an optimiser's steps were taken."""

from typing import Any

import pytest
import torch


def noted_rates(rule: type[torch.optim.Optimizer], monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A list to which the rate of every step of this rule is added from here on."""
    rates: list[float] = []
    step = rule.step

    def noted(self: torch.optim.Optimizer, *arguments: Any, **options: Any) -> Any:
        (group,) = self.param_groups
        rates.append(group["lr"])
        return step(self, *arguments, **options)

    monkeypatch.setattr(rule, "step", noted)
    return rates
