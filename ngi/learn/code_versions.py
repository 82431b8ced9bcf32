"""Every version of the code that made a run: no part of its identity, but of its record."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from typing import Any

from ngi.durable import write_atomically

log = logging.getLogger(__name__)

FILE = "commits.json"


def code_versions(folder: Path) -> list[dict[str, Any]]:
    """Of a run, in order: 'commit' (None outside git), 'dirty', and 'after_step' from which on.

    Empty for runs of before this was recorded. Raises ValueError where the file is damaged.
    """
    path = folder / FILE
    if not path.exists():
        return []
    try:
        found: list[dict[str, Any]] = json.loads(path.read_text())
        _ = [(entry["commit"], entry["dirty"], entry["after_step"]) for entry in found]
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{path} is damaged ({error}); delete it, and the run goes on") from error
    return found


def record_code_version(folder: Path, *, commit: str | None, dirty: bool, after_step: int) -> None:
    """Adds the version with which a run is begun or goes on, and warns where it is another one."""
    found = code_versions(folder)
    now = {"commit": commit, "dirty": dirty, "after_step": after_step}
    if found and found[-1]["commit"] == commit and not (dirty or found[-1]["dirty"]):
        return
    if found and after_step > 0:
        log.warning(
            "%s: goes on with %s; up to step %d it was made with %s. If what is computed has "
            "changed in between, start it afresh in another folder (run.folder=…)",
            folder,
            _shown(now),
            after_step,
            _shown(found[-1]),
        )
    kept = [entry for entry in found if entry["after_step"] < after_step]
    write_atomically(folder / FILE, json.dumps([*kept, now], indent=2).encode())


def _shown(version: dict[str, Any]) -> str:
    commit = f"commit {version['commit'][:12]}" if version["commit"] else "code outside git"
    return f"{commit} and uncommitted changes" if version["dirty"] else commit
