"""Where a result comes from: commit, library versions and machine."""

import hashlib
import platform
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
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


def code_hash() -> str:
    """16 hexadecimal digits over every module of this package, with its name.

    It differs between two states of the code with the same commit, if a module of the package has
    changed. Files beside the package, which a wheel has in `DATA`, and classes that a configuration
    takes from other packages, do not count.
    """
    folder = Path(ngi.__file__).resolve().parent
    digest = hashlib.sha256()
    found = (f for f in folder.rglob("[!.]*.py") if f.is_file())  # editors leave links to nothing
    modules = (f for f in found if f.relative_to(folder).parts[0] != DATA)
    for file in sorted(modules):
        digest.update(f"{file.relative_to(folder)}\0{file.stat().st_size}\0".encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
