"""What a user sets in the panel is what v becomes, and the other way round."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest
from skimage.color import rgb2xyz

viser = pytest.importorskip("viser", reason="needs pip install -e .[viewer]")

from ngi.scene import read_scene, scenes, srgb  # noqa: E402
from ngi.scene.kinds import KINDS  # noqa: E402
from ngi.view.inputs import (  # noqa: E402
    Control,
    Menu,
    Picker,
    Slider,
    Switch,
    _controls,
    controls,
    inputs,
)
from ngi.view.page import viser_server  # noqa: E402
from ngi.view.panel import Panel  # noqa: E402

LAMP = [Control("lamp", f"radiance {c}", i, 2, 22, of_colour=True) for i, c in enumerate("rgb")]


@pytest.fixture(scope="module")
def gui() -> Iterator[viser.GuiApi]:
    server = viser_server(host="127.0.0.1", port=0)
    yield server.gui
    server.stop()


def shipped(name: str) -> tuple[Control, ...]:
    return controls(read_scene(**scenes()[name]))


def panel(gui: viser.GuiApi, of: Sequence[Control], changes: list[int]) -> Panel:
    return Panel(
        gui,
        controls=of,
        v=[0.123456] * len(of),
        presets={"one": [1.0] * len(of)},
        buffers=("albedo",),
        resolution=64,
        epsilon=0.01,
        on_change=lambda: changes.append(1),
    )


def test_the_transfer_curve_is_that_of_scikit_image() -> None:
    encoded = np.linspace(0, 1, 256)
    greys = np.repeat(encoded[:, None, None], 3, axis=2)
    np.testing.assert_allclose(srgb.decoded(encoded), rgb2xyz(greys)[:, 0, 1], atol=1e-5)
    np.testing.assert_allclose(srgb.encoded(srgb.decoded(encoded)), encoded, atol=1e-12)


def test_every_component_has_one_input_of_its_kind() -> None:
    for of in (shipped(name) for name in ("sphere-caustic", "archviz", "living-room")):
        v = np.random.default_rng(0).random(len(of))
        parts = list(inputs(of))
        set_by = [component for part in parts for component in part.components(part.shown(v))]
        assert set_by == list(range(len(of)))
    kinds = [type(part) for part in inputs(shipped("sphere-caustic"))]
    assert kinds == [Picker, Picker, *[Slider] * 6]
    assert {type(part) for part in inputs(shipped("archviz"))} == {Picker, Slider, Menu, Switch}


def test_a_picked_colour_is_the_albedo() -> None:
    picker = next(inputs(shipped("sphere-caustic")))
    assert isinstance(picker, Picker)
    picked = (188, 100, 255)
    components = picker.components(picked)
    values = [0.05 + 0.9 * components[i] for i in range(3)]
    linear = rgb2xyz(np.repeat(np.array(picked)[:, None, None] / 255, 3, axis=2))[:, 0, 1]
    assert values[:2] == pytest.approx(linear[:2], abs=1e-5)
    assert values[2] == pytest.approx(0.95)  # brought into the range
    assert picker.shown([*components.values()])[:2] == picked[:2]


def test_the_colour_of_a_light_is_relative_to_its_brightest() -> None:
    picker = Picker(*LAMP)
    assert picker.shown([1, 1, 1]) == (255, 255, 255)
    assert picker.components((255, 255, 0)) == {0: 1, 1: 1, 2: 0}


def test_a_light_that_becomes_darker_along_v_is_shown_as_it_is() -> None:
    """As scenes of the authors may have it: v = 0 stands for the brightest."""
    falling = [replace(channel, low=channel.high, high=channel.low) for channel in LAMP]
    picker = Picker(*falling)
    assert picker.shown([0, 0, 0]) == (255, 255, 255)
    assert picker.components((255, 255, 255)) == {0: 0, 1: 0, 2: 0}


def test_what_is_set_in_the_panel_is_v(gui: viser.GuiApi) -> None:
    changes: list[int] = []
    made = panel(gui, shipped("sphere-caustic"), changes)
    left, right, slider = (handle for _, handle in made._inputs[:3])
    left.value = (255, 0, 0)
    assert changes == [1]
    assert made.v[:3] == (1, 0, 0)
    assert made.v[3:] == (0.123456,) * 9  # to every digit, though no input shows them
    slider.value = 0.0
    assert made.v[6] == pytest.approx(0.5)
    made.set_v([0.5] * 12)
    assert left.value == right.value == tuple(np.rint(255 * srgb.encoded([0.5] * 3)))
    assert made.v == (0.5,) * 12


def test_a_picker_shows_what_becomes_of_a_colour_out_of_the_range(gui: viser.GuiApi) -> None:
    changes: list[int] = []
    made = panel(gui, shipped("sphere-caustic"), changes)
    picker = made._inputs[0][1]
    picker.value = (255, 100, 0)
    ends = np.rint(255 * srgb.encoded(np.array([0.95, 0.05]))).tolist()
    assert picker.value == (ends[0], 100, ends[1])
    assert (made.v[0], made.v[2]) == (1, 0)
    assert changes == [1]


def test_reset_brings_everything_back(gui: viser.GuiApi) -> None:
    made = panel(gui, shipped("mirror"), [])
    start, screen, pixels = made.v, made.screen, made.resolution
    made.set_v([1.0] * len(start))
    made._show.value, made._curve.value, made._resolution.value = "albedo", "linear", "128"
    made._exposure.value = 2.0
    made.reset()
    assert (made.v, made.screen, made.resolution) == (start, screen, pixels)


def test_the_way_back_leads_over_every_jump_and_ends(gui: viser.GuiApi) -> None:
    made = panel(gui, shipped("mirror"), [])
    start = made.v
    places = [tuple(0.001 * (step + 1) for _ in start) for step in range(60)]
    for place in places:
        made.jump(place)
    walked = (0.75, *places[-1][1:])
    made.set_v(walked)  # as a mouse does, which is no jump
    made.reset()
    made.load(b'{"v": [1' + b", 1" * (len(start) - 1) + b"]}")
    seen = []
    for _ in range(60):
        made.back()
        seen.append(made.v)
    assert seen[:3] == [start, walked, places[-2]]
    assert set(seen[49:]) == {places[11]}  # fifty steps, then no further


@pytest.mark.parametrize("button", ["random configuration", "reset"])
def test_back_brings_v_back(gui: viser.GuiApi, button: str) -> None:
    made = panel(gui, shipped("mirror"), [])
    chosen = tuple(0.5 for _ in made.v)
    made.set_v(chosen)
    press(gui, button)
    assert made.v != chosen
    press(gui, "back")
    assert made.v == chosen


def press(gui: viser.GuiApi, label: str) -> None:
    """The newest of these buttons."""
    handles = gui._gui_input_handle_from_uuid.values()
    *_, button = (each for each in handles if getattr(each, "label", None) == label)
    for react in button._impl.update_cb:
        react(None)  # type: ignore[arg-type]


def test_nothing_stands_where_a_handle_would_cover_it(gui: viser.GuiApi) -> None:
    made = panel(gui, shipped("sphere-caustic"), [])
    sliders = [handle for part, handle in made._inputs if isinstance(part, Slider)]
    for slider in (made._exposure, *sliders):
        assert slider._marks == ()
        assert slider.hint.startswith("from ")


@pytest.mark.parametrize(
    ("kind", "numbers", "unit"),
    [("rotation", 1, " degrees"), ("fov", 1, " degrees"), ("cone", 2, " degrees"),
     ("direction", 2, " degrees"), ("translation", 3, ""), ("scale", 1, "")],
)  # fmt: skip
def test_angles_say_that_they_are_degrees(
    gui: viser.GuiApi, kind: str, numbers: int, unit: str
) -> None:
    variable = KINDS[kind](("it",), minimum=(1.0,) * numbers, maximum=(2.0,) * numbers)  # type: ignore[call-arg]
    hints = [made.add(gui, [0.5] * numbers).hint for made in inputs(_controls(variable, 0))]
    assert hints == numbers * [f"from 1 to 2{unit}"]


def test_a_range_that_falls_has_a_slider(gui: viser.GuiApi) -> None:
    """As scenes of the authors may have: v = 0 stands for the greater value."""
    slider = Slider(Control("door", "angle", 0, 90.0, -30.0))
    handle = slider.add(gui, [0.25])
    assert (handle.min, handle.max, handle.value) == (-30, 90, pytest.approx(60))
    assert handle.step <= 1
    assert slider.components(60.0) == {0: pytest.approx(0.25)}
    assert slider.shown([0.0]) == 90


def test_what_has_no_range_has_a_slider(gui: viser.GuiApi) -> None:
    slider = Slider(Control("camera", "x", 0, 0.0, 5e-324))  # as scenes of the authors may say
    assert slider.add(gui, [0.3]).value == pytest.approx(0.0)
    assert slider.components(0.0) == {0: 0.0}
