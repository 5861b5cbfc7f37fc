"""Pliant's Python package: whole steps as a run takes them, with checks, energies and the watch over the critical time step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import pliant
from cube import DENSITY, DURATION, LONG_STEP, POISSON, RATE, SQUEEZE, YOUNG, Array, Cube, Peer, serve

PUSHED = 0.05
"""Until when an explicit simulation moves the face [s]; it is timed after that."""


def model_of(cube: Cube, run: dict[str, Any], law: str = "neo-hookean", damping: float = 0.0) -> pliant.Model:
    """The cube. Equilibria and implicit steps begin with all tets deformed alike; explicit ones move the face within `PUSHED`."""
    explicit = run["solver"] == "explicit"
    scene = pliant.Scene(until=1e4, run=run)
    displacement = cube.start - cube.points
    sets = {"held": np.flatnonzero(cube.held), "moved": np.flatnonzero(cube.moved)}
    mesh = pliant.Mesh(cube.points, {"tetra": cube.tets}, point_sets=sets, point_data={"start": displacement})
    scene.law["tissue"] = {"type": law, "young-modulus": YOUNG, "poisson-ratio": POISSON}
    body: dict[str, Any] = {"mesh": mesh, "law": "tissue", "density": DENSITY, "damping": damping}
    scene.body["cube"] = body if explicit else {**body, "initial-displacement": {"point-data": "start"}}
    scene.constraint["held"] = {"type": "fix", "body": "cube", "nodes": {"set": "held"}}
    move = {"type": "move", "body": "cube", "nodes": {"set": "moved"}, "by": SQUEEZE.tolist()}
    scene.constraint["moved"] = {**move, "curve": "smooth-step", "to": PUSHED} if explicit else {**move, "curve": "hold", "to": 1.0}
    return scene.build()


class Whole(Peer):
    """A simulation on some threads."""

    def __init__(self, cube: Cube, dt: float, run: dict[str, Any], threads: int = 1, law: str = "neo-hookean") -> None:
        self.cube, self.dt, self.run, self.threads, self.law = cube, dt, {**run, "step": dt}, threads, law
        self.model = model_of(cube, self.run, law)
        self.start()

    def start(self) -> None:
        self.simulation = self.model.simulate(threads=self.threads)
        if self.run["solver"] == "explicit":
            self.simulation.step(round(1.2 * PUSHED / self.dt))

    def settle(self) -> None:
        """Velocities cannot be set; an explicit body has damping of its own instead."""
        damped = model_of(self.cube, self.run, self.law, damping=RATE)
        self.simulation = damped.simulate(threads=self.threads)
        self.simulation.step(round(DURATION / self.dt))

    def step(self, count: int) -> None:
        self.simulation.step(count)

    def places(self) -> Array:
        return self.simulation.positions()

    def force(self) -> float:
        return float(self.simulation.reaction("moved")[0])


class Equilibrium(Whole):
    """Where the cube stays: the solver `static` in double precision."""

    def __init__(self, cube: Cube, law: str) -> None:
        self.simulation = model_of(cube, {"solver": "static", "load-steps": 1}, law).simulate()

    def settle(self) -> None:
        self.simulation.step(1)


def explicit(threads: int, **run: str) -> Callable[[Cube], Whole]:
    """Central differences at the step of all explicit rows."""
    return lambda cube: Whole(cube, cube.step, {"solver": "explicit", **run}, threads)


def implicit(law: str = "neo-hookean", **run: Any) -> Callable[[Cube], Whole]:
    """Backward Euler in long steps."""
    return lambda cube: Whole(cube, LONG_STEP, {"solver": "implicit", **run}, law=law)


if __name__ == "__main__":
    serve(
        {
            "static": lambda cube: Equilibrium(cube, "neo-hookean"),
            "static-stvk": lambda cube: Equilibrium(cube, "st-venant-kirchhoff"),
            "single": explicit(1, precision="single"),
            "single-all": explicit(0, precision="single"),
            "double": explicit(1, precision="double"),
            "implicit": implicit(),
            "implicit-stvk": implicit("st-venant-kirchhoff"),
            "implicit-1": implicit(iterations=1, **{"accept-unconverged": True}),
        }
    )
