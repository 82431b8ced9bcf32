"""A path through a scene as trained networks show it, as a video: `ngi video --help`."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass
from os.path import relpath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ngi.config.options import check_output, option, run_tool

if TYPE_CHECKING:
    from ngi.view.film import Film, Measured
    from ngi.view.path_traced_run import PathTracedRun
    from ngi.view.trained_run import TrainedRun


@dataclass
class VideoOptions:
    """Films a path through a scene with a trained network, and measures temporal stability.

    ngi video run=outputs/demo/sphere-caustic/method=uniform/seed=0 reference=64
    ngi video run=FOLDER beside=OTHER path=hard_frames seconds=20
    ngi video run=FOLDER path=static hard_frame=3 reference=64
    ngi video run=FOLDER out=film.webp seconds=4 frames_per_second=12   # for a README

    A JSON file of the same name, next to the film, holds the measurements: along a moving path, the
    error of the changes from frame to frame (needs a reference); for a static v, flicker.
    `ngi report` tabulates every video*.json below its folder. A video with other options does not
    overwrite these measurements: give it another name with out=FILE.
    """

    run: str = option("a run's folder, finished or not; a path tracing run must be finished")
    out: str | None = option(
        "file to write, .mp4 or .webp; null: video_PATH.mp4 in the run's folder (with _3 for "
        "path=static hard_frame=3, and _supersampled for supersampled_edges=true)",
        None,
    )
    path: str = option(
        "through v: camera (the scene's own), hard_frames, static, or a JSON file with a list of v",
        "camera",
    )
    hard_frame: int = option("for path=static: index of the hard frame", 0)
    beside: list[str] | None = option(
        "folder of another run of the scene to show too; may be repeated", None
    )
    reference: int = option(
        "samples per pixel (even) of path-traced frames to compare with; 0: none", 0
    )
    seconds: float = option("length of the video", 8.0)
    frames_per_second: int = option("of the video", 24)
    resolution: int = option("pixels a side", 256)
    exposure: float = option("stops", 0.0)
    supersampled_edges: bool = option(
        "evaluate networks four times per pixel at edges: less error, slower", False
    )
    scene: str | None = option("folder of the scene, if it is one of the paper's authors", None)


def write_video(options: VideoOptions) -> None:
    """Writes the video and the JSON file.

    Raises ValueError, OSError or RuntimeError, naming key and value, before anything is rendered.
    """
    from ngi.view.mp4 import mp4_file, pyav
    from ngi.view.webp import webp_file

    out = _out(options)
    _check(options, figures=out.with_suffix(".json"))
    if out.suffix == ".mp4":
        pyav()
    file_of = mp4_file if out.suffix == ".mp4" else webp_file
    with ExitStack() as stack:
        film = _film(options, stack)
        with file_of(out, frames_per_second=options.frames_per_second) as add_frame:
            measured = film.shoot(add_frame)
    _write_json(out.with_suffix(".json"), options, film, measured)
    steps = ", ".join(f"step {run.step}" for run in film.runs)
    print(f"{out}: {len(film.path)} frames; {steps}")
    print(_table(film, measured))


def _out(options: VideoOptions) -> Path:
    if options.out is not None:
        return Path(options.out)
    frame = f"_{options.hard_frame}" if options.path == "static" and options.hard_frame else ""
    edges = "_supersampled" if options.supersampled_edges else ""
    return Path(options.run) / f"video_{Path(options.path).stem}{frame}{edges}.mp4"


def _check(options: VideoOptions, *, figures: Path) -> None:
    """figures: the JSON file that is to be written"""
    if options.out is not None:
        check_output(Path(options.out), ".mp4", ".webp")
    if figures.exists():
        _check_replaced(options, figures)
    if not options.resolution >= 1 or not options.frames_per_second >= 1:
        raise ValueError("resolution and frames_per_second have to be at least 1")
    if options.reference < 0 or options.reference % 2:
        raise ValueError(f"reference: {options.reference}; it has to be an even number, or 0")
    if not 2 <= options.seconds * options.frames_per_second < float("inf"):
        raise ValueError(f"seconds: {options.seconds}; a video needs at least two frames")


def _check_replaced(options: VideoOptions, figures: Path) -> None:
    """ValueError where `figures` is no video's, or holds what one of other options measured."""
    try:
        film = json.loads(figures.read_text())
        before, measured = _decisive(film["options"], _folders(film, figures)), film["measured"]
        _ = film["measure"]
    except (ValueError, KeyError, TypeError, AttributeError):
        raise ValueError(
            f"out: {figures}, the file for the measurements, exists but is not a video's; "
            "choose another name"
        ) from None
    now = _decisive(asdict(options), map(Path, (options.run, *(options.beside or ()))))
    now["key_frames"] = _content(options.path)
    before["key_frames"] = film.get("key_frames", now["key_frames"])
    apart = [key for key in now if before[key] != now[key]]
    if measured and apart:
        was, would_be = (", ".join(f"{key}={of[key]}" for key in apart) for of in (before, now))
        raise ValueError(
            f"out: {figures} holds measurements with {was}; a video with {would_be} would replace "
            "them; give this video another name with out=…, or delete that file"
        )


