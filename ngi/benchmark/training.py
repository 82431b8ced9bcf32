"""Training steps against the matrix rate of the machine, and scoring against training."""

from __future__ import annotations

from collections.abc import Callable

import torch

from ngi.benchmark import PATCH_SIZE, PATCHES
from ngi.benchmark.figures import Figure, figure, in_turn, ratio
from ngi.explore import LossTimesOutputGradient, LossTimesStep, Target
from ngi.learn import PhaseClock, Scorer, patch_example
from ngi.models import L1Dssim, PatchLinear, PixelGenerator
from ngi.patches import BufferLayout, Patches

DIMENSIONS = 12
"""Of the scene vector."""


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


class Training:
    """Training steps of a network on one batch of random patches, on the GPU where there is one.

    bf16: whether the products run in bfloat16.
    """

    def __init__(self, features: int, layers: int, *, bf16: bool) -> None:
        self.device = "cuda" if torch.cuda.is_available() else "cpu"
        self.bf16 = bf16
        layout = BufferLayout()
        self.network = PixelGenerator(
            layout=layout,
            scene_dimensions=DIMENSIONS,
            hidden_features=features,
            hidden_layers=layers,
        ).to(self.device)
        self.optimizer = torch.optim.Adam(self.network.parameters(), lr=1e-4)
        self.loss = L1Dssim(l1_weight=1.0, dssim_weight=1.0)
        self.patches = random_patches(layout, DIMENSIONS).to(self.device)

    def step(self) -> None:
        self.optimizer.zero_grad()
        with torch.autocast(self.device, torch.bfloat16, enabled=self.bf16):
            prediction = self.network(self.patches.buffers, self.patches.scene_vector)
        self.loss(prediction, self.patches.log_radiance).mean().backward()
        self.optimizer.step()

    def step_with(self, target: Target) -> Callable[[], None]:
        """A step that scores the batch as proposals and, in a pass of its own, as the current."""
        patches = self.patches
        scorer = Scorer(
            target=target,
            network=self.network,
            loss=self.loss,
            clock=PhaseClock(),
            example=patch_example,
        )

        def scored_step() -> None:
            self.optimizer.zero_grad()
            with torch.autocast(self.device, torch.bfloat16, enabled=self.bf16):
                with scorer.watch(patches, patches, self.optimizer) as score:
                    prediction = self.network(patches.buffers, patches.scene_vector)
                    losses = self.loss(prediction, patches.log_radiance)
                proposed, _ = score(prediction, losses)
            losses.mean().backward()
            proposed()
            self.optimizer.step()

        return scored_step


def training(features: int, layers: int, bf16: bool, repeats: int) -> list[Figure]:
    """A training step against the matrix rate, and scoring against a training step."""
    ours = Training(features, layers, bf16=bf16)
    pixels = PATCHES * PATCH_SIZE**2
    dtype = torch.bfloat16 if bf16 else torch.float32
    left = torch.rand(pixels, features, device=ours.device, dtype=dtype)
    right = torch.rand(features, features, device=ours.device, dtype=dtype)
    products = 3 * layers

    def matrix_products() -> None:
        for _ in range(products):
            left @ right

    steps, matrices, adam, cheap = in_turn(
        repeats, f"training, {layers}x{features}", ours.step, matrix_products,
        ours.step_with(LossTimesStep()), ours.step_with(LossTimesOutputGradient()),
    )  # fmt: skip
    operations = training_operations(ours.network)
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
