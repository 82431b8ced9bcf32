"""What the parts of a run are told of each other."""

from pathlib import Path

import pytest
from hydra.utils import instantiate

from ngi import learn
from ngi.config.build import build_module, build_samples, build_stream
from ngi.config.configuration import composed
from tests.learn.small_stream import steps


@pytest.mark.parametrize(
    ("reuse", "samples_per_pixel", "reused"),
    [
        ("by_samples", 32, 0.9),
        ("by_samples", 512, 0.975),
        ("by_loss", 512, 0.98),
        ("steady", 512, 0.92),
    ],
)
def test_a_reuse_policy_is_told_how_clean_patches_are_where_it_asks(
    reuse: str, samples_per_pixel: int, reused: float, tmp_path: Path
) -> None:
    config = composed(
        "renderer=analytic",
        f"+renderer.samples_per_pixel={samples_per_pixel}",
        f"reuse={reuse}",
        "reuse.policy.bootstrap_batches=1",
        "sampler=uniform",
    )
    renderer = instantiate(config.renderer)
    stream = build_stream(
        config,
        renderer=renderer,
        samples=build_samples(config, renderer=renderer),
        clock=learn.PhaseClock(),
        patches=tmp_path,
    )
    probabilities = [stream.reuse_probability for _ in steps(stream, 3)]
    assert probabilities == [0, pytest.approx(reused), pytest.approx(reused)]


@pytest.mark.parametrize(
    ("sampler", "described"), [("predicted_from_buffers", True), ("predicted_loss", False)]
)
def test_a_sampler_that_looks_at_patches_is_told_of_them(
    sampler: str, described: bool, tmp_path: Path
) -> None:
    config = composed("renderer=analytic", f"sampler={sampler}", "averaging=exponential")
    renderer = instantiate(config.renderer)
    samples = build_samples(config, renderer=renderer)
    stream = build_stream(
        config, renderer=renderer, samples=samples, clock=learn.PhaseClock(), patches=tmp_path
    )
    build_module(config, samples=samples, stream=stream, folder=tmp_path)
    assert (stream.description is not None) == described


def test_a_sampler_that_looks_is_refused_without_averaged_weights_before_a_run_begins(
    tmp_path: Path,
) -> None:
    config = composed(
        "renderer=analytic",
        "sampler=predicted_from_buffers",
        "averaging=none",
        f"run.folder={tmp_path}",
    )
    renderer = instantiate(config.renderer)
    samples = build_samples(config, renderer=renderer)
    stream = build_stream(
        config, renderer=renderer, samples=samples, clock=learn.PhaseClock(), patches=tmp_path
    )
    with pytest.raises(ValueError, match="give averaging=exponential"):
        build_module(config, samples=samples, stream=stream, folder=tmp_path)
