"""The one place where Dr.Jit and Mitsuba are imported and their variant is chosen.

    from ngi.machine.backend import activate, dr, mi

Dr.Jit reads $DRJIT_LIBLLVM_PATH and $DRJIT_LIBCUDA_PATH when it is imported, so the libraries are
chosen before that.
"""

import logging
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ctypes import CDLL
from functools import cache
from threading import RLock

from ngi.machine.llvm import INSTALL_COMMAND, WITHOUT_ROOT, find_llvm, llvm_candidates

LIBCUDA = "libcuda.so.1"
"""The driver's name wherever one is installed; Dr.Jit itself tries libcuda.so, then /usr/lib."""


def _can_be_loaded(library: str) -> bool:
    try:
        CDLL(library)
    except OSError:
        return False
    return True


_has_driver = _can_be_loaded(os.environ.get("DRJIT_LIBCUDA_PATH") or LIBCUDA)
if _has_driver:
    os.environ.setdefault("DRJIT_LIBCUDA_PATH", LIBCUDA)
_llvm = find_llvm()
if _llvm is not None:
    os.environ["DRJIT_LIBLLVM_PATH"] = _llvm.path

import drjit as dr  # noqa: E402
import mitsuba as mi  # noqa: E402

_most_threads = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0].strip()
if _most_threads.isdecimal() and 0 < int(_most_threads) < dr.thread_count():
    # Who limits PyTorch so, as launchers of several runs on one machine do, means Dr.Jit as well.
    dr.set_thread_count(int(_most_threads))

__all__ = [
    "VARIANTS",
    "a_worker_thread",
    "activate",
    "cuda_problem",
    "describe",
    "dr",
    "llvm_problem",
    "mi",
]

VARIANTS = {"cuda": "cuda_ad_rgb", "llvm": "llvm_ad_rgb", "scalar": "scalar_rgb"}
"""Backend -> Mitsuba variant. The wheels of Mitsuba 3.9 hold no JIT variant without `ad`."""

_logger = logging.getLogger(__name__)

_TRACE_ON_GPU = """
import mitsuba as mi
mi.set_variant("cuda_ad_rgb")
scene = mi.load_dict({"type": "scene", "sphere": {"type": "sphere"}})
assert abs(scene.ray_intersect(mi.Ray3f([0, 0, 4], [0, 0, -1])).t[0] - 3) < 1e-3
"""


_one_at_a_time = RLock()


@contextmanager
def a_worker_thread() -> Iterator[None]:
    """Around whatever may read or write an EXR file: then Dr.Jit has a worker thread.

    On one core it has none, and Mitsuba 3.9 waits for one for ever with every such file
    (docs/upstream.md). Beside a renderer on one core a worker only takes its time: it waits by
    asking again and again, a third of what a patch takes.
    """
    with _one_at_a_time:
        threads = dr.thread_count()
        if threads > 1:
            yield
            return
        dr.set_thread_count(2)
        try:
            yield
        finally:
            dr.set_thread_count(threads)


def activate(backend: str = "auto") -> str:
    """Sets the Mitsuba variant of this thread and returns its name.

    backend: 'cuda', 'llvm', 'scalar', or 'auto', which takes the first of them that works.
    Raises ValueError for any other name and RuntimeError, saying why and what to do, where the
    backend asked for does not work on this machine.
    """
    if backend not in ("auto", *VARIANTS):
        raise ValueError(f"renderer.backend '{backend}': choose one of {['auto', *VARIANTS]}")
    problems: dict[str, Callable[[], str | None]]
    problems = {"cuda": cuda_problem, "llvm": llvm_problem}
    if backend == "auto":
        backend = next((name for name, problem in problems.items() if problem() is None), "scalar")
        if backend == "scalar":
            _say_what_would_be_faster()
    elif backend in problems and (problem := problems[backend]()) is not None:
        raise RuntimeError(f"renderer.backend '{backend}' does not work here: {problem}")
    variant = VARIANTS[backend]
    mi.set_variant(variant)
    return variant


def describe(variant: str) -> str:
    """One line for logs and result files: Mitsuba's version, the variant and what it runs on."""
    runs_on = ""
    if variant == VARIANTS["llvm"]:
        runs_on = f", {_llvm}"
    elif variant == VARIANTS["cuda"]:
        import torch  # slow to import, and only needed for the name

        if torch.cuda.is_available():
            runs_on = f", {torch.cuda.get_device_name()}"
    return f"Mitsuba {mi.__version__}, {variant}{runs_on}"


def llvm_problem() -> str | None:
    """Why the LLVM backend cannot be used and the command that helps, or None where it can."""
    if _llvm is not None:
        return None
    rejected = "; ".join(f"{c.path}: {c.problem}" for c in llvm_candidates())
    remedy = f"get one with `{INSTALL_COMMAND}`, {WITHOUT_ROOT}"
    return f"no usable libLLVM ({rejected or 'none found'}); {remedy}"


@cache
def cuda_problem() -> str | None:
    """Why the CUDA backend cannot be used and what to do, or None where it can.

    A ray is traced on the GPU in a child process, since a broken driver can abort its process.
    """
    if not _has_driver:
        return "no NVIDIA driver (libcuda) was found; install one, or choose another backend"
    try:
        child = subprocess.run(
            [sys.executable, "-c", _TRACE_ON_GPU],
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return "tracing one ray took more than two minutes; check the driver with `nvidia-smi`"
    if child.returncode == 0:
        import torch  # slow to import, and only asked where there is a GPU

        if not torch.cuda.is_available():
            return (
                f"PyTorch {torch.__version__} cannot use it; install a build for CUDA that fits "
                "the driver (`nvidia-smi` names its version)"
            )
        return None
    reason = child.stderr.strip().splitlines() or [f"exit status {child.returncode}"]
    return f"tracing one ray failed ({reason[-1]}); check the driver with `nvidia-smi`"


@cache
def _say_what_would_be_faster() -> None:
    """Logged once per process."""
    _logger.warning(
        "rendering with the scalar backend; the LLVM backend would be about 3 times faster; "
        "install it with `%s`",
        INSTALL_COMMAND,
    )
