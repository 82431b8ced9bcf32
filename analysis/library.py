"""Runs as tidy pandas frames, for questions that no report answers: `load_runs(folder)`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from analysis.effects import compare_pairs, pool
from analysis.evidence import ComparisonResult
from analysis.methods import name_methods
from analysis.pairs import pair_by_seed
from analysis.runs import FURTHER, METRICS, SETS, Run, check_comparable, find_runs
from analysis.step_log import read_steps

KEYS = ["scene", "method", "seed", "folder"]
"""Which run a row is of: its folder alone tells it from all others."""


@dataclass(frozen=True)
class Results:
    """The runs below a folder. Every frame has the columns scene, method, seed and folder.

    warnings: what was left out, and why; and which runs have the same scene, method and seed, so
    that only the column folder, a string, tells them apart. Runs that a report would refuse to
    compare (other protocols, other references) are here too; the columns of `runs` say which.
    """

    found: tuple[Run, ...]
    warnings: tuple[str, ...]

    @cached_property
    def runs(self) -> pd.DataFrame:
        """A row per run: labels, costs, provenance.

        Columns of nested entries are joined by dots: 'label.reuse', 'seconds.render', 'commit',
        'machine.processor', 'versions.torch', 'protocol.name'. The rest of result.json
        is in the other frames.
        """
        left_out = {"config", "frames", "metrics", "seed"}
        rows = pd.json_normalize(
            [
                {key: value for key, value in run.result.items() if key not in left_out}
                for run in self.found
            ]
        )
        return pd.concat([self._keys(), rows], axis=1)

    @cached_property
    def configs(self) -> pd.DataFrame:
        """A row per run: its whole configuration, defaults too.

        A column per setting, 'model.hidden_features', 'optimizer.lr'; NaN where a run has none of
        that name.
        """
        settings = pd.json_normalize(
            [
                {key: value for key, value in run.result["config"].items() if key != "seed"}
                for run in self.found
            ]
        )
        return pd.concat([self._keys(), settings], axis=1)

    @cached_property
    def evaluations(self) -> pd.DataFrame:
        """A row per evaluation, set, metric and statistic, with the value.

        Columns: step, run_seconds, set ('hard', 'uniform'), metric ('mape', 'dssim', 'mae',
        'lpips', and where they were measured 'relmse' and 'tail', which
        `ngi.evaluate.Evaluation.row` explains and which have a mean alone), statistic
        ('mean', 'worst5': of the worst 5 % of the frames), value (NaN where it was not measured).
        """
        columns = {
            f"{set_name}_{metric}{suffix}": (set_name, metric, statistic)
            for set_name in SETS
            for metric in METRICS
            for suffix, statistic in (("", "mean"), ("_worst5", "worst5"))
        }
        columns |= {
            f"{name}_{metric}": (name, metric, "mean") for name in SETS for metric in FURTHER
        }
        wide = self._tables([run.history for run in self.found])
        there = [column for column in columns if column in wide]
        tidy = wide.melt([*KEYS, "step", "run_seconds"], there, "key", "value")
        parts = [columns[key] for key in tidy.pop("key")]
        tidy[["set", "metric", "statistic"]] = pd.DataFrame(parts, index=tidy.index)
        return tidy[[*KEYS, "step", "run_seconds", "set", "metric", "statistic", "value"]]

    @cached_property
    def frames(self) -> pd.DataFrame:
        """A row per test frame and metric, at the end of the run.

        Columns: set, frame (its index in the set, the same picture in all runs of a scene), metric
        ('mape', 'dssim', 'mae', 'lpips', and 'relmse' where it was measured), value (NaN where it
        was not).
        """
        wide = self._tables([pd.DataFrame(run.result["frames"]) for run in self.found])
        wide = wide.rename(columns={"index": "frame"})
        metrics = [metric for metric in (*METRICS, *FURTHER) if metric in wide]
        tidy = wide.melt([*KEYS, "set", "frame"], metrics, "metric", "value")
        return tidy.astype({"value": float})

    def compared(self, method: str, baseline: str) -> pd.DataFrame:
        """How much less error one method has than another, paired by seed and frame.

        Computed as the paper's claims are judged: the geometric mean of error ratios, with a 95 %
        interval that counts seeds and frames as drawn by chance, over all scenes with each scene
        as one draw.

        method, baseline: as the column `method` names them

        Columns: scene ('all scenes' in the last rows, where there are several), set, metric
        ('together': the geometric mean of the metrics that both have), statistic ('mean',
        'worst5'), difference (per cent, negative where `method` has less error), low, high (NaN
        for a single seed), seeds, frames (pairs per seed; 0 for 'worst5').

        Raises ValueError for methods without a scene and seed in common, for a seed with several
        runs, and for runs that a report would refuse to compare.
        """
        named = [run for run in self.found if run.method in (method, baseline)]
        check_comparable(named)
        results = []
        for scene in sorted({run.scene for run in named}):
            by_method = {
                name: {r.seed: r for r in named if (r.scene, r.method) == (scene, name)}
                for name in (method, baseline)
            }
            if pairs := pair_by_seed(by_method[method], by_method[baseline]):
                results.append(compare_pairs(pairs, scene, method, baseline))
        if not results:
            there = ", ".join(sorted({run.method for run in self.found}))
            raise ValueError(
                f"'{method}' and '{baseline}' have no scene and seed in common; there are {there}"
            )
        together = [pool(results)] if len(results) > 1 else []
        return pd.DataFrame([row for result in results + together for row in _effects(result)])

    @cached_property
    def steps(self) -> pd.DataFrame:
        """A row per training step, as in steps.csv; read at the first use.

        Runs without steps.csv have no rows.
        """
        return self._tables(
            [
                read_steps(run) if (run.folder / "steps.csv").is_file() else pd.DataFrame()
                for run in self.found
            ]
        )

    def _keys(self) -> pd.DataFrame:
        return pd.DataFrame([_key(run) for run in self.found], columns=KEYS)

    def _tables(self, tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
        """One below the other, each with its run's `KEYS` in front."""
        keyed = [
            pd.DataFrame(dict(zip(KEYS, _key(run), strict=True)), table.index)
            .join(table)
            .reset_index(drop=True)
            for run, table in zip(self.found, tables, strict=True)
            if len(table)
        ]
        return pd.concat(keyed, ignore_index=True) if keyed else pd.DataFrame(columns=KEYS)


