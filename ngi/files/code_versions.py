"""Every version of the code that made a run: no part of its identity, but of its record."""

import json
import logging
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import ngi
from ngi.files.durable import damage_named, write_atomically
from ngi.machine.provenance import code_commit, code_hash

log = logging.getLogger(__name__)

FILE = "commits.json"


def code_version(settings: Any = None) -> dict[str, Any]:
    """'commit' (None outside git), 'dirty', and 'code', a hash over this package's modules.

    As they are when it is first asked for.
    settings: of a run, nested; modules of the user's own that it names (`_target_`) count as well
    """
    return _version(tuple(sorted({target.partition(".")[0] for target in _targets(settings)})))


@cache
def _version(packages: Sequence[str]) -> dict[str, Any]:
    commit, dirty = code_commit()
    own = [name for name in packages if name and name != ngi.__name__]
    return {"commit": commit, "dirty": dirty, "code": code_hash(own)}


def _targets(settings: Any) -> Iterator[str]:
    if isinstance(settings, dict):
        yield from (v for key, v in settings.items() if key == "_target_" and isinstance(v, str))
        settings = list(settings.values())
    for part in settings if isinstance(settings, list) else ():
        yield from _targets(part)


def code_versions(folder: Path) -> list[dict[str, Any]]:
    """Of a run, in order: `code_version`, and 'after_step' from which on it was made with it.

    Empty where nothing was made yet. Raises ValueError where the file is damaged.
    """
    path = folder / FILE
    if not path.exists():
        return []
    with damage_named(path, "delete it, and the run resumes"):
        found: list[dict[str, Any]] = json.loads(path.read_text())
        _ = [[entry[key] for key in ("commit", "dirty", "code", "after_step")] for entry in found]
    return found


def record_code_version(folder: Path, *, after_step: int, settings: Any = None) -> None:
    """Adds the version with which a run is begun or goes on, and warns where it is another one.

    after_step: the last step that is kept of what was made before
    settings: the run's, see `code_version`
    """
    found, version = code_versions(folder), code_version(settings)
    kept = [entry for entry in found if entry["after_step"] < after_step]
    if kept and same_program(kept[-1], version):
        _write(folder, kept)
        return
    if kept:
        log.warning(
            "%s: resumes with %s; up to step %d it was made with %s. If the computation has "
            "changed in between, run.on_code_change=restart begins again",
            folder,
            shown(version),
            after_step,
            shown(kept[-1]),
        )
    _write(folder, [*kept, {**version, "after_step": after_step}])


def made_with(folder: Path, *, last_step: int) -> dict[str, Any] | None:
    """The version that made the last step there is, None where nothing was made yet.

    Not one with which the run was started afterwards, and stopped before it made a step.
    last_step: the last in steps.csv, saved or not; 0 of what makes no steps
    """
    found = code_versions(folder)
    made = [entry for entry in found if entry["after_step"] < last_step]
    return made[-1] if made else found[-1] if found else None


def _write(folder: Path, versions: list[dict[str, Any]]) -> None:
    write_atomically(folder / FILE, json.dumps(versions, indent=2).encode())


def same_program(earlier: dict[str, Any], now: dict[str, Any]) -> bool:
    """Whether two versions compute the same, as far as is known."""
    return bool(earlier["code"] == now["code"])


def shown(version: dict[str, Any]) -> str:
    """'commit 0123456789ab and uncommitted changes (0123abcd)'."""
    code = f" ({version['code'][:8]})"
    commit = f"commit {version['commit'][:12]}" if version["commit"] else f"code outside git{code}"
    return f"{commit} and uncommitted changes{code}" if version["dirty"] else commit
