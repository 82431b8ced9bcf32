"""Weights & Biases, as its users expect a run there to look."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from secrets import token_hex
from typing import Any

from ngi.evaluate import SETS, Comparison
from ngi.files.row_log import RowLog
from ngi.files.run_folder import LAST
from ngi.learn.interruption import Interrupted
from ngi.learn.remote_tracker import (
    FINISH_SECONDS,
    Remote,
    group,
    job_type,
    kept_id,
    nested,
    reason,
    shown_name,
)

SWEEP = "WANDB_SWEEP_ID"
"""Set by W&B's agents, which also choose the project and the run's id."""

LONGEST_TAG = 64
"""Characters: `wandb.init` refuses longer ones."""

RESULT = ("result.json", "settings.json", "commits.json", "metrics.csv", "steps.csv")
NETWORK = (LAST, "result.json", "settings.json", "scene.json")
"""Files of the artifacts; those of the second are a folder that `ngi view` opens."""


class WeightsAndBiases(Remote):
    """Weights & Biases, offline unless `mode` says 'online'.

    Errors are shown against run time, losses against steps. The summary has every metric's last
    value, its lowest below 'best/', and as 'failure' why a run ended early. Each evaluation brings
    a sheet of predictions, references and error maps of the hard frames, and the error maps one by
    one. Runs are grouped by sweep, or else by experiment or budget; their job type is what else
    they differ in beside scene and seed.

    An interrupted run goes on as the same one: its id is in tracker.json. Offline, each start has a
    folder of its own below wandb/ of the run's folder, which `wandb sync` joins.

    tags: beside those of scene, sampler and seed, and those of the variable WANDB_TAGS
    network: whether the network of the finished run is an artifact too, beside its result
    options: what was chosen of each group of conf/
    """

    name = "Weights & Biases"

    def __init__(
        self,
        *,
        project: str,
        mode: str,
        tags: Sequence[str],
        network: bool,
        options: Mapping[str, Any],
        every: int,
    ) -> None:
        super().__init__(every=every)
        if mode not in ("offline", "online"):
            raise ValueError(f"tracker.mode: '{mode}'; expected 'offline' or 'online'")
        self._project = project
        self._mode = mode
        self._tags = tags
        self._network = network
        self._options = options
        self._run: Any = None
        self._first = 0

    def finished(self, *, folder: Path, settings: dict[str, Any], label: dict[str, Any]) -> None:
        """Of a sweep by W&B's agents, the last evaluation is told once more: it waits for one."""
        if SWEEP in os.environ:
            self.start(folder=folder, settings=settings, label=label)
            row = RowLog(folder / "metrics.csv").last_row or {}
            self._tell({key: float(value) for key, value in row.items() if value})

    def _import(self) -> None:
        try:
            import wandb  # noqa: F401  only a run that asks for it pays for its import
        except ImportError as error:
            raise RuntimeError(
                f"tracker=wandb: wandb cannot be imported ({error}); `pip install wandb`, or "
                "choose tracker=local"
            ) from error

    def _begin(self, folder: Path, settings: dict[str, Any], label: dict[str, Any]) -> None:
        import wandb

        by_agent = SWEEP in os.environ
        self._run = wandb.init(
            project=None if by_agent else self._project,
            mode=self._mode,  # type: ignore[arg-type]
            dir=folder,
            id=None if by_agent else kept_id(folder, "wandb", lambda: token_hex(4)),
            resume=None if by_agent else "allow",
            config=nested(label, settings, self._options),
            group=group(label, settings, self._options),
            job_type=job_type(label),
            name=shown_name(label),
            tags=self._all_tags(label),
            reinit="finish_previous",
            settings=wandb.Settings(quiet=True, finish_timeout=FINISH_SECONDS),
        )
        self._first = int(self._run.step)
        self._run.define_metric("step")
        self._run.define_metric("run_seconds", step_metric="step")
        for section in ("train", "run"):
            self._run.define_metric(f"{section}/*", step_metric="step")
        for section in (*SETS, "best"):
            self._run.define_metric(f"{section}/*", step_metric="run_seconds")

    def _all_tags(self, label: dict[str, Any]) -> list[str]:
        """Each as short as W&B takes it; those given here would win over the environment's."""
        ours = [f"{key}={label[key]}" for key in ("scene", "sampler", "seed")]
        told = [*ours, *map(str, self._tags), *os.environ.get("WANDB_TAGS", "").split(",")]
        return [tag[:LONGEST_TAG] for tag in told if tag]

    def _log(self, row: dict[str, float]) -> None:
        self._send(row, int(row["step"]))

    def _send(self, content: dict[str, Any], step: int) -> None:
        """W&B ignores steps before that with which a run goes on there. What is made once more of
        the step before, as an evaluation, is sent with what comes next; of earlier ones it has all.
        """
        if step >= self._first:
            self._run.log(content, step=step)
        elif step == self._first - 1:
            self._run.log(content, commit=False)

    def _show(self, comparison: Comparison, step: int) -> None:
        from wandb import Image

        maps = [Image(image, caption=name) for name, image in comparison.error_maps.items()]
        sheet = Image(comparison.sheet, file_type="jpg")
        self._send({"comparison": sheet, "error_maps": maps}, step)

    def _keep(self) -> None:
        self._add("result", "result", RESULT)
        if self._network:
            self._add("network", "model", NETWORK)

    def _add(self, name: str, kind: str, files: tuple[str, ...]) -> None:
        from wandb import Artifact

        artifact = Artifact(f"{name}-{self._run.id}", type=kind)
        for file in files:
            if (path := self._folder / file).exists():
                artifact.add_file(str(path))
        self._run.log_artifact(artifact)

    def _end(self, failure: BaseException | None) -> None:
        self._run.summary["failure"] = reason(failure)  # hides that of an earlier start
        code = failure.code if isinstance(failure, Interrupted) else int(failure is not None)
        self._run.finish(exit_code=code)
