"""Keeps a browser's camera where v has the scene's, and v where a mouse has moved that camera."""

from threading import Timer
from time import time

import numpy as np
import viser

from ngi.view.panel import Panel
from ngi.view.subject import Camera, Vector

AGAIN = 0.5
"""Seconds after which a browser is put again that has not said that it is there."""
PATIENCE = 2.0
"""Seconds after which a browser is believed that never was exactly where the page has put it."""
KEYSTROKE = 1.0
"""Seconds after a slider has moved in which a key that is held down turns the camera as well."""
ASIDE = 0.01
"""Of the distance to the target."""


class Walk:
    """Of one browser. Its camera tells of every move some time later, in any of several threads.

    camera: of the scene
    """

    def __init__(self, client: viser.ClientHandle, camera: Camera, panel: Panel) -> None:
        self._client = client
        self._camera = camera
        self._panel = panel
        self._part: tuple[float, ...] | None = None  # of v, that the browser shows or soon will
        self._there = True  # whether the browser has been where it was put last
        self._put_in = self._waits_since = 0.0
        self._insists = False
        self.follow()
        client.camera.on_update(self._moved)

    def follow(self) -> None:
        """Puts the browser's camera where v has the scene's, unless it has led v there."""
        with self._panel.lock:
            if self._panel.v[self._camera.part] != self._part:
                self._put()

    def _put(self) -> None:
        self._part = self._put_part = self._panel.v[self._camera.part]
        self._view = self._camera.view(self._panel.v)
        mine = self._client.camera
        if self._there and _same_view((mine.position, mine.look_at), self._view):
            return
        self._there = False
        self._waits_since = time()
        self._send()
        if not self._insists:
            self._later()

    def _later(self) -> None:
        self._insists = True
        timer = Timer(AGAIN, self._insist)
        timer.daemon = True
        timer.start()

    def _insist(self) -> None:
        """A browser tells of the last of its frames only, and may have left where it was put."""
        with self._panel.lock:
            self._insists = False
            self._there = self._there or time() > self._waits_since + PATIENCE
            if self._there:
                return
            if time() >= self._put_in + AGAIN:
                self._send()
            self._later()

    def _send(self) -> None:
        mine, (origin, target) = self._client.camera, self._view
        put = False
        while not put:  # again where a message in between has undone a part
            with self._client.atomic():
                mine.up_direction = np.asarray(self._camera.up)
                # what the browser was last heard to have viser does not send, old as that may be
                mine.position = origin + ASIDE * (target - origin)
                mine.position = origin
                mine.look_at = target
            self._put_in = time()
            put = _same_view((mine.position, mine.look_at), self._view)

    def _moved(self, mine: viser.CameraHandle) -> None:
        """Takes over into v where a mouse has moved the browser's camera.

        Until the browser is where the page has put it, it tells of before, which is no wish of its
        user. It is left where the mouse has moved it to, beside the box of v's camera as well.
        """
        with self._panel.lock:
            if mine.update_timestamp <= self._put_in:  # says what was put, not where it is
                return
            view = (mine.position, mine.look_at)
            if _same_view(view, self._view):
                self._there, part = True, self._put_part
            elif not self._there:
                return
            elif time() < self._panel.touched + KEYSTROKE:
                self._put()
                return
            else:
                part = tuple(self._camera.components(*view).tolist())
            v = np.array(self._panel.v)
            if np.allclose(v[self._camera.part], part, atol=1e-3):
                return
            v[self._camera.part] = part
            self._part = part
            self._panel.set_v(v.tolist())


def _same_view(one: tuple[Vector, Vector], other: tuple[Vector, Vector]) -> bool:
    """Whether origins and targets are the same, to a browser's precision."""
    distance = float(np.linalg.norm(other[1] - other[0]))
    return np.allclose(np.stack(one), np.stack(other), atol=1e-3 * distance)
