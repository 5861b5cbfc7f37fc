"""Calls in any order leave the bits that a fresh run has, and meshes come back from other packages as they went."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from test_exchange import alike

import pliant
from conftest import cube

hypothesis = pytest.importorskip("hypothesis")
given, settings, st = hypothesis.given, hypothesis.settings, pytest.importorskip("hypothesis.strategies")

MODELS = {
    "explicit": cube().build(),
    "implicit": cube(**{"run.solver": "implicit", "run.step": 0.01}).build(),
    "quasi-static": cube(**{"run.solver": "quasi-static", "run.load-steps": 40}).build(),
}
PULLS = ((0.0, 0.0, 0.01), (0.01, 0.0, 0.0))

CALLS = st.one_of(
    st.tuples(st.just("step"), st.integers(1, 3)),
    st.tuples(st.just("set"), st.sampled_from([8e3, 10e3, 12e3])),
    st.tuples(st.just("grip"), st.sampled_from(PULLS)),
    st.tuples(st.sampled_from(["state", "restore", "release", "look", "view"]), st.none()),
)


def replayed(model: pliant.Model, calls: list[tuple[str, object]], looks: bool) -> int:
    """The fingerprint after calls; without `looks`, only what moves the body is called, and ways that were given up are left out."""
    sim = model.simulate(threads=1 if looks else 2)
    grips: list[pliant.Grip] = []
    kept: tuple[pliant.State, list[tuple[str, object]]] | None = None
    for name, value in calls:
        if name == "step":
            sim.step(value)  # type: ignore[arg-type]
        elif name == "set":
            # At the start of a quasi-static run a look finds the equilibrium of these numbers.
            sim.sample()
            sim.set({"law.tissue.young-modulus": value})  # type: ignore[dict-item]
        elif name == "grip" and model is not MODELS["quasi-static"]:
            # After a look a hand acts one step later.
            sim.sample()
            grips.append(sim.grip(at=(0.1, 0.1, 0.1), stiffness=20.0))
            grips[-1].place = grips[-1].point + value
            sim.step()
        elif name == "release" and grips:
            sim.sample()
            grips.pop().release()
            sim.step()
        elif looks and name == "look":
            sim.sample()
            sim.field("von-mises")
        elif looks and name == "view":
            assert abs(sim.displacement).max() < 1.0
        elif looks and name == "state":
            kept = sim.state(), []
        elif looks and name == "restore":
            here = sim.state()
            sim.restore(here if kept is None else kept[0])
            sim.step()
            sim.restore(here)
    # Before the first step a look finds the increment that leads to it.
    sim.step()
    return sim.fingerprint()


@pytest.mark.parametrize("solver", MODELS)
@settings(max_examples=25, deadline=None)
@given(calls=st.lists(CALLS, max_size=12))
def test_looks_snapshots_and_detours_change_no_bit(solver: str, calls: list[tuple[str, object]]) -> None:
    model = MODELS[solver]
    assert replayed(model, calls, looks=True) == replayed(model, calls, looks=False)


KINDS = {"line": 2, "triangle": 3, "quad": 4, "tetra": 4, "hexahedron": 8}
NAMES = st.text("abö1 -", min_size=1, max_size=6).filter(lambda name: name == name.strip() and name != "label")


@st.composite
def meshes(draw: hypothesis.strategies.DrawFn) -> pliant.Mesh:
    """Any cells on a dozen points, with data, sets and names; some data are not there for all kinds."""
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    kinds = draw(st.lists(st.sampled_from(list(KINDS)), min_size=1, max_size=3, unique=True))
    counts = [draw(st.integers(1, 4)) for _ in kinds]
    total = sum(counts)
    cells = {kind: random.integers(0, 12, (count, KINDS[kind])) for kind, count in zip(kinds, counts, strict=True)}
    data = {name: random.random((total, draw(st.sampled_from([1, 3, 9])))) for name in draw(st.lists(NAMES, max_size=2, unique=True))}
    data |= {"label": random.integers(-3, 4, total)} if draw(st.booleans()) else {}
    if len(kinds) > 1:
        for values in data.values():
            if values.dtype == float and draw(st.booleans()):
                values[: counts[0]] = np.nan
    subset = lambda count: np.flatnonzero(random.random(count) < 0.5)  # noqa: E731
    point_sets = {name: subset(12) for name in draw(st.lists(NAMES, max_size=2, unique=True))}
    cell_sets = {name: subset(total) for name in draw(st.lists(NAMES, max_size=2, unique=True))}
    names = draw(st.dictionaries(st.integers(-5, 5), NAMES, max_size=3))
    arrays = {"point_data": {name: random.random((12, 3)) for name in data if name != "label"}, "cell_data": data}
    return pliant.Mesh(random.random((12, 3)), cells, **arrays, point_sets=point_sets, cell_sets=cell_sets, label_names=names)


@settings(max_examples=100, deadline=None)
@given(mesh=meshes())
def test_meshes_go_there_and_back(mesh: pliant.Mesh) -> None:
    pytest.importorskip("meshio")
    pytest.importorskip("pyvista")
    alike(pickle.loads(pickle.dumps(mesh)), mesh)
    alike(pliant.Mesh.from_meshio(mesh.to_meshio()), mesh)
    alike(pliant.Mesh.from_pyvista(mesh.to_pyvista()), mesh)
