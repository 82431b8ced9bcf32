"""How much of a difference is the steps that a method had no time for?

`python -m analysis.examples.same_steps FOLDER [SCENE …]` compares every method that is trained
with uniform sampling, after the same run time and after the same number of steps. Cells begin with
`# %%`, see `questions.py`.
"""

# %%
import sys

import numpy as np
import pandas as pd

from analysis import load_runs
from analysis.effects import paired_effect
from analysis.runs import METRICS

evaluations = load_runs(sys.argv[1] if len(sys.argv) > 1 else "outputs/demo").evaluations
of_hard_frames = evaluations[evaluations["metric"].isin(METRICS)].query(
    "statistic == 'mean' and set == 'hard' and step > 0"
)
scenes = sys.argv[2:] or sorted(of_hard_frames["scene"].unique())

# %% Mean logarithm of the metrics: a column per method, scene and seed, a row per step
log_errors = (
    of_hard_frames[of_hard_frames["scene"].isin(scenes)]
    .assign(log_error=lambda rows: np.log(rows["value"]))
    .pivot_table(values="log_error", index="step", columns=["method", "scene", "seed"])
)


def differences(run: pd.Series, baseline: pd.Series) -> tuple[float, float, float]:
    """Part of the baseline's steps, and log error less the baseline's at its end and its step."""
    run, baseline = run.dropna(), baseline.dropna()
    steps, error = float(run.index[-1]), float(run.iloc[-1])
    at_its_step = np.interp(steps, baseline.index.to_numpy(), baseline.to_numpy())
    return steps / baseline.index[-1], error - baseline.iloc[-1], error - at_its_step


# %% Differences in per cent, with 95 % intervals over seeds and scenes
print("Error on hard frames against uniform sampling, geometric mean of the metrics:")
for method in log_errors.columns.get_level_values(0).unique().drop("uniform"):
    pairs = [(s, k) for s, k in log_errors[method] if (s, k) in log_errors["uniform"]]
    values = [differences(log_errors[method][p], log_errors["uniform"][p]) for p in pairs]
    table = pd.DataFrame(values, index=pd.MultiIndex.from_tuples(pairs))
    print(f"{method}: {len(pairs)} runs, {table[0].mean():.3f} of the steps")
    for column, what in ((1, "time"), (2, "steps")):
        effect = paired_effect(table[column].unstack(0).to_numpy())
        interval = "" if effect.low is None else f" [{effect.low:+.1f}, {effect.high:+.1f}]"
        print(f"  after the same {what}: {effect.effect_percent:+.1f} %{interval}")
