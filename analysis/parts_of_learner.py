"""What each part of ours is worth: errors with it and without, on every scene and seed.

`analysis.learner_table` writes the tables into docs/learner, `analysis.parts_plot` the picture
and the numbers of a folder's runs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import pandas as pd

from analysis.readme_table import markdown_row
from analysis.runs import METRICS, Run
from analysis.statistics import (
    Estimate,
    difference_over_scenes,
    mean_of_shared,
    paired_difference,
)
from analysis.tables import format_percent

ABLATIONS = {  # of a whole method: prefix of its runs, caption
    "ours": ("ours_without", "taken out of ours"),
    "active_exploration": ("paper_with", "added to the paper's method"),
}

OTHER_NAMES = {"ours_uniform": "ours_without/sobol_sequence"}
"""Methods that leave a part out and are not named after it."""

BELONGING = {*ABLATIONS, *OTHER_NAMES, *(prefix for prefix, _ in ABLATIONS.values())}

WORK = ("steps", "patches_traced", "run_seconds")


def errors_of(runs: Sequence[Run]) -> pd.DataFrame:
    """A row per run of `sweeps/learner`: scene, method, seed, errors on hard frames, `WORK`.

    Runs that belong to neither ablation are left out. Raises ValueError where a method has two runs
    of one scene and seed.
    """
    rows: dict[tuple[str, str, int], dict[str, Any]] = {}
    for run in runs:
        method = run.label.get("method") or ""
        if method.partition("/")[0] not in BELONGING:
            continue
        key = run.scene, method, run.seed
        if key in rows:
            raise ValueError(
                f"two runs of {method} on {run.scene} with seed {run.seed}, {run.folder} is one; "
                "give a folder that holds one sweep alone"
            )
        rows[key] = {
            **{f"hard_{metric}": run.history[f"hard_{metric}"].iloc[-1] for metric in METRICS},
            **{name: run.result[name] for name in WORK},
        }
    columns = ["scene", "method", "seed"]
    return pd.DataFrame(
        [{**dict(zip(columns, key, strict=True)), **rows[key]} for key in sorted(rows)],
        columns=[*columns, *(f"hard_{metric}" for metric in METRICS), *WORK],
    )


def errors_by_part(results: pd.DataFrame, whole: str) -> pd.DataFrame:
    """[parts, scenes and seeds] errors, the first row those of the whole method, named ''.

    Geometric means on hard frames of the metrics that all runs have; NaN where a run is missing,
    Inf where it diverged. Parts are ordered by their effect over all scenes, those that lower the
    error most by being there first.

    results: as from `errors_of`; scenes and seeds without the whole method, or without any part of
    it, are left out
    """
    prefix, _ = ABLATIONS[whole]
    error = mean_of_shared(results[[f"hard_{metric}" for metric in METRICS]]).fillna(math.inf)
    methods = results["method"].replace(OTHER_NAMES)
    parts = methods.str.removeprefix(f"{prefix}/").mask(methods == whole, "")
    named = methods.eq(whole) | methods.str.startswith(f"{prefix}/")
    table = results[["scene", "seed"]].assign(part=parts, error=error)[named]
    table = table.pivot(index="part", columns=["scene", "seed"], values="error")
    if "" not in table.index:
        return table.iloc[:0]
    table = table.loc[:, table.loc[""].notna() & table.drop(index="").notna().any()]
    gains = effects(table).sort_values(ascending=prefix == "paper_with")
    return table.loc[["", *gains.index]]


def effects(errors: pd.DataFrame) -> pd.Series:
    """[parts] the mean of each part's `effect`; the whole method has none."""
    found = {part: effect(errors, part) for part in errors.index if part}
    return pd.Series({part: estimate.mean for part, estimate in found.items() if estimate})


def effect(errors: pd.DataFrame, part: str) -> Estimate | None:
    """Relative difference of a part to the whole method, the mean over scenes.

    errors: as from `errors_by_part`. A scene's value is the mean over its seeds, paired. None where
    there is no run of the part, a mean of NaN where a run diverged.
    """
    return difference_over_scenes(*_whole_and_part(errors, part))


def effect_on(scene: str, errors: pd.DataFrame, part: str) -> Estimate | None:
    """The same on one scene, the mean over its seeds."""
    return paired_difference(*_whole_and_part(errors[[scene]], part))


def _whole_and_part(errors: pd.DataFrame, part: str) -> tuple[dict[Any, float], dict[Any, float]]:
    """Errors of the runs that there are, NaN where one diverged."""
    there = (errors.loc[name].dropna().replace(math.inf, math.nan) for name in ("", part))
    whole, of_part = (runs.to_dict() for runs in there)
    return whole, of_part


def parts_table(results: pd.DataFrame) -> str:
    """Two tables, a row per part, a column per scene: errors and their differences to the whole.

    results: as from `errors_of`, see `errors_by_part`
    """
    return "\n\n".join(_table(errors_by_part(results, whole), whole) for whole in ABLATIONS)


def _table(errors: pd.DataFrame, whole: str) -> str:
    scenes = errors.columns.unique("scene")
    heads = [ABLATIONS[whole][1], *scenes, "all of them"]
    lines = [markdown_row(heads), markdown_row([":--", *["--:"] * (len(heads) - 1)])]
    for part in errors.index:
        means = {scene: _mean(errors.loc[part, scene]) for scene in scenes}
        if part == "":
            cells = [f"**{mean}**" for mean in means.values()]
            lines.append(markdown_row(["*nothing*", *cells, ""]))
            continue
        cells = [
            f"{mean} ({format_percent(found, 0)})"
            if (found := effect_on(scene, errors, part))
            else ""
            for scene, mean in means.items()
        ]
        overall = format_percent(effect(errors, part), 0)
        lines.append(markdown_row([title(part), *cells, overall]))
    return "\n".join(lines)


def _mean(errors: pd.Series) -> str:
    """Over the seeds of a scene; how many runs diverged instead, where any did."""
    diverged = errors.eq(math.inf).sum()
    return f"{diverged} of {errors.count()} diverged" if diverged else f"{errors.mean():.4f}"


def title(part: str) -> str:
    """As tables and legends name a part, or '', the whole method."""
    return part.replace("_", " ") or "nothing"
