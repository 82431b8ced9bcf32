"""A renderer in an actor on a Ray cluster. Needs Ray (`pip install -e .[ray]`)."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import ray
from ray.exceptions import RayError

from ngi.render.worker_protocol import RenderServer, Reply, Request, Worker, WorkerDiedError


@dataclass(frozen=True)
class Share:
    """What every worker gets of its machine; gpus: 1 / k where k workers share one."""

    cpus: int
    gpus: float


class RayWorker(Worker):
    """The `Worker` that is an actor, which Ray places on a machine with room for its share.

    number: 0, 1, ... make: pickled function without arguments that makes the renderer, there.
    `ngi` and the files of the scene have to be on every machine, under the same paths.
    """

    def __init__(self, number: int, *, share: Share, make: bytes) -> None:
        actor = ray.remote(num_cpus=share.cpus, num_gpus=share.gpus)(RenderServer)
        self._actor = actor.remote(make, threads=share.cpus)
        self._replies = deque([self._actor.start.remote()])
        self.name = f"renderer actor {number}"

    def send(self, request: Request) -> None:
        self._replies.append(self._actor.render.remote(request))

    def receive(self) -> Reply:
        try:
            reply: Reply = ray.get(self._replies.popleft())
        except RayError as error:
            raise WorkerDiedError(" ".join(str(error).split())) from error
        return reply

    def kill(self) -> None:
        ray.kill(self._actor)


def join_cluster(address: str, *, workers: int) -> Share:
    """Connects this process, unless it is already, and shares the cluster out among the workers.

    address: 'auto' for the cluster that this machine belongs to, 'local' for a new one on it.
    Raises ConnectionError where there is no cluster, and RuntimeError where it has no room.
    """
    if not ray.is_initialized():
        ray.init(address=address, logging_level=logging.WARNING)
    return share_out([node["Resources"] for node in ray.nodes() if node["Alive"]], workers)


def share_out(machines: Sequence[Mapping[str, float]], workers: int) -> Share:
    """The largest share that all workers can have at the same time.

    machines: the number of CPUs and GPUs of each; those without a GPU are left out where others
    have one. Raises RuntimeError for more workers than CPUs.
    """
    machines = [machine for machine in machines if machine.get("GPU")] or machines
    gpus = sum(int(machine.get("GPU", 0)) for machine in machines)
    per_gpu = -(-workers // gpus) if gpus else workers

    def room(cpus: int) -> int:
        return sum(
            min(int(machine.get("CPU", 0)) // cpus, int(machine.get("GPU", 1)) * per_gpu)
            for machine in machines
        )

    most = max(int(machine.get("CPU", 0)) for machine in machines)
    cpus = max((cpus for cpus in range(1, most + 1) if room(cpus) >= workers), default=0)
    if cpus == 0:
        raise RuntimeError(
            f"renderer.workers={workers}: the Ray cluster has CPUs for only {room(1)} "
            "workers; lower renderer.workers"
        )
    return Share(cpus=cpus, gpus=1 / per_gpu if gpus else 0)
