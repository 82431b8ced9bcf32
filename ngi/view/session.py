"""What one browser wants to see, which picture of it is computed next, and how fine it is."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from ngi.view.scene_view import Place, SceneView
from ngi.view.screen import Screen

SETTLED = 0.25
"""Seconds without a change after which the full resolution is worth its time."""
MOST_SAMPLES = 4096
"""Samples per pixel after which a path-traced picture is left as it is."""


@dataclass(frozen=True)
class Wish:
    """A configuration, and what to show of it."""

    place: Place
    screen: Screen


@dataclass(frozen=True)
class Job:
    """A picture to make. more_paths: after another pass of the path tracer."""

    wish: Wish
    more_paths: bool = False


class Session:
    """Keeps the newest wish only, so that no backlog of pictures can grow.

    preview: what of a place is shown while something moves; the place itself where it is quick
    """

    def __init__(self, wish: Wish, preview: Callable[[Place], Place]) -> None:
        self._wish = wish
        self._preview = preview
        self._changed = -SETTLED
        self._shown: Wish | None = None
        self._previewed: Wish | None = None

    @property
    def wish(self) -> Wish:
        return self._wish

    def change(self, wish: Wish, *, now: float) -> None:
        """now: seconds of any clock that does not go back."""
        if wish != self._wish:
            self._wish = wish
            self._changed = now

    def again(self) -> None:
        """What is shown is out of date: the network has changed, or the browser was lost."""
        self._shown = self._previewed = None

    def next_job(self, *, now: float, samples: int) -> Job | None:
        """The picture that is wanted most; None where all is shown.

        samples: per pixel that the wish's path-traced picture has.
        """
        if self._shown == self._wish:
            more = self._wish.screen.traces_paths and samples < MOST_SAMPLES
            return Job(self._wish, more_paths=True) if more else None
        if now - self._changed >= SETTLED:
            return Job(self._wish)
        if self._previewed == self._wish:
            return None
        return Job(replace(self._wish, place=self._preview(self._wish.place)))

    def seconds_until_settled(self, *, now: float) -> float:
        """After which `next_job` asks for the full resolution."""
        return max(0.0, self._changed + SETTLED - now)

    def done(self, job: Job) -> None:
        """A job's picture is on its way to the browser."""
        self._shown = job.wish
        self._previewed = self._wish


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
