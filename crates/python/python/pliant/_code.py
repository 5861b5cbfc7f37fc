"""A text that changes with the code of a function."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import pickle
import types
from collections.abc import Mapping
from typing import Any

import numpy as np

__all__ = ["code_of"]


def code_of(function: Any) -> str:
    """A hash of a function: its code, its defaults and closure, and the functions and plain values of its module that it names.

    >>> code_of(lambda r: r + 1) == code_of(lambda r: r + 1), code_of(lambda r: r + 1) == code_of(lambda r: r + 2)
    (True, False)
    """
    digest = hashlib.sha256()
    for part in _parts(function, set()):
        digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()


def _parts(value: Any, seen: set[int]) -> list[bytes]:
    """Everything that a value is made of."""
    if id(value) in seen:
        return []
    if isinstance(value, types.FunctionType):
        seen.add(id(value))
        parts = _of_code(value.__code__, seen)
        for defaults in (value.__defaults__, value.__kwdefaults__):
            parts += _parts(defaults, seen)
        for cell in value.__closure__ or ():
            parts += _parts(cell.cell_contents, seen) if _filled(cell) else []
        for name in sorted(_names(value.__code__)):
            named = value.__globals__.get(name)
            if isinstance(named, types.FunctionType) and named.__module__ != value.__module__:
                parts.append(f"{name}={named.__module__}.{named.__qualname__}".encode())
            elif named is not None and not isinstance(named, (types.ModuleType, type)):
                parts += [name.encode(), *_parts(named, seen)]
        return parts
    if isinstance(value, types.MethodType):
        return _parts(value.__func__, seen) + _parts(value.__self__, seen)
    if isinstance(value, functools.partial):
        return [part for member in (value.func, value.args, value.keywords) for part in _parts(member, seen)]
    if isinstance(value, np.ndarray):
        return [str((value.dtype, value.shape)).encode(), value.tobytes()]
    if isinstance(value, Mapping):
        return [part for key, entry in value.items() for part in [repr(key).encode(), *_parts(entry, seen)]]
    if isinstance(value, (set, frozenset)):
        return [repr(sorted(map(repr, value))).encode()]
    if isinstance(value, (list, tuple)):
        return [part for element in value for part in [b",", *_parts(element, seen)]]
    if value is None or isinstance(value, (bool, int, float, complex, str, bytes, np.generic)):
        return [repr(value).encode()]
    kind = type(value)
    parts = [f"{kind.__module__}.{kind.__qualname__}".encode()]
    call = kind.__dict__.get("__call__")
    if isinstance(call, types.FunctionType):
        seen.add(id(value))
        return parts + _parts(call, seen) + _parts(getattr(value, "__dict__", None), seen)
    # What can't be pickled counts by its type alone.
    with contextlib.suppress(Exception):
        parts.append(pickle.dumps(value))
    return parts


def _of_code(code: types.CodeType, seen: set[int]) -> list[bytes]:
    parts = [code.co_code, repr(code.co_names).encode(), repr(code.co_varnames).encode()]
    for constant in code.co_consts:
        parts += _of_code(constant, seen) if isinstance(constant, types.CodeType) else _parts(constant, seen)
    return parts


def _names(code: types.CodeType) -> set[str]:
    """Names of globals in a code and in the functions within it."""
    inner = [constant for constant in code.co_consts if isinstance(constant, types.CodeType)]
    return set(code.co_names).union(*(_names(nested) for nested in inner))


def _filled(cell: types.CellType) -> bool:
    try:
        _ = cell.cell_contents
    except ValueError:
        return False
    return True
