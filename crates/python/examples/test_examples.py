"""Runs each example of this folder."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[2]


def example(name: str) -> ModuleType:
    """An example as a module."""
    spec = importlib.util.spec_from_file_location(f"example_{name}", HERE / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(autouse=True)
def at_the_root(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenes are named from the root of the repository."""
    monkeypatch.chdir(ROOT)


def test_run() -> None:
    pytest.importorskip("pandas")
    assert example("01_run").main(until=0.1).status == "done"


def test_loop() -> None:
    assert example("02_loop").main(until=0.1) > 1e-5


def test_change() -> None:
    stiff, soft = example("03_change").main(until=0.15)
    assert stiff > 1.1 * soft > 0


def test_arrays() -> None:
    history = example("04_arrays").main()
    assert history["displacement"].shape[1:] == (125, 3)
    assert history["displacement"][-1, :, 2].min() < -1e-3


def test_image() -> None:
    mesh = example("05_image").main()
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    assert np.allclose(high - low, [0.12, 0.084, 0.066], rtol=0.1)


def test_pull() -> None:
    forces = example("06_pull").main()
    assert forces[-1] > forces[10] > 0


def test_sweep() -> None:
    table = example("07_sweep").main()
    assert len(table) == 5 and not table.failures


def test_identify() -> None:
    assert abs(example("08_identify").main() / 4.2e3 - 1) < 1e-3


@pytest.mark.skipif(not os.environ.get("PLIANT_REQUIRE_GPU"), reason="pictures need an adapter")
def test_picture() -> None:
    assert example("09_picture").main().size == (640, 480)


def test_shells() -> None:
    most = example("10_shells").main()
    assert most[0] < most[2]


def test_retraction() -> None:
    pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env

    module = example("11_retraction")
    check_env(module.Retraction(), skip_render_check=True)
    assert module.main() > 5e-3


def test_meshes() -> None:
    module = example("12_meshes")
    counts = module.main()
    assert counts["fewer triangles"] <= 400 and counts["curved shells"] <= 80 and min(counts.values()) > 0
    pytest.importorskip("meshio")
    pytest.importorskip("pyvista")
    plate = module.Mesh.plate([0.1, 0.05], edge=0.01)
    assert np.allclose(module.other_packages(plate).points, plate.points)


def test_scene() -> None:
    result = example("13_scene").main()
    assert result.status == "done" and len(result.history["time"]) > 5


@pytest.mark.skipif(not os.environ.get("PLIANT_REQUIRE_GPU"), reason="pictures need an adapter")
def test_saved_picture(tmp_path: Path) -> None:
    module = example("13_scene")
    pixels = module.picture(module.pliant.Scene.from_toml(module.TEXT).build().simulate(), str(tmp_path / "picture.png"))
    assert pixels.shape == (720, 960, 4) and (tmp_path / "picture.png").stat().st_size > 1000


def test_read() -> None:
    module = example("14_read")
    assert module.main() < 0.95
    volume, pressure = module.balloon()
    assert volume > 1.4e-4 and pressure > 1e3
