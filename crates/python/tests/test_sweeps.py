"""Sweeps: the same rows by every engine, lost workers, rows that last, other versions."""

from __future__ import annotations

import csv
import json
import os
import signal
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


def slow(_: pliant.Result) -> dict[str, object]:
    """A measure that takes its time."""
    time.sleep(0.4)
    return {}


def test_an_interrupted_sweep_goes_on(tmp_path: Path, expected: list[dict[str, Any]]) -> None:
    out = tmp_path / "study"
    program = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "import pliant, test_sweeps as t\n"
        f"pliant.sweep(t.scene(), t.VALUES, out={str(out)!r}, progress=False, measure=t.slow)\n"
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
    table = pliant.sweep(scene(), VALUES, out=out, progress=False, measure=slow)
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
    cube_scene = scene()
    cube_scene.body["cube"]["mesh"] = {"file": "block.vtu"}
    cube_scene.folder = str(tmp_path)
    bundle = _bundle(cube_scene, [{"scene.until": 0.01}], ["scene.until"], None, 1, None)
    assert list(bundle.files) == ["block.vtu"]
    row = _run(bundle, 0)
    assert row["status"] == "done", row


def test_parts_of_the_command_line_are_put_together(tmp_path: Path, expected: list[dict[str, Any]]) -> None:
    cube_scene = scene()
    cube_scene.save(tmp_path / "scene.toml")
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


def swept(out: Path, **options: Any) -> pliant.Sweep:
    return pliant.sweep(scene(), {"law.tissue.young-modulus": [5e3]}, out=out, progress=False, **options)


def test_rows_of_an_edited_measure_are_made_anew(tmp_path: Path) -> None:
    def make(text: str) -> Any:
        names: dict[str, Any] = {}
        exec(text, names)
        return names["measure"]

    edits = [
        "def measure(r): return {'x': 1}",
        "def measure(r): return {'x': 2}",
        "LEVEL = 3\ndef measure(r): return {'x': LEVEL}",
        "LEVEL = 4\ndef measure(r): return {'x': LEVEL}",
        "def helper(): return 5\ndef measure(r): return {'x': helper()}",
        "def helper(): return 6\ndef measure(r): return {'x': helper()}",
        "def measure(r, level=7): return {'x': level}",
    ]
    assert [swept(tmp_path, measure=make(text)).rows[0]["x"] for text in edits] == [1, 2, 3, 4, 5, 6, 7]
    stamp = (tmp_path / "rows.jsonl").read_text()
    assert swept(tmp_path, measure=make(edits[2])).rows[0]["x"] == 3
    assert (tmp_path / "rows.jsonl").read_text() == stamp


