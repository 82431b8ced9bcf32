"""What a part of the benchmark is, and what the command line asks of all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ngi.studies.benchmark.figures import Figure
from ngi.studies.benchmark.scenes import Scene

TRAINING = "training"
"""In place of a number of samples per pixel: that of the scene's training patches."""


@dataclass(frozen=True)
class Options:
    """What the command line asks for; a part has its own number where one is None.

    seconds: after which no further repeat of a scene's timings is begun.
    """

    scenes: Sequence[Scene]
    samples_per_pixel: int | str | None
    repeats: int
    seconds: float
    patches: int | None

    def samples(self, default: int | None) -> int | None:
        """Samples per pixel; None stands for the scene's own number."""
        if self.samples_per_pixel is None:
            return default
        return None if isinstance(self.samples_per_pixel, str) else self.samples_per_pixel

    def timings(self, samples: int | None) -> dict[str, Any]:
        """What timing a scene takes, with these samples per pixel by default."""
        return {
            "samples_per_pixel": self.samples(samples),
            "repeats": self.repeats,
            "seconds": self.seconds,
        }

    def rendering(self, samples: int, patches: int) -> dict[str, Any]:
        """What rendering many patches of a scene takes, with these numbers by default."""
        return {
            "samples_per_pixel": self.samples(samples),
            "patches": self.patches or patches,
        }


Measure = Callable[[Options], Iterable[Figure]]


@dataclass(frozen=True)
class Part:
    """scenes: those it renders by default, () for none at all, None for every one there is."""

    name: str
    help: str
    measure: Measure
    scenes: tuple[str, ...] | None = ()

    def figures(self, options: Options) -> Iterator[Figure]:
        """Everything that it measures, one after the other."""
        for figure in self.measure(options):
            yield replace(figure, part=figure.part or self.name)


def per_scene(measure: Callable[[Scene, Options], Iterable[Figure]]) -> Measure:
    """Measures one scene after the other."""

    def measure_all(options: Options) -> Iterator[Figure]:
        for scene in options.scenes:
            for figure in measure(scene, options):
                yield replace(figure, scene=scene.name)

    return measure_all
