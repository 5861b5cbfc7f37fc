"""Segmented images: voxels with labels, and where they are in the patient."""

from __future__ import annotations

import operator
import os
import struct
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pliant import _native
from pliant._arrays import fixed, numbers
from pliant.mesh import Mesh, _meshed

__all__ = ["Image", "Label"]

_LPS_TO_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


class Label(NamedTuple):
    """A label of an image: its name, if known, its voxels, and their volume [m³]."""

    name: str | None
    voxels: int
    volume: float


class Image:
    """Voxels ``array[i, j, k]`` with an affine matrix to metres of the patient: x to the right, y to the front, z to the head.

    Parameters
    ----------
    array
        Labels or values, (i, j, k).
    affine
        (4, 4): from (i, j, k, 1) to metres.

    Examples
    --------
    >>> import numpy as np
    >>> i, j, k = np.mgrid[0:20, 0:20, 0:20]
    >>> ball = ((i - 9.5) ** 2 + (j - 9.5) ** 2 + (k - 9.5) ** 2 < 64).astype(np.uint8)
    >>> image = Image(ball, np.diag([2e-3, 2e-3, 2e-3, 1.0]))
    >>> image.labels()[1].voxels
    2176
    >>> Mesh.of_image(image, 1, edge=8e-3).cells["tetra"].shape[0] > 50
    True
    """

    def __init__(self, array: ArrayLike, affine: ArrayLike) -> None:
        values = np.asarray(array)
        if values.dtype.kind not in "biuf":
            raise ValueError(f"an image must hold numbers, not {values.dtype}")
        if values.ndim != 3 or 0 in values.shape:
            raise ValueError(f"an image has shape {values.shape}, expected (i, j, k)")
        self.array: NDArray[Any] = fixed(np.array(values))
        self.affine: NDArray[np.float64] = numbers(affine, "the affine matrix", (4, 4))
        if not np.allclose(self.affine[3], [0, 0, 0, 1]):
            raise ValueError(f"the last row of the affine matrix is {self.affine[3]}, expected (0, 0, 0, 1)")
        self._names: dict[int, str] = {}

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Image:
        """Reads an image of any format that ``pliant labels`` knows: NIfTI, NRRD, MetaImage, GIPL, DICOM."""
        values, dims, affine, names = _native.read_image(os.fspath(path))
        if bool((values == np.rint(values)).all()) and np.abs(values).max(initial=0.0) < 2**31:
            values = values.astype(np.int32)
        image = cls(values.reshape(dims, order="F"), [*affine, [0.0, 0.0, 0.0, 1.0]])
        image._names = dict(names)
        return image

    @classmethod
    def from_nibabel(cls, image: Any) -> Image:
        """From an image of nibabel, in the unit that its header names; in millimetres, if it names none."""
        units = getattr(image.header, "get_xyzt_units", lambda: ("mm", "sec"))()[0]
        metres = {"meter": 1.0, "micron": 1e-6}.get(units, 1e-3)
        return cls(np.asanyarray(image.dataobj), np.diag([metres, metres, metres, 1.0]) @ np.asarray(image.affine))

    @classmethod
    def from_sitk(cls, image: Any) -> Image:
        """From an image of SimpleITK, which is in millimetres with x to the left and y to the back."""
        import importlib

        sitk = importlib.import_module("SimpleITK")
        turn = np.array(image.GetDirection()).reshape(3, 3) * np.array(image.GetSpacing())
        affine = np.eye(4)
        affine[:3, :3], affine[:3, 3] = turn, image.GetOrigin()
        to_metres = np.diag([1e-3, 1e-3, 1e-3, 1.0])
        return cls(np.transpose(sitk.GetArrayFromImage(image)), to_metres @ _LPS_TO_RAS @ affine)

    def labels(self) -> dict[int, Label]:
        """The labels except 0, with their voxels. Values are rounded as for a mesh: a value more than 1e-4 from a whole number is a `MeshError`."""
        size = float(abs(np.linalg.det(self.affine[:3, :3])))
        return {label: Label(self._names.get(label), count, count * size) for label, count in self._own.labels()}

    def _mesh(self, labels: Sequence[int], edge: float, kind: str, clean: Mapping[str, Any] | None) -> Mesh:
        table: dict[str, Any] = {"image": self, "labels": [operator.index(label) for label in labels]}
        table |= {"edge": float(edge), "as": kind}
        if clean is not None:
            table["clean"] = dict(clean)
        return _meshed(table, {})

    @property
    def _own(self) -> _native.Image:
        """A copy of the engine's."""
        number = self.array.dtype
        if number.kind == "b":
            number = np.dtype(np.uint8)
        elif number.kind == "f" and number.itemsize not in (4, 8):
            number = np.dtype(np.float64)
        values = self.array.astype(number.newbyteorder("<"), copy=False)
        affine = [[float(x) for x in row] for row in self.affine[:3]]
        names = list(self._names.items())
        return _native.Image(values.tobytes(order="F"), number.name, self.array.shape, affine, names)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the image as NIfTI-1 of 32-bit integers, the affine matrix in millimetres (`sform`). Values are rounded as for a mesh."""
        whole = np.rint(self.array)
        if not bool((np.abs(whole - self.array) <= 1e-4).all()) or float(np.abs(whole).max()) >= 2**31:
            raise ValueError("the values of an image must be labels: whole numbers below 2³¹")
        if max(self.array.shape) >= 2**15:
            raise ValueError(f"NIfTI-1 allows at most 32,767 voxels along an axis, not {max(self.array.shape)}")
        header = bytearray(352)
        struct.pack_into("<i", header, 0, 348)
        struct.pack_into("<8h", header, 40, 3, *self.array.shape, 1, 1, 1, 1)
        struct.pack_into("<2h", header, 70, 8, 32)
        steps = np.linalg.norm(self.affine[:3, :3], axis=0) * 1e3
        struct.pack_into("<8f", header, 76, 1.0, *steps, 1.0, 1.0, 1.0, 1.0)
        struct.pack_into("<3f", header, 108, 352.0, 1.0, 0.0)
        header[123] = 2
        struct.pack_into("<2h", header, 252, 0, 1)
        for row in range(3):
            struct.pack_into("<4f", header, 280 + 16 * row, *(self.affine[row] * 1e3))
        header[344:348] = b"n+1\0"
        with open(path, "wb") as file:
            file.write(header)
            file.write(np.asarray(whole, dtype="<i4").tobytes(order="F"))

    def __repr__(self) -> str:
        steps = np.linalg.norm(self.affine[:3, :3], axis=0) * 1e3
        shape = " × ".join(str(n) for n in self.array.shape)
        return f"Image({shape} voxels of {' × '.join(f'{s:.3g}' for s in steps)} mm)"