def test_a_measure_that_raises_leaves_the_columns_of_the_run(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    mark.touch()

    def measure(_: pliant.Result) -> dict[str, object]:
        if mark.exists():
            raise OSError("disk full")
        return {"ok": 1}

    for _ in range(2):
        (row,) = swept(tmp_path, measure=measure).rows
        assert row["status"] == "failed" and row["error"] == "measure: OSError: disk full" and np.isfinite(row["reaction.base.z"])
        mark.unlink(missing_ok=True)
    (row,) = swept(tmp_path, measure=measure, retry="failed").rows
    assert row["status"] == "done" and row["ok"] == 1
    with pytest.raises(ValueError, match="retry"):
        swept(tmp_path, retry="all")
    (row,) = swept(tmp_path / "other", measure=lambda _: {"a": object()}).rows
    assert row["status"] == "failed" and "object" in row["error"]


def test_a_wrong_combination_is_a_row_wherever_it_stands() -> None:
    for ratios in ([0.6, 0.2], [0.2, 0.6], [0.6, 0.7]):
        table = pliant.sweep(scene(), {"law.tissue.poisson-ratio": ratios}, progress=False)
        assert [row["status"] for row in table] == ["failed" if ratio > 0.5 else "done" for ratio in ratios]
    table = pliant.sweep(scene(), {"law.tisue.young-modulus": [3e3, 4e3]}, progress=False)
    assert all(row["status"] == "failed" and "tisue" in row["error"] for row in table)


def test_values_are_vectors_tables_meshes_and_numbers_of_numpy(tmp_path: Path) -> None:
    from pliant import tables

    gravities = [np.array([0, 0, -9.81]), (0, 0, np.float64(-1.6))]
    table = pliant.sweep(scene(), {"scene.gravity": gravities, "law.tissue.young-modulus": np.array([5e3, 8e3])}, progress=False, out=tmp_path)
    assert not table.failures and table.rows[0]["scene.gravity"] == [0.0, 0.0, -9.81]
    again = pliant.sweep(scene(), {"scene.gravity": gravities, "law.tissue.young-modulus": [5e3, 8e3]}, progress=False, out=tmp_path)
    assert [row["wall_seconds"] for row in again] == [row["wall_seconds"] for row in table]
    pytest.importorskip("xarray")
    grid = table.to_xarray()
    assert grid["reaction.base.z"].shape == (2, 2) and grid["scene.gravity"].values[0] == "[0.0, 0.0, -9.81]"
    meshes = [pliant.Mesh.block([0.1] * 3, edge=edge) for edge in (0.05, 0.034)]
    table = pliant.sweep(scene(), {"body.cube.mesh": meshes}, progress=False, out=tmp_path)
    assert not table.failures and "48 tetra" in table.rows[0]["body.cube.mesh"]
    assert table.rows[0]["step"] != table.rows[1]["step"]
    laws = [tables.NeoHookean(young_modulus=e, poisson_ratio=0.3) for e in (5e3, np.float64(8e3))]
    table = pliant.sweep(scene(), {"law.tissue": laws}, progress=False, measure=lambda r: {"three": np.arange(3.0)})
    assert not table.failures and table.to_xarray()["three"].shape == (2, 3)


def test_ctrl_c_stops_the_runs_under_way_and_keeps_rows(tmp_path: Path) -> None:
    program = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "import pliant\nfrom conftest import cube\n"
        "scene = cube(8, **{'law.tissue.young-modulus': 2e5})\n"
        "values = {'scene.until': [0.002, 0.003, 60.0, 61.0, 62.0, 63.0]}\n"
        "print('go', flush=True)\n"
        f"try: pliant.sweep(scene, values, out={str(tmp_path)!r}, progress=False)\n"
        "except KeyboardInterrupt: print('interrupted', flush=True)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "go\n"
    rows = tmp_path / "rows.jsonl"
    until = time.monotonic() + 60
    while time.monotonic() < until and not (rows.exists() and rows.read_text().count("\n") >= 2):
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    begin = time.monotonic()
    assert process.communicate(timeout=60)[0] == "interrupted\n"
    assert time.monotonic() - begin < 10
    assert sorted(json.loads(line)["scene.until"] for line in rows.read_text().splitlines()) == [0.002, 0.003]


def test_a_worker_of_dask_without_the_package_is_named(tmp_path: Path) -> None:
    distributed = engine("distributed")
    with distributed.LocalCluster(n_workers=0, dashboard_address=None) as cluster, distributed.Client(cluster) as client:
        program = (
            "import importlib.util as own\nfind = own.find_spec\n"
            "own.find_spec = lambda name, package=None: None if name == 'pliant' else find(name, package)\n"
            "from distributed.cli.dask_worker import main\n"
            f"main(['{cluster.scheduler_address}', '--no-nanny', '--nthreads', '1', '--no-dashboard'])\n"
        )
        worker = subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        try:
            client.wait_for_workers(1, timeout=60)
            with pytest.raises(pliant.ClusterError, match="not installed"):
                pliant.sweep(scene(), VALUES, on=client, progress=False)
        finally:
            worker.terminate()
            worker.wait()
