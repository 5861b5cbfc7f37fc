"""The command line, as ``pip install pliant`` brings it."""

from __future__ import annotations

import sys

from pliant import _native

__all__ = ["main"]


def main() -> int:
    """Does what the command line says."""
    import signal

    # The engine ends runs on signals by itself, with a checkpoint.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.main(["pliant", *sys.argv[1:]])
