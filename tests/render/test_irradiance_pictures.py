"""Pictures of photons that a test puts where it wants them."""

import numpy as np
import pytest

from ngi.machine.backend import dr, llvm_problem, mi
from ngi.render.irradiance_pictures import IrradiancePictures

PICTURES = IrradiancePictures(((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)))


@pytest.fixture(autouse=True)
def _variant():
    if (problem := llvm_problem()) is not None:
        pytest.skip(problem)
    mi.set_variant("llvm_ad_rgb")


def on_the_floor(points):
    """Points [n, 2] of the plane z = 0, seen from above."""
    hit = dr.zeros(mi.SurfaceInteraction3f, len(points))
    hit.p = mi.Point3f(mi.Float(points[:, 0]), mi.Float(points[:, 1]), 0)
    hit.n = mi.Normal3f(0, 0, 1)
    hit.sh_frame = mi.Frame3f(hit.n)
    hit.wi = mi.Vector3f(0, 0, 1)
    hit.t = mi.Float(1)
    return hit


@pytest.mark.parametrize("brightness", [7e-4, 6e-4, 1e-4, 1e-5])
def test_faint_light_is_as_sharp_beside_bright_light(brightness) -> None:
    """A dim lamp's caustic beside that of the sun."""
    generator = np.random.default_rng(0)
    faint = generator.uniform(0.2, 0.25, (256, 2))
    places = on_the_floor(
        np.stack(np.meshgrid(*[np.linspace(0.1, 0.35, 20)] * 2), -1).reshape(-1, 2)
    )

    def irradiance(points, powers):
        pictures = PICTURES.of_photons(on_the_floor(points), mi.Color3f(mi.Float(powers)))
        return PICTURES.irradiance(pictures, places).numpy()

    alone = irradiance(faint, np.ones(256))
    beside = irradiance(np.vstack([faint, [[0.9, 0.9]]]), np.append(np.full(256, brightness), 1))
    assert alone.max() > 0
    np.testing.assert_allclose(beside / brightness, alone, rtol=1e-3, atol=1e-3 * alone.max())
