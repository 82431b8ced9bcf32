"""Kernels of the tests are compiled without optimisation, in a third of the time.

LLVM's optimisation does not change what a kernel computes, and tests render little: without it most
of their time went into compiling. Nothing of it reaches anybody's runs: such kernels lie in a
folder of their own. `NGI_OPTIMISED=1 pytest` tests those that users have.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from ngi.machine.llvm import find_llvm

FOLDER = Path(__file__).parents[1] / "build" / "quick_kernels"
SOURCE = Path(__file__).with_suffix(".c")


def use() -> None:
    """Has to be called before Dr.Jit is imported; processes that are started have it, too.

    Without a C compiler that works, or anywhere but on Linux, tests take longer and say the same.
    """
    compiler = shutil.which("cc") or shutil.which("gcc")
    wanted = os.environ.get("NGI_OPTIMISED") != "1" and "PYTEST_XDIST_WORKER" not in os.environ
    if not wanted or compiler is None or sys.platform != "linux":
        return
    llvm = find_llvm()
    if llvm is None:
        return
    FOLDER.mkdir(parents=True, exist_ok=True)
    library = FOLDER / f"libLLVM-{llvm.version[0]}.so"
    made = library.with_suffix(f".{os.getpid()}")  # another session may have that one open
    linked = ("-Wl,--no-as-needed", llvm.path, "-ldl")
    command = [compiler, "-shared", "-fPIC", "-o", made, SOURCE, *linked]
    if subprocess.run(command, check=False).returncode != 0:
        return
    made.replace(library)
    os.environ["DRJIT_LIBLLVM_PATH"] = str(library)
    os.environ["DRJIT_CACHE_DIR"] = str(FOLDER)
