from functools import partial

import pytest
import torch

from ngi.machine.backend import activate, llvm_problem
from ngi.scene.variable_scene import VariableScene
from ngi.studies.benchmark import PATCH_SIZE, PATCHES, measure, overhead
from ngi.studies.benchmark.batches import Batches
from ngi.studies.benchmark.measure import STEPS, FixedLaunch, counted_kernels, timed_steps
from ngi.studies.benchmark.scenes import shipped

[CORNELL_BOX] = shipped(["cornell-box"])

needs_llvm = pytest.mark.skipif(llvm_problem() is not None, reason=str(llvm_problem()))


def test_steps_are_given_per_patch_and_as_shares_of_the_batch() -> None:
    batch = {step: 0.016 * number for number, step in enumerate(STEPS)}  # 0 to 6 ms per patch
    batch |= {overhead.REST: 0.016 * 9, overhead.BATCH: 0.016 * 30}
    figures = overhead.step_figures([batch, batch], patches=16)
    milliseconds = {f.name: f.median for f in figures if f.unit == "ms"}
    shares = {f.name: f.median for f in figures if f.unit == "%"}
    assert milliseconds["copying"] == pytest.approx(6)
    assert milliseconds[overhead.BATCH] == pytest.approx(30)
    assert shares["copying"] == pytest.approx(100 * 6 / 30)
    assert sum(shares.values()) == pytest.approx(100)


def test_a_step_inside_a_step_counts_once(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0

    def take(seconds: float) -> None:
        nonlocal now
        now += seconds

    monkeypatch.setattr(measure.time, "perf_counter", lambda: now)
    steps = measure._Steps()
    inner = steps.timed("acceleration structure", partial(take, 4))

    def apply() -> None:
        take(1)
        inner()
        take(2)

    for _ in range(2):
        steps.timed("parameters", apply)()
    assert steps.seconds["parameters"] == 6
    assert steps.seconds["acceleration structure"] == 8


@pytest.mark.parametrize(("samples", "patches"), [(16, 16), (2048, 16), (2049, 4), (24_000, 1)])
def test_a_batch_of_very_many_paths_has_fewer_patches(samples: int, patches: int) -> None:
    assert overhead.patches_of_batch(samples) == patches


@needs_llvm
@pytest.mark.parametrize("samples", [3, 16])
def test_the_fixed_launch_is_warm_after_its_warm_up(samples: int) -> None:
    activate("llvm")
    fixed = FixedLaunch(CORNELL_BOX.read(), paths=16 * samples, samples_per_pixel=samples)
    fixed.warm_up()
    with counted_kernels() as kernels:
        fixed.trace(seed=1)
    assert kernels.compiled == 0


@needs_llvm
def test_timing_the_steps_reaches_each_and_changes_nothing() -> None:
    renderer = Batches(CORNELL_BOX.read, samples_per_pixel=1).renderer
    states = torch.rand(2, renderer.dimensions + 2, generator=torch.Generator().manual_seed(0))
    plain = renderer.render_patches(states, resolution=128, seed=0)
    apply = VariableScene.apply
    with timed_steps() as seconds:
        timed = renderer.render_patches(states, resolution=128, seed=0)
    assert VariableScene.apply is apply
    torch.testing.assert_close(timed.log_radiance, plain.log_radiance, rtol=0, atol=0)
    torch.testing.assert_close(timed.buffers, plain.buffers, rtol=0, atol=0)
    assert tuple(seconds) == STEPS
    assert all(value > 0 for value in seconds.values())


@needs_llvm
@pytest.mark.usefixtures("here")
def test_the_overhead_of_a_scene() -> None:
    figures = overhead.overhead(CORNELL_BOX, samples_per_pixel=16, repeats=1, seconds=60)
    measured = {f.name: f for f in figures if f.part == "overhead"}
    assert measured["patches per batch"].median == 16
    assert measured["samples per pixel"].median == 16
    ratio = measured["batch / fixed launch, equal paths"]
    assert ratio.limit == "≤ 2"
    paths_per_patch = 16 * PATCH_SIZE**2
    patch, paths = measured["patch"].median, measured["paths traced"].median
    assert paths == pytest.approx(paths_per_patch / (1e-3 * patch) / 1e6)


@needs_llvm
def test_everything_is_new_in_every_batch() -> None:
    batches = Batches(CORNELL_BOX.read, samples_per_pixel=2)
    asked: list[tuple[torch.Tensor, int, int]] = []
    start = batches.renderer.start_patches

    def listen(states: torch.Tensor, *, resolution: int, seed: int):
        asked.append((states, resolution, seed))
        return start(states, resolution=resolution, seed=seed)

    batches.renderer.start_patches = listen  # type: ignore[method-assign]
    batches.render(2)
    (first, small, seed), (second, large, other) = asked
    assert len(first) == PATCHES
    assert not (first == second).any()
    assert (small, seed) != (large, other)
