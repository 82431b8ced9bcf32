"""A run without training: path tracing takes the network's place, and is measured like one."""

from __future__ import annotations

import logging
from functools import partial
from typing import TYPE_CHECKING, Any

from hydra.utils import instantiate
from omegaconf import DictConfig
from torch import Tensor

from ngi.clock.phase_clock import PAUSES, PHASES
from ngi.config.build import build_network, build_samples, plain, training_device
from ngi.config.configuration import scene_record
from ngi.files.code_versions import record_code_version
from ngi.machine.precision import dtype_of
from ngi.machine.provenance import provenance
from ngi.methods.path_tracing.frame_time import Frame, FrameTimes, largest_fitting, show
from ngi.methods.path_tracing.tracing import PathTracing, Plan

if TYPE_CHECKING:
    from ngi.evaluate import Evaluation
    from ngi.learn import RunFolder, Tracker
    from ngi.render import Renderer

log = logging.getLogger(__name__)

UNUSED = ("sampler", "reuse", "resolution", "model", "loss")
"""Parts of a run's label that only training has."""

NO_TRAINING = {
    **dict.fromkeys(("steps", "patches_traced", "paths_traced"), 0),
    **dict.fromkeys(("run_seconds", "wall_seconds"), 0.0),
    "seconds": dict.fromkeys((*PHASES, *PAUSES), 0.0),
}
"""What a result says of training."""


def run_path_tracing(
    config: DictConfig, *, renderer: Renderer, folder: RunFolder, tracker: Tracker
) -> dict[str, Any]:
    """Evaluates frames of path tracing as the network's are, and writes and returns the result.

    The result has what comparisons need, as a trained run's, and 'frame': samples per pixel, and
    the median milliseconds of a frame and of its parts over the scene's hard frames, at the
    resolution of the protocol, beside those of the network of the same configuration. That network
    is not trained, which its time does not depend on. Its buffers guide the denoiser too, and count
    for both.
    """
    plan = instantiate(config.path_tracing)
    label = {**plain(config.label), **dict.fromkeys(UNUSED, "none"), "seed": config.seed}
    folder.begin(scene=scene_record(config))
    folder.forget_logs()
    record_code_version(folder.path, after_step=0, settings=folder.settings)
    tracker.start(folder=folder.path, settings=folder.settings, label=label)
    timed = _timed(config, plan, renderer)
    log.info("%s: %s", folder.path, timed)
    tracing = PathTracing(  # whose frames do not depend on how many were timed
        renderer=renderer,
        denoiser=plan.denoiser,
        samples_per_pixel=timed["samples_per_pixel"],
        seed=config.seed,
    )
    evaluator = instantiate(config.evaluation.evaluator)(
        renderer=renderer, test_inputs=tracing.test_inputs
    )
    evaluation = evaluator.evaluate(tracing.predict)
    _log(evaluation, folder=folder, tracker=tracker)
    result = {
        **provenance(backend=renderer.description),
        **NO_TRAINING,
        "identity": folder.identity,
        "finished": True,
        "label": label,
        "seed": config.seed,
        "config": folder.settings,
        "clock": config.budget.clock,
        "frame": timed,
        "pixels_masked": tracing.pixels_masked,
        "scene_hash": renderer.scene_hash,
        **evaluation.result(),
        "linear": evaluation.write(folder.path, linear_megabytes=folder.linear_megabytes),
    }
    return folder.write_result(result)


def _log(evaluation: Evaluation, *, folder: RunFolder, tracker: Tracker) -> None:
    """The row of metrics.csv."""
    row = {"step": 0, "run_seconds": 0.0, **evaluation.row()}
    folder.metrics.append(row)
    folder.metrics.flush()
    tracker.evaluated(row, evaluation)


def _timed(config: DictConfig, plan: Plan, renderer: Renderer) -> dict[str, Any]:
    """The result's 'frame'."""
    tracing = PathTracing(
        renderer=renderer,
        denoiser=plan.denoiser,
        samples_per_pixel=plan.samples_per_pixel or 1,
        seed=config.seed,
    )
    resolution = config.evaluation.evaluator.protocol.resolution
    frames = _Frames(config, tracing=tracing, resolution=resolution)
    if plan.samples_per_pixel is None:
        frames.fit(plan.milliseconds)
    return frames.timed()


class _Frames:
    """Times the frames of path tracing and of the network, at the size of the test frames."""

    def __init__(self, config: DictConfig, *, tracing: PathTracing, resolution: int) -> None:
        renderer = tracing.renderer
        self._tracing = tracing
        self._times = FrameTimes(list(renderer.hard_frames()))
        samples = build_samples(config, renderer=renderer)
        network = build_network(config, samples=samples).eval()
        network = network.to(training_device(config))
        precision = dtype_of(config.trainer.precision)
        self._buffers: Frame = partial(renderer.image_buffers, resolution=resolution)
        self._trace: Frame = partial(tracing.trace, resolution=resolution)
        buffers = renderer.image_buffers(renderer.hard_frames()[0], resolution=resolution).cpu()
        noisy = tracing.trace(renderer.hard_frames()[0], resolution=resolution)

        def predict(v: Tensor) -> Tensor:
            inputs = samples.test_inputs(v, buffers)
            return show(network, buffers, *inputs, precision=precision, render=samples.render)

        self._network: Frame = predict
        self._denoise: Frame = lambda _: tracing.denoise(noisy, buffers)

    def fit(self, milliseconds: float | None) -> None:
        """Sets the samples per pixel to the most whose frame takes no longer; at least 1.

        milliseconds: None for the network's, which is timed again beside each number that is tried
        """

        def fits(samples: int) -> bool:
            self._tracing.samples_per_pixel = samples
            found = self._seconds(f"{samples} samples per pixel")
            allowed = found["network"] if milliseconds is None else 1e-3 * milliseconds
            return found["path tracing"] <= allowed

        self._tracing.samples_per_pixel = largest_fitting(fits)

    def timed(self) -> dict[str, Any]:
        seconds = self._seconds("time of a frame")
        return {
            "samples_per_pixel": self._tracing.samples_per_pixel,
            "milliseconds": {part: 1e3 * value for part, value in seconds.items()},
        }

    def _seconds(self, what: str) -> dict[str, float]:
        """Median seconds of the parts, and of whole frames of 'path tracing' and 'network'."""
        parts = {
            "buffers": self._buffers,
            "paths": self._trace,
            "denoiser": self._denoise,
            "network alone": self._network,
        }
        found = self._times.seconds(parts, what=what)
        if self._tracing.denoiser is None:
            found["denoiser"] = 0.0
        guided = found["buffers"] if self._tracing.denoiser is not None else 0.0
        return {
            **found,
            "path tracing": guided + found["paths"] + found["denoiser"],
            "network": found["buffers"] + found["network alone"],
        }
