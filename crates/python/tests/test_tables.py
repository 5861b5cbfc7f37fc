"""Scenes made of classes of tables are varied as those of files are."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

import pliant
from pliant import Mesh
from pliant import tables as t


def scene() -> pliant.Scene:
    """A block of relaxing tissue on its base."""
    scene = pliant.Scene(until=0.02, gravity=(0, 0, -9.81))
    terms = [{"part": "isochoric", "weight": 0.3, "time": 0.1}]
    scene.law["tissue"] = t.NeoHookean(young_modulus=3e3, poisson_ratio=0.45, prony=terms)
    scene.body["block"] = t.Body(mesh=Mesh.block([0.1, 0.1, 0.1], edge=0.05), law="tissue", density=1000, damping=5, velocity=(0.0, 0.0, 0.1))
    scene.constraint["base"] = t.Fix(body="block", nodes={"set": "z-min"})
    return scene


def test_values_are_read_and_set_by_their_paths() -> None:
    block = scene()
    law = block.law["tissue"]
    assert block["law.tissue.young-modulus"] == 3e3 and block["law.tissue.prony.0.weight"] == 0.3 and block["constraint.base.nodes.set"] == "z-min"
    block["law.tissue.young-modulus"] = 4e3
    block["law.tissue.prony.0.weight"] = np.float64(0.2)
    block["body.block.velocity.2"] = 0.05
    block["constraint.base.nodes.set"] = "z-max"
    assert block["law.tissue.young-modulus"] == 4e3 and block["law.tissue.prony.0.weight"] == 0.2 and block["body.block.velocity.2"] == 0.05
    # Classes of tables are constant, and may be in other scenes.
    assert law.young_modulus == 3e3 and law.prony[0]["weight"] == 0.3
    for path in ("law.tissue.prony.1.weight", "law.tissue.colour", "body.block.mesh.edge", "law.tissue.young-modulus.unit"):
        with pytest.raises(KeyError, match="law|body"):
            _ = block[path]
    for path in ("law.tissue.prony.1.weight", "body.block.mesh.edge", "law.tissue.young-modulus.unit", "body.block.velocity.x"):
        with pytest.raises(KeyError, match="law|body"):
            block[path] = 1.0
    assert len(block.build().rest) == 27


def test_scenes_of_tables_are_replaced_swept_and_set(tmp_path: Path) -> None:
    typed = scene()
    plain = pliant.Scene(until=0.02, gravity=(0, 0, -9.81))
    for kind in ("law", "body", "constraint"):
        for name, table in getattr(typed, kind).items():
            getattr(plain, kind)[name] = table.to_dict()
    values = {"law.tissue.young-modulus": 5e3}
    assert typed.replace(values).build().step == plain.replace(values).build().step
    assert typed["law.tissue.young-modulus"] == 3e3
    rows = [pliant.sweep(each, {"law.tissue.young-modulus": [3e3, 5e3]}, progress=False) for each in (typed, plain)]
    assert not rows[0].failures and [row["reaction.base.z"] for row in rows[0]] == [row["reaction.base.z"] for row in rows[1]]
    sim = typed.build().simulate()
    sim.set(values)
    assert sim.model.scene["law.tissue.young-modulus"] == 5e3
    assert pickle.loads(pickle.dumps(typed)).replace(values)["law.tissue.young-modulus"] == 5e3
    typed.save(tmp_path / "scene.toml")
    assert pliant.load(tmp_path / "scene.toml", set=values).build().step == typed.replace(values).build().step
    loaded = pliant.Scene.from_toml(plain.replace({"body.block.mesh": {"block": {"size": [0.1] * 3}, "edge": 0.05}}).to_toml())
    loaded.law["tissue"] = typed.law["tissue"]
    assert loaded.replace(values).build().step == typed.replace(values).build().step
