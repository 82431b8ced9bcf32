"""Names methods by what tells them apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from analysis.runs import DISTINCTIONS, Run

BASELINE = "uniform"
"""The sampler that others are compared with; it comes first."""


def name_methods(runs: Sequence[Run]) -> list[Run]:
    """The same runs with `method` set: the sampler, and what else its methods need to differ by.

    'uniform' and 'mcmc_loss' suffice where each sampler was run in one way. Otherwise the fewest
    label fields that tell a sampler's runs apart follow: 'mcmc_loss, growing'.
    """
    named = []
    for run in runs:
        same_sampler = [other for other in runs if other.label["sampler"] == run.label["sampler"]]
        fields = _telling_fields(same_sampler)
        parts = [run.label["sampler"], *(_value(run, field, same_sampler) for field in fields)]
        named.append(replace(run, method=", ".join(part for part in parts if part)))
    return named


def methods_in_order(runs: Sequence[Run]) -> list[str]:
    """The methods' names: the baseline's first, then by name."""
    return sorted({run.method for run in runs}, key=lambda name: (not is_baseline(name), name))


def is_baseline(method: str) -> bool:
    return method.split(", ")[0] == BASELINE


def _telling_fields(runs: Sequence[Run]) -> list[str]:
    """The first of `DISTINCTIONS` that split these runs as finely as all of them together do."""
    by_scene: dict[str, list[Run]] = {}
    for run in runs:
        by_scene.setdefault(run.scene, []).append(run)

    def groups(fields: Sequence[str]) -> int:
        return sum(
            len({tuple(run.label[field] for field in fields) for run in of_scene})
            for of_scene in by_scene.values()
        )

    chosen: list[str] = []
    for field in DISTINCTIONS:
        if groups([*chosen, field]) > groups(chosen):
            chosen.append(field)
    return chosen


def _value(run: Run, field: str, others: Sequence[Run]) -> str:
    """A label field's value; of the overrides only those that not all the runs have."""
    if field != "overrides":
        return run.label[field]
    common = set.intersection(*(set(other.label[field].split(",")) for other in others))
    return " ".join(item for item in run.label[field].split(",") if item not in common)


def differing_fields(runs: Sequence[Run]) -> list[str]:
    """Label fields that are not the same in all runs of a scene, the sampler first."""
    first = {run.scene: run for run in reversed(runs)}
    return [
        field
        for field in ("sampler", *DISTINCTIONS)
        if any(run.label[field] != first[run.scene].label[field] for run in runs)
    ]
