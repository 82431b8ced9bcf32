"""How fine a picture may be while something moves, so that it moves smoothly."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from ngi.view.scene_view import Place, SceneView

MOVING = 0.08
"""Seconds that a picture may take while something moves; sending it takes some more."""
FEWEST_RAYS = 4
"""Per pixel of the buffers: with fewer, shadows of large lights would jump as they settle."""
DIVISORS = (1, 2, 4)
"""By what the resolution is divided."""
SMALLEST = 64
"""Pixels a side below which a preview would tell nothing."""


class Pace:
    """Chooses the finest preview that is quick enough, by how long the last picture took.

    rays: per pixel of the buffers of a whole picture
    """

    def __init__(self, rays: int) -> None:
        self._rays = rays
        self._per_unit: dict[str, float] = {}

    def measured(self, view: SceneView) -> None:
        """A picture was made; of its parts the seconds are known."""
        self._per_unit = {
            part: seconds / self._units(part, view.place) for part, seconds in view.seconds.items()
        }

    def preview(self, place: Place) -> Place:
        """The finest that takes at most `MOVING`, by the last picture's speed; else the coarsest.

        What takes a fixed time makes finer ones look slower than they are, so that none is chosen
        that takes too long; the next choice then knows better.
        """
        *finer, coarsest = self._ladder(place)
        if not self._per_unit:
            return coarsest
        return next((each for each in finer if self._seconds(each) <= MOVING), coarsest)

    def _ladder(self, whole: Place) -> Iterator[Place]:
        """From the whole picture down: fewer rays first, then fewer pixels."""
        yield whole
        halved = (self._rays >> times for times in range(1, self._rays.bit_length()))
        fewer: Sequence[int | None] = [rays for rays in halved if rays >= FEWEST_RAYS]
        for divisor in DIVISORS:
            pixels = max(whole.resolution // divisor, min(SMALLEST, whole.resolution))
            for rays in fewer or [whole.rays]:
                yield replace(whole, resolution=pixels, rays=rays)

    def _seconds(self, place: Place) -> float:
        return sum(each * self._units(part, place) for part, each in self._per_unit.items())

    def _units(self, part: str, place: Place) -> int:
        """Rays of the buffers, pixels of all else."""
        rays = (place.rays or self._rays) if part == "buffers" else 1
        return rays * place.resolution**2
