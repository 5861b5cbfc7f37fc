"""The base class of all classes of `pliant.tables`."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any, ClassVar

__all__ = ["Table"]


class Table:
    """A table of a scene. Keys are those of the file, with underscores for hyphens; keys that are `None` are left out."""

    _type: ClassVar[str | None] = None
    _keys: ClassVar[dict[str, str]] = {}

    def to_dict(self) -> dict[str, Any]:
        """The table as it stands in a file."""
        table: dict[str, Any] = {} if self._type is None else {"type": self._type}
        assert is_dataclass(self)
        for field in fields(self):
            value = getattr(self, field.name)
            if value is not None:
                table[self._keys[field.name]] = value
        return table
