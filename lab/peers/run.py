"""Pliant beside other programs on the same cube: `python lab/peers/run.py`. Two to three minutes.

Every row is a process of its own. Their timed repeats take turns, so that all meet the same machine.
"""

from __future__ import annotations

import argparse
import datetime
import importlib.metadata
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np

import pliant
from cube import LONG_STEP, SQUEEZE, Array, Cube

HERE = Path(__file__).parent
START, END = "<!-- peers: start -->", "<!-- peers: end -->"
CORES = os.cpu_count() or 1
SECONDS = 0.25
"""What a repeat of an explicit row takes, about [s]."""
IMPLICIT_STEPS = 20
"""Steps of a repeat of an implicit row."""
EARLY = 4
"""Steps after which the places of implicit rows are compared."""


@dataclass
class Row:
    """A row of a table and the process behind it."""

    script: str
    key: str
    program: str
    way: str
    law: str
    numbers: str
    threads: int = 1
    stvk: bool = False
    """Whether Pliant is compared by that law."""
    worker: subprocess.Popen[str] | None = None
    printed: IO[str] = field(init=False)
    """What the process prints."""
    found: dict[str, Any] = field(default_factory=dict)
    steps: int = IMPLICIT_STEPS
    times: list[float] = field(default_factory=list)
    """Time of a step [s] in each repeat: CPU time where the row has one thread, else wall time."""

    def open(self, cells: int, folder: str) -> None:
        """Starts the process, with a folder for what it leaves."""
        command = [sys.executable, str(HERE / self.script), self.key, str(cells)]
        self.printed = tempfile.TemporaryFile("w+")  # noqa: SIM115
        self.worker = subprocess.Popen(command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.printed, text=True)

    def ask(self, **question: Any) -> dict[str, Any]:
        """The answer of the process."""
        assert self.worker and self.worker.stdin and self.worker.stdout
        try:
            print(json.dumps(question), file=self.worker.stdin, flush=True)
            answer: dict[str, Any] = json.loads(self.worker.stdout.readline())
        except (BrokenPipeError, json.JSONDecodeError) as error:
            self.close()
            self.printed.seek(0)
            raise SystemExit(f"{self.script} {self.key} failed:\n{self.printed.read()}") from error
        return answer

    def close(self) -> None:
        """Ends the process."""
        if self.worker:
            self.worker.communicate()
            self.worker = None

    def timed(self, steps: int) -> float:
        """Time of a step [s]."""
        taken = self.ask(steps=steps)
        return float(taken["cores" if self.threads == 1 else "wall"]) / steps


def explicit_rows() -> list[Row]:
    """Central differences or the like, all with the same step; the first one is what the others are compared with."""
    split = "split neo-Hookean"
    return [
        Row("with_pliant.py", "single", "Pliant", "explicit", split, "single"),
        Row("with_pliant.py", "single-all", "Pliant", "explicit", split, "single", threads=CORES),
        Row("with_pliant.py", "double", "Pliant", "explicit", split, "double"),
        Row("with_warp.py", "kernels", "Warp", "two kernels of ours", split, "single"),
        Row("with_newton.py", "semi-implicit", "Newton", "`SolverSemiImplicit`", "stable neo-Hookean", "single"),
        Row("with_mujoco.py", "euler", "MuJoCo", "flex, `Euler`", "St Venant–Kirchhoff", "double", stvk=True),
    ]


def implicit_rows() -> list[Row]:
    """Backward Euler or the like, in long steps."""
    split = "split neo-Hookean"
    return [
        Row("with_pliant.py", "implicit", "Pliant", "`implicit`", split, "double"),
        Row("with_pliant.py", "implicit-1", "Pliant", "`implicit`, one iteration", split, "double"),
        Row("with_newton.py", "vbd", "Newton", "`SolverVBD`, 10 iterations", "stable neo-Hookean", "single"),
        Row("with_newton.py", "vbd-40", "Newton", "`SolverVBD`, 40 iterations", "stable neo-Hookean", "single"),
        Row("with_mujoco.py", "discrete", "MuJoCo", "flex, `discrete`", "St Venant–Kirchhoff", "double", stvk=True),
    ]


def measure(rows: Sequence[Row], cells: int, repeats: int, *, explicit: bool) -> None:
    """Fills rows: first where the cube comes to rest, then repeats in turn."""
    with tempfile.TemporaryDirectory() as folder:
        file = f"{folder}/places.npy"
        rests = [reference(key, cells, folder) for key in ("static", "static-stvk")]
        early = [] if explicit else [reference(key, cells, folder, EARLY) for key in ("implicit", "implicit-stvk")]
        for row in rows:
            say(f"{cells}³: {row.program}, {row.way}, comes to rest")
            row.open(cells, folder)
            row.found = row.ask(places=file)
            row.found["wanted"], places = rests[row.stvk]
            row.found["at rest"] = farthest(np.load(file), places)
            if early:
                row.ask(places=file, after=EARLY)
                row.found["early"] = farthest(np.load(file), early[row.stvk][1])
        for row in rows:
            if explicit:
                row.steps = max(2, 2 * round(SECONDS / row.timed(20) / 2))
        for repeat in range(repeats):
            say(f"{cells}³: repeat {repeat + 1} of {repeats}")
            for row in rows:
                row.times.append(row.timed(row.steps))
        for row in rows:
            row.close()


