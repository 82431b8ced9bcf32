"""The LightningDataModule around the on-the-fly stream."""

from __future__ import annotations

from typing import Any

from torch.utils.data import DataLoader

from ngi.learn.batch import Batch
from ngi.learn.lightning_api import LightningDataModule
from ngi.learn.stream import TrainingStream


class ExplorationDataModule(LightningDataModule):
    """Hands out the stream's ready-made batches and keeps the stream's state in checkpoints."""

    def __init__(self, *, stream: TrainingStream) -> None:
        super().__init__()
        self.stream = stream

    def train_dataloader(self) -> DataLoader[Batch]:
        # Batches come ready-made, in this process: a worker would run ahead of the network.
        return DataLoader(self.stream, batch_size=None, num_workers=0)

    def state_dict(self) -> dict[str, Any]:
        return self.stream.state_dict()

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        self.stream.load_state_dict(state_dict)
