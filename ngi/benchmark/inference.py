"""Frames of a viewer: buffers from Mitsuba, radiance from the paper's network."""

from __future__ import annotations

import torch

from ngi.benchmark.figures import Figure, figure, in_turn
from ngi.benchmark.scenes import Scene
from ngi.models import PixelGenerator
from ngi.models.patch_linear import PatchLinear
from ngi.render.mitsuba_renderer import MitsubaRenderer

FEATURES, LAYERS = 512, 8
"""Of the paper's network."""
RESOLUTIONS = {"cpu": (256,), "cuda": (256, 900)}
CHUNK = 65_536
"""Rows of the matrix products that give the machine's rate; pixels of a chunk of the network."""


def inference(
    scene: Scene, *, repeats: int, features: int = FEATURES, layers: int = LAYERS
) -> list[Figure]:
    """Milliseconds of buffers and network in bf16, v new in each frame, and frames per second."""
    device = "cuda" if torch.cuda.is_available() else "cpu"
    renderer = MitsubaRenderer(scene=scene.read())
    network = PixelGenerator(
        layout=renderer.layout,
        scene_dimensions=renderer.dimensions,
        hidden_features=features,
        hidden_layers=layers,
    ).to(device)
    title = f"{layers}x{features} bf16"
    return [
        figure
        for resolution in RESOLUTIONS[device]
        for figure in _frames(renderer, network, device, resolution, repeats, title)
    ]


def _frames(
    renderer: MitsubaRenderer,
    network: PixelGenerator,
    device: str,
    resolution: int,
    repeats: int,
    title: str,
) -> list[Figure]:
    generator = torch.Generator().manual_seed(0)
    v = torch.rand(renderer.dimensions, generator=generator)
    buffers = renderer.image_buffers(v, resolution=resolution)

    def render_buffers() -> None:
        v.copy_(torch.rand(renderer.dimensions, generator=generator))
        buffers.copy_(renderer.image_buffers(v, resolution=resolution))

    def show() -> None:
        with torch.autocast(device, torch.bfloat16):
            network.render(buffers.to(device), v.to(device), pixels_per_chunk=CHUNK).cpu()

    features = network.input_layer.out_features
    left = torch.rand(CHUNK, features, device=device, dtype=torch.bfloat16)
    right = torch.rand(features, features, device=device, dtype=torch.bfloat16)

    def matrix_product() -> None:
        left @ right

    of_buffers, of_network, of_product = in_turn(
        repeats, f"inference, {resolution} pixels", render_buffers, show, matrix_product
    )
    operations = 2 * resolution**2 * products_per_pixel(network)
    rates = [2 * CHUNK * features**2 / t for t in of_product]
    shares = [100 * operations / t / rate for t, rate in zip(of_network, rates, strict=True)]
    frames = [1 / (a + b) for a, b in zip(of_buffers, of_network, strict=True)]
    size = f"{resolution} × {resolution}"
    return [
        figure(f"buffers, {size}", [1e3 * t for t in of_buffers], "ms"),
        figure(f"network {title}, {size}", [1e3 * t for t in of_network], "ms"),
        figure(f"both, {size}", frames, "frames/s"),
        figure(f"network {title}, {size}, share of the matrix rate", shares, "%"),
    ]


def products_per_pixel(network: PixelGenerator) -> int:
    """Multiplications of a pixel's features and buffers with weights; v enters as a bias."""
    return sum(
        sum(layer.widths[:-1]) * layer.out_features
        for layer in network.modules()
        if isinstance(layer, PatchLinear)
    )
