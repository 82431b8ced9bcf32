"""What the page shows a browser, which is a stand-in."""

import html
import re
import shlex
from contextlib import closing
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from threading import Thread, get_ident
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import torch
from PIL import Image
from skimage.feature import match_template

viser = pytest.importorskip("viser", reason="needs pip install -e .[viewer]")

from viser._messages import GuiHtmlMessage  # noqa: E402

from ngi.config.options import read_options  # noqa: E402
from ngi.evaluate.metrics import mape  # noqa: E402
from ngi.render import AnalyticRenderer  # noqa: E402
from ngi.view.page import Page  # noqa: E402
from ngi.view.picture import PictureOptions  # noqa: E402
from ngi.view.scene_view import PASS_SAMPLES, Place, SceneView  # noqa: E402
from ngi.view.screen import Screen  # noqa: E402
from ngi.view.session import Wish  # noqa: E402
from ngi.view.studio import Shown, Studio  # noqa: E402
from ngi.view.visitor import Visitor  # noqa: E402
from tests.view.browser import START, Browser, coloured, studio, subject, visitor  # noqa: E402

SIZE = 300


def test_a_browser_that_left_while_its_controls_were_made_is_drawn_nothing(
    browser: Browser,
) -> None:
    made = studio()
    page = Page(made, subject(), resolution=64, host="127.0.0.1", port=0)
    with closing(page):
        page._welcome(browser)  # type: ignore[arg-type]  # which is not among the server's
    assert not made.waiting


def test_who_comes_back_sees_what_the_last_one_left(browser: Browser) -> None:
    page = Page(studio(), subject(), resolution=64, host="127.0.0.1", port=0)
    with closing(page):
        page._server.get_clients = lambda: {1: browser, 2: browser}  # type: ignore[method-assign, assignment, dict-item]
        page._welcome(browser)  # type: ignore[arg-type]
        first = page._visitors[1]
        start = first.wish
        first._panel.set_v([0.25] * 7)
        panel = first._panel
        panel._show.value, panel._resolution.value = "error", "128"
        panel._curve.value, panel._exposure.value = "filmic", 1.5
        page._leave(browser)  # type: ignore[arg-type]
        browser.client_id = 2
        page._welcome(browser)  # type: ignore[arg-type]
        again = page._visitors[2]
        assert [*page._visitors] == [2]
        assert again.wish == Wish(Place((0.25,) * 7, 128), Screen("error", "filmic", 1.5))
        assert page._studio._browsers[2].session.wish == again.wish
        again._panel.reset()
        assert again.wish == start


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
    browser.camera.image_width = parts * browser.camera.image_height
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


def test_pictures_are_one_below_the_other_in_a_window_that_is_tall(browser: Browser) -> None:
    made = visitor(browser)
    screen = Screen("network | path tracer | error")
    renderer = AnalyticRenderer(dimensions=7, patch_size=16)
    view = SceneView(Place((0.5,) * 7, SIZE), renderer, coloured)
    shown = Shown(screen.pixels(view), view, Wish(view.place, screen), full=True)
    browser.camera.image_width = browser.camera.image_height // 3
    made.show(shown)
    ((tall, _),) = browser.shown
    assert 3 * SIZE < tall.shape[0] < 4 * SIZE
    for column, picture in enumerate(np.split(shown.pixels, 3, axis=1)):
        found = match_template(tall.mean(-1), picture.mean(-1))
        assert found.max() > 0.999
        assert np.unravel_index(found.argmax(), found.shape)[0] // SIZE == column
    browser.camera.image_width = 2 * browser.camera.image_height  # it is made wide again
    made._refit(browser.camera)  # type: ignore[arg-type]
    assert browser.shown[-1][0].shape[0] < 2 * SIZE


