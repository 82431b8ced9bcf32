"""The loss of sequences of frames (Işık et al. 2021, Sec. 4)."""

from dataclasses import dataclass

import torch
from torch import Tensor

EPSILON = 1e-2
"""Of `smape`, in units of radiance."""


@dataclass(frozen=True, kw_only=True)
class SequenceSmape:
    """SMAPE of the frames + temporal_weight · SMAPE of their changes from frame to frame.

    temporal_weight: theirs is 0.25
    """

    temporal_weight: float

    def __post_init__(self) -> None:
        if self.temporal_weight < 0:
            raise ValueError(
                f"loss.temporal_weight is {self.temporal_weight}: it cannot be negative"
            )

    def __call__(self, prediction: Tensor, target: Tensor) -> Tensor:
        """Log1p radiance [n, frames, P, P, 3], predicted and rendered, to the loss of each, [n].

        Raises ValueError for shapes that differ, and for less than two frames.
        """
        if prediction.shape != target.shape or prediction.ndim != 5 or prediction.shape[1] < 2:
            raise ValueError(
                f"prediction {list(prediction.shape)} and target {list(target.shape)}: expected "
                "the same shape [n, frames, P, P, 3], with two frames at least"
            )
        frames, truth = torch.expm1(prediction.float()), torch.expm1(target.float())
        changes = smape(frames.diff(dim=1), truth.diff(dim=1))
        return smape(frames, truth) + self.temporal_weight * changes


def smape(a: Tensor, b: Tensor) -> Tensor:
    """[n]: mean of |a − b|₁ / (|a|₁ + |b|₁ + ε) / 3 over [n, frames, P, P, 3]; norms over RGB."""
    error = (a - b).abs().sum(dim=-1)
    return (error / (a.abs().sum(dim=-1) + b.abs().sum(dim=-1) + EPSILON)).flatten(1).mean(1) / 3
