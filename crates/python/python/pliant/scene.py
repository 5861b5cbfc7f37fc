"""Scenes: models and their run as plain data."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, MutableMapping
from copy import deepcopy
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from pliant import _native, _toml
from pliant._arrays import numbers
from pliant._table import Table
from pliant.errors import Diagnostic
from pliant.image import Image
from pliant.mesh import Mesh, _table

if TYPE_CHECKING:
    from pliant.model import Model
    from pliant.result import Result

__all__ = ["Scene", "load"]

_NAMED = (
    "participant",
    "law",
    "body",
    "tie",
    "surface",
    "constraint",
    "load",
    "obstacle",
    "tool",
    "contact",
    "output",
)


class Scene:
    """A scene to simulate: laws, bodies, constraints, loads, tools, outputs. It is plain data and can be changed at any time.

    The tables are the tables of a scene file: `scene.body["liver"]` is ``[body.liver]``; values are dictionaries as in the file, or the
    classes of `pliant.tables`. One value is found by its path: ``scene["law.tissue.young-modulus"]``.

    Parameters
    ----------
    until
        Duration [s].
    title
        Title of the scene.
    gravity
        Acceleration [m/s²], three numbers.
    run
        Solver, steps and device: the keys of ``[run]``.
    folder
        Folder that file names are relative to.

    Examples
    --------
    >>> scene = Scene(until=0.1, gravity=(0, 0, -9.81))
    >>> scene.law["tissue"] = {"type": "neo-hookean", "young-modulus": 3e3, "poisson-ratio": 0.45}
    >>> scene.body["block"] = {"mesh": Mesh.block([0.1, 0.1, 0.1], edge=0.05), "law": "tissue", "density": 1000.0}
    >>> scene.constraint["base"] = {"type": "fix", "body": "block", "nodes": {"set": "z-min"}}
    >>> scene
    Scene('', 0.1 s, 1 body, 1 law, 1 constraint)
    >>> scene.build()
    Model(1 body, 27 nodes, step 0.00909 s)
    """

    folder: str

    def __init__(
        self,
        *,
        until: float,
        title: str = "",
        gravity: ArrayLike | None = None,
        run: Table | Mapping[str, Any] | None = None,
        folder: str | os.PathLike[str] = ".",
    ) -> None:
        top: dict[str, Any] = {"title": title, "until": float(until)} if title else {"until": float(until)}
        if gravity is not None:
            top["gravity"] = [float(g) for g in numbers(gravity, "gravity", (3,))]
        self._data: dict[str, Any] = {"scene": top}
        if run is not None:
            self._data["run"] = _plain(run, {}, "run")
        self._origin: tuple[str, str] | None = None
        self._pristine: dict[str, Any] = {}
        self._set: dict[str, Any] = {}
        self._given: dict[str, Mesh | Image] = {}
        self.folder = os.fspath(folder)

    @classmethod
    def from_toml(cls, text: str, *, folder: str | os.PathLike[str] = ".", name: str = "scene.toml") -> Scene:
        """The scene of a text; `name` stands in messages, and file names are relative to `folder`."""
        scene = cls.__new__(cls)
        scene._data = _native.parse(text, name)
        scene._origin = (text, name)
        scene._pristine = deepcopy(scene._data)
        scene._set, scene._given = {}, {}
        scene.folder = os.fspath(folder)
        return scene

    @classmethod
    def of_mesh(cls, mesh: Mesh) -> Scene:
        """Soft tissue in the shape of a mesh, held at its lowest tenth, as for a mesh that is dropped on the window.

        >>> Scene.of_mesh(Mesh.block([0.1, 0.05, 0.05], edge=0.025)).constraint["held"]["type"]
        'fix'
        """
        scene = cls.from_toml(_native.scene_of_mesh(mesh._own, "mesh"))
        scene._given["mesh"] = mesh
        return scene

    def _tables(self, kind: str) -> MutableMapping[str, Any]:
        tables = self._data.setdefault(kind, {})
        if not isinstance(tables, MutableMapping):
            raise TypeError(f"`{kind}` of the scene is not a table")
        return tables

    @property
    def law(self) -> MutableMapping[str, Any]:
        """Laws of tissue, by name."""
        return self._tables("law")

    @property
    def body(self) -> MutableMapping[str, Any]:
        """Bodies, by name; ``mesh`` may be a `Mesh`, and its ``image`` an `Image`."""
        return self._tables("body")

    @property
    def surface(self) -> MutableMapping[str, Any]:
        """Carried surfaces, by name."""
        return self._tables("surface")

    @property
    def constraint(self) -> MutableMapping[str, Any]:
        """Constraints, by name."""
        return self._tables("constraint")

    @property
    def load(self) -> MutableMapping[str, Any]:
        """Loads, by name."""
        return self._tables("load")

    @property
    def tie(self) -> MutableMapping[str, Any]:
        """Ties between bodies, by name."""
        return self._tables("tie")

    @property
    def obstacle(self) -> MutableMapping[str, Any]:
        """Rigid obstacles, by name."""
        return self._tables("obstacle")

    @property
    def tool(self) -> MutableMapping[str, Any]:
        """Tools, by name."""
        return self._tables("tool")

    @property
    def contact(self) -> MutableMapping[str, Any]:
        """Contacts, by name."""
        return self._tables("contact")

    @property
    def participant(self) -> MutableMapping[str, Any]:
        """Participants, by name."""
        return self._tables("participant")

    @property
    def output(self) -> MutableMapping[str, Any]:
        """Outputs of runs with files, by name."""
        return self._tables("output")

    @property
    def run_table(self) -> MutableMapping[str, Any]:
        """The keys of ``[run]``: solver, steps and device."""
        return self._tables("run")

    @property
    def view(self) -> MutableMapping[str, Any]:
        """The keys of ``[view]``: the look of pictures."""
        return self._tables("view")

    @property
    def title(self) -> str:
        """Title of the scene."""
        return str(self._data.get("scene", {}).get("title", ""))

    @property
    def until(self) -> float:
        """Duration [s]."""
        return float(self._data["scene"]["until"])

    def __getitem__(self, key: str) -> Any:
        found: Any = self._data
        for part in _path(key):
            try:
                found = _opened(found)
                found = found[int(part)] if isinstance(found, (list, tuple, np.ndarray)) else found[part]
            except (KeyError, IndexError, ValueError, TypeError):
                raise KeyError(f"the scene has no `{key}`") from None
        return found

    def __setitem__(self, key: str, value: object) -> None:
        parts = _path(key)
        plain = _plain(value, self._given, key)
        for tree in (self._data, self._pristine):
            if tree is self._pristine and self._origin is None:
                continue
            branch: Any = tree
            for part in parts[:-1]:
                branch = _inner(branch, part, key)
            try:
                branch[int(parts[-1]) if isinstance(branch, list) else parts[-1]] = deepcopy(plain)
            except (IndexError, ValueError):
                raise KeyError(f"the scene has no `{key}`") from None
        if self._origin is not None:
            self._set = {known: setting for known, setting in self._set.items() if not known.startswith(f"{key}.")}
            self._set[key] = plain

    def replace(self, values: Mapping[str, object]) -> Scene:
        """A copy with other values, by their paths.

        >>> scene = Scene(until=1.0)
        >>> scene.replace({"scene.until": 2.0}).until, scene.until
        (2.0, 1.0)
        """
        copy = self.copy()
        for key, value in values.items():
            copy[key] = value
        return copy

    def copy(self) -> Scene:
        """A copy that shares meshes and images."""
        copy = Scene.__new__(Scene)
        memo = {id(given): given for given in _given_in(self._data)}
        copy._data = deepcopy(self._data, memo)
        copy._pristine = deepcopy(self._pristine, memo)
        copy._origin, copy._set, copy._given = self._origin, dict(self._set), dict(self._given)
        copy.folder = self.folder
        return copy

    def _handed(self) -> _native._Scene:
        """What the engine reads: text, its name, the folder, what is set; and the meshes and images from memory."""
        given = dict(self._given)
        if self._origin is not None and self._data == self._pristine:
            text, name = self._origin
            sets = [f"{key} = {_toml.value(value)}" for key, value in self._set.items()]
        else:
            plain = {kind: _plain(table, given, kind) for kind, table in self._data.items()}
            name, sets = "scene.toml" if self._origin is None else self._origin[1], []
            text = _toml.document({k: v for k, v in plain.items() if v}, _NAMED)
        meshes = {name: mesh._own for name, mesh in given.items() if isinstance(mesh, Mesh)}
        images = {name: image._own for name, image in given.items() if isinstance(image, Image)}
        return text, name, self.folder, sets, meshes, images

    def to_toml(self) -> str:
        """The text of the scene; meshes from memory stand as ``{ given = "NAME" }``, images as their names.

        >>> print(Scene(until=1.0, title="a block").to_toml(), end="")
        [scene]
        title = "a block"
        until = 1.0
        """
        plain = {kind: _plain(table, dict(self._given), kind) for kind, table in self._data.items()}
        return _toml.document({kind: table for kind, table in plain.items() if table}, _NAMED)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the scene to a file; meshes and images from memory go to the same folder, as VTU and NIfTI."""
        path = os.fspath(path)
        given = dict(self._given)
        plain = {kind: _plain(table, given, kind) for kind, table in self._data.items()}
        stem, folder = os.path.splitext(os.path.basename(path))[0], os.path.dirname(path)

        def written(name: str) -> str:
            source = given[name]
            file = f"{stem}-{name}.{'vtu' if isinstance(source, Mesh) else 'nii'}"
            source.write(os.path.join(folder, file))
            return file

        for body in plain.get("body", {}).values():
            table = body.get("mesh", {})
            if "given" in table:
                body["mesh"] = {"file": written(table.pop("given")), "scale": 1.0, **table}
            for key in ("image", "add"):
                if table.get(key) in given:
                    table[key] = written(table[key])
            if "masks" in table:
                table["masks"] = [written(mask) if mask in given else mask for mask in table["masks"]]
        with open(path, "w", encoding="utf-8") as file:
            file.write(_toml.document({kind: table for kind, table in plain.items() if table}, _NAMED))

    def check(self) -> list[Diagnostic]:
        """Builds the model, drops it and returns the warnings. Raises `SceneError` with all mistakes."""
        return _native.check(self._handed())

    def build(self, *, cache: bool = True, like: Model | None = None) -> Model:
        """Makes the model: meshes, masses, the critical time step.

        Parameters
        ----------
        cache
            If true, keeps meshes of images and surfaces from run to run, as the command line does.
        like
            A model whose meshes are taken for bodies with the same table ``mesh``.
        """
        from pliant.model import Model

        lent = {} if like is None else like._lends(self)
        native = _native.build(self._handed(), {name: mesh._own for name, mesh in lent.items()}, cache)
        return Model._of(self.copy(), native)

    def run(self, out: str | os.PathLike[str] | None = None, **options: Any) -> Result:
        """Builds the model and runs it to its end: see `Model.run`."""
        return self.build().run(out, **options)

    def _mesh_of(self, body: str) -> Mesh:
        native, _ = _native.mesh(self._handed(), body)
        return Mesh._of(native)

    def _counts(self) -> Iterator[tuple[int, str]]:
        for kind in _NAMED:
            count = len(self._data.get(kind, {}))
            if count:
                plural = "bodies" if kind == "body" else f"{kind}s"
                yield count, kind if count == 1 else plural

    def __repr__(self) -> str:
        order = sorted(self._counts(), key=lambda item: not item[1].startswith("bod"))
        counts = "".join(f", {count} {kind}" for count, kind in order)
        return f"Scene({self.title!r}, {self.until:g} s{counts})"

    def _repr_html_(self) -> str:
        return _table("Scene", {"title": self.title, "until [s]": self.until, **{k: n for n, k in self._counts()}})


