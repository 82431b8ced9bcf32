"""What becomes of a run whose program has changed since it was made or interrupted."""

import logging

from ngi.files import code_versions
from ngi.files.code_versions import made_with, same_program, shown
from ngi.files.run_folder import RunFolder, has_something

log = logging.getLogger(__name__)

ON_CHANGE = ("continue", "refuse", "restart")
"""What `run.on_code_change` can be."""


def heed_code_change(folder: RunFolder, *, on_change: str) -> None:
    """Does what `run.on_code_change` says where the code is not what the run was made with so far.

    'continue' leaves it at a warning: here for a finished run, for others once they go on (see
    `record_code_version`). 'restart' lets the folder's `begin` delete what is there. Raises
    RuntimeError for 'refuse', ValueError for another word.
    """
    if on_change not in ON_CHANGE:
        raise ValueError(f"run.on_code_change: '{on_change}'; expected one of {list(ON_CHANGE)}")
    if not has_something(folder.path):
        return
    made = made_with(folder.path, last_step=folder.steps.last_step)
    now = code_versions.code_version(folder.settings)
    if made is None or same_program(made, now):
        return
    change = f"{folder.path} was made with {shown(made)}; this program is {shown(now)}"
    if on_change == "refuse":
        raise RuntimeError(
            f"{change}; run.on_code_change=continue keeps the run, run.on_code_change=restart "
            "deletes it and begins again, run.folder=… chooses another folder"
        )
    if on_change == "restart":
        log.warning("%s: the run is deleted and begins again", change)
        folder.restarted = True
    elif folder.result is not None:
        log.warning("%s: to repeat the run, set run.on_code_change=restart", change)
