"""Makes the pictures that all browsers ask for, one after the other, in the caller's thread."""

import logging
import threading
from collections import OrderedDict, deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import partial
from time import monotonic

from ngi.render import Renderer
from ngi.view.scene_view import PASS_SAMPLES, Place, Predict, SceneView
from ngi.view.screen import Pixels
from ngi.view.session import Job, Pace, Session, Wish

log = logging.getLogger(__name__)

KEPT = 8
"""Views that are kept, with their path-traced pictures."""


@dataclass(frozen=True)
class Shown:
    """A picture for one browser. full: at the resolution asked for, not a preview."""

    pixels: Pixels
    view: SceneView
    wish: Wish
    full: bool


Show = Callable[[Shown], None]
Failed = Callable[[Exception], None]


@dataclass(frozen=True)
class _Browser:
    session: Session
    show: Show
    failed: Failed


@dataclass(frozen=True)
class _Turn:
    name: Hashable
    browser: _Browser
    job: Job


class Studio:
    """Renderer and network, which only one thread at a time may use, shared by all browsers.

    Browsers' threads call `open`, `change`, `close` and `ask`; whoever owns renderer and network
    calls `work`, which makes one picture at a time, the browsers taking turns. What fails is logged
    and told to its browser, and the next picture is made.
    """

    def __init__(self, *, renderer: Renderer, predict: Predict) -> None:
        self._renderer = renderer
        self._predict = predict
        self._pace = Pace(renderer.buffer_samples)
        self._browsers: OrderedDict[Hashable, _Browser] = OrderedDict()
        self._asked: deque[tuple[Callable[[], None], Failed]] = deque()
        self._views: OrderedDict[Place, SceneView] = OrderedDict()
        self._changed = threading.Condition()

    def open(self, browser: Hashable, wish: Wish, show: Show, failed: Failed) -> None:
        """To this browser `show` brings every picture, and `failed` tells why there is none.

        Both in the thread that calls `work`.
        """
        with self._changed:
            session = Session(wish, self._pace.preview)
            self._browsers[browser] = _Browser(session, show, failed)
            self._changed.notify()

    def change(self, browser: Hashable, wish: Wish) -> None:
        """Wants something else from now on; of a browser that is gone nothing."""
        with self._changed:
            if browser in self._browsers:
                self._browsers[browser].session.change(wish, now=monotonic())
                self._changed.notify()

    def close(self, browser: Hashable) -> None:
        with self._changed:
            self._browsers.pop(browser, None)

    def ask(self, errand: Callable[[], None], failed: Failed) -> None:
        """Has something done that needs network or renderer; `failed` is told why it was not."""
        with self._changed:
            self._asked.append((errand, failed))
            self._changed.notify()

    def view(self, place: Place) -> SceneView:
        """What is or can be computed there; in the thread that calls `work`, see `ask`."""
        if place not in self._views:
            self._views[place] = SceneView(place, self._renderer, self._predict)
        self._views.move_to_end(place)
        view = self._views[place]
        self._forget()
        return view

    def network_changed(self) -> None:
        """Every picture is made again."""
        with self._changed:
            for view in self._views.values():
                view.forget_prediction()
            for browser in self._browsers.values():
                browser.session.again()

    @property
    def waiting(self) -> bool:
        """Whether some browser wants something that is not made yet."""
        with self._changed:
            return bool(self._asked) or self._next() is not None

    def work(self, *, wait: float) -> bool:
        """Makes one picture; False where for `wait` seconds there was none to make."""
        if (task := self._await_task(wait)) is None:
            return False
        do, failed = task
        try:
            do()
        except Exception as error:
            log.exception("the viewer could not make a picture")
            failed(error)
        return True

    def _await_task(self, wait: float) -> tuple[Callable[[], None], Failed] | None:
        deadline = monotonic() + wait
        with self._changed:
            while not self._asked and (turn := self._next()) is None:
                now = monotonic()
                if now >= deadline:
                    return None
                sessions = [browser.session for browser in self._browsers.values()]
                pauses = [session.seconds_until_settled(now=now) for session in sessions]
                soon = min((pause for pause in pauses if pause > 0), default=wait)
                self._changed.wait(min(soon, deadline - now))
            if self._asked:
                return self._asked.popleft()
            assert turn is not None
            self._browsers.move_to_end(turn.name)
            turn.browser.session.done(turn.job)
            full = turn.job.wish == turn.browser.session.wish
            return partial(self._make, turn, full=full), partial(self._failed, turn.browser)

    def _make(self, turn: _Turn, *, full: bool) -> None:
        wish = turn.job.wish
        view = self.view(wish.place)
        if turn.job.more_paths:
            view.trace()
        pixels = wish.screen.pixels(view)
        self._pace.measured(view)
        turn.browser.show(Shown(pixels, view, wish, full))

    def _failed(self, browser: _Browser, error: Exception) -> None:
        with self._changed:
            browser.session.failed()
        browser.failed(error)

    def _next(self) -> _Turn | None:
        """The job of the browser that has waited longest; new pictures before better ones."""
        now, better = monotonic(), None
        for name, browser in self._browsers.items():
            wish = browser.session.wish
            view = self._views.get(wish.place)
            job = browser.session.next_job(
                now=now,
                samples=0 if view is None else view.samples,
                computed=view is not None and view.has(wish.screen.needs),
            )
            if job is None:
                continue
            turn = _Turn(name, browser, job)
            if not job.more_paths:
                return turn
            better = better or turn
        return better

    def _forget(self) -> None:
        """Views too many that no browser looks at; last those with more paths than a preview."""
        with self._changed:
            wanted = {browser.session.wish.place for browser in self._browsers.values()}
        spare = [place for place in self._views if place not in wanted]
        spare.sort(key=lambda place: self._views[place].samples > PASS_SAMPLES)
        for place in spare[: max(0, len(self._views) - KEPT)]:
            del self._views[place]
