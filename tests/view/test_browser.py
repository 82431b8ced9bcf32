"""The viewer in a real browser, on a run of closed formulas."""

import contextlib
import shlex
import shutil
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic, sleep

import numpy as np
import pytest
from PIL import Image

from ngi.view.picture import main as render
from tests.learn.command_line import environment, run
from tests.warm import start_module

playwright = pytest.importorskip(
    "playwright.sync_api", reason="browser tests need pip install -e .[viewer,dev]"
)
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
if CHROMIUM is None:
    pytest.skip("browser tests need Chromium: apt-get install chromium", allow_module_level=True)

DRAW_SELDOM = "requestAnimationFrame = draw => setTimeout(() => draw(performance.now()), 100)"
"""Ten pictures a second: software that draws as many as it can leaves no time for the rest."""
OPTIONS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"]
OPTIONS += ["--enable-unsafe-swiftshader"]
WALKED = """
name: room
scene: scene.xml
samples_per_pixel: 4
max_depth: 4
bounds: {minimum: [-1, 0, -1], maximum: [1, 2, 1]}
variables:
  - object: camera
    property: look_at
    minimum: [-1, 0.5, 3, 0, 1, 0]
    maximum: [1, 1.5, 4, 0, 1, 0]
  - {object: lamp, property: intensity, minimum: 0.5, maximum: 2}
"""
TINY = ("budget=smoke", "budget.steps=1", "evaluation.evaluator.protocol.low_discrepancy_frames=1")
PATIENCE = 120_000
"""Milliseconds; WebGL by software is slow on a busy machine."""


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("trained")
    status, output = run(folder, "run.folder=run")
    assert status == 0, output
    return folder


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@contextmanager
def viewer(folder: Path, port: int, run_folder: str = "run") -> Iterator[str]:
    process = start_module(
        "ngi.view",
        *(f"run={run_folder}", f"port={port}", "resolution=64"),
        folder=folder,
        environment=environment(folder),
        output=folder / f"viewer-{port}.log",
    )
    try:
        deadline = monotonic() + 120
        while monotonic() < deadline:
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    break
            assert process.is_alive(), "the viewer has ended"
            sleep(0.2)
        yield f"http://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.join(timeout=60)


@pytest.fixture(scope="module")
def started() -> Iterator[playwright.Browser]:
    with playwright.sync_playwright() as tools:
        started = tools.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        yield started
        started.close()


@pytest.fixture
def browser(started: playwright.Browser) -> Iterator[playwright.Browser]:
    yield started
    for context in started.contexts:  # a page that is left open goes on drawing
        context.close()


def opened(browser: playwright.Browser, address: str) -> playwright.Page:
    page = browser.new_page(viewport={"width": 1000, "height": 600}, accept_downloads=True)
    page.set_default_timeout(PATIENCE)
    page.add_init_script(DRAW_SELDOM)
    page.goto(address)
    page.get_by_text("64 × 64 pixels").wait_for()
    return page


def saved(page: playwright.Page, button: str) -> Path:
    if not page.get_by_role("button", name=button).is_visible():
        page.get_by_text("Files").click()
    with page.expect_download() as download:
        page.get_by_role("button", name=button).click()
    return Path(download.value.path())


def picture(page: playwright.Page) -> np.ndarray:
    return np.asarray(Image.open(saved(page, "picture (PNG)")))


def command(page: playwright.Page) -> str:
    """The command line that the page shows."""
    shown = page.locator("code", has_text="ngi ").text_content()
    assert shown is not None
    return shown


def set_slider(page: playwright.Page, number: int, value: float) -> None:
    """Types it; the first slider is the exposure."""
    field = page.locator("input.mantine-NumberInput-input").nth(number)
    field.fill(f"{value}")
    field.press("Enter")


def wait_until_changed(page: playwright.Page, before: np.ndarray) -> np.ndarray:
    deadline = monotonic() + PATIENCE / 1000
    while monotonic() < deadline:
        now = picture(page)
        if now.shape == before.shape and (now != before).any():
            return now
        sleep(0.1)
    pytest.fail("the picture has not changed")


def rendered(folder: Path, options: list[str]) -> np.ndarray:
    out = folder / "expected.png"
    with contextlib.chdir(folder):
        assert render([*options, f"out={out}"]) == 0
    return np.asarray(Image.open(out))


