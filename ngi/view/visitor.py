"""One browser that looks at a page: its controls, its camera, its picture."""

import html
import io
import shlex
from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from time import perf_counter

import numpy as np
import viser
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from ngi.evaluate import image_metrics
from ngi.evaluate.metrics import mape
from ngi.evaluate.pictures import WHITE, side_by_side, stacked
from ngi.render.exr import write_exr
from ngi.view.panel import Panel
from ngi.view.scene_view import PASS_SAMPLES, Place, SceneView
from ngi.view.screen import Pixels
from ngi.view.session import Wish
from ngi.view.studio import Shown, Studio
from ngi.view.subject import Subject
from ngi.view.walk import Walk

SMALL = 128
"""Pixels a side up to which JPEG would not be faster than PNG, and its colours would run."""
RATE_OVER = 2.0
"""Seconds over which pictures per second are counted."""
WIDEST = 8
"""Width / height of a window, or the other way round, from which on a picture does not fit."""
FOLDER = '<div style="padding: 0 1em; font-size: 0.85em; overflow-wrap: anywhere">{}</div>'
"""Titles cut off what tells runs apart."""
COMMAND = """<div style="padding: 0 1em; font-size: 0.85em">
<button onclick="navigator.clipboard.writeText(this.nextElementSibling.textContent)">copy</button>
<code style="user-select: all; word-break: break-all">{}</code></div>"""
"""A click selects all of it, where a browser gives its clipboard to no page by HTTP."""
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
        self._sending = Lock()
        client.gui.add_html(FOLDER.format(html.escape(str(subject.folder))))
        self._moments: deque[float] = deque(maxlen=100)
        self._panel = Panel(
            client.gui,
            controls=subject.controls,
            v=subject.start,
            presets=dict(subject.presets),
            buffers=subject.buffers,
            resolution=resolution,
            epsilon=subject.protocol.epsilon,
            on_change=self._changed,
        )
        self._add_files()
        client.camera.on_update(self._refit)
        self._walk = None if subject.camera is None else Walk(client, subject.camera, self._panel)

    @property
    def wish(self) -> Wish:
        return Wish(self._place, self._panel.screen)

    def restore(self, wish: Wish) -> None:
        """Sets everything as it was in another browser of the same page."""
        self._panel.restore(wish.place, wish.screen)

    def show(self, shown: Shown) -> None:
        """Sends a picture; in the thread that made it."""
        begin = perf_counter()
        with self._sending:
            self._send(shown)
        self._moments.append(perf_counter())
        self._show_command()
        self._panel.say(self._status(shown, sending=perf_counter() - begin))

    def failed(self, error: Exception) -> None:
        """Tells why there is no picture."""
        self._panel.say([f"This failed: {_reason(error)}"])

    def _not_saved(self, error: Exception) -> None:
        """Where the next picture does not push it out."""
        self._client.add_notification("This file cannot be made", _reason(error), color="red")

    @property
    def _place(self) -> Place:
        return Place(self._panel.v, self._panel.resolution)

    def _send(self, shown: Shown) -> None:
        self._last, self._aspect = shown, self._window()
        pixels = _fitted(_captioned(shown, self._aspect), self._aspect)
        exactly = shown.full or len(shown.pixels) <= SMALL
        self._client.scene.set_background_image(pixels, format="png" if exactly else "jpeg")
        self._client.flush()

    def _refit(self, _: viser.CameraHandle) -> None:
        """Sends the picture again where the window has got another shape."""
        with self._sending:
            if self._last is not None and not np.isclose(self._window(), self._aspect):
                self._send(self._last)

    def _window(self) -> float:
        """Width / height of the browser's, as far as a picture is made to fit it."""
        camera = self._client.camera
        shape = camera.image_width / max(1, camera.image_height)
        return min(max(shape, 1 / WIDEST), WIDEST)

    def _changed(self) -> None:
        self._studio.change(self._client.client_id, self.wish)
        self._show_command()
        if self._walk is not None:
            self._walk.follow()

    def _status(self, shown: Shown, *, sending: float) -> list[str]:
        """What is asked for first: later lines may have to be scrolled to."""
        view = shown.view
        parts = {**view.seconds, "sending": sending}
        lines = [f"{view.place.resolution} × {view.place.resolution} pixels"]
        if shown.wish.screen.traces_paths:
            lines[0] += f", {view.samples} samples per pixel"
            lines.append(self._metrics(shown) if shown.full else "metrics once nothing moves")
        lines.append(", ".join(f"{name} {1e3 * seconds:.0f} ms" for name, seconds in parts.items()))
        if (rate := self._pictures_per_second()) is not None:
            lines.append(f"{rate:.1f} pictures per second")
        return lines

    def _pictures_per_second(self) -> float | None:
        """Over the last seconds; None where nothing has moved."""
        recent = [moment for moment in self._moments if moment > self._moments[-1] - RATE_OVER]
        if len(recent) < 2:
            return None
        return (len(recent) - 1) / (recent[-1] - recent[0])

    def _metrics(self, shown: Shown) -> str:
        view, protocol = shown.view, self._subject.protocol
        smallest = protocol.ssim_window
        if min(view.prediction.shape[:2]) < smallest:
            return f"metrics need at least {smallest} pixels a side"
        reference = view.reference
        measured = image_metrics(view.prediction, reference, protocol=protocol, lpips=None)
        said = {name: f"{value:.3g}" for name, value in measured.items() if value is not None}
        if (noise := view.noise) is not None:
            about = mape(reference + noise, reference, protocol.epsilon)
            said["mape"] += f" (path tracer's noise about {about:.2g})"
        return ", ".join(f"{name.upper()} {value}" for name, value in said.items())

    def _add_files(self) -> None:
        gui, client = self._client.gui, self._client
        with gui.add_folder("Files", expand_by_default=False):
            self._command = gui.add_html("")
            self._show_command()
            png, exr, save = (
                gui.add_button(name) for name in ("picture (PNG)", "radiance (EXR)", "save v")
            )
            upload = gui.add_upload_button("load v", mime_type="application/json")

        png.on_click(lambda _: self._save("picture.png", self._png))
        exr.on_click(lambda _: self._save("picture.exr", _exr))

        @save.on_click
        def _(_: object) -> None:
            client.send_file_download("v.json", self._panel.saved(), save_immediately=True)

        @upload.on_upload
        def _(_: object) -> None:
            try:
                self._panel.load(upload.value.content)
            except ValueError as error:
                client.add_notification("This file cannot be loaded", str(error), color="red")

    def _save(self, name: str, content: Callable[[SceneView, Wish], bytes]) -> None:
        """Sends the whole picture of the present wish as a file, whatever preview is shown."""
        wish, send = self.wish, self._client.send_file_download

        def errand() -> None:
            made = content(self._studio.view(wish.place), wish)
            send(name, made, save_immediately=True)

        self._studio.ask(errand, self._not_saved)

    def _png(self, view: SceneView, wish: Wish) -> bytes:
        """Carries the command that makes it as text, "command", where there is one."""
        picture, text, file = Image.fromarray(wish.screen.pixels(view)), PngInfo(), io.BytesIO()
        if (command := self._command_for(wish, view.samples)) is not None:
            text.add_text("command", command)
        picture.save(file, "PNG", pnginfo=text)
        return file.getvalue()

    def _show_command(self) -> None:
        """Again only where it has changed: what is selected of it would no longer be."""
        content = COMMAND.format(html.escape(self._command_line()))
        if content != self._command.content:
            self._command.content = content

    def _command_line(self) -> str:
        """With as many samples per pixel as are seen, rounded down to a power of two."""
        wish, last = self.wish, self._last
        samples = 0 if last is None or last.view.place != wish.place else last.view.samples
        rounded = 1 << samples.bit_length() >> 1
        return self._command_for(wish, rounded) or "ngi render does not render buffers"

    def _command_for(self, wish: Wish, samples: int) -> str | None:
        """What makes a picture without the page; None of a buffer.

        samples: per pixel of its path-traced part, which begins with a single pass
        """
        place, screen = wish.place, wish.screen
        if "buffers" in screen.needs:
            return None
        v = ",".join(f"{number:.9g}" for number in place.v)
        words = [f"run={self._subject.folder}", f"v=[{v}]", f"resolution={place.resolution}"]
        if self._subject.scene is not None:
            words.append(f"scene={self._subject.scene}")
        if self._subject.supersampled_edges:
            words.append("supersampled_edges=true")
        if screen.traces_paths:
            words.append(f"reference={samples or PASS_SAMPLES}")
        if screen.exposure:
            words.append(f"exposure={screen.exposure:g}")
        if screen.curve != "sRGB":
            words.append(f"tone_mapping={screen.curve}")
        return shlex.join(["ngi", "render", *words, "out=picture.png"])


def _reason(error: Exception) -> str:
    return str(error) or type(error).__name__


def _exr(view: SceneView, wish: Wish) -> bytes:
    """Radiance of the first picture that is shown; the network's where that is a buffer."""
    traced = wish.screen.parts[0] == "path tracer"
    with TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        write_exr(path, view.reference if traced else view.prediction)
        return path.read_bytes()


def _captioned(shown: Shown, aspect: float) -> Pixels:
    """Its picture, or several, each under its name: one below the other in a window that is tall.

    aspect: width / height of the window
    """
    parts = shown.wish.screen.parts
    if len(parts) == 1:
        return shown.pixels
    pictures = [Image.fromarray(each) for each in np.split(shown.pixels, len(parts), axis=1)]
    row = partial(side_by_side, paper=(GREY,) * 3, ink=WHITE)
    if aspect >= 1:
        return np.asarray(row(pictures, parts))
    named = zip(pictures, parts, strict=True)
    return np.asarray(stacked([row([picture], [part]) for picture, part in named]))


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