def load(path: str | os.PathLike[str], *, set: Mapping[str, object] | None = None) -> Scene:
    """Reads a scene file, or the ``scene.toml`` of a folder; `set` gives values by their paths, as ``--set`` does.

    >>> load("nowhere")
    Traceback (most recent call last):
    ...
    FileNotFoundError: [Errno 2] there is no scene: 'nowhere'
    """
    path = os.fspath(path)
    if not os.path.exists(path):
        raise FileNotFoundError(2, "there is no scene", path)
    text, name, folder = _native.read(path)
    scene = Scene.from_toml(text, folder=folder, name=name)
    for key, value in (set or {}).items():
        scene[key] = value
    return scene


def _path(key: str) -> list[str]:
    parts = key.split(".")
    if not all(parts):
        raise KeyError(f"`{key}` is not the path of a value, such as law.tissue.young-modulus")
    return parts


def _opened(value: Any) -> Any:
    """The plain table of a class of `pliant.tables`; anything else as it is."""
    return value.to_dict() if isinstance(value, Table) else value


def _inner(parent: Any, part: str, key: str) -> Any:
    """The table or list at a part of a path, which can be written into: classes of tables, which are constant, become plain tables."""
    at: Any = int(part) if isinstance(parent, list) and part.lstrip("-").isdigit() else part
    try:
        inner = parent[at] if isinstance(parent, list) else parent.get(at)
    except (IndexError, TypeError):
        raise KeyError(f"the scene has no `{key}`") from None
    if inner is None:
        inner = {}
    elif isinstance(inner, Table):
        inner = deepcopy(inner.to_dict(), {id(given): given for given in _given_in(inner)})
    elif isinstance(inner, (tuple, np.ndarray)):
        inner = list(inner)
    elif not isinstance(inner, (list, MutableMapping)):
        raise KeyError(f"`{key}` lies inside a value that is not a table")
    parent[at] = inner
    return inner


