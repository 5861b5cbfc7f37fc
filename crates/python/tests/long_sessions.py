"""Long sessions: tools are dragged through contact for hours, side by side, as in a simulator. Run by hand:

    python crates/python/tests/long_sessions.py                        # a minute
    nice python crates/python/tests/long_sessions.py --seconds 3600    # an hour
    python crates/python/tests/long_sessions.py --hours 1              # an hour of simulated time in each session

Each session is a process with a small scene. A seeded random walk leads its tool from goal to goal, in and out of the tissue and sometimes through it, at up
to 0.5 m/s; half of the ways are led again before each look, as by a mouse. There is a look every 10 ms, each 1 to 24 steps. A step that ends in an error takes
the session back to the newest of six states that are kept, which is not gone back to again, or else to the start. A session fails if

* it can't go on even so, or its process ends or is silent for ten minutes,
* an error is none of a simulation (`pliant.SimulationError`), has no reason, or tells it in more than 2 kB,
* a force, an energy or a displacement is not finite, or
* its resident memory grows by more than 5 % after the first tenth of its time and 3,000 looks.

A table tells what each one did; the exit status is 1 if one failed. Simulated time counts all steps, those from which it went back, too.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import time
import warnings
from collections import Counter, deque
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import numpy as np

import pliant

LOOK = 0.01  # simulated time from look to look [s]; the step of implicit sessions
FASTEST, TURN, ANGLE = 0.5, 10.0, 0.5  # of the tool [m/s], [rad/s]; of turns and between jaws [rad]
KEPT, EVERY = 6, 0.05  # states to go back to, and simulated time between them [s]
MOST_FAILURES, LONGEST, HANGS = 50, 2048, 600.0  # in a row, back at the start; bytes of a message; without a word [s]
GROWTH, WARM = 1.05, 3000  # of memory, after so many looks
Body = tuple[dict[str, Any], list[str], dict[str, Any]]


class Kind(NamedTuple):
    """Bodies (mesh, where they are fixed, more keys), the tool, what touches what, and the lowest and highest place of the tool [m]."""

    bodies: dict[str, Body]
    tool: dict[str, Any]
    pairs: list[str]
    low: list[float]
    high: list[float]
    young: float = 2e4  # [Pa]


FINGER = {"shape": {"capsule": {"radius": 0.008, "length": 0.02}}, "at": [0.03, 0.03, 0.085]}
BALL = {"shape": {"sphere": {"radius": 0.01}}, "at": [0.04, 0.045, 0.04]}
JAWS = {"shape": {"jaws": {"length": 0.04, "width": 0.012, "thickness": 0.004}}, "at": [0.015, 0.003, 0.07], "turn": [np.pi, 0.0, 0.0]}
BLOCK: Body = {"block": {"size": [0.06, 0.06, 0.05]}, "edge": 0.02}, ["z-min"], {}
FOLD: Body = {"block": {"size": [0.03, 0.006, 0.02], "cells": [4, 1, 3]}, "as": "hexes"}, ["z-min"], {"element": "hex8-full"}
# Held at one end, it hangs over the block.
FLAP: Body = {"block": {"size": [0.07, 0.04, 0.01]}, "edge": 0.012, "at": [0.0, 0.01, 0.053]}, ["x-min"], {}
SHEET: Body = {"plate": {"size": [0.08, 0.08]}, "edge": 0.01}, ["x-min", "x-max", "y-min", "y-max"], {"model": "membrane", "thickness": 1e-3}
TUBE: Body = {"cylinder": {"radius": 0.02, "length": 0.08}, "edge": 0.01, "at": [0.04, 0.0, 0.0]}, ["z-min", "z-max"], {"model": "shell", "thickness": 2e-3}
KINDS = {
    "finger": Kind({"block": BLOCK}, FINGER, ["block tool"], [0.0, 0.0, 0.02], [0.06, 0.06, 0.085]),
    "jaws": Kind({"fold": FOLD}, {**JAWS, "opening": {"angle": ANGLE, "curve": "hold"}}, ["fold tool"], [0.0, -0.01, 0.035], [0.03, 0.016, 0.07]),
    "two bodies": Kind({"block": BLOCK, "flap": FLAP}, FINGER, ["flap tool", "flap block"], [0.02, 0.01, 0.03], [0.06, 0.05, 0.095]),
    "sheet": Kind({"sheet": SHEET}, BALL, ["sheet tool"], [0.015, 0.015, -0.05], [0.065, 0.065, 0.03], 1e5),
    "tube": Kind({"tube": TUBE}, BALL, ["tube tool", "tube tube"], [0.02, -0.01, 0.02], [0.06, 0.045, 0.06], 5e5),
}
# Walls that bend have implicit steps only.
SESSIONS = [f"{kind}, {how}" for kind in KINDS for how in ("explicit", "barrier") if (kind, how) != ("tube", "explicit")]


def scene(name: str) -> pliant.Scene:
    """The scene of a session."""
    kind, barrier = KINDS[name.partition(",")[0]], name.endswith("barrier")
    run = {"solver": "implicit", "step": LOOK} if barrier else {}
    scene = pliant.Scene(until=1e6, gravity=(0, 0, -9.81), run={"threads": 1, **run})
    scene.law["tissue"] = {"type": "neo-hookean", "young-modulus": kind.young, "poisson-ratio": 0.4}
    for body, (mesh, fixed, more) in kind.bodies.items():
        scene.body[body] = {"mesh": mesh, "law": "tissue", "density": 1000.0, "damping": 20.0, **more}
        scene.constraint[body] = {"type": "fix", "body": body, "nodes": {"union": [{"set": part} for part in fixed]}}
    scene.tool["tool"] = kind.tool
    for pair in kind.pairs:
        scene.contact[pair.replace(" ", "-")] = {"between": pair.split(), "friction": 0.3, **({"barrier-distance": 5e-4} if barrier else {})}
    return scene


@dataclass
class Row:
    """What a session has done."""

    name: str
    steps: int = 0
    simulated: float = 0.0  # [s]
    looks: int = 0
    touching: int = 0  # looks at which something touches the tool
    longest: float = 0.0  # processor time of a look [s]
    heard: Counter[str] = field(default_factory=Counter)  # errors and warnings
    message: str = ""  # the longest one
    memory: list[float] = field(default_factory=list)  # first, last, most [MB]
    faults: list[str] = field(default_factory=list)

    def sample(self) -> None:
        """Looks at the resident memory."""
        with open("/proc/self/statm") as file:
            now = int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6
        self.memory = [self.memory[0], now, max(self.memory[2], now)] if self.memory else [now, now, now]

    def hear(self, said: Warning | pliant.Error) -> None:
        """Counts an error or a warning and checks what it says."""
        text, kind = str(said), getattr(said, "kind", "")
        self.heard[f"{type(said).__name__} {kind}"] += 1
        if isinstance(said, pliant.Error) and not (isinstance(said, pliant.SimulationError) and kind and len(text) > 20):
            self.faults.append(f"error without a reason: {said!r:.500}")
        if len(text.encode()) > LONGEST:
            self.faults.append(f"message of {len(text.encode())} bytes: {text:.300} …")
        self.message = max(self.message, text, key=len)

    def verdict(self) -> list[str]:
        """Why it fails."""
        first, _, most = self.memory or (1.0, 1.0, 1.0)
        return self.faults + [f"memory grew from {first:.1f} to {most:.1f} MB"] * (most > GROWTH * first)

    def __str__(self) -> str:
        memory = "".join(f"{size:7.1f}" for size in self.memory) or "       not judged yet"
        heard = ", ".join(f"{count} {kind}" for kind, count in sorted(self.heard.items())) or "none"
        numbers = f"{self.steps:9}{self.simulated:9.1f}{self.touching / max(self.looks, 1):9.0%}{1e3 * self.longest:11.0f}"
        return f"{self.name:20}{numbers} {memory}  {'FAIL' if self.verdict() else 'PASS'}  {heard}"


class Session:
    """A simulation with its tool."""

    def __init__(self, name: str, seed: int) -> None:
        self.row, self.random = Row(name), np.random.default_rng([seed, SESSIONS.index(name)])
        self.kind = KINDS[name.partition(",")[0]]
        self.sim = scene(name).build().simulate()
        self.turn = self.sim.tool("tool").quaternion
        self.start, self.kept, self.stuck = self.sim.state(), deque[pliant.State](maxlen=KEPT), 0

    def way(self) -> None:
        """Leads the tool to a next goal."""
        sim, random = self.sim, self.random
        goal, turn = random.uniform(self.kind.low, self.kind.high), self.turn + 0.5 * ANGLE * random.uniform(-1, 1, 4)
        turn /= np.linalg.norm(turn)
        far = float(np.linalg.norm(goal - sim.tool("tool").place))
        end = sim.time + max(far / (FASTEST * random.uniform(0.05, 1.0)), 2.0 * ANGLE / TURN)
        again = random.random() < 0.5
        sim.drive("tool", (goal, turn), within=end - sim.time)
        if "opening" in self.kind.tool:
            sim.open("tool", random.uniform(0.0, ANGLE), within=random.uniform(0.05, 0.3))
        while sim.time < end - 0.5 * sim.step_size:
            if again:
                sim.drive("tool", (goal, turn), within=end - sim.time)
            self.look()
            if sim.time >= (self.kept[-1] if self.kept else self.start).time + EVERY:
                self.kept.append(sim.state())
                self.stuck = 0

    def look(self) -> None:
        """Some steps, and a look at what came of them."""
        sim, row, begin, before = self.sim, self.row, time.process_time(), self.sim.time
        asked = max(1, round(LOOK / sim.step_size))
        done = sim.step(asked)
        row.longest = max(row.longest, time.process_time() - begin)
        row.steps, row.simulated, row.looks = row.steps + done, row.simulated + sim.time - before, row.looks + 1
        if done != asked:
            raise RuntimeError(f"the session has ended: {sim.ended}")
        force = sim.tool("tool").force
        row.touching += bool(force.any())
        for seen in (force, *sim.contacts().values(), sim.energies, sim.displacement):
            if not np.all(np.isfinite(seen)):
                raise RuntimeError(f"a value at t = {sim.time} s is not finite")

    def back(self) -> None:
        """To the newest state or to the start."""
        self.stuck += not self.kept
        if self.stuck > MOST_FAILURES:
            raise RuntimeError(f"it can't go on: {MOST_FAILURES} failures from the start")
        self.sim.restore(self.kept.pop() if self.kept else self.start)


def work(name: str, seed: int, seconds: float, hours: float, pipe: Connection) -> None:
    """A session in its process; its row goes out every second."""
    begun = sent = time.monotonic()
    session = Session(name, seed)
    row = session.row
    warnings.simplefilter("always")
    warnings.showwarning = lambda said, *_, **__: row.hear(said if isinstance(said, Warning) else UserWarning(said))
    part = 0.0
    while part < 1.0 and not row.faults:
        try:
            try:
                session.way()
            except pliant.Error as error:
                row.hear(error)
                session.back()
        except Exception as error:
            row.faults.append(f"{error!r:.500}")
        part = max((time.monotonic() - begun) / seconds, row.simulated / (3600.0 * hours))
        if time.monotonic() > sent + 1.0 or part >= 1.0 or row.faults:
            sent = time.monotonic()
            if part > 0.1 and row.looks > WARM:
                row.sample()
            pipe.send(row)


def main() -> None:
    """Runs all sessions and prints their rows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, help="wall time; 60 if no hours are given")
    parser.add_argument("--hours", type=float, default=np.inf, help="simulated time of each session")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    seconds = args.seconds or (60.0 if args.hours == np.inf else np.inf)
    spawn = multiprocessing.get_context("spawn")
    rows, running, heard = {name: Row(name) for name in SESSIONS}, {}, dict.fromkeys(SESSIONS, time.monotonic())
    for name in rows:
        out, pipe = spawn.Pipe(duplex=False)
        running[name] = spawn.Process(target=work, args=(name, args.seed, seconds, args.hours, pipe)), out
        running[name][0].start()
        pipe.close()
    title = "session                 steps time [s] touching worst [ms]   first   last   most [MB]   errors, each gone back from"
    shown = begun = time.monotonic()
    while running:
        for name, (process, out) in list(running.items()):
            try:
                while out.poll(0.1):
                    rows[name], heard[name] = out.recv(), time.monotonic()
                if time.monotonic() > heard[name] + HANGS:
                    process.kill()
            except EOFError:
                process.join()
                del running[name]
                if process.exitcode:
                    rows[name].faults.append(f"its process ended with {process.exitcode}")
        if time.monotonic() > shown + 300.0 or not running:
            shown = time.monotonic()
            print(f"\nafter {shown - begun:.0f} s, seed {args.seed}", title, *rows.values(), sep="\n", flush=True)
    longest = max((row.message for row in rows.values()), key=len)
    print(f"\n{sum(row.simulated for row in rows.values()) / 3600.0:.2f} simulated hours in all; the longest message, {len(longest.encode())} bytes: {longest}")
    faults = [f"FAIL {row.name}: {fault}" for row in rows.values() for fault in row.verdict()]
    print(*faults, sep="\n")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
