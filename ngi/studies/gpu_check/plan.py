"""All that is found out, in order, at full size and at that of a dry run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path

from ngi.commands.doctor import CHECKS, examine, report
from ngi.studies.benchmark.inference import inference
from ngi.studies.benchmark.part import Options, Part
from ngi.studies.benchmark.parts import PARTS
from ngi.studies.benchmark.scenes import Scene, one_per_folder, shipped
from ngi.studies.gpu_check.graphs import LEARNERS, frames, steps
from ngi.studies.gpu_check.item import Item, Outcome
from ngi.studies.gpu_check.pixels import pixels
from ngi.studies.gpu_check.runs import METHODS, learning, training

MOST_SECONDS = 500.0
"""Of an item that can not go on where it was cut off: less than a window of ten minutes."""


@dataclass(frozen=True)
class Sizes:
    """How much is measured.

    methods: trained on both devices. scenes: compared pixel by pixel, None for all
    resolution, samples: of those images. parts: of the benchmark, None for all
    seconds, repeats, patches: of a part's timings
    training, training_methods: scenes, each trained by these methods
    training_overrides: of their runs, with {seconds} of the command line
    network: hidden features and layers of those whose frames are counted and recorded as graphs
    frame: pixels along a side of the image that is recorded
    """

    methods: tuple[str, ...] = tuple(METHODS)
    scenes: tuple[str, ...] | None = None
    resolution: int = 128
    samples: int = 64
    parts: tuple[str, ...] | None = None
    seconds: float = 60.0
    repeats: int = 20
    patches: int = 10_000
    training: tuple[str, ...] = ("living-room", "sphere-caustic")
    training_methods: tuple[str, ...] = (
        *("active_exploration", "uniform", "ours", "ours_small_patches"),
    )
    training_overrides: tuple[str, ...] = (
        *("budget=paper", "trainer=fast", "budget.seconds={seconds}"),
    )
    network: tuple[int, int] = (512, 8)
    frame: int = 900


DRY = Sizes(
    methods=("active_exploration",),
    scenes=("cornell-box",),
    resolution=16,
    samples=2,
    parts=("store",),
    seconds=1.0,
    repeats=1,
    patches=8,
    training=("cornell-box",),
    training_methods=("active_exploration",),
    training_overrides=("budget=smoke", "evaluation.count=1"),
    network=(16, 2),
    frame=16,
)
"""Everything once, without a GPU."""


def items(sizes: Sizes, folder: Path, *, training_seconds: float) -> list[Item]:
    """All items. folder: of runs that go on. training_seconds: run time of each scene."""
    return list(_items(sizes, folder, training_seconds))


def _items(sizes: Sizes, folder: Path, training_seconds: float) -> Iterator[Item]:
    yield _whole("doctor", "", doctor)
    for method in sizes.methods:
        measure = partial(learning, method, folder / "learning")
        yield Item("learning", method, measure, goes_on=True)
    for scene in shipped(one_per_folder() if sizes.scenes is None else sizes.scenes):
        of_pixels = partial(pixels, scene, resolution=sizes.resolution, samples=sizes.samples)
        yield _whole("pixels", scene.name, of_pixels)
    for part in PARTS:
        if sizes.parts is None or part.name in sizes.parts:
            yield from _benchmark(part, sizes)
    yield from _graphs(sizes)
    for name, method in product(sizes.training, sizes.training_methods):
        changed = (option.format(seconds=training_seconds) for option in sizes.training_overrides)
        chosen = (f"scene={name}", f"method={method}", *changed)
        overrides = (*chosen, f"run.references={folder / 'references'}")
        length = f"{training_seconds:g} s"
        train = partial(training, folder / "training" / name / method / length, overrides)
        yield Item("training", f"{name}, {method}, {length}", train, goes_on=True)
    for scene in shipped(sizes.training):
        yield _whole("frames", scene.name, partial(_frames, scene, sizes), MOST_SECONDS)


def _whole(stage: str, name: str, measure: Callable[[], Outcome], seconds: float = 120.0) -> Item:
    """What can not go on where it was cut off, and does not ask how much time is left."""
    return Item(stage, name, lambda _: measure(), seconds)


def _graphs(sizes: Sizes) -> Iterator[Item]:
    features, layers = sizes.network
    size = {"features": features, "layers": layers, "repeats": sizes.repeats}
    for name in LEARNERS:
        yield _whole("graphs", f"step, {name}", partial(steps, name, **size))
    yield _whole("graphs", "frame", partial(frames, resolution=sizes.frame, **size))


def _frames(scene: Scene, sizes: Sizes) -> Outcome:
    features, layers = sizes.network
    found = inference(
        scene, repeats=sizes.repeats, seconds=sizes.seconds, features=features, layers=layers
    )
    return Outcome([replace(figure, scene=scene.name) for figure in found])


def doctor() -> Outcome:
    """What the machine has, and how to get what is missing."""
    return Outcome(notes=report([examine(check) for check in CHECKS]).splitlines())


def _benchmark(part: Part, sizes: Sizes) -> Iterator[Item]:
    """One item per scene of a part, so that none is long."""
    named = one_per_folder() if part.scenes is None else part.scenes
    if sizes.scenes is not None and named:
        named = sizes.scenes
    for names in ([name] for name in named) if named else [[]]:
        options = Options(
            scenes=shipped(names),
            samples_per_pixel=None,
            repeats=sizes.repeats,
            seconds=sizes.seconds,
            patches=sizes.patches,
        )
        measure = partial(_of_part, part, options)
        yield _whole("benchmark", "/".join([part.name, *names]), measure, MOST_SECONDS)


def _of_part(part: Part, options: Options) -> Outcome:
    return Outcome([*part.figures(options)])
