"""Pictures of test frames for the page: the reference, each method's prediction and error map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.methods import title
from analysis.page.images import Illustration, from_picture
from analysis.pictures import FrameOfMethods, error_scale, frames_of_scene, picture
from analysis.runs import Run
from analysis.tables import format_number


@dataclass(frozen=True)
class MethodPictures:
    method: str
    seed: int
    mape: str
    prediction: Illustration
    error: Illustration


@dataclass(frozen=True)
class FramePictures:
    """A hard frame: the reference, the error maps' colours, and what each method made of it."""

    scene: str
    index: int
    reference: Illustration
    scale: Illustration
    scale_maximum: str
    scale_text: str
    methods: list[MethodPictures]


def frames_of(runs: Sequence[Run], count: int) -> list[FramePictures]:
    """The frames that differ most; none where a file is missing, which the report warns of."""
    try:
        return [_frame(runs[0].scene, frame) for frame in frames_of_scene(runs)[:count]]
    except OSError:
        return []


def _frame(scene: str, frame: FrameOfMethods) -> FramePictures:
    first = next(iter(frame.runs.values()))
    scale = error_scale(first, frame.index)
    where = f"hard frame {frame.index} of {scene}"
    methods = [
        MethodPictures(
            method=title(method),
            seed=run.seed,
            mape=format_number(frame.mape(method)),
            prediction=from_picture(
                picture(run, frame.index, "prediction"), f"prediction of {title(method)}, {where}"
            ),
            error=from_picture(
                picture(run, frame.index, "error"), f"error map of {title(method)}, {where}"
            ),
        )
        for method, run in frame.runs.items()
    ]
    return FramePictures(
        scene=scene,
        index=frame.index,
        reference=from_picture(picture(first, frame.index, "reference"), f"reference, {where}"),
        scale=from_picture(scale.bar, f"colours of the error maps, from 0 to {scale.maximum}"),
        scale_maximum=scale.maximum,
        scale_text=scale.text,
        methods=methods,
    )
