"""How long a worker may take, and what happens to one that takes longer; without any process."""

from __future__ import annotations

import threading

import pytest

from ngi.render import watchdog
from ngi.render.watchdog import SHORTEST_SECONDS, STARTING_SECONDS, Watchdog
from ngi.render.worker_pool import WorkerPool
from ngi.render.worker_protocol import Request, WorkerDiedError
from tests.render.odd_renderer import OddRenderer, assert_same, states
from tests.waiting import wait_for


class Silent:
    """Says that it is ready, then nothing; `answers` replies come before that."""

    answers = 0

    def __init__(self, number: int) -> None:
        self.name = f"silent {number}"
        self._killed = threading.Event()
        self._left = self.answers
        self._ready = False
        self._requests: list[Request] = []

    def send(self, request: Request) -> None:
        self._requests.append(request)

    def receive(self):
        if not self._ready:
            self._ready = True
            return None
        if self._left:
            self._left -= 1
            request = self._requests.pop(0)
            return OddRenderer(gate=None).render_patches(
                request.states, resolution=request.resolution, seed=request.seed
            )
        assert self._killed.wait(60)
        raise WorkerDiedError("SIGKILL")

    def kill(self) -> None:
        self._killed.set()

    def release(self) -> None:
        assert self._killed.is_set()


@pytest.fixture(autouse=True)
def _impatient(monkeypatch) -> None:
    monkeypatch.setattr(watchdog, "TICK", 0.01)
    monkeypatch.setattr(watchdog, "STARTING_SECONDS", 0.05)
    monkeypatch.setattr(watchdog, "SHORTEST_SECONDS", 0.05)


def pool(kind: type[Silent], workers: int) -> WorkerPool:
    return WorkerPool(kind, workers)


def request(seed: int) -> Request:
    return Request(states(3, seed), 20, seed)


@pytest.mark.parametrize("workers", [1, 2])
def test_workers_that_only_hang_are_given_up(caplog, workers) -> None:
    silent = pool(Silent, workers)
    (job,) = silent.submit([request(0)])
    with pytest.raises(RuntimeError, match=r"renderer\.workers: .*no answer within"):
        job.result(timeout=60)
    silent.close()
    assert len(caplog.records) == workers + 1


def test_what_a_hanging_worker_had_is_rendered_by_others(caplog) -> None:
    class Tiring(Silent):
        answers = 2

    tiring = pool(Tiring, 1)
    requests = [request(seed) for seed in range(7)]
    jobs = tiring.submit(requests)
    for job, each in zip(jobs, requests, strict=True):
        alone = OddRenderer(gate=None).render_patches(each.states, resolution=20, seed=each.seed)
        assert_same(job.result(timeout=60), alone)
    tiring.close()
    assert len(caplog.records) == 3


def test_a_limit_scales_with_the_slowest_reply(monkeypatch) -> None:
    monkeypatch.undo()
    monkeypatch.setattr(watchdog, "TICK", 0.0)
    dog, worker = Watchdog(), Silent(0)
    assert dog.limit(0, lost=0) == dog.limit(8, lost=0) == STARTING_SECONDS
    for waited, expected in ((0.0, SHORTEST_SECONDS), (60.0, 1200.0), (10.0, 1200.0)):
        with dog.waiting(worker, patches=4, lost=0):
            dog._waits[0].waited = waited
        assert dog.limit(8, lost=0) == expected
    assert dog.limit(8, lost=2) == 4 * 1200
    assert dog.limit(0, lost=0) == STARTING_SECONDS
    assert dog.limit(0, lost=1) == 2 * STARTING_SECONDS


def test_a_program_that_was_stopped_itself_has_not_been_waiting(monkeypatch) -> None:
    """However long ago it asked: only what the thread itself has seen counts."""
    dog, worker = Watchdog(), Silent(0)
    looks = iter([False, False, True])
    monkeypatch.setattr(dog._ended, "wait", lambda _: next(looks))
    with dog.waiting(worker, patches=1, lost=0):
        dog.run()  # two looks, whatever the clock says
        assert dog._waits[0].waited == pytest.approx(0.02)
        assert not worker._killed.is_set()


def test_the_thread_ends_with_the_pool() -> None:
    before = set(threading.enumerate())
    silent = pool(Silent, 2)
    silent.warm_up()
    assert {thread.name for thread in set(threading.enumerate()) - before} >= {"renderer-watchdog"}
    silent.close()
    wait_for(lambda: set(threading.enumerate()) <= before)
