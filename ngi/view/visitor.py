"""One browser that looks at a page: its controls, its camera, its picture."""

import io
import shlex
from collections import deque
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np
import viser
from PIL import Image

from ngi.evaluate import image_metrics
from ngi.evaluate.pictures import WHITE, side_by_side
from ngi.render.exr import write_exr
from ngi.view.panel import Panel
from ngi.view.scene_view import Place
from ngi.view.screen import Pixels
from ngi.view.session import Wish
from ngi.view.studio import Shown, Studio
from ngi.view.subject import Subject, Vector

SMALL = 128
"""Pixels a side up to which JPEG would not be faster than PNG, and its colours would run."""
RATE_OVER = 2.0
"""Seconds over which pictures per second are counted."""
ECHOES = 200
"""Views that the page has asked for and a browser may still answer."""
GREY = 24
"""Of what is beside the picture where the window has another shape."""


class Visitor:
    """Tells the studio what its browser wants, and the browser what the studio has made."""

    def __init__(
        self, client: viser.ClientHandle, subject: Subject, studio: Studio, *, resolution: int
    ) -> None:
        self._client = client
        self._subject = subject
        self._studio = studio
        self._last: Shown | None = None
        self._aspect = 1.0
        self._moments: deque[float] = deque(maxlen=100)
        self._aims: deque[tuple[Vector, Vector]] = deque(maxlen=ECHOES)
        start = next(iter(subject.presets.values()))
        self._panel = Panel(
            client.gui,
            controls=subject.controls,
            v=start,
            presets=dict(subject.presets),
            buffers=subject.buffers,
            resolution=resolution,
            epsilon=subject.protocol.epsilon,
            on_change=self._changed,
        )
        self._add_files()
        client.camera.on_update(self._refit)
        if subject.camera is not None:
            self._aim()
            client.camera.on_update(self._walk)

    @property
    def wish(self) -> Wish:
        return Wish(Place(self._panel.v, self._panel.resolution), self._panel.screen)

    def show(self, shown: Shown) -> None:
        """Sends a picture; in the thread that made it."""
        begin = perf_counter()
        self._send(shown)
        self._moments.append(perf_counter())
        self._panel.status.content = self._status(shown, sending=perf_counter() - begin)

    def _send(self, shown: Shown) -> None:
        self._last, self._aspect = shown, self._client.camera.aspect
        pixels = _fitted(_captioned(shown), self._aspect)
        exactly = shown.full or len(shown.pixels) <= SMALL
        self._client.scene.set_background_image(pixels, format="png" if exactly else "jpeg")
        self._client.flush()

    def _refit(self, mine: viser.CameraHandle) -> None:
        """Sends the picture again where the window has got another shape."""
        if self._last is not None and not np.isclose(mine.aspect, self._aspect):
            self._send(self._last)

    def _changed(self) -> None:
        self._studio.change(self._client.client_id, self.wish)
        self._command.value = self._command_line()
        if self._subject.camera is not None:
            self._aim()

    def _aim(self) -> None:
        """Puts the browser's camera where v has the scene's."""
        camera = self._subject.camera
        assert camera is not None
        origin, target = camera.view(self._panel.v)
        mine = self._client.camera
        if _same_view((mine.position, mine.look_at), (origin, target)):
            return
        self._aims.append((origin, target))
        with self._client.atomic():
            mine.up_direction = np.asarray(camera.up)
            mine.position = origin
            mine.look_at = target

    def _walk(self, mine: viser.CameraHandle) -> None:
        """Takes over into v where a mouse has moved the browser's camera.

        Where the page has put it, the browser says so some time later: that is no wish of its user.
        """
        camera = self._subject.camera
        assert camera is not None
        there = (mine.position, mine.look_at)
        if any(_same_view(there, aim) for aim in tuple(self._aims)):
            return
        v = np.array(self._panel.v)
        moved = camera.components(mine.position, mine.look_at)
        if np.allclose(v[camera.part], moved, atol=1e-3):
            return
        v[camera.part] = moved
        self._panel.set_v(v.tolist())

    def _status(self, shown: Shown, *, sending: float) -> str:
        view = shown.view
        parts = {**view.seconds, "sending": sending}
        lines = [
            f"{view.place.resolution} × {view.place.resolution} pixels",
            ", ".join(f"{name} {1e3 * seconds:.0f} ms" for name, seconds in parts.items()),
        ]
        if (rate := self._pictures_per_second()) is not None:
            lines.append(f"{rate:.1f} pictures per second")
        if shown.wish.screen.traces_paths:
            lines.append(f"{view.samples} samples per pixel")
            lines.append(self._metrics(shown))
        return "  \n".join(lines)

    def _pictures_per_second(self) -> float | None:
        """Over the last seconds; None where nothing has moved."""
        recent = [moment for moment in self._moments if moment > self._moments[-1] - RATE_OVER]
        if len(recent) < 2:
            return None
        return (len(recent) - 1) / (recent[-1] - recent[0])

    def _metrics(self, shown: Shown) -> str:
        smallest = self._subject.protocol.ssim_window
        if min(shown.view.prediction.shape[:2]) < smallest:
            return f"metrics take {smallest} pixels a side"
        measured = image_metrics(
            shown.view.prediction,
            shown.view.reference,
            protocol=self._subject.protocol,
            lpips=None,
        )
        return ", ".join(
            f"{name.upper()} {value:.3g}" for name, value in measured.items() if value is not None
        )

    def _add_files(self) -> None:
        gui, client = self._client.gui, self._client
        with gui.add_folder("Files", expand_by_default=False):
            self._command: Any = gui.add_text("command", self._command_line(), disabled=True)
            png, exr, save = (
                gui.add_button(name) for name in ("picture (PNG)", "radiance (EXR)", "save v")
            )
            upload = gui.add_upload_button("load v", mime_type="application/json")

        @png.on_click
        def _(_: object) -> None:
            if self._last is not None:
                buffer = io.BytesIO()
                Image.fromarray(self._last.pixels).save(buffer, "PNG")
                client.send_file_download("picture.png", buffer.getvalue(), save_immediately=True)

        @exr.on_click
        def _(_: object) -> None:
            if self._last is not None:
                client.send_file_download("picture.exr", _exr(self._last), save_immediately=True)

        @save.on_click
        def _(_: object) -> None:
            client.send_file_download("v.json", self._panel.saved(), save_immediately=True)

        @upload.on_upload
        def _(_: object) -> None:
            try:
                self._panel.load(upload.value.content)
            except ValueError as error:
                client.add_notification("This file cannot be loaded", str(error), color="red")

    def _command_line(self) -> str:
        v = ",".join(f"{number:.6g}" for number in self._panel.v)
        return shlex.join(
            [
                *("ngi", "render", f"run={self._subject.folder}", f"v=[{v}]"),
                *(f"resolution={self._panel.resolution}", "out=picture.png"),
            ]
        )