def test_the_page_shows_what_is_computed_without_it(
    trained: Path, browser: playwright.Browser
) -> None:
    with viewer(trained, free_port()) as address:
        page = opened(browser, address)
        first = picture(page)
        np.testing.assert_array_equal(
            first, rendered(trained, ["run=run", "hard_frame=0", "resolution=64"])
        )
        # what the window shows is that picture, enlarged
        page.wait_for_timeout(1000)
        box = page.locator("canvas").first.bounding_box()
        assert box is not None
        side = min(box["width"], box["height"])
        left, top = (box["width"] - side) / 2, (box["height"] - side) / 2
        square = {"x": left, "y": top, "width": side, "height": side}
        page.screenshot(clip=square, path=trained / "screen.png")
        window = Image.open(trained / "screen.png").convert("RGB")
        small = np.asarray(window.resize((16, 16), Image.Resampling.BOX), dtype=float)
        wanted = Image.fromarray(first).resize((16, 16), Image.Resampling.BOX)
        # without the first rows, where the browser says that it has no GPU
        assert np.abs(small - np.asarray(wanted, dtype=float))[6:].mean() < 3
        # every slider moves it
        before = first
        for number in (1, 2, 3):
            set_slider(page, number, 0.05 * number)
            before = wait_until_changed(page, before)
        options = shlex.split(command(page))[2:-1]
        assert "v=[0.05,0.1,0.15]" in options
        page.wait_for_timeout(1000)
        np.testing.assert_array_equal(picture(page), rendered(trained, options))
        page.context.grant_permissions(["clipboard-read", "clipboard-write"])
        page.get_by_role("button", name="copy").click()
        assert page.evaluate("navigator.clipboard.readText()") == command(page)
        page.locator("code", has_text="ngi ").click()
        assert page.evaluate("getSelection().toString()").strip() == command(page)
        set_slider(page, 0, 2)
        brighter = wait_until_changed(page, before)
        assert brighter.mean() > before.mean()


def test_the_mouse_walks_the_camera_within_its_box(
    tmp_path: Path, browser: playwright.Browser
) -> None:
    scene = tmp_path / "scenes" / "room"
    shutil.copytree(Path(__file__).parents[1] / "render" / "scenes" / "box", scene)
    (scene / "scene.yaml").write_text(WALKED)
    status, output = run(tmp_path, "run.folder=run", "scene=room", base=TINY)
    assert status == 0, output
    with viewer(tmp_path, free_port()) as address:
        page = opened(browser, address)
        page.wait_for_timeout(2000)
        before, start = picture(page), walked(page)
        box = page.locator("canvas").first.bounding_box()
        assert box is not None
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"], box["y"] + box["height"] / 2, steps=5)
        page.mouse.up()
        wait_until_changed(page, before)
        page.wait_for_timeout(2000)  # until nothing moves any more
        end = walked(page)
        assert end[:-1] != start[:-1]
        assert end[-1] == start[-1]  # the lamp, which the mouse does not move
        assert all(0 <= component <= 1 for component in end)
        options = shlex.split(command(page))[2:-1]
        np.testing.assert_array_equal(picture(page), rendered(tmp_path, options))
        page.get_by_role("button", name="reset").click()
        page.wait_for_timeout(2000)
        assert walked(page) == start  # which no message of the browser's had changed
        lamp = page.get_by_role("slider").last
        lamp.focus()
        for wait in (600, *10 * (30,)):  # as a keyboard that repeats a key
            page.keyboard.down("ArrowRight")
            page.wait_for_timeout(wait)
        page.keyboard.up("ArrowRight")
        page.wait_for_timeout(2000)
        assert walked(page)[-1] != start[-1]
        assert walked(page)[:-1] == start[:-1]  # viser turns the camera by these keys


def walked(page: playwright.Page) -> list[float]:
    """v, as the page's command line has it."""
    (v,) = [word for word in shlex.split(command(page)) if word.startswith("v=")]
    return [float(number) for number in v[3:-1].split(",")]


def test_two_browsers_and_a_configuration_that_is_saved_and_loaded(
    trained: Path, browser: playwright.Browser
) -> None:
    with viewer(trained, free_port()) as address:
        ours, theirs = opened(browser, address), opened(browser, address)
        start = picture(theirs)
        set_slider(ours, 1, 0.9)
        changed = wait_until_changed(ours, start)
        np.testing.assert_array_equal(picture(theirs), start)
        file = saved(ours, "save v").read_bytes()
        for content, accepted in ((b'{"v": [2, 0, 0]}', False), (file, True)):
            theirs.locator("input[type=file]").set_input_files(
                files=[{"name": "v.json", "mimeType": "application/json", "buffer": content}]
            )
            if not accepted:
                theirs.get_by_text("3 numbers from 0 to 1").wait_for()
        np.testing.assert_array_equal(wait_until_changed(theirs, start), changed)


def test_a_page_that_is_opened_again_shows_what_it_showed(
    trained: Path, browser: playwright.Browser
) -> None:
    with viewer(trained, free_port()) as address:
        page = opened(browser, address)
        start = picture(page)
        set_slider(page, 1, 0.9)
        left = wait_until_changed(page, start)
        page.close()
        np.testing.assert_array_equal(picture(opened(browser, address)), left)


def test_a_lost_connection_comes_back(trained: Path, browser: playwright.Browser) -> None:
    port = free_port()
    with viewer(trained, port) as address:
        page = opened(browser, address)
        start = picture(page)
        set_slider(page, 1, 0.9)
        wait_until_changed(page, start)
    page.set_default_timeout(5_000)  # a page without connection gives no picture
    with viewer(trained, port):
        deadline = monotonic() + PATIENCE / 1000
        while monotonic() < deadline:
            try:
                if (picture(page) == start).all():  # of the new viewer, which starts afresh
                    return
            except playwright.TimeoutError:
                continue  # not connected yet
        pytest.fail("the page has not connected again")