def reference(key: str, cells: int, folder: str, after: int | None = None) -> tuple[float, Array]:
    """Force and places of Pliant, at rest or after some steps."""
    say(f"{cells}³: {key}")
    row, file = Row("with_pliant.py", key, "Pliant", key, "", "double"), f"{folder}/{key}.npy"
    row.open(cells, folder)
    force = float(row.ask(places=file, after=after)["force"])
    row.close()
    return force, np.load(file)


def farthest(places: Array, wanted: Array) -> float:
    """The largest distance of a node from where it is wanted, as a part of the squeeze."""
    return float(np.linalg.norm(places - wanted, axis=1).max() / abs(SQUEEZE[0]))


def say(what: str) -> None:
    """Tells how far it is."""
    print(what, file=sys.stderr, flush=True)


def at_rest(row: Row) -> str:
    """Two cells: force at rest with its deviation, and the farthest node."""
    force, wanted = row.found["force"], row.found["wanted"]
    off = 0.0 if force is None else 100 * (force / wanted - 1)
    sign = "" if abs(off) < 0.005 else "+" if off > 0 else "−"
    force_text = "–" if force is None else f"{abs(force):.4f} ({sign}{abs(off):.2f} %)"
    return f"{force_text} | {100 * row.found['at rest']:.2f} %"


def explicit_table(cells: int, rows: Sequence[Row]) -> list[str]:
    """A table of rows with the same step."""
    cube = Cube(cells)
    tets = len(cube.tets)
    lines = [
        f"{tets:,} tets, {len(cube.points):,} nodes, steps of {1e3 * cube.step:.3f} ms:",
        "",
        "| program | solver | law | precision | threads | ns | least–most | × Pliant | a second takes | force at rest N | farthest node |",
        "|:--|:--|:--|:--|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for row in rows:
        each = [1e9 * time / tets for time in row.times]
        ratio = statistics.median(time / first for time, first in zip(row.times, rows[0].times, strict=True))
        lines.append(
            f"| {row.program} | {row.way} | {row.law} | {row.numbers} | {row.threads} | {statistics.median(each):.2f} | {min(each):.2f}–{max(each):.2f} "
            f"| {ratio:.2f} | {statistics.median(row.times) / cube.step:.3f} s | {at_rest(row)} |"
        )
    return lines


def implicit_table(cells: int, rows: Sequence[Row]) -> list[str]:
    """A table of rows with long steps."""
    lines = [
        f"Implicit solvers, {6 * cells**3:,} tets, steps of {1e3 * LONG_STEP:.0f} ms, the first {IMPLICIT_STEPS} after the start:",
        "",
        f"| program | solver | law | precision | threads | a step ms | least–most | a second takes | force at rest N | farthest node | after {EARLY} steps |",
        "|:--|:--|:--|:--|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for row in rows:
        each = [1e3 * time for time in row.times]
        lines.append(
            f"| {row.program} | {row.way} | {row.law} | {row.numbers} | {row.threads} | {statistics.median(each):.2f} | {min(each):.2f}–{max(each):.2f} "
            f"| {statistics.median(row.times) / LONG_STEP:.2f} s | {at_rest(row)} | {100 * row.found['early']:.2f} % |"
        )
    return lines


def machine() -> str:
    """The machine, the versions and the day."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        name = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        name = platform.machine()
    versions = {"Warp": "warp-lang", "Newton": "newton", "MuJoCo": "mujoco", "NumPy": "numpy"}
    packages = ", ".join(f"{program} {importlib.metadata.version(package)}" for program, package in versions.items())
    return f"{name}, {CORES} cores, Python {platform.python_version()}; pliant {pliant.__version__}, {packages}; {datetime.date.today()}."


def main() -> None:
    """Measures, and prints the tables or writes them between the marks of a file."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--repeats", type=int, default=7, help="timed repeats of each row (default: 7)")
    options.add_argument("--table", type=Path, metavar="FILE", help=f"writes the tables between {START} and {END} of a file")
    asked = options.parse_args()
    page = asked.table.read_text() if asked.table else f"{START}{END}"
    if page.count(START) != 1 or page.count(END) != 1:
        options.error(f"{asked.table} needs the marks {START} and {END}, once each")
    before = os.getloadavg()[0]
    parts = [[machine()]]
    for cells in (10, 21):
        rows = explicit_rows()
        measure(rows, cells, asked.repeats, explicit=True)
        parts.append(explicit_table(cells, rows))
    rows = implicit_rows()
    measure(rows, 10, asked.repeats, explicit=False)
    parts.append(implicit_table(10, rows))
    load = max(before, os.getloadavg()[0] - 1)
    if load > 0.5:
        parts[0].append(f"Other programs were running (load {load:.1f}): rows of more threads are too slow, and the others are uncertain.")
    text = "\n\n".join("\n".join(part) for part in parts)
    if asked.table:
        asked.table.write_text(f"{page.split(START)[0]}{START}\n\n{text}\n\n{END}{page.split(END)[1]}")
    else:
        print(text)


if __name__ == "__main__":
    main()