def _exr(shown: Shown) -> bytes:
    """Radiance of the first picture that is shown; the network's where that is a buffer."""
    traced = shown.wish.screen.parts[0] == "path tracer"
    with TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        write_exr(path, shown.view.reference if traced else shown.view.prediction)
        return path.read_bytes()


def _same_view(one: tuple[Vector, Vector], other: tuple[Vector, Vector]) -> bool:
    """Whether origins and targets are the same, to a browser's precision."""
    return np.allclose(np.stack(one), np.stack(other), atol=1e-3)


def _captioned(shown: Shown) -> Pixels:
    """Its picture, or several side by side, each under its name."""
    parts = shown.wish.screen.parts
    if len(parts) == 1:
        return shown.pixels
    pictures = [Image.fromarray(each) for each in np.split(shown.pixels, len(parts), axis=1)]
    return np.asarray(side_by_side(pictures, parts, paper=(GREY,) * 3, ink=WHITE))


def _fitted(pixels: Pixels, aspect: float) -> Pixels:
    """The picture amid grey, so that a window of this aspect (width / height) does not stretch it.

    pixels: [H, W, 3]
    """
    height, width = pixels.shape[:2]
    wanted = (max(height, round(width / aspect)), max(width, round(height * aspect)))
    canvas = np.full((*wanted, 3), GREY, dtype=np.uint8)
    top, left = (wanted[0] - height) // 2, (wanted[1] - width) // 2
    canvas[top : top + height, left : left + width] = pixels
    return canvas
