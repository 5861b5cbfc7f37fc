"""What engines of sweeps cost: `python crates/python/bench_engines.py`. Start, cost of a run beyond its own time, and memory."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pliant

RUNS = 200


def scene() -> pliant.Scene:
    """A run of a few steps."""
    scene = pliant.Scene(until=0.01, gravity=(0, 0, -9.81))
    scene.law["tissue"] = {"type": "neo-hookean", "young-modulus": 10e3, "poisson-ratio": 0.3}
    scene.body["cube"] = {"mesh": {"block": {"size": [0.1, 0.1, 0.1], "cells": [1, 1, 1]}}, "law": "tissue", "density": 1000.0}
    scene.constraint["base"] = {"type": "fix", "body": "cube", "nodes": {"set": "z-min"}}
    return scene


def family() -> int:
    """Resident memory [B] of all processes but this one whose parents are ours."""
    total = 0
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{pid}/cmdline", "rb") as file:
                words = file.read()
            if int(pid) != os.getpid() and (b"ray" in words or b"multiprocessing" in words or b"distributed" in words):
                with open(f"/proc/{pid}/statm") as file:
                    total += int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")
        except OSError:
            continue
    return total


def measured(name: str, start: Callable[[], tuple[Any, Callable[[], object]]], alone: float) -> None:
    """Prints the row of an engine."""
    begin = time.perf_counter()
    on, stop = start()
    started = time.perf_counter() - begin
    values = {"law.tissue.young-modulus": [5e3 + k for k in range(RUNS)]}
    begin = time.perf_counter()
    first = pliant.sweep(scene(), {"law.tissue.young-modulus": [5e3]}, on=on, progress=False)
    warm = time.perf_counter() - begin
    begin = time.perf_counter()
    table = pliant.sweep(scene(), values, on=on, progress=False)
    each = (time.perf_counter() - begin) / RUNS
    memory = family() / 1e6
    stop()
    assert len(first) == 1 and not table.failures
    print(f"{name}: start {started:.1f} s, first run {warm:.1f} s, a run {1e3 * each:.1f} ms ({1e3 * alone:.1f} alone), other processes {memory:.0f} MB")


def main() -> None:
    """Prints a row for each engine that is installed."""
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, pliant {pliant.__version__}")
    model_times = []
    for _ in range(20):
        begin = time.perf_counter()
        scene().run(threads=1)
        model_times.append(time.perf_counter() - begin)
    alone = sorted(model_times)[10]
    measured("local", lambda: ("local", lambda: None), alone)

    def executor() -> tuple[Any, Callable[[], object]]:
        pool = ThreadPoolExecutor(2)
        return pool, pool.shutdown

    measured("executor", executor, alone)

    def dask() -> tuple[Any, Callable[[], object]]:
        import distributed

        cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
        client = distributed.Client(cluster)
        return client, lambda: (client.close(), cluster.close())

    measured("dask", dask, alone)

    def ray() -> tuple[Any, Callable[[], object]]:
        import ray

        ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
        return "ray", ray.shutdown

    measured("ray", ray, alone)


if __name__ == "__main__":
    main()
