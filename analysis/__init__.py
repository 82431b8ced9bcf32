"""From the files that runs leave behind to tables, plots, pictures and verdicts.

Reads files only: nothing of `ngi` is imported, so results can be reported where it is not
installed. `load_runs(folder)` gives the runs as pandas frames; `analysis/examples` shows how they
answer questions.
"""

import logging

from analysis.library import Results, load_runs

# Of a missing font cache or an unwritable home it says much that is of no use to anybody here.
logging.getLogger("matplotlib").setLevel(logging.ERROR)

__all__ = ["Results", "load_runs"]
