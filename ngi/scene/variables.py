"""The scene vector v in [0, 1]^D and the values of the variables it stands for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ngi.scene.properties import PROPERTIES


@dataclass(frozen=True)
class Variable:
    """One varying property of one object.

    minimum, maximum: values that components 0 and 1 of v stand for, in the scene's units.
    axes: for properties with directions, which of x, y and z vary.
    """

    object: str
    property: str
    minimum: tuple[float, ...]
    maximum: tuple[float, ...]
    axes: str | None = None


def component_names(variables: Sequence[Variable]) -> tuple[str, ...]:
    """The names of the D components of v, in order, for example 'sphere.translation.x'."""
    return tuple(
        ".".join(filter(None, (variable.object, variable.property, suffix)))
        for variable in variables
        for suffix in PROPERTIES[variable.property].components(variable.axes)
    )


def variable_values(
    variables: Sequence[Variable], scene_vector: ArrayLike
) -> list[NDArray[np.float64]]:
    """The value of every variable at v: minimum + v * (maximum - minimum), component by component.

    Raises ValueError as `check_scene_vector` does.
    """
    v = check_scene_vector(variables, scene_vector)
    values = []
    start = 0
    for variable in variables:
        low, high = np.array(variable.minimum), np.array(variable.maximum)
        values.append(low + v[start : start + len(low)] * (high - low))
        start += len(low)
    return values


def scene_vector_of(
    variables: Sequence[Variable], values: Sequence[ArrayLike]
) -> NDArray[np.float64]:
    """The inverse of `variable_values`; raises ValueError for values outside the ranges."""
    parts = []
    for variable, value in zip(variables, values, strict=True):
        low, high = np.array(variable.minimum), np.array(variable.maximum)
        parts.append((np.asarray(value, dtype=np.float64) - low) / (high - low))
    return check_scene_vector(variables, np.concatenate(parts))


def check_scene_vector(
    variables: Sequence[Variable], scene_vector: ArrayLike
) -> NDArray[np.float64]:
    """Returns v as float64 of shape [D]; ValueError, naming the component, outside [0, 1]^D."""
    v = np.asarray(scene_vector, dtype=np.float64)
    names = component_names(variables)
    if v.shape != (len(names),):
        raise ValueError(
            f"scene vector of shape {list(v.shape)}: this scene has {len(names)} variables, "
            f"{', '.join(names)}"
        )
    for name, value in zip(names, v, strict=True):
        if not 0 <= value <= 1:  # NaN fails too
            raise ValueError(f"scene vector: component '{name}' is {value}, expected 0 to 1")
    return v
