"""Evaluates a prediction function on the test frames of one scene under one protocol."""

import hashlib
import logging
from collections.abc import Callable
from dataclasses import dataclass
from random import SystemRandom
from time import perf_counter
from typing import TypeVar

import torch
from torch import Tensor
from tqdm import tqdm

from ngi.evaluate.evaluation import EvaluatedFrame, Evaluation, FrameMetrics
from ngi.evaluate.lpips_metric import Lpips
from ngi.evaluate.metrics import image_metrics, non_finite_pixels, radiance_of, relmse
from ngi.evaluate.protocol import EvaluationProtocol, Frame, evaluation_frames
from ngi.evaluate.references import Reference, ReferenceCache
from ngi.render.protocol import Renderer

log = logging.getLogger(__name__)

T = TypeVar("T")

Predict = Callable[..., Tensor]
"""(buffers [H, W, C], *test inputs) -> log1p of linear radiance [H, W, 3]; on any device."""

TestInputs = Callable[..., tuple[Tensor, ...]]
"""(v [D], buffers [H, W, C]) -> what a prediction needs beside the buffers."""


@dataclass(frozen=True)
class _PreparedFrame:
    frame: Frame
    buffers: Tensor
    inputs: tuple[Tensor, ...]
    seconds: dict[str, float]
    reference: Reference
    floor: FrameMetrics


class Evaluator:
    """Measures predictions of one scene's images.

    The references are rendered, or read from the cache, by `prepare`, at the latest by the first
    evaluation; the buffers and other inputs, which are never cached, are made by the present
    renderer, each timed.

    test_inputs: makes what predictions need beside the buffers; v alone, or what is rendered at v
    """

    def __init__(
        self,
        *,
        renderer: Renderer,
        test_inputs: TestInputs,
        protocol: EvaluationProtocol,
        cache: ReferenceCache,
        lpips: Lpips,
    ) -> None:
        self.protocol = protocol
        self._renderer = renderer
        self._test_inputs = test_inputs
        self._cache = cache
        self._lpips = lpips
        self._frames = evaluation_frames(renderer, protocol)
        self._prepared: tuple[_PreparedFrame, ...] = ()
        self._reference_hash = ""

    def prepare(self) -> None:
        """Renders the frames' buffers and the references not cached yet, with a progress bar."""
        if self._prepared:
            return
        digest = hashlib.sha256()
        prepared = []
        for frame, reference in zip(self._frames, self._references(), strict=True):
            seconds: dict[str, float] = {}
            digest.update(f"{frame.set}/{frame.index}/{reference.content_hash}\n".encode())
            v = frame.scene_vector
            buffers = timed(seconds, "buffers", self._buffers, v)
            prepared.append(
                _PreparedFrame(
                    frame=frame,
                    buffers=buffers,
                    inputs=timed(seconds, "inputs", self._inputs, v, buffers),
                    seconds=seconds,
                    reference=reference,
                    floor=self._measure(frame, reference.half_a, reference.radiance),
                )
            )
        self._reference_hash = digest.hexdigest()[:16]
        self._prepared = tuple(prepared)
        self._report_noise()

    def _references(self) -> list[Reference]:
        """Of all frames, in their order; got in an order that is another in every process.

        Runs that begin side by side thus render them together, and not each of them all.
        """
        order = list(range(len(self._frames)))
        SystemRandom().shuffle(order)
        found = {}
        with tqdm(order, desc="references", unit="frame") as progress:
            for index in progress:
                found[index] = self._cache.get(
                    self._renderer,
                    self.protocol,
                    self._frames[index].scene_vector,
                    on_pass=lambda samples, noise: progress.set_postfix_str(
                        f"{samples} spp, noise {noise:.1%}"
                    ),
                )
        return [found[index] for index in range(len(order))]

    def _report_noise(self) -> None:
        """One line where references stayed above the protocol's noise level."""
        noises = [prepared.reference.noise for prepared in self._prepared]
        above = [noise for noise in noises if noise > self.protocol.target_noise]
        if above:
            log.info(
                "%d of %d references still have more than %.1f %% noise at %d samples per pixel; "
                "the worst has %.1f %%",
                len(above),
                len(noises),
                100 * self.protocol.target_noise,
                self.protocol.maximum_samples,
                100 * max(above),
            )

    def evaluate(self, predict: Predict) -> Evaluation:
        """Predicts and measures every test frame.

        predict: called once per frame, without gradients, with tensors on the CPU.
        Raises ValueError where its answer is not [H, W, 3].
        """
        self.prepare()
        return Evaluation(
            protocol=self.protocol,
            frames=tuple(self._evaluated(prepared, predict) for prepared in self._prepared),
            reference_hash=self._reference_hash,
            lpips_note=self._lpips.reason,
        )

    def _evaluated(self, prepared: _PreparedFrame, predict: Predict) -> EvaluatedFrame:
        seconds = dict(prepared.seconds)
        prediction = timed(seconds, "network", _radiance, predict, prepared)
        return EvaluatedFrame(
            frame=prepared.frame,
            prediction=prediction,
            reference=prepared.reference,
            metrics=self._measure(prepared.frame, prediction, prepared.reference.radiance),
            floor=prepared.floor,
            relmse=relmse(prediction, prepared.reference.half_a, prepared.reference.half_b),
            seconds=seconds,
        )

    def _buffers(self, v: Tensor) -> Tensor:
        """[H, W, C] float32 on the CPU."""
        buffers = self._renderer.image_buffers(v, resolution=self.protocol.resolution)
        return buffers.detach().cpu().float()

    def _inputs(self, v: Tensor, buffers: Tensor) -> tuple[Tensor, ...]:
        inputs = self._test_inputs(v, buffers)
        return tuple(tensor.detach().cpu() for tensor in inputs)

    def _measure(self, frame: Frame, prediction: Tensor, reference: Tensor) -> FrameMetrics:
        """prediction, reference: [H, W, 3] linear radiance."""
        return FrameMetrics(
            set=frame.set,
            index=frame.index,
            non_finite=non_finite_pixels(prediction),
            **image_metrics(prediction, reference, protocol=self.protocol, lpips=self._lpips),
        )


def _radiance(predict: Predict, prepared: _PreparedFrame) -> Tensor:
    """[H, W, 3] float32 linear radiance on the CPU; negative values stay as they are."""
    with torch.no_grad():
        log_radiance = predict(prepared.buffers, *prepared.inputs)
    expected = prepared.reference.half_a.shape
    if log_radiance.shape != expected:
        raise ValueError(
            f"prediction of shape {list(log_radiance.shape)}, expected {list(expected)}"
        )
    return radiance_of(log_radiance.detach().cpu().float())


def timed(seconds: dict[str, float], part: str, compute: Callable[..., T], *arguments: object) -> T:
    """What `compute` gives; how long it takes is noted as that part's seconds."""
    begin = perf_counter()
    result = compute(*arguments)
    seconds[part] = perf_counter() - begin
    return result
