"""What one browser wants to see, and which picture of it has to be computed next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from ngi.view.scene_view import Place
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
