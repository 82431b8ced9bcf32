"""What one browser wants to see, which picture of it is computed next, and how fine it is."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

from ngi.view.scene_view import Place, SceneView
from ngi.view.screen import Screen

SETTLED = 0.25
"""Seconds without a change after which the full resolution or more paths are worth their time."""
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
        self._failed: Wish | None = None

    @property
    def wish(self) -> Wish:
        return self._wish

    def change(self, wish: Wish, *, now: float) -> None:
        """now: seconds of any clock that does not go back."""
        if wish != self._wish:
            self._wish = wish
            self._changed = now
            self._failed = None

    def again(self) -> None:
        """What is shown is out of date: the network has changed, or the browser was lost."""
        self._shown = self._previewed = self._failed = None

    def next_job(self, *, now: float, samples: int, computed: bool) -> Job | None:
        """The picture that is wanted most; None where all is shown, or the last one failed.

        samples: per pixel that the wish's path-traced picture has.
        computed: whether all is there that the wish's picture is made from.
        """
        if self._failed == self._wish:
            return None
        settled = now - self._changed >= SETTLED
        if self._shown == self._wish:
            more = settled and self._wish.screen.traces_paths and samples < MOST_SAMPLES
            return Job(self._wish, more_paths=True) if more else None
        if settled or computed:
            return Job(self._wish)
        if self._previewed == self._wish:
            return None
        return Job(replace(self._wish, place=self._preview(self._wish.place)))

    def seconds_until_settled(self, *, now: float) -> float:
        """After which `next_job` asks for the full resolution, or for more paths."""
        return max(0.0, self._changed + SETTLED - now)

    def done(self, job: Job) -> None:
        """A job's picture is on its way to the browser."""
        self._shown = job.wish
        self._previewed = self._wish

    def failed(self) -> None:
        """The last job cannot be done: it is not tried again before something is changed."""
        self._failed = self._previewed


MOVING = 0.095
"""Seconds that a picture may take while something moves; sending it takes some more."""
FEWEST_RAYS = 3
"""Per pixel of the buffers: with two, shadows of large lights jump as they settle."""
DIVISORS = (1, 2, 4)
"""By what the resolution is divided."""
SMALLEST = 64
"""Pixels a side below which a preview would tell nothing."""


class Pace:
    """Chooses the finest preview that is quick enough, by how long the last pictures took.

    rays: per pixel of the buffers of a whole picture
    """

    def __init__(self, rays: int) -> None:
        self._rays = rays
        # Of whole pictures and of previews, by part and its units, oldest first.
        self._seconds: dict[bool, dict[str, dict[int, float]]] = {}

    def measured(self, view: SceneView) -> None:
        """A picture was made; of its parts the seconds are known."""
        preview = view.place.rays is not None
        before, now = self._seconds.get(preview, {}), {}
        for part, seconds in view.seconds.items():
            units = self._units(part, view.place)
            known = [item for item in before.get(part, {}).items() if item[0] != units]
            now[part] = dict([*known[-1:], (units, seconds)])
        self._seconds[preview] = now

    def preview(self, place: Place) -> Place:
        """The finest that takes at most `MOVING` by what the last ones took; else the coarsest."""
        *finer, coarsest = self._ladder(place)
        if not self._seconds:
            return coarsest
        return next((each for each in finer if self._expected(each) <= MOVING), coarsest)

    def _ladder(self, whole: Place) -> Iterator[Place]:
        """From the whole picture down: without its edges, then fewer rays, then fewer pixels."""
        yield whole
        halved = (self._rays >> times for times in range(self._rays.bit_length()))
        fewer: list[int | None] = [rays for rays in halved if rays > FEWEST_RAYS]
        if self._rays > FEWEST_RAYS:
            fewer.append(FEWEST_RAYS)
        for divisor in DIVISORS:
            pixels = max(whole.resolution // divisor, min(SMALLEST, whole.resolution))
            for rays in fewer or [whole.rays]:
                yield replace(whole, resolution=pixels, rays=rays)

    def _expected(self, place: Place) -> float:
        """Seconds: see `_at`."""
        preview = place.rays is not None
        parts = self._seconds.get(preview) or self._seconds[not preview]
        return sum(_at(self._units(part, place), known) for part, known in parts.items())

    def _units(self, part: str, place: Place) -> int:
        """Rays of the buffers, pixels of all else."""
        rays = (place.rays or self._rays) if part == "buffers" else 1
        return rays * place.resolution**2


def _at(units: int, known: Mapping[int, float]) -> float:
    """Seconds of a part of this size, from those of the one or two sizes that are known.

    There is a fixed time, and one per unit; while a single size is known, the latter only, so that
    larger pictures are expected to take longer than they do rather than shorter.
    """
    *older, (size, seconds) = known.items()
    per_unit = seconds / size
    for other, then in older:
        per_unit = min(max((seconds - then) / (size - other), 0.0), per_unit)
    return seconds + per_unit * (units - size)
