"""Claims and their evidence as text: effects, time ratios, verdicts, tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from analysis.evidence import (
    ALL_SCENES,
    MORE_THAN_MOST_SEEDS,
    ComparisonResult,
    Effect,
    TimeRatio,
)
from analysis.methods import title
from analysis.runs import METRICS
from analysis.tables import MISSING, TITLES, Cell, Table
from analysis.verdicts import ClaimResult

SHOWN_BESIDE = "shown beside"
"""Instead of a verdict where a comparison decides nothing about its claim."""

_METRIC_TITLES = tuple(TITLES[metric] for metric in METRICS)
_COLUMNS = ("difference", "g", "verdict", "time", "seeds", "seeds needed")


@dataclass(frozen=True)
class EvidenceLine:
    """One line of evidence in words: what was compared or measured, and how it came out.

    test: 'primary' where it alone can refute the claim, else 'further'.
    """

    what: str
    difference: str
    effect_size: str
    verdict: str
    time_ratio: str
    seeds: str
    seeds_needed: str
    test: Literal["primary", "further"] = "further"

    @property
    def cells(self) -> tuple[str, ...]:
        """As the columns of `claims_table` have them, without `what`."""
        return (
            self.difference,
            self.effect_size,
            self.verdict,
            self.time_ratio,
            self.seeds,
            self.seeds_needed,
        )


def main_evidence(result: ClaimResult) -> list[EvidenceLine]:
    """What decides about a claim: findings, and per pair of methods all scenes or the only one.

    The primary test comes first. Where nothing decides, what is shown beside.
    """
    findings: list[EvidenceLine] = []
    for finding in result.findings:
        value = MISSING if math.isnan(finding.value) else f"{finding.value:.3g}"
        number = _with_interval(value, finding.low, finding.high, "{:.3g}")
        findings.append(
            EvidenceLine(finding.text, number, MISSING, finding.verdict, MISSING, MISSING, MISSING)
        )
    compared: list[EvidenceLine] = []
    pairs = dict.fromkeys((item.better, item.worse) for item in result.comparisons)
    for pair in pairs:
        of_pair = [item for item in result.comparisons if (item.better, item.worse) == pair]
        pooled = [item for item in of_pair if item.scene == ALL_SCENES]
        compared += [_of_comparison(item) for item in pooled or of_pair]
    primary_finds = result.claim.primary == "finding"
    evidence = [*findings, *compared] if primary_finds else [*compared, *findings]
    if findings if primary_finds else _is_primary(result):
        evidence[0] = replace(evidence[0], test="primary")
    deciding = [line for line in evidence if line.verdict != SHOWN_BESIDE]
    return deciding or evidence


def _is_primary(result: ClaimResult) -> bool:
    """Whether the first comparison that has runs is the claim's first, and decides."""
    if not result.comparisons:
        return False
    found, wanted = result.comparisons[0], result.claim.comparisons[0]
    return found.decides and (found.better, found.worse) == (wanted.better, wanted.worse)


def _of_comparison(item: ComparisonResult) -> EvidenceLine:
    return EvidenceLine(
        what=f"{_pair(item)}, {item.scene}",
        difference=format_effect(item.decisive),
        effect_size=_number(item.decisive.hedges_g),
        verdict=_verdict(item),
        time_ratio=format_time_ratio(item.time_ratio),
        seeds=str(item.decisive.seeds),
        seeds_needed=format_seeds_needed(item.seeds_needed),
    )


def _pair(item: ComparisonResult) -> str:
    return f"{title(item.better)} against {title(item.worse)}"


def _verdict(item: ComparisonResult) -> str:
    return item.verdict if item.decides else SHOWN_BESIDE


def claims_table(results: Sequence[ClaimResult]) -> Table:
    """Every claim that has runs, a row per line of main evidence; the first has its verdict."""
    rows = tuple(
        tuple(map(Cell, (result.claim.id, line.test, line.what, *line.cells, verdict)))
        for result in results
        for number, line in enumerate(main_evidence(result))
        for verdict in [str(result.verdict) if number == 0 else ""]
    )
    return Table(
        "Claims of the paper", ("claim", "test", "compared", *_COLUMNS, "of the claim"), rows, 3
    )


def effects_table(result: ClaimResult) -> Table:
    """Every comparison of a claim on hard frames: what decides, and each metric's difference."""
    rows = tuple(
        _row(item, *_of_comparison(item).cells, *_differences(item, "hard", ""))
        for item in result.comparisons
    )
    columns = ("scene", "compared", "all metrics", *_COLUMNS[1:], *_METRIC_TITLES)
    caption = f"{result.claim.title}: difference of the error on hard frames"
    return Table(caption, columns, rows, 2)


def further_effects_table(result: ClaimResult, set_name: str, suffix: str) -> Table:
    """Each metric's difference; suffix is '' for all frames of a set, '_worst5' for the worst."""
    rows = tuple(_row(item, *_differences(item, set_name, suffix)) for item in result.comparisons)
    frames = f"{set_name} frames" + (", worst 5 %" if suffix else "")
    caption = f"{result.claim.title}: difference of the error on {frames}"
    return Table(caption, ("scene", "compared", *_METRIC_TITLES), rows, 2)


def _row(item: ComparisonResult, *texts: str) -> tuple[Cell, ...]:
    return tuple(map(Cell, (item.scene, _pair(item), *texts)))


def _differences(item: ComparisonResult, set_name: str, suffix: str) -> list[str]:
    return [format_effect(item.effects.get(f"{set_name}_{metric}{suffix}")) for metric in METRICS]


def format_effect(effect: Effect | None) -> str:
    """'-12.3 % [-20.1, -3.2]', negative where the method claimed to be better has less error."""
    if effect is None or math.isnan(effect.effect_percent):
        return MISSING
    return _with_interval(f"{effect.effect_percent:+.1f} %", effect.low, effect.high, "{:+.1f}")


def format_time_ratio(ratio: TimeRatio | None) -> str:
    """'1.42 × [1.10, 1.83]' or 'at least 2.00 ×'; above 1 the claimed method is faster."""
    if ratio is None or math.isnan(ratio.value):
        return MISSING
    text = f"{ratio.bound} {ratio.value:.2f} ×".strip()
    return _with_interval(text, ratio.low, ratio.high, "{:.2f}")


def format_seeds_needed(seeds: int | None) -> str:
    if seeds is None:
        return MISSING
    return "more than 100" if seeds >= MORE_THAN_MOST_SEEDS else str(seeds)


def _with_interval(text: str, low: float | None, high: float | None, number: str) -> str:
    if low is None or high is None:
        return text
    return f"{text} [{number.format(low)}, {number.format(high)}]"


def _number(value: float | None) -> str:
    return MISSING if value is None or math.isnan(value) else f"{value:+.2f}"
