"""Models: scenes that are built, constant and shared between simulations."""

from __future__ import annotations

import base64
import json
import math
import os
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pliant import _native
from pliant._arrays import fixed
from pliant.errors import PliantWarning, SimulationError
from pliant.mesh import Mesh, _table

if TYPE_CHECKING:
    from pliant.engines import Stop
    from pliant.result import Progress, Result
    from pliant.scene import Scene
    from pliant.simulation import Simulation

__all__ = ["Body", "Model"]

_MOST_THREADS = 1024
"""The limit of the key ``threads`` of a scene."""


@dataclass(frozen=True)
class Body:
    """A body of a model.

    `nodes` are its nodes among all nodes of the model, `mesh` is at rest [m], and `given_numbers` (nodes,) holds the number of each node
    in the mesh that was given or read.
    """

    name: str
    nodes: slice
    mesh: Mesh
    given_numbers: NDArray[np.uint32]


class Model:
    """A scene that is built. It does not change, and any number of simulations share it.

    Examples
    --------
    >>> from pliant import Mesh, Scene
    >>> model = Scene.of_mesh(Mesh.block([0.1, 0.05, 0.05], edge=0.025)).build()
    >>> model.rest.shape
    (45, 3)
    >>> model.mass.sum().round(3)
    np.float64(0.25)
    """

    _own: _native.Model
    _scene: Scene

    @classmethod
    def _of(cls, scene: Scene, native: _native.Model) -> Model:
        model = cls.__new__(cls)
        model._scene, model._own = scene, native
        for text in {str(found) for found in native.warnings()}:
            warnings.warn(text, PliantWarning, stacklevel=3)
        return model

    @property
    def scene(self) -> Scene:
        """A copy of the scene it was built from."""
        return self._scene.copy()

    @property
    def rest(self) -> NDArray[np.float64]:
        """Places of all nodes at rest [m], (nodes, 3), bodies one after another."""
        places: NDArray[np.float64] = self._kept("_rest", lambda: fixed(self._own.rest()))
        return places

    @property
    def mass(self) -> NDArray[np.float64]:
        """Masses of all nodes [kg], (nodes,)."""
        masses: NDArray[np.float64] = self._kept("_mass", lambda: fixed(self._own.mass()))
        return masses

    @property
    def step(self) -> float:
        """Time step [s]."""
        return self._own.steps()[0]

    @property
    def limit(self) -> float | None:
        """Critical time step [s] of explicit steps; `None` where steps of any length are stable."""
        return self._own.steps()[1]

    @property
    def steps(self) -> int:
        """Steps to the end of the scene."""
        return self._own.steps()[2]

    @property
    def bodies(self) -> Mapping[str, Body]:
        """The bodies by name."""

        def make() -> Mapping[str, Body]:
            all_bodies = {}
            for name, first, count, mesh, given in self._own.bodies():
                all_bodies[name] = Body(name, slice(first, first + count), Mesh._of(mesh), fixed(given))
            return MappingProxyType(all_bodies)

        bodies: Mapping[str, Body] = self._kept("_bodies", make)
        return bodies

    @property
    def constraints(self) -> list[str]:
        """Names of constraints."""
        return self._own.names()["constraints"]

    @property
    def contacts(self) -> list[str]:
        """Names of contacts."""
        return self._own.names()["contacts"]

    @property
    def tools(self) -> list[str]:
        """Names of tools."""
        return self._own.names()["tools"]

    @property
    def notes(self) -> list[str]:
        """Remarks on the construction of the model."""
        return self._own.notes()

    @property
    def warnings(self) -> list[str]:
        """Warnings about the model."""
        return [str(found) for found in self._own.warnings()]

    @property
    def device(self) -> str:
        """``"cpu"``, or the name of the GPU that computes the steps."""
        return self._own.device()

    def _kept(self, name: str, make: Callable[[], Any]) -> Any:
        if name not in self.__dict__:
            self.__dict__[name] = make()
        return self.__dict__[name]

    def _body_mesh(self, name: str) -> Mesh:
        return self.bodies[name].mesh

    def select(self, body: str, what: str | Mapping[str, Any]) -> NDArray[np.uint32]:
        """Nodes of a body's mesh: ``"all"``, ``"boundary"``, the name of a set, or a selection as scenes write it.

        >>> from pliant import Mesh, Scene
        >>> model = Scene.of_mesh(Mesh.block([0.1, 0.05, 0.05], edge=0.025)).build()
        >>> model.select("body", "x-max").size, model.select("body", {"sphere": {"centre": [0, 0, 0], "radius": 0.03}}).size
        (9, 4)
        """
        from pliant.scene import _plain

        is_set = isinstance(what, str) and what not in ("all", "boundary")
        selection = _plain({"set": what} if is_set else what, {}, "the selection")
        return np.asarray(self._own.select(body, json.dumps(selection)), dtype=np.uint32)

    def simulate(self, *, threads: int = 1, precision: str | None = None, device: str | None = None) -> Simulation:
        """A simulation at its start.

        Parameters
        ----------
        threads
            Threads of its own, 1024 at most; 0 for all cores. Many simulations at once are fastest with one thread each.
        precision
            ``"single"`` or ``"double"`` instead of the scene's.
        device
            ``"cpu"``, ``"gpu"`` or the name of an adapter instead of the scene's.
        """
        from pliant.simulation import Simulation

        _check_threads(threads)
        values = {"run.precision": precision, "run.device": device}
        changed = {key: value for key, value in values.items() if value is not None}
        model = self._scene.replace(changed).build(like=self) if changed else self
        return Simulation._of(model, threads)

    def run(
        self,
        out: str | os.PathLike[str] | None = None,
        *,
        until: float | None = None,
        each: Callable[[Progress], object] | None = None,
        force: bool = False,
        resume: bool = False,
        threads: int = 0,
        picture: bool = False,
    ) -> Result:
        """Runs the model to its end, with the outputs of the scene in the folder `out`, or in memory.

        Parameters
        ----------
        out
            Folder of the outputs, as for ``pliant run``; without one nothing is written, and `Result.history` has the tables.
        until
            Duration [s] instead of the scene's.
        each
            Called about ten times a second with a `Progress`. An exception in it ends the run.
        force
            If true, replaces files of an earlier run.
        resume
            If true, continues from the last checkpoint in `out`.
        threads
            Threads, 1024 at most; 0 for all cores.
        picture
            If true, draws ``picture.png`` at the end.

        A run that fails warns and returns a result whose `status` is ``"failed"``: `Result.error` has the reason, and the results until then are kept.
        """
        _check_threads(threads)
        result = self._run(out, until=until, each=each, threads=threads, force=force, resume=resume, picture=picture)
        _doubt(result)
        return result

    def _run(
        self,
        out: str | os.PathLike[str] | None,
        *,
        until: float | None = None,
        each: Callable[[Progress], object] | None = None,
        threads: int = 0,
        stop: Stop | None = None,
        **options: bool,
    ) -> Result:
        """`run`, which `stop` can end from another thread: it then raises `Stopped`."""
        from pliant.result import Progress, Result

        if until is not None:
            until = float(until)
            if not (0.0 < until < math.inf):
                raise ValueError(f"a run lasts until a time greater than 0, not {until} s")
        if out is None:
            if options.get("resume") or options.get("picture"):
                raise ValueError("a run in memory has no checkpoints and draws no file: give a folder `out`")
            return self._run_in_memory(until, each, threads, stop)

        def report(time: float, end: float, wall: float) -> None:
            if stop is not None:
                stop.check()
            if each is not None:
                each(Progress(time, end, wall))

        try:
            all_options = {"until": until, "threads": threads, "force": False, "resume": False, "picture": False, **options}
            text, time, energies = self._own.run(os.fspath(out), all_options, report if each or stop else None)
        except KeyboardInterrupt as interrupt:
            if "checkpoint" in self._scene.run_table and hasattr(interrupt, "add_note"):
                interrupt.add_note(f"`run({os.fspath(out)!r}, resume=True)` continues from the last checkpoint")
            raise
        units = {"time": "s", **dict(self._own.columns())}
        return Result._of_files(json.loads(text), time, energies, os.fspath(out), units)

    def _lasting(self, until: float | None) -> Model:
        """The same with another duration [s]: steps divide it, as they do in a run with a folder."""
        if until is None or until == self._scene.until:
            return self
        model = Model.__new__(Model)
        model._scene, model._own = self._scene.replace({"scene.until": until}), self._own.lasting(until)
        return model

    def _run_in_memory(
        self,
        until: float | None,
        each: Callable[[Progress], object] | None,
        threads: int,
        stop: Stop | None,
    ) -> Result:
        import time as clock

        from pliant.result import Progress, Result

        started = clock.monotonic()
        end = self._scene.until if until is None else until
        simulation = self._lasting(until).simulate(threads=threads)
        error: SimulationError | None = None

        def look(now: Simulation) -> None:
            if stop is not None:
                stop.check()
            if each is not None:
                each(Progress(now.time, end, clock.monotonic() - started))

        history = simulation._history(())
        if stop is not None:
            stop.watch(simulation)
        try:
            simulation._run_into(history, end, look, None)
        except SimulationError as failure:
            error = failure
        finally:
            if stop is not None:
                stop.forget(simulation)
        if stop is not None:
            stop.check()
        return Result._of_memory(simulation, history, clock.monotonic() - started, error)

    def _lends(self, scene: Scene) -> dict[str, Mesh]:
        """Meshes for the bodies of another scene whose tables of the mesh are the same, and are not given anyway."""
        lent: dict[str, Mesh] = {}
        if os.path.abspath(scene.folder) != os.path.abspath(self._scene.folder):
            return lent
        for name, body in scene.body.items():
            known = self._scene.body.get(name)
            table = _get(body, "mesh")
            if known is None or table is None or isinstance(table, Mesh) or _get(known, "mesh") != table:
                continue
            if not isinstance(table, Mapping) or any(
                scene._given.get(image) is not self._scene._given.get(image) for image in _images_of(table) if isinstance(image, str)
            ):
                continue
            if isinstance(table, Mapping) and ("given" in table or "fix" in table or ("file" in table and "as" not in table)):
                continue
            lent[name] = self._body_mesh(name)
        return lent

    def __reduce__(self) -> tuple[Any, ...]:
        return _built_again, (self._scene,)

    def __repr__(self) -> str:
        count = len(self.bodies)
        return f"Model({count} {'body' if count == 1 else 'bodies'}, {len(self.rest)} nodes, step {self.step:.3g} s)"

    def _repr_html_(self) -> str:
        rows: dict[str, Any] = {"bodies": ", ".join(self.bodies), "nodes": len(self.rest), "mass [kg]": f"{self.mass.sum():.4g}"}
        rows |= {"step [s]": f"{self.step:.3g}", "steps": self.steps, "device": self.device}
        # More takes longer than one waits for.
        if len(self.rest) > 50_000:
            return _table("Model", rows)
        with self.simulate() as simulation:
            png = simulation._repr_png_()
        picture = "" if png is None else f'<img src="data:image/png;base64,{base64.b64encode(png).decode()}" width="480">'
        return _table("Model", rows) + picture


def _built_again(scene: Scene) -> Model:
    with warnings.catch_warnings():
        # They were shown when the model was built first.
        warnings.simplefilter("ignore", PliantWarning)
        return scene.build()


def _images_of(table: Mapping[str, Any]) -> list[Any]:
    """What a table of a mesh is made of: names of files or of given images, or images."""
    return [table.get("image"), table.get("add"), *(table.get("masks") or ())]


def _get(body: Any, key: str) -> Any:
    return body.get(key) if isinstance(body, Mapping) else getattr(body, key, None)


def _check_threads(threads: int) -> None:
    """Raises `ValueError` for a number of threads that no scene may have either."""
    if not 0 <= threads <= _MOST_THREADS:
        raise ValueError(f"`threads` is {threads}: it must be from 0 (all cores) to {_MOST_THREADS}")


def _doubt(result: Result) -> None:
    for text in dict.fromkeys(result.warnings):
        warnings.warn(text, PliantWarning, stacklevel=3)
    if result.error is not None:
        warnings.warn(f"the run failed: {result.error}", PliantWarning, stacklevel=3)
