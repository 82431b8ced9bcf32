"""What one evaluation found: per frame, averaged, for CSV rows, result files and pictures."""

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from statistics import median
from typing import Any

import torch
from PIL import Image
from torch import Tensor

from ngi.evaluate.linear import write_linear
from ngi.evaluate.pictures import Panels, stacked
from ngi.evaluate.protocol import METRICS, SETS, EvaluationProtocol, Frame
from ngi.evaluate.references import Reference
from ngi.files.durable import full_disk_named

WORST_OF = 20
"""The worst 5 %, one frame or pixel of 20, are averaged on their own."""


@dataclass(frozen=True)
class FrameMetrics:
    """The metrics of one frame; `lpips` is None where LPIPS is not available.

    non_finite: number of pixels with NaN or Inf in the prediction; with any, each metric is NaN
    or Inf.
    """

    set: str
    index: int
    mape: float
    dssim: float
    mae: float
    lpips: float | None
    non_finite: int


def worst_mean(values: Iterable[float]) -> float:
    """Mean of the worst 5 % of the frames' values, rounded up to whole frames; NaN counts as worst.

    With up to 20 frames this is the worst frame.
    """
    order = sorted(values, key=lambda value: math.inf if math.isnan(value) else value)
    return mean(order[-math.ceil(len(order) / WORST_OF) :])


def worst(values: Tensor) -> Tensor:
    """The largest 5 % of [n], rounded up to whole ones; NaN counts as largest."""
    return values.topk(math.ceil(len(values) / WORST_OF)).values


def mean(values: Iterable[float]) -> float:
    """Arithmetic mean; NaN or Inf where one of the values is."""
    numbers = list(values)
    return sum(numbers) / len(numbers)


@dataclass(frozen=True)
class Comparison:
    """Pictures of a set of frames.

    sheet: a row per frame: prediction, reference, error map
    error_maps: by frame, as in 'hard 3'
    """

    sheet: Image.Image
    error_maps: dict[str, Image.Image]


@dataclass(frozen=True, kw_only=True)
class EvaluatedFrame:
    """A test frame, what was predicted of it, and how good that is.

    prediction: [H, W, 3] linear radiance
    floor: what a perfect prediction would score for the reference's own noise; of DSSIM and LPIPS a
        lower bound, see `Reference.radiance`
    relmse: relative mean square error without the reference's noise
    seconds: by part: 'buffers', 'inputs' (whatever else the network is given of a frame, which may
        have to be path-traced) and 'network'
    """

    frame: Frame
    prediction: Tensor
    reference: Reference
    metrics: FrameMetrics
    floor: FrameMetrics
    relmse: float
    seconds: dict[str, float]

    @property
    def log_errors(self) -> Tensor:
        """[H·W] absolute differences of log1p radiance, mean over the channels."""
        both = (self.prediction, self.reference.radiance)
        prediction, reference = (radiance.clamp(min=0).log1p() for radiance in both)
        return (prediction - reference).abs().mean(dim=-1).flatten()

    def panels(self, protocol: EvaluationProtocol) -> Panels:
        """Its pictures."""
        return Panels.of(
            self.prediction,
            self.reference.radiance,
            epsilon=protocol.epsilon,
            exposure=protocol.exposure,
        )


