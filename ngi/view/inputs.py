"""What a user moves for each part of v: a slider, a switch, a menu, or a colour picker."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser

from ngi.scene import SceneDescription, Variable, srgb
from ngi.scene.kinds import Visibility
from ngi.scene.variable import DiscreteVariable, RangedVariable

COLOUR = ("r", "g", "b")
"""The components of a variable that is a colour."""


@dataclass(frozen=True)
class Control:
    """One component of v.

    group: the objects that follow it
    name: what of them varies
    component: its index in v
    low, high: what 0 and 1 stand for, in the scene's units
    unit: see `RangedVariable.unit`
    choices: of a discrete variable, each an equally long part of [0, 1]; else empty
    of_colour: whether it is one of three in a row that are red, green and blue, linear
    """

    group: str
    name: str
    component: int
    low: float = 0.0
    high: float = 1.0
    unit: str = ""
    choices: tuple[str, ...] = ()
    of_colour: bool = False

    def value(self, component: float) -> float:
        """In the scene's units; component in [0, 1]."""
        return self.low + component * (self.high - self.low)

    def of_value(self, value: float) -> float:
        """The component in [0, 1] that a value in the scene's units stands for."""
        return min(max((value - self.low) / (self.high - self.low), 0.0), 1.0)

    def choice(self, component: float) -> str:
        """What a discrete variable is at a component in [0, 1]."""
        return self.choices[min(int(component * len(self.choices)), len(self.choices) - 1)]

    def of_choice(self, choice: str) -> float:
        """The middle of the part of [0, 1] that stands for a choice."""
        return (self.choices.index(choice) + 0.5) / len(self.choices)


def controls(description: SceneDescription) -> tuple[Control, ...]:
    """A control for every component of v, in order."""
    return tuple(
        control
        for variable, part in description.parts()
        for control in _controls(variable, part.start)
    )


def unnamed_controls(dimensions: int) -> tuple[Control, ...]:
    """For a v whose components have no names, as of closed formulas."""
    return tuple(Control("v", str(index + 1), index) for index in range(dimensions))


def _controls(variable: Variable, start: int) -> list[Control]:
    group = ", ".join(variable.objects)
    names = [f"{variable.kind} {name}".replace("_", " ").strip() for name in variable.components]
    if isinstance(variable, DiscreteVariable):
        return [Control(group, names[0], start, choices=variable.choices)]
    if isinstance(variable, RangedVariable) and not variable.linked:
        ranges = zip(variable.minimum, variable.maximum, strict=True)
        limits = [limit for limit in ranges if limit[0] != limit[1]]
        of_colour = variable.components == COLOUR
        return [
            Control(group, name, start + i, low, high, variable.unit, of_colour=of_colour)
            for i, (name, (low, high)) in enumerate(zip(names, limits, strict=True))
        ]
    return [Control(group, name, start + i) for i, name in enumerate(names)]


STEPS = 500
"""Of a slider from one end to the other, at least."""

NO_WIDTH = 1e-12
"""Least range of a slider, in the variable's units."""


class Input(ABC):
    """Shows some components of v, and says what they are once a user has changed it."""

    @property
    @abstractmethod
    def group(self) -> str:
        """The objects that follow it."""

    @abstractmethod
    def shown(self, v: Sequence[float]) -> Any:
        """The value that stands for v, of length D."""

    @abstractmethod
    def components(self, value: Any) -> dict[int, float]:
        """Components by their index in v that a value stands for."""

    @abstractmethod
    def add(self, gui: viser.GuiApi, v: Sequence[float]) -> Any:
        """Puts it on a page; the handle has a `value` and `on_update`."""


@dataclass(frozen=True)
class _One(Input):
    control: Control

    @property
    def group(self) -> str:
        return self.control.group


