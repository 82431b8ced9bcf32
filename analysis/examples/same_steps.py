"""How much of a difference is the steps that a method had no time for?

`python -m analysis.examples.same_steps FOLDER [SCENE …]` compares every method that is trained
with uniform sampling, after the same run time and after the same number of steps, by runs of one
budget. Cells begin with `# %%`, see `questions.py`.
"""

# %%
import sys

import numpy as np
import pandas as pd

from analysis import load_runs
from analysis.effects import paired_effect
from analysis.pairs import pair_runs, runs_of_one_budget
from analysis.runs import Run, check_comparable
from analysis.speedup import log_error_series

results = load_runs(sys.argv[1] if len(sys.argv) > 1 else "outputs/demo")
for warning in results.warnings:
    print(f"warning: {warning}", file=sys.stderr)
runs = results.found
check_comparable(runs)
scenes = sys.argv[2:] or sorted({run.scene for run in runs})
methods = sorted({run.label.get("method") or "uniform" for run in runs} - {"uniform"})
if not methods:
    print("nothing to compare with uniform sampling: no run has another method=…")


# %% Two runs
def differences(run: Run, baseline: Run) -> tuple[float, float, float] | None:
    """Part of the baseline's steps, and log error less the baseline's at both ends and after as
    many steps, which are those of the shorter run.

    None for what is not trained, and for a run that was not evaluated, or diverged.
    """
    series = log_error_series([run, baseline], over="step")
    own, its = (one[one[:, 0] > 0] for one in series)
    if not (len(own) and len(its)):
        return None
    (step, error), (its_step, its_error) = own[-1], its[-1]
    both = min(step, its_step)
    after_as_many = np.interp(both, *own.T) - np.interp(both, *its.T)
    return step / its_step, error - its_error, after_as_many


# %% Differences in per cent, with 95 % intervals over the seeds that all scenes have, and scenes
print("Error on hard frames against uniform sampling, geometric mean of the metrics:")
for method in methods:
    alike = runs_of_one_budget(runs, [((scene,), (method, "uniform")) for scene in scenes])
    pairs = [pair for scene in scenes for pair in pair_runs(alike, scene, method, "uniform")]
    found = {
        (pair.better.scene, pair.better.seed): values
        for pair in pairs
        if (values := differences(pair.better, pair.worse)) is not None
    }
    budget = alike[0].label["budget"]
    name = f"{method}, budget={budget} alone" if len(alike) < len(runs) else method
    lost = sum(pair.better.diverged("hard") or pair.worse.diverged("hard") for pair in pairs)
    if lost:
        print(f"{name}: left out {lost} of {len(pairs)} pairs, one of whose runs diverged")
    if not found:
        continue
    table = pd.DataFrame(list(found.values()), index=pd.MultiIndex.from_tuples(found))
    print(f"{name}: {len(table)} runs, {table[0].mean():.3f} of the steps")
    for column, what in ((1, "time"), (2, "steps")):
        by_seed = table[column].unstack(0).dropna()
        if by_seed.empty:
            print(f"  after the same {what}: no seed that all these scenes have")
            continue
        effect = paired_effect(by_seed.to_numpy())
        interval = "" if effect.low is None else f" [{effect.low:+.1f}, {effect.high:+.1f}]"
        print(f"  after the same {what}: {effect.effect_percent:+.1f} %{interval}")
