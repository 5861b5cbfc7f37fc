"""Each error once, with its place."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable

import numpy as np
import pytest

import pliant
from conftest import cube


def test_a_scene_tells_all_its_mistakes_with_lines() -> None:
    text = cube().to_toml().replace("young-modulus", "young-modulos").replace("density = 1000.0", "density = -1.0")
    with pytest.raises(pliant.SceneError) as caught:
        pliant.Scene.from_toml(text, name="mine.toml").build()
    found = caught.value.diagnostics
    assert len(found) >= 2 and isinstance(caught.value, ValueError)
    assert any(diagnostic.key == "law.tissue.young-modulos" and diagnostic.line for diagnostic in found), found
    assert "young-modulos" in str(caught.value) and "mine.toml" in str(caught.value)
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value) and again.diagnostics == found


def test_a_value_that_is_set_is_underlined(tmp_path: object) -> None:
    path = f"{tmp_path}/scene.toml"
    cube().save(path)
    with pytest.raises(pliant.SceneError) as caught:
        pliant.load(path, set={"law.tissue.young-modulus": -3.0}).build()
    assert caught.value.diagnostics[0].key == "law.tissue.young-modulus"
    with pytest.raises(pliant.SceneError, match="did you mean"):
        pliant.load(path, set={"law.tisue.young-modulus": 3.0}).build()


@pytest.mark.parametrize("threads", [-1, 1025, 1 << 70])
def test_threads_that_no_machine_has(threads: int) -> None:
    model = cube().build()
    with pytest.raises(ValueError, match="`threads` is"):
        model.simulate(threads=threads)
    with pytest.raises(ValueError, match="`threads` is"):
        model.run(threads=threads)


def test_texts_that_are_none() -> None:
    with pytest.raises(pliant.SceneError):
        pliant.Scene.from_toml("[scene")
    with pytest.raises(ValueError, match="64"):
        pliant.Scene.from_toml("# " + "x" * (100 << 20))
    with pytest.raises(FileNotFoundError):
        pliant.load("nowhere")
    scene = cube()
    scene.body["cube"]["density"] = object()
    with pytest.raises(TypeError, match="density"):
        scene.build()
    with pytest.raises(KeyError):
        _ = cube()["law.tissue.colour"]
    with pytest.raises(KeyError):
        _ = cube()["law..tissue"]


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: pliant.Mesh([[0, 0]], {}), r"\(n, 3\)"),
        (lambda: pliant.Mesh(np.empty((0, 3)), {}), "needs points"),
        (lambda: pliant.Mesh([[0, 0, np.nan]], {}), "not finite"),
        (lambda: pliant.Mesh(np.zeros((4, 3)), {"tetra": [[0, 1, 2, 4]]}), "0 to 3"),
        (lambda: pliant.Mesh(np.zeros((4, 3)), {"tetra": [[0, 1, 2, -1]]}), "0 to 3"),
        (lambda: pliant.Mesh(np.zeros((4, 3)), {"tetra": [[0, 1, 2]]}), r"\(n, 4\)"),
        (lambda: pliant.Mesh(np.zeros((4, 3)), {"tetra10": [[0, 1, 2, 3]]}), "tetra10"),
        (lambda: pliant.Mesh(np.zeros((5, 3)), {"pyramid": [[0, 1, 2, 3]]}), r"\(n, 5\)"),
        (lambda: pliant.Mesh(np.zeros((4, 3), dtype=complex), {}), "complex"),
        (lambda: pliant.Mesh([["a", "b", "c"]], {}), "must be numbers"),
        (lambda: pliant.Mesh(np.zeros((4, 3)), {"tetra": [[0, 1, 2, 2.5]]}), "whole"),
        (lambda: pliant.Mesh(np.zeros((4, 3)), {}, point_data={"a": [1, 2]}), "point data"),
        (lambda: pliant.Image(np.zeros((2, 2)), np.eye(4)), r"\(i, j, k\)"),
        (lambda: pliant.Image(np.zeros((2, 2, 2)), np.eye(3)), r"\(4, 4\)"),
    ],
)
def test_arrays_that_do_not_fit(make: Callable[[], object], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        make()


def test_meshes_that_cannot_be_used(tmp_path: object) -> None:
    with pytest.raises(pliant.MeshError) as caught:
        pliant.Mesh.read(f"{tmp_path}/none.vtu")
    assert caught.value.path == f"{tmp_path}/none.vtu"
    flat = pliant.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], {"tetra": [[0, 1, 2, 3]]}, scale=0.1)
    scene = cube()
    scene.body["cube"]["mesh"] = flat
    with pytest.raises(pliant.SceneError, match="without volume"):
        scene.build()
    with pytest.raises(pliant.MeshError):
        pliant.Mesh.block([0.1, 0.1, 0.1], edge=0.05).write(f"{tmp_path}/mesh.doc")


def test_calls_that_do_not_fit() -> None:
    sim = cube().build().simulate()
    nodes = len(sim.model.rest)
    for call, says in [
        (lambda: sim.push(np.zeros((3, nodes))), rf"\(3, {nodes}\), expected \({nodes}, 3\)"),
        (lambda: sim.push(np.full((nodes, 3), np.inf)), "not finite"),
        (lambda: sim.grip(), "either a place or nodes"),
        (lambda: sim.grip(at=(0, 0, np.nan)), "not finite"),
        (lambda: sim.grip(nodes=[]), "needs nodes"),
        (lambda: sim.grip(nodes=[nodes]), f"0 to {nodes - 1}"),
        (lambda: sim.grip(at=(0, 0, 0), stiffness=-1.0), "`stiffness` of a grip"),
        (lambda: sim.grip(at=(0, 0, 0), on="nobody"), "nobody"),
        (lambda: sim.grip(at=(0, 0, 0), radius=-0.01), "at least 0"),
        (lambda: sim.positions(np.zeros((nodes, 3), dtype=np.float32)), "float32"),
        (lambda: sim.field("colour"), "there is no field"),
        (lambda: sim.field("membrane-force", on="cube"), "has no field"),
        (lambda: sim.field("displacement", on="cube", at="edges"), "points or cells"),
        (lambda: sim.step(-1), "-1"),
        (lambda: sim.run(every=-1.0), "`every`"),
        (lambda: sim.picture(size=(0, 10)), "pixels"),
        (lambda: sim.drive("nothing", ((0, 0, 0), (0, 0, 0, 1))), "no tool"),
        (lambda: sim.drive("nothing", ((0, 0, 0), (0, 0, 0, 0))), "length 0"),
        (lambda: sim.drive("nothing", np.ones((4, 4))), "rotation"),
    ]:
        with pytest.raises(ValueError, match=says):
            call()
    for call in (lambda: sim.reaction("nobody"), lambda: sim.tool("nothing"), lambda: sim.push(np.zeros((1, 3)), body="nobody")):
        with pytest.raises(KeyError):
            call()
    assert sim.step() == 1


def test_states_of_other_models(tmp_path: object) -> None:
    sim, other = cube(2).build().simulate(), cube(3).build().simulate()
    with pytest.raises(pliant.ResumeError):
        sim.restore(other.state())
    with pytest.raises(pliant.ResumeError):
        sim.restore(pickle.loads(pickle.dumps(other.state())))
    path = f"{tmp_path}/state"
    with open(path, "wb") as file:
        file.write(b"no state")
    with pytest.raises((pliant.ResumeError, OSError)):
        pliant.State.load(path)
    assert sim.step() == 1


def test_closed_twice_and_used_after() -> None:
    model = cube().build()
    sim = model.simulate()
    sim.close()
    sim.close()
    with pytest.raises(pliant.ClosedError):
        sim.step()
    del model
    with pytest.raises(pliant.ClosedError):
        _ = sim.time


def test_a_model_may_go_while_a_simulation_uses_it() -> None:
    sim = cube().build().simulate()
    assert sim.step(10) == 10


def test_devices_that_are_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises((pliant.SceneError, pliant.DeviceError), match="adapter|GPU|device"):
        cube(**{"run.device": "gpu", "run.adapter": "Unobtainium"}).build().simulate()


def test_a_model_warns_once_per_text() -> None:
    scene = cube()
    scene.body["cube"]["mesh"] = {"block": {"size": [1e-5, 1e-5, 1e-5], "cells": [2, 2, 2]}}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene.build()
    texts = [str(warning.message) for warning in caught if issubclass(warning.category, pliant.PliantWarning)]
    assert texts and len(texts) == len(set(texts))


def test_errors_travel() -> None:
    error = pliant.ConvergenceError("no", kind="not-converged", body="b", element=None, node=3, time=0.5, load_step=2, residual=0.1)
    again = pickle.loads(pickle.dumps(error))
    assert (again.node, again.residual, str(again)) == (3, 0.1, "no")
    blocked = pickle.loads(pickle.dumps(pliant.BlockedError("no", kind="blocked", driver="push", force=2.5)))
    assert (blocked.driver, blocked.force, blocked.node) == ("push", 2.5, None)
    assert isinstance(blocked, pliant.ConvergenceError)


def test_what_is_not_installed_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    import importlib

    def missing(name: str) -> object:
        raise ImportError(name)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(ImportError, match=r"pliant\[mesh\]"):
        pliant.Mesh.block([0.1, 0.1, 0.1], edge=0.05).to_pyvista()
