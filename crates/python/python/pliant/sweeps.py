"""Many runs with different values, on one machine or many."""

from __future__ import annotations

import contextlib
import csv
import glob
import hashlib
import itertools
import json
import math
import os
import pickle
import socket
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from pliant import _native, _toml
from pliant._code import code_of
from pliant._table import Table
from pliant.engines import Stop, Stopped, engine_of
from pliant.errors import ClusterError, Error, PliantWarning
from pliant.image import Image
from pliant.mesh import Mesh, _extra, _table
from pliant.model import Model
from pliant.result import Result
from pliant.scene import Scene, load

if TYPE_CHECKING:
    import pandas
    import xarray

__all__ = ["Sweep", "merge", "sweep"]

_ROWS = "rows.jsonl"
_TABLE = "sweep.csv"


@dataclass
class Sweep:
    """The rows of a sweep, in the order of the combinations: values, `status`, `error`, and the results at the end of each run.

    `keys` are the paths that were varied, `path` is the folder of the table.
    """

    rows: list[dict[str, Any]]
    keys: list[str]
    path: str | None = None
    missing: list[int] = field(default_factory=list)

    @property
    def failures(self) -> list[dict[str, Any]]:
        """Rows of runs that failed."""
        return [row for row in self.rows if row["status"] != "done"]

    def to_pandas(self) -> pandas.DataFrame:
        """A data frame, a row a run."""
        pd = _extra("pandas", "tables")
        return pd.DataFrame(self.rows).set_index("run")

    def to_xarray(self) -> xarray.Dataset:
        """A data set over the values, if all their combinations were run."""
        xr = _extra("xarray", "tables")
        # Vectors and tables are no coordinates: their text is.
        texts = [{key: _toml.value(row[key]) if isinstance(row[key], (list, dict)) else row[key] for key in self.keys} for row in self.rows]
        axes = {key: list(dict.fromkeys(row[key] for row in texts)) for key in self.keys}
        shape = tuple(len(values) for values in axes.values())
        if math.prod(shape) != len(self.rows):
            raise ValueError("these runs do not form a grid of values; use `to_pandas` for a table")
        names = [name for name in _columns(self.rows, self.keys) if name not in ("run", *self.keys, *_TOLD)]
        data = {}
        for name in names:
            there = [np.asarray(row[name]) for row in self.rows if name in row]
            if len({array.shape for array in there}) != 1:
                raise ValueError(f"the shape of `{name}` differs between runs; use `to_pandas` for a table")
            array = np.array([row.get(name, np.full(there[0].shape, math.nan)) for row in self.rows])
            dims = [*axes, *(f"{name}_{k}" for k in range(1, array.ndim))]
            data[name] = (dims, array.reshape(shape + array.shape[1:]))
        found: xarray.Dataset = xr.Dataset(data, coords=axes)
        return found

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.rows)

    def __repr__(self) -> str:
        failed = f", {len(self.failures)} failed" if self.failures else ""
        return f"Sweep({len(self.rows)} runs{failed})"

    def _repr_html_(self) -> str:
        return _table("Sweep", {"runs": len(self.rows), "failed": len(self.failures), "values": ", ".join(self.keys)})


_TOLD = ("status", "error", "host", "wall_seconds")


@dataclass(frozen=True)
class _Bundle:
    """What all runs share, and workers get once."""

    scene: bytes
    files: dict[str, bytes]
    combinations: list[dict[str, Any]]
    keys: list[str]
    measure: Callable[[Result], Mapping[str, object]] | None
    threads: int
    keep: str | None
    version: str
    code: str

    def hashed(self, number: int) -> str:
        """The key of a row: it belongs to these values of this scene, to the code of `measure` and to this version."""
        digest = hashlib.sha256(self.scene)
        for name in sorted(self.files):
            digest.update(name.encode() + hashlib.sha256(self.files[name]).digest())
        values = {key: pickle.dumps(value).hex() if isinstance(value, (Mesh, Image)) else value for key, value in self.combinations[number].items()}
        digest.update(json.dumps([values, self.code, self.version], sort_keys=True).encode())
        return digest.hexdigest()


