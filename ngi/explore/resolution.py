"""The resolution of the virtual image patches are cut from (paper, Sec. 6.2)."""

from typing import Protocol


class ResolutionSchedule(Protocol):
    """Width and height of the virtual image, over the training."""

    def resolution(self, iteration: int) -> int:
        """Pixels along the virtual image's side at a training iteration, counted from 0."""
        ...


class GrowingResolution(ResolutionSchedule):
    """Starts at `start` pixels and grows by `step` every `every` iterations, up to `end`.

    The paper (Sec. 6.2) starts at 128 and grows by 4 every 2,000 iterations up to 600, which it
    reaches at iteration 236,000. The growth lets small steps close in on details; it helps
    exploration and hurts uniform sampling, whose resolution stays: `step` is 0, and `end` is
    nothing then.
    """

    def __init__(self, *, start: int, step: int, every: int, end: int) -> None:
        _check_positive(start=start, every=every, end=end)
        if step < 0:
            raise ValueError(f"step: {step}: give at least 0; with 0 the resolution stays")
        if step > 0 and end < start:
            raise ValueError(f"end: {end}: give at least start, which is {start}")
        self._start = start
        self._step = step
        self._every = every
        self._end = end

    def resolution(self, iteration: int) -> int:
        """Raises ValueError for a negative iteration."""
        if iteration < 0:
            raise ValueError(f"iteration: {iteration}: iterations are counted from 0")
        if self._step == 0:
            return self._start
        return min(self._end, self._start + self._step * (iteration // self._every))


def _check_positive(**values: int) -> None:
    for name, value in values.items():
        if value < 1:
            raise ValueError(f"{name}: {value}: give at least 1")
