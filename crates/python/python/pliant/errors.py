"""Errors of Pliant, each with its place. Every error is also the built-in exception that Python users expect.

>>> issubclass(SceneError, ValueError) and issubclass(SceneError, Error)
True
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pliant.result import History

__all__ = [
    "BlockedError",
    "BusyError",
    "ClosedError",
    "ClusterError",
    "ConvergenceError",
    "DeviceError",
    "Diagnostic",
    "Error",
    "InternalError",
    "MeshError",
    "OutputError",
    "PliantWarning",
    "ResumeError",
    "SceneError",
    "SimulationError",
    "UnstableError",
]


class PliantWarning(UserWarning):
    """A model or a result that is questionable; nothing was stopped."""


@dataclass(frozen=True)
class Diagnostic:
    """A finding about a scene.

    `line` and `column` count from 1 in the text of the scene; `key` is the path of the key, such as ``law.tissue.young-modulus``.
    """

    severity: str
    message: str
    file: str
    line: int | None
    column: int | None
    key: str | None
    label: str
    help: str | None

    def __str__(self) -> str:
        place = self.file if self.line is None else f"{self.file}:{self.line}:{self.column}"
        advice = f" ({self.help})" if self.help else ""
        return f"{place}: {self.severity}: {self.message}{advice}"


class Error(Exception):
    """The base of all errors of Pliant."""

    _fields: tuple[str, ...] = ()

    def __init__(self, message: str, **fields: Any) -> None:
        super().__init__(message)
        for name in self._fields:
            setattr(self, name, fields.get(name))

    def __reduce__(self) -> tuple[Any, ...]:
        fields = {name: getattr(self, name) for name in self._fields}
        return _again, (type(self), str(self), fields)


def _again(kind: type[Error], message: str, fields: dict[str, Any]) -> Error:
    return kind(message, **fields)


class SceneError(Error, ValueError):
    """A scene with mistakes: `diagnostics` lists all mistakes, and the text shows the lines."""

    _fields: tuple[str, ...] = ("diagnostics",)
    diagnostics: Sequence[Diagnostic]


class MeshError(Error, ValueError):
    """A mesh or an image that cannot be read, repaired or meshed."""

    _fields: tuple[str, ...] = ("path", "line", "place")
    path: str | None
    line: int | None
    place: Sequence[float] | None


class SimulationError(Error, RuntimeError):
    """A simulation that cannot continue. It stays at the last good instant; `time` is in s. After `Simulation.run`, `history` has the samples until then."""

    _fields: tuple[str, ...] = ("kind", "body", "element", "node", "time")
    kind: str
    body: str | None
    element: int | None
    node: int | None
    time: float | None
    history: History | None = None


class UnstableError(SimulationError):
    """A step that was too long, an inverted element, or energy from nowhere."""


class ConvergenceError(SimulationError):
    """Equations that were not solved, in a load step counted from 1."""

    _fields: tuple[str, ...] = (*SimulationError._fields, "load_step", "residual")
    load_step: int | None
    residual: float | None


class BlockedError(ConvergenceError):
    """A tool or moved nodes with something in their way: `driver` is their name, `force` their last push [N]."""

    _fields: tuple[str, ...] = (*ConvergenceError._fields, "driver", "force")
    driver: str | None
    force: float | None


class DeviceError(Error, RuntimeError):
    """No graphics adapter fits the request; the text names the packages to install."""

    _fields: tuple[str, ...] = ("adapter",)
    adapter: str | None


class OutputError(Error, OSError):
    """A file or folder that cannot be written."""

    _fields: tuple[str, ...] = ("path",)
    path: str | None


class ResumeError(Error, ValueError):
    """A state or a checkpoint of another model."""

    _fields: tuple[str, ...] = ("path",)
    path: str | None


class BusyError(Error, RuntimeError):
    """A call during another call, from a callback, or after a fork."""


class ClosedError(Error, RuntimeError):
    """A call after `close`."""


class ClusterError(Error, RuntimeError):
    """Workers with another version, or an engine that does not exist."""

    _fields: tuple[str, ...] = ("hosts",)
    hosts: Sequence[str] | None


class InternalError(Error, RuntimeError):
    """An error in Pliant itself. It ends this simulation; others continue."""
