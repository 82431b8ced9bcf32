"""Where a run can be watched. Local files are the truth; a tracker is a view of them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from ngi.learn.aside import Aside


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


FINISH_SECONDS = 60.0
"""How long W&B may take to send what is left at the end of a run, and of the program."""

LEEWAY_SECONDS = 10.0
"""How much longer it may take to say so."""


class WeightsAndBiases:
    """Weights & Biases, offline unless `mode` says 'online'.

    Runs are grouped by experiment, and tagged by experiment, scene, sampler and seed. Offline runs
    lie in the run's folder; `wandb sync` sends them.

    Nothing waits for it but the end of the run, and that not for long. Where it fails, a warning
    says so once and the run goes on with its own files.
    """

    def __init__(self, *, project: str, mode: str) -> None:
        if mode not in ("offline", "online"):
            raise ValueError(f"tracker.mode: '{mode}'; expected 'offline' or 'online'")
        self._project = project
        self._mode = mode
        self._aside: Aside | None = None
        self._run: Any = None

    def start(self, *, folder: Path, settings: dict[str, Any], label: dict[str, Any]) -> None:
        """Raises RuntimeError where wandb is not installed."""
        try:
            import wandb  # only a run that asks for it pays for its import
        except ImportError as error:
            raise RuntimeError(
                f"tracker=wandb: wandb cannot be imported ({error}); `pip install wandb`, or "
                "choose tracker=local"
            ) from error

        def begin() -> None:
            self._run = wandb.init(
                project=self._project,
                mode=self._mode,  # type: ignore[arg-type]
                dir=folder,
                config=settings,
                group=label["experiment"],
                name="/".join(str(label[key]) for key in ("scene", "sampler", "seed")),
                tags=[f"{key}={label[key]}" for key in ("experiment", "scene", "sampler", "seed")],
                reinit="finish_previous",
                settings=wandb.Settings(quiet=True, finish_timeout=FINISH_SECONDS),
            )

        self._aside = Aside(
            "Weights & Biases",
            consequence=f"rows are missing there, but all are in the files of {folder}",
        )
        self._aside.call(begin)

    def log(self, row: Mapping[str, object]) -> None:
        if self._aside is not None:
            given = {key: value for key, value in row.items() if value is not None}
            self._aside.call(lambda: self._run.log(given, step=given["step"]))

    def finish(self, *, failed: bool) -> None:
        if self._aside is not None:
            self._aside.call(lambda: self._run.finish(exit_code=int(failed)))
            self._aside.end(seconds=FINISH_SECONDS + LEEWAY_SECONDS)
            self._aside = None
