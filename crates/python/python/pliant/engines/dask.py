"""Dask's distributed scheduler."""

from __future__ import annotations

import importlib.util
from collections.abc import Generator, Iterable
from typing import Any

from pliant.engines import Task
from pliant.errors import ClusterError
from pliant.mesh import _extra

__all__ = ["Dask"]


class Dask:
    """Runs on workers of Dask: those of a client, of the current one, or of a local cluster that is started."""

    def __init__(self, client: Any, cores: int, gpus: float, retries: int) -> None:
        self._distributed = _extra("distributed", "dask")
        self._client, self._retries = client, retries
        self._resources = {"GPU": gpus} if gpus else None
        self._cores = cores
        self.ended: list[dict[str, Any]] = []

    def run(self, task: Task, bundle: Any, numbers: Iterable[int]) -> Generator[dict[str, Any]]:
        """Rows as runs end."""
        client, local_client = self._client, None
        if client is None:
            try:
                client = self._distributed.get_client()
            except ValueError:
                local_client = client = self._distributed.Client(processes=True, threads_per_worker=1, dashboard_address=None)
        lacking = [name for name, found in client.run(importlib.util.find_spec, "pliant").items() if found is None]
        if lacking:
            raise ClusterError(f"pliant is not installed on {', '.join(lacking)}; install the version of this process there", hosts=lacking)
        # The bundle is the result of a task, not scattered: a worker that has it and is lost does not take it
        # away.
        shared = client.submit(_same, bundle, pure=False)
        options = {"pure": False, "retries": self._retries, "resources": self._resources}
        left = iter(numbers)
        most = max(2, 2 * sum(client.nthreads().values()) // max(1, self._cores))
        pending: set[Any] = set()
        try:
            pending |= {client.submit(task, shared, number, **options) for _, number in zip(range(most), left, strict=False)}
            running = self._distributed.as_completed(pending)
            for future in running:
                row = future.result()
                pending.discard(future)
                number = next(left, None)
                if number is not None:
                    pending.add(another := client.submit(task, shared, number, **options))
                    running.add(another)
                yield row
        finally:
            self.ended = [future.result() for future in pending if future.status == "finished"]
            client.cancel([future for future in pending if not future.done()])
            if local_client is not None:
                local_client.close()


def _same(bundle: Any) -> Any:
    return bundle
