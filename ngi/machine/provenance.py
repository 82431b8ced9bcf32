"""Where a result comes from: commit, library versions and machine."""

import hashlib
import platform
import subprocess
from collections.abc import Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from sysconfig import get_path
from typing import Any

import ngi
from ngi.machine.size import usable_cores

SCHEMA_VERSION = 1

DATA = "_data"
"""Folder of a wheel's package that has what lies beside the package in a checkout."""

LIBRARIES = ("torch", "lightning", "mitsuba", "drjit", "hydra-core", "lpips", "numpy")


def provenance(*, backend: str) -> dict[str, Any]:
    """What every result file begins with. backend: the renderer's description."""
    import torch  # the doctor reads LIBRARIES where PyTorch may be missing

    commit, dirty = code_commit()
    return {
        "schema_version": SCHEMA_VERSION,
        "commit": commit,
        "dirty": dirty,
        "versions": {"python": platform.python_version(), **_versions()},
        "machine": {
            "processor": _processor(),
            "cores": usable_cores(),
            "threads": torch.get_num_threads(),
            "gpu": torch.cuda.get_device_name() if torch.cuda.is_available() else None,
            "backend": backend,
        },
    }


def _versions() -> dict[str, str | None]:
    found: dict[str, str | None] = {}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = None
    return found


@cache
def code_commit() -> tuple[str | None, bool]:
    """The commit of this code and whether it was changed since; (None, False) outside git.

    As it is when it is first asked for: a process loads its modules once.
    """
    folder = Path(__file__).resolve().parent

    def git(*arguments: str) -> str:
        return subprocess.run(
            ["git", "-C", str(folder), *arguments], capture_output=True, text=True, check=True
        ).stdout.strip()

    try:
        git("ls-files", "--error-unmatch", __file__)  # an unrelated repository is not ours
        return git("rev-parse", "HEAD"), bool(git("status", "--porcelain", "--untracked-files=no"))
    except (OSError, subprocess.CalledProcessError):
        return None, False


def code_hash(packages: Sequence[str] = ()) -> str:
    """16 hexadecimal digits over every module of this package, with its name.

    It differs between two states of the code with the same commit, if a module of the package has
    changed. Files beside the package, which a wheel has in `DATA`, do not count.

    packages: names of others, or of modules, whose files count as well where nobody has installed
        them: those that a user is at work on
    """
    folder = Path(ngi.__file__).resolve().parent
    modules = [(folder, f) for f in _modules(folder) if f.relative_to(folder).parts[0] != DATA]
    modules += [each for name in packages for each in _at_work_on(name)]
    digest = hashlib.sha256()
    for place, file in modules:
        digest.update(f"{file.relative_to(place)}\0{file.stat().st_size}\0".encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _modules(folder: Path) -> list[Path]:
    found = (f for f in folder.rglob("[!.]*.py") if f.is_file())  # editors leave links to nothing
    return sorted(found)


def _at_work_on(name: str) -> list[tuple[Path, Path]]:
    """Files of a package or module, each with the folder that its name counts from."""
    try:
        spec = find_spec(name)
    except ValueError:  # of what has none, such as __main__
        return []
    if spec is None or spec.origin is None or not (origin := Path(spec.origin).resolve()).is_file():
        return []
    installed = (Path(get_path(place)).resolve() for place in ("stdlib", "purelib", "platlib"))
    if any(origin.is_relative_to(place) for place in installed):
        return []
    files = _modules(origin.parent) if spec.submodule_search_locations else [origin]
    return [(origin.parent, file) for file in files]


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
