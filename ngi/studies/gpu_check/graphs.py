"""CUDA graphs against kernels that are launched one by one: seconds, and the numbers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import torch
from torch import Tensor

from ngi.learn.captured_pass import CapturedPass
from ngi.machine.captured import Captured
from ngi.machine.timing import in_turn
from ngi.studies.benchmark.figures import Figure, figure, ratio
from ngi.studies.benchmark.training import DIMENSIONS, OURS, PAPER, Learner, Training
from ngi.studies.gpu_check.item import Outcome

LEARNERS = {"paper": PAPER, "ours": OURS}


def steps(name: str, *, features: int, layers: int, repeats: int) -> Outcome:
    """Training steps in bfloat16 on stored patches; both ways from the same weights."""
    learner = LEARNERS[name]
    launched, recorded = (_training(learner, features, layers) for _ in range(2))
    captured = CapturedPass(
        recorded.network,
        recorded.loss,
        precision=partial(torch.autocast, recorded.device, torch.bfloat16),
    )
    patches = recorded.patches
    example = (patches.buffers, patches.scene_vector), patches.log_radiance

    def step() -> None:
        captured(example, None)
        recorded.optimizer.step()

    title = f"step, {name} {layers}x{features}"
    seconds = in_turn(repeats, title, launched.step, step)
    networks = launched.network, recorded.network
    weights = [
        torch.cat([p.detach().flatten() for p in network.parameters()]) for network in networks
    ]
    return _outcome(title, seconds, weights)


def frames(*, features: int, layers: int, resolution: int, repeats: int) -> Outcome:
    """Images by the paper's network in bfloat16, of buffers that are there."""
    made = _training(PAPER, features, layers)
    buffers = torch.rand(resolution, resolution, PAPER.layout.channels, device=made.device)
    v = torch.rand(DIMENSIONS, device=made.device)

    def render(*inputs: Tensor) -> tuple[Tensor]:
        return (made.network.render(*inputs),)  # type: ignore[operator]

    def shown(image: Callable[..., tuple[Tensor]]) -> Tensor:
        with torch.autocast(made.device, torch.bfloat16):
            return image(buffers, v)[0]

    captured = Captured(render, module=made.network, name="images")
    ways = [partial(shown, way) for way in (render, captured)]
    title = f"frame, {layers}x{features}, {resolution} × {resolution}"
    seconds = in_turn(repeats, title, *ways)
    return _outcome(title, seconds, [way().clone() for way in ways])


def _training(learner: Learner, features: int, layers: int) -> Training:
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(0)
        return Training(features, layers, bf16=True, learner=learner)


def _outcome(title: str, seconds: list[list[float]], numbers: list[Tensor]) -> Outcome:
    """Both of kernels launched one by one first, then of the graph."""
    launched, recorded = ([1e3 * t for t in times] for times in seconds)
    apart = float((numbers[0] - numbers[1]).abs().max())
    figures: list[Figure] = [
        figure(f"{title}, kernel by kernel", launched, "ms"),
        figure(f"{title}, as a graph", recorded, "ms"),
        figure(f"{title}, gained", ratio(launched, recorded), "×"),
        figure(f"{title}, largest difference of a number", [apart], "", "0"),
    ]
    without = not torch.cuda.is_available()
    return Outcome(figures, ["no GPU: kernel by kernel twice"] if without else [])
