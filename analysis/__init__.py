"""From the files that runs leave behind to tables, plots, pictures and verdicts.

Reads files only: nothing of `ngi` is imported, so results can be reported where it is not
installed. `load_runs(folder)` gives the runs as pandas frames; `analysis/examples` shows how they
answer questions.
"""

import logging
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.library import Results, load_runs

# Of a missing font cache or an unwritable home it says much that is of no use to anybody here.
logging.getLogger("matplotlib").setLevel(logging.ERROR)

__all__ = ["Results", "load_runs"]

if not TYPE_CHECKING:  # a type checker would take any name for one that is there

    def __getattr__(name: str) -> Any:
        """`Results` and `load_runs`, imported when asked for, so that help waits for no pandas."""
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from analysis import library

        return getattr(library, name)
