"""When does one method have less error than another has at its end?

`python -m analysis.examples.time_to_error FOLDER METHOD BASELINE` prints, scene by scene, the
errors at the end, and the part of the baseline's run time after which the method's error on the
hard frames (geometric mean of the metrics) stays below that with which the baseline ends, means
over the seeds that both have; without a part where a run diverged, and of what is not trained.
Cells begin with `# %%`, see `questions.py`.
"""

# %%
import sys

import numpy as np
from tabulate import tabulate

from analysis import load_runs
from analysis.pairs import pair_runs
from analysis.runs import METRICS, check_comparable
from analysis.speedup import log_error_series, time_to_stay_below
from analysis.statistics import estimate
from analysis.tables import MISSING

folder, method, baseline = sys.argv[1:4]
results = load_runs(folder)
for warning in results.warnings:
    print(f"warning: {warning}", file=sys.stderr)
runs = results.found
check_comparable(runs)


# %% Means and 95 % intervals over seeds
def interval(values: list[float]) -> str:
    """Mean, and half the width of Student's interval where there are several values."""
    found = estimate(values)
    half = "" if found.half_width is None else f" ± {found.half_width:.3f}"
    return f"{found.mean:.3f}{half}"


# %% A row per scene
rows = []
for scene in sorted({run.scene for run in runs}):
    pairs = pair_runs(runs, scene, method, baseline)
    both = [(pair.better, pair.worse) for pair in pairs]
    if not both:
        continue
    parts, differences = [], []
    for ours, theirs in both:
        curve, end = log_error_series([ours, theirs])
        if not (len(curve) and len(end)):  # one diverged
            parts.append((np.nan, False))
            differences.append(np.nan)
            continue
        seconds, bound = time_to_stay_below(curve, end[-1, 1])
        length = end[-1, 0]
        parts.append((seconds / length, bound) if length > 0 else (np.nan, False))
        differences.append(100 * (np.exp(curve[-1, 1] - end[-1, 1]) - 1))
    at_most = "at most " if any(bound for _, bound in parts) else ""
    of = {who: [pair[who] for pair in both] for who in (0, 1)}
    finals = [
        " / ".join(
            f"{np.mean([run.history[f'hard_{metric}'].iloc[-1] for run in of[who]]):.3f}"
            for metric in METRICS
        )
        for who in (0, 1)
    ]
    part = np.mean([p for p, _ in parts])
    time = MISSING if np.isnan(part) else f"{at_most}{part:.3f}"
    lost = sum(ours.diverged("hard") or theirs.diverged("hard") for ours, theirs in both)
    seeds = f"{len(both)} ({lost} diverged)" if lost else len(both)
    rows.append([scene, seeds, *finals, f"{interval(differences)} %", time])
print(f"Hard frames, {' / '.join(METRICS)}; error: {method} against {baseline} at the end;")
print(f"time: part of its run time after which {method} stays below {baseline}'s final error")
print(
    tabulate(
        rows,
        ["scene", "seeds", method, baseline, "error", "time"],
        disable_numparse=True,
        tablefmt="github",
    )
)
