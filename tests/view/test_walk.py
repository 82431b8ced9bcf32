"""What a browser says of its camera: what a mouse has done, and what it tells late."""

from collections.abc import Callable
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest

viser = pytest.importorskip("viser", reason="needs pip install -e .[viewer]")

from ngi.view import walk  # noqa: E402
from ngi.view.visitor import Visitor  # noqa: E402
from tests.view.browser import START, Browser, visitor  # noqa: E402

ELSEWHERE = (np.array([3.0, 3.0, 3.0]), np.zeros(3))


@pytest.fixture
def made(browser: Browser, monkeypatch: pytest.MonkeyPatch) -> Visitor:
    monkeypatch.setattr(walk, "AGAIN", 600.0)
    monkeypatch.setattr(walk, "KEYSTROKE", 600.0)
    return visitor(browser)


def set_slider(made: Visitor, number: int, value: float) -> None:
    made._panel._inputs[number][1].value = value


def precisely(view: tuple[Any, Any]) -> tuple[Any, Any]:
    """As a browser says it, which counts in float32."""
    return view[0].astype(np.float32), view[1].astype(np.float32) + 1e-6


def test_where_it_was_before_the_page_has_put_it_is_no_wish(
    browser: Browser, made: Visitor
) -> None:
    put = browser.view
    browser.says(*ELSEWHERE)
    browser.says(*precisely(put))
    assert made.wish.place.v == tuple(START)
    browser.says(*ELSEWHERE)  # it has been there, so that this is a mouse's doing
    assert made.wish.place.v != tuple(START)


def test_where_sliders_have_put_it_is_no_wish(browser: Browser, made: Visitor) -> None:
    views = [browser.view]
    for origin_x in (0.5, 1.0, 1.5):
        set_slider(made, 0, origin_x)
        views.append(browser.view)
    wanted = made.wish.place.v
    assert wanted[1:] == tuple(START[1:])
    assert len({tuple(position) for position, _ in views}) == 4
    for view in (*views, views[-1]):  # late, all of them, and the last one twice
        browser.says(*precisely(view))
        assert made.wish.place.v == wanted


def test_what_was_received_before_the_page_has_put_it_says_nothing(
    browser: Browser, made: Visitor
) -> None:
    """Its thread comes late, and finds what the page has put there as if the browser were there."""
    browser.says(*browser.view, at=0.0)
    browser.says(*ELSEWHERE)
    assert made.wish.place.v == tuple(START)


def test_where_a_mouse_has_put_it_is_one(browser: Browser, made: Visitor) -> None:
    position, target = browser.view
    browser.says(position, target)
    browser.says(position + 0.1, target)
    moved = made.wish.place.v
    assert moved[:3] != tuple(START[:3])
    assert moved[5:] == tuple(START[5:])  # blind and lamp


def test_a_mouse_is_followed_out_of_the_box_and_back_and_never_led(
    browser: Browser, made: Visitor
) -> None:
    position, target = browser.view
    browser.says(position, target)
    for beyond in (100.0, 200.0, 100.0):
        browser.says(position + beyond, target)
        assert max(made.wish.place.v[:3]) == 1.0
        np.testing.assert_array_equal(browser.view, (position + beyond, target))
    browser.says(position + 0.1, target)
    assert max(made.wish.place.v[:3]) < 1.0


def test_a_slider_puts_it_back_after_a_mouse(browser: Browser, made: Visitor) -> None:
    first = browser.view
    browser.says(*first)
    browser.says(first[0] + 0.1, first[1])
    made._panel.reset()
    np.testing.assert_allclose(browser.view, first)
    browser.says(first[0] + 0.1, first[1])  # said before it got there
    assert made.wish.place.v == tuple(START)


def test_a_mouse_that_comes_back_to_where_the_page_has_put_it_is_followed(
    browser: Browser, made: Visitor
) -> None:
    put = browser.view
    browser.says(*put)
    browser.says(put[0] + 0.1, put[1])
    assert made.wish.place.v != tuple(START)
    browser.says(*precisely(put))
    assert made.wish.place.v == tuple(START)


def test_a_key_on_a_slider_moves_no_camera(
    browser: Browser, made: Visitor, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Viser turns the camera by the arrows that Mantine moves its sliders by."""
    put = browser.view
    browser.says(*put)
    lamp = len(START) - 1
    set_slider(made, lamp, 0.5)
    wanted = made.wish.place.v
    assert wanted[:lamp] == tuple(START[:lamp])
    browser.says(put[0] + 0.1, put[1])
    assert made.wish.place.v == wanted
    np.testing.assert_array_equal(browser.view, put)
    browser.says(*put)
    monkeypatch.setattr(walk, "KEYSTROKE", 0.0)  # long ago
    browser.says(put[0] + 0.1, put[1])
    assert made.wish.place.v != wanted


def test_a_slider_that_comes_back_before_the_browser_has_answered(
    browser: Browser, made: Visitor
) -> None:
    first = browser.view
    set_slider(made, 0, 1.0)
    browser.says(*first, at=0.0)  # late: viser takes it for where the browser is
    sent: list[np.ndarray] = []
    browser.camera = Listening(sent, *first)  # type: ignore[assignment]
    made._panel.reset()
    np.testing.assert_array_equal(sent[-1], first[0])


class Listening:
    """A camera that drops what it believes to be so already, as viser's does."""

    up_direction = None

    def __init__(self, sent: list[np.ndarray], position: np.ndarray, look_at: np.ndarray) -> None:
        self.look_at = look_at
        self._position = position
        self._sent = sent

    @property
    def position(self) -> np.ndarray:
        return self._position

    @position.setter
    def position(self, position: np.ndarray) -> None:
        if not np.allclose(position, self._position):
            self._sent.append(position)
        self._position = position


def test_a_browser_that_never_gets_there_is_put_again_and_believed_in_the_end(
    browser: Browser, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(walk, "AGAIN", 0.02)
    monkeypatch.setattr(walk, "PATIENCE", 0.3)
    made = visitor(browser)
    put = browser.view
    browser.says(*ELSEWHERE)
    wait_until(lambda: np.array_equal(browser.view, put))
    assert made.wish.place.v == tuple(START)
    walking = made._walk
    assert walking is not None
    wait_until(lambda: walking._there)
    browser.says(*ELSEWHERE)
    assert made.wish.place.v != tuple(START)


def wait_until(holds: Callable[[], bool]) -> None:
    deadline = monotonic() + 60
    while not holds():
        assert monotonic() < deadline
        sleep(0.01)


class Jostled:
    """A camera that says where it is just when the page has put its origin, as often as `times`."""

    up_direction = None
    look_at = np.zeros(3)

    def __init__(self, times: int) -> None:
        self.times = times
        self._position = np.ones(3)

    @property
    def position(self) -> np.ndarray:
        return self._position

    @position.setter
    def position(self, position: np.ndarray) -> None:
        self.times -= 1
        self._position = np.full(3, 5.0) if self.times >= 0 else position

    def on_update(self, react: Any) -> None:
        pass


def test_a_message_that_comes_while_the_page_puts_it_does_not_keep_it_away(
    browser: Browser, made: Visitor
) -> None:
    put = browser.view
    browser.camera = Jostled(times=3)  # type: ignore[assignment]
    walk.Walk(browser, made._subject.camera, made._panel)  # type: ignore[arg-type]
    np.testing.assert_array_equal(browser.view, put)
