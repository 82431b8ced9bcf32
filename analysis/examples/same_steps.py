"""How much of a difference is the steps that a method had no time for?

`python -m analysis.examples.same_steps FOLDER [SCENE …]` compares every method that is trained
with uniform sampling, after the same run time and after the same number of steps. Cells begin with
`# %%`, see `questions.py`.
"""

# %%
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.effects import paired_effect
from analysis.pairs import pair_runs, shared_metrics
from analysis.runs import Run, find_runs

runs = find_runs(Path(sys.argv[1] if len(sys.argv) > 1 else "outputs/demo"))[0]
scenes = sys.argv[2:] or sorted({run.scene for run in runs})
methods = sorted({run.label.get("method", "uniform") for run in runs} - {"uniform"})


# %% Steps of a run's evaluations, and the mean logarithm of the metrics there
def curve(run: Run, metrics: list[str]) -> tuple[np.ndarray, np.ndarray]:
    keys = [f"hard_{metric}" for metric in metrics]
    rows = run.history[run.history["step"] > 0].dropna(subset=keys)
    return rows["step"].to_numpy(float), np.log(rows[keys].to_numpy(float)).mean(axis=1)


def differences(run: Run, baseline: Run) -> tuple[float, float, float] | None:
    """Part of the baseline's steps, and log error less the baseline's at its end and its step.

    None for what is not trained, and for a run that was not evaluated.
    """
    metrics = shared_metrics([run, baseline], "hard")
    (steps, errors), (of_baseline, its_errors) = (curve(one, metrics) for one in (run, baseline))
    if not (steps.size and of_baseline.size):
        return None
    at_its_step = np.interp(steps[-1], of_baseline, its_errors)
    return (
        float(steps[-1] / of_baseline[-1]),
        float(errors[-1] - its_errors[-1]),
        float(errors[-1] - at_its_step),
    )


# %% Differences in per cent, with 95 % intervals over the seeds that all scenes have, and scenes
print("Error on hard frames against uniform sampling, geometric mean of the metrics:")
for method in methods:
    pairs = [pair for scene in scenes for pair in pair_runs(runs, scene, method, "uniform")]
    found = {
        (pair.better.scene, pair.better.seed): values
        for pair in pairs
        if (values := differences(pair.better, pair.worse)) is not None
    }
    if not found:
        continue
    table = pd.DataFrame(list(found.values()), index=pd.MultiIndex.from_tuples(found))
    print(f"{method}: {len(table)} runs, {table[0].mean():.3f} of the steps")
    for column, what in ((1, "time"), (2, "steps")):
        by_seed = table[column].unstack(0).dropna()
        if by_seed.empty:
            print(f"  after the same {what}: no seed that all these scenes have")
            continue
        effect = paired_effect(by_seed.to_numpy())
        interval = "" if effect.low is None else f" [{effect.low:+.1f}, {effect.high:+.1f}]"
        print(f"  after the same {what}: {effect.effect_percent:+.1f} %{interval}")
