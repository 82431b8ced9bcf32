"""Measures the speed of generation, training, scoring and the store, as ratios inside one run.

`python -m ngi.benchmark` prints a table and writes it as JSON. A ratio compares two things timed
in turn within one process, so that a slow or busy machine slows both; every figure is a median
with its quartiles.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import torch
from tqdm import tqdm

from ngi.backend import activate, describe
from ngi.explore import LossTimesOutputGradient, LossTimesStep
from ngi.learn import PhaseClock, Scorer
from ngi.memory import keep_freed_memory
from ngi.models import L1Dssim, PatchLinear, PixelGenerator
from ngi.patches import BufferLayout, Patches
from ngi.provenance import provenance
from ngi.reuse import PatchStore
from ngi.scene import read_scene, scenes

PATCHES = 16
PATCH_SIZE = 32
NETWORKS = ((512, 8, True), (128, 6, False), (128, 6, True))
"""Hidden features, hidden layers, bf16: the paper's network, and the demo's."""
STORED_PATCHES = 1024


@dataclass(frozen=True)
class Figure:
    """One measured number with its quartiles; `limit` is what it is meant to reach, if anything."""

    name: str
    median: float
    lower: float
    upper: float
    unit: str
    limit: str = ""


def figure(name: str, values: Sequence[float], unit: str, limit: str = "") -> Figure:
    quartiles = statistics.quantiles(values, n=4) if len(values) > 1 else [values[0]] * 3
    return Figure(name, statistics.median(values), quartiles[0], quartiles[2], unit, limit)


def in_turn(repeats: int, title: str, *functions: Callable[[], object]) -> list[list[float]]:
    """Seconds of each function, called in turn `repeats` times after a warm-up of one."""
    seconds: list[list[float]] = [[] for _ in functions]
    for function in functions:
        function()
    for _ in tqdm(range(repeats), desc=title, leave=False):
        for function, times in zip(functions, seconds, strict=True):
            start = time.perf_counter()
            function()
            if torch.cuda.is_available():
                torch.cuda.synchronize()
            times.append(time.perf_counter() - start)
    return seconds


def ratio(numerator: Sequence[float], denominator: Sequence[float]) -> list[float]:
    return [a / b for a, b in zip(numerator, denominator, strict=True)]


def generation(scene: str, samples_per_pixel: int, repeats: int) -> list[Figure]:
    """16 patches with every variable, position and resolution new, against one fixed launch."""
    from ngi.render.measure import FixedLaunch, counted_compilations
    from ngi.render.mitsuba_renderer import MitsubaRenderer

    description = read_scene(**scenes()[scene])
    renderer = MitsubaRenderer(
        scene=description, patch_size=PATCH_SIZE, samples_per_pixel=samples_per_pixel
    )
    paths = PATCHES * PATCH_SIZE**2 * samples_per_pixel
    fixed = FixedLaunch(description, paths=paths, samples_per_pixel=samples_per_pixel)
    generator = torch.Generator().manual_seed(0)
    calls = iter(range(1_000_000))

    def varying() -> None:
        call = next(calls)
        states = torch.rand(PATCHES, renderer.dimensions + 2, generator=generator)
        renderer.render_patches(states, resolution=128 + 4 * (call % 100), seed=call)

    ours, theirs = in_turn(
        repeats, f"generation, {scene}", varying, lambda: fixed.trace(next(calls))
    )
    with counted_compilations() as compiled:
        for _ in range(repeats):
            varying()
    title = f"{scene}, {samples_per_pixel} spp"
    patches = f"in {repeats * PATCHES} patches"
    return [
        figure(f"batch / fixed launch, equal paths ({title})", ratio(ours, theirs), "×", "≤ 1.5"),
        figure(f"batch of {PATCHES} patches ({title})", ours, "s"),
        figure(f"paths traced ({title})", [paths / t / 1e6 for t in ours], "Mpaths/s"),
        figure("kernels compiled after warm-up", compiled, patches, "0"),
    ]  # fmt: skip


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


def store(dimensions: int, count: int, repeats: int) -> list[Figure]:
    """Memory per patch, the error of half precision, and the time of a draw."""
    layout = BufferLayout()
    patches = PatchStore(capacity=count, layout=layout)
    original = random_patches(layout, dimensions)
    ids = patches.add(original)
    error = (patches.get(ids).log_radiance - original.log_radiance).abs().max().item()
    for _ in range(count // PATCHES - 1):
        ids = patches.add(original)
        patches.update(ids, torch.rand(PATCHES))
    generator = torch.Generator().manual_seed(0)
    (draws,) = in_turn(repeats, "store", lambda: patches.get(patches.draw(PATCHES, generator)))
    size = patches.bytes_per_patch
    title = f"{dimensions} variables"
    return [
        figure(f"store, memory per patch ({title})", [size], "bytes", "≤ 48,000"),
        figure("store, largest error of half precision, log1p radiance in [0, 1]", [error], ""),
        figure(f"store, drawing {PATCHES} of {count:,} patches", [1e3 * t for t in draws], "ms"),
    ]  # fmt: skip


def table(figures: Sequence[Figure]) -> str:
    width = max(len(f.name) for f in figures)
    return "\n".join(
        f"{f.name:<{width}}  {f.median:9.4g} {f.unit}"
        + (f"  ({f.lower:.4g} – {f.upper:.4g})" if f.lower != f.upper else "")
        + (f"  wanted {f.limit}" if f.limit else "")
        for f in figures
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `python -m ngi.benchmark` and `ngi-benchmark`."""
    parser = argparse.ArgumentParser(prog="ngi.benchmark", description=__doc__)
    parser.add_argument("--scene", default="sphere-caustic", choices=sorted(scenes()))
    parser.add_argument("--samples-per-pixel", type=int, default=64)
    parser.add_argument("--repeats", type=int, default=20, help="timings per figure")
    parser.add_argument("--output", type=Path, default=Path("outputs/benchmark.json"))
    chosen = parser.parse_args(arguments)
    keep_freed_memory()
    figures = [
        *generation(chosen.scene, chosen.samples_per_pixel, chosen.repeats),
        *(f for network in NETWORKS for f in training(*network, repeats=chosen.repeats)),
        *store(dimensions=12, count=STORED_PATCHES, repeats=chosen.repeats),
        *store(dimensions=128, count=STORED_PATCHES, repeats=chosen.repeats),
    ]
    print(table(figures))
    chosen.output.parent.mkdir(parents=True, exist_ok=True)
    report = {**provenance(backend=describe(activate())), "figures": [asdict(f) for f in figures]}
    chosen.output.write_text(json.dumps(report, indent=2))
    print(f"\nwritten to {chosen.output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
