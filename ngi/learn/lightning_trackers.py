"""TensorBoard and MLflow, by Lightning's own loggers."""

import logging
from abc import abstractmethod
from collections.abc import Mapping
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ngi.evaluate import SETS, Comparison
from ngi.files.extras import install_command
from ngi.files.row_log import RowLog
from ngi.learn.interruption import Interrupted
from ngi.learn.remote_tracker import (
    Remote,
    group,
    job_type,
    kept_id,
    nested,
    reason,
    shown_name,
)


class LightningLogger(Remote):
    """What the loggers of Lightning have in common.

    options: what was chosen of each group of conf/
    """

    extra: str
    """Of pyproject.toml, and the option of conf/tracker."""

    def __init__(self, *, options: Mapping[str, Any], every: int) -> None:
        super().__init__(every=every)
        self._options = options
        self._logger: Any = None

    def _import(self) -> None:
        if find_spec(self.extra) is None:
            raise RuntimeError(
                f"tracker={self.extra}: {self.extra} is not installed; "
                f"`{install_command(self.extra)}`, or choose tracker=local"
            )

    def _log(self, row: dict[str, float]) -> None:
        values = {key: value for key, value in row.items() if key != "step"}
        self._logger.log_metrics(values, step=int(row["step"]))

    def _show(self, comparison: Comparison, step: int) -> None:
        self._picture("comparison", comparison.sheet, step)
        for name, image in comparison.error_maps.items():
            self._picture(f"error_maps/{name.replace(' ', '_')}", image, step)

    def _end(self, failure: BaseException | None) -> None:
        self._logger.finalize("success" if failure is None else "failed")

    @abstractmethod
    def _picture(self, name: str, image: Image.Image, step: int) -> None: ...


class TensorBoard(LightningLogger):
    """TensorBoard, in the folder tensorboard/ of the run's folder.

    A run that goes on does so in the same folder; what is done again hides what was there. The
    configuration of a finished run stands below HPARAMS, with the lowest value of every metric.
    """

    name = "TensorBoard"
    extra = "tensorboard"

    def _begin(self, folder: Path, settings: dict[str, Any], label: dict[str, Any]) -> None:
        from lightning.pytorch.loggers import TensorBoardLogger

        last = RowLog(folder / "steps.csv").last_step
        self._configuration = nested(label, settings, self._options)
        self._logger = TensorBoardLogger(
            folder,
            name="tensorboard",
            version="",
            default_hp_metric=False,
            purge_step=last + 1,
        )

    def _picture(self, name: str, image: Image.Image, step: int) -> None:
        self._logger.experiment.add_image(name, np.asarray(image), step, dataformats="HWC")

    def _keep(self) -> None:
        lowest = {f"lowest/{key}": value for key, value in self._best.items()}
        self._logger.log_hyperparams(self._configuration, lowest)


STEP, EVALUATION = "train/loss", f"{SETS[0]}/mape"
"""What every row of either kind has."""


class MLflow(LightningLogger):
    """MLflow: one run there, in one experiment, across interruptions; its id is in tracker.json.

    What is done again after an interruption is there already, and is not told twice.

    uri: of the tracking server or its database
    experiment: as MLflow calls what runs are listed by
    """

    name = "MLflow"
    extra = "mlflow"

    def __init__(
        self, *, uri: str, experiment: str, options: Mapping[str, Any], every: int
    ) -> None:
        super().__init__(options=options, every=every)
        self._uri = uri
        self._experiment = experiment
        self._told: dict[str, int] = {}

    def _begin(self, folder: Path, settings: dict[str, Any], label: dict[str, Any]) -> None:
        from lightning.pytorch.loggers import MLFlowLogger

        logging.getLogger("mlflow").setLevel(logging.WARNING)  # it tells of its database's tables
        logger = partial(MLFlowLogger, experiment_name=self._experiment, tracking_uri=self._uri)
        new = logger(
            run_name=shown_name(label),
            tags={"group": group(label, settings, self._options), "job_type": job_type(label)},
        )

        def begun() -> str:
            new.log_hyperparams(nested(label, settings, self._options))  # they cannot change later
            return str(new.run_id)

        run_id = kept_id(folder, "mlflow", begun)
        self._logger = logger(run_id=run_id)
        client = self._logger.experiment
        client.update_run(run_id, status="RUNNING")
        for key in (STEP, EVALUATION):
            points = client.get_metric_history(run_id, key)
            self._told[key] = max((point.step for point in points), default=-1)

    def _log(self, row: dict[str, float]) -> None:
        if row["step"] > self._told[STEP if STEP in row else EVALUATION]:
            super()._log(row)

    def _show(self, comparison: Comparison, step: int) -> None:
        if step > self._told[EVALUATION]:
            super()._show(comparison, step)

    def _picture(self, name: str, image: Image.Image, step: int) -> None:
        self._logger.experiment.log_image(
            self._logger.run_id, np.asarray(image), key=name, step=step
        )

    def _end(self, failure: BaseException | None) -> None:
        told = reason(failure)  # hides that of an earlier start
        self._logger.experiment.set_tag(self._logger.run_id, "failure", told)
        if isinstance(failure, Interrupted):
            self._logger.finalize("KILLED")
        else:
            super()._end(failure)

    def _keep(self) -> None:
        for name in ("result.json", "metrics.csv"):
            self._logger.experiment.log_artifact(self._logger.run_id, self._folder / name)
