"""Simulations that are running."""

from __future__ import annotations

import contextlib
import math
import operator
import os
import warnings
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pliant import _native
from pliant._arrays import indices, numbers, shaped
from pliant.errors import BusyError, Error, InternalError, PliantWarning, ResumeError
from pliant.mesh import Mesh
from pliant.result import History

if TYPE_CHECKING:
    from pliant.model import Model
    from pliant.pictures import Picture

__all__ = ["Energies", "Grip", "Simulation", "State", "Tool"]


class Energies(NamedTuple):
    """Energies [J]; `balance` is the missing energy, as a fraction of the largest.

    `step_changes` is the energy added by explicit steps of changing length.
    """

    kinetic: float
    internal: float
    damping: float
    external: float
    hourglass: float
    step_changes: float
    balance: float


class Tool(NamedTuple):
    """A tool at an instant: place [m], quaternion (x, y, z, w), angle between its jaws [rad], and contact forces.

    `force` [N] is the sum of all contacts, `torque` [N m] their moment about the place; `None` on a GPU.
    """

    place: NDArray[np.float64]
    quaternion: NDArray[np.float64]
    opening: float
    force: NDArray[np.float64]
    torque: NDArray[np.float64] | None


class State:
    """A snapshot: displacements, velocities, and internal variables of relaxing tissue. It fits any model with the same meshes, and pickles."""

    _own: _native.State

    @classmethod
    def _of(cls, native: _native.State) -> State:
        state = cls.__new__(cls)
        state._own = native
        return state

    @property
    def time(self) -> float:
        """Time [s]."""
        return self._own.time

    @property
    def steps(self) -> int:
        """Steps since the start."""
        return self._own.steps

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Displacements of all nodes [m], (nodes, 3)."""
        return self._own.displacement()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the snapshot to a file."""
        bytes_of, time, steps, moved = self._own.encoded()
        parts = {f"part{k}": np.frombuffer(part, dtype=np.uint8) for k, part in enumerate(bytes_of)}
        with open(path, "wb") as file:
            np.savez(file, allow_pickle=False, time=time, steps=steps, moved=np.asarray(moved), **parts)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> State:
        """Reads a file that `save` wrote."""
        try:
            with np.load(path, allow_pickle=False) as file:
                parts = [file[f"part{k}"].tobytes() for k in range(sum(name.startswith("part") for name in file.files))]
                return _state(parts, float(file["time"]), int(file["steps"]), file["moved"].tolist())
        except (KeyError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
            raise ResumeError(f"`{os.fspath(path)}` is not a state of a simulation: {error}", path=os.fspath(path)) from error

    def __reduce__(self) -> tuple[Any, ...]:
        return _state, self._own.encoded()

    def __repr__(self) -> str:
        return f"State({self.time:g} s, {len(self.displacement)} nodes)"


def _state(parts: list[bytes], time: float, steps: int, moved: list[float]) -> State:
    return State._of(_native.State.decoded(parts, time, steps, moved))


class Grip:
    """A grip: a spring between the surface around a point and a place. Setting `place` pulls."""

    def __init__(self, simulation: Simulation, nodes: list[tuple[int, float]], stiffness: float) -> None:
        self._simulation: Simulation | None = simulation
        self._nodes, self._asked = nodes, stiffness
        self._stiffness = stiffness
        rest, moved = simulation.model.rest, simulation.displacement
        places = np.array([rest[n] + moved[n] for n, _ in nodes], dtype=np.float64)
        self._place: NDArray[np.float64] = np.array([w for _, w in nodes]) @ places

    def _held(self) -> Simulation:
        if self._simulation is None:
            raise ValueError("this grip is released")
        return self._simulation

    @property
    def point(self) -> NDArray[np.float64]:
        """Present place of the gripped surface [m]."""
        return self._pulled()[0]

    @property
    def force(self) -> NDArray[np.float64]:
        """Its force on the body [N]."""
        return self._pulled()[1]

    def _pulled(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        simulation = self._held()
        found = simulation._own.pulled(simulation._grips.index(self))
        if found is None:
            raise InternalError("the engine holds fewer grips than were taken")
        return np.array(found[0]), np.array(found[1])

    @property
    def place(self) -> NDArray[np.float64]:
        """Place that the grip pulls to [m]."""
        return self._place.copy()

    @place.setter
    def place(self, place: ArrayLike) -> None:
        self._place = numbers(place, "the place of a grip", (3,)).copy()
        self._held()._hold()

    @property
    def stiffness(self) -> float:
        """Its stiffness [N/m]: as given, or lower so that steps stay stable."""
        return self._stiffness

    def release(self) -> None:
        """Releases the grip."""
        if self._simulation is not None:
            self._simulation._grips.remove(self)
            self._simulation._hold()
            self._simulation = None


class Simulation:
    """A running model. It takes one call at a time: a second call raises `BusyError`. It is a context manager.

    Examples
    --------
    >>> from pliant import Mesh, Scene
    >>> scene = Scene.of_mesh(Mesh.block([0.1, 0.05, 0.05], edge=0.025))
    >>> scene["scene.gravity"] = (0.0, 0.0, -9.81)
    >>> with scene.build().simulate() as sim:
    ...     u = sim.displacement
    ...     sim.step(100)
    ...     bool(u[:, 2].min() < -1e-4)
    100
    True
    """

    _own: _native.Simulation
    _model: Model

    @classmethod
    def _of(cls, model: Model, threads: int) -> Simulation:
        simulation = cls.__new__(cls)
        simulation._model = model
        simulation._own = _native.Simulation(model._own, threads)
        simulation._threads = threads
        simulation._grips = []
        simulation._calling = False
        return simulation

    _threads: int
    _grips: list[Grip]
    _calling: bool

    @property
    def model(self) -> Model:
        """The model, with the numbers of the last `set`."""
        return self._model

    @property
    def time(self) -> float:
        """Time [s]."""
        return self._own.time

    @property
    def steps(self) -> int:
        """Steps since the start."""
        return self._own.steps

    @property
    def step_size(self) -> float:
        """Length of the next step [s]."""
        return self._own.step_size

    @property
    def device(self) -> str:
        """``"cpu"``, or the name of the GPU that computes the steps."""
        return self._model.device

    @property
    def ended(self) -> str | None:
        """The reason why it ended before the last step of its scene."""
        return self._own.ended()

    @property
    def displacement(self) -> NDArray[np.float32] | NDArray[np.float64]:
        """Displacements of all nodes [m], (nodes, 3): a live view, always of the newest instant, read-only, without a copy.

        It is in the solver's own numbers. ``np.array(sim.displacement)`` keeps an instant. A thread that reads the view
        during a step of another thread may see two instants mixed.
        """
        return self._own.displacement

    def positions(self, out: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Positions of all nodes [m], (nodes, 3), in a fresh array or in `out`."""
        out = self._out(out)
        self._own.positions(out)
        return out

    def velocities(self, out: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Velocities of all nodes [m/s], (nodes, 3), in a fresh array or in `out`."""
        out = self._out(out)
        self._own.velocities(out)
        return out

    def _out(self, out: NDArray[np.float64] | None) -> NDArray[np.float64]:
        shape = self._model.rest.shape
        if out is None:
            return np.empty(shape)
        if out.dtype != np.float64 or out.shape != shape or not out.flags.writeable:
            raise ValueError(f"`out` has shape {out.shape} and type {out.dtype}; expected a writeable float64 array of shape {shape}")
        return out

    def field(self, name: str, *, on: str | None = None, at: Literal["points", "cells"] | None = None) -> NDArray[np.float64]:
        """A field at the instant: (n,), (n, 3) or (n, 3, 3), as `pliant.tables.Vtu` describes them.

        Parameters
        ----------
        name
            A name as in ``data = […]`` of outputs: ``"von-mises"``, ``"contact-pressure"``, ….
        on
            A body or a carried surface; if not given, all bodies, one after another.
        at
            ``"points"`` or ``"cells"``; if not given, the place where the field is computed.
        """
        if at not in (None, "points", "cells"):
            raise ValueError(f"a field is at points or cells, not {at!r}")
        if on is None:
            return np.concatenate([self.field(name, on=body, at=at) for body in self._model.bodies])
        values = self._own.field(name, on, None if at is None else at == "cells")
        if values.shape[1] == 1:
            return values[:, 0]
        return values.reshape(-1, 3, 3) if values.shape[1] == 9 else values

    @property
    def energies(self) -> Energies:
        """Energies at the instant [J]."""
        return Energies(*self._own.energies())

    def reaction(self, constraint: str) -> NDArray[np.float64]:
        """Force by which a constraint holds or moves its nodes [N], (3,)."""
        found = self._own.reaction(constraint)
        if found is None:
            raise KeyError(f"there is no constraint `{constraint}`; there are {', '.join(self._model.constraints) or 'none'}")
        return np.array(found)

    def enclosed(self, constraint: str) -> tuple[float, float]:
        """Volume [m³] and pressure [Pa] of a constraint ``volume``."""
        found = self._own.enclosed(constraint)
        if found is None:
            raise KeyError(f"there is no constraint of volume `{constraint}`")
        return found[0], found[1]

    def contacts(self) -> dict[str, NDArray[np.float64]]:
        """Force of each contact on its second partner [N], (3,), by name.

        A contact between several things has pairs, such as ``"hold.liver-grasper.upper"`` of ``between = ["liver", "grasper"]``.
        """
        return {name: np.array(force) for name, force in self._own.contacts().items()}

    def tool(self, name: str) -> Tool:
        """A tool, an obstacle, or a jaw of a tool (``"grasper.upper"``, ``"grasper.lower"``) at the instant."""
        found = self._own.tool(name)
        if found is None:
            raise KeyError(f"nothing touches a tool `{name}`; there are {', '.join(self._model.tools) or 'none'}")
        (place, quaternion), opening, force, torque = found
        return Tool(np.array(place), np.array(quaternion), opening, np.array(force), None if torque is None else np.array(torque))

    def drive(
        self,
        tool: str,
        pose: ArrayLike | tuple[ArrayLike, ArrayLike] | None = None,
        *,
        opening: float | None = None,
        within: float = 0.0,
    ) -> float:
        """Leads a tool to a pose, and its jaws to an angle; returns the time of arrival [s].

        Parameters
        ----------
        tool
            Its name.
        pose
            A place [m], a pair of place and quaternion (x, y, z, w), or a matrix (4, 4). A place alone keeps its orientation. Without a
            pose the tool continues its motion.
        opening
            Angle between the jaws [rad]. Without one the jaws continue their motion.
        within
            Time to get there [s], at least a step.
        """
        if pose is None and opening is None:
            raise ValueError(f"`{tool}` has no goal: give a pose, an opening, or both")
        goal: tuple[list[float], list[float]] | None = None
        if pose is not None:
            place, quaternion = _pose(pose)
            if quaternion is None:
                quaternion = self.tool(tool).quaternion
            goal = [float(c) for c in place], [float(c) for c in quaternion]
        return self._own.drive(tool, goal, None if opening is None else float(opening), float(within))

    def open(self, tool: str, angle: float, *, within: float = 0.0) -> float:
        """Opens or closes the jaws of a tool to an angle [rad], while the tool continues its motion; returns the time of arrival [s]."""
        return self.drive(tool, opening=angle, within=within)

    def sample(self) -> dict[str, float]:
        """All columns of the scene's tables at the instant."""
        return dict(zip((name for name, _ in self._own.columns()), self._own.sample(), strict=True))

    def step(self, count: int = 1) -> int:
        """Takes steps; returns the steps done, fewer if the run ends before."""
        number = operator.index(count)
        if number < 0:
            raise ValueError(f"the number of steps must be at least 0, not {count}")
        self._free()
        return self._own.advance(number, None)

    def run(
        self,
        until: float | None = None,
        *,
        each: Callable[[Simulation], object] | None = None,
        every: float | None = None,
        record: str | Sequence[str] = (),
    ) -> History:
        """Runs to a time, and records on the way. An exception that ends the run early has the history until then as its attribute `history`.

        Parameters
        ----------
        until
            Time [s]; the end of the scene, if not given.
        each
            Called at every sample, between steps: it may read, move grips and tools, push and set. Its exceptions pass through.
        every
            Time between samples [s], at least a step. If not given, the interval of the scene's table, or a thousandth of the run.
        record
            Further fields at points to record, one or several: ``history["displacement"]`` is (samples, nodes, 3).
        """
        self._free()
        end = self._model._scene.until if until is None else float(until)
        if not math.isfinite(end):
            raise ValueError(f"`until` must be a finite time, not {end} s")
        history = self._history([record] if isinstance(record, str) else record)
        try:
            self._run_into(history, end, each, every)
        except BaseException as error:
            # Some exceptions take no attributes.
            with contextlib.suppress(AttributeError):
                error.history = history  # type: ignore[attr-defined]
            raise
        return history

    def _history(self, record: Sequence[str]) -> History:
        return History._empty(self._own.columns(), list(record))

    def _run_into(
        self,
        history: History,
        until: float,
        each: Callable[[Simulation], object] | None,
        every: float | None,
    ) -> None:
        if every is None:
            tables = [output for output in self._model._scene._data.get("output", {}).values() if _kind(output) == "csv"]
            every = float(_every(tables[0])) if tables else (until - self.time) / 1000.0
        if until <= self.time:
            every = math.inf
        if not every > 0.0:
            raise ValueError(f"`every` must be greater than 0, not {every} s")
        start, count = self.time, 0
        while True:
            history._add(self.time, self._own.sample(), {name: self._recorded(name) for name in history._fields})
            if each is not None:
                self._calling = True
                try:
                    each(self)
                finally:
                    self._calling = False
            done = 0
            while done == 0:
                count += 1
                target = start + count * every
                # Samples that come closer than steps are one a step.
                if target < self.time + 0.5 * self.step_size:
                    target = self.time + self.step_size
                target = min(target, until)
                done = self._own.advance(None, target)
                if target >= until or self.ended is not None:
                    break
            if done == 0:
                return

    def _recorded(self, name: str) -> NDArray[np.float64]:
        return np.array(self.displacement, dtype=np.float64) if name == "displacement" else self.field(name, at="points")

    def _free(self) -> None:
        if self._calling:
            raise BusyError("a callback of `run` may read, pull and set; it must not take steps or restore a snapshot")

    def push(self, forces: ArrayLike | None, *, body: str | None = None) -> None:
        """Sets forces on all nodes [N], (nodes, 3), or on the nodes of a body. They stay until replaced; `None` ends them."""
        if forces is None:
            self._own.push(None)
            return
        count = len(self._model.rest)
        if body is None:
            # The engine looks for forces that are not finite.
            self._own.push(shaped(forces, "forces", (count, 3)))
            return
        if body not in self._model.bodies:
            raise KeyError(f"there is no body `{body}`; there are {', '.join(self._model.bodies)}")
        nodes, before = self._model.bodies[body].nodes, self._own.pushed()
        every = before if len(before) else np.zeros((count, 3))
        every[nodes] = numbers(forces, f"forces on `{body}`", (nodes.stop - nodes.start, 3))
        self._own.push(every)

    def grip(
        self,
        at: ArrayLike | None = None,
        *,
        nodes: ArrayLike | None = None,
        on: str | None = None,
        radius: float | None = None,
        stiffness: float = 100.0,
    ) -> Grip:
        """Takes hold of the surface around the place that is nearest to `at` [m], or of nodes.

        Parameters
        ----------
        at
            A place [m].
        nodes
            Nodes of the model instead of a place, held by their mean.
        on
            The body to hold; the nearest one, if not given.
        radius
            Radius of the gripped surface [m]; if not given, two edges of the mesh.
        stiffness
            Stiffness of the spring [N/m]; reduced where steps would not be stable.
        """
        if (at is None) == (nodes is None):
            raise ValueError("give a grip either a place or nodes")
        if not stiffness > 0.0:
            raise ValueError(f"`stiffness` of a grip must be greater than 0, not {stiffness} N/m")
        if nodes is not None:
            chosen = indices(nodes, "nodes of a grip", (None,), len(self._model.rest))
            if not len(chosen):
                raise ValueError("a grip needs nodes")
            weights = [(int(node), 1.0 / len(chosen)) for node in chosen]
        else:
            place = numbers(at if at is not None else (), "the place of a grip", (3,))
            weights = self._own.around([float(x) for x in place], on, radius)
        grip = Grip(self, weights, float(stiffness))
        self._grips.append(grip)
        try:
            self._hold()
        except Exception:
            self._grips.remove(grip)
            self._hold()
            raise
        return grip

    def _hold(self) -> None:
        all_grips = [(grip._nodes, [float(x) for x in grip._place], grip._asked) for grip in self._grips]
        for grip, stiffness in zip(self._grips, self._own.hold(all_grips), strict=True):
            grip._stiffness = stiffness

    def set(self, values: Mapping[str, float]) -> None:
        """Changes numbers of laws, loads, density or damping, by their paths, from the next step on. The step length may change."""
        scene = self._model._scene.replace(dict(values))
        model = scene.build(like=self._model)
        if not self._own.exchange(model._own):
            raise ValueError(f"{', '.join(values)} would change the mesh, the solver or the precision; build a new model")
        self._model = model
        # Steps of another length are stable with other stiffnesses.
        self._hold()

    def state(self) -> State:
        """A snapshot, without grips, pushed forces and the numbers of `set`."""
        return State._of(self._own.state())

    def restore(self, state: State) -> None:
        """Restores a snapshot. Grips and pushed forces stay. A callback of `run` cannot call this: the run would have no end."""
        self._free()
        try:
            self._own.restore(state._own)
        except ValueError as error:
            raise ResumeError(str(error)) from None

    def reset(self) -> None:
        """Goes back to the start of the scene."""
        self.restore(Simulation._of(self._model, 1).state())

    def copy(self) -> Simulation:
        """Another simulation in the same state, without grips and pushed forces."""
        other = Simulation._of(self._model, self._threads)
        other.restore(self.state())
        return other

    def fingerprint(self) -> int:
        """A hash of all bits of the motion: equal motions have equal hashes."""
        return self._own.fingerprint()

    def mesh(self, data: Sequence[str] = ("displacement",), *, on: str | None = None, at: str = "points") -> Mesh:
        """The mesh at rest of a body, a surface or all bodies, with fields of the instant."""
        return Mesh._of(self._own.mesh(list(data), on, at == "cells"))

    def picture(
        self,
        *,
        field: str | None = None,
        size: tuple[int, int] = (960, 720),
        camera: tuple[float, float] | None = None,
    ) -> Picture:
        """A picture of the instant, as ``[view]`` of the scene shows it. No screen is needed.

        Parameters
        ----------
        field
            Field for the colours, instead of the scene's.
        size
            Width and height in pixels.
        camera
            Azimuth and elevation [degrees], instead of the scene's.
        """
        from pliant.pictures import Picture

        if len(size) != 2 or not all(1 <= int(n) <= 8192 for n in size):
            raise ValueError(f"`size` is {size} pixels; each side must have 1 to 8192")
        png = self._own.picture(field, [int(size[0]), int(size[1])], None if camera is None else list(camera))
        return Picture(bytes(png))

    def _repr_png_(self) -> bytes | None:
        try:
            return self.picture().png
        except Error as error:
            warnings.warn(f"no picture: {error}", PliantWarning, stacklevel=2)
            return None

    def close(self) -> None:
        """Ends the simulation. Views stay readable; everything else raises `ClosedError`."""
        self._own.close()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Simulation({self.time:g} s, {self.steps} steps, {len(self._model.rest)} nodes, {self.device})"


def _kind(table: Any) -> str | None:
    return table.get("type") if isinstance(table, Mapping) else getattr(table, "_type", None)


def _every(table: Any) -> Any:
    return table.get("every") if isinstance(table, Mapping) else table.every


def _pose(pose: Any) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    if isinstance(pose, tuple) and len(pose) == 2:
        return numbers(pose[0], "the place of a tool", (3,)), numbers(pose[1], "the quaternion of a tool", (4,))
    array = np.asarray(pose)
    if array.shape == (3,):
        return numbers(array, "the place of a tool", (3,)), None
    matrix = numbers(array, "the pose of a tool", (4, 4))
    turn = matrix[:3, :3]
    if not np.allclose(turn @ turn.T, np.eye(3), atol=1e-6) or np.linalg.det(turn) < 0.0:
        raise ValueError("the 3 × 3 part of the pose of a tool must be a rotation, without stretching")
    return matrix[:3, 3], _quaternion(turn)


def _quaternion(turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """(x, y, z, w) of a rotation matrix, from the eigenvector of the largest eigenvalue (Bar-Itzhack 2000)."""
    a = turn
    k = np.array(
        [
            [a[0, 0] - a[1, 1] - a[2, 2], a[0, 1] + a[1, 0], a[0, 2] + a[2, 0], a[2, 1] - a[1, 2]],
            [a[0, 1] + a[1, 0], a[1, 1] - a[0, 0] - a[2, 2], a[1, 2] + a[2, 1], a[0, 2] - a[2, 0]],
            [a[0, 2] + a[2, 0], a[1, 2] + a[2, 1], a[2, 2] - a[0, 0] - a[1, 1], a[1, 0] - a[0, 1]],
            [a[2, 1] - a[1, 2], a[0, 2] - a[2, 0], a[1, 0] - a[0, 1], a[0, 0] + a[1, 1] + a[2, 2]],
        ]
    )
    quaternion: NDArray[np.float64] = np.linalg.eigh(k)[1][:, 3]
    return quaternion