class Slider(_One):
    """A number, whose range is said on hover: below the slider its handle would cover it."""

    def shown(self, v: Sequence[float]) -> float:
        value = self.control.value(v[self.control.component])
        low, high = self._ends
        return min(max(round(value, self._digits), low), high)

    def components(self, value: float) -> dict[int, float]:
        return {self.control.component: self.control.of_value(value)}

    def add(self, gui: viser.GuiApi, v: Sequence[float]) -> Any:
        name, (low, high) = self.control.name, self._ends
        step = 10.0**-self._digits
        hint = f"from {low:g} to {high:g} {self.control.unit}".rstrip()
        return gui.add_slider(name, low, high, step, self.shown(v), marks=(), hint=hint)

    @property
    def _ends(self) -> tuple[float, float]:
        """In order: scenes of the paper's authors may have a range that falls."""
        low, high = sorted((self.control.low, self.control.high))
        return low, high

    @property
    def _digits(self) -> int:
        """After the decimal point, so that a slider has at least `STEPS` values.

        Of a component without a range, which scenes of the paper's authors may have, it has one.
        """
        width = max(abs(self.control.high - self.control.low), NO_WIDTH)
        return -math.floor(math.log10(width / STEPS))


class Switch(_One):
    """There or not."""

    def shown(self, v: Sequence[float]) -> bool:
        return self.control.choice(v[self.control.component]) == self.control.choices[1]

    def components(self, value: bool) -> dict[int, float]:
        return {self.control.component: self.control.of_choice(self.control.choices[value])}

    def add(self, gui: viser.GuiApi, v: Sequence[float]) -> Any:
        return gui.add_checkbox(self.control.name, self.shown(v))


class Menu(_One):
    """One of several."""

    def shown(self, v: Sequence[float]) -> str:
        return self.control.choice(v[self.control.component])

    def components(self, value: str) -> dict[int, float]:
        return {self.control.component: self.control.of_choice(value)}

    def add(self, gui: viser.GuiApi, v: Sequence[float]) -> Any:
        choices = self.control.choices
        return gui.add_dropdown(self.control.name, choices, initial_value=self.shown(v))


@dataclass(frozen=True)
class Picker(Input):
    """A colour of three components; of a light, relative to the brightest that it can have.

    A colour out of the range is brought into it, channel by channel.
    """

    red: Control
    green: Control
    blue: Control

    @property
    def group(self) -> str:
        return self.red.group

    def shown(self, v: Sequence[float]) -> tuple[int, ...]:
        linear = [control.value(v[control.component]) for control in self._channels]
        return tuple(
            np.rint(255 * srgb.encoded(np.array(linear) / self._white)).astype(int).tolist()
        )

    def components(self, value: Sequence[int]) -> dict[int, float]:
        linear = self._white * srgb.decoded(np.array(value) / 255)
        channels = zip(self._channels, linear.tolist(), strict=True)
        return {control.component: control.of_value(number) for control, number in channels}

    def add(self, gui: viser.GuiApi, v: Sequence[float]) -> Any:
        name = self.red.name.rpartition(" ")[0]
        ranges = dict.fromkeys(f"{c.low:g} to {c.high:g}" for c in self._channels)
        hint = f"linear r, g, b from {', '.join(ranges)}"
        return gui.add_rgb(name, self.shown(v), hint=hint)  # type: ignore[arg-type]

    @property
    def _channels(self) -> tuple[Control, Control, Control]:
        return self.red, self.green, self.blue

    @property
    def _white(self) -> float:
        """What the brightest colour of a screen stands for."""
        return max(1.0, *(end for one in self._channels for end in (one.low, one.high)))


def inputs(controls: Sequence[Control]) -> Iterator[Input]:
    """In the order of v; one for the three components of a colour."""
    rest = iter(controls)
    for control in rest:
        if control.of_colour:
            yield Picker(control, next(rest), next(rest))
        elif control.choices == Visibility.choices:
            yield Switch(control)
        elif control.choices:
            yield Menu(control)
        else:
            yield Slider(control)
