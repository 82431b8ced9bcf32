"""Launches that do not fit into memory are traced in parts.

On CUDA Dr.Jit raises a RuntimeError where it gets no memory. On LLVM Dr.Jit 1.5 does not: it ends
the process, or Linux does. There `ngi.render.tracing` keeps launches small beforehand, and only
what workers render is rendered again.
"""

import logging
from collections.abc import Callable, Iterable
from math import inf, prod
from typing import TypeVar

import torch
from torch import Tensor

from ngi.render.tracing import Pending, Pixels, Tracer, Window, derive_seed

Part = TypeVar("Part", bound=Pixels)

_logger = logging.getLogger(__name__)

_MESSAGES = (
    "out of memory",
    "free the allocation cache while recording",  # to get memory for a frozen function
    "exceeds the limit of 2^32",
)


def does_not_fit(error: RuntimeError) -> bool:
    """Whether Dr.Jit raised this, or what caused it, because a launch is too large."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, RuntimeError) and any(text in str(cause) for text in _MESSAGES):
            return True
        cause = cause.__cause__
    return False


class FittingTracer(Tracer):
    """The `ngi.render.tracing.Tracer` that halves what another one cannot trace at once.

    First the samples, of radiance alone, then the rows. Each half has a seed of its own, which
    depends on the whole's and on nothing else: the same halves give the same numbers. Launches as
    large as one that did not fit are not tried again.

    tracer: raises RuntimeError, see `does_not_fit`, when it launches.
    free: gives back memory that is kept for later; tried before anything is halved.
    split: how many launches have been halved.

    Raises RuntimeError, saying what to lower, where one row does not fit with one sample per pixel,
    or with the rays of its buffers.
    """

    def __init__(self, tracer: Tracer, *, free: Callable[[], None]) -> None:
        self._tracer = tracer
        self._free = free
        self._too_large: dict[str, float] = {"radiance": inf, "buffers": inf}  # pixels x samples
        self.split = 0

    def radiance(self, window: Window, *, samples: int, seed: int) -> Pending:
        whole = self._attempt(
            "radiance",
            prod(window.shape) * samples,
            lambda: self._tracer.radiance(window, samples=samples, seed=seed),
        )
        if whole is not None:
            return whole
        seeds = [derive_seed(seed, half) for half in range(2)]
        if samples > 1:
            self.split += 1
            counts = [samples - samples // 2, samples // 2]
            halves = [
                self.radiance(window, samples=n, seed=s) for n, s in zip(counts, seeds, strict=True)
            ]
            return lambda: _weighted_mean([half() for half in halves], counts)
        return _stacked(
            self.radiance(half, samples=1, seed=s)
            for half, s in zip(
                self._counted(window.halves(), prod(window.shape)), seeds, strict=True
            )
        )

    def buffers(self, pixels: Pixels, *, samples: int) -> Pending:
        """The same numbers, however it is split."""
        whole = self._attempt(
            "buffers",
            prod(pixels.shape) * samples,
            lambda: self._tracer.buffers(pixels, samples=samples),
        )
        if whole is not None:
            return whole
        return _stacked(
            self.buffers(half, samples=samples)
            for half in self._counted(pixels.halves(), prod(pixels.shape), samples=samples)
        )

    def _attempt(self, what: str, size: int, launch: Callable[[], Pending]) -> Pending | None:
        """None for what does not fit."""
        if size >= self._too_large[what]:
            return None
        for _ in range(2):
            try:
                return launch()
            except RuntimeError as error:
                if not does_not_fit(error):
                    raise
                reason = error
            self._free()
        if self.split == 0:
            _logger.warning(
                "a launch of %d pixels x samples does not fit into memory. From now on such "
                "launches are traced in parts, so random numbers differ from those on a machine "
                "with more memory: %s",
                size,
                reason,
            )
        self._too_large[what] = size
        return None

    def _counted(
        self, halves: tuple[Part, Part] | None, size: int, *, samples: int = 1
    ) -> tuple[Part, Part]:
        if halves is None:
            rays = f"{samples} samples" if samples > 1 else "one sample"
            fewer = "renderer.buffer_samples, " if samples > 1 else ""
            raise RuntimeError(
                f"not even {size} pixels with {rays} fit into memory; free some (`nvidia-smi` "
                f"lists its users), lower {fewer}renderer.workers or the sizes of the scene's "
                "meshes and textures, or choose renderer.backend=llvm"
            )
        self.split += 1
        return halves


def _stacked(parts: Iterable[Pending]) -> Pending:
    launched = list(parts)
    return lambda: torch.cat([part() for part in launched])


def _weighted_mean(means: list[Tensor], counts: list[int]) -> Tensor:
    sums = [count * mean for count, mean in zip(counts, means, strict=True)]
    return torch.stack(sums).sum(dim=0) / sum(counts)
