"""Muon for the weight matrices and Adam for everything else, as one optimiser."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import torch
from torch import Tensor, nn

from ngi.models.batched_muon import BatchedMuon

SMALLEST_SIDE = 9
"""Rows and columns from which on a weight is a matrix to Muon. Below that, an output of three
channels for example, there are hardly any directions to be made equal."""

RULES: dict[str, Callable[[list[dict[str, Any]]], torch.optim.Optimizer]] = {
    "muon": BatchedMuon,
    "adam": torch.optim.Adam,
}
"""What steps the parameters of a group, by its entry `rule`."""


class MuonAdam(torch.optim.Optimizer):
    """`torch.optim.Muon` for weight matrices, `torch.optim.Adam` for all other parameters.

    Adam lets the rank of a ReLU network's hidden layers collapse, which is what looks like spectral
    bias (arXiv 2512.14366); Muon orthogonalises the momentum of each matrix (Jordan et al. 2024),
    so that no direction is left behind. Nesterov momentum, no weight decay, and steps of Adam's
    size (Liu et al. 2025, arXiv 2502.16982): an entry's change has the root mean square 0.2 `lr`.

    To everybody else it is one optimiser: `param_groups` and `state` hold both parts, which share
    them, so that a learning rate set there counts, and checkpoints hold all there is. The entry
    `rule` of a group says which part it is.

    params: of these, weights of two dimensions with at least `SMALLEST_SIDE` rows and columns go to
        Muon; biases, output layers, embedding grids and tables of few columns to Adam
    lr: learning rate of the matrices
    adam_lr: of everything else
    momentum: of the matrices, at least 0, below 1
    clip_norm: before a step, the gradient of all parameters together is scaled down to this norm
        where it is larger
    Raises ValueError for numbers outside these ranges, for negative rates, and for no parameters.
    """

    def __init__(
        self,
        params: Iterable[nn.Parameter],
        *,
        lr: float = 3e-3,
        adam_lr: float = 3e-3,
        momentum: float = 0.95,
        clip_norm: float = 1.0,
    ) -> None:
        for name, rate in (("lr", lr), ("adam_lr", adam_lr)):
            if not rate >= 0:
                raise ValueError(f"optimizer.{name}: {rate}; expected at least 0")
        if not 0 <= momentum < 1:
            raise ValueError(f"optimizer.momentum: {momentum}; expected at least 0, below 1")
        if not clip_norm > 0:
            raise ValueError(f"optimizer.clip_norm: {clip_norm}; expected more than 0")
        by_rule: dict[str, list[nn.Parameter]] = {"muon": [], "adam": []}
        for parameter in params:
            by_rule["muon" if _is_matrix(parameter) else "adam"].append(parameter)
        options: dict[str, dict[str, Any]] = {
            "muon": {
                "lr": lr,
                "momentum": momentum,
                "weight_decay": 0.0,
                "adjust_lr_fn": "match_rms_adamw",
            },
            "adam": {"lr": adam_lr},
        }
        groups = [
            {"params": members, "rule": rule, **options[rule]}
            for rule, members in by_rule.items()
            if members
        ]
        super().__init__(groups, {"clip_norm": clip_norm})
        self._share()

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Of a copy, and of `load_state_dict`."""
        super().__setstate__(state)
        self._share()

    @torch.no_grad()
    def step(self, closure: Callable[[], Any] | None = None) -> Any:
        """Scales the gradient down where it is too large, then lets both parts step."""
        loss = None
        if closure is not None:
            with torch.enable_grad():
                loss = closure()
        parameters = [p for group in self.param_groups for p in group["params"]]
        nn.utils.clip_grad_norm_(parameters, self.defaults["clip_norm"])
        for part in self._parts:
            part.step()
        return loss

    def _share(self) -> None:
        """Both parts on the groups and the state of this optimiser: the same objects."""
        self._parts = [RULES[group["rule"]]([group]) for group in self.param_groups]
        for part in self._parts:
            part.state = self.state


def _is_matrix(parameter: Tensor) -> bool:
    return parameter.ndim == 2 and min(parameter.shape) >= SMALLEST_SIDE
