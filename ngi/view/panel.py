"""The sliders, switches and menus of one browser."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable, Sequence
from itertools import groupby
from typing import Any

import viser

from ngi.evaluate.pictures import ERROR_RANGE, error_colours
from ngi.scene.kinds import Visibility
from ngi.view.controls import Control
from ngi.view.screen import PARTS, Screen
from ngi.view.tone import CURVES

RESOLUTIONS = ("64", "128", "256", "384", "512", "768", "900")
STEPS = 500
"""Of a slider from one end to the other, at least."""
CHOOSE = "choose …"
MOST_SLIDERS = 200
"""More variables than that are set by presets alone: a browser draws every slider."""


class Panel:
    """What v and the screen are, as a browser has set them.

    controls: of every component of v
    v: at first
    presets: configurations by name, each of length D
    buffers: names of those that can be shown
    on_change: called, in a thread of the browser's, after anything was changed
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
        self._gui = gui
        self._controls = controls
        self._v = [float(number) for number in v]
        self._presets = presets
        self._epsilon = epsilon
        self._on_change = on_change
        self._inputs: dict[int, Any] = {}
        self.status = gui.add_markdown("…")
        self._error_scale = gui.add_image(
            error_colours(256, 12),
            label=f"|error| / (reference + {epsilon:g}), from 0 to {ERROR_RANGE:g} and above",
            visible=False,
        )
        self._add_presets()
        self._add_screen(buffers, resolution)
        self._add_controls()

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
        self._v = [float(number) for number in v]
        for control in self._controls:
            self._move(control)
        self._on_change()

    def load(self, content: bytes) -> None:
        """A configuration that `saved` gave; ValueError for anything else."""
        try:
            v = [float(number) for number in json.loads(content)["v"]]
        except (ValueError, TypeError, KeyError) as error:
            raise ValueError('expected a JSON file with {"v": [numbers]}') from error
        if len(v) != len(self._v) or not all(0 <= number <= 1 for number in v):
            raise ValueError(f"v has to be {len(self._v)} numbers from 0 to 1")
        self.set_v(v)

    def saved(self) -> bytes:
        """The configuration as a file's content."""
        return json.dumps({"v": self._v}).encode()

    def _add_presets(self) -> None:
        menu: Any = self._gui.add_dropdown("configuration", (CHOOSE, *self._presets))
        anywhere = self._gui.add_button("random configuration")

        @menu.on_update
        def _(_: object) -> None:
            if menu.value != CHOOSE:
                self.set_v(self._presets[menu.value])
                menu.value = CHOOSE  # so that the same can be chosen again

        @anywhere.on_click
        def _(_: object) -> None:
            self.set_v([random.random() for _ in self._v])

    def _add_screen(self, buffers: Sequence[str], resolution: int) -> None:
        sizes = sorted({*RESOLUTIONS, str(resolution)}, key=int)
        with self._gui.add_folder("Picture"):
            self._show = self._gui.add_dropdown("show", (*PARTS, *buffers))
            self._resolution = self._gui.add_dropdown(
                "pixels a side", sizes, initial_value=str(resolution)
            )
            self._curve = self._gui.add_dropdown("tone mapping", CURVES)
            self._exposure = self._gui.add_slider("exposure, stops", -8.0, 8.0, 0.25, 0.0)

        @self._show.on_update
        def _(_: object) -> None:
            self._error_scale.visible = "error" in self.screen.parts

        for each in (self._show, self._resolution, self._curve, self._exposure):
            each.on_update(lambda _: self._on_change())

    def _add_controls(self) -> None:
        if len(self._controls) > MOST_SLIDERS:
            self._gui.add_markdown(f"{len(self._controls)} variables: too many for sliders")
            return
        for group, members in groupby(self._controls, key=lambda control: control.group):
            with self._gui.add_folder(group):
                for control in members:
                    self._add(control)

    def _add(self, control: Control) -> None:
        component = self._v[control.component]
        if control.choices == Visibility.choices:
            made: Any = self._gui.add_checkbox(
                control.name, control.choice(component) == control.choices[1]
            )
        elif control.choices:
            made = self._gui.add_dropdown(
                control.name, control.choices, initial_value=control.choice(component)
            )
        else:
            made = self._gui.add_slider(
                control.name,
                control.low,
                control.high,
                10.0 ** -_digits(control),
                self._as_shown(control),
            )
        self._inputs[control.component] = made
        made.on_update(lambda _: self._read(control))

    def _read(self, control: Control) -> None:
        """Takes over what a user has set; what `_move` has set says nothing new."""
        shown = self._inputs[control.component].value
        if shown == self._as_shown(control):
            return
        if not control.choices:
            self._v[control.component] = control.of_value(shown)
        elif isinstance(shown, bool):
            self._v[control.component] = control.of_choice(control.choices[shown])
        else:
            self._v[control.component] = control.of_choice(shown)
        self._on_change()

    def _move(self, control: Control) -> None:
        if control.component in self._inputs:
            self._inputs[control.component].value = self._as_shown(control)

    def _as_shown(self, control: Control) -> float | str | bool:
        component = self._v[control.component]
        if not control.choices:
            rounded = round(control.value(component), _digits(control))
            return min(max(rounded, control.low), control.high)
        choice = control.choice(component)
        is_switch = isinstance(self._inputs[control.component].value, bool)
        return choice == control.choices[1] if is_switch else choice


def _digits(control: Control) -> int:
    """After the decimal point, so that a slider has at least `STEPS` values."""
    return -math.floor(math.log10((control.high - control.low) / STEPS))
