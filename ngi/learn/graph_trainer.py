"""A trainer that launches steps and images as CUDA graphs."""

from __future__ import annotations

from ngi.learn.lightning_api import Trainer


class GraphTrainer(Trainer):
    """Lightning's. On a GPU `IlluminationModule` records what it computes (`Captured`) for it.

    Steps that need not be waited for are not (`Learner.before`).
    """
