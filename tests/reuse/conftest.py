import pytest
import torch

from ngi.patches import BufferLayout, Patches


@pytest.fixture
def make_patches():
    """Makes n random patches whose scene vector's first number tells them apart."""

    def make(n, *, first=0, size=4, dimensions=3, layout=None, seed=0):
        layout = layout or BufferLayout()
        generator = torch.Generator().manual_seed(seed + first)
        scene_vector = torch.rand(n, dimensions, generator=generator)
        scene_vector[:, 0] = (torch.arange(n) + first) / 2**20
        return Patches(
            scene_vector=scene_vector,
            position=torch.rand(n, 2, generator=generator),
            resolution=torch.randint(128, 601, (n,), generator=generator),
            large_step=torch.rand(n, generator=generator) < 0.3,
            buffers=torch.rand(n, size, size, layout.channels, generator=generator) * 2 - 1,
            log_radiance=torch.rand(n, size, size, 3, generator=generator) * 8,
        )

    return make
