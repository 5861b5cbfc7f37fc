"""Meshes: points and cells, from arrays, files, shapes and images."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pliant import _native
from pliant._arrays import fixed, indices, numbers

if TYPE_CHECKING:
    import meshio
    import pyvista

    from pliant.image import Image

__all__ = ["Mesh"]

_CORNERS = {"vertex": 1, "line": 2, "triangle": 3, "quad": 4, "tetra": 4, "hexahedron": 8, "wedge": 6, "pyramid": 5}
_VTK = {"vertex": 1, "line": 3, "triangle": 5, "quad": 9, "tetra": 10, "hexahedron": 12, "wedge": 13, "pyramid": 14}
_SET = "set:"
_NAMES = "label-names"
# VTK's cells along the axes have other orders of corners.
_REORDERED = {8: ("quad", [0, 1, 3, 2]), 11: ("hexahedron", [0, 1, 3, 2, 4, 5, 7, 6])}


class Mesh:
    """Points and cells, which do not change.

    Parameters
    ----------
    points
        Places [m], (n, 3).
    cells
        Corners of the cells by kind: ``"tetra"`` (k, 4), ``"hexahedron"`` (k, 8), ``"triangle"`` (k, 3), ``"quad"`` (k, 4),
        ``"line"`` (k, 2), numbered as VTK and meshio do. ``"wedge"`` (k, 6) and ``"pyramid"`` (k, 5) become tetrahedra, and so do
        hexahedra that share faces with them.
    point_data, cell_data
        Values by name: (n,) or (n, c) for points; for cells in the order of `cells`, one kind after another.
    point_sets, cell_sets
        Named sets of points, and of cells counted over all kinds, which scenes name as ``{ set = "NAME" }``.
    label_names
        Names of the numbers that cell data ``label`` has.
    scale
        Size of one unit of `points` in metres.

    Examples
    --------
    >>> mesh = Mesh([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], {"tetra": [[0, 1, 2, 3]]})
    >>> mesh
    Mesh(4 points, 1 tetra)
    """

    _own: _native.Mesh

    def __init__(
        self,
        points: ArrayLike,
        cells: Mapping[str, ArrayLike],
        *,
        point_data: Mapping[str, ArrayLike] | None = None,
        cell_data: Mapping[str, ArrayLike] | None = None,
        point_sets: Mapping[str, ArrayLike] | None = None,
        cell_sets: Mapping[str, ArrayLike] | None = None,
        label_names: Mapping[int, str] | None = None,
        scale: float = 1.0,
    ) -> None:
        places = numbers(points, "points", (None, 3)) * float(scale)
        count = len(places)
        if count == 0:
            raise ValueError("a mesh needs points")
        blocks = []
        for kind, corners in cells.items():
            if kind not in _CORNERS:
                raise ValueError(f"unknown kind of cells `{kind}`; known kinds: {', '.join(_CORNERS)}")
            blocks.append((kind, indices(corners, f"corners of `{kind}`", (None, _CORNERS[kind]), count)))
        total = sum(len(corners) for _, corners in blocks)
        by_point = [(name, _columns(values, f"point data `{name}`", count)) for name, values in (point_data or {}).items()]
        by_cell = []
        for name, values in (cell_data or {}).items():
            all_values, first = _columns(values, f"cell data `{name}`", total), 0
            for kind, corners in blocks:
                part = np.ascontiguousarray(all_values[first : first + len(corners)])
                # Data that a kind of cells does not have are NaN there, as in files.
                if len(blocks) == 1 or not np.isnan(part).all():
                    by_cell.append((kind, name, part))
                first += len(corners)
        sets = [(name, indices(members, f"points of the set `{name}`", (None,), count)) for name, members in (point_sets or {}).items()]
        of_cells = []
        for name, members in (cell_sets or {}).items():
            chosen, first = indices(members, f"cells of the set `{name}`", (None,), total), 0
            for kind, corners in blocks:
                here = chosen[(chosen >= first) & (chosen < first + len(corners))] - np.uint32(first)
                if len(here) or not (len(chosen) or first):
                    of_cells.append((kind, name, here))
                first += len(corners)
        names = {operator.index(number): str(name) for number, name in (label_names or {}).items()}
        self._own = _native.Mesh(places, blocks, by_point, by_cell, sets, of_cells, names)

    @classmethod
    def _of(cls, native: _native.Mesh) -> Mesh:
        mesh = cls.__new__(cls)
        mesh._own = native
        return mesh

    @property
    def points(self) -> NDArray[np.float64]:
        """Places [m], (n, 3)."""
        points: NDArray[np.float64] = self._kept("_points", lambda: fixed(self._own.points()))
        return points

    @property
    def cells(self) -> Mapping[str, NDArray[np.uint32]]:
        """Corners of the cells by kind."""
        make = lambda: MappingProxyType({k: fixed(v) for k, v in self._own.cells().items()})  # noqa: E731
        cells: Mapping[str, NDArray[np.uint32]] = self._kept("_cells", make)
        return cells

    @property
    def point_data(self) -> Mapping[str, NDArray[np.float64]]:
        """Values of points by name: (n,), (n, 3) or (n, 3, 3)."""
        make = lambda: MappingProxyType({k: fixed(_shaped(v)) for k, v in self._own.point_data().items()})  # noqa: E731
        data: Mapping[str, NDArray[np.float64]] = self._kept("_point_data", make)
        return data

    @property
    def cell_data(self) -> Mapping[str, NDArray[np.float64]]:
        """Values of cells by name, one kind of cells after another; NaN where a kind has no values."""
        data: Mapping[str, NDArray[np.float64]] = self._kept("_cell_data", self._gather)
        return data

    @property
    def point_sets(self) -> Mapping[str, NDArray[np.uint32]]:
        """Named sets of points, and the points of named sets of cells."""
        make = lambda: MappingProxyType({k: fixed(v) for k, v in self._own.point_sets(True).items()})  # noqa: E731
        sets: Mapping[str, NDArray[np.uint32]] = self._kept("_point_sets", make)
        return sets

    @property
    def cell_sets(self) -> Mapping[str, NDArray[np.uint32]]:
        """Named sets of cells, counted over all kinds."""

        def make() -> Mapping[str, NDArray[np.uint32]]:
            counts = [len(corners) for corners in self.cells.values()]
            first = dict(zip(self.cells, np.cumsum([0, *counts]).tolist(), strict=False))
            sets: dict[str, list[NDArray[np.uint32]]] = {}
            for name, kind, members in self._own.cell_sets():
                sets.setdefault(name, []).append(members + np.uint32(first[kind]))
            return MappingProxyType({name: fixed(np.concatenate(parts)) for name, parts in sets.items()})

        found: Mapping[str, NDArray[np.uint32]] = self._kept("_cell_sets", make)
        return found

    @property
    def label_names(self) -> dict[int, str]:
        """Names of the labels of cells, if known."""
        return self._own.label_names()

    def _kept(self, name: str, make: Any) -> Any:
        if name not in self.__dict__:
            self.__dict__[name] = make()
        return self.__dict__[name]

    def _gather(self) -> Mapping[str, NDArray[np.float64]]:
        found = self._own.cell_data()
        by_name: dict[str, dict[str, NDArray[np.float64]]] = {}
        for name, kind, values in found:
            by_name.setdefault(name, {})[kind] = values
        gathered = {}
        for name, by_kind in by_name.items():
            columns = next(iter(by_kind.values())).shape[1]
            parts = [by_kind.get(kind, np.full((len(corners), columns), np.nan)) for kind, corners in self.cells.items()]
            gathered[name] = fixed(_shaped(np.concatenate(parts)))
        return MappingProxyType(gathered)

    @classmethod
    def read(cls, path: str | os.PathLike[str], *, scale: float = 1.0) -> Mesh:
        """Reads a mesh file of any format that ``pliant info`` knows; `scale` is the size of its unit in metres."""
        native, _ = _native.Mesh.read(os.fspath(path), float(scale))
        return cls._of(native)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the mesh; the ending selects the format (``.vtu``, ``.vtk``, ``.msh``, ``.stl``, …)."""
        self._own.write(os.fspath(path))

    @classmethod
    def block(
        cls,
        size: Sequence[float],
        *,
        edge: float | None = None,
        cells: Sequence[int] | None = None,
        kind: str = "tets",
    ) -> Mesh:
        """A box from the origin, of edges `size` [m]. Point sets: ``x-min``, ``x-max``, ``y-min``, …

        >>> Mesh.block([0.1, 0.1, 0.1], edge=0.05)
        Mesh(27 points, 48 tetra)
        """
        shape: dict[str, Any] = {"size": list(size)}
        if cells is not None:
            shape["cells"] = list(cells)
        return cls._shape("block", shape, edge, kind)

    @classmethod
    def tube(cls, *, edge: float, kind: str = "tets", **shape: Any) -> Mesh:
        """A tube along z from the origin, by the keys of ``tube`` in scenes (``inner_radius`` for ``inner-radius`` [m], …)."""
        return cls._shape("tube", shape, edge, kind)

    @classmethod
    def ellipsoid(cls, radii: Sequence[float], *, edge: float, kind: str = "tets") -> Mesh:
        """An ellipsoid about the origin, of radii [m]."""
        return cls._shape("ellipsoid", {"radii": list(radii)}, edge, kind)

    @classmethod
    def organ(cls, name: str, *, edge: float, kind: str = "tets") -> Mesh:
        """A built-in organ about the origin: ``"liver"``, ``"brain"``, …"""
        return cls._shape("organ", name, edge, kind)

    @classmethod
    def sphere(cls, radius: float, *, edge: float) -> Mesh:
        """A sphere of triangles about the origin, of a radius [m]."""
        return cls._shape("sphere", {"radius": radius}, edge, "triangles")

    @classmethod
    def cylinder(cls, radius: float, length: float, *, edge: float, **shape: Any) -> Mesh:
        """A cylinder of triangles about the z axis from z = 0, open at its ends [m]."""
        return cls._shape("cylinder", {"radius": radius, "length": length, **shape}, edge, "triangles")

    @classmethod
    def plate(cls, size: Sequence[float], *, edge: float, **shape: Any) -> Mesh:
        """A rectangle of triangles in the plane z = 0 from the origin, of edges `size` [m]."""
        return cls._shape("plate", {"size": list(size), **shape}, edge, "triangles")

    @classmethod
    def _shape(cls, name: str, shape: Any, edge: float | None, kind: str) -> Mesh:
        table: dict[str, Any] = {name: _dashed(shape)}
        if edge is not None:
            table["edge"] = float(edge)
        if kind not in ("tets", "triangles"):
            table["as"] = kind
        return _meshed(table, {}, shell=kind == "triangles")

    @classmethod
    def of_image(
        cls,
        image: Image,
        labels: int | Iterable[int],
        edge: float,
        *,
        kind: str = "tets",
        clean: Mapping[str, Any] | None = None,
    ) -> Mesh:
        """Cells of `edge` [m] in the voxels with the given labels of an image. Cell data ``label`` holds the label of each cell."""
        chosen = [labels] if isinstance(labels, (int, np.integer)) else list(labels)
        return image._mesh(chosen, edge, kind, clean)

    def of_surface(self, edge: float, *, kind: str = "tets") -> Mesh:
        """Cells of `edge` [m] inside the closed surface of this mesh."""
        return _meshed({"given": "surface", "as": kind, "edge": float(edge), "scale": 1.0}, {"surface": self})

    def decimate(self, triangles: int) -> Mesh:
        """Its closed surface with the given number of triangles, placed where the shape needs them."""
        table = {"given": "surface", "as": "surface", "triangles": int(triangles), "scale": 1.0}
        return _meshed(table, {"surface": self}, shell=True)

    def shells(self, count: int | None = None, *, error: float | None = None) -> Mesh:
        """Few curved shells fitted to its closed surface: `count` shells, or as many as keep within `error` of its diagonal."""
        table: dict[str, Any] = {"given": "surface", "as": "shells", "scale": 1.0}
        if count is not None:
            table["shells"] = int(count)
        if error is not None:
            table["error"] = float(error)
        return _meshed(table, {"surface": self}, shell=True)

    def to_pyvista(self) -> pyvista.UnstructuredGrid:
        """A copy for PyVista, with cells, data, sets and names of labels as they stand in ``.vtu`` files.

        Sets are arrays ``set:NAME`` of 0 and 1, names the field data ``label-names``.
        """
        pv = _extra("pyvista", "mesh")
        cells, kinds = [], []
        for kind, corners in self.cells.items():
            cells.append(np.hstack([np.full((len(corners), 1), corners.shape[1]), corners]).ravel())
            kinds.append(np.full(len(corners), _VTK[kind], dtype=np.uint8))
        grid: pyvista.UnstructuredGrid = pv.UnstructuredGrid(np.concatenate(cells), np.concatenate(kinds), self.points.copy())
        for name, values in self.point_data.items():
            grid.point_data[name] = _flat(values)
        for name, values in self.cell_data.items():
            grid.cell_data[name] = _as_label(name, _flat(values))
        for name, points in self._own.point_sets(False).items():
            grid.point_data[_SET + name] = _mask(points, grid.n_points)
        for name, members in self.cell_sets.items():
            grid.cell_data[_SET + name] = _mask(members, grid.n_cells)
        if self.label_names:
            grid.field_data[_NAMES] = _bytes_of(self.label_names)
        return grid

    @classmethod
    def from_pyvista(cls, grid: Any, *, scale: float = 1.0) -> Mesh:
        """Makes a mesh from a grid or a surface of PyVista, as from a ``.vtu`` file; `scale` is the size of its unit in metres.

        Arrays ``set:NAME`` become sets, the field data ``label-names`` the names of labels. Cells of kinds that a mesh does not have are a
        `ValueError`.
        """
        names = grid.field_data.get(_NAMES)
        grid = grid.cast_to_unstructured_grid()
        words = {number: word for word, number in _VTK.items()}
        cells: dict[str, Any] = {}
        order = []
        all_corners = grid.cells_dict
        numbers, firsts = np.unique(grid.celltypes, return_index=True)
        for number in numbers[np.argsort(firsts)]:
            corners = all_corners[number]
            kind = words.get(int(number), f"VTK type {number}")
            if int(number) in _REORDERED:
                kind, places = _REORDERED[int(number)]
                corners = corners[:, places]
            cells[kind] = np.concatenate([cells[kind], corners]) if kind in cells else corners
            order.append((kind, np.flatnonzero(grid.celltypes == number)))
        # Cells of one kind stand together, as the mesh has them.
        at = np.concatenate([rows for kind in cells for word, rows in order if word == kind]) if order else np.empty(0, int)
        by_cell = {name: np.asarray(grid.cell_data[name])[at] for name in grid.cell_data}
        by_point = {name: np.asarray(grid.point_data[name]) for name in grid.point_data}
        return cls._with_sets(grid.points, cells, by_point, by_cell, {}, {}, _names_of(names), scale)

    @classmethod
    def _with_sets(
        cls,
        points: Any,
        cells: dict[str, Any],
        point_data: dict[str, NDArray[Any]],
        cell_data: dict[str, NDArray[Any]],
        point_sets: dict[str, Any],
        cell_sets: dict[str, Any],
        names: dict[int, str],
        scale: float,
    ) -> Mesh:
        """A mesh whose arrays ``set:NAME`` are sets."""
        for data, sets in ((point_data, point_sets), (cell_data, cell_sets)):
            for name in [key for key in data if key.startswith(_SET) and data[key].ndim == 1]:
                sets[name.removeprefix(_SET)] = np.flatnonzero(data.pop(name))
        arrays: dict[str, Any] = {"point_data": point_data, "cell_data": cell_data, "point_sets": point_sets, "cell_sets": cell_sets}
        return cls(points, cells, **arrays, label_names=names, scale=scale)

    def to_meshio(self) -> meshio.Mesh:
        """A copy for meshio, with data, sets, and names of labels as the field data ``label-names``."""
        mio = _extra("meshio", "mesh")
        blocks = [(kind, np.array(corners)) for kind, corners in self.cells.items()]
        cell_data: dict[str, list[NDArray[np.float64]]] = {}
        for name, values in self.cell_data.items():
            ends = np.cumsum([len(corners) for _, corners in blocks])[:-1]
            cell_data[name] = [part.copy() for part in np.split(_as_label(name, values), ends)]
        data = {name: np.array(values) for name, values in self.point_data.items()}
        point_sets = {name: np.array(points) for name, points in self._own.point_sets(False).items()}
        cell_sets: dict[str, list[NDArray[np.uint32]]] = {}
        for name, kind, members in self._own.cell_sets():
            none = [np.empty(0, dtype=np.uint32) for _ in blocks]
            cell_sets.setdefault(name, none)[list(self.cells).index(kind)] = members
        names = {_NAMES: _bytes_of(self.label_names)} if self.label_names else {}
        arrays: dict[str, Any] = {"point_data": data, "cell_data": cell_data, "point_sets": point_sets, "cell_sets": cell_sets}
        return mio.Mesh(self.points.copy(), blocks, **arrays, field_data=names)

    @classmethod
    def from_meshio(cls, mesh: Any, *, scale: float = 1.0) -> Mesh:
        """Makes a mesh from a mesh of meshio, as from its file; `scale` is the size of its unit in metres.

        Arrays ``set:NAME`` become sets, the physical groups of Gmsh labels. Cells of kinds that a mesh does not have are a `ValueError`.
        """
        kinds = list(dict.fromkeys(block.type for block in mesh.cells))
        # Cells of one kind stand together, as the mesh has them.
        order = [k for kind in kinds for k, block in enumerate(mesh.cells) if block.type == kind]
        cells = {kind: np.concatenate([block.data for block in mesh.cells if block.type == kind]) for kind in kinds}
        by_cell = {name: np.concatenate([np.asarray(parts[k]) for k in order]) for name, parts in mesh.cell_data.items() if order}
        first = dict(zip(order, np.cumsum([0, *(len(mesh.cells[k].data) for k in order)]).tolist(), strict=False))
        cell_sets = {}
        for name, parts in mesh.cell_sets.items():
            here = [np.asarray(parts[k], dtype=np.int64) + first[k] for k in order if parts[k] is not None]
            cell_sets[name] = np.concatenate(here) if here else np.empty(0, dtype=np.int64)
        by_point, point_sets = {name: np.asarray(values) for name, values in mesh.point_data.items()}, dict(mesh.point_sets)
        _of_gmsh(by_cell, by_point, cell_sets)
        return cls._with_sets(mesh.points, cells, by_point, by_cell, point_sets, cell_sets, _names_of(mesh.field_data.get(_NAMES)), scale)

    def __repr__(self) -> str:
        kinds = ", ".join(f"{len(corners)} {kind}" for kind, corners in self.cells.items() if len(corners))
        return f"Mesh({len(self.points)} points, {kinds or 'no cells'})"

    def _repr_html_(self) -> str:
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        rows: dict[str, Any] = {"points": len(self.points), **{kind: len(corners) for kind, corners in self.cells.items()}}
        rows["size [m]"] = " × ".join(f"{x:.4g}" for x in high - low)
        return _table("Mesh", rows)

    def __reduce__(self) -> tuple[Any, ...]:
        cells = {kind: np.array(corners) for kind, corners in self.cells.items()}
        data = [{name: values.reshape(len(values), -1) for name, values in all_data.items()} for all_data in (self.point_data, self.cell_data)]
        sets = [self._own.point_sets(False), {name: np.array(members) for name, members in self.cell_sets.items()}]
        return _again, (np.array(self.points), cells, *data, *sets, self.label_names)


