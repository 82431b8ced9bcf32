"""Where a run can be watched. Local files are the truth; a tracker is a view of them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol


class Tracker(Protocol):
    """Watches a run."""

    def start(self, *, folder: Path, settings: dict[str, Any], label: dict[str, Any]) -> None:
        """Called once, before training."""
        ...

    def log(self, row: Mapping[str, object]) -> None:
        """A row of numbers with its `step`."""
        ...

    def finish(self, *, failed: bool) -> None:
        """Called whatever happens, so that the jobs of a sweep stay apart."""
        ...


class Local:
    """The run's own files and nothing else."""

    def start(self, *, folder: Path, settings: dict[str, Any], label: dict[str, Any]) -> None:
        pass

    def log(self, row: Mapping[str, object]) -> None:
        pass

    def finish(self, *, failed: bool) -> None:
        pass


class WeightsAndBiases:
    """Weights & Biases, offline unless `mode` says 'online'.

    Runs are grouped by experiment, and tagged by experiment, scene, sampler and seed. Offline runs
    lie in the run's folder; `wandb sync` sends them.
    """

    def __init__(self, *, project: str, mode: str) -> None:
        if mode not in ("offline", "online"):
            raise ValueError(f"tracker.mode: '{mode}'; expected 'offline' or 'online'")
        self._project = project
        self._mode = mode
        self._run: Any = None

    def start(self, *, folder: Path, settings: dict[str, Any], label: dict[str, Any]) -> None:
        import wandb  # only a run that asks for it pays for its import

        self._run = wandb.init(
            project=self._project,
            mode=self._mode,  # type: ignore[arg-type]
            dir=folder,
            config=settings,
            group=label["experiment"],
            name="/".join(str(label[key]) for key in ("scene", "sampler", "seed")),
            tags=[f"{key}={label[key]}" for key in ("experiment", "scene", "sampler", "seed")],
            reinit="finish_previous",
            settings=wandb.Settings(quiet=True),
        )

    def log(self, row: Mapping[str, object]) -> None:
        self._run.log({k: v for k, v in row.items() if v is not None}, step=row["step"])

    def finish(self, *, failed: bool) -> None:
        if self._run is not None:
            self._run.finish(exit_code=int(failed))
            self._run = None
