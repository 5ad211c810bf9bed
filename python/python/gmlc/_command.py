"""The command ``gmlc``."""

from __future__ import annotations

import signal
import sys

from . import _gmlc


def main() -> int:
    """Do what the command line says; returns the exit status."""
    # The command has its own answer to Ctrl-C, and its reader may close the pipe early.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    words = ["gmlc", *sys.argv[1:]]
    if "--dask" in words or any(word.startswith("--dask=") for word in words):
        from . import _dask

        return _dask.main(words)
    return _gmlc.command(words)
