"""What reaches the stream by way of Lightning."""

from pathlib import Path
from typing import Any

from ngi.learn import ExplorationDataModule
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
