"""Where a variable shape may stand: T(min + u * range) * R(axis, min_angle + u * range_angle)."""

from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np

from ngi.scene import transforms
from ngi.scene.kinds import Rotation, Translation
from ngi.scene.release.source import Source
from ngi.scene.release.tags import Tags
from ngi.scene.variable import Values, Variable
from ngi.scene.yaml_keys import Vector

ANGLES = 65
"""Angles at which the box of a turning shape is taken."""


@dataclass(frozen=True)
class Motion:
    """Offsets from the authored place, after a rotation about the world's origin.

    minimum, maximum: [3]. axis: of the rotation by angles[0] to angles[1] degrees, if any.
    """

    minimum: Vector
    maximum: Vector
    axis: Vector
    angles: tuple[float, float] | None

    @property
    def fixed_offset(self) -> Vector | None:
        """The offset where it does not vary: it belongs into the document then."""
        return self.minimum if self.minimum == self.maximum else None

    def variables(self, objects: tuple[str, ...]) -> list[Variable]:
        """Of objects that stand where the document, with the fixed offset, puts them."""
        variables: list[Variable] = []
        if self.fixed_offset is None:
            variables.append(Translation(objects, self.minimum, self.maximum))
        if self.angles is not None:
            low, high = self.angles
            pivot = self.fixed_offset or (0.0, 0.0, 0.0)
            variables.append(Rotation(objects, (low,), (high,), axis=self.axis, pivot=pivot))
        return variables

    def sweep(self, corners: Values) -> Values:
        """[n, 3]: where the corners [8, 3] of the authored box come by."""
        turned = corners
        if self.angles is not None:
            axis = np.array(self.axis)
            matrices = [transforms.rotation(axis, a) for a in np.linspace(*self.angles, ANGLES)]
            turned = np.concatenate([corners @ matrix[:3, :3].T for matrix in matrices])
        return np.concatenate([turned + np.array(self.minimum), turned + np.array(self.maximum)])


def motion_of(source: Source, element: Element, tags: Tags) -> Motion:
    """Only axes whose range is positive take a component; one that is left over is the angle."""
    low, extent = tags.minimum[:3], tags.extent[:3]
    high = tuple(a + max(e, 0.0) for a, e in zip(low, extent, strict=True))
    moving = sum(e > 0 for e in extent)
    turns = bool(tags.given & {"rotation_axis", "min_angle", "range_angle"})
    left = tags.count - moving
    if left not in (0, 1) or tags.count < 1:
        raise source.error(
            element,
            f"num_parameters is {tags.count} (3 where not given), but range_bounds is positive "
            f"along {moving} axes; one each, and at most one more for a rotation",
        )
    if left and not turns and element.get("type") != "instance":
        raise source.error(
            element,
            f"num_parameters is {tags.count} (3 where not given), but range_bounds is positive "
            f"along {moving} axes; make num_parameters {moving}, or give a rotation_axis",
        )
    if left and not tags.range_angle:
        raise source.error(element, "range_angle is 0, so that the rotation does not vary")
    angles = (tags.min_angle, tags.min_angle + tags.range_angle) if left else None
    return Motion(low, high, tags.axis, angles)