def _again(points: Any, cells: Any, point_data: Any, cell_data: Any, point_sets: Any, cell_sets: Any, label_names: Any) -> Mesh:
    arrays = {"point_data": point_data, "cell_data": cell_data, "point_sets": point_sets, "cell_sets": cell_sets}
    return Mesh(points, cells, **arrays, label_names=label_names)


def _flat(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """A copy of (n,) or (n, c)."""
    return values.copy() if values.ndim == 1 else values.reshape(len(values), -1).copy()


def _mask(members: NDArray[Any], count: int) -> NDArray[np.uint8]:
    mask = np.zeros(count, dtype=np.uint8)
    mask[members] = 1
    return mask


def _as_label(name: str, values: NDArray[Any]) -> NDArray[Any]:
    """Labels as integers, if all are whole."""
    whole = name == "label" and bool((values == np.rint(values)).all()) and bool((np.abs(values) < 2**31).all())
    return values.astype(np.int32) if whole else values


def _bytes_of(names: Mapping[int, str]) -> NDArray[np.uint8]:
    """Names as ``.vtu`` files have them: bytes of texts such as ``5 liver``, each ended by a 0."""
    return np.frombuffer("".join(f"{number} {name}\0" for number, name in names.items()).encode(), dtype=np.uint8).copy()


def _names_of(array: Any) -> dict[int, str]:
    """The names in such bytes, or in texts, as earlier versions wrote them."""
    if array is None:
        return {}
    entries = np.asarray(array).ravel()
    texts = entries.astype(np.uint8).tobytes().decode(errors="replace").split("\0") if entries.dtype.kind in "biu" else [str(text) for text in entries]
    pairs = [text.partition(" ") for text in texts]
    return {int(number): name for number, _, name in pairs if name and number.lstrip("-").isdecimal()}


def _of_gmsh(cell_data: dict[str, NDArray[Any]], point_data: dict[str, NDArray[Any]], cell_sets: dict[str, Any]) -> None:
    """Makes labels of the physical groups that meshio reads, or of the geometrical entities without any, as the reader of files does."""
    groups, entities = cell_data.pop("gmsh:physical", None), cell_data.pop("gmsh:geometrical", None)
    for sets in (point_data, cell_sets):
        for name in [key for key in sets if key.startswith("gmsh:")]:
            del sets[name]
    found = entities if groups is None else groups
    if found is not None and np.any(found):
        cell_data.setdefault("label", found)


def _columns(values: ArrayLike, what: str, count: int) -> NDArray[np.float64]:
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise ValueError(f"{what} must be numbers, not {array.dtype}")
    if array.shape[:1] != (count,):
        raise ValueError(f"{what} have shape {array.shape}, expected ({count}, …)")
    return np.ascontiguousarray(array.reshape(count, -1), dtype=np.float64)


def _shaped(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,), (n, 3) or (n, 3, 3)."""
    if values.shape[1] == 1:
        return values[:, 0]
    return values.reshape(-1, 3, 3) if values.shape[1] == 9 else values


def _dashed(shape: Any) -> Any:
    if isinstance(shape, Mapping):
        return {key.replace("_", "-"): _dashed(value) for key, value in shape.items()}
    return shape


def _meshed(table: Mapping[str, Any], meshes: Mapping[str, Mesh], *, shell: bool = False) -> Mesh:
    """The mesh that a body of a scene would have by a table."""
    from pliant.scene import Scene

    scene = Scene(until=1.0)
    body: dict[str, Any] = {"mesh": dict(table), "law": "tissue", "density": 1000.0}
    scene.body["mesh"] = body | ({"model": "shell", "thickness": 1e-3} if shell else {})
    scene._given.update(meshes)
    return scene._mesh_of("mesh")


def _extra(module: str, extra: str) -> Any:
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ImportError(f"{module} is not installed: `pip install 'pliant[{extra}]'`") from error


def _table(title: str, rows: Mapping[str, Any]) -> str:
    import html

    cells = "".join(f"<tr><th>{html.escape(str(k))}</th><td>{html.escape(str(v))}</td></tr>" for k, v in rows.items())
    return f"<table><caption>{html.escape(title)}</caption>{cells}</table>"
