"""Executors of `concurrent.futures` and all that submit as they do; threads of this process without one."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, ThreadPoolExecutor, wait
from typing import Any

from pliant.engines import Task

__all__ = ["Futures"]

_MOST = 64


class Futures:
    """Runs on an executor; without one on threads, as many as cores allow."""

    def __init__(self, executor: Executor | None, cores: int) -> None:
        self._executor = executor
        self._threads = max(1, len(os.sched_getaffinity(0)) // max(1, cores)) if hasattr(os, "sched_getaffinity") else 1

    def run(self, task: Task, bundle: Any, numbers: Iterable[int]) -> Iterator[dict[str, Any]]:
        """Rows as runs end."""
        own = ThreadPoolExecutor(self._threads, thread_name_prefix="pliant") if self._executor is None else None
        executor = own or self._executor
        assert executor is not None
        most = 2 * self._threads if own else _MOST
        left, pending = iter(numbers), set()
        try:
            while True:
                for number in left:
                    pending.add(executor.submit(task, bundle, number))
                    if len(pending) >= most:
                        break
                if not pending:
                    return
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        finally:
            for future in pending:
                future.cancel()
            if own is not None:
                own.shutdown(wait=True, cancel_futures=True)
