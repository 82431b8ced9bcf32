"""A stand-in for a browser that looks at a page, and a page for it to look at."""

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from time import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import viser
from torch import Tensor

from ngi.evaluate import EvaluationProtocol
from ngi.render import AnalyticRenderer
from ngi.scene import read_scene, scenes
from ngi.view.inputs import controls
from ngi.view.studio import Studio
from ngi.view.subject import Subject, camera_of
from ngi.view.visitor import Visitor

ROOM = read_scene(**scenes()["living-room"])
START = [0.0, 0.2, 0.1, 0.3, 0.9, 1.0, 0.1]


class Browser:
    """As `viser.ClientHandle`; its camera is where the page or a mouse has put it."""

    client_id = 1

    def __init__(self, gui: viser.GuiApi) -> None:
        self.gui = gui
        self.shown: list[tuple[np.ndarray, str]] = []
        self.files: dict[str, bytes] = {}
        self.notified: list[tuple[str, str]] = []
        self.camera = SimpleNamespace(
            position=np.zeros(3),
            look_at=np.ones(3),
            up_direction=None,
            image_width=600,
            image_height=600,
            on_update=lambda react: self._reactions.append(react),
        )
        self.scene = SimpleNamespace(
            set_background_image=lambda pixels, format: self.shown.append((pixels, format))
        )
        self._reactions: list[Callable[[Any], None]] = []

    @property
    def view(self) -> tuple[Any, Any]:
        """Origin and target that the page knows of or has asked for."""
        return self.camera.position, self.camera.look_at

    def atomic(self) -> Any:
        return nullcontext()

    def flush(self) -> None:
        pass

    def send_file_download(self, name: str, content: bytes, *, save_immediately: bool) -> None:
        assert save_immediately
        self.files[name] = content

    def add_notification(self, title: str, body: str, *, color: str) -> None:
        assert color == "red"
        self.notified.append((title, body))

    def says(self, position: Any, look_at: Any, *, at: float | None = None) -> None:
        """Where its camera is; at: when that was received, now where it is None."""
        self.camera.position, self.camera.look_at = position, look_at
        self.camera.update_timestamp = time() if at is None else at
        for react in self._reactions:
            react(self.camera)


def subject() -> Subject:
    return Subject(
        name="room",
        folder=Path("run"),
        controls=controls(ROOM),
        presets={"start": START},
        buffers=("albedo",),
        camera=camera_of(ROOM),
        protocol=EvaluationProtocol(
            name="test", resolution=32, low_discrepancy_frames=1, target_noise=1,
            samples_per_pass=1, maximum_samples=2,
        ),
        scene=None,
        supersampled_edges=False,
    )  # fmt: skip


def coloured(buffers: Tensor, v: Tensor, *, preview: bool) -> Tensor:  # noqa: ARG001
    return buffers[..., :3] * v[0]


def studio() -> Studio:
    return Studio(renderer=AnalyticRenderer(dimensions=7, patch_size=16), predict=coloured)


def visitor(browser: Browser) -> Visitor:
    return Visitor(browser, subject(), studio(), resolution=64)  # type: ignore[arg-type]
