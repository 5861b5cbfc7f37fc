"""Executors of `concurrent.futures` and all that submit as they do; threads of this process without one."""

from __future__ import annotations

import os
from collections.abc import Generator, Iterable
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from typing import Any

from pliant.engines import Stop, Task

__all__ = ["Futures"]

_MOST = 64


class Futures:
    """Runs on an executor; without one on threads, as many as cores allow."""

    def __init__(self, executor: Executor | None, cores: int) -> None:
        self._executor = executor
        self._threads = max(1, len(os.sched_getaffinity(0)) // max(1, cores)) if hasattr(os, "sched_getaffinity") else 1
        self.ended: list[dict[str, Any]] = []

    def run(self, task: Task, bundle: Any, numbers: Iterable[int]) -> Generator[dict[str, Any]]:
        """Rows as runs end."""
        pool = ThreadPoolExecutor(self._threads, thread_name_prefix="pliant") if self._executor is None else None
        executor = pool or self._executor
        assert executor is not None
        stop = Stop()
        # Another process can't be stopped by a flag of this one.
        extra = () if pool is None else (stop,)
        most = 2 * self._threads if pool else _MOST
        left = iter(numbers)
        pending: set[Future[dict[str, Any]]] = set()
        try:
            while True:
                for number in left:
                    pending.add(executor.submit(task, bundle, number, *extra))
                    if len(pending) >= most:
                        break
                if not pending:
                    return
                done, _ = wait(pending, return_when=FIRST_COMPLETED)
                for future in done:
                    pending.discard(future)
                    yield future.result()
        finally:
            stop.ask()
            for future in pending:
                future.cancel()
            if pool is not None:
                pool.shutdown(wait=True, cancel_futures=True)
            ended = (future for future in pending if future.done() and not future.cancelled())
            self.ended = [future.result() for future in ended if future.exception() is None]
