"""A renderer of closed formulas with noise of known variance."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from ngi.evaluate import EvaluationProtocol
from ngi.patches import BufferLayout


class NoisyRenderer:
    """radiance = 0.5 + x v_0 + y v_1, plus normal noise whose variance falls as 1 / spp."""

    layout = BufferLayout(names=("position",))
    dimensions = 3
    patch_size = 32
    samples_per_pixel = 4
    scene_hash = "noisy"
    description = "closed formula"

    def __init__(self, *, noise: float = 0.5) -> None:
        self.noise = noise
        self.seeds: list[int] = []
        self.buffer_passes = 0

    def truth(self, scene_vector: Tensor, resolution: int) -> Tensor:
        y, x = torch.meshgrid(*[torch.linspace(0, 1, resolution)] * 2, indexing="ij")
        return (0.5 + x * scene_vector[0] + y * scene_vector[1])[..., None].repeat(1, 1, 3)

    def render_image(
        self, scene_vector: Tensor, *, resolution: int, samples_per_pixel: int, seed: int
    ) -> Tensor:
        self.seeds.append(seed)
        generator = torch.Generator().manual_seed(seed)
        radiance = self.truth(scene_vector, resolution)
        noise = torch.randn(radiance.shape, generator=generator) * self.noise
        return radiance + noise / samples_per_pixel**0.5

    def image_buffers(self, scene_vector: Tensor, *, resolution: int) -> Tensor:
        self.buffer_passes += 1
        return self.truth(scene_vector, resolution)

    def hard_frames(self) -> Tensor:
        return torch.linspace(0, 1, 30).reshape(10, 3)


@pytest.fixture
def renderer() -> NoisyRenderer:
    return NoisyRenderer()


@pytest.fixture
def protocol() -> EvaluationProtocol:
    return EvaluationProtocol(
        name="test",
        resolution=33,
        low_discrepancy_frames=4,
        target_noise=0.02,
        samples_per_pass=64,
        maximum_samples=4096,
    )
