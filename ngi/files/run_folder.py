"""A run's folder: its identity, its files, and whether it is new, interrupted or finished."""

import fcntl
import hashlib
import json
import math
import shutil
from contextlib import ExitStack
from os.path import relpath
from pathlib import Path
from typing import Any, TextIO

from ngi.files import code_versions
from ngi.files.durable import damage_named, write_atomically
from ngi.files.record_log import CHAINS, TARGET_MAPS, RecordLog
from ngi.files.row_log import RowLog

SETTINGS, RESULT, STEPS = "settings.json", "result.json", "steps.csv"
LAST, PREVIOUS = "last.ckpt", "previous.ckpt"
STABLE = "stable.ckpt"
"""The last checkpoint before the learning rate decayed."""
CHECKPOINTS = (LAST, PREVIOUS, STABLE)
LIMITS = ("steps", "seconds")
"""Of a budget."""
TRACKED = "tracker.json"
"""By which trackers know the run: see `ngi.learn.remote_tracker.kept_id`."""


class RunFolder:
    """The folder of one run. A run's identity is the hash of what decides its result.

    How long it trains is no part of it: a run can be trained longer, in its folder.

    settings: everything that decides the result (resolved configuration, scene hash, version),
        as plain JSON data; those of a run that the folder holds stay as they were first written,
        1 where the command says 1.0 now, for checkpoints go by them.
    linear_megabytes: see `Evaluation.write`
    lengthened: whether the folder holds the same run with a smaller budget
    restarted: whether `begin` will delete what the folder holds of this run
    Raises ValueError where the folder holds another run, RuntimeError where another process is
    training in it, OSError where it can not be written to. In all these cases nothing in the folder
    has been touched.
    """

    def __init__(
        self, path: Path, *, settings: dict[str, Any], linear_megabytes: float = 0.0
    ) -> None:
        self.path = path
        self.settings = settings
        self.linear_megabytes = linear_megabytes
        self.checkpoint = path / LAST
        self.previous_checkpoint = path / PREVIOUS
        self.stable_checkpoint = path / STABLE
        self.patches = path / "patches"
        self.metrics = RowLog(path / "metrics.csv")
        self.steps = RowLog(path / STEPS)
        self.chains = RecordLog(path / "chains.bin", description=CHAINS)
        self.target_maps = RecordLog(path / "target_map.bin", description=TARGET_MAPS)
        self.logs = (self.steps, self.metrics, self.chains, self.target_maps)
        self._result = path / RESULT
        self._settings = path / SETTINGS
        self.lengthened = False
        self.restarted = False
        self._lock = self._acquire_lock()
        self._check_identity()

    @property
    def identity(self) -> str:
        """16 hexadecimal digits, by which checkpoints know the run."""
        canonical = json.dumps(_without_limits(self.settings)[0], sort_keys=True)
        return hashlib.sha256(canonical.encode()).hexdigest()[:16]

    @property
    def name(self) -> str:
        """What a progress bar calls it: its path from here, the last three parts at most."""
        return "/".join(Path(relpath(self.path)).parts[-3:])

    @property
    def result(self) -> dict[str, Any] | None:
        """The finished run's result, or None while the run is not finished."""
        if self.lengthened or self.restarted or not self._result.exists():
            return None
        advice = "delete it, and the same command evaluates the run again from its last checkpoint"
        with damage_named(self._result, advice):
            result: dict[str, Any] = json.loads(self._result.read_text())
        return result

    def begin(self, *, scene: dict[str, Any] | None = None) -> None:
        """Makes the folder this run's, once everything is built and training can start.

        scene: where it lies, and as what it is known; kept in scene.json, no part of the identity
        """
        if self.restarted:
            self._forget()
        _write_json(self._settings, self.settings)
        if scene is not None:
            _write_json(self.path / "scene.json", scene)

    def forget_result(self) -> None:
        """Before anything of a finished run is changed that is to be trained longer."""
        self._result.unlink(missing_ok=True)

    def _forget(self) -> None:
        """Deletes what this run would go on with; checkpoints first, on which the rest depends."""
        others = (self.path / name for name in (code_versions.FILE, TRACKED))
        checkpoints = (self.path / name for name in CHECKPOINTS)
        for file in (*checkpoints, self._result, *others):
            file.unlink(missing_ok=True)
        self.forget_logs()
        shutil.rmtree(self.patches, ignore_errors=True)

    def forget_logs(self) -> None:
        """Deletes what a start left that was never saved: its columns were perhaps other ones."""
        for log in self.logs:
            log.close()
            log.path.unlink(missing_ok=True)

    def write_result(self, result: dict[str, Any]) -> dict[str, Any]:
        """Writes and returns it, with what only the folder knows.

        That is every version of the code that it was made with, and the logs' lengths and
        checksums, by which damage is seen.
        """
        logs = {log.path.name: log.fingerprint() for log in self.logs}
        whole = {
            **result,
            "commits": code_versions.code_versions(self.path),
            "logs": {name: found for name, found in logs.items() if found},
        }
        _write_json(self._result, whole)
        return whole

    def close(self) -> None:
        """Writes the logs out and lets other processes use the folder."""
        with ExitStack() as stack:
            for part in (self._lock, *self.logs):
                stack.callback(part.close)

    def _acquire_lock(self) -> TextIO:
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            lock = (self.path / ".lock").open("w")
        except OSError as error:
            raise OSError(
                error.errno,
                f"{error.strerror}: this run's folder is not writable; choose another one with "
                "run.folder=…, or change its permissions",
                str(self.path),
            ) from error
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            lock.close()
            raise RuntimeError(
                f"{self.path}: another process is training this run; wait for it or stop it"
            ) from error
        except OSError as error:
            lock.close()
            raise OSError(
                error.errno,
                f"{error.strerror}: this disk cannot lock files, so two processes might train one "
                "run at the same time; choose a folder on another disk with run.folder=…",
                str(self.path),
            ) from error
        return lock

    def _check_identity(self) -> None:
        try:
            earlier = kept_settings(self.path)
        except ValueError:
            self._lock.close()
            raise
        if earlier is None:
            return
        if isinstance(earlier, dict) and longer(self.settings, than=earlier):
            self.lengthened = True
            self.settings = _with_limits_of(self.settings, earlier)
            return
        if different := differences(earlier, self.settings):
            self._lock.close()
            raise ValueError(
                f"{self.path} holds another run ({'; '.join(different[:3])}"
                f"{'; …' if len(different) > 3 else ''}); choose another folder with run.folder=…, "
                "or move that run away"
            )
        self.settings = earlier


