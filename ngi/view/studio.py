"""Makes the pictures that all browsers ask for, one after the other, in the caller's thread."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from time import monotonic

from ngi.render import Renderer
from ngi.view.scene_view import Place, Predict, SceneView
from ngi.view.screen import Pixels
from ngi.view.session import Job, Pace, Session, Wish

KEPT = 8
"""Views of other places whose path-traced pictures are kept."""


@dataclass(frozen=True)
class Shown:
    """A picture for one browser. full: at the resolution asked for, not a preview."""

    pixels: Pixels
    view: SceneView
    wish: Wish
    full: bool


Show = Callable[[Shown], None]


@dataclass(frozen=True)
class _Turn:
    browser: Hashable
    session: Session
    show: Show
    job: Job


class Studio:
    """Renderer and network, which only one thread at a time may use, shared by all browsers.

    Browsers' threads call `open`, `change` and `close`; whoever owns renderer and network calls
    `work`, which makes one picture at a time, the browsers taking turns.
    """

    def __init__(self, *, renderer: Renderer, predict: Predict) -> None:
        self._renderer = renderer
        self._predict = predict
        self._pace = Pace(renderer.buffer_samples)
        self._sessions: OrderedDict[Hashable, tuple[Session, Show]] = OrderedDict()
        self._views: OrderedDict[Place, SceneView] = OrderedDict()
        self._changed = threading.Condition()

    def open(self, browser: Hashable, wish: Wish, show: Show) -> None:
        """show: gets every picture for this browser, in the thread that calls `work`."""
        with self._changed:
            self._sessions[browser] = (Session(wish, self._pace.preview), show)
            self._changed.notify()

    def change(self, browser: Hashable, wish: Wish) -> None:
        """Wants something else from now on; of a browser that is gone nothing."""
        with self._changed:
            if browser in self._sessions:
                self._sessions[browser][0].change(wish, now=monotonic())
                self._changed.notify()

    def close(self, browser: Hashable) -> None:
        with self._changed:
            self._sessions.pop(browser, None)

    def network_changed(self) -> None:
        """Every picture is made again."""
        with self._changed:
            for view in self._views.values():
                view.forget_prediction()
            for session, _ in self._sessions.values():
                session.again()

    @property
    def waiting(self) -> bool:
        """Whether some browser wants a picture that is not made yet."""
        with self._changed:
            return self._next() is not None

    def work(self, *, wait: float) -> bool:
        """Makes one picture; False where for `wait` seconds there was none to make."""
        deadline = monotonic() + wait
        with self._changed:
            while (turn := self._next()) is None:
                now = monotonic()
                if now >= deadline:
                    return False
                pauses = [s.seconds_until_settled(now=now) for s, _ in self._sessions.values()]
                soon = min((pause for pause in pauses if pause > 0), default=wait)
                self._changed.wait(min(soon, deadline - now))
            self._sessions.move_to_end(turn.browser)
            turn.session.done(turn.job)
            full = turn.job.wish == turn.session.wish
        wish = turn.job.wish
        view = self._view(wish.place)
        if turn.job.more_paths:
            view.trace()
        pixels = wish.screen.pixels(view)
        self._pace.measured(view)
        turn.show(Shown(pixels, view, wish, full))
        return True

    def _next(self) -> _Turn | None:
        """The job of the browser that has waited longest; new pictures before better ones."""
        now, better = monotonic(), None
        for browser, (session, show) in self._sessions.items():
            view = self._views.get(session.wish.place)
            job = session.next_job(now=now, samples=0 if view is None else view.samples)
            if job is None:
                continue
            turn = _Turn(browser, session, show, job)
            if not job.more_paths:
                return turn
            better = better or turn
        return better

    def _view(self, place: Place) -> SceneView:
        if place not in self._views:
            self._views[place] = SceneView(place, self._renderer, self._predict)
        self._views.move_to_end(place)
        while len(self._views) > KEPT:
            self._views.popitem(last=False)
        return self._views[place]
