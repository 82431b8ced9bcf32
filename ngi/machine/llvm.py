"""Finds a libLLVM that Dr.Jit can use, without loading any into this process.

Dr.Jit 1.5 refuses LLVM 14, and 15 and 16 abort the whole process at the first render ("Cannot
select fminimum"), so a library is asked for its version in a child process before it is trusted.
"""

import os
import re
import subprocess
import sys
from ctypes.util import find_library
from dataclasses import dataclass
from functools import cache
from pathlib import Path

OLDEST_VERSION = 17
"""First major version with which Dr.Jit's LLVM backend renders correctly."""

INSTALL_COMMAND = "apt-get install libllvm19"

WITHOUT_ROOT = "or, without being root, from conda-forge: name the file in DRJIT_LIBLLVM_PATH"

LIBRARY_PATTERNS = (
    "/usr/lib/llvm-*/lib/libLLVM",
    "/usr/lib/*/libLLVM",
    "/usr/lib/libLLVM",
    "/usr/lib64/libLLVM",
    "/usr/local/lib/libLLVM",
    "/opt/homebrew/opt/llvm*/lib/libLLVM",
    "/usr/local/opt/llvm*/lib/libLLVM",
)

_LIBRARY_NAME = re.compile(r"libLLVM(-[\d.]+)?(\.so(\.[\d.]+)?|(\.[\d.]+)?\.dylib)")

_ASK_VERSION = """
import ctypes, sys
library = ctypes.CDLL(sys.argv[1])
version = [ctypes.c_uint() for _ in range(3)]
library.LLVMGetVersion(*map(ctypes.byref, version))
print(*(number.value for number in version))
"""


@dataclass(frozen=True)
class LlvmLibrary:
    """One libLLVM found on this machine. problem: why Dr.Jit cannot use it; None where it can"""

    path: str
    problem: str | None
    version: tuple[int, ...] = ()

    def __str__(self) -> str:
        return f"LLVM {'.'.join(map(str, self.version))} ({self.path})"


def find_llvm() -> LlvmLibrary | None:
    """The library to use: $DRJIT_LIBLLVM_PATH where that is usable, else the newest usable one."""
    usable = [library for library in llvm_candidates() if library.problem is None]
    asked_for = os.environ.get("DRJIT_LIBLLVM_PATH")
    if asked_for and usable and usable[0].path == asked_for:
        return usable[0]
    return max(usable, key=lambda library: library.version, default=None)


def llvm_candidates() -> list[LlvmLibrary]:
    """Every libLLVM found, $DRJIT_LIBLLVM_PATH first; several names of one file count once."""
    found: dict[str, str] = {}
    for path in _candidate_paths():
        found.setdefault(os.path.realpath(path), path)
    return [_examine(path) for path in found.values()]


def _candidate_paths() -> list[str]:
    paths = []
    if asked_for := os.environ.get("DRJIT_LIBLLVM_PATH"):
        paths.append(asked_for)
    conda = os.environ.get("CONDA_PREFIX")
    for pattern in (*LIBRARY_PATTERNS, *([f"{conda}/lib/libLLVM"] if conda else [])):
        matches = Path("/").glob(pattern.lstrip("/") + "*")
        paths += sorted(str(match) for match in matches if _LIBRARY_NAME.fullmatch(match.name))
    # A bare name such as libLLVM-19.so.1: the dynamic linker knows folders that we do not.
    if (by_linker := find_library("LLVM")) and not any(p.endswith(by_linker) for p in paths):
        paths.append(by_linker)
    return paths


@cache
def _examine(path: str) -> LlvmLibrary:
    """Asks a library for its version in a child process (0.1 s), once per process."""
    try:
        child = subprocess.run(
            [sys.executable, "-I", "-c", _ASK_VERSION, path],
            capture_output=True,
            text=True,
            timeout=30,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return LlvmLibrary(path, f"its version could not be asked: {error}")
    if child.returncode != 0:
        return LlvmLibrary(path, _problem(child))
    version = tuple(map(int, child.stdout.split()))
    if version[0] < OLDEST_VERSION:
        number = ".".join(map(str, version))
        return LlvmLibrary(path, f"version {number}, Dr.Jit needs {OLDEST_VERSION} or newer")
    return LlvmLibrary(path, None, version)


def _problem(child: subprocess.CompletedProcess[str]) -> str:
    if "LLVMGetVersion" in child.stderr:  # the function came with LLVM 16
        return f"older than version 16, Dr.Jit needs {OLDEST_VERSION} or newer"
    reason = child.stderr.strip().splitlines() or [f"exit status {child.returncode}"]
    return f"it does not load: {reason[-1]}"
