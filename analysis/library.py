"""Runs as tidy pandas frames, for questions that no report answers: `load_runs(folder)`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import pandas as pd

from analysis.methods import name_methods
from analysis.runs import FURTHER, METRICS, SETS, Run, find_runs
from analysis.step_log import read_steps

KEYS = ["scene", "method", "seed"]


@dataclass(frozen=True)
class Results:
    """The runs below a folder. Every frame has the columns scene, method and seed.

    warnings: what was left out, and why. Runs that a report would refuse to compare (other
    protocols, other references) are here too; the columns of `runs` tell them apart.
    """

    found: tuple[Run, ...]
    warnings: tuple[str, ...]

    @cached_property
    def runs(self) -> pd.DataFrame:
        """A row per run: folder, labels, costs, provenance.

        Columns of nested entries are joined by dots: 'label.reuse', 'seconds.render', 'commit',
        'machine.processor', 'versions.torch', 'protocol.name'. Without `config` and the errors.
        """
        left_out = {"config", "frames", "metrics", "seed"}
        rows = pd.json_normalize(
            [
                {key: value for key, value in run.result.items() if key not in left_out}
                for run in self.found
            ]
        )
        folders = [str(run.folder) for run in self.found]
        return pd.concat([_keys(self.found), pd.DataFrame({"folder": folders}), rows], axis=1)

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

        Columns: set, frame (its index in the set, the same picture in all runs of a scene), metric,
        value (NaN where it was not measured).
        """
        wide = self._tables([pd.DataFrame(run.result["frames"]) for run in self.found])
        wide = wide.rename(columns={"index": "frame"})
        tidy = wide.melt([*KEYS, "set", "frame"], list(METRICS), "metric", "value")
        return tidy.astype({"value": float})

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

    def _tables(self, tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
        """One below the other, each with its run's scene, method and seed in front."""
        keyed = [
            pd.DataFrame({"scene": run.scene, "method": run.method, "seed": run.seed}, table.index)
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
    runs, warnings = find_runs(Path(folder))
    return Results(tuple(name_methods(runs)), tuple(warnings))


def _keys(runs: Sequence[Run]) -> pd.DataFrame:
    return pd.DataFrame([(run.scene, run.method, run.seed) for run in runs], columns=KEYS)
