"""What each part of the benchmark runs."""

from __future__ import annotations

from collections.abc import Iterator

from ngi.studies.benchmark.compilations import compilations
from ngi.studies.benchmark.figures import Figure
from ngi.studies.benchmark.frames import frames
from ngi.studies.benchmark.inference import inference
from ngi.studies.benchmark.leaving_out import leaving_out
from ngi.studies.benchmark.memory import memory
from ngi.studies.benchmark.overhead import overhead
from ngi.studies.benchmark.part import Measure, Options, per_scene
from ngi.studies.benchmark.scoring import scoring
from ngi.studies.benchmark.store import store
from ngi.studies.benchmark.threads import alternation
from ngi.studies.benchmark.training import OURS, training
from ngi.studies.benchmark.viewer import viewer
from ngi.studies.benchmark.waiting import waiting
from ngi.studies.benchmark.workers import throughput

NETWORKS = ((512, 8, True), (128, 6, False), (128, 6, True))
"""Hidden features, hidden layers, bf16: the paper's network, and the demo's."""
STORED_PATCHES = 1024
"""Patches in the store that is measured."""


def train(options: Options) -> Iterator[Figure]:
    for network in NETWORKS:
        yield from training(*network, repeats=options.repeats)
    for bf16 in (False, True):
        yield from training(128, 6, bf16, repeats=options.repeats, learner=OURS)


def keep(options: Options) -> Iterator[Figure]:
    for dimensions in (12, 128):
        yield from store(dimensions=dimensions, count=STORED_PATCHES, repeats=options.repeats)


MEASURES: dict[str, Measure] = {
    "overhead": per_scene(lambda scene, o: overhead(scene, **o.timings(16))),
    "compilations": per_scene(
        lambda scene, o: compilations(scene, **o.rendering(4, patches=1_000))
    ),
    "memory": per_scene(lambda scene, o: memory(scene, **o.rendering(1, patches=10_000))),
    "leaving-out": per_scene(lambda scene, o: leaving_out(scene, **o.timings(16))),
    "training": train,
    "scoring": per_scene(lambda scene, o: scoring(scene, network=NETWORKS[0], **o.timings(None))),
    "threads": lambda o: alternation(o.repeats),
    "store": keep,
    "workers": per_scene(lambda scene, o: throughput(scene, **o.timings(16))),
    "waiting": per_scene(lambda scene, _: waiting(scene)),
    "inference": per_scene(lambda scene, o: inference(scene, repeats=o.repeats, seconds=o.seconds)),
    "frames": per_scene(lambda scene, o: frames(scene, repeats=o.repeats, seconds=o.seconds)),
    "viewer": per_scene(lambda scene, o: viewer(scene, seconds=o.seconds)),
}
"""By the name of the part, `ngi.studies.benchmark.parts`."""
