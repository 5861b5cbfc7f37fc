"""The live view: no copy, and its memory outlives all else."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest

import pliant
from conftest import crushed


def test_it_is_read_only_and_of_the_newest_instant(scene: pliant.Scene) -> None:
    sim = scene.build().simulate()
    u = sim.displacement
    assert u.shape == sim.model.rest.shape
    assert not u.flags.owndata and not u.flags.writeable and u.flags.c_contiguous
    with pytest.raises(ValueError, match="WRITEABLE|writeable"):
        u.flags.writeable = True
    assert not u.any()
    sim.step(20)
    assert u[:, 2].min() < 0.0
    assert np.shares_memory(u, sim.displacement)
    assert u.dtype == np.float64


def test_it_keeps_its_address(any_solver: pliant.Scene) -> None:
    sim = any_solver.build().simulate()
    address = sim.displacement.__array_interface__["data"][0]
    start = sim.state()
    sim.step(5)
    sim.set({"law.tissue.young-modulus": 11e3})
    sim.restore(start)
    sim.step(1000)
    sim.reset()
    assert sim.displacement.__array_interface__["data"][0] == address


def test_it_lives_as_long_as_someone_looks(scene: pliant.Scene) -> None:
    sim = scene.build().simulate()
    sim.step(50)
    u = sim.displacement
    kept, native = np.array(u), weakref.ref(sim._own)
    del sim
    gc.collect()
    assert native() is not None
    junk = [np.random.default_rng(k).random((1000, 3)) for k in range(200)]
    assert np.array_equal(u, kept) and len(junk) == 200
    del u
    gc.collect()
    assert native() is None


def test_it_survives_a_close_and_a_failure(scene: pliant.Scene) -> None:
    sim = scene.build().simulate()
    sim.step(10)
    u, kept = sim.displacement, np.array(sim.displacement)
    sim.close()
    assert np.array_equal(u, kept)
    sim = crushed().build().simulate()
    u = sim.displacement
    with pytest.raises(pliant.UnstableError) as caught:
        sim.step(200)
    assert caught.value.kind in ("unstable", "not-finite", "inverted", "unbalanced")
    assert caught.value.body == "cube" and caught.value.time is not None
    assert np.isfinite(u).all() and np.shares_memory(u, sim.displacement)