def test_a_windows_strip_gets_a_picture_all_the_same(browser: Browser) -> None:
    made = visitor(browser)
    view = SceneView(Place((0.5,) * 7, 64), AnalyticRenderer(dimensions=7, patch_size=16), coloured)
    shown = Shown(Screen().pixels(view), view, Wish(view.place, Screen()), full=True)
    for width, height in ((1400, 1), (1400, 0), (0, 900)):
        browser.camera.image_width, browser.camera.image_height = width, height
        made.show(shown)
        assert max(browser.shown[-1][0].shape) <= 8 * 64


def test_the_radiance_of_a_buffers_picture_is_made_where_pictures_are(browser: Browser) -> None:
    made_in: list[int] = []

    def predict(buffers: torch.Tensor, v: torch.Tensor, *, preview: bool) -> torch.Tensor:
        made_in.append(get_ident())
        return coloured(buffers, v, preview=preview)

    renderer = AnalyticRenderer(dimensions=7, patch_size=16)
    about = Studio(renderer=renderer, predict=predict)
    made = Visitor(browser, subject(), about, resolution=64)  # type: ignore[arg-type]
    made._panel._show.value = "albedo"
    view, screen = about.view(made.wish.place), made.wish.screen
    made.show(Shown(screen.pixels(view), view, Wish(view.place, screen), full=True))
    asking = Thread(target=lambda: press(made, "radiance (EXR)"))
    asking.start()
    asking.join()
    assert made_in == [*browser.files] == []
    assert about.work(wait=0)
    assert made_in == [get_ident()]
    assert [*browser.files] == ["picture.exr"]


@pytest.mark.parametrize(("show", "shown"), [("network", 0), ("network | path tracer", 1)])
def test_what_is_saved_while_a_preview_is_shown_is_whole(
    browser: Browser, monkeypatch: pytest.MonkeyPatch, show: str, shown: int
) -> None:
    written: list[torch.Tensor] = []
    monkeypatch.setattr(
        "ngi.view.visitor.write_exr",
        lambda path, radiance: (written.append(radiance), path.write_bytes(b"EXR")),
    )
    about = studio()
    made = Visitor(browser, subject(), about, resolution=64)  # type: ignore[arg-type]
    made._panel._show.value = show
    coarse = SceneView(Place(tuple(START), 16, rays=3), about._renderer, coloured)
    made.show(Shown(made.wish.screen.pixels(coarse), coarse, made.wish, full=False))
    for label in ("picture (PNG)", "radiance (EXR)"):
        press(made, label)
        assert about.work(wait=0)
    whole = SceneView(Place(tuple(START), 64), about._renderer, coloured)
    picture = Image.open(BytesIO(browser.files["picture.png"]))
    np.testing.assert_array_equal(np.asarray(picture), Screen(show).pixels(whole))
    torch.testing.assert_close(written, [whole.prediction])
    words = shlex.split(picture.info["command"])
    assert words[:3] == ["ngi", "render", "run=run"]
    assert words[4:] == ["resolution=64", *shown * ["reference=8"], "out=picture.png"]
    options = read_options(PictureOptions, "ngi render", words[2:])
    assert options.v == pytest.approx(START)


def test_a_saved_picture_of_a_buffer_names_no_command(browser: Browser) -> None:
    about = studio()
    made = Visitor(browser, subject(), about, resolution=64)  # type: ignore[arg-type]
    made._panel._show.value = "albedo"
    press(made, "picture (PNG)")
    assert about.work(wait=0)
    assert "command" not in Image.open(BytesIO(browser.files["picture.png"])).info