def _content(path: str) -> str:
    """Of a file with key frames, 16 hexadecimal digits; empty for a path by its name."""
    file = Path(path)
    return hashlib.sha256(file.read_bytes()).hexdigest()[:16] if file.is_file() else ""


def _folders(film: dict[str, Any], figures: Path) -> list[Path]:
    """Of the film's runs."""
    return [figures.parent / run["folder"] for run in film["runs"]]


def _decisive(options: dict[str, Any], folders: Iterable[Path]) -> dict[str, Any]:
    """The options by which videos of one name may differ; what an older file lacks has its default.

    folders: of `run` and `beside`, which options name as seen from wherever the command was given.
        `scene` is named so too, and a run is shown in no other than its own.
    """
    run, *beside = (str(folder.resolve()) for folder in folders)
    known = asdict(VideoOptions(run=run))
    found = {key: options.get(key, default) for key, default in known.items()}
    del found["out"], found["scene"]
    return {**found, "run": run, "beside": beside}


def _film(options: VideoOptions, stack: ExitStack) -> Film:
    """stack: closes the renderers."""
    from ngi.view.film import Film
    from ngi.view.path_traced_run import open_run
    from ngi.view.scene_vectors import along, key_frames

    runs: list[TrainedRun | PathTracedRun] = []
    for folder in map(Path, (options.run, *(options.beside or ()))):
        if folder.resolve() in (run.folder.resolve() for run in runs):
            raise ValueError(f"beside: {folder} is given twice")
        run = open_run(
            folder, scene_path=options.scene, supersampled_edges=options.supersampled_edges
        )
        stack.enter_context(closing(run.renderer))
        first = (runs or [run])[0]
        if (run.renderer.scene_hash, run.renderer.dimensions) != (
            first.renderer.scene_hash,
            first.renderer.dimensions,
        ):
            raise ValueError(
                f"beside: {folder} was trained on another scene ('{run.scene_name}') than "
                f"{options.run} ('{first.scene_name}'), or on another version of it"
            )
        runs.append(run)
    keys = key_frames(options.path, runs[0], still=options.hard_frame)
    return Film(
        runs=runs,
        labels=_labels(runs),
        path=along(keys, round(options.seconds * options.frames_per_second)),
        resolution=options.resolution,
        samples=options.reference,
        exposure=options.exposure,
    )


def _labels(runs: Sequence[TrainedRun | PathTracedRun]) -> list[str]:
    """What tells the folders' names apart: 'uniform' of outputs/demo/…/method=uniform/seed=0."""
    from ngi.view.path_traced_run import PathTracedRun

    if len(runs) == 1:
        return ["path tracing" if isinstance(runs[0], PathTracedRun) else "network"]
    names = [run.folder.resolve().parts for run in runs]
    return [
        "/".join(
            part.removeprefix("method=")
            for level, part in enumerate(name)
            if any(other[level : level + 1] != (part,) for other in names)
        )
        or name[-1]
        for name in names
    ]


def _write_json(file: Path, options: VideoOptions, film: Film, measured: Measured) -> None:
    from ngi.files.durable import write_atomically
    from ngi.machine.provenance import provenance

    first = film.runs[0]
    content = {
        **provenance(backend=first.renderer.description),
        "options": asdict(options),
        "key_frames": _content(options.path),
        "scene": first.scene_name,
        "scene_hash": first.renderer.scene_hash,
        "runs": [
            {"folder": relpath(run.folder, file.parent), "label": label, "step": run.step}
            for run, label in zip(film.runs, film.labels, strict=True)
        ],
        "protocol": asdict(first.protocol),
        "frames": len(film.path),
        "measure": "flicker" if film.stands_still else "temporal_error",
        "definitions": "ngi/evaluate/temporal.py",
        "measured": measured,
    }
    write_atomically(file, json.dumps(content, indent=2).encode())


def _table(film: Film, measured: Measured) -> str:
    from tabulate import tabulate

    if not measured:
        return "the temporal error needs a reference: reference=64, for example"
    rows = [
        (label, *(f"{value:.3g}" for value in values.values()))
        for label, values in measured.items()
    ]
    what = "flicker" if film.stands_still else "temporal error"
    names = (name.replace("_", " ") for name in next(iter(measured.values())))
    table: str = tabulate(rows, (what, *names), tablefmt="github", disable_numparse=True)
    return table


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `ngi video`."""
    return run_tool(write_video, VideoOptions, "ngi video", arguments)
