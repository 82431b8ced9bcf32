"""Commands in processes that start in no time, forked from one that has imported everything.

`python -m MODULE WORDS` takes five seconds to import Lightning before it begins. What such a
process does here is the same from there on: words, folder, environment, output, exit status.
"""

import atexit
import gc
import multiprocessing
import os
import runpy
import signal
import sys
import threading
from collections.abc import Callable, Mapping
from multiprocessing import forkserver
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import Any
from unittest import mock

CONTEXT = multiprocessing.get_context("forkserver")
PRELOADED = [
    *("pytest", "ngi.train", "ngi.learn", "matplotlib.pyplot", "torch._dynamo", "tqdm"),
    *("tests.learn.forked", "tests.warmed", __name__),
]


def process(work: Callable[..., None], *arguments: Any) -> ForkServerProcess:
    """A process that begins with `work`, with one thread for PyTorch; not started yet."""
    CONTEXT.set_forkserver_preload(PRELOADED)
    with mock.patch.dict(os.environ, PYTHONPATH=os.pathsep.join(sys.path), OMP_NUM_THREADS="1"):
        forkserver.ensure_running()
    return CONTEXT.Process(target=work, args=arguments)


def finish(started: ForkServerProcess, output: Path, *, seconds: float) -> tuple[int, str]:
    """Exit status and what `output` holds; TimeoutError, with that, where it takes longer."""
    started.join(timeout=seconds)
    if started.exitcode is None:
        started.kill()
        raise TimeoutError(output.read_text())
    return started.exitcode, output.read_text()


def start_module(
    module: str, *words: str, folder: Path, environment: Mapping[str, str], output: Path
) -> ForkServerProcess:
    """`python -m MODULE WORDS` in `folder`, which prints into `output`.

    environment: PYTHONPATH in it is looked at first
    """
    started = process(_module, module, words, folder, dict(environment), output)
    started.start()
    return started


def begin(output: Path) -> None:
    """What this process prints from now on, and what it starts, ends up in `output`.

    What was imported is not looked at by its garbage collections, nor copied because of them.
    """
    gc.freeze()
    with output.open("a") as stream:
        for descriptor in (1, 2):
            os.dup2(stream.fileno(), descriptor)


def without_semaphores() -> None:
    """The lock of tqdm is a semaphore, which a killed process would leave behind."""
    from tqdm import tqdm

    tqdm.set_lock(threading.RLock())


def _module(
    module: str, words: tuple[str, ...], folder: Path, environment: dict[str, str], output: Path
) -> None:
    begin(output)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    for place in reversed(environment["PYTHONPATH"].split(os.pathsep)):
        if place in sys.path:
            sys.path.remove(place)
        sys.path.insert(0, place)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in a script's background
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # ignored by nohup
    sys.argv = [module, *words]
    sys.modules.pop(module, None)  # it would be said to be there before it runs
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    except SystemExit as ended:
        if not isinstance(ended.code, str):
            raise
        print(ended.code, file=sys.stderr)  # now; multiprocessing would do so in the end
        raise SystemExit(1) from None
    finally:
        atexit._run_exitfuncs()  # processes of multiprocessing end without
