"""The sliders, switches and menus of one browser."""

import html
import json
import random
from collections import deque
from collections.abc import Callable, Sequence
from itertools import groupby
from threading import RLock
from time import time
from typing import Any

import viser

from ngi.evaluate.pictures import ERROR_RANGE, error_colours
from ngi.view.inputs import Control, Input, Picker, inputs
from ngi.view.scene_view import Place
from ngi.view.screen import CURVES, PARTS, Screen

RESOLUTIONS = ("64", "128", "256", "384", "512", "768", "900")
CHOOSE = "choose …"
STATUS = "height: 9.8em; overflow-y: auto; padding: 0 1em; font-size: 0.85em; line-height: 1.4"
"""Of what is said, seven lines of it: a click that falls while a button moves is lost."""
MOST_STEPS_BACK = 50
MOST_SLIDERS = 200
"""More variables than that are set by presets alone: a browser draws every slider."""


class Panel:
    """What v and the screen are, as a browser has set them.

    controls: of every component of v
    v: at first
    presets: configurations by name, each of length D
    buffers: names of those that can be shown
    on_change: called, in a thread of the browser's that holds `lock`, after anything was changed

    `lock` is held while v changes; `touched` is when a slider or a setting was last used, in
    seconds of `time.time()`.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        *,
        controls: Sequence[Control],
        v: Sequence[float],
        presets: dict[str, Sequence[float]],
        buffers: Sequence[str],
        resolution: int,
        epsilon: float,
        on_change: Callable[[], None],
    ) -> None:
        self.lock = RLock()
        self.touched = 0.0
        self._gui = gui
        self._v = [float(number) for number in v]
        self._start = tuple(self._v)
        self._presets = presets
        self._epsilon = epsilon
        self._on_change = on_change
        self._inputs: list[tuple[Input, Any]] = []
        self._before: deque[list[float]] = deque(maxlen=MOST_STEPS_BACK)
        self._status = gui.add_html("")
        self.say(["…"])
        self._error_scale = gui.add_image(
            error_colours(256, 12),
            label=f"|error| / (reference + {epsilon:g}), from 0 to {ERROR_RANGE:g} and above",
            visible=False,
        )
        self._add_presets()
        self._add_screen(buffers, resolution)
        self._add_inputs(controls)

    def say(self, lines: Sequence[str]) -> None:
        """Shows text above the controls, which keep their places however much it is."""
        text = "<br>".join(html.escape(line) for line in lines)
        self._status.content = f'<div style="{STATUS}">{text}</div>'

    @property
    def v(self) -> tuple[float, ...]:
        return tuple(self._v)

    @property
    def screen(self) -> Screen:
        return Screen(
            show=self._show.value,
            curve=self._curve.value,
            exposure=float(self._exposure.value),
            epsilon=self._epsilon,
        )

    @property
    def resolution(self) -> int:
        return int(self._resolution.value)

    def set_v(self, v: Sequence[float]) -> None:
        """Moves every control there."""
        with self.lock:
            self._v = [float(number) for number in v]
            for each, made in self._inputs:
                made.value = each.shown(self._v)
            self._on_change()

    def jump(self, v: Sequence[float]) -> None:
        """As `set_v`, and `back` leads to where v was."""
        with self.lock:
            self._before.append(self._v)
            self.set_v(v)

    def back(self) -> None:
        """To where v was before the last jump that is not undone yet; nothing where there is none.

        The last `MOST_STEPS_BACK` are known.
        """
        with self.lock:
            if self._before:
                self.set_v(self._before.pop())

    def reset(self) -> None:
        """Everything as it was at first."""
        for each, value in self._at_first:
            each.value = value
        self.jump(self._start)

    def restore(self, place: Place, screen: Screen) -> None:
        """As another browser's panel of the same page was."""
        wanted = (screen.show, str(place.resolution), screen.curve, screen.exposure)
        for (each, _), value in zip(self._at_first, wanted, strict=True):
            each.value = value
        self.set_v(place.v)

    def load(self, content: bytes) -> None:
        """A configuration that `saved` gave; ValueError for anything else."""
        try:
            v = [float(number) for number in json.loads(content)["v"]]
        except (ValueError, TypeError, KeyError) as error:
            raise ValueError('expected a JSON file with {"v": [numbers]}') from error
        if len(v) != len(self._v) or not all(0 <= number <= 1 for number in v):
            raise ValueError(f"v has to be {len(self._v)} numbers from 0 to 1")
        self.jump(v)

    def saved(self) -> bytes:
        """The configuration as a file's content."""
        return json.dumps({"v": self._v}).encode()

    def _add_presets(self) -> None:
        menu: Any = self._gui.add_dropdown("configuration", (CHOOSE, *self._presets))
        anywhere = self._gui.add_button("random configuration")
        hint = "to v before the last preset, random configuration, file or reset"
        back = self._gui.add_button("back", hint=hint)
        reset = self._gui.add_button("reset", hint="restore the initial v and settings")

        @menu.on_update  # type: ignore[untyped-decorator]
        def _(_: object) -> None:
            if menu.value != CHOOSE:
                self.jump(self._presets[menu.value])
                menu.value = CHOOSE  # so that the same can be chosen again

        @anywhere.on_click
        def _(_: object) -> None:
            self.jump([random.random() for _ in self._v])

        back.on_click(lambda _: self.back())
        reset.on_click(lambda _: self.reset())

    def _add_screen(self, buffers: Sequence[str], resolution: int) -> None:
        sizes = sorted({*RESOLUTIONS, str(resolution)}, key=int)
        with self._gui.add_folder("Picture"):
            self._show = self._gui.add_dropdown("show", (*PARTS, *buffers))
            self._resolution = self._gui.add_dropdown(
                "pixels a side", sizes, initial_value=str(resolution)
            )
            self._curve = self._gui.add_dropdown("tone mapping", CURVES)
            self._exposure = self._gui.add_slider(
                "exposure, stops", -8.0, 8.0, 0.25, 0.0, marks=(), hint="from -8 to 8"
            )

        @self._show.on_update
        def _(_: object) -> None:
            self._error_scale.visible = "error" in self.screen.parts

        settings: list[Any] = [self._show, self._resolution, self._curve, self._exposure]
        self._at_first = [(each, each.value) for each in settings]
        for each in settings:
            each.on_update(lambda _: self._used())

    def _add_inputs(self, controls: Sequence[Control]) -> None:
        if len(controls) > MOST_SLIDERS:
            self._gui.add_markdown(f"{len(controls)} variables, too many for sliders: use presets")
            return
        for group, members in groupby(inputs(controls), key=lambda each: each.group):
            with self._gui.add_folder(group):
                for each in members:
                    made = each.add(self._gui, self._v)
                    made.on_update(lambda _, each=each, made=made: self._read(each, made))
                    self._inputs.append((each, made))

    def _read(self, changed: Input, made: Any) -> None:
        """Takes over what a user has set; what `set_v` has set says nothing new."""
        with self.lock:
            value = made.value
            if value == changed.shown(self._v):
                return
            for component, number in changed.components(value).items():
                self._v[component] = number
            if isinstance(changed, Picker):  # brought into the range
                made.value = changed.shown(self._v)
            self._used()

    def _used(self) -> None:
        with self.lock:
            self.touched = time()
            self._on_change()
