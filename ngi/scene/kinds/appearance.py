"""Variables of materials and lights."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import ClassVar, Self

import numpy as np

from ngi.scene.variable import (
    DiscreteVariable,
    LoadedScene,
    RangedVariable,
    Values,
    Variable,
    Write,
    in_turn,
)
from ngi.scene.yaml_keys import YamlKeys

_REFLECTANCES = (
    "base_color",
    "diffuse_reflectance",
    "specular_transmittance",
    "specular_reflectance",
    "reflectance",
)

PLASTICS = ("SmoothPlastic", "RoughPlastic")
"""Whose albedo is their diffuse_reflectance: the specular one is that of the coat over it."""


MOST_TEXELS = 2**16
"""Every one is a component of v, which is stored with every patch."""


@dataclass(frozen=True)
class Albedo(RangedVariable):
    """Reflectance of a BSDF, linear RGB; it replaces the authored one, of whichever kind it is."""

    kind = "albedo"
    affects = frozenset({"albedo"})
    numbers = ("r", "g", "b")
    limits = (0.0, 1.0)
    reflectances: ClassVar[tuple[str, ...]] = _REFLECTANCES

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        key = scene.parameter(
            object_id,
            _reflectances(scene, object_id, "value", among=self.reflectances),
            hint="name a BSDF whose reflectance is given as <rgb>, not as a texture",
        )
        if (count := scene.read(key).size) != 3:
            raise ValueError(
                f"scene.xml: albedo of '{object_id}': {key} holds {count} number(s) instead of 3; "
                "give the reflectance as <rgb>, not as <spectrum>"
            )
        return lambda value: scene.write(key, value)


@dataclass(frozen=True)
class Roughness(RangedVariable):
    """Beckmann or GGX alpha of a rough BSDF; of a `principled` one, its own roughness."""

    kind = "roughness"
    affects = frozenset({"roughness"})
    limits = (1e-3, 1.0)

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        key = scene.parameter(
            object_id,
            ("alpha.value", "alpha", "roughness.value"),
            hint="name a rough BSDF with one isotropic alpha",
        )
        return lambda value: scene.write(key, value)


@dataclass(frozen=True)
class Intensity(RangedVariable):
    """Factor on the radiance, intensity or irradiance of an emitter, authored or varied."""

    kind = "intensity"
    affects = frozenset({"emission"})
    limits = (0.0, inf)

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        return scene.intensity(object_id)


@dataclass(frozen=True)
class Radiance(RangedVariable):
    """Radiance, intensity or irradiance of an emitter, linear RGB; it replaces the authored one."""

    kind = "radiance"
    affects = frozenset({"emission"})
    numbers = ("r", "g", "b")
    limits = (0.0, inf)

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        return scene.radiance(object_id)


@dataclass(frozen=True)
class Texture(DiscreteVariable):
    """Which image is the albedo of a BSDF; choices: files of the authored bitmap's size."""

    kind = "texture"
    affects = frozenset({"albedo"})

    @property
    def files(self) -> tuple[str, ...]:
        return self.choices

    def bind(self, scene: LoadedScene) -> Write:
        keys = [_bitmap(scene, object_id) for object_id in self.objects]
        files = [scene.file(name) for name in self.choices]
        images = {key: [scene.bitmap(key).load(file) for file in files] for key in keys}

        def write(value: Values) -> None:
            for key in keys:
                scene.write(key, images[key][int(value[0])])

        return write


@dataclass(frozen=True)
class Texels(Variable):
    """Every texel of a bitmap: a variable texture of thousands of variables (paper, Sec. 9).

    objects: BSDFs whose reflectance is a bitmap of `size` pixels, all grey between
    minimum and maximum, linear. size: rows and columns.
    """

    size: tuple[int, int]
    minimum: float
    maximum: float

    kind = "texels"
    affects = frozenset({"albedo"})

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return tuple(
            f"{row}_{column}" for row in range(self.size[0]) for column in range(self.size[1])
        )

    @property
    def components(self) -> tuple[str, ...]:
        return self._names

    @property
    def range(self) -> str:
        return f"{self.size[0]} x {self.size[1]} texels, {self.minimum:g} ... {self.maximum:g}"

    def value(self, components: Values) -> Values:
        return (self.minimum + components * (self.maximum - self.minimum)).reshape(self.size)

    def bind(self, scene: LoadedScene) -> Write:
        keys = [_bitmap(scene, object_id) for object_id in self.objects]
        bitmaps = {key: scene.bitmap(key) for key in keys}
        for key, bitmap in bitmaps.items():
            if bitmap.shape[:2] != self.size:
                raise ValueError(
                    f"scene.yaml: texels of size {list(self.size)}, but the bitmap {key} of "
                    f"scene.xml has {list(bitmap.shape[:2])} rows and columns; make them equal"
                )

        def write(value: Values) -> None:
            for key, bitmap in bitmaps.items():
                scene.write(key, np.broadcast_to(bitmap.stored(value)[..., None], bitmap.shape))

        return write

    @classmethod
    def read(cls, objects: tuple[str, ...], keys: YamlKeys) -> Self:
        rows, columns = keys.numbers("size", length=2)
        if min(rows, columns) < 1 or rows % 1 or columns % 1:
            raise keys.error("size", [rows, columns], "expected two positive integers")
        if rows * columns > MOST_TEXELS:
            raise keys.error("size", [rows, columns], f"at most {MOST_TEXELS} texels can vary")
        (low,), (high,) = (keys.numbers(key, length=1) for key in ("minimum", "maximum"))
        for key, value in (("minimum", low), ("maximum", high)):
            if not 0 <= value <= 1:
                raise keys.error(key, value, "texels lie between 0 and 1")
        keys.check_range((low,), (high,), strict=True)
        return cls(objects, (int(rows), int(columns)), low, high)


@dataclass(frozen=True)
class Material(DiscreteVariable):
    """Which BSDF a shape has; objects: shapes or instances, choices: ids of BSDFs in scene.xml."""

    kind = "material"
    affects = frozenset({"albedo", "roughness"})

    def bind(self, scene: LoadedScene) -> Write:
        return in_turn([scene.materials(object_id, self.choices) for object_id in self.objects])


def most_materials(variables: Iterable[Variable]) -> int:
    """Of how many BSDFs one of the variables chooses at most, 0 where none does."""
    return max((len(v.choices) for v in variables if isinstance(v, Material)), default=0)


def _bitmap(scene: LoadedScene, object_id: str) -> str:
    return scene.parameter(
        object_id,
        _reflectances(scene, object_id, "data", among=_REFLECTANCES),
        hint="name a BSDF whose reflectance is one bitmap",
    )


def _reflectances(
    scene: LoadedScene, object_id: str, ending: str, *, among: tuple[str, ...]
) -> tuple[str, ...]:
    """What an object's albedo may be, as parameters with this ending."""
    names = ("diffuse_reflectance",) if scene.is_made_of(object_id, PLASTICS) else among
    return tuple(f"{name}.{ending}" for name in names)
