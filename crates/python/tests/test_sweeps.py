"""Sweeps: the same rows by every engine, lost workers, rows that last, other versions."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pliant
from conftest import cube
from pliant.sweeps import _bundle, _run

MARK = Path(tempfile.gettempdir()) / "pliant-worker-killed-once"
VALUES = {"law.tissue.young-modulus": [5e3, 10e3, 20e3], "law.tissue.poisson-ratio": [0.2, 0.6]}


def scene() -> pliant.Scene:
    """A short run; a Poisson's ratio of 0.6 is a mistake, and its rows fail."""
    return cube(**{"scene.until": 0.02})


def rows_of(table: pliant.Sweep) -> list[dict[str, Any]]:
    """Rows without what a machine adds."""
    return [{k: v for k, v in row.items() if k not in ("wall_seconds", "host")} for row in table]


@pytest.fixture(scope="module")
def expected() -> list[dict[str, Any]]:
    return rows_of(pliant.sweep(scene(), VALUES, progress=False))


def engine(name: str) -> Any:
    """An engine; a missing one is passed over, or fails in the gate."""
    try:
        return __import__(name)
    except ImportError:
        if os.environ.get("PLIANT_REQUIRE_CLUSTER"):
            raise
        pytest.skip(f"{name} is not installed")


def test_rows_are_in_order_and_failures_are_rows(expected: list[dict[str, Any]]) -> None:
    assert [row["run"] for row in expected] == list(range(6))
    assert [row["status"] for row in expected] == ["done", "failed"] * 3
    assert "poisson-ratio" in expected[1]["error"]
    assert all(np.isfinite(row["reaction.base.z"]) for row in expected[::2])


def test_they_are_those_of_single_runs(expected: list[dict[str, Any]]) -> None:
    result = scene().replace({"law.tissue.young-modulus": 10e3, "law.tissue.poisson-ratio": 0.2}).run()
    assert expected[2]["reaction.base.z"] == result.reactions["base"][2]


def test_an_executor(expected: list[dict[str, Any]]) -> None:
    with ThreadPoolExecutor(2) as pool:
        assert rows_of(pliant.sweep(scene(), VALUES, on=pool, progress=False)) == expected


def test_ray(expected: list[dict[str, Any]]) -> None:
    ray = engine("ray")
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    try:
        assert rows_of(pliant.sweep(scene(), VALUES, on="ray", progress=False)) == expected
        assert rows_of(pliant.sweep(scene(), VALUES, on="ray", progress=False, measure=killed_once())) == expected
    finally:
        ray.shutdown()


def test_dask(expected: list[dict[str, Any]]) -> None:
    distributed = engine("distributed")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        assert rows_of(pliant.sweep(scene(), VALUES, on=client, progress=False)) == expected
        assert rows_of(pliant.sweep(scene(), VALUES, on=client, progress=False, measure=killed_once())) == expected


def killed_once() -> Any:
    """A measure that kills its worker the first time. It is made here, so that it travels whole."""
    mark = str(MARK)

    def measure(_: pliant.Result) -> dict[str, object]:
        import os
        import signal

        try:
            with open(mark, "x"):
                pass
        except FileExistsError:
            return {}
        os.kill(os.getpid(), signal.SIGKILL)
        return {}

    return measure


@pytest.fixture(autouse=True)
def no_mark() -> Any:
    MARK.unlink(missing_ok=True)
    yield
    MARK.unlink(missing_ok=True)


def test_an_interrupted_sweep_goes_on(tmp_path: Path, expected: list[dict[str, Any]]) -> None:
    out = tmp_path / "study"
    program = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "import time, pliant, test_sweeps as t\n"
        "slow = lambda result: time.sleep(0.4) or {}\n"
        "slow.__qualname__ = ''\n"
        f"pliant.sweep(t.scene(), t.VALUES, out={str(out)!r}, progress=False, measure=slow)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", program])
    rows = out / "rows.jsonl"
    for _ in range(600):
        if rows.exists() and rows.read_text().count("\n") >= 2:
            break
        time.sleep(0.05)
    process.kill()
    process.wait()
    before = rows.read_text()
    known = before.count("\n")
    assert 2 <= known < 6
    rows.write_text(before + '{"run": 5, "cut')
    table = pliant.sweep(scene(), VALUES, out=out, progress=False)
    assert rows_of(table) == expected
    assert rows.read_text().startswith(before) and len([line for line in rows.read_text().splitlines() if line.endswith("}")]) == 6
    with open(out / "sweep.csv", newline="") as file:
        written = list(csv.DictReader(file))
    assert [row["status"] for row in written] == [row["status"] for row in expected]
    assert float(written[0]["reaction.base.z"]) == expected[0]["reaction.base.z"]


