"""A small stream on closed formulas, and a made-up training step that answers its batches."""

from collections.abc import Iterator
from pathlib import Path

from ngi.clock.phase_clock import PhaseClock
from ngi.explore import (
    Always,
    ConstantTarget,
    Greedy,
    GrowingResolution,
    Loss,
    MarkovChains,
    NormalPerturbation,
    ProposalDistribution,
    ResolutionSchedule,
    Sampler,
    Target,
)
from ngi.learn.batch import Batch, Feedback
from ngi.learn.samples import PatchSamples
from ngi.learn.stream import TrainingStream
from ngi.render import AnalyticRenderer, PocketRenderer
from ngi.reuse import DrawingRule, FixedProbability, PatchArchive, PatchStore, Reuse, ReusePolicy

CHAINS = 4


def constant_resolution(pixels: int) -> GrowingResolution:
    return GrowingResolution(start=pixels, step=0, every=1, end=pixels)


def make(
    folder: Path,
    *,
    greedy: bool = True,
    target: Target | None = None,
    sampler: Sampler | None = None,
    proposal: ProposalDistribution | None = None,
    policy: ReusePolicy | None = None,
    rule: DrawingRule | None = None,
    schedule: ResolutionSchedule | None = None,
    capacity: int = 64,
    seed: int = 0,
    renderer: AnalyticRenderer | PocketRenderer | None = None,
    when_late: str = "wait",
    clock: PhaseClock | None = None,
    device: str = "cpu",
) -> TrainingStream:
    renderer = renderer or AnalyticRenderer(dimensions=3, patch_size=8)
    return TrainingStream(
        samples=PatchSamples(renderer=renderer),
        sampler=sampler
        or MarkovChains(
            chains=CHAINS,
            proposal=proposal
            or NormalPerturbation(large_step_probability=0.3, standard_deviation=0.05),
            target=target or (Loss() if greedy else ConstantTarget()),
            acceptance=Greedy(accept_equal=False) if greedy else Always(),
        ),
        reuse=Reuse(
            store=PatchStore(capacity=capacity, layout=renderer.layout, rule=rule, device=device),
            archive=PatchArchive(folder),
            policy=policy or FixedProbability(bootstrap_batches=3, probability=0.5),
            when_late=when_late,
        ),
        schedule=schedule or constant_resolution(24),
        clock=clock or PhaseClock(),
        seed=seed,
    )


def answer(batch: Batch) -> Feedback:
    """A loss that depends on the patch alone."""
    losses = batch.patches.log_radiance.mean(dim=(1, 2, 3))
    if batch.current is None:
        return Feedback(losses, None, None)
    return Feedback(losses, losses, batch.current.log_radiance.mean(dim=(1, 2, 3)))


def steps(stream: TrainingStream, count: int) -> Iterator[Batch]:
    batches = iter(stream)
    for _ in range(count):
        batch = next(batches)
        yield batch
        stream.feedback(answer(batch))
