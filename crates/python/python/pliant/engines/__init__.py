"""Engines for the runs of a sweep: threads of this process, Dask, Ray, or any executor.

An engine takes tasks, keeps at most two of them in flight for each of its cores, and gives back what they return as they end.
Tasks never raise: a run that fails is a row as any other, so engines repeat only what a lost worker had.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Iterable
from typing import TYPE_CHECKING, Any, Protocol

from pliant.errors import ClusterError

if TYPE_CHECKING:
    from pliant.simulation import Simulation

__all__ = ["Engine", "Stop", "Stopped", "engine_of"]

Task = Callable[..., dict[str, Any]]
"""Does the run of a number, with a bundle that all runs share; the third argument, a `Stop`, is optional."""


class Stopped(Exception):
    """A run that was stopped before its end."""


class Stop:
    """Ends runs on threads of this process."""

    def __init__(self) -> None:
        self._asked, self._lock = threading.Event(), threading.Lock()
        self._running: set[Simulation] = set()

    def ask(self) -> None:
        """Ends all runs under way after their steps."""
        self._asked.set()
        with self._lock:
            for simulation in self._running:
                simulation._own.interrupt()

    def check(self, *_: object) -> None:
        """Raises `Stopped` if somebody has asked."""
        if self._asked.is_set():
            raise Stopped

    def watch(self, simulation: Simulation) -> None:
        """Adds a simulation that is to be interrupted."""
        with self._lock:
            self._running.add(simulation)

    def forget(self, simulation: Simulation) -> None:
        """Removes a simulation that has ended."""
        with self._lock:
            self._running.discard(simulation)


class Engine(Protocol):
    """Runs tasks."""

    ended: list[dict[str, Any]]
    """Rows of runs that had ended when the iterator was closed, and were not given back."""

    def run(self, task: Task, bundle: Any, numbers: Iterable[int]) -> Generator[dict[str, Any]]:
        """Rows in the order in which runs end. Closing the iterator cancels what is queued, and stops what runs on threads of this process."""
        ...


def engine_of(on: Any, cores: int, gpus: float, retries: int) -> Engine:
    """The engine of a name, a client of Dask, or an executor."""
    module = type(on).__module__.partition(".")[0]
    if on == "local" or (module not in ("distributed", "builtins") and hasattr(on, "submit")):
        from pliant.engines.executor import Futures

        return Futures(None if on == "local" else on, cores)
    if on == "dask" or module == "distributed":
        from pliant.engines.dask import Dask

        return Dask(None if on == "dask" else on, cores, gpus, retries)
    if on == "ray":
        from pliant.engines.ray import Ray

        return Ray(cores, gpus, retries)
    raise ClusterError(f"there is no engine {on!r}; take 'local', 'dask', 'ray', a client of Dask or an executor")
