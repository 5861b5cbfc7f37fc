"""The task that all programs get: a cube of tets, held at one face and squeezed and sheared by 2 % at the other.

A program answers two questions. What does a step cost? Where do the nodes come to rest?
"""

from __future__ import annotations

import itertools
import json
import math
import os
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EDGE = 0.1
"""Edge of the cube [m]."""
YOUNG, POISSON, DENSITY = 3e3, 0.45, 1e3
"""Young's modulus [Pa], Poisson's ratio, density [kg/m³]."""
SHEAR = YOUNG / (2 * (1 + POISSON))
"""Shear modulus μ [Pa]."""
LAME = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
"""Lamé's first parameter λ [Pa]."""
BULK = YOUNG / (3 * (1 - 2 * POISSON))
"""Bulk modulus κ [Pa]."""
SQUEEZE = np.array([-0.02, 0.01, 0.005]) * EDGE
"""Displacement of the moved face [m], the one of `pliant-lab bench`."""
LONG_STEP = 0.01
"""Time step of implicit solvers [s]."""


RATE, DURATION = 50.0, 0.8
"""How fast velocities fall on the way to rest [1/s], near critical for the slowest mode, and for how long [s]."""


class Cube:
    """The mesh: n³ grid cells of six tets each."""

    def __init__(self, n: int) -> None:
        self.n = n
        self.points: Array = EDGE / n * np.array(list(itertools.product(range(n + 1), repeat=3)), dtype=np.float64)
        """Places at rest [m], (nodes, 3)."""
        corner = np.array([(i * (n + 1) + j) * (n + 1) + k for i, j, k in itertools.product(range(n), repeat=3)])
        along = np.array([(n + 1) ** 2, n + 1, 1])
        tets = []
        for order in itertools.permutations(range(3)):
            tet = corner[:, None] + np.cumsum([0, *along[list(order)]])
            even = np.linalg.det(np.eye(3)[list(order)]) > 0
            tets.append(tet if even else tet[:, [0, 2, 1, 3]])
        self.tets: NDArray[np.int32] = np.stack(tets, axis=1).reshape(-1, 4).astype(np.int32)
        """Nodes of the tets, those of a grid cell side by side, (tets, 4)."""
        edges = np.swapaxes(self.points[self.tets[:, 1:]] - self.points[self.tets[:, :1]], 1, 2)
        self.volumes: Array = np.linalg.det(edges) / 6
        """Volumes of the tets [m³]."""
        self.poses: Array = np.linalg.inv(edges)
        """The inverse of the three edges of each tet as columns [1/m], (tets, 3, 3)."""
        self.masses: Array = np.bincount(self.tets.ravel(), np.repeat(DENSITY / 4 * self.volumes, 4))
        """Lumped masses of the nodes [kg]."""
        self.held: NDArray[np.bool_] = self.points[:, 0] < 1e-9
        self.moved: NDArray[np.bool_] = self.points[:, 0] > EDGE - 1e-9
        self.free: NDArray[np.bool_] = ~(self.held | self.moved)
        self.start: Array = self.points + self.points[:, :1] / EDGE * SQUEEZE
        """Places at the start [m]: every tet is deformed alike."""

    @property
    def step(self) -> float:
        """Time step of explicit solvers [s], about half of the critical one."""
        return 0.01 / self.n


class Peer(Protocol):
    """A program with the cube in it."""

    def start(self) -> None:
        """Puts all nodes to their places at the start, without speed."""

    def step(self, count: int) -> None:
        """Goes so many steps on, an even number."""

    def settle(self) -> None:
        """Goes on until the cube is at rest."""

    def places(self) -> Array:
        """Where all nodes are [m]."""

    def force(self) -> float | None:
        """Force along x by which the moved face is held [N], where the program tells it."""


class Slowed(Peer, Protocol):
    """A program whose velocities can be set."""

    dt: float
    """Its time step [s]."""

    def slow(self, factor: float) -> None:
        """Multiplies all velocities."""

    def settle(self) -> None:
        """Lets velocities fall at `RATE`. Two steps at a time are less than half a period of the fastest mode at half of the critical time
        step: with four, some modes meet the damping at the same phase each time, and grow.
        """
        self.start()
        for _ in range(round(DURATION / (2 * self.dt))):
            self.step(2)
            self.slow(math.exp(-2 * RATE * self.dt))


def serve(rows: Mapping[str, Callable[[Cube], Peer]]) -> None:
    """Answers `run.py`: one JSON object for each line of its standard input. What a program prints goes to standard error."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    row, cells = sys.argv[1:]
    cube = Cube(int(cells))
    peer = rows[row](cube)
    for line in sys.stdin:
        ask: dict[str, Any] = json.loads(line)
        answer = shown(peer, ask["places"], ask.get("after")) if "places" in ask else clocked(peer, ask["steps"])
        print(json.dumps(answer), file=answers, flush=True)


def shown(peer: Peer, file: str, after: int | None) -> dict[str, Any]:
    """Where all nodes are after some steps, or at rest, as a file; the force."""
    if after is None:
        peer.settle()
    else:
        peer.start()
        peer.step(after)
    places = peer.places()
    if not np.isfinite(places).all():
        raise ArithmeticError("the cube is not finite")
    np.save(file, places)
    return {"force": peer.force()}


def clocked(peer: Peer, steps: int) -> dict[str, Any]:
    """What steps from the start take: wall time and time of the process on all cores [s]."""
    peer.start()
    peer.step(2)
    wall, cores = time.perf_counter(), time.process_time()
    peer.step(steps)
    return {"wall": time.perf_counter() - wall, "cores": time.process_time() - cores}
