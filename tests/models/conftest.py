"""Plain-concatenation twins of the networks, and small seeded batches."""

from dataclasses import dataclass

import pytest
import torch
import torch.nn.functional as F
from torch import Tensor

from ngi.models import PixelGenerator
from ngi.patches import BufferLayout


def plain_forward(
    model: PixelGenerator, parameters: dict[str, Tensor], buffers: Tensor, scene_vector: Tensor
) -> Tensor:
    """The paper's network in the release's words: v repeated at every pixel and concatenated."""
    layout = model.layout
    v = scene_vector[:, None, None].expand(*buffers.shape[:3], -1)
    inputs = torch.cat([buffers[..., : layout.input_channels], v], dim=-1)
    first = buffers[..., layout.slice("position")] if model.position_preconditioning else inputs
    names = ["input_layer", *(f"hidden.{i}" for i in range(len(model.hidden)))]
    x = first
    for i, name in enumerate(names):
        x = x if i == 0 else torch.cat([x, inputs], dim=-1)
        x = F.linear(x, parameters[f"{name}.weight"], parameters[f"{name}.bias"])
        x = F.leaky_relu(x, model.negative_slope)
    x = torch.cat([x, inputs], dim=-1)
    output = F.linear(x, parameters["output_layer.weight"], parameters["output_layer.bias"])
    radiance = torch.zeros_like(output)
    for name in {"direct", "emission"} & {*layout.names}:
        radiance = radiance + buffers[..., layout.slice(name)].exp() - 1
    output = output + torch.log1p(radiance)
    if "emission" not in layout.names:
        return output
    emission = buffers[..., layout.slice("emission")]
    return torch.where(emission > 1, emission, output)


@dataclass
class Batch:
    buffers: Tensor
    scene_vector: Tensor
    target: Tensor


@pytest.fixture
def make_model():
    def make(
        names=("position", "normal", "roughness", "emission"), scene_dimensions=4, **options
    ) -> PixelGenerator:
        options = {"hidden_features": 16, "hidden_layers": 3, **options}
        with torch.random.fork_rng():
            torch.manual_seed(3)
            return PixelGenerator(
                layout=BufferLayout(names), scene_dimensions=scene_dimensions, **options
            )

    return make


@pytest.fixture
def make_batch():
    def make(model: PixelGenerator, *, samples=3, height=6, width=5) -> Batch:
        generator = torch.Generator().manual_seed(7)
        dtype = model.output_layer.weight.dtype

        def rand(*shape: int) -> Tensor:
            return torch.rand(*shape, generator=generator, dtype=torch.float64).to(dtype)

        return Batch(
            2 * rand(samples, height, width, model.layout.channels),
            rand(samples, model.scene_dimensions),
            rand(samples, height, width, 3),
        )

    return make
