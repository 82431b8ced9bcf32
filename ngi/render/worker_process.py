"""A renderer in a process of its own on this machine.

Neither forked, since CUDA and Dr.Jit do not survive that, nor started by multiprocessing, which
would run the main module again and fails below some launchers of sweeps.
"""

import os
import pickle
import signal
import subprocess
import sys
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from queue import SimpleQueue
from threading import Thread

import torch

from ngi.machine.memory import keep_freed_memory
from ngi.machine.size import usable_cores
from ngi.render.worker_protocol import RenderServer, Reply, Request, Worker, WorkerDiedError

NICENESS = 10
"""Of processes that render on the CPU: a tenth of its time while training wants all of it. At 0 a
6x128 step beside two of them took three times as long on two cores; at 19 nothing was rendered."""


class WorkerProcess(Worker):
    """The `Worker` that is a process of this machine, in which `serve` runs.

    number, of: 0, 1, ... of how many; together they use the machine's cores once.
    make: pickled function without arguments that makes the renderer.

    Without a GPU it lets training go first: the threads of a step wait for the slowest of them at
    every barrier, so that a busy neighbour on one core slows all.
    """

    def __init__(self, number: int, *, of: int, make: bytes) -> None:
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
        gpus = visible_gpus()
        if gpus:
            environment["CUDA_VISIBLE_DEVICES"] = gpus[(number + 1) % len(gpus)]  # 0 trains
        niceness = 0 if gpus else NICENESS
        threads = max(1, (usable_cores() + number) // of)
        self._connection, theirs = Pipe()
        with theirs:
            numbers = map(str, (theirs.fileno(), threads, niceness))
            self._process = subprocess.Popen(
                [sys.executable, "-c", f"from {__name__} import main; main()", *numbers],
                env=environment,
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                process_group=0,  # Ctrl-C is for this process to deal with
            )
        self.name = f"renderer process {number} (pid {self._process.pid})"
        self._send(make)

    def send(self, request: Request) -> None:
        self._send(pickle.dumps(request))

    def receive(self) -> Reply:
        try:
            reply: Reply = pickle.loads(self._connection.recv_bytes())
        except (EOFError, OSError):
            code = self._process.wait()
            end = signal.Signals(-code).name if code < 0 else f"exit code {code}"
            raise WorkerDiedError(end) from None
        return reply

    def kill(self) -> None:
        self._process.kill()

    def release(self) -> None:
        self._process.wait()
        self._connection.close()

    def _send(self, message: bytes) -> None:
        with suppress(OSError):  # of a pipe that nobody reads from
            self._connection.send_bytes(message)


def visible_gpus() -> list[str]:
    """The GPUs that a process started from here sees, as CUDA_VISIBLE_DEVICES names them."""
    indices = [str(index) for index in range(torch.cuda.device_count())]
    names = os.environ.get("CUDA_VISIBLE_DEVICES", ",".join(indices)).split(",")
    return names[: len(indices)]


def serve(connection: Connection, *, threads: int) -> None:
    """Answers what comes over the connection, for as long as the process at its other end lives."""
    make = connection.recv_bytes()
    requests: SimpleQueue[Request] = SimpleQueue()
    Thread(target=_listen, args=(connection, requests), daemon=True).start()
    keep_freed_memory()
    server = RenderServer(make, threads=threads)
    connection.send_bytes(pickle.dumps(server.start()))
    while True:
        connection.send_bytes(pickle.dumps(server.render(requests.get())))


def _listen(connection: Connection, requests: SimpleQueue[Request]) -> None:
    """Reads at all times, so that neither end waits for the other to read.

    Where the other has ended, this one does too, even in the middle of a patch.
    """
    try:
        while True:
            requests.put(pickle.loads(connection.recv_bytes()))
    finally:
        os._exit(1)


def main() -> None:
    """Runs in the process that `WorkerProcess` starts."""
    descriptor, threads, niceness = map(int, sys.argv[1:])
    os.nice(niceness)  # threads that start from here on inherit it
    serve(Connection(descriptor), threads=threads)
