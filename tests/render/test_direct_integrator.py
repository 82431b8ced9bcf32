"""Traced direct light of every shipped scene against Mitsuba's `direct` integrator."""

import numpy as np
import pytest
import torch

from ngi.backend import llvm_problem, mi
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.scene import read_scene, scenes

NAMES = sorted(set(scenes()) - {"salon-5", "salon-7", "salon-9", "salon-10"})
"""Of the salon's variants only the one that varies everything."""

RESOLUTION, BLOCK = 32, 8
SAMPLES, BATCHES = 64, 6
"""Of the reference per pixel and batch, and batches, which tell its noise."""
RAYS = 64
"""Of the buffers per pixel: four times the usual, so that less is lost in their error."""


def reference(renderer) -> np.ndarray:
    """[BATCHES, n, n, 3]: the direct integrator, less the emission of the very same rays."""
    scene = renderer._scene.scene
    camera = mi.traverse(scene.sensors()[0])
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
    integrators = [{"type": "direct"}, {"type": "path", "max_depth": 1}]
    whole, emitted = (
        np.stack(
            [
                np.array(mi.render(scene, sensor=sensor, integrator=i, spp=SAMPLES, seed=seed))
                for seed in range(BATCHES)
            ]
        )
        for i in map(mi.load_dict, integrators)
    )
    return whole - emitted


def blurred(image: np.ndarray) -> np.ndarray:
    """Means over blocks of BLOCK x BLOCK pixels and the colours: [..., n, n, 3] to [..., m, m]."""
    blocks = RESOLUTION // BLOCK
    shape = (*image.shape[:-3], blocks, BLOCK, blocks, BLOCK, 3)
    return image.reshape(shape).mean(axis=(-4, -2, -1))


@pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))
@pytest.mark.parametrize("name", NAMES)
def test_scene(name) -> None:
    """Random v. A pixel's variance is that of random paths, one point in every pixel counts once:
    so the error of a block is at most that of a pixel with as many random rays.
    """
    renderer = MitsubaRenderer(
        scene=read_scene(**scenes()[name]), backend="llvm", direct="traced", buffer_samples=RAYS
    )
    v = torch.rand(renderer.dimensions, generator=torch.Generator().manual_seed(7))
    image = renderer.image_buffers(v, resolution=RESOLUTION)
    found = image[..., renderer.layout.slice("direct")].expm1().numpy()
    batches = reference(renderer)
    expected = batches.mean(0)
    variance = batches.var(0, ddof=1) * SAMPLES  # of one path, [n, n, 3]
    ours = blurred(np.sqrt(variance / RAYS))
    noise = blurred(batches).std(0, ddof=1) / BATCHES**0.5
    error = blurred(found) - blurred(expected)
    assert expected.mean() > 0.01
    assert (abs(error) < 2 * np.hypot(ours, noise) + 1e-4).all(), error
    random = np.sqrt((variance / RAYS + variance / (SAMPLES * BATCHES)).mean())  # of a pixel
    assert abs(error.mean()) < 0.005 * expected.mean() + 0.1 * random
    assert ((found - expected) ** 2).mean() < random**2
