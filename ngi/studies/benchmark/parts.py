"""The parts of the benchmark, in the order in which they are measured."""

from __future__ import annotations

from collections.abc import Iterator

from ngi.studies.benchmark.compilations import compilations
from ngi.studies.benchmark.figures import Figure
from ngi.studies.benchmark.frames import frames
from ngi.studies.benchmark.inference import inference
from ngi.studies.benchmark.leaving_out import leaving_out
from ngi.studies.benchmark.memory import memory
from ngi.studies.benchmark.overhead import overhead
from ngi.studies.benchmark.part import Options, Part, per_scene
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


PARTS = (
    Part(
        "overhead",
        "a batch of patches, everything new, against one launch of as many paths; its steps",
        per_scene(lambda scene, o: overhead(scene, **o.timings(16))),
        scenes=None,
    ),
    Part(
        "compilations",
        "seconds of the warm-up with and without cached kernels; kernels compiled after it",
        per_scene(lambda scene, o: compilations(scene, **o.rendering(4, patches=1_000))),
        scenes=None,
    ),
    Part(
        "memory",
        "growth of a process that renders many patches",
        per_scene(lambda scene, o: memory(scene, **o.rendering(1, patches=10_000))),
        scenes=("cornell-box",),
    ),
    Part(
        "leaving-out",
        "patches with what a scene needs against patches with everything",
        per_scene(lambda scene, o: leaving_out(scene, **o.timings(16))),
        scenes=None,
    ),
    Part("training", "a training step against the machine's matrix rate; scoring", train),
    Part(
        "scoring",
        "scoring a batch of proposals against rendering it, at the scene's training samples",
        per_scene(lambda scene, o: scoring(scene, network=NETWORKS[0], **o.timings(None))),
        scenes=("sphere-caustic",),
    ),
    Part(
        "threads",
        "rendering and training in turn on the same cores",
        lambda o: alternation(o.repeats),
    ),
    Part("store", "memory, precision and speed of the store of patches", keep),
    Part(
        "workers",
        "patches per second of several processes that render",
        per_scene(lambda scene, o: throughput(scene, **o.timings(16))),
        scenes=("sphere-caustic",),
    ),
    Part(
        "waiting",
        "how long training waits for patches, rendered in turn and by a worker ahead",
        per_scene(lambda scene, _: waiting(scene)),
        scenes=("sphere-caustic",),
    ),
    Part(
        "inference",
        "frames per second of buffers and the paper's network; its share of the matrix rate",
        per_scene(lambda scene, o: inference(scene, repeats=o.repeats, seconds=o.seconds)),
        scenes=("sphere-caustic",),
    ),
    Part(
        "frames",
        "milliseconds of our frames by part, beside those of path tracing with a denoiser",
        per_scene(lambda scene, o: frames(scene, repeats=o.repeats, seconds=o.seconds)),
        scenes=("sphere-caustic",),
    ),
    Part(
        "viewer",
        "pictures per second that the viewer shows while a slider moves, and how fine they are",
        per_scene(lambda scene, o: viewer(scene, seconds=o.seconds)),
        scenes=("sphere-caustic",),
    ),
)
