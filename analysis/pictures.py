"""Pictures side by side: the reference, then each method's prediction and its error map."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from analysis.files import write
from analysis.methods import methods_in_order, title
from analysis.runs import Run

PANEL = 256
"""Pixels that smaller pictures are enlarged to, by a whole factor."""

MOST_DIFFERENT = 3
"""Frames in a scene's overview."""

_MARGIN = 12
_LINE = 20
_BAR = (200, 12)


@dataclass(frozen=True)
class FrameOfMethods:
    """One hard frame, and per method the run that predicted it."""

    index: int
    runs: Mapping[str, Run]

    def mape(self, method: str) -> float:
        return _frame_mapes(self.runs[method])[self.index]

    @property
    def spread(self) -> float:
        """How much the methods differ: largest finite MAPE minus smallest; 0 without any."""
        values = [value for value in map(self.mape, self.runs) if math.isfinite(value)]
        return max(values) - min(values) if values else 0.0


@dataclass(frozen=True)
class ErrorScale:
    """What an error map's colours mean.

    bar: RGB, its colours from no error on the left to `maximum` on the right; text: what is shown
    """

    bar: Image.Image
    maximum: str
    text: str


def frames_of_scene(runs: Sequence[Run]) -> list[FrameOfMethods]:
    """The hard frames that all methods of one scene have, those that differ most first.

    Every method is represented by its lowest seed.
    """
    chosen = {
        method: min((run for run in runs if run.method == method), key=lambda run: run.seed)
        for method in methods_in_order(runs)
    }
    indices = sorted(set.intersection(*(set(_frame_mapes(run)) for run in chosen.values())))
    frames = [FrameOfMethods(index, chosen) for index in indices]
    return sorted(frames, key=lambda frame: -frame.spread)


def write_comparisons(runs: Sequence[Run], folder: Path) -> tuple[list[Path], list[str]]:
    """Writes comparison sheets of the hard frames of one scene.

    `<scene>.png` has the frames in which the methods' MAPEs differ most, and
    `<scene>/hard_<index>.png` are all of them; every method shows its lowest seed. Returns what
    was written, overview and folder, and a warning where pictures are missing.
    """
    scene, frames = runs[0].scene, frames_of_scene(runs)
    overview, every = folder / f"{scene}.png", folder / scene
    try:
        every.mkdir(parents=True, exist_ok=True)
        for frame in frames:
            write(every / f"hard_{frame.index:02d}.png", _sheet([frame]))
        write(overview, _sheet(frames[:MOST_DIFFERENT]))
    except OSError as error:
        return [], [f"no comparison pictures of {scene}: {error}"]
    return [overview, every], []


def picture(run: Run, index: int, kind: str) -> Image.Image:
    """A hard frame's 'reference', 'prediction' or 'error' as sRGB; OSError where it is missing."""
    with Image.open(_file(run, index, kind)) as file:
        return file.convert("RGB")


def error_scale(run: Run, index: int) -> ErrorScale:
    """The scale that an error map's file says it has; OSError where it says none."""
    path = _file(run, index, "error")
    with Image.open(path) as file:
        said = dict(file.info)
    try:
        text, name, maximum = said["scale"], said["colour_map"], said["maximum"]
    except KeyError as error:
        raise OSError(f"{path}: its metadata lacks {error}; restore a copy") from error
    width, height = _BAR
    levels = np.tile(np.linspace(0, 1, width), (height, 1))
    colours = np.ascontiguousarray(matplotlib.colormaps[name](levels, bytes=True)[..., :3])
    return ErrorScale(Image.fromarray(colours), maximum, text)


def _frame_mapes(run: Run) -> dict[int, float]:
    frames = run.result["frames"]
    return {frame["index"]: frame["mape"] for frame in frames if frame["set"] == "hard"}


def _sheet(frames: Sequence[FrameOfMethods]) -> bytes:
    """PNG: a row per frame, and below them what the error maps' colours mean."""
    rows = [_row(frame) for frame in frames]
    legend_top = sum(row.height for row in rows) + _MARGIN
    sheet = Image.new(
        "RGB", (max(row.width for row in rows), legend_top + _LINE + _MARGIN), "white"
    )
    top = 0
    for row in rows:
        sheet.paste(row, (0, top))
        top += row.height
    first = frames[0]
    scale = error_scale(next(iter(first.runs.values())), first.index)
    _draw_error_scale(sheet, scale, legend_top)
    stream = BytesIO()
    sheet.save(stream, "PNG")
    return stream.getvalue()


def _row(frame: FrameOfMethods) -> Image.Image:
    panels: list[tuple[str, Image.Image]] = []
    for method, run in frame.runs.items():
        if not panels:
            label = f"reference, hard frame {frame.index}"
            panels.append((label, _enlarged(run, frame.index, "reference")))
        prediction = _enlarged(run, frame.index, "prediction")
        panels.append((f"{title(method)} (seed {run.seed})", prediction))
        error = _enlarged(run, frame.index, "error")
        panels.append((f"its error, MAPE {frame.mape(method):.3f}", error))
    width, height = panels[0][1].size
    labels = [_lines(label, width) for label, _ in panels]
    top = _MARGIN + _LINE * max(len(lines) for lines in labels)
    row = Image.new("RGB", (_MARGIN + (width + _MARGIN) * len(panels), top + height), "white")
    draw = ImageDraw.Draw(row)
    for column, (lines, (_, image)) in enumerate(zip(labels, panels, strict=True)):
        left = _MARGIN + column * (width + _MARGIN)
        for number, line in enumerate(lines):
            draw.text((left, _MARGIN + _LINE * number), line, fill="black", font=_font(14))
        row.paste(image, (left, top))
    return row


def _lines(label: str, width: int) -> list[str]:
    """The label in lines no wider than its picture, but for single words that are."""
    first, *words = label.split()
    lines = [first]
    for word in words:
        longer = f"{lines[-1]} {word}"
        if _font(14).getlength(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


def _enlarged(run: Run, index: int, kind: str) -> Image.Image:
    image = picture(run, index, kind)
    factor = max(1, PANEL // image.height)
    return image.resize((image.width * factor, image.height * factor), Image.Resampling.NEAREST)


def _draw_error_scale(sheet: Image.Image, scale: ErrorScale, top: int) -> None:
    """A colour bar and what it stands for."""
    draw, font, middle = ImageDraw.Draw(sheet), _font(13), top + scale.bar.height // 2
    draw.text((_MARGIN, middle), "0", fill="black", font=font, anchor="lm")
    sheet.paste(scale.bar, (_MARGIN + 14, top))
    text = f"≥ {scale.maximum}     error: {scale.text}"
    left = _MARGIN + 20 + scale.bar.width
    draw.text((left, middle), text, fill="black", font=font, anchor="lm")


def _file(run: Run, index: int, kind: str) -> Path:
    return run.folder / "pictures" / f"hard_{index:02d}_{kind}.png"


def _font(size: int) -> ImageFont.FreeTypeFont:
    file = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
    return ImageFont.truetype(str(file), size)
