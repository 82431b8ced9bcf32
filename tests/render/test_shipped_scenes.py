"""Every shipped scene renders at the ends of its variables, is lit, keeps its camera free, and its
traced direct light is that of Mitsuba's `direct` integrator.
"""

import numpy as np
import pytest
import torch

from ngi.machine.backend import llvm_problem, mi
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene, scenes
from ngi.scene.clearance import camera_problems

NAMES = sorted(set(scenes()) - {"salon-5", "salon-7", "salon-9", "salon-10"})
"""Of the salon's variants only the one that varies everything."""

DARK, TOO_DARK = 0.002, 0.5
"""Radiance below which a pixel is black, and the share of such pixels that is too much."""

LIT = {"shutters": 0.005}
"""Mean radiance that a scene has at least where it is not 0.01: there little light is the point."""

RESOLUTION, BLOCK = 32, 8
PATHS = 384
"""Of the reference per pixel."""
RAYS = 64
"""Of the buffers per pixel: four times the usual, so that less is lost in their error."""

pytestmark = pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))


@pytest.fixture(scope="module", params=NAMES)
def renderer(request):
    """Loaded once for all tests: a large scene takes longer to load than to render."""
    return MitsubaRenderer(
        scene=read_scene(**scenes()[request.param]),
        backend="llvm",
        patch_size=RESOLUTION,
        samples_per_pixel=8,
        direct="traced",
    )


def some(renderer, count) -> torch.Tensor:
    """[count, D] random v."""
    return torch.rand(count, renderer.dimensions, generator=torch.Generator().manual_seed(7))


def test_it_is_seen_and_lit_at_the_ends_of_its_variables(renderer) -> None:
    ends = [torch.full((1, renderer.dimensions), value) for value in (0.0, 0.5, 1.0)]
    v = torch.cat([*ends, some(renderer, 3), renderer.hard_frames()])
    # A patch of 32 pixels of an image of 32 is the whole image.
    states = torch.cat([v, torch.zeros(len(v), 2)], dim=1)
    patches = renderer.render_patches(states, resolution=RESOLUTION, seed=1)
    assert patches.masked == 0
    assert torch.isfinite(patches.buffers).all()
    radiance = patches.log_radiance.expm1()
    dark = (radiance.amax(dim=-1) < DARK).float().mean(dim=(1, 2))
    assert (dark < TOO_DARK).all(), dark
    least = LIT.get(renderer._scene.description.name, 0.01)
    assert (radiance.mean(dim=(1, 2, 3)) > least).all()
    position = patches.buffers[..., renderer.layout.slice("position")]
    seen = position.amax(dim=-1) > 0
    assert seen.float().mean() > 0.5, "the camera sees nothing"
    assert (position >= -1e-4).all(), "something lies outside of the scene's bounds"
    assert (position <= 1 + 1e-4).all(), "something lies outside of the scene's bounds"
    assert camera_problems(renderer._scene) == []


def test_direct_light_is_that_of_the_direct_integrator(renderer) -> None:
    """Random v. A pixel's variance is that of random paths, one point in every pixel counts once:
    so the error of a block is at most that of a pixel with as many random rays.
    """
    v = some(renderer, 1)[0]
    image = renderer.image_buffers(v, resolution=RESOLUTION, samples=RAYS)
    found = image[..., renderer.layout.slice("direct")].expm1().numpy()
    expected, variance, variance_of_mean = reference(renderer)
    ours = blurred(np.sqrt(variance / RAYS))
    noise = np.sqrt(blurred(variance_of_mean[..., None].repeat(3, -1)) / (PATHS * BLOCK**2))
    error = blurred(found) - blurred(expected)
    assert expected.mean() > 0.01
    assert (abs(error) < 2 * np.hypot(ours, noise) + 1e-4).all(), error
    random = np.sqrt((variance / RAYS + variance / PATHS).mean())  # of a pixel
    assert abs(error.mean()) < 0.005 * expected.mean() + 0.1 * random
    assert ((found - expected) ** 2).mean() < random**2


def reference(renderer) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means [n, n, 3] of the direct integrator less the emission of the very same rays, variances
    [n, n, 3] of one path, and those of its colours' mean, [n, n].

    The integrator returns squares beside the values: one kernel, rendered once.
    """
    direct = mi.load_dict({"type": "direct"})

    class Reflected(mi.SamplingIntegrator):
        def sample(self, scene, sampler, ray, medium=None, active=True):
            value, valid, _ = direct.sample(scene, sampler, ray, medium, active)
            hit = scene.ray_intersect(mi.Ray3f(ray), active)
            value -= hit.emitter(scene).eval(hit, active)
            mean = (value[0] + value[1] + value[2]) / 3
            return value, valid, [*(value * value), mean * mean]

        def aov_names(self):
            return ["red", "green", "blue", "mean"]

    camera = mi.traverse(renderer._scene.scene.sensors()[0])
    sensor = mi.load_dict(
        {
            "type": "perspective",
            "fov": float(np.ravel(camera["x_fov"])[0]),
            "fov_axis": "x",
            "near_clip": float(np.ravel(camera["near_clip"])[0]),
            "far_clip": float(np.ravel(camera["far_clip"])[0]),
            "to_world": mi.ScalarTransform4f(
                np.array(camera["to_world"].matrix, dtype=float).reshape(4, 4)
            ),
            "film": {
                "type": "hdrfilm",
                "width": RESOLUTION,
                "height": RESOLUTION,
                "rfilter": {"type": "box"},
            },
        }
    )
    image = mi.render(
        renderer._scene.scene, sensor=sensor, integrator=Reflected(mi.Properties()), spp=PATHS
    )
    value, squares = np.split(np.array(image), [3], axis=-1)
    of_mean = squares[..., 3] - value.mean(-1) ** 2
    return value, squares[..., :3] - value**2, of_mean


def blurred(image: np.ndarray) -> np.ndarray:
    """Means over blocks of BLOCK x BLOCK pixels and the colours: [..., n, n, 3] to [..., m, m]."""
    blocks = RESOLUTION // BLOCK
    shape = (*image.shape[:-3], blocks, BLOCK, blocks, BLOCK, 3)
    return image.reshape(shape).mean(axis=(-4, -2, -1))
