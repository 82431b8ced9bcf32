"""What reaches the stream by way of Lightning, and what a checkpoint of it brings back."""

from pathlib import Path
from typing import Any

import torch

from ngi.learn import ExplorationDataModule
from ngi.learn.step_guard import OUTLIER, Attempt
from ngi.render import AnalyticRenderer
from ngi.reuse import Epochs
from tests.learn.lightning_warnings import IGNORED
from tests.learn.small_stream import make
from tests.learn.test_noise import predicted
from tests.learn.test_step import module, trainer

pytestmark = IGNORED


def test_the_noise_of_halves_is_told_of_every_new_batch(tmp_path: Path) -> None:
    renderer = AnalyticRenderer(
        dimensions=3, patch_size=8, samples_per_pixel=2, halves=True, noise=0.3
    )
    stream = make(tmp_path, sampler=predicted(), rule=Epochs(), renderer=renderer)
    told: list[tuple[bool, bool]] = []
    feedback = stream.feedback

    def listen(given: Any) -> None:
        assert stream._pending is not None
        told.append((stream._pending.generated, given.noise is not None))
        feedback(given)

    stream.feedback = listen  # type: ignore[method-assign]
    trainer("32-true").fit(module(stream, tmp_path), ExplorationDataModule(stream=stream))
    assert set(told) == {(True, True), (False, False)}


def attempt(gradient_norm: float) -> Attempt:
    network = torch.nn.Linear(1, 1)
    return Attempt(
        number=1,
        batch=None,  # type: ignore[arg-type]
        losses=torch.ones(4),
        loss=1.0,
        gradient_norm=gradient_norm,
        largest_moment=0.0,
        network=network,
        optimizer=torch.optim.SGD(network.parameters(), lr=1.0),
    )


def test_a_resumed_run_knows_how_large_gradients_were(tmp_path: Path) -> None:
    before, after = (module(make(tmp_path / name), tmp_path) for name in "ab")
    for _ in range(3):
        before.learner.guard.admit(attempt(2.0))
    checkpoint: dict[str, Any] = {}
    before.on_save_checkpoint(checkpoint)
    after.on_load_checkpoint(checkpoint)
    assert not after.learner.guard.admits(attempt(2.1 * OUTLIER))
    assert after.learner.guard.admits(attempt(1.9 * OUTLIER))