def test_rows_of_other_values_are_not_taken(tmp_path: Path) -> None:
    first = pliant.sweep(scene(), {"law.tissue.young-modulus": [5e3]}, out=tmp_path, progress=False)
    second = pliant.sweep(scene(), {"law.tissue.young-modulus": [6e3]}, out=tmp_path, progress=False)
    assert first.rows[0]["reaction.base.z"] != second.rows[0]["reaction.base.z"]


def test_measures_and_tables(tmp_path: Path) -> None:
    table = pliant.sweep(scene(), {"law.tissue.young-modulus": [5e3, 10e3]}, progress=False, measure=lambda r: {"most": float(r.time)})
    assert all(row["most"] == row["time"] for row in table)
    pandas = pytest.importorskip("pandas")
    assert isinstance(table.to_pandas(), pandas.DataFrame)
    pytest.importorskip("xarray")
    assert table.to_xarray()["reaction.base.z"].shape == (2,)
    kept = pliant.sweep(scene(), [{"scene.until": 0.01}], out=tmp_path, keep="all", progress=False)
    assert (tmp_path / "run-0000" / "summary.md").exists() and not kept.failures


def test_workers_of_another_version() -> None:
    class Other(ThreadPoolExecutor):
        def submit(self, task: Any, *arguments: Any) -> Any:  # type: ignore[override]
            return super().submit(lambda: task(*arguments) | {"version": "0.0.0"})

    with Other(1) as pool, pytest.raises(pliant.ClusterError, match=r"0\.0\.0") as caught:
        pliant.sweep(scene(), VALUES, on=pool, progress=False)
    assert caught.value.hosts
    with pytest.raises(pliant.ClusterError, match="no engine"):
        pliant.sweep(scene(), VALUES, on="mainframe", progress=False)


def test_files_of_a_scene_travel(tmp_path: Path) -> None:
    pliant.Mesh.block([0.1, 0.1, 0.1], edge=0.05).write(tmp_path / "block.vtu")
    own = scene()
    own.body["cube"]["mesh"] = {"file": "block.vtu"}
    own.folder = str(tmp_path)
    bundle = _bundle(own, [{"scene.until": 0.01}], ["scene.until"], None, 1, None)
    assert list(bundle.files) == ["block.vtu"]
    row = _run(bundle, 0)
    assert row["status"] == "done", row


def test_parts_of_the_command_line_are_put_together(tmp_path: Path, expected: list[dict[str, Any]]) -> None:
    own = scene()
    own.save(tmp_path / "scene.toml")
    sets = [f"--set={key}={','.join(str(value) for value in values)}" for key, values in VALUES.items() if "young" in key]
    for part in ("1/2", "2/2"):
        words = ["sweep", str(tmp_path / "scene.toml"), *sets, "--set=law.tissue.poisson-ratio=0.2", "--out", str(tmp_path), "--part", part]
        assert pliant._native.main(["pliant", *words]) == 0
    table = pliant.merge(tmp_path)
    assert not table.missing
    found = [(row["law.tissue.young-modulus"], row["reaction.base.z"]) for row in table]
    assert found == [(row["law.tissue.young-modulus"], row["reaction.base.z"]) for row in expected[::2]]


def test_parts_are_put_together(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no parts"):
        pliant.merge(tmp_path)
    row = {"row": {"whole": [1]}, "run": 1, "runs": 3, "keys": ["a"], "a": 2.0, "status": "done", "error": ""}
    (tmp_path / "rows-2-of-3.jsonl").write_text(json.dumps(row) + "\n")
    with pytest.warns(pliant.PliantWarning, match="2 of 3"):
        table = pliant.merge(tmp_path)
    assert table.missing == [0, 2] and table.rows[0]["a"] == 2.0
