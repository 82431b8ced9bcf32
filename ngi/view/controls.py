"""What a user moves: a slider, switch or choice per component of v, in the scene's units."""

from __future__ import annotations

from dataclasses import dataclass

from ngi.scene import SceneDescription, Variable
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
    choices: of a discrete variable, each an equally long part of [0, 1]; else empty
    of_colour: whether it is one of three in a row that are red, green and blue, linear
    """

    group: str
    name: str
    component: int
    low: float = 0.0
    high: float = 1.0
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
            Control(group, name, start + i, low, high, of_colour=of_colour)
            for i, (name, (low, high)) in enumerate(zip(names, limits, strict=True))
        ]
    return [Control(group, name, start + i) for i, name in enumerate(names)]
