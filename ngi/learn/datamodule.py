"""The LightningDataModule around the on-the-fly stream."""

from collections.abc import Iterator
from typing import Any

from ngi.learn.batch import ENDLESS, Batch
from ngi.learn.lightning_api import LightningDataModule
from ngi.learn.stream import TrainingStream


class EndlessBatches:
    """The stream's batches, with a length: without one, Lightning fetches a batch ahead.

    The sampler would run one step behind the network.
    """

    def __init__(self, stream: TrainingStream) -> None:
        self._stream = stream

    def __iter__(self) -> Iterator[Batch]:
        return iter(self._stream)

    def __len__(self) -> int:
        return ENDLESS


class ExplorationDataModule(LightningDataModule):
    """Hands out the stream's ready-made batches and keeps the stream's state in checkpoints."""

    def __init__(self, *, stream: TrainingStream) -> None:
        super().__init__()
        self.stream = stream

    def train_dataloader(self) -> EndlessBatches:
        return EndlessBatches(self.stream)

    def state_dict(self) -> dict[str, Any]:
        return self.stream.state_dict()

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        self.stream.load_state_dict(state_dict)
