"""Kinds of variables that only scenes in this format have."""

from dataclasses import dataclass

import numpy as np

from ngi.scene.kinds import Albedo, Shape
from ngi.scene.variable import LoadedScene, RangedVariable, Write

NOTHING = "nothing"

TINTED = ("base_color", "diffuse_reflectance", "reflectance", "specular_reflectance")
"""What can be a bitmap with a factor; of a plastic the first, as where it has none."""


@dataclass(frozen=True)
class SpecularReflectance(Albedo):
    """Of a dielectric, which may have a transmittance beside it, that stays."""

    reflectances = ("specular_reflectance",)


@dataclass(frozen=True)
class Tint(RangedVariable):
    """Factor on the bitmap that is the reflectance of a BSDF, linear RGB.

    The bitmap is kept in floating point: to encode 8 bits anew took longer than to trace a patch.
    """

    kind = "tint"
    affects = frozenset({"albedo"})
    numbers = ("r", "g", "b")
    limits = (0.0, 1.0)

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        key = scene.parameter(
            object_id,
            tuple(f"{name}.data" for name in TINTED),
            hint="only bitmaps can be tinted",
        )
        bitmap = scene.bitmap(key)
        if bitmap.shape[2] != 3:
            raise ValueError(
                f"'{object_id}': a bitmap of grey values cannot be tinted; save it with three "
                "channels"
            )
        authored = scene.read(key).astype(np.float32)
        return lambda colour: scene.write(key, np.multiply(authored, colour, dtype=np.float32))


@dataclass(frozen=True)
class Alternatives(Shape):
    """Which shape of a group is there, or none: the last choice, whose name is `NOTHING`.

    choices: the instances that show one shape each. Emitters cannot vanish.
    """

    kind = "alternatives"

    @property
    def shown(self) -> tuple[str, ...]:
        return self.choices[:-1]
