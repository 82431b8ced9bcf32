"""How work is shared out among workers and what happens when they fail, without any process."""

import gc
import pickle
import threading
import time
from collections import deque
from functools import partial
from pathlib import Path

import pytest
import torch

from ngi.machine.backend import dr
from ngi.render import AnalyticRenderer, workers
from ngi.render.worker_protocol import RenderServer, WorkerDiedError
from ngi.render.workers import WorkerRenderer, chunk_sizes
from tests.render.odd_renderer import OddRenderer, assert_same, render, states
from tests.waiting import wait_for

make = partial(OddRenderer, gate=Path("nowhere"))


class FakeWorker:
    """A worker without a process: renders when its reply is waited for."""

    started: list["FakeWorker"]

    def __init__(self, number, *, make, **_) -> None:
        self.name = f"fake {number}"
        self.killed = False
        self._server = RenderServer(make, threads=1)
        self._replies = deque([self._server.start])
        self.started.append(self)

    def send(self, request) -> None:
        copy = pickle.loads(pickle.dumps(request))
        self._replies.append(lambda: self._server.render(copy))

    def receive(self):
        while not self._replies and not self.killed:
            time.sleep(0.01)
        if self.killed:
            raise WorkerDiedError("kill()")
        return pickle.loads(pickle.dumps(self._replies.popleft()()))

    def kill(self) -> None:
        self.killed = True

    def release(self) -> None:
        assert self.killed


@pytest.fixture(autouse=True)
def _threads():
    """As they were: a RenderServer counts on a process of its own."""
    before = torch.get_num_threads(), dr.thread_count()
    yield
    torch.set_num_threads(before[0])
    dr.set_thread_count(before[1])


@pytest.fixture
def fake(monkeypatch):
    """Has WorkerRenderer start workers of this class."""

    def use(kind=FakeWorker):
        kind.started = []
        monkeypatch.setattr(workers, "WorkerProcess", kind)
        return kind.started

    return use


@pytest.mark.parametrize("n", [0, 1, 2, 16, 33])
@pytest.mark.parametrize("count", [1, 2, 3, 40])
def test_any_number_of_workers_gives_the_same(fake, count, n) -> None:
    fake()
    with WorkerRenderer(make, workers=count) as renderer:
        assert_same(render(renderer, states(n)), render(make(), states(n)))


@pytest.mark.parametrize("patches", [0, 1, 5, 16, 257])
@pytest.mark.parametrize("count", [1, 2, 8])
def test_chunks_get_smaller(patches, count) -> None:
    sizes = list(chunk_sizes(patches, count))
    assert sum(sizes) == patches
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] <= max(1, patches / count / 2)
    assert sizes[-1] == min(1, patches)


@pytest.mark.parametrize(
    ("given", "resolution", "message"),
    [
        (states(2)[:, :4], 20, r"expected \[n, 5\]"),
        (states(2) + 1, 20, "expected 0 to 1"),
        (states(2), 7, "a patch of 8 pixels is larger"),
    ],
)
def test_bad_states_are_not_sent(fake, given, resolution, message) -> None:
    started = fake()
    renderer = WorkerRenderer(make, workers=2)
    with pytest.raises(ValueError, match=message):
        renderer.start_patches(given, resolution=resolution, seed=0)
    assert started == []


def test_an_exception_that_cannot_travel_says_the_same(fake) -> None:
    fake()
    with (
        WorkerRenderer(StrangeRenderer, workers=1) as renderer,
        pytest.raises(RuntimeError, match="StrangeError: strange 3"),
    ):
        render(renderer, states(1))


class StrangeError(Exception):
    def __init__(self, a: str, b: int) -> None:  # pickle would call it with one argument
        super().__init__(f"{a} {b}")


class StrangeRenderer(AnalyticRenderer):
    def __init__(self) -> None:
        super().__init__(dimensions=3, patch_size=8)

    def render_patches(self, *_, **__):
        raise StrangeError("strange", 3)


class NowhereElse(AnalyticRenderer):
    """Can be made once, in the parent, and not in a worker."""

    made = 0

    def __init__(self) -> None:
        super().__init__(dimensions=3, patch_size=8)
        NowhereElse.made += 1
        if NowhereElse.made > 1:
            raise FileNotFoundError("no such scene")


def test_a_worker_without_a_renderer_says_why(fake, monkeypatch) -> None:
    monkeypatch.setattr(NowhereElse, "made", 0)
    started = fake()
    with WorkerRenderer(NowhereElse, workers=2) as renderer:
        for _ in range(2):
            with pytest.raises(FileNotFoundError, match="no such scene"):
                renderer.warm_up()
            with pytest.raises(FileNotFoundError, match="no such scene"):
                render(renderer, states(4))
    assert all(worker.killed for worker in started)


class Mortal(FakeWorker):
    """Dies at every `lifetime`-th reply."""

    lifetime: int
    replies = 0

    def receive(self):
        type(self).replies += 1
        if type(self).replies % self.lifetime == 0:
            raise WorkerDiedError("old age")
        return super().receive()


class ColdRenderer(AnalyticRenderer):
    def __init__(self) -> None:
        super().__init__(dimensions=3, patch_size=8)

    def warm_up(self) -> None:
        raise OSError("cold")


def test_workers_warm_up(fake) -> None:
    fake()
    # Closed, so that no thread goes on into the next test: a start sets Dr.Jit's threads.
    with (
        WorkerRenderer(ColdRenderer, workers=2) as renderer,
        pytest.raises(OSError, match="cold"),
    ):
        renderer.warm_up()


def test_a_worker_keeps_to_its_threads() -> None:
    assert RenderServer(pickle.dumps(make), threads=3).start() is None
    assert (dr.thread_count(), torch.get_num_threads()) == (3, 1)


@pytest.mark.parametrize("count", [1, 2])
def test_workers_that_only_die_are_given_up(fake, monkeypatch, caplog, count) -> None:
    monkeypatch.setattr(Mortal, "lifetime", 1, raising=False)
    started = fake(Mortal)
    with WorkerRenderer(make, workers=count) as renderer:
        job = renderer.start_patches(states(8), resolution=20, seed=0)
        wait_for(job.done)
        with pytest.raises(RuntimeError, match=r"renderer\.workers: .*last one: old age"):
            job.result()
    deaths = count + 2
    assert deaths <= len(started) <= deaths + count
    assert len(caplog.records) == deaths - 1


def test_deaths_between_replies_are_survived(fake, monkeypatch, caplog) -> None:
    monkeypatch.setattr(Mortal, "lifetime", 3, raising=False)
    fake(Mortal)
    with WorkerRenderer(make, workers=1) as renderer:
        assert_same(render(renderer, states(40)), render(make(), states(40)))
    assert len(caplog.records) > 3


def test_a_forgotten_renderer_is_closed(fake) -> None:
    started, threads = fake(), set(threading.enumerate())
    renderer = WorkerRenderer(make, workers=2)
    renderer.warm_up()
    assert not any(worker.killed for worker in started)
    del renderer
    gc.collect()
    assert all(worker.killed for worker in started)
    assert set(threading.enumerate()) <= threads
