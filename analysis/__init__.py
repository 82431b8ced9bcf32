"""From the files that runs leave behind to tables, plots, pictures and verdicts.

Reads files only: nothing of `ngi` is imported, so results can be reported where it is not
installed. `load_runs(folder)` gives the runs as pandas frames; `analysis/examples` shows how they
answer questions.
"""

from analysis.library import Results, load_runs

__all__ = ["Results", "load_runs"]