def sweep(
    scene: Scene | str | os.PathLike[str],
    values: Mapping[str, Sequence[Any]] | Sequence[Mapping[str, Any]] | pandas.DataFrame,
    *,
    out: str | os.PathLike[str] | None = None,
    on: Literal["local", "dask", "ray"] | Any = "local",
    cores: int = 1,
    gpus: float = 0,
    retries: int = 3,
    measure: Callable[[Result], Mapping[str, object]] | None = None,
    keep: Literal["table", "all"] = "table",
    resume: bool = True,
    retry: Literal["failed"] | None = None,
    progress: bool = True,
) -> Sweep:
    """Runs a scene with many values.

    Parameters
    ----------
    scene
        The scene, or the path of its file.
    values
        Lists of values by path, of which all combinations are run, the last path changing fastest; or one mapping for each run; or a data frame, a row a run.
        A value is a number, a text, a vector or a table, also of NumPy, or a mesh.
    out
        Folder of ``rows.jsonl`` and ``sweep.csv``. The same call again continues an interrupted sweep.
    on
        ``"local"`` (threads), ``"dask"``, ``"ray"``, a client of Dask, or an executor.
    cores, gpus
        Cores and GPUs for one run.
    retries
        Number of times that a run is repeated if its worker is lost. Runs that fail become rows and are not repeated.
    measure
        Called with the `Result` of each run, on the worker; its returned mapping goes into the row. If it raises, the row has failed, and keeps
        the columns of the run.
    keep
        ``"all"`` writes the outputs of each run to ``out/run-NNNN``, which all workers must reach.
    resume
        If true, takes rows of an earlier call with the same scene, values, version and `measure`. The code of `measure` includes the functions
        and plain values of its module that it names.
    retry
        ``"failed"`` repeats the failed runs of an earlier call.
    progress
        If true, a line on standard error shows the number of runs that have ended.

    Ctrl-C stops active runs on threads of this process; elsewhere it cancels the queued runs. Rows of runs that have ended are kept, so
    that the same call continues the sweep.

    Examples
    --------
    >>> from pliant import Mesh, Scene
    >>> scene = Scene.of_mesh(Mesh.block([0.1, 0.05, 0.05], edge=0.025))
    >>> table = sweep(scene, {"scene.until": [0.01], "law.tissue.young-modulus": [4e3, 8e3]}, progress=False)
    >>> [row["law.tissue.young-modulus"] for row in table], len(table.failures)
    ([4000.0, 8000.0], 0)
    """
    scene = scene if isinstance(scene, Scene) else load(scene)
    combinations, keys = _combinations(values)
    if not combinations:
        raise ValueError("a sweep needs values")
    if keep == "all" and out is None:
        raise ValueError("to keep the outputs of all runs, give a folder `out`")
    if retry not in (None, "failed"):
        raise ValueError(f"`retry` must be None or 'failed', not {retry!r}")
    folder = None if out is None else os.path.abspath(os.fspath(out))
    bundle = _bundle(scene, combinations, keys, measure, cores, folder if keep == "all" else None)
    rows: dict[int, dict[str, Any]] = {}
    if folder is not None:
        os.makedirs(folder, exist_ok=True)
        rows = _known(os.path.join(folder, _ROWS), bundle) if resume else {}
        if not resume and os.path.exists(os.path.join(folder, _ROWS)):
            os.remove(os.path.join(folder, _ROWS))
    if retry == "failed":
        rows = {number: row for number, row in rows.items() if row["status"] == "done"}
    left = [number for number in range(len(combinations)) if number not in rows]
    sink = None if folder is None else open(os.path.join(folder, _ROWS), "a", encoding="utf-8")  # noqa: SIM115
    engine = engine_of(on, cores, gpus, retries)
    runs = engine.run(_run, bundle, left)

    def take(row: dict[str, Any]) -> None:
        _take(row, rows, bundle)
        if sink is not None:
            sink.write(json.dumps(row) + "\n")
            sink.flush()
        if progress:
            print(f"\r{len(rows)} of {len(combinations)} runs", end="", file=sys.stderr, flush=True)

    try:
        for row in runs:
            take(row)
    except KeyboardInterrupt:
        runs.close()
        for row in engine.ended:
            take(row)
        raise
    finally:
        runs.close()
        if sink is not None:
            sink.close()
        if progress and rows:
            print(file=sys.stderr)
    done = Sweep([_public(rows[number]) for number in sorted(rows)], keys, folder)
    if folder is not None:
        _write(done, folder)
    return done


