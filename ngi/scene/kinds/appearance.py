"""Variables of materials and lights."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Self

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
    "specular_reflectance",
    "reflectance",
)


@dataclass(frozen=True)
class Albedo(RangedVariable):
    """Reflectance of a BSDF, linear RGB; it replaces the authored one, of whichever kind it is."""

    kind = "albedo"
    affects = frozenset({"albedo"})
    numbers = ("r", "g", "b")
    limits = (0.0, 1.0)

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        key = scene.parameter(
            object_id,
            tuple(f"{name}.value" for name in _REFLECTANCES),
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
        factor, _ = scene.emission(object_id)
        return factor


@dataclass(frozen=True)
class Radiance(RangedVariable):
    """Radiance, intensity or irradiance of an emitter, linear RGB; it replaces the authored one."""

    kind = "radiance"
    affects = frozenset({"emission"})
    numbers = ("r", "g", "b")
    limits = (0.0, inf)

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        _, colour = scene.emission(object_id)
        return colour


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
        images = [scene.image(scene.file(name)) for name in self.choices]
        for key in keys:
            authored = scene.read(key).shape
            for name, image in zip(self.choices, images, strict=True):
                if image.shape != authored:
                    raise ValueError(
                        f"{scene.file(name)}: an image of {_size(image.shape)}, but the bitmap "
                        f"{key} of scene.xml has {_size(authored)}; make them equal"
                    )

        def write(value: Values) -> None:
            for key in keys:
                scene.write(key, images[int(value[0])])

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

    def value(self, components: Values) -> Values:
        return (self.minimum + components * (self.maximum - self.minimum)).reshape(self.size)

    def bind(self, scene: LoadedScene) -> Write:
        keys = [_bitmap(scene, object_id) for object_id in self.objects]
        shapes = [scene.read(key).shape for key in keys]
        for key, shape in zip(keys, shapes, strict=True):
            if shape[:2] != self.size:
                raise ValueError(
                    f"scene.yaml: texels of size {list(self.size)}, but the bitmap {key} of "
                    f"scene.xml has {list(shape[:2])} rows and columns; make them equal"
                )

        def write(value: Values) -> None:
            for key, shape in zip(keys, shapes, strict=True):
                scene.write(key, np.broadcast_to(value[..., None], shape))

        return write

    @classmethod
    def read(cls, objects: tuple[str, ...], keys: YamlKeys) -> Self:
        rows, columns = keys.numbers("size", length=2)
        if min(rows, columns) < 1 or rows % 1 or columns % 1:
            raise keys.error("size", [rows, columns], "expected two positive integers")
        (low,), (high,) = (keys.numbers(key, length=1) for key in ("minimum", "maximum"))
        keys.check_range((low,), (high,))
        if not 0 <= low < high <= 1:
            raise keys.error("maximum", high, "texels lie between 0 and 1")
        return cls(objects, (int(rows), int(columns)), low, high)


@dataclass(frozen=True)
class Material(DiscreteVariable):
    """Which BSDF a shape has; objects: shapes or instances, choices: ids of BSDFs in scene.xml."""

    kind = "material"
    affects = frozenset({"albedo", "roughness"})

    def bind(self, scene: LoadedScene) -> Write:
        return in_turn([scene.materials(object_id, self.choices) for object_id in self.objects])


def _bitmap(scene: LoadedScene, object_id: str) -> str:
    return scene.parameter(
        object_id,
        tuple(f"{name}.data" for name in _REFLECTANCES),
        hint="name a BSDF whose reflectance is one bitmap",
    )


def _size(shape: tuple[int, ...]) -> str:
    return f"{shape[1]} x {shape[0]} pixels and {shape[2]} channel(s)"