def test_why_there_is_no_file_stays_whatever_is_shown_next(
    browser: Browser, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr("ngi.view.visitor.write_exr", full)
    about = studio()
    made = Visitor(browser, subject(), about, resolution=64)  # type: ignore[arg-type]
    press(made, "radiance (EXR)")
    assert about.work(wait=0)
    assert browser.notified == [("This file cannot be made", "no space left")]


@pytest.mark.parametrize("full", [False, True])
def test_metrics_are_of_whole_pictures_alone(browser: Browser, full: bool) -> None:
    made = visitor(browser)
    made._panel._show.value = "error"
    view = SceneView(made.wish.place, AnalyticRenderer(dimensions=7, patch_size=16), coloured)
    made.show(Shown(made.wish.screen.pixels(view), view, made.wish, full=full))
    assert ("MAPE" in made._panel._status.content) == full


def press(made: Visitor, label: str) -> None:
    handles = made._client.gui._gui_input_handle_from_uuid.values()
    (button,) = (each for each in handles if getattr(each, "label", None) == label)
    for react in button._impl.update_cb:
        react(None)


def test_the_command_makes_what_is_seen(browser: Browser) -> None:
    assert set(shlex.split(visitor(browser)._command_line())[4:]) == {
        "resolution=64", "out=picture.png",
    }  # fmt: skip
    about = replace(subject(), scene="their scene", supersampled_edges=True)
    made = Visitor(browser, about, studio(), resolution=64)  # type: ignore[arg-type]
    made._panel._exposure.value = 1.5
    made._panel._curve.value = "filmic"
    words = shlex.split(made._command_line())
    assert words[:3] == ["ngi", "render", "run=run"]
    assert set(words[4:]) == {
        "resolution=64", "scene=their scene", "exposure=1.5", "tone_mapping=filmic",
        "supersampled_edges=true", "out=picture.png",
    }  # fmt: skip
    options = read_options(PictureOptions, "ngi render", words[2:])
    assert options.v == pytest.approx(START)
    assert options.supersampled_edges


@pytest.mark.parametrize(
    ("show", "sizes", "references"),
    [
        ("network", [64], []),
        ("path tracer", [64], ["reference=16"]),
        ("network | path tracer | error", [64], ["reference=16"]),
        ("error", [32], ["reference=8"]),  # which is a preview
        ("error", [], ["reference=8"]),
    ],
)
def test_the_command_traces_as_many_paths_as_are_seen(
    browser: Browser, show: str, sizes: list[int], references: list[str]
) -> None:
    made = visitor(browser)
    made._panel._show.value = show
    for size in sizes:
        place = Place(tuple(START), size)
        view = SceneView(place, AnalyticRenderer(dimensions=7, patch_size=16), coloured)
        for _ in range(3):
            view.trace()
        made.show(Shown(made.wish.screen.pixels(view), view, Wish(place, made.wish.screen), True))
    words = shlex.split(command(made))
    assert [word for word in words if word.startswith("reference=")] == references


def test_no_command_makes_the_picture_of_a_buffer(browser: Browser) -> None:
    made = visitor(browser)
    made._panel._show.value = "albedo"
    assert command(made) == "ngi render does not render buffers"


def command(made: Visitor) -> str:
    """What is selected as the command, without its markup."""
    code = ElementTree.fromstring(made._command.content).find("code")
    assert code is not None
    assert code.text is not None
    return code.text


def test_the_command_has_v_to_the_last_bit_and_markup_is_text(browser: Browser) -> None:
    made = Visitor(browser, replace(subject(), scene="<b>&a"), studio(), resolution=64)  # type: ignore[arg-type]
    v = np.random.default_rng(0).random(7).tolist()
    made._panel.set_v(v)
    words = shlex.split(command(made))
    options = read_options(PictureOptions, "ngi render", words[2:])
    assert torch.tensor(options.v).equal(torch.tensor(v))
    assert options.scene == "<b>&a"


def test_the_command_stays_as_it_is_while_paths_are_added(browser: Browser) -> None:
    """What is selected in it would be lost."""
    made = visitor(browser)
    made._panel._show.value = "path tracer"
    view = SceneView(made.wish.place, AnalyticRenderer(dimensions=7, patch_size=16), coloured)
    seen = []
    for _ in range(9):
        view.trace()
        made.show(Shown(made.wish.screen.pixels(view), view, made.wish, full=True))
        seen.append(re.findall(r"reference=(\d+)", command(made)))
    assert seen == [[str(samples)] for samples in (8, 16, 16, 32, 32, 32, 32, 64, 64)]


def test_the_runs_folder_is_said_in_full_where_it_wraps(browser: Browser) -> None:
    folder = Path(*(f"<{20 * letter}>" for letter in "abcdef"))
    about = replace(subject(), folder=folder)
    Visitor(browser, about, studio(), resolution=64)  # type: ignore[arg-type]
    buffer = browser.gui._websock_interface.get_message_buffer().message_from_id.values()
    said = [m.props.content for m in buffer if isinstance(m, GuiHtmlMessage)]
    assert any(
        html.unescape(each).endswith(f">{folder}</div>") and "overflow-wrap: anywhere" in each
        for each in said
    )


def test_what_it_says_takes_the_same_room_and_is_no_markup(browser: Browser) -> None:
    """A click that falls while a button moves is lost."""
    made = visitor(browser)
    said = []
    for error in (RuntimeError("<b>1</b>"), RuntimeError()):
        made.failed(error)
        said.append(made._panel._status.content)
    assert "&lt;b&gt;1&lt;/b&gt;" in said[0]
    assert "This failed: RuntimeError" in said[1]
    assert all("height: 9.8em" in each for each in said)


def test_metrics_come_before_the_times_which_may_have_to_be_scrolled_to(browser: Browser) -> None:
    made = visitor(browser)
    made._panel._show.value = "network | path tracer"
    view = SceneView(made.wish.place, AnalyticRenderer(dimensions=7, patch_size=16), coloured)
    view.trace()
    size, metrics, times, *_ = made._status(
        Shown(made.wish.screen.pixels(view), view, made.wish, full=True), sending=0.0
    )
    assert size.endswith(f" pixels, {PASS_SAMPLES} samples per pixel")
    assert metrics.startswith("MAPE")
    assert " ms" in times


def test_where_reset_view_leads_is_where_a_page_begins() -> None:
    page = Page(studio(), subject(), resolution=64, host="127.0.0.1", port=0)
    with closing(page):
        camera = subject().camera
        assert camera is not None
        first = page._server.initial_camera
        np.testing.assert_allclose((first.position, first.look_at), camera.view(START))


def test_pictures_too_small_for_the_metrics_are_shown_without(browser: Browser) -> None:
    for side, said in ((8, "metrics need at least 11 pixels a side"), (16, "MAPE")):
        picture = torch.rand(side, side, 3, generator=torch.Generator().manual_seed(0))
        view: Any = SimpleNamespace(prediction=picture, reference=picture / 2, noise=None)
        shown: Any = SimpleNamespace(view=view)
        assert visitor(browser)._metrics(shown).startswith(said)


@pytest.mark.parametrize("passes", [1, 2, 7, 8])
def test_the_noise_said_is_how_far_the_path_traced_picture_is_off(
    browser: Browser, passes: int
) -> None:
    made = visitor(browser)
    made._panel._show.value = "error"
    noisy = AnalyticRenderer(dimensions=7, patch_size=16, noise=0.5)
    view = SceneView(made.wish.place, noisy, coloured)
    for _ in range(passes):
        view.trace()
    truth = AnalyticRenderer(dimensions=7, patch_size=16).render_image(
        view.place.tensor(), resolution=64, samples_per_pixel=1, seed=0
    )
    metrics = made._metrics(Shown(made.wish.screen.pixels(view), view, made.wish, full=True))
    found = re.match(r"MAPE [\d.]+ \(path tracer's noise about ([\d.]+)\), DSSIM", metrics)
    if passes == 1:
        assert found is None
        return
    assert found is not None
    assert float(found[1]) == pytest.approx(mape(view.reference, truth, 0.01), rel=0.1)