def merge(out: str | os.PathLike[str]) -> Sweep:
    """Joins the parts that ``pliant sweep --part i/n`` wrote to a folder, writes the table, and names missing runs."""
    folder = os.fspath(out)
    parts = sorted(glob.glob(os.path.join(glob.escape(folder), "rows-*-of-*.jsonl")))
    if not parts:
        raise ValueError(f"there are no parts of a sweep (rows-1-of-4.jsonl, …) in `{folder}`")
    rows: dict[int, dict[str, Any]] = {}
    keys: list[str] = []
    runs = 0
    for path in parts:
        for row in _lines(path):
            keys, runs = row["keys"], max(runs, int(row["runs"]))
            rows[int(row["run"])] = row
    missing = [number for number in range(runs) if number not in rows]
    if missing:
        warnings.warn(f"{len(missing)} of {runs} runs are missing: {missing[:20]}", PliantWarning, stacklevel=2)
    done = Sweep([_public(rows[number]) for number in sorted(rows)], keys, folder, missing)
    _write(done, folder)
    return done


def _combinations(values: Any) -> tuple[list[dict[str, Any]], list[str]]:
    if hasattr(values, "to_dict") and hasattr(values, "columns"):
        values = values.to_dict(orient="records")
    if isinstance(values, Mapping):
        keys = list(values)
        lists = [list(choices) if not isinstance(choices, str) else [choices] for choices in values.values()]
        return [dict(zip(keys, map(_number, combination), strict=True)) for combination in itertools.product(*lists)], keys
    rows = [{str(key): _number(value) for key, value in row.items()} for row in values]
    keys = list(dict.fromkeys(key for row in rows for key in row))
    if any(list(row) != keys for row in rows):
        raise ValueError("all runs of a sweep must set the same values in the same order")
    return rows, keys


def _number(value: Any) -> Any:
    """A value as plain data; meshes and images as they are."""
    if isinstance(value, Table):
        value = value.to_dict()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [_number(element) for element in value]
    if isinstance(value, Mapping):
        return {str(key): _number(entry) for key, entry in value.items()}
    return value


def _bundle(
    scene: Scene,
    combinations: list[dict[str, Any]],
    keys: list[str],
    measure: Callable[[Result], Mapping[str, object]] | None,
    threads: int,
    keep: str | None,
) -> _Bundle:
    scene = scene.copy()
    # Meshes of images and surfaces are made here, once, unless a value changes them.
    if not any(".mesh" in key for key in keys):
        for name, mesh in _lent(scene, combinations).items():
            body = _number(scene.body[name])
            if any(word in body["mesh"] for word in ("image", "masks", "file")):
                scene.body[name] = {**body, "mesh": mesh}
    files = {name: _bytes(os.path.join(scene.folder, name)) for name in _files(scene._data, scene.folder)}
    carried = scene if not files else _elsewhere(scene)
    version, code = _native.__version__, code_of(measure)
    return _Bundle(pickle.dumps(carried), files, combinations, keys, measure, threads, keep, version, code)


def _lent(scene: Scene, combinations: Sequence[Mapping[str, Any]]) -> Mapping[str, Mesh]:
    """Meshes of the first combination that can be built; a wrong one is a row that fails."""
    for values in combinations:
        try:
            return scene.replace(values).build()._lends(scene)
        except (Error, KeyError, TypeError, ValueError):
            continue
    return {}


def _elsewhere(scene: Scene) -> Scene:
    copy = scene.copy()
    copy.folder = ""
    return copy


def _files(value: Any, folder: str) -> Iterator[str]:
    """Files of its folder that a scene names."""
    if isinstance(value, str):
        if value and len(value) < 4096 and "\n" not in value and os.path.isfile(os.path.join(folder, value)):
            yield value
    elif isinstance(value, Mapping):
        for entry in value.values():
            yield from _files(entry, folder)
    elif isinstance(value, (list, tuple)):
        for element in value:
            yield from _files(element, folder)


def _bytes(path: str) -> bytes:
    with open(path, "rb") as file:
        return file.read()


def _run(bundle: _Bundle, number: int, stop: Stop | None = None) -> dict[str, Any]:
    """A run as a row. It raises only if it was stopped, so that no engine repeats it."""
    row: dict[str, Any] = {"run": number, **{key: _told(value) for key, value in bundle.combinations[number].items()}}
    row |= {"key": bundle.hashed(number), "host": socket.gethostname(), "version": _native.__version__}
    if bundle.version != _native.__version__:
        return row | {"status": "failed", "error": "another version"}
    with tempfile.TemporaryDirectory() if bundle.files else contextlib.nullcontext() as folder:
        try:
            result, found = _ran(bundle, number, folder, stop)
        except Stopped:
            raise
        except Exception as error:
            return row | {"status": "failed", "error": f"{type(error).__name__}: {error}"}
        if bundle.measure is not None and result.status == "done":
            try:
                found |= {str(name): _jsonable(measured) for name, measured in bundle.measure(result).items()}
            except Exception as error:
                found |= {"status": "failed", "error": f"measure: {type(error).__name__}: {error}"}
        return row | found