def _plain(value: Any, given: dict[str, Mesh | Image], name: str) -> Any:
    """Plain data: tables as dictionaries, meshes and images as their names."""
    if isinstance(value, (Mesh, Image)):
        stem = name.removesuffix(".image").removesuffix(".mesh").split(".")[-1]
        taken = next((known for known, other in given.items() if other is value), None)
        if taken is None:
            taken, count = stem, 2
            while taken in given:
                taken, count = f"{stem}-{count}", count + 1
            given[taken] = value
        return {"given": taken, "scale": 1.0} if isinstance(value, Mesh) else taken
    if isinstance(value, Table):
        return _plain(value.to_dict(), given, name)
    if isinstance(value, Mapping):
        return {str(key): _plain(entry, given, f"{name}.{key}") for key, entry in value.items() if entry is not None}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (list, tuple)):
        return [_plain(element, given, name) for element in value]
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    raise TypeError(f"`{name}`: a scene holds numbers, texts, lists, tables, meshes and images, not {type(value).__name__}")


def _given_in(value: Any) -> Iterator[Mesh | Image]:
    if isinstance(value, (Mesh, Image)):
        yield value
    elif isinstance(value, Table):
        yield from _given_in(value.to_dict())
    elif isinstance(value, (Mapping, list, tuple)):
        for element in value.values() if isinstance(value, Mapping) else value:
            yield from _given_in(element)
