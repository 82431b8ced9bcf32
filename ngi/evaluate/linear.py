"""Predictions and references as they were measured, kept as EXR files of linear radiance."""

import logging
import shutil
from collections.abc import Mapping
from pathlib import Path

from torch import Tensor

from ngi.files.durable import DamagedError

log = logging.getLogger(__name__)

FORMATS = {"float": 4, "half": 2}
"""Bytes of a number by what result.json calls the format; the better one first."""


Pictures = Mapping[tuple[str, int], tuple[Tensor, Tensor]]
"""Set and index of a test frame -> prediction and reference, [H, W, 3] linear radiance each."""


def write_linear(folder: Path, pictures: Pictures, *, megabytes: float) -> str | None:
    """Writes `{set}_{index}_prediction.exr` and `…_reference.exr` of every test frame.

    megabytes: that all of them may have together, before EXR compresses them. Where 32-bit floats
        are more, 16-bit ones are written; where these are more too, nothing is.

    Returns 'float', 'half', or None where nothing is kept. What was in the folder before goes.
    Raises OSError with what to do where the disk is full.
    """
    shutil.rmtree(folder, ignore_errors=True)
    if megabytes <= 0:
        return None
    numbers = sum(image.numel() for pair in pictures.values() for image in pair)
    kept = next((name for name, size in FORMATS.items() if numbers * size <= 1e6 * megabytes), None)
    if kept is None:
        log.warning(
            "%s: linear pictures would take %.0f MB as half floats, more than run.linear_megabytes="
            "%g: none are kept, so `ngi metrics` cannot check this run later",
            folder.parent,
            1e-6 * numbers * FORMATS["half"],
            megabytes,
        )
        return None
    from ngi.render.exr import write_exr  # Mitsuba, which closed formulas do without

    folder.mkdir(parents=True, exist_ok=True)  # a viewer on NFS may hold old ones
    for (set_name, index), (prediction, reference) in pictures.items():
        for kind, image in (("prediction", prediction), ("reference", reference)):
            write_exr(_file(folder, set_name, index, kind), image, half=kept == "half")
    return kept


def read_linear(folder: Path, set_name: str, index: int) -> tuple[Tensor, Tensor]:
    """Prediction and reference of a frame, [H, W, 3] float32 each.

    Raises DamagedError, naming the file, for one that is missing, damaged, or of another size than
    its partner.
    """
    from ngi.render.exr import read_exr

    files = [_file(folder, set_name, index, kind) for kind in ("prediction", "reference")]
    prediction, reference = map(read_exr, files)
    if prediction.shape != reference.shape:
        sizes = " and ".join(f"{x.shape[1]} x {x.shape[0]}" for x in (prediction, reference))
        raise DamagedError(f"{files[0]} and its reference have different sizes, {sizes} pixels")
    return prediction, reference


def _file(folder: Path, set_name: str, index: int, kind: str) -> Path:
    return folder / f"{set_name}_{index:02d}_{kind}.exr"
