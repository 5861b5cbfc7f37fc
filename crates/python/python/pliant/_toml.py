"""Plain data as TOML."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

__all__ = ["document", "value"]

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else json.dumps(name)


def value(content: Any) -> str:
    """A value as it stands behind ``=``.

    >>> value({"size": [0.1, 0.2], "kind": "tets"})
    '{ size = [0.1, 0.2], kind = "tets" }'
    """
    if isinstance(content, (bool, np.bool_)):
        return "true" if content else "false"
    if isinstance(content, (int, np.integer)):
        return str(int(content))
    if isinstance(content, (float, np.floating)):
        number = float(content)
        if math.isnan(number):
            return "nan"
        if math.isinf(number):
            return "inf" if number > 0 else "-inf"
        text = repr(number)
        return text if any(mark in text for mark in ".e") else text + ".0"
    if isinstance(content, str):
        return json.dumps(content, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(content, np.ndarray):
        return value(content.tolist())
    if isinstance(content, Mapping):
        inner = ", ".join(f"{_key(name)} = {value(item)}" for name, item in content.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(content, Sequence):
        return "[" + ", ".join(value(item) for item in content) + "]"
    raise TypeError(f"a scene holds numbers, texts, lists and tables, not {type(content).__name__}")


def document(data: Mapping[str, Any], named: Sequence[str]) -> str:
    """The text of a scene: a header for each table, and for each table of the `named` kinds."""
    parts = []
    for kind, table in data.items():
        if kind in named:
            parts += [_section(f"{kind}.{_key(name)}", entry) for name, entry in table.items()]
        elif isinstance(table, Mapping):
            parts.append(_section(kind, table))
        else:
            parts.insert(0, f"{_key(kind)} = {value(table)}\n")
    return "\n".join(parts)


def _section(header: str, table: Any) -> str:
    if not isinstance(table, Mapping):
        raise TypeError(f"`{header}` must be a table, not {type(table).__name__}")
    lines = [f"{_key(name)} = {value(entry)}\n" for name, entry in table.items()]
    return f"[{header}]\n" + "".join(lines)
