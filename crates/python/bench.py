"""What calls of the package cost: `python crates/python/bench.py`. Medians, with the machine named."""

from __future__ import annotations

import gc
import os
import platform
import signal
import statistics
import threading
import time
from collections.abc import Callable

import numpy as np

import pliant


def median(work: Callable[[], object], repeats: int = 200) -> float:
    """Median time of a call [s]."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def block(cells: int, precision: str = "double") -> pliant.Scene:
    """A block of soft tissue."""
    scene = pliant.Scene(until=10.0, gravity=(0, 0, -9.81))
    scene.law["tissue"] = {"type": "neo-hookean", "young-modulus": 10e3, "poisson-ratio": 0.45}
    mesh = {"block": {"size": [0.1, 0.1, 0.1], "cells": [cells] * 3}}
    scene.body["block"] = {"mesh": mesh, "law": "tissue", "density": 1000.0, "damping": 5.0}
    scene.constraint["base"] = {"type": "fix", "body": "block", "nodes": {"set": "z-min"}}
    scene["run.precision"] = precision
    return scene


def main() -> None:
    """Prints a line for each number."""
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, numpy {np.__version__}, pliant {pliant.__version__}")
    small = block(1).build()
    for threads in (1, 2):
        sim = small.simulate(threads=threads)
        one = median(sim.step, 2000)
        many = median(lambda sim=sim: sim.step(1000), 50) / 1000
        print(f"step() beyond its step, {threads} threads: {1e6 * (one - many):.1f} µs")
    # The block of crates/c/tests/times.rs, whose step in Rust that test prints.
    known = pliant.Scene(until=1e6, gravity=(0, 0, -9.81), run={"threads": 1, "step": 1e-4, "on-unstable": "report"})
    known.law["tissue"] = {"type": "neo-hookean", "young-modulus": 3e3, "poisson-ratio": 0.45}
    mesh = {"block": {"size": [0.1, 0.1, 0.1], "cells": [2, 2, 2]}, "as": "hexes"}
    known.body["block"] = {"mesh": mesh, "law": "tissue", "density": 1000.0, "damping": 50.0}
    known.constraint["base"] = {"type": "fix", "body": "block", "nodes": {"set": "z-min"}}
    sim = known.build().simulate()
    print(f"a step of 8 hexes by step(1000): {1e3 * median(lambda: sim.step(1000), 50):.2f} µs")
    cubes = [block(12).build().simulate() for _ in range(2)]
    alone = median(lambda: cubes[0].step(1000), 5)

    def both() -> None:
        other = threading.Thread(target=cubes[1].step, args=(1000,))
        other.start()
        cubes[0].step(1000)
        other.join()

    print(f"two simulations on two threads: {2 * alone / median(both, 5):.2f} × as fast as one after the other")
    sim = small.simulate()
    print(f"sim.displacement: {1e6 * median(lambda: sim.displacement, 20_000):.2f} µs, sim.time: {1e6 * median(lambda: sim.time, 20_000):.2f} µs")
    for precision in ("double", "single"):
        large = block(20, precision).build()
        sim = large.simulate()
        forces = np.zeros((len(large.rest), 3))
        print(f"{len(large.rest)} nodes, {precision}: push {1e6 * median(lambda sim=sim, forces=forces: sim.push(forces)):.0f} µs", end=", ")
        sim.push(None)
        sim.step()
        state = sim.state()
        out = np.empty((len(large.rest), 3))
        print(f"state {1e3 * median(sim.state):.2f} ms, restore {1e3 * median(lambda sim=sim, state=state: sim.restore(state)):.2f} ms", end=", ")
        print(f"positions {1e6 * median(lambda sim=sim, out=out: sim.positions(out)):.0f} µs")
        single = median(lambda sim=sim: sim.step(1), 200)
        print(f"  a step {1e6 * single:.0f} µs by single calls, {1e6 * median(lambda sim=sim: sim.step(200), 5) / 200:.0f} µs in one of 200")
    busy = block(20).build().simulate()
    took = []
    for _ in range(5):
        timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        try:
            begin = time.perf_counter()
            busy.step(10**9)
        except KeyboardInterrupt:
            took.append(time.perf_counter() - begin - 0.3)
        timer.join()
    print(f"Ctrl-C: {1e3 * statistics.median(took):.0f} ms, at most {1e3 * max(took):.0f} ms")
    small.simulate()
    gc.collect()
    before, begin = pages(), time.perf_counter()
    for _ in range(1000):
        small.simulate()
    gc.collect()
    print(f"1,000 simulations made and dropped: {(pages() - before) / 1e6:+.1f} MB, {time.perf_counter() - begin:.2f} s")


def pages() -> int:
    """Resident memory [B]."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")


if __name__ == "__main__":
    main()
