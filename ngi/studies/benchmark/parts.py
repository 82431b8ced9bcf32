"""The parts of the benchmark, in the order in which they are measured.

They are listed without PyTorch and Mitsuba, so that help is there at once.
"""

from __future__ import annotations

from collections.abc import Iterable

from ngi.studies.benchmark.figures import Figure
from ngi.studies.benchmark.part import Measure, Options, Part


def _imported_when_measured(name: str) -> Measure:
    def measure(options: Options) -> Iterable[Figure]:
        from ngi.studies.benchmark.measures import MEASURES

        return MEASURES[name](options)

    return measure


def _part(name: str, text: str, scenes: tuple[str, ...] | None = ()) -> Part:
    return Part(name, text, _imported_when_measured(name), scenes)


PARTS = (
    _part(
        "overhead",
        "a batch of new patches against one launch of equally many paths; its steps",
        scenes=None,
    ),
    _part(
        "compilations",
        "seconds of the warm-up with and without cached kernels; kernels compiled after it",
        scenes=None,
    ),
    _part(
        "memory", "memory growth of a process that renders many patches", scenes=("cornell-box",)
    ),
    _part(
        "leaving-out",
        "patches with only the buffers a scene needs against patches with all",
        scenes=None,
    ),
    _part("training", "a training step against the machine's matrix rate; scoring"),
    _part(
        "scoring",
        "scoring a batch of proposals against rendering it, at the scene's training samples",
        scenes=("sphere-caustic",),
    ),
    _part("threads", "rendering and training in turn on the same cores"),
    _part("store", "memory, precision and speed of the store of patches"),
    _part(
        "workers", "patches per second of several processes that render", scenes=("sphere-caustic",)
    ),
    _part(
        "waiting",
        "how long training waits for patches, rendered in turn and by a worker ahead",
        scenes=("sphere-caustic",),
    ),
    _part(
        "inference",
        "frames per second of buffers and the paper's network; its share of the matrix rate",
        scenes=("sphere-caustic",),
    ),
    _part(
        "frames",
        "milliseconds of our frames by part, against path tracing with a denoiser",
        scenes=("sphere-caustic",),
    ),
    _part(
        "viewer",
        "pictures per second, and their resolution, that the viewer shows while a slider moves",
        scenes=("sphere-caustic",),
    ),
)
