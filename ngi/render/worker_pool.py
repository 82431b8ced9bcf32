"""Shares requests for patches out among renderers elsewhere, and replaces those that are lost."""

import logging
import threading
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any

from ngi.render.protocol import RenderedPatches
from ngi.render.watchdog import Watchdog
from ngi.render.worker_protocol import Reply, Request, Worker, WorkerDiedError

_logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Task:
    request: Request
    patches: Future[RenderedPatches] = field(default_factory=Future)


class WorkerPool:
    """A number of workers, started when they are first needed.

    start: starts worker number 0, 1, ...; called again for a number whose worker has died, or has
        not answered for so long that the watchdog ended it.
    workers: how many.

    One thread per worker sleeps until there is something to send or to receive, so that workers go
    on while the main thread trains. A worker that ends a request has the next one with it already.
    """

    def __init__(self, start: Callable[[int], Worker], workers: int) -> None:
        self._start = start
        self._waiting: deque[_Task] = deque()
        self._alive: dict[int, Worker] = {}
        self._idle = 0
        self._deaths = 0  # in a row: since the last reply
        self._end: Exception | None = None  # why nothing is rendered any more
        self._ready: list[Future[None]] = [Future() for _ in range(workers)]
        self._changed = threading.Condition()  # guards all of the above
        self._threads = [
            threading.Thread(target=self._serve, args=(i,), name=f"renderer-{i}", daemon=True)
            for i in range(workers)
        ]
        self._watchdog = Watchdog()
        self._threads.append(
            threading.Thread(target=self._watchdog.run, name="renderer-watchdog", daemon=True)
        )

    def submit(self, requests: Iterable[Request]) -> list[Future[RenderedPatches]]:
        """The patches of every request, when they are there; begun in this order."""
        self._begin()
        tasks = [_Task(request) for request in requests]
        with self._changed:
            self._waiting.extend(tasks)
            self._changed.notify_all()
            if self._end is not None:
                self._stop()
        return [task.patches for task in tasks]

    def warm_up(self) -> None:
        """Waits until every worker is ready; raises what keeps one from it."""
        self._begin()
        for ready in self._ready:
            ready.result()

    def close(self) -> None:
        """Ends all workers at once; what is not rendered yet raises RuntimeError."""
        self._stop(RuntimeError("the renderer is closed"))
        for thread in self._threads:
            if thread.is_alive() and thread is not threading.current_thread():
                thread.join()

    def _begin(self) -> None:
        with self._changed:
            if self._end is None and self._threads[0].ident is None:
                for thread in self._threads:
                    thread.start()

    def _stop(self, reason: Exception | None = None) -> None:
        """Everything that is waited for raises the reason why it ends, the first one given."""
        with self._changed:
            self._end = self._end or reason
            abandoned: list[Future[Any]] = [task.patches for task in self._waiting]
            abandoned += [ready for ready in self._ready if not ready.done()]
            self._waiting.clear()
            for future in abandoned:
                future.set_exception(self._end)
            for worker in self._alive.values():
                worker.kill()
            self._watchdog.end()
            self._changed.notify_all()

    def _serve(self, number: int) -> None:
        """The thread of one worker and of those that replace it."""
        reason = None
        try:
            while self._end is None:
                self._employ(number)
        except Exception as error:  # a worker that cannot start or make its renderer, or too many
            reason = error
        self._stop(reason)

    def _employ(self, number: int) -> None:
        """The life of one worker."""
        worker = self._start(number)
        sent: deque[_Task] = deque()
        with self._changed:
            self._alive[number] = worker
            if self._end is not None:
                worker.kill()
        try:
            self._converse(number, worker, sent)
        except WorkerDiedError as death:
            self._report(worker, death, sum(len(task.request.states) for task in sent))
        finally:
            with self._changed:
                self._waiting.extendleft(reversed(sent))
                self._changed.notify_all()
            worker.kill()
            worker.release()

    def _converse(self, number: int, worker: Worker, sent: deque[_Task]) -> None:
        """Requests and replies, until nothing is wanted any more; `sent` awaits its replies."""
        reply = self._receive(worker, patches=0)
        if isinstance(reply, Exception):
            raise reply
        with self._changed:
            if not self._ready[number].done():
                self._ready[number].set_result(None)
        while True:
            while len(sent) < 2 and (task := self._next(wait=not sent)) is not None:
                sent.append(task)
                worker.send(task.request)
            if not sent:
                return
            reply = self._receive(worker, patches=len(sent[0].request.states))
            with self._changed:
                self._deaths = 0
            patches = sent.popleft().patches
            if isinstance(reply, Exception):
                patches.set_exception(reply)
            else:
                assert reply is not None
                patches.set_result(reply)

    def _receive(self, worker: Worker, *, patches: int) -> Reply:
        with self._changed:
            lost = self._deaths
        with self._watchdog.waiting(worker, patches=patches, lost=lost):
            return worker.receive()

    def _next(self, *, wait: bool) -> _Task | None:
        """wait: for as long as it takes; otherwise only what no idle worker could begin now."""
        with self._changed:
            if wait:
                self._idle += 1
                self._changed.wait_for(lambda: self._waiting or self._end is not None)
                self._idle -= 1
            elif self._idle:
                return None
            return self._waiting.popleft() if self._waiting else None

    def _report(self, worker: Worker, death: WorkerDiedError, patches: int) -> None:
        """Raises RuntimeError for one death too many: all may die at once, but not go on so."""
        with self._changed:
            if self._end is not None:
                return
            self._deaths += 1
        if self._deaths > len(self._ready) + 1:
            raise RuntimeError(
                f"renderer.workers: {self._deaths} workers died one after the other without "
                f"rendering anything (the last one: {death}); look for 'Out of memory' in "
                "`dmesg` and lower renderer.workers, or see the error with renderer.workers=0"
            )
        _logger.warning(
            "%s died (%s); it is replaced, and %d patches are rendered again",
            worker.name,
            death,
            patches,
        )
