"""Training steps against the matrix rate of the machine, and scoring against training."""

from __future__ import annotations

from collections.abc import Callable

import torch

from ngi.benchmark.figures import Figure, figure, in_turn, ratio
from ngi.explore import LossTimesOutputGradient, LossTimesStep
from ngi.learn import PhaseClock, Scorer
from ngi.models import L1Dssim, PatchLinear, PixelGenerator
from ngi.patches import BufferLayout, Patches

PATCHES = 16
PATCH_SIZE = 32


def random_patches(layout: BufferLayout, dimensions: int, count: int = PATCHES) -> Patches:
    generator = torch.Generator().manual_seed(0)
    shape = (count, PATCH_SIZE, PATCH_SIZE)
    return Patches(
        scene_vector=torch.rand(count, dimensions, generator=generator),
        position=torch.rand(count, 2, generator=generator),
        resolution=torch.full((count,), 128),
        large_step=torch.ones(count, dtype=torch.bool),
        buffers=torch.rand(*shape, layout.channels, generator=generator),
        log_radiance=torch.rand(*shape, 3, generator=generator),
    )


def training(
    features: int, layers: int, bf16: bool, repeats: int, dimensions: int = 12
) -> list[Figure]:
    """A training step against the matrix rate, and scoring against a training step."""
    device = "cuda" if torch.cuda.is_available() else "cpu"
    dtype = torch.bfloat16 if bf16 else torch.float32
    layout = BufferLayout()
    network = PixelGenerator(
        layout=layout, scene_dimensions=dimensions, hidden_features=features, hidden_layers=layers
    ).to(device)
    optimizer = torch.optim.Adam(network.parameters(), lr=1e-4)
    loss = L1Dssim(l1_weight=1.0, dssim_weight=1.0)
    patches = random_patches(layout, dimensions).to(device)
    pixels = PATCHES * PATCH_SIZE**2

    def step() -> None:
        optimizer.zero_grad()
        with torch.autocast(device, torch.bfloat16, enabled=bf16):
            prediction = network(patches.buffers, patches.scene_vector)
        loss(prediction, patches.log_radiance).mean().backward()
        optimizer.step()

    left = torch.rand(pixels, features, device=device, dtype=dtype)
    right = torch.rand(features, features, device=device, dtype=dtype)
    products = 3 * layers

    def matrix_products() -> None:
        for _ in range(products):
            left @ right

    clock = PhaseClock()

    def step_with(target: LossTimesStep | LossTimesOutputGradient) -> Callable[[], None]:
        scorer = Scorer(target=target, network=network, loss=loss, clock=clock)

        def scored_step() -> None:
            optimizer.zero_grad()
            with torch.autocast(device, torch.bfloat16, enabled=bf16):
                with scorer.watch(patches, patches, optimizer) as score:
                    prediction = network(patches.buffers, patches.scene_vector)
                    losses = loss(prediction, patches.log_radiance)
                proposed, _ = score(prediction, losses)
            losses.mean().backward()
            proposed()
            optimizer.step()

        return scored_step

    steps, matrices, adam, cheap = in_turn(
        repeats, f"training, {layers}x{features}", step, matrix_products,
        step_with(LossTimesStep()), step_with(LossTimesOutputGradient()),
    )  # fmt: skip
    operations = training_operations(network)
    peak = [2 * pixels * features**2 * products / t for t in matrices]
    name = f"{layers}x{features} {'bf16' if bf16 else 'fp32'}"
    half = "≥ 50 %" if bf16 and features == 512 else ""
    share = [100 * operations / t / p for t, p in zip(steps, peak, strict=True)]
    return [
        figure(f"training step, share of the matrix rate ({name})", share, "%", half),
        figure(f"training step ({name})", [1e3 * t for t in steps], "ms"),
        figure(f"matrix rate ({name})", [p / 1e12 for p in peak], "TFLOP/s"),
        figure(f"step with scoring, loss × step / step ({name})", ratio(adam, steps), "×"),
        figure(f"step with scoring, output gradient / step ({name})", ratio(cheap, steps), "×"),
    ]  # fmt: skip


def training_operations(network: PixelGenerator) -> int:
    """Floating-point operations in the matrix products of a step on 16 patches.

    Output, gradient of the weights and gradient of the input are one product each per weight and
    pixel; buffers need no gradient, and v meets its weights once per patch, which is left out.
    """
    products = 0
    for layer in network.modules():
        if isinstance(layer, PatchLinear):
            *pixel_features, _ = layer.widths
            products += 2 * sum(pixel_features) * layer.out_features
            if layer is not network.input_layer:
                products += pixel_features[0] * layer.out_features
    return 2 * PATCHES * PATCH_SIZE**2 * products
