"""What a browser tells the page, and what the page shows it; the browser is a stand-in."""

from collections.abc import Callable, Iterator
from contextlib import closing, nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from skimage.feature import match_template
from torch import Tensor

viser = pytest.importorskip("viser", reason="needs pip install -e .[viewer]")

from ngi.evaluate import EvaluationProtocol  # noqa: E402
from ngi.render import AnalyticRenderer  # noqa: E402
from ngi.scene import read_scene, scenes  # noqa: E402
from ngi.view.inputs import controls  # noqa: E402
from ngi.view.page import Page, viser_server  # noqa: E402
from ngi.view.scene_view import Place, SceneView  # noqa: E402
from ngi.view.screen import Screen  # noqa: E402
from ngi.view.session import Wish  # noqa: E402
from ngi.view.studio import Shown, Studio  # noqa: E402
from ngi.view.subject import Subject, camera_of  # noqa: E402
from ngi.view.visitor import Visitor  # noqa: E402

ROOM = read_scene(**scenes()["living-room"])
START = [0.0, 0.2, 0.1, 0.3, 0.9, 1.0, 0.1]
SIZE = 300


class Browser:
    """As `viser.ClientHandle`; its camera is where the page or a mouse has put it."""

    client_id = 1

    def __init__(self, gui: viser.GuiApi) -> None:
        self.gui = gui
        self.shown: list[tuple[np.ndarray, str]] = []
        self.camera = SimpleNamespace(
            position=np.zeros(3),
            look_at=np.ones(3),
            up_direction=None,
            aspect=1.0,
            on_update=lambda react: self._reactions.append(react),
        )
        self.scene = SimpleNamespace(
            set_background_image=lambda pixels, format: self.shown.append((pixels, format))
        )
        self._reactions: list[Callable[[Any], None]] = []

    def atomic(self) -> Any:
        return nullcontext()

    def flush(self) -> None:
        pass

    def says(self, position: Any, look_at: Any) -> None:
        for react in self._reactions:
            react(SimpleNamespace(position=position, look_at=look_at, aspect=self.camera.aspect))


@pytest.fixture
def browser() -> Iterator[Browser]:
    server = viser_server(host="127.0.0.1", port=0)
    yield Browser(server.gui)
    server.stop()


def coloured(buffers: Tensor, v: Tensor) -> Tensor:
    return buffers[..., :3] * v[0]


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
    )  # fmt: skip


def studio() -> Studio:
    return Studio(renderer=AnalyticRenderer(dimensions=7, patch_size=16), predict=coloured)


def visitor(browser: Browser) -> Visitor:
    return Visitor(browser, subject(), studio(), resolution=64)  # type: ignore[arg-type]


def set_slider(made: Visitor, number: int, value: float) -> None:
    made._panel._inputs[number][1].value = value


def test_a_browser_that_left_while_its_controls_were_made_is_drawn_nothing(
    browser: Browser,
) -> None:
    made = studio()
    page = Page(made, subject(), resolution=64, host="127.0.0.1", port=0)
    with closing(page):
        page._welcome(browser)  # type: ignore[arg-type]  # which is not among the server's
    assert not made.waiting


def test_where_the_page_has_put_the_camera_is_no_wish(browser: Browser) -> None:
    made = visitor(browser)
    answers = [(browser.camera.position, browser.camera.look_at)]
    for origin_x in (0.5, 1.0, 1.5):
        set_slider(made, 0, origin_x)
        answers.append((browser.camera.position, browser.camera.look_at))
    wanted = made.wish.place.v
    assert wanted[1:] == tuple(START[1:])
    assert len({tuple(position) for position, _ in answers}) == 4
    for position, target in answers:  # late, all of them, and of a browser's precision
        browser.says(position.astype(np.float32), target.astype(np.float32) + 1e-6)
    assert made.wish.place.v == wanted


def test_where_a_mouse_has_put_it_is_one(browser: Browser) -> None:
    made = visitor(browser)
    browser.says(browser.camera.position + 0.1, browser.camera.look_at)
    moved = made.wish.place.v
    assert moved[:3] != tuple(START[:3])
    assert moved[5:] == tuple(START[5:])  # blind and lamp


@pytest.mark.parametrize(("show", "parts"), [("network", 1), ("network | path tracer", 2)])
def test_pictures_side_by_side_have_their_names_above_them(
    browser: Browser, show: str, parts: int
) -> None:
    made = visitor(browser)
    view = SceneView(
        Place((0.5,) * 7, SIZE),
        AnalyticRenderer(dimensions=7, patch_size=16),
        coloured,
    )
    screen = Screen(show)
    browser.camera.aspect = parts + 0.0
    made.show(Shown(screen.pixels(view), view, Wish(view.place, screen), full=True))
    ((pixels, format),) = browser.shown
    assert format == "png"
    pictures = np.split(screen.pixels(view), parts, axis=1)
    if parts == 1:
        np.testing.assert_array_equal(pixels, pictures[0])
        return
    for half, picture in zip(np.split(pixels, parts, axis=1), pictures, strict=True):
        top = np.flatnonzero((half == picture[0, 0]).all(axis=-1).any(axis=1))[0]
        assert (half[:top] > 200).any(), "its name"
        assert match_template(half.mean(-1), picture.mean(-1)).max() > 0.999


def test_pictures_too_small_for_the_metrics_are_shown_without(browser: Browser) -> None:
    for side, said in ((8, "metrics take 11 pixels a side"), (16, "MAPE")):
        picture = torch.rand(side, side, 3, generator=torch.Generator().manual_seed(0))
        view: Any = SimpleNamespace(prediction=picture, reference=picture / 2)
        shown: Any = SimpleNamespace(view=view)
        assert visitor(browser)._metrics(shown).startswith(said)