def load_runs(folder: Path | str) -> Results:
    """Every finished run below a folder.

    Raises ValueError for a folder that is missing or holds no finished run, and for result files
    of another schema version.
    """
    found, warnings = find_runs(Path(folder))
    runs = name_methods(found)
    return Results(tuple(runs), (*warnings, *_repeated(runs)))


def _effects(result: ComparisonResult) -> list[dict[str, Any]]:
    """A row for each effect of a comparison, that of all metrics together first."""
    effects = {("hard", "together", "mean"): result.decisive}
    for key, effect in result.effects.items():
        set_name, metric, *worst = key.split("_")
        effects[set_name, metric, worst[0] if worst else "mean"] = effect
    return [
        {
            **dict(zip(("scene", "set", "metric", "statistic"), (result.scene, *key), strict=True)),
            "difference": effect.effect_percent,
            "low": math.nan if effect.low is None else effect.low,
            "high": math.nan if effect.high is None else effect.high,
            "seeds": effect.seeds,
            "frames": effect.frames,
        }
        for key, effect in effects.items()
    ]


def _key(run: Run) -> tuple[str, str, int, str]:
    return run.scene, run.method, run.seed, str(run.folder)


def _repeated(runs: Sequence[Run]) -> list[str]:
    """A warning per scene, method and seed that several runs have, with their folders."""
    folders: dict[tuple[str, str, int], list[str]] = {}
    for run in runs:
        scene, method, seed, folder = _key(run)
        folders.setdefault((scene, method, seed), []).append(folder)
    return [
        f"{len(those)} runs of {scene}, {method}, seed {seed}, which only the column folder tells "
        f"apart: {', '.join(those)}"
        for (scene, method, seed), those in folders.items()
        if len(those) > 1
    ]
