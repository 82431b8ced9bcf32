"""What the buffers are told of materials, on a surface of two sides."""

import numpy as np
import pytest

from ngi.machine.backend import activate, llvm_problem, mi
from ngi.render.materials import collect_materials, evaluate_materials

RED, GREEN = [0.7, 0.1, 0.2], [0.2, 0.6, 0.3]


def plate(*sides: dict) -> dict:
    bsdf = {"type": "twosided", **{f"side_{index}": side for index, side in enumerate(sides)}}
    return {"type": "scene", "plate": {"type": "rectangle", "bsdf": bsdf}}


def paint(colour: list[float]) -> dict:
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": colour}}


METAL = {
    "type": "roughconductor",
    "alpha": 0.3,
    "specular_reflectance": {"type": "rgb", "value": GREEN},
}


@pytest.fixture(params=["scalar", "llvm"])
def _each_backend(request) -> None:
    if request.param == "llvm" and (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    activate(request.param)


@pytest.mark.usefixtures("_each_backend")
@pytest.mark.parametrize(
    ("sides", "expected"),
    [
        ([paint(RED)], [(RED, 1.0), (RED, 1.0)]),
        ([paint(RED), METAL], [(RED, 1.0), (GREEN, 0.3)]),
        ([METAL, paint(RED)], [(GREEN, 0.3), (RED, 1.0)]),
    ],
)
def test_each_side_has_its_own(sides, expected) -> None:
    scene = mi.load_dict(plate(*sides))
    materials = collect_materials([scene.shapes()[0].bsdf()])
    for z, (albedo, roughness) in zip((1, -1), expected, strict=True):
        hit = scene.ray_intersect(mi.Ray3f([0.1, 0.2, z], [0, 0, -z]))
        found = evaluate_materials(materials, hit, hit.is_valid())
        np.testing.assert_allclose(np.ravel(found[0]), albedo, rtol=1e-5)
        np.testing.assert_allclose(np.ravel(found[1]), roughness, rtol=1e-5)


def test_what_differs_between_the_sides_is_not_constant() -> None:
    activate("scalar")
    for sides, roughness, albedo in (
        ([paint(RED), paint(RED)], 1.0, tuple(RED)),
        ([paint(RED), paint(GREEN)], 1.0, None),
        ([paint(GREEN), METAL], None, tuple(GREEN)),
    ):
        (material,) = collect_materials([mi.load_dict(plate(*sides)).shapes()[0].bsdf()])
        assert material.constant_roughness == roughness
        assert material.constant_albedo == (None if albedo is None else pytest.approx(albedo))