def has_something(folder: Path) -> bool:
    """Whether there is a result or a checkpoint; before that there is nothing to lose."""
    return any((folder / name).exists() for name in (*CHECKPOINTS, RESULT))


def kept_settings(folder: Path) -> Any:
    """Of the run that a folder holds; None where there is nothing to lose, or they are not there.

    Raises ValueError where they cannot be read.
    """
    file = folder / SETTINGS
    if not (file.exists() and has_something(folder)):
        return None
    with damage_named(file, "delete it if you are sure that this folder holds the same run"):
        return json.loads(file.read_text())


def longer(settings: dict[str, Any], *, than: dict[str, Any]) -> bool:
    """Whether these are settings of the same run with a larger budget, and it trains."""
    (now, limits), (earlier, former) = map(_without_limits, (settings, than))
    if now != earlier or "path_tracing" in now or limits == former:
        return False
    return all(limit >= old for limit, old in zip(limits, former, strict=True))


def differences(there: Any, now: Any) -> list[str]:
    """Of the settings in a folder and those of a run: each that differs, with both values."""
    before, after = _flatten(there), _flatten(now)
    return [
        f"{key}: {before.get(key, 'absent')!r} there, {after.get(key, 'absent')!r} now"
        for key in sorted(before.keys() | after.keys())
        if before.get(key) != after.get(key)
    ]


def _without_limits(settings: dict[str, Any]) -> tuple[dict[str, Any], list[float]]:
    """The settings but for how long the run is, and this: steps and seconds, Inf for no limit."""
    budget = dict(settings.get("budget", {}))
    limits = [budget.pop(unit, None) for unit in LIMITS]
    rest = {**settings, "budget": budget} if "budget" in settings else settings
    return rest, [math.inf if limit is None else limit for limit in limits]


def _with_limits_of(settings: dict[str, Any], kept: dict[str, Any]) -> dict[str, Any]:
    """The settings that a folder has of the same run, as long as the run is to be now."""
    budget = settings["budget"]
    limits = {unit: budget[unit] for unit in LIMITS if unit in budget}
    return {**kept, "budget": {**kept["budget"], **limits}}


def _write_json(path: Path, content: dict[str, Any]) -> None:
    text = json.dumps(content, indent=2, sort_keys=True)
    write_atomically(path, text.encode())


def _flatten(value: Any, prefix: str = "") -> dict[str, Any]:
    if not isinstance(value, dict):
        return {prefix: value}
    return {
        key: leaf
        for name, child in value.items()
        for key, leaf in _flatten(child, f"{prefix}.{name}" if prefix else name).items()
    }
