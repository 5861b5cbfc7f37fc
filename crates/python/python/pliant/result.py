"""Results of runs: histories, summaries, frames."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pliant.errors import BlockedError, ConvergenceError, SimulationError, UnstableError
from pliant.mesh import Mesh, _extra, _table

if TYPE_CHECKING:
    import pandas
    import xarray

    from pliant.simulation import Energies, Simulation

__all__ = ["History", "Progress", "Result"]


class Progress(NamedTuple):
    """Progress of a run: simulated time [s], its end [s], wall time [s]."""

    time: float
    until: float
    wall: float


class History(Mapping[str, NDArray[np.float64]]):
    """Samples over time: ``history["time"]`` [s], the columns of the scene's tables, recorded fields (samples, nodes, …). `units` has units by name.

    >>> history = History({"time": [0.0, 0.1], "reaction.base.z": [0.0, 2.0]}, {"time": "s", "reaction.base.z": "N"})
    >>> float(history["reaction.base.z"][-1]), history.units["reaction.base.z"]
    (2.0, 'N')
    """

    def __init__(self, columns: Mapping[str, Sequence[float]], units: Mapping[str, str]) -> None:
        self._columns = {name: np.asarray(column, dtype=np.float64) for name, column in columns.items()}
        self.units = dict(units)
        self._fields: list[str] = []

    @classmethod
    def _empty(cls, columns: Sequence[tuple[str, str]], fields: Sequence[str]) -> History:
        history = cls({}, {"time": "s", **dict(columns)})
        history._names = [name for name, _ in columns]
        history._fields = list(fields)
        history._rows = []
        history._frames = {name: [] for name in fields}
        return history

    _names: list[str]
    _rows: list[list[float]]
    _frames: dict[str, list[NDArray[np.float64]]]

    def _add(self, time: float, row: Sequence[float], frames: Mapping[str, NDArray[np.float64]]) -> None:
        self._rows.append([time, *row])
        for name, frame in frames.items():
            self._frames[name].append(frame)
        self._columns = {}

    def _whole(self) -> dict[str, NDArray[np.float64]]:
        if not self._columns and getattr(self, "_rows", None):
            table = np.array(self._rows, dtype=np.float64)
            self._columns = dict(zip(["time", *self._names], table.T, strict=True))
            self._columns |= {name: np.array(frames) for name, frames in self._frames.items()}
        return self._columns

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        found = self._whole()
        if name not in found:
            raise KeyError(f"the history has no `{name}`; it has {', '.join(found)}")
        return found[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._whole())

    def __len__(self) -> int:
        return len(self._whole())

    def to_pandas(self) -> pandas.DataFrame:
        """A data frame of the columns, without recorded fields."""
        pd = _extra("pandas", "tables")
        return pd.DataFrame({name: column for name, column in self._whole().items() if column.ndim == 1})

    def to_xarray(self) -> xarray.Dataset:
        """A data set over time, with units and recorded fields."""
        xr = _extra("xarray", "tables")
        rest = {name: column for name, column in self._whole().items() if name != "time"}
        data = {}
        for name, column in rest.items():
            dims = ("time", *(f"{name}_{k}" for k in range(1, column.ndim)))
            data[name] = (dims, column, {"units": self.units.get(name, "")})
        found: xarray.Dataset = xr.Dataset(data, coords={"time": ("time", self["time"], {"units": "s"})})
        return found

    def plot(self, *names: str, ax: Any = None) -> Any:
        """Draws columns over time with matplotlib; all reactions, if none are named."""
        plt = _extra("matplotlib.pyplot", "plot")
        ax = plt.subplots()[1] if ax is None else ax
        chosen = names or tuple(name for name in self if name.startswith("reaction."))
        for name in chosen:
            unit = self.units.get(name)
            ax.plot(self["time"], self[name], label=f"{name} [{unit}]" if unit else name)
        ax.set_xlabel("time [s]")
        ax.legend()
        return ax

    def __repr__(self) -> str:
        samples = len(self["time"]) if "time" in self else 0
        return f"History({samples} samples of {len(self)} columns)"


@dataclass
class Result:
    """The end of a run.

    `status` is ``"done"`` or ``"failed"``; a failed run has an `error`. `time` [s], `steps`, `wall_seconds`, `energies` [J] and `reactions` [N] are
    values at its end. `files` are the paths that were written, `summary` is the object that ``pliant run --json`` prints.
    """

    status: str
    time: float
    steps: int
    wall_seconds: float
    energies: Energies
    reactions: dict[str, NDArray[np.float64]]
    warnings: list[str]
    files: list[str]
    history: History
    error: SimulationError | None = None
    summary: dict[str, Any] = field(default_factory=dict)
    folder: str | None = None

    @classmethod
    def _of_files(
        cls,
        summary: dict[str, Any],
        time: float,
        energies: Sequence[float],
        folder: str,
        units: Mapping[str, str],
    ) -> Result:
        from pliant.simulation import Energies

        failure = summary.get("error")
        return cls(
            status=summary["status"],
            time=time,
            steps=summary["steps"],
            wall_seconds=summary["wall_seconds"],
            energies=Energies(*energies),
            reactions={name: np.array(force) for name, force in summary["reactions"].items()},
            warnings=summary["warnings"],
            files=summary["files"],
            history=_read_tables(summary["files"], units),
            error=None if failure is None else _failure(failure),
            summary=summary,
            folder=folder,
        )

    @classmethod
    def _of_memory(cls, simulation: Simulation, history: History, wall: float, error: SimulationError | None) -> Result:
        from pliant.simulation import Energies

        names = [name for name in history if name.startswith("energy.") and name.count(".") == 1]
        last = {name.split(".")[1]: float(history[name][-1]) for name in names}
        reactions: dict[str, NDArray[np.float64]] = {}
        for name in simulation.model.constraints:
            if f"reaction.{name}.x" in history:
                reactions[name] = np.array([history[f"reaction.{name}.{axis}"][-1] for axis in "xyz"])
        return cls(
            status="done" if error is None else "failed",
            time=simulation.time,
            steps=simulation.steps,
            wall_seconds=wall,
            energies=Energies(*(last.get(name.replace("_", "-"), float("nan")) for name in Energies._fields)),
            reactions=reactions,
            warnings=[],
            files=[],
            history=history,
            error=error,
        )

    def frames(self, output: str | None = None) -> Iterator[tuple[float, Mesh]]:
        """Time [s] and mesh of each frame of a series that was written: the series `output`, or the only one."""
        series = [path for path in self.files if path.endswith(".pvd")]
        if output is not None:
            series = [path for path in series if os.path.basename(path) == f"{output}.pvd"]
        if len(series) != 1:
            known = ", ".join(os.path.basename(path)[:-4] for path in self.files if path.endswith(".pvd"))
            raise ValueError(f"name one series as `output`; the run has written {known or 'no series'}")
        import xml.etree.ElementTree as tree

        for entry in tree.parse(series[0]).iter("DataSet"):
            path = os.path.join(os.path.dirname(series[0]), entry.attrib["file"])
            yield float(entry.attrib["timestep"]), Mesh.read(path)

    def __repr__(self) -> str:
        return f"Result({self.status}, {self.time:g} s, {self.steps} steps in {self.wall_seconds:.3g} s)"

    def _repr_html_(self) -> str:
        rows: dict[str, Any] = {"status": self.status, "time [s]": f"{self.time:g}", "steps": self.steps}
        rows["wall time [s]"] = f"{self.wall_seconds:.3g}"
        for name, force in self.reactions.items():
            rows[f"reaction {name} [N]"] = ", ".join(f"{f:.4g}" for f in force)
        return _table("Result", rows)


def _failure(failure: Mapping[str, Any]) -> SimulationError:
    kinds: dict[str, type[SimulationError]]
    kinds = {"not-finite": UnstableError, "inverted": UnstableError, "unbalanced": UnstableError, "unstable": UnstableError}
    kinds |= {"not-converged": ConvergenceError, "singular": ConvergenceError, "blocked": BlockedError}
    step, blocked = failure.get("load_step") or {}, failure.get("blocked") or {}
    kind = kinds.get(failure["kind"], SimulationError)
    fields = {name: failure.get(name) for name in ("kind", "body", "element", "node", "time")}
    fields |= {"load_step": step.get("number"), "residual": step.get("residual")}
    return kind(failure["message"], **fields, driver=blocked.get("driver"), force=blocked.get("force"))


def _read_tables(files: Sequence[str], units: Mapping[str, str]) -> History:
    """The first table that a run has written."""
    tables = [path for path in files if path.endswith(".csv") and not os.path.basename(path).startswith("convergence")]
    if not tables:
        return History({}, {})
    with open(tables[0], newline="", encoding="utf-8") as file:
        header, *rows = list(csv.reader(file))
    numbers = np.array([[float(cell) if cell else float("nan") for cell in row] for row in rows]).reshape(-1, len(header))
    return History(dict(zip(header, numbers.T, strict=True)), {name: units.get(name, "") for name in header})
