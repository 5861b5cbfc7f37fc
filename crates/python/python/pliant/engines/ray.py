"""Ray."""

from __future__ import annotations

import contextlib
from collections.abc import Generator, Iterable
from typing import Any

from pliant.engines import Task
from pliant.mesh import _extra

__all__ = ["Ray"]


class Ray:
    """Runs on the instance of Ray that is there, or on a local one that is started."""

    def __init__(self, cores: int, gpus: float, retries: int) -> None:
        self._ray = _extra("ray", "ray")
        self._options = {"num_cpus": cores, "num_gpus": gpus, "max_retries": retries}
        self.ended: list[dict[str, Any]] = []

    def run(self, task: Task, bundle: Any, numbers: Iterable[int]) -> Generator[dict[str, Any]]:
        """Rows as runs end."""
        ray = self._ray
        started = not ray.is_initialized()
        if started:
            ray.init(include_dashboard=False, log_to_driver=False)
        shared, remote = ray.put(bundle), ray.remote(task).options(**self._options)
        cores = int(ray.cluster_resources().get("CPU", 1))
        most, left, running = max(2, 2 * cores // max(1, self._options["num_cpus"])), iter(numbers), []
        try:
            while True:
                for number in left:
                    running.append(remote.remote(shared, number))
                    if len(running) >= most:
                        break
                if not running:
                    return
                done, running = ray.wait(running, num_returns=1)
                for reference in done:
                    yield ray.get(reference)
        finally:
            done, running = ray.wait(running, num_returns=len(running), timeout=0) if running else ([], [])
            for reference in done:
                # What a lost worker had is run by the next call.
                with contextlib.suppress(ray.exceptions.RayError):
                    self.ended.append(ray.get(reference))
            for reference in running:
                ray.cancel(reference, force=True)
            if started:
                ray.shutdown()
