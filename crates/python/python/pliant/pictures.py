"""Pictures."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import NDArray

from pliant import _native

__all__ = ["Picture"]


class Picture:
    """A picture, which shows itself in notebooks; `png` has the bytes of the PNG file."""

    def __init__(self, png: bytes) -> None:
        self.png = png

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        height, width, _ = self.to_numpy().shape
        return width, height

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the PNG file."""
        with open(path, "wb") as file:
            file.write(self.png)

    def to_numpy(self) -> NDArray[np.uint8]:
        """(height, width, 4) red, green, blue and opacity, 0 to 255."""
        pixels, height = _native.pixels(self.png)
        return pixels.reshape(height, -1, 4)

    def _repr_png_(self) -> bytes:
        return self.png

    def __repr__(self) -> str:
        return f"Picture({len(self.png)} bytes)"
