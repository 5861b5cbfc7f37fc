"""Where the runs of a sweep are done: threads of this process, Dask, Ray, or any executor.

An engine takes tasks, keeps at most two of them in flight for each of its cores, and gives back what they return as they end.
Tasks never raise: a run that fails is a row as any other, so engines repeat only what a lost worker had.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, Protocol

from pliant.errors import ClusterError

__all__ = ["Engine", "engine_of"]

Task = Callable[[Any, int], dict[str, Any]]
"""Does the run of a number, with a bundle that all runs share."""


class Engine(Protocol):
    """Runs tasks."""

    def run(self, task: Task, bundle: Any, numbers: Iterable[int]) -> Iterator[dict[str, Any]]:
        """Rows in the order in which runs end. Closing the iterator cancels what is queued."""
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
    raise ClusterError(f"there is no engine {on!r}; there are 'local', 'dask', 'ray', clients of Dask and executors")
