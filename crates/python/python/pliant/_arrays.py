"""Checks of arrays that come in."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["fixed", "indices", "numbers", "shaped"]


def _plain(value: ArrayLike, what: str) -> NDArray[Any]:
    array = np.asarray(value)
    if array.dtype.kind not in "biuf":
        raise ValueError(f"{what} must be numbers, not {array.dtype}")
    return array


def shaped(value: ArrayLike, what: str, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """Numbers as float64 of a shape, in which `None` stands for any length."""
    array = _plain(value, what)
    wrong = len(array.shape) != len(shape) or any(w not in (None, h) for h, w in zip(array.shape, shape, strict=False))
    if wrong:
        wanted = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ("," if len(shape) == 1 else "") + ")"
        raise ValueError(f"{what} have shape {array.shape}, expected {wanted}")
    return np.ascontiguousarray(array, dtype=np.float64)


def numbers(value: ArrayLike, what: str, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """Finite numbers as float64 of a shape, in which `None` stands for any length."""
    result = shaped(value, what, shape)
    if not np.isfinite(result).all():
        at = np.argwhere(~np.isfinite(result))[0]
        raise ValueError(f"{what} are not finite at {tuple(int(k) for k in at)}")
    return result


def indices(value: ArrayLike, what: str, shape: tuple[int | None, ...], below: int) -> NDArray[np.uint32]:
    """Whole numbers from 0 to below a bound as uint32."""
    array = _plain(value, what)
    if array.size == 0:
        array = array.reshape(tuple(0 if n is None else n for n in shape))
    if len(array.shape) != len(shape) or any(w not in (None, h) for h, w in zip(array.shape, shape, strict=False)):
        wanted = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ")"
        raise ValueError(f"{what} have shape {array.shape}, expected {wanted}")
    if array.size and array.dtype.kind == "f" and not (array == np.floor(array)).all():
        raise ValueError(f"{what} are not whole numbers")
    if array.size and (array.min() < 0 or array.max() >= below):
        raise ValueError(f"{what} are {int(array.min())} to {int(array.max())}, but must be 0 to {below - 1}")
    return np.ascontiguousarray(array, dtype=np.uint32)


def fixed(array: NDArray[Any]) -> NDArray[Any]:
    """The same array, read-only."""
    array.flags.writeable = False
    return array
