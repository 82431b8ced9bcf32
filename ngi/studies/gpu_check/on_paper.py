"""What a training step and a frame would take on a GPU: bytes, operations, launches.

    python -m ngi.studies.gpu_check.on_paper

Nothing is computed: the step runs on tensors without numbers (PyTorch's 'meta' device), and every
operator's operands are counted as read and written once. Kernels that fuse operators, as
torch.compile makes them, would move fewer bytes; caches, too.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any
from unittest import mock

import torch
from torch import Tensor, nn
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_leaves
from torch.utils.flop_counter import flop_registry

from ngi.models import L1Dssim, MuonAdam
from ngi.studies.benchmark import PATCH_SIZE
from ngi.studies.benchmark.training import DIMENSIONS, OURS, PAPER, Learner, random_patches


@dataclass(frozen=True)
class Card:
    """By its data sheet. bf16: dense products, FLOP/s; memory: bytes/s

    launch: seconds between two launches of small kernels by PyTorch; graph: within a CUDA graph.
    Both are rules of thumb, not of the data sheet.
    """

    name: str
    bf16: float
    memory: float
    launch: float = 5e-6
    graph: float = 1.5e-6


H100 = Card("H100 SXM", bf16=989e12, memory=3.35e12)

PAPER_STEPS, PAPER_PATCHES, PAPER_SAMPLES = 236_000, 37_000, (200, 24_000)
"""Of the paper's whole training, its scenes' samples per pixel being between these."""
MINUTES = 15.0


class Counted(TorchDispatchMode):
    """Counts what is launched while it lasts, views left out."""

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self.launches = 0
        self.bytes = 0
        self.operations = 0

    def __torch_dispatch__(
        self, operator: Any, types: Any, args: Any = (), kwargs: dict[str, Any] | None = None
    ) -> Any:
        result = operator(*args, **(kwargs or {}))
        moves = [t for t in tree_leaves((args, kwargs, result)) if isinstance(t, Tensor)]
        if not _is_view(operator) and any(t.device.type == "meta" for t in moves):
            self.launches += 1
            self.bytes += sum(t.numel() * t.element_size() for t in moves)
            if (formula := flop_registry.get(operator.overloadpacket)) is not None:
                self.operations += formula(*args, **(kwargs or {}), out_val=result)
        return result


def _is_view(operator: Any) -> bool:
    arguments = operator._schema.arguments
    return any(a.alias_info is not None and not a.alias_info.is_write for a in arguments)


def counted(work: Callable[[], object]) -> Counted:
    """What the work launches."""
    found = Counted()
    with _without_autocast(), found:
        work()
    return found


@contextmanager
def _without_autocast() -> Iterator[None]:
    """Which does not know the device 'meta'."""
    with (
        mock.patch.object(torch, "is_autocast_enabled", return_value=False),
        mock.patch.object(torch, "autocast", return_value=nullcontext()),
    ):
        yield


def made(learner: Learner, features: int, layers: int) -> nn.Module:
    """The network, without numbers."""
    return learner.network(
        layout=learner.layout,
        scene_dimensions=DIMENSIONS,
        hidden_features=features,
        hidden_layers=layers,
    ).to("meta")


def step(learner: Learner, features: int, layers: int) -> Counted:
    """Of a training step on stored patches, the second of a run."""
    network = made(learner, features, layers)
    rule = MuonAdam if learner is OURS else partial(torch.optim.Adam, foreach=True)
    optimizer = rule(network.parameters())
    patches = random_patches(learner.layout, DIMENSIONS, learner.patches).to("meta")
    loss = L1Dssim(l1_weight=1.0, dssim_weight=1.0)

    def take() -> None:
        optimizer.zero_grad()
        prediction = network(patches.buffers, patches.scene_vector)
        loss(prediction, patches.log_radiance).mean().backward()
        optimizer.step()

    counted(take)
    return counted(take)


def frame(learner: Learner, features: int, layers: int, *, width: int, height: int) -> Counted:
    """Of an image by the network, its buffers being there."""
    network = made(learner, features, layers)
    buffers = torch.zeros(height, width, learner.layout.channels, device="meta")
    v = torch.zeros(DIMENSIONS, device="meta")
    render: Callable[..., Tensor] = network.render  # type: ignore[assignment]
    return counted(lambda: render(buffers, v))


def milliseconds(found: Counted, card: Card) -> dict[str, float]:
    """What would bound it, each by itself. Bytes are those of float32; bf16 halves most of them."""
    return {
        "bf16 products": 1e3 * found.operations / card.bf16,
        "memory": 1e3 * found.bytes / card.memory,
        "launches": 1e3 * found.launches * card.launch,
        "graph": 1e3 * found.launches * card.graph,
    }


def table(card: Card = H100) -> str:
    """Markdown: a row per step and frame."""
    work = {
        "step, 8×512, 16 patches": (step(PAPER, 512, 8), f"{1e3 * 60 * MINUTES / PAPER_STEPS:.2f}"),
        "step, ours 8×512, 8 patches": (step(OURS, 512, 8), " "),
        "step, ours 6×128, 8 patches": (step(OURS, 128, 6), " "),
        "frame, 8×512, 900×900": (frame(PAPER, 512, 8, width=900, height=900), f"{1e3 / 120:.2f}"),
        "frame, ours 6×128, 1080p": (frame(OURS, 128, 6, width=1920, height=1080), "4.00"),
    }
    lines = [
        "| | GFLOP | GB | launches | bf16 products, ms | memory, ms | launches, ms "
        "| in a graph, ms | wanted, ms |",
        "| :-- |" + " --: |" * 8,
    ]
    for name, (found, wanted) in work.items():
        numbers = [found.operations / 1e9, found.bytes / 1e9]
        bounds = milliseconds(found, card).values()
        cells = [*(f"{x:.3g}" for x in numbers), str(found.launches), *(f"{x:.3g}" for x in bounds)]
        lines.append(f"| {name} | {' | '.join(cells)} | {wanted} |")
    return "\n".join(lines)


def paths_per_second() -> tuple[float, float]:
    """That the paper's patches take within `MINUTES`, at the fewest and the most samples."""
    pixels = PAPER_PATCHES * PATCH_SIZE**2 / (60 * MINUTES)
    few, many = PAPER_SAMPLES
    return pixels * few, pixels * many


def main() -> int:
    """Entry point."""
    few, many = paths_per_second()
    print(f"{H100.name}\n\n{table()}\n")
    print(
        f"{PAPER_STEPS:,} steps in {MINUTES:g} minutes are {PAPER_STEPS / 60 / MINUTES:.0f} a "
        f"second; {PAPER_PATCHES:,} patches at {PAPER_SAMPLES[0]} to {PAPER_SAMPLES[1]:,} samples "
        f"per pixel are {few / 1e6:.1f} to {many / 1e6:,.0f} million paths a second"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
