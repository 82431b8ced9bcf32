"""What of an object can vary: one small class per property, registered by the name YAML uses.

A property knows its components without Mitsuba; `bind` finds the parameters of a loaded scene and
returns the function that writes them. A new property is a new class and one line in `PROPERTIES`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from math import inf
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

Write = Callable[[NDArray[np.float64]], None]
"""Writes the components of one variable, in the scene's units, to the loaded scene."""


class Parameters(Protocol):
    """The parameters of a loaded scene, as `ngi.scene.scene_parameters` offers them."""

    def key(self, object_id: str, suffixes: tuple[str, ...], *, hint: str) -> str:
        """The one parameter of an object that ends with a suffix; ValueError where none does."""
        ...

    def read(self, key: str) -> NDArray[np.float64]: ...

    def write(self, key: str, value: NDArray[np.float64]) -> None: ...


class Property(ABC):
    """One kind of variation; instances hold no state."""

    limits: ClassVar[tuple[float, float]] = (-inf, inf)
    """Smallest and largest value that any component may take."""

    takes_axes: ClassVar[bool] = False
    """Whether the variable names axes, of which each is one component."""

    colour: ClassVar[bool] = False
    """Whether the components are linear RGB; otherwise there is one without a name."""

    def components(self, axes: str | None) -> tuple[str, ...]:
        """Names of the components: x, y, z; r, g, b; or one empty name.

        Raises ValueError for axes that are missing, repeated, out of order or not taken.
        """
        if self.takes_axes:
            if not axes or axes not in ("x", "y", "z", "xy", "xz", "yz", "xyz"):
                raise ValueError(f"axes {axes!r}: name one to three of the axes xyz, in that order")
            return tuple(axes)
        if axes is not None:
            raise ValueError(f"axes {axes!r}: this property takes no axes, remove the key")
        return ("r", "g", "b") if self.colour else ("",)

    @abstractmethod
    def bind(self, parameters: Parameters, object_id: str, axes: str | None) -> Write:
        """The function that writes this property; ValueError where the object does not have it."""


class Albedo(Property):
    """Reflectance of a BSDF, linear RGB; it replaces the authored one, of whichever kind it is."""

    limits = (0.0, 1.0)
    colour = True

    def bind(self, parameters: Parameters, object_id: str, axes: str | None) -> Write:  # noqa: ARG002
        key = parameters.key(
            object_id,
            (
                "base_color.value",
                "diffuse_reflectance.value",
                "specular_reflectance.value",
                "reflectance.value",
            ),
            hint="name a BSDF whose reflectance is given as <rgb>, not as a texture",
        )
        if (count := parameters.read(key).size) != 3:
            raise ValueError(
                f"scene.xml: albedo of '{object_id}': {key} holds {count} number(s) instead of 3; "
                "give the reflectance as <rgb>, not as <spectrum>"
            )
        return lambda value: parameters.write(key, value)


class Roughness(Property):
    """Beckmann or GGX alpha of a rough BSDF; of a `principled` one, its own roughness."""

    limits = (1e-3, 1.0)

    def bind(self, parameters: Parameters, object_id: str, axes: str | None) -> Write:  # noqa: ARG002
        key = parameters.key(
            object_id,
            ("alpha.value", "alpha", "roughness.value"),
            hint="name a rough BSDF with one isotropic alpha",
        )
        return lambda value: parameters.write(key, value)


class Translation(Property):
    """Offset in world space from the authored place: to_world = T(offset) * authored to_world.

    Composing keeps what the authored transform also holds, a sphere's radius or a rectangle's
    size. A mesh has no to_world; only an instance of it can move.
    """

    takes_axes = True

    def bind(self, parameters: Parameters, object_id: str, axes: str | None) -> Write:
        key = parameters.key(
            object_id,
            ("to_world",),
            hint="a mesh can only move as <shape type='instance'> of a shapegroup that holds it",
        )
        authored = parameters.read(key)
        rows = ["xyz".index(axis) for axis in axes or ""]

        def write(offset: NDArray[np.float64]) -> None:
            to_world = authored.copy()
            to_world[rows, 3] += offset
            parameters.write(key, to_world)

        return write


class Intensity(Property):
    """Factor on the authored radiance or intensity of an emitter."""

    limits = (0.0, inf)

    def bind(self, parameters: Parameters, object_id: str, axes: str | None) -> Write:  # noqa: ARG002
        key = parameters.key(
            object_id,
            ("radiance.value", "intensity.value", "irradiance.value", "scale"),
            hint="name an emitter, or the shape that carries it, with a constant radiance",
        )
        authored = parameters.read(key)
        return lambda factor: parameters.write(key, factor * authored)


PROPERTIES: dict[str, Property] = {
    "albedo": Albedo(),
    "roughness": Roughness(),
    "translation": Translation(),
    "intensity": Intensity(),
}
