"""The cost of asking the network where to look, against that of rendering what is there."""

from __future__ import annotations

from functools import partial

from ngi.explore import LossTimesStep
from ngi.machine.timing import alternated, timed
from ngi.studies.benchmark.batches import Batches
from ngi.studies.benchmark.figures import Figure, figure
from ngi.studies.benchmark.remote import remote
from ngi.studies.benchmark.scenes import Scene
from ngi.studies.benchmark.training import Training


def scoring(
    scene: Scene,
    *,
    network: tuple[int, int, bool],
    samples_per_pixel: int | None,
    repeats: int,
    seconds: float,
) -> list[Figure]:
    """Scoring 16 proposals and 16 current states against generating a batch of 16 patches.

    Scoring is by loss × Adam step: what a training step with it takes longer than one without.

    network: hidden features, hidden layers, bf16.
    """
    features, layers, bf16 = network
    ours = Training(features, layers, bf16=bf16)
    with remote(partial(Batches, scene.read, samples_per_pixel=samples_per_pixel)) as batches:
        plain, scored, batch = alternated(
            repeats,
            f"scoring, {scene.name}",
            timed(ours.step),
            timed(ours.step_with(LossTimesStep())),
            partial(batches, Batches.render),
            seconds=seconds,
        )
    return scoring_figures(plain, scored, batch)


def scoring_figures(plain: list[float], scored: list[float], batch: list[float]) -> list[Figure]:
    """Seconds of a step, of one with scoring, and of a batch, timed in turn."""
    scores = [b - a for a, b in zip(plain, scored, strict=True)]
    shares = [100 * score / t for score, t in zip(scores, batch, strict=True)]
    return [
        figure("scoring / generation", shares, "%", "≤ 10"),
        figure("scoring", [1e3 * score for score in scores], "ms"),
        figure("generation of a batch", [1e3 * t for t in batch], "ms"),
    ]
