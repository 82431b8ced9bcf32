"""Frames of a viewer: buffers from Mitsuba, radiance from the paper's network."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import torch

from ngi.machine.precision import dtype_of, fast_precision
from ngi.machine.timing import in_turn
from ngi.methods.path_tracing.frame_time import show
from ngi.models import ImageLinear, PatchLinear, PixelGenerator
from ngi.render.mitsuba_renderer import MitsubaRenderer
from ngi.studies.benchmark.figures import Figure, figure
from ngi.studies.benchmark.scenes import Scene

FEATURES, LAYERS = 512, 8
"""Of the paper's network."""
RESOLUTIONS = {"cpu": (256,), "cuda": (256, 900)}
WANTED = {("cpu", 256): "≥ 5 with bf16 matrix units", ("cuda", 900): "≥ 60"}
"""Frames per second in bf16."""
ROWS, PRODUCTS = 8_192, 8
"""Of the matrix products that give the machine's rate: their rows stay in its caches."""


def inference(
    scene: Scene,
    *,
    repeats: int,
    seconds: float,
    features: int = FEATURES,
    layers: int = LAYERS,
) -> list[Figure]:
    """Frames per second of buffers, of the network in each precision, and of both; v is always new.

    The network is also compared with plain products of its hidden layers' size, timed in turn.
    """
    device = "cuda" if torch.cuda.is_available() else "cpu"
    renderer = MitsubaRenderer(scene=scene.read())
    network = PixelGenerator(
        layout=renderer.layout,
        scene_dimensions=renderer.dimensions,
        hidden_features=features,
        hidden_layers=layers,
    ).to(device)
    return [
        figure
        for resolution in RESOLUTIONS[device]
        for figure in _frames(renderer, network, resolution, repeats=repeats, seconds=seconds)
    ]


def precisions() -> dict[str, torch.dtype]:
    """By name; bfloat16 only where the machine does not have to emulate it."""
    fast = dtype_of(fast_precision())
    return {"fp32": fast} if fast == torch.float32 else {"bf16": fast, "fp32": torch.float32}


def _frames(
    renderer: MitsubaRenderer,
    network: PixelGenerator,
    resolution: int,
    *,
    repeats: int,
    seconds: float,
) -> list[Figure]:
    generator = torch.Generator().manual_seed(0)
    v = torch.rand(renderer.dimensions, generator=generator)
    buffers = renderer.image_buffers(v, resolution=resolution)

    def render_buffers() -> None:
        v.copy_(torch.rand(renderer.dimensions, generator=generator))
        buffers.copy_(renderer.image_buffers(v, resolution=resolution))

    functions: list[Callable[[], object]] = [render_buffers]
    for precision in precisions().values():
        shown = partial(show, network, buffers, v, precision=precision)
        functions += [shown, products(network, precision)]
    title = f"inference, {resolution} pixels"
    of_buffers, *others = in_turn(repeats, title, *functions, seconds=seconds)
    size = f"{resolution} × {resolution}"
    figures = [figure(f"buffers, {size}", _per_second(of_buffers), "frames/s")]
    for name, of_network, of_products in zip(precisions(), others[::2], others[1::2], strict=True):
        features, layers = network.input_layer.out_features, len(network.hidden) + 1
        device = network.input_layer.weight.device.type
        wanted = WANTED.get((device, resolution), "") if name == "bf16" else ""
        both = [a + b for a, b in zip(of_buffers, of_network, strict=True)]
        rates = [2 * PRODUCTS * ROWS * features**2 / t for t in of_products]
        operations = 2 * resolution**2 * products_per_pixel(network)
        shares = [100 * operations / t / rate for t, rate in zip(of_network, rates, strict=True)]
        title = f"network {layers}x{features} {name}, {size}"
        figures += [
            figure(title, _per_second(of_network), "frames/s"),
            figure(f"buffers and {title}", _per_second(both), "frames/s", wanted),
            figure(f"{title}, share of the matrix rate", shares, "%"),
            figure(
                f"matrix rate, {name}, beside {size}", [rate / 1e12 for rate in rates], "TFLOP/s"
            ),
        ]
    return figures


def _per_second(seconds: Sequence[float]) -> list[float]:
    return [1 / t for t in seconds]


def products(network: PixelGenerator, precision: torch.dtype) -> Callable[[], None]:
    """Products of a hidden layer's features with its weights, and nothing else."""
    features, device = network.input_layer.out_features, network.input_layer.weight.device
    rows = torch.rand(ROWS, features, device=device, dtype=precision)
    weight = torch.rand(features, features, device=device, dtype=precision)
    layer = ImageLinear(weight, weight[0])

    def multiply() -> None:
        for _ in range(PRODUCTS):
            layer(rows)

    return multiply


def products_per_pixel(network: PixelGenerator) -> int:
    """Multiplications of a pixel's features and buffers with weights; v enters as a bias."""
    return sum(
        sum(layer.widths[:-1]) * layer.out_features
        for layer in network.modules()
        if isinstance(layer, PatchLinear)
    )
