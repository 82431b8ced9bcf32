"""What a claim is judged by: effects, times to equal error, findings; and the rule of verdicts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

EQUIVALENCE = 2.0
"""Percent. An interval that lies wholly within ± this shows that there is no difference."""

ALL_SCENES = "all scenes"

MORE_THAN_MOST_SEEDS = 101
"""Stands for 'more than 100 seeds'."""


class Verdict(StrEnum):
    REPRODUCED = "reproduced"
    NOT_REPRODUCED = "not reproduced"
    INCONCLUSIVE = "inconclusive"
    NOT_RUN = "not run"


@dataclass(frozen=True)
class Effect:
    """How much less error the claimed method has: a paired ratio of errors.

    effect_percent: 100 · (ratio - 1), negative where the method claimed to be better has less
    error, NaN where an error is not finite; low, high: its 95 % interval, None for one seed;
    hedges_g: the mean log ratio in standard deviations between seeds (between scenes, over all
    scenes), same sign, None where `analysis.statistics.hedges_g` gives none; seeds: pairs of runs;
    frames: pairs of frames per seed (0 for the worst 5 %, which are other frames in every run).
    """

    effect_percent: float
    low: float | None
    high: float | None
    hedges_g: float | None
    seeds: int
    frames: int


@dataclass(frozen=True)
class TimeRatio:
    """Time to equal error: the worse method's run time over the better one's; above 1 it is faster.

    low, high: 95 % interval over seeds, None for one seed and for a bound; bound: 'at least' or
    'at most' where the error was already reached at a run's first evaluation, so that its time is
    only bounded.
    """

    value: float
    low: float | None
    high: float | None
    bound: Literal["", "at least", "at most"]


@dataclass(frozen=True)
class ComparisonResult:
    """Two methods on one scene, or on several together.

    scene: a scene's name or `ALL_SCENES`; better, worse: options of the group `method`; decisive:
    the effect that the verdict is read from, the geometric mean of the metrics on hard frames;
    effects: by set and metric ('hard_mape', 'uniform_lpips', …) and with the suffix
    '_worst5'; seeds_needed: per method, to decide with a power of 80 %, None where it is decided
    or unknown, `MORE_THAN_MOST_SEEDS` where more than 100; time_ratio: None where the curves do
    not give it; decides: whether the claim's verdict depends on it.
    """

    scene: str
    better: str
    worse: str
    decisive: Effect
    effects: Mapping[str, Effect]
    verdict: Verdict
    seeds_needed: int | None
    time_ratio: TimeRatio | None
    decides: bool = True


@dataclass(frozen=True)
class Finding:
    """Evidence that is no comparison of two methods: a trend, a distance, a limit.

    text: what was measured, with its unit; value, low, high: with its 95 % interval, None for one
    seed.
    """

    text: str
    value: float
    low: float | None
    high: float | None
    verdict: Verdict


def decide(low: float | None, high: float | None, *, equivalence: float = 0.0) -> Verdict:
    """The verdict on a number that is claimed to be negative, from its 95 % interval.

    Not reproduced where the interval is wholly within ± equivalence: whatever its sign, there is
    no difference worth the name. Otherwise reproduced where it is wholly below 0, not reproduced
    where it is wholly above, else inconclusive, and so without an interval.
    """
    if low is None or high is None:
        return Verdict.INCONCLUSIVE
    if low > 0 or (-equivalence < low and high < equivalence):
        return Verdict.NOT_REPRODUCED
    return Verdict.REPRODUCED if high < 0 else Verdict.INCONCLUSIVE


def of_tests(primary: Verdict, further: Iterable[Verdict]) -> Verdict:
    """A claim's verdict from its primary test, named beforehand, and the further ones.

    Reproduced where every test is: each may err in 5 % of the cases, all together no more often.
    Not reproduced where the primary one is not: were any of several allowed to refute, one would by
    chance. Else inconclusive.
    """
    if primary is Verdict.REPRODUCED:
        together = all(verdict is Verdict.REPRODUCED for verdict in further)
        return Verdict.REPRODUCED if together else Verdict.INCONCLUSIVE
    return primary
