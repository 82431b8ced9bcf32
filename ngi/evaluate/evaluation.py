"""What one evaluation found: per frame, averaged, for CSV rows, result files and pictures."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from typing import Any

from PIL import Image
from torch import Tensor

from ngi.evaluate.frames import Frame
from ngi.evaluate.linear import write_linear
from ngi.evaluate.pictures import Panels, stacked, write_pictures
from ngi.evaluate.protocol import METRICS, SETS, EvaluationProtocol
from ngi.evaluate.reference import Reference
from ngi.files.durable import full_disk_named

WORST_OF = 20
"""The worst 5 %, one frame of 20, are averaged on their own."""


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


@dataclass(frozen=True)
class Evaluation:
    """The metrics of every test frame under one protocol.

    frames: the test frames
    metrics: their metrics, in the same order
    floors: what a perfect prediction would score for the references' own noise, in the same order;
        of DSSIM and LPIPS a lower bound, see `Reference.radiance`
    predictions: [H, W, 3] linear radiance, in the same order
    references: the reference images, in the same order
    reference_hash: hash over all references
    seconds: of each frame, in the same order, by part: 'buffers', 'inputs' (whatever else the
        network is given of a frame, which may have to be path-traced) and 'network'
    lpips_note: why there is no LPIPS, or None
    """

    protocol: EvaluationProtocol
    frames: tuple[Frame, ...]
    metrics: tuple[FrameMetrics, ...]
    floors: tuple[FrameMetrics, ...]
    predictions: tuple[Tensor, ...]
    references: tuple[Reference, ...]
    reference_hash: str
    seconds: tuple[dict[str, float], ...]
    lpips_note: str | None

    def row(self) -> dict[str, float | int | None]:
        """One flat row for metrics.csv: `hard_mape`, `hard_mape_worst5`, …, `hard_non_finite`, ….

        The keys never depend on the values; LPIPS is None where it is not available.
        """
        row: dict[str, float | int | None] = {}
        for set_name in SETS:
            for metric in METRICS:
                values = _values(self.metrics, set_name, metric)
                row[f"{set_name}_{metric}"] = None if values is None else mean(values)
                row[f"{set_name}_{metric}_worst5"] = None if values is None else worst_mean(values)
            row[f"{set_name}_non_finite"] = sum(
                frame.non_finite for frame in self.metrics if frame.set == set_name
            )
        return row

    def result(self) -> dict[str, Any]:
        """This evaluation's part of result.json: plain JSON data.

        protocol: {name, identity}; reference_hash; metrics: {set: {metric: {mean, worst5, floor}
        or null}}; non_finite: {set: pixels}; frames: per frame its metrics and its reference's
        noise and samples per pixel; frame_seconds: by part, median over the frames; lpips_note.
        """
        return {
            "protocol": {"name": self.protocol.name, "identity": self.protocol.identity},
            "reference_hash": self.reference_hash,
            "metrics": {
                set_name: {metric: self._summary(set_name, metric) for metric in METRICS}
                for set_name in SETS
            },
            "non_finite": {set_name: self.row()[f"{set_name}_non_finite"] for set_name in SETS},
            "frames": [
                {
                    **asdict(frame),
                    "reference_noise": reference.noise,
                    "reference_samples_per_pixel": reference.samples_per_pixel,
                }
                for frame, reference in zip(self.metrics, self.references, strict=True)
            ],
            "frame_seconds": {
                part: median(of_frame[part] for of_frame in self.seconds)
                for part in self.seconds[0]
            },
            "lpips_note": self.lpips_note,
        }

    def _summary(self, set_name: str, metric: str) -> dict[str, float] | None:
        values = _values(self.metrics, set_name, metric)
        floors = _values(self.floors, set_name, metric)
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
            (frame.set, frame.index): (prediction, reference.radiance)
            for frame, prediction, reference in zip(
                self.frames, self.predictions, self.references, strict=True
            )
        }
        return write_linear(folder / "linear", linear, megabytes=linear_megabytes)

    def comparison(self, set_name: str) -> Comparison:
        """The frames of a set, as they are shown elsewhere than in the run's folder."""
        rows, error_maps = [], {}
        for frame, metrics, prediction, reference in zip(
            self.frames, self.metrics, self.predictions, self.references, strict=True
        ):
            if frame.set != set_name:
                continue
            name = f"{frame.set} {frame.index}"
            shown = Panels.of(
                prediction,
                reference.radiance,
                epsilon=self.protocol.epsilon,
                exposure=self.protocol.exposure,
            )
            error_maps[name] = shown.error
            rows.append(shown.triptych(mape=metrics.mape, name=name))
        return Comparison(stacked(rows), error_maps)

    def write_pictures(self, folder: Path) -> None:
        """Writes every frame's prediction, reference, error map and labelled triptych as PNG."""
        for frame, metrics, prediction, reference in zip(
            self.frames, self.metrics, self.predictions, self.references, strict=True
        ):
            write_pictures(
                folder,
                f"{frame.set}_{frame.index:02d}",
                prediction=prediction,
                reference=reference.radiance,
                epsilon=self.protocol.epsilon,
                exposure=self.protocol.exposure,
                mape=metrics.mape,
            )


def _values(frames: Iterable[FrameMetrics], set_name: str, metric: str) -> list[float] | None:
    values = [getattr(frame, metric) for frame in frames if frame.set == set_name]
    return None if None in values else values
