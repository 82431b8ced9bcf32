"""What one browser wants to see, and which picture of it has to be computed next."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ngi.view.scene_view import Place
from ngi.view.screen import Screen

SETTLED = 0.25
"""Seconds without a change after which the full resolution is worth its time."""
PREVIEW = 4
"""Factor by which the resolution is lower while something moves."""
SMALLEST = 64
"""Pixels a side below which a preview would tell nothing."""
MOST_SAMPLES = 4096
"""Samples per pixel after which a path-traced picture is left as it is."""


@dataclass(frozen=True)
class Wish:
    """A configuration, and what to show of it."""

    place: Place
    screen: Screen

    @property
    def preview(self) -> Wish:
        """The same at the resolution of a moving picture."""
        pixels = max(self.place.resolution // PREVIEW, min(SMALLEST, self.place.resolution))
        return replace(self, place=replace(self.place, resolution=pixels))


@dataclass(frozen=True)
class Job:
    """A picture to make. more_paths: after another pass of the path tracer."""

    wish: Wish
    more_paths: bool = False


class Session:
    """Keeps the newest wish only, so that no backlog of pictures can grow."""

    def __init__(self, wish: Wish) -> None:
        self._wish = wish
        self._changed = -SETTLED
        self._shown: Wish | None = None

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
        self._shown = None

    def next_job(self, *, now: float, samples: int) -> Job | None:
        """The picture that is wanted most; None where all is shown.

        samples: per pixel that the wish's path-traced picture has.
        """
        if self._shown == self._wish:
            more = self._wish.screen.traces_paths and samples < MOST_SAMPLES
            return Job(self._wish, more_paths=True) if more else None
        if now - self._changed >= SETTLED:
            return Job(self._wish)
        return None if self._shown == self._wish.preview else Job(self._wish.preview)

    def seconds_until_settled(self, *, now: float) -> float:
        """After which `next_job` asks for the full resolution."""
        return max(0.0, self._changed + SETTLED - now)

    def done(self, job: Job) -> None:
        """A job's picture is on its way to the browser."""
        self._shown = job.wish
