"""Variables that are numbers of Mitsuba's own, by the names that Mitsuba has for them.

Which plugins have them, and what else of Mitsuba's varies or does not: `ngi.scene.offered`.
"""

from dataclasses import dataclass
from typing import ClassVar, Self

from ngi.scene.variable import LoadedScene, RangedVariable, Values, Write
from ngi.scene.yaml_keys import YamlKeys


@dataclass(frozen=True)
class Number(RangedVariable):
    """One number, or one colour, of a plugin; scene.xml has to give it.

    of: Mitsuba's classes of which it varies; all that have it where empty.
    """

    limits = (0.0, 1.0)
    of: ClassVar[tuple[str, ...]] = ()

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        key = scene.parameter(
            object_id,
            (f"{self.kind}.value", self.kind),
            hint=f"name an object whose '{self.kind}' varies, and give it in scene.xml",
            of=self.of,
        )
        if (count := scene.read(key).size) != len(self.numbers):
            element = "<rgb>" if len(self.numbers) > 1 else "<float>"
            raise ValueError(
                f"{self.kind} of '{object_id}': {key} holds {count} number(s) instead of "
                f"{len(self.numbers)}; give it as {element}"
            )
        return lambda value: scene.write(key, value)


class FieldOfView(Number):
    """Degrees that the camera sees, across the image's width, which is its height too."""

    kind = "fov"
    affects = frozenset({"camera"})
    unit = "degrees"
    limits = (0.1, 179.0)

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        key = scene.parameter(object_id, ("x_fov",), hint="name the camera")
        return lambda value: scene.write(key, value)


class Cone(RangedVariable):
    """The light of a spot, by degrees from its axis.

    cutoff_angle: from where on there is no light. beam_width: up to where there is all of it; in
    between the intensity falls linearly.
    """

    kind = "cone"
    numbers = ("cutoff_angle", "beam_width")
    unit = "degrees"
    limits = (0.0, 180.0)

    def bind_one(self, scene: LoadedScene, object_id: str) -> Write:
        keys = [
            scene.parameter(object_id, (name,), hint="name a spot light") for name in self.numbers
        ]

        def write(angles: Values) -> None:
            for key, angle in zip(keys, angles, strict=True):
                scene.write(key, angle.reshape(1))

        return write

    @classmethod
    def read(cls, objects: tuple[str, ...], keys: YamlKeys) -> Self:
        made = super().read(objects, keys)
        if made.maximum[1] > made.minimum[0]:
            raise keys.error(
                "maximum",
                list(made.maximum),
                f"beam_width reaches {made.maximum[1]:g}, cutoff_angle goes down to "
                f"{made.minimum[0]:g}; keep the first below the second",
            )
        return made


class RefractiveIndex(Number):
    """Of a thin or rough dielectric: that of the inside relative to the outside."""

    kind = "eta"
    affects = frozenset({"position"})  # of what is seen through it, where that is traced
    limits = (0.2, 5.0)
    of = ("ThinDielectric", "RoughDielectric")


class AlphaU(Number):
    """Roughness of an anisotropic BSDF along its tangent."""

    kind = "alpha_u"
    affects = frozenset({"roughness"})
    limits = (1e-3, 1.0)


class AlphaV(Number):
    """Roughness of an anisotropic BSDF across its tangent."""

    kind = "alpha_v"
    affects = frozenset({"roughness"})
    limits = (1e-3, 1.0)


class FirstColour(Number):
    """Of a checkerboard, linear RGB."""

    kind = "color0"
    affects = frozenset({"albedo"})
    numbers = ("r", "g", "b")


class SecondColour(Number):
    """Of a checkerboard, linear RGB."""

    kind = "color1"
    affects = frozenset({"albedo"})
    numbers = ("r", "g", "b")


class Metallic(Number):
    """Of a `principled` BSDF, as the numbers below."""

    kind = "metallic"


class Specular(Number):
    kind = "specular"


class SpecularTint(Number):
    kind = "spec_tint"


class Anisotropic(Number):
    kind = "anisotropic"


class Sheen(Number):
    kind = "sheen"


class SheenTint(Number):
    kind = "sheen_tint"


class Clearcoat(Number):
    kind = "clearcoat"


class ClearcoatGloss(Number):
    kind = "clearcoat_gloss"


class Flatness(Number):
    kind = "flatness"


class SpecularTransmission(Number):
    kind = "spec_trans"


NUMBERS: tuple[type[RangedVariable], ...] = (Cone, *Number.__subclasses__())