def _ran(bundle: _Bundle, number: int, folder: str | None, stop: Stop | None) -> tuple[Result, dict[str, Any]]:
    """The result of a run, and its columns."""
    scene: Scene = pickle.loads(bundle.scene)
    if folder is not None:
        for name, content in bundle.files.items():
            path = os.path.join(folder, os.path.basename(name) if os.path.isabs(name) or ".." in name else name)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "wb") as file:
                file.write(content)
        scene.folder = folder
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PliantWarning)
        model: Model = scene.replace(bundle.combinations[number]).build()
        out = None if bundle.keep is None else os.path.join(bundle.keep, f"run-{number:04}")
        result = model._run(out, threads=bundle.threads, force=out is not None, stop=stop)
        last: dict[str, Any] = {} if out is not None else {name: float(column[-1]) for name, column in result.history.items() if name != "time"}
    row: dict[str, Any] = {"status": result.status, "error": "" if result.error is None else str(result.error)}
    row |= {"time": result.time, "steps": result.steps, "step": model.step, "wall_seconds": result.wall_seconds}
    row |= last or {f"energy.{name}": energy for name, energy in result.energies._asdict().items()}
    for name, force in result.reactions.items():
        row |= {f"reaction.{name}.{axis}": float(component) for axis, component in zip("xyz", force, strict=True)}
    return result, row


def _told(value: Any) -> Any:
    """A value as it stands in a row."""
    return repr(value) if isinstance(value, (Mesh, Image)) else value


def _jsonable(value: Any) -> Any:
    """What `measure` returned as plain data; an error names what can't be."""
    plain = _number(value)
    json.dumps(plain)
    return plain


def _take(row: dict[str, Any], rows: dict[int, dict[str, Any]], bundle: _Bundle) -> None:
    if row["version"] != bundle.version:
        message = f"a worker on {row['host']} has version {row['version']} of pliant, but this process has {bundle.version}; install the same version there"
        raise ClusterError(message, hosts=[row["host"]])
    rows[int(row["run"])] = row


def _lines(path: str) -> Iterator[dict[str, Any]]:
    """Whole lines of a file of rows: one that was cut off is passed over."""
    with open(path, encoding="utf-8") as file:
        for line in file:
            if not line.endswith("\n"):
                return
            try:
                yield json.loads(line)
            except json.JSONDecodeError:
                continue


def _known(path: str, bundle: _Bundle) -> dict[int, dict[str, Any]]:
    if not os.path.exists(path):
        return {}
    # A line that was cut off ends here, so that the next one begins afresh.
    content = _bytes(path)
    if content and not content.endswith(b"\n"):
        with open(path, "ab") as file:
            file.write(b"\n")
    rows = {}
    for row in _lines(path):
        number = int(row.get("run", -1))
        if 0 <= number < len(bundle.combinations) and row.get("key") == bundle.hashed(number):
            rows[number] = row
    return rows


def _public(row: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in row.items() if name not in ("key", "keys", "runs", "row", "version")}


def _columns(rows: Sequence[Mapping[str, Any]], keys: Sequence[str]) -> list[str]:
    names = ["run", *keys, "status", "error", "time", "steps", "step"]
    found = dict.fromkeys(name for row in rows for name in row if name not in (*names, "wall_seconds", "host"))
    return [*names, *found, "wall_seconds", "host"]


def _write(done: Sweep, folder: str) -> None:
    names = _columns(done.rows, done.keys)
    temporary = os.path.join(folder, f".{_TABLE}.{os.getpid()}")
    with open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        for row in done.rows:
            writer.writerow([_cell(row.get(name)) for name in names])
    os.replace(temporary, os.path.join(folder, _TABLE))
    try:
        import pandas as pd
        import pyarrow  # noqa: F401

        pd.DataFrame(done.rows).to_parquet(os.path.join(folder, "sweep.parquet"))
    except ImportError:
        pass


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    return _toml.value(value) if isinstance(value, (bool, list, tuple, dict)) else repr(value)
