"""Meshes: points and cells, from arrays, files, shapes and images."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
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
        Values by name: (n,) or (n, c) for points; for cells in the order of `cells`, all kinds after each other.
    point_sets
        Named sets of points, which scenes name as ``{ set = "NAME" }``.
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
        scale: float = 1.0,
    ) -> None:
        places = numbers(points, "points", (None, 3)) * float(scale)
        count = len(places)
        if count == 0:
            raise ValueError("a mesh needs points")
        blocks = []
        for kind, corners in cells.items():
            if kind not in _CORNERS:
                raise ValueError(f"there are no cells `{kind}`; there are {', '.join(_CORNERS)}")
            blocks.append((kind, indices(corners, f"corners of `{kind}`", (None, _CORNERS[kind]), count)))
        total = sum(len(corners) for _, corners in blocks)
        by_point = [(name, _columns(values, f"point data `{name}`", count)) for name, values in (point_data or {}).items()]
        by_cell = []
        for name, values in (cell_data or {}).items():
            all_values, first = _columns(values, f"cell data `{name}`", total), 0
            for kind, corners in blocks:
                by_cell.append((kind, name, np.ascontiguousarray(all_values[first : first + len(corners)])))
                first += len(corners)
        sets = [(name, indices(own, f"points of the set `{name}`", (None,), count)) for name, own in (point_sets or {}).items()]
        self._own = _native.Mesh(places, blocks, by_point, by_cell, sets)

    @classmethod
    def _of(cls, native: _native.Mesh) -> Mesh:
        mesh = cls.__new__(cls)
        mesh._own = native
        return mesh

    @property
    def points(self) -> NDArray[np.float64]:
        """Places [m], (n, 3)."""
        own: NDArray[np.float64] = self._kept("_points", lambda: fixed(self._own.points()))
        return own

    @property
    def cells(self) -> Mapping[str, NDArray[np.uint32]]:
        """Corners of the cells by kind."""
        make = lambda: MappingProxyType({k: fixed(v) for k, v in self._own.cells().items()})  # noqa: E731
        own: Mapping[str, NDArray[np.uint32]] = self._kept("_cells", make)
        return own

    @property
    def point_data(self) -> Mapping[str, NDArray[np.float64]]:
        """Values of points by name: (n,), (n, 3) or (n, 3, 3)."""
        make = lambda: MappingProxyType({k: fixed(_shaped(v)) for k, v in self._own.point_data().items()})  # noqa: E731
        own: Mapping[str, NDArray[np.float64]] = self._kept("_point_data", make)
        return own

    @property
    def cell_data(self) -> Mapping[str, NDArray[np.float64]]:
        """Values of cells by name, all kinds of cells after each other; NaN where a kind has none."""
        own: Mapping[str, NDArray[np.float64]] = self._kept("_cell_data", self._gather)
        return own

    @property
    def point_sets(self) -> Mapping[str, NDArray[np.uint32]]:
        """Named sets of points."""
        make = lambda: MappingProxyType({k: fixed(v) for k, v in self._own.point_sets().items()})  # noqa: E731
        own: Mapping[str, NDArray[np.uint32]] = self._kept("_point_sets", make)
        return own

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
        for name, own in by_name.items():
            columns = next(iter(own.values())).shape[1]
            parts = [own.get(kind, np.full((len(corners), columns), np.nan)) for kind, corners in self.cells.items()]
            gathered[name] = fixed(_shaped(np.concatenate(parts)))
        return MappingProxyType(gathered)

    @classmethod
    def read(cls, path: str | os.PathLike[str], *, scale: float = 1.0) -> Mesh:
        """Reads a mesh file of any format that ``pliant info`` knows; `scale` is the size of its unit in metres."""
        native, _ = _native.Mesh.read(os.fspath(path), float(scale))
        return cls._of(native)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes it; the ending tells the format (``.vtu``, ``.vtk``, ``.msh``, ``.stl``, …)."""
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
        labels: int | Sequence[int],
        edge: float,
        *,
        kind: str = "tets",
        clean: Mapping[str, Any] | None = None,
    ) -> Mesh:
        """Cells of `edge` [m] in what has one of the labels of an image. Each cell has its own as cell data ``label``."""
        return image._mesh([labels] if isinstance(labels, int) else list(labels), edge, kind, clean)

    def of_surface(self, edge: float, *, kind: str = "tets") -> Mesh:
        """Cells of `edge` [m] in what the closed surface of this mesh encloses."""
        return _meshed({"given": "surface", "as": kind, "edge": float(edge), "scale": 1.0}, {"surface": self})

    def decimate(self, triangles: int) -> Mesh:
        """Its closed surface with so many triangles, placed where the shape needs them."""
        table = {"given": "surface", "as": "surface", "triangles": int(triangles), "scale": 1.0}
        return _meshed(table, {"surface": self}, shell=True)

    def shells(self, count: int | None = None, *, error: float | None = None) -> Mesh:
        """Few curved shells fitted to its closed surface: `count` of them, or as many as keep within `error` of its diagonal."""
        table: dict[str, Any] = {"given": "surface", "as": "shells", "scale": 1.0}
        if count is not None:
            table["shells"] = int(count)
        if error is not None:
            table["error"] = float(error)
        return _meshed(table, {"surface": self}, shell=True)

    def to_pyvista(self) -> pyvista.UnstructuredGrid:
        """A copy for PyVista, with data and cells."""
        pv = _extra("pyvista", "mesh")
        cells, kinds = [], []
        for kind, corners in self.cells.items():
            cells.append(np.hstack([np.full((len(corners), 1), corners.shape[1]), corners]).ravel())
            kinds.append(np.full(len(corners), _VTK[kind], dtype=np.uint8))
        grid: pyvista.UnstructuredGrid = pv.UnstructuredGrid(np.concatenate(cells), np.concatenate(kinds), self.points.copy())
        for name, values in self.point_data.items():
            grid.point_data[name] = values.reshape(len(values), -1).squeeze().copy()
        for name, values in self.cell_data.items():
            grid.cell_data[name] = values.reshape(len(values), -1).squeeze().copy()
        return grid

    @classmethod
    def from_pyvista(cls, grid: Any) -> Mesh:
        """From a grid or a surface of PyVista; lengths are taken as metres. Cells of kinds that a mesh does not have are a `ValueError`."""
        grid = grid.cast_to_unstructured_grid()
        words = {number: word for word, number in _VTK.items()}
        cells: dict[str, Any] = {}
        order = []
        for number, corners in grid.cells_dict.items():
            kind = words.get(int(number), f"VTK type {number}")
            if int(number) in _REORDERED:
                kind, places = _REORDERED[int(number)]
                corners = corners[:, places]
            cells[kind] = np.concatenate([cells[kind], corners]) if kind in cells else corners
            order.append((kind, np.flatnonzero(grid.celltypes == number)))
        # Cells of one kind stand together, as the mesh has them.
        at = np.concatenate([own for kind in cells for word, own in order if word == kind]) if order else np.empty(0, int)
        by_cell = {name: np.asarray(grid.cell_data[name])[at] for name in grid.cell_data}
        by_point = {name: np.asarray(grid.point_data[name]) for name in grid.point_data}
        return cls(grid.points, cells, point_data=by_point, cell_data=by_cell)

    def to_meshio(self) -> meshio.Mesh:
        """A copy for meshio."""
        mio = _extra("meshio", "mesh")
        blocks = [(kind, np.array(corners)) for kind, corners in self.cells.items()]
        cell_data: dict[str, list[NDArray[np.float64]]] = {}
        for name, values in self.cell_data.items():
            ends = np.cumsum([len(corners) for _, corners in blocks])[:-1]
            cell_data[name] = [part.copy() for part in np.split(values, ends)]
        data = {name: np.array(values) for name, values in self.point_data.items()}
        return mio.Mesh(self.points.copy(), blocks, point_data=data, cell_data=cell_data)

    @classmethod
    def from_meshio(cls, mesh: Any, *, scale: float = 1.0) -> Mesh:
        """From a mesh of meshio; `scale` is the size of its unit in metres. Cells of kinds that a mesh does not have are a `ValueError`."""
        cells: dict[str, Any] = {}
        for block in mesh.cells:
            before = cells.get(block.type)
            cells[block.type] = block.data if before is None else np.concatenate([before, block.data])
        by_cell: dict[str, Any] = {}
        for name, parts in mesh.cell_data.items():
            own = [np.asarray(part) for kind in cells for block, part in zip(mesh.cells, parts, strict=True) if block.type == kind]
            by_cell[name] = np.concatenate(own) if own else np.empty(0)
        return cls(mesh.points, cells, point_data=dict(mesh.point_data), cell_data=by_cell, scale=scale)

    def __repr__(self) -> str:
        kinds = ", ".join(f"{len(corners)} {kind}" for kind, corners in self.cells.items() if len(corners))
        return f"Mesh({len(self.points)} points, {kinds or 'no cells'})"

    def _repr_html_(self) -> str:
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        rows: dict[str, Any] = {"points": len(self.points), **{kind: len(own) for kind, own in self.cells.items()}}
        rows["size [m]"] = " × ".join(f"{x:.4g}" for x in high - low)
        return _table("Mesh", rows)

    def __reduce__(self) -> tuple[Any, ...]:
        sets = {name: np.array(own) for name, own in self.point_sets.items()}
        points, cells = np.array(self.points), {kind: np.array(own) for kind, own in self.cells.items()}
        data = {name: np.array(own) for name, own in self.point_data.items()}
        return _again, (points, cells, data, {name: np.array(own) for name, own in self.cell_data.items()}, sets)


def _again(points: Any, cells: Any, point_data: Any, cell_data: Any, point_sets: Any) -> Mesh:
    flat = {k: v.reshape(len(v), -1) for k, v in point_data.items()}
    by_cell = {k: v.reshape(len(v), -1) for k, v in cell_data.items()}
    return Mesh(points, cells, point_data=flat, cell_data=by_cell, point_sets=point_sets)


def _columns(values: ArrayLike, what: str, count: int) -> NDArray[np.float64]:
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise ValueError(f"{what} hold {array.dtype}, numbers are wanted")
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
