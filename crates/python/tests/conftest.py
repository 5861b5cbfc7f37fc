"""Scenes that tests share."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import pytest

import pliant

# A process in the background may have been started with Ctrl-C ignored, which Python then leaves so.
signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
os.chdir(ROOT)


def cube(cells: int = 2, **changes: object) -> pliant.Scene:
    """A cube of soft tissue that hangs on its base."""
    scene = pliant.Scene(until=0.2, gravity=(0, 0, -9.81))
    scene.law["tissue"] = {"type": "neo-hookean", "young-modulus": 10e3, "poisson-ratio": 0.3}
    mesh = {"block": {"size": [0.1, 0.1, 0.1], "cells": [cells] * 3}}
    scene.body["cube"] = {"mesh": mesh, "law": "tissue", "density": 1000.0, "damping": 5.0}
    scene.constraint["base"] = {"type": "fix", "body": "cube", "nodes": {"set": "z-min"}}
    return scene.replace(changes)


def crushed() -> pliant.Scene:
    """The cube, whose top is pushed through its base: its elements invert on the way."""
    scene = cube(**{"run.on-unstable": "report"})
    crush = {"type": "move", "body": "cube", "nodes": {"set": "z-max"}, "by": [0.0, 0.0, -0.2], "curve": "smooth-step", "to": 0.1}
    scene.constraint["crush"] = crush
    return scene


@pytest.fixture
def scene() -> pliant.Scene:
    """The cube."""
    return cube()


@pytest.fixture(params=["explicit single", "explicit double", "quasi-static", "implicit"])
def any_solver(request: pytest.FixtureRequest) -> pliant.Scene:
    """The cube by each solver."""
    solver, _, precision = request.param.partition(" ")
    scene = cube(**{"run.solver": solver})
    if precision:
        scene["run.precision"] = precision
    if solver == "implicit":
        scene["run.step"] = 0.01
    if solver == "quasi-static":
        scene["run.load-steps"] = 8
    return scene
