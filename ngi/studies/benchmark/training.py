"""Training steps against the matrix rate of the machine, and scoring against training."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

import torch
from torch import nn

from ngi.explore import LossTimesOutputGradient, LossTimesStep, Target
from ngi.learn import PhaseClock, Scorer, patch_example
from ngi.machine.timing import in_turn
from ngi.models import EncodedGenerator, L1Dssim, MuonAdam, PatchLinear, PixelGenerator
from ngi.models.pixel_mlp import PixelMLP
from ngi.patches import BufferLayout, Patches
from ngi.studies.benchmark import PATCH_SIZE, PATCHES
from ngi.studies.benchmark.figures import Figure, figure, ratio

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


@dataclass(frozen=True)
class Learner:
    """What trains on a batch: a network, an optimiser, and as many patches as they are made for."""

    name: str
    layout: BufferLayout
    network: Callable[..., nn.Module]
    optimizer: Callable[[Iterable[nn.Parameter]], torch.optim.Optimizer]
    patches: int


PAPER = Learner("", BufferLayout(), PixelGenerator, partial(torch.optim.Adam, lr=1e-4), PATCHES)
OURS = Learner(
    "ours ",
    BufferLayout().adding(["direct"]),
    partial(EncodedGenerator, octaves=4, directions=True),
    MuonAdam,
    PATCHES // 2,
)


class Training:
    """Training steps of a network on one batch of random patches, on the GPU where there is one.

    bf16: whether the products run in bfloat16.
    """

    def __init__(self, features: int, layers: int, *, bf16: bool, learner: Learner = PAPER) -> None:
        self.device = "cuda" if torch.cuda.is_available() else "cpu"
        self.bf16 = bf16
        self.network = learner.network(
            layout=learner.layout,
            scene_dimensions=DIMENSIONS,
            hidden_features=features,
            hidden_layers=layers,
        ).to(self.device)
        self.optimizer = learner.optimizer(self.network.parameters())
        self.loss = L1Dssim(l1_weight=1.0, dssim_weight=1.0)
        patches = random_patches(learner.layout, DIMENSIONS, learner.patches)
        self.patches = patches.to(self.device)

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


def training(
    features: int, layers: int, bf16: bool, repeats: int, learner: Learner = PAPER
) -> list[Figure]:
    """A training step against the matrix rate, and scoring against a training step."""
    made = Training(features, layers, bf16=bf16, learner=learner)
    pixels = learner.patches * PATCH_SIZE**2
    dtype = torch.bfloat16 if bf16 else torch.float32
    left = torch.rand(pixels, features, device=made.device, dtype=dtype)
    right = torch.rand(features, features, device=made.device, dtype=dtype)
    products = 3 * layers

    def matrix_products() -> None:
        for _ in range(products):
            left @ right

    steps, matrices, adam, cheap = in_turn(
        repeats, f"training, {layers}x{features}", made.step, matrix_products,
        made.step_with(LossTimesStep()), made.step_with(LossTimesOutputGradient()),
    )  # fmt: skip
    operations = pixels * training_operations(made.network)
    peak = [2 * pixels * features**2 * products / t for t in matrices]
    name = f"{learner.name}{layers}x{features} {'bf16' if bf16 else 'fp32'}"
    half = "≥ 50 %" if bf16 and (features == 512 or learner is OURS) else ""
    share = [100 * operations / t / p for t, p in zip(steps, peak, strict=True)]
    return [
        figure(f"training step, share of the matrix rate ({name})", share, "%", half),
        figure(f"training step ({name})", [1e3 * t for t in steps], "ms"),
        figure(f"matrix rate ({name})", [p / 1e12 for p in peak], "TFLOP/s"),
        figure(f"step with scoring, loss × step / step ({name})", ratio(adam, steps), "×"),
        figure(f"step with scoring, output gradient / step ({name})", ratio(cheap, steps), "×"),
    ]  # fmt: skip


def training_operations(network: nn.Module) -> int:
    """Floating-point operations in the matrix products of a step, per pixel.

    Output, gradient of the weights and gradient of the input are one product each per weight;
    buffers need no gradient, and v meets its weights once per patch, which is left out.
    """
    products = 0
    for part in network.modules():
        if isinstance(part, PatchLinear):
            *pixel_features, _ = part.widths
            products += 2 * sum(pixel_features) * part.out_features
            if part is not network.input_layer:
                products += pixel_features[0] * part.out_features
        elif isinstance(part, PixelMLP):
            first, *later = part.weights
            products += 2 * sum(weight.numel() for weight in part.weights)
            products += sum(len(first) * len(weight) for weight in later)
    return 2 * products
