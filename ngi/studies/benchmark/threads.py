"""Rendering and training in turn on the same cores, against each of them alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from ngi.machine.precision import fast_precision
from ngi.machine.timing import repeated, timed
from ngi.studies.benchmark.batches import Batches
from ngi.studies.benchmark.figures import Figure, figure
from ngi.studies.benchmark.remote import remote
from ngi.studies.benchmark.scenes import shipped
from ngi.studies.benchmark.training import Training

SCENE = "sphere-caustic"
SAMPLES_PER_PIXEL = 16
NETWORKS = ((512, 8), (128, 6))
"""Hidden features and hidden layers: the paper's network, and the demo's."""
ROUNDS = 4
"""Batches and steps per timing."""


def alternation(repeats: int) -> list[Figure]:
    """Batches of patches and training steps in turn, against as many of each without the other.

    The threads of one pool that wait for work by spinning slow those of the other down.
    """
    bf16 = fast_precision() == "bf16-mixed"
    return [f for network in NETWORKS for f in _alternation(*network, bf16=bf16, repeats=repeats)]


def _alternation(features: int, layers: int, *, bf16: bool, repeats: int) -> list[Figure]:
    name = f"{layers}x{features} {'bf16' if bf16 else 'fp32'}"
    with remote(partial(Turns, features, layers, bf16=bf16)) as turns:
        seconds = repeated(repeats, f"threads, {name}", partial(turns, Turns.seconds))
    render, step, both = zip(*seconds, strict=True)
    shares = [b / (r + s) for r, s, b in seconds]
    title = f"{name}; {SCENE}, {SAMPLES_PER_PIXEL} spp"
    return [
        figure(f"render and step in turn / sum of both alone ({title})", shares, "×", "≤ 1.1"),
        figure(f"render alone ({title})", [1e3 * t for t in render], "ms"),
        figure(f"step alone ({title})", [1e3 * t for t in step], "ms"),
        figure(f"render and step in turn ({title})", [1e3 * t for t in both], "ms"),
    ]  # fmt: skip


class Turns:
    """A renderer and a network in training in one process."""

    def __init__(self, features: int, layers: int, *, bf16: bool) -> None:
        [scene] = shipped([SCENE])
        self._render = Batches(scene.read, samples_per_pixel=SAMPLES_PER_PIXEL).render
        self._step = Training(features, layers, bf16=bf16).step

    def seconds(self) -> tuple[float, float, float]:
        """Of a batch without steps around it, of a step without batches, of both in turn."""
        return tuple(
            timed(_rounds(*functions))() / ROUNDS
            for functions in ([self._render], [self._step], [self._render, self._step])
        )  # type: ignore[return-value]


def _rounds(*functions: Callable[[], object]) -> Callable[[], None]:
    def call() -> None:
        for _ in range(ROUNDS):
            for function in functions:
                function()

    return call
