"""What a variable is: some components of v, the value they stand for, what it does to a scene.

The kinds of variables are in `ngi.scene.kinds`. They know their components without Mitsuba; `bind`
finds what they change in a loaded scene and returns the function that writes it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any, ClassVar, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from ngi.scene.yaml_keys import YamlKeys

Values = NDArray[np.float64]
Write = Callable[[Values], None]
"""Writes the value of one variable, in the scene's units, to the loaded scene."""


class Placement(Protocol):
    """Where an object of a loaded scene stands; see `ngi.scene.placement`."""

    @property
    def origin(self) -> Values: ...
    @property
    def mirrors(self) -> bool: ...
    def step(self, *, last: bool = False) -> Write: ...
    def switch(self) -> Write: ...
    def place(self, to_world: Values) -> None: ...
    def reshape(self, positions: Values, normals: Values | None) -> None: ...


class Bitmap(Protocol):
    """A bitmap texture of a loaded scene; see `ngi.scene.assets`."""

    shape: tuple[int, ...]

    def load(self, path: Path) -> Values: ...
    def stored(self, linear: Values) -> Values: ...


class LoadedScene(Protocol):
    """What variables may do to a loaded scene; see `ngi.scene.scene_parameters`."""

    def parameter(
        self, object_id: str, suffixes: tuple[str, ...], *, hint: str, of: Sequence[str] = ()
    ) -> str: ...
    def is_made_of(self, object_id: str, classes: Sequence[str]) -> bool: ...
    def read(self, key: str) -> Values: ...
    def write(self, key: str, value: Values) -> None: ...
    def placement(
        self, object_id: str, *, only: Sequence[str] = (), finite: bool = False
    ) -> Placement: ...
    def intensity(self, object_id: str) -> Write: ...
    def radiance(self, object_id: str) -> Write: ...
    def materials(self, object_id: str, bsdfs: Sequence[str]) -> Write: ...
    def bitmap(self, key: str) -> Bitmap: ...
    def mesh(self, object_id: str, path: Path) -> tuple[Values, Values | None]: ...
    def file(self, name: str) -> Path: ...


def in_turn(writes: Sequence[Write]) -> Write:
    """Gives one value to several objects."""

    def write(value: Values) -> None:
        for each in writes:
            each(value)

    return write


@dataclass(frozen=True)
class Variable(ABC):
    """One varying property of one or more objects, which follow it alike.

    objects: ids in scene.xml.
    """

    objects: tuple[str, ...]

    kind: ClassVar[str]
    """The name that YAML and users know it by."""

    affects: ClassVar[frozenset[str]] = frozenset()
    """What of the buffers it can change: position, albedo, roughness, emission; camera: all."""

    @property
    def components(self) -> tuple[str, ...]:
        """Names of its components of v. A single component, as most have, has an empty name."""
        return ("",)

    @abstractmethod
    def value(self, components: Values) -> Values:
        """The value in the scene's units that components in [0, 1] stand for."""

    @abstractmethod
    def bind(self, scene: LoadedScene) -> Write:
        """The function that writes the value; ValueError where the scene has no such object."""

    @classmethod
    @abstractmethod
    def read(cls, objects: tuple[str, ...], keys: YamlKeys) -> Self:
        """From the keys of its entry in scene.yaml; ValueError for what is wrong with them."""

    @property
    @abstractmethod
    def range(self) -> str:
        """What it varies between, for people."""

    @property
    def files(self) -> tuple[str, ...]:
        """Files that it needs beside those that scene.xml names."""
        return ()


@dataclass(frozen=True)
class RangedVariable(Variable):
    """Numbers that vary between a minimum and a maximum.

    A number whose minimum equals its maximum is fixed and takes no component of v.

    minimum, maximum: one number each per entry of `numbers`, in the scene's units.
    linked: one component of v moves all numbers together, along the line between the two.
    """

    minimum: tuple[float, ...]
    maximum: tuple[float, ...]
    linked: bool = False

    numbers: ClassVar[tuple[str, ...]] = ("",)
    unit: ClassVar[str] = ""
    """Of the numbers, 'degrees'; empty for those that have none or the scene's own."""
    limits: ClassVar[tuple[float, float]] = (-inf, inf)

    @property
    def components(self) -> tuple[str, ...]:
        ranges = zip(self.numbers, self.minimum, self.maximum, strict=True)
        varied = tuple(name for name, low, high in ranges if low != high)
        return ("",) if self.linked and varied else varied

    def value(self, components: Values) -> Values:
        """Number by number: minimum + u * (maximum - minimum)."""
        low, high = (np.array(limits, np.float64) for limits in (self.minimum, self.maximum))
        if self.linked:
            return low + components * (high - low)
        value = low.copy()
        value[low != high] += components * (high - low)[low != high]
        return value

    @property
    def range(self) -> str:
        low, high = (
            ", ".join(f"{number:.4g}" for number in end) for end in (self.minimum, self.maximum)
        )
        return f"{low} ... {high}"

    def bind(self, scene: LoadedScene) -> Write:
        return in_turn([self.bind_one(scene, object_id) for object_id in self.objects])

    @abstractmethod
    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        """The function that writes the value to one of the objects."""

    @classmethod
    def read(cls, objects: tuple[str, ...], keys: YamlKeys) -> Self:
        low, high = (keys.numbers(key, length=len(cls.numbers)) for key in ("minimum", "maximum"))
        keys.check_range(low, high)
        for key, values in (("minimum", low), ("maximum", high)):
            if not all(cls.limits[0] <= value <= cls.limits[1] for value in values):
                smallest, largest = cls.limits
                advice = f"{cls.kind} lies between {smallest} and {largest}"
                raise keys.error(key, list(values), advice)
        linked = bool(len(low) > 1 and keys.flag("linked"))
        return cls(objects, low, high, linked, **cls.read_options(objects, keys))

    @classmethod
    def read_options(cls, objects: tuple[str, ...], keys: YamlKeys) -> dict[str, Any]:  # noqa: ARG003
        """The keys that only this kind has."""
        return {}


@dataclass(frozen=True)
class DiscreteVariable(Variable):
    """One of several choices, each for an equally long part of [0, 1].

    choices: what there is to choose from.
    """

    choices: tuple[str, ...]

    def value(self, components: Values) -> Values:
        """[1]: the index min(floor(u * n), n - 1)."""
        return np.minimum(np.floor(components * len(self.choices)), len(self.choices) - 1)

    @property
    def range(self) -> str:
        return " | ".join(self.choices)

    @classmethod
    def read(cls, objects: tuple[str, ...], keys: YamlKeys) -> Self:
        return cls(objects, keys.names("choices", at_least=2))