@dataclass(frozen=True)
class Evaluation:
    """The metrics of every test frame under one protocol.

    reference_hash: hash over all references
    lpips_note: why there is no LPIPS, or None
    """

    protocol: EvaluationProtocol
    frames: tuple[EvaluatedFrame, ...]
    reference_hash: str
    lpips_note: str | None

    def row(self) -> dict[str, float | int | None]:
        """One flat row for metrics.csv: `hard_mape`, `hard_mape_worst5`, …, `hard_relmse`,
        `hard_tail`, `hard_non_finite`, ….

        The tail is the mean absolute difference of log1p radiance over the worst 5 % of all pixels
        of a set's frames.

        The keys never depend on the values; LPIPS is None where it is not available.
        """
        row: dict[str, float | int | None] = {}
        for set_name in SETS:
            metrics = [frame.metrics for frame in self._of(set_name)]
            for metric in METRICS:
                values = _values(metrics, metric)
                row[f"{set_name}_{metric}"] = None if values is None else mean(values)
                row[f"{set_name}_{metric}_worst5"] = None if values is None else worst_mean(values)
            row[f"{set_name}_relmse"] = mean(frame.relmse for frame in self._of(set_name))
            row[f"{set_name}_tail"] = self._tails[set_name]
            row[f"{set_name}_non_finite"] = sum(frame.non_finite for frame in metrics)
        return row

    def result(self) -> dict[str, Any]:
        """This evaluation's part of result.json: plain JSON data.

        protocol: {name, identity}; reference_hash; metrics: {set: {metric: {mean, worst5, floor}
        or null}}; relmse: {set: mean}; tail: {set: as in `row`}; non_finite: {set: pixels}; frames:
        per frame its metrics, relMSE, and its reference's noise and samples per pixel;
        frame_seconds: by part, median over the frames; lpips_note.
        """
        row = self.row()
        return {
            "protocol": {"name": self.protocol.name, "identity": self.protocol.identity},
            "reference_hash": self.reference_hash,
            "metrics": {
                set_name: {metric: self._summary(set_name, metric) for metric in METRICS}
                for set_name in SETS
            },
            "relmse": {set_name: row[f"{set_name}_relmse"] for set_name in SETS},
            "tail": {set_name: row[f"{set_name}_tail"] for set_name in SETS},
            "non_finite": {set_name: row[f"{set_name}_non_finite"] for set_name in SETS},
            "frames": [
                {
                    **asdict(frame.metrics),
                    "relmse": frame.relmse,
                    "reference_noise": frame.reference.noise,
                    "reference_samples_per_pixel": frame.reference.samples_per_pixel,
                }
                for frame in self.frames
            ],
            "frame_seconds": {
                part: median(frame.seconds[part] for frame in self.frames)
                for part in self.frames[0].seconds
            },
            "lpips_note": self.lpips_note,
        }

    @cached_property
    def _tails(self) -> dict[str, float]:
        """By set, for `row` and `result`: it sorts every pixel."""
        errors = {name: torch.cat([f.log_errors for f in self._of(name)]) for name in SETS}
        return {name: worst(of_set).mean().item() for name, of_set in errors.items()}

    def _of(self, set_name: str) -> list[EvaluatedFrame]:
        return [frame for frame in self.frames if frame.frame.set == set_name]

    def _summary(self, set_name: str, metric: str) -> dict[str, float] | None:
        frames = self._of(set_name)
        values = _values([frame.metrics for frame in frames], metric)
        floors = _values([frame.floor for frame in frames], metric)
        if values is None or floors is None:
            return None
        return {"mean": mean(values), "worst5": worst_mean(values), "floor": mean(floors)}

    def write(self, folder: Path, *, linear_megabytes: float) -> str | None:
        """Writes `folder`/pictures, and into `folder`/linear what `write_linear` writes.

        Returns what that does: the format of the linear pictures, for result.json. Raises OSError
        with what to do where the disk is full.
        """
        with full_disk_named(folder / "pictures"):
            self.write_pictures(folder / "pictures")
        linear = {
            (each.frame.set, each.frame.index): (each.prediction, each.reference.radiance)
            for each in self.frames
        }
        return write_linear(folder / "linear", linear, megabytes=linear_megabytes)

    def comparison(self, set_name: str) -> Comparison:
        """The frames of a set, as they are shown elsewhere than in the run's folder."""
        rows, error_maps = [], {}
        for frame in self._of(set_name):
            name = f"{set_name} {frame.frame.index}"
            shown = frame.panels(self.protocol)
            error_maps[name] = shown.error
            rows.append(shown.triptych(mape=frame.metrics.mape, name=name))
        return Comparison(stacked(rows), error_maps)

    def write_pictures(self, folder: Path) -> None:
        """Writes every frame's prediction, reference, error map and labelled triptych as PNG."""
        for each in self.frames:
            each.panels(self.protocol).write(
                folder,
                f"{each.frame.set}_{each.frame.index:02d}",
                epsilon=self.protocol.epsilon,
                mape=each.metrics.mape,
            )


def _values(frames: Iterable[FrameMetrics], metric: str) -> list[float] | None:
    values = [getattr(frame, metric) for frame in frames]
    return None if None in values else values
