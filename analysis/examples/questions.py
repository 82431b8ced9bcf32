"""Three questions to a folder of runs: `python -m analysis.examples.questions FOLDER`.

Cells begin with `# %%`: an editor that knows them (VS Code, PyCharm, Spyder, Jupytext) shows this
file as a notebook.
"""

# %%
import sys

import numpy as np
import pandas as pd

from analysis import load_runs

results = load_runs(sys.argv[1] if len(sys.argv) > 1 else "outputs/demo")
for warning in results.warnings:
    print(f"warning: {warning}", file=sys.stderr)
evaluations, frames = results.evaluations, results.frames
means = evaluations.query("statistic == 'mean' and set == 'hard' and metric == 'mape'")

# %% Which method has the lowest error after the same time?
# The longest time that all runs of a scene reached that are trained; MAPE on hard frames, mean over
# the seeds. Path tracing has one error at any time.
runs = means.groupby(["scene", "method", "seed"])
ends = runs["run_seconds"].max().loc[lambda seconds: seconds > 0].groupby("scene").min()


def error_at(history: pd.DataFrame, seconds: float) -> float:
    history = history.sort_values("run_seconds")
    return float(np.interp(seconds, history["run_seconds"], history["value"]))


errors = runs[["run_seconds", "value"]].apply(lambda run: error_at(run, ends.get(run.name[0], 0.0)))
print("\nMAPE on hard frames after the same time:")
print(errors.groupby(["scene", "method"]).agg(["mean", "std", "count"]).round(4).to_string())

# %% How long does each method take to reach an error?
# For every scene the error that its worst method ends with; the first evaluation at or below it. A
# mean over the seeds that get there would favour who does by chance: there is none unless all do.
targets = errors.groupby(["scene", "method"]).mean().groupby("scene").max()
reached = means[means["value"] <= means["scene"].map(targets)]
seconds = reached.groupby(["scene", "method", "seed"])["run_seconds"].min().reindex(errors.index)
by_method = seconds.groupby(["scene", "method"])
times = pd.DataFrame({"mean": by_method.mean(skipna=False), "count": by_method.count()})
print("\nSeconds to the error that the scene's worst method ends with, count: seeds that reach it:")
print(times.round(1).to_string())

# %% Which frames are hardest, and which method does best there?
mape = frames.query("set == 'hard' and metric == 'mape'")
table = mape.pivot_table(values="value", index=["scene", "frame"], columns="method")
hardest = table.assign(best=table.idxmin(axis=1), hardness=table.min(axis=1))
hardest = hardest.sort_values("hardness", ascending=False).groupby("scene").head(3).sort_index()
print("\nThe three hardest frames of each scene, MAPE:")
print(hardest.drop(columns="hardness").round(4).to_string())
