"""Entry point of the command ``asperity``."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import sysconfig
from typing import List, Optional


def main(arguments: Optional[List[str]] = None) -> int:
    """Runs a command line and returns the exit code.

    The function handles signals, and it ends the process if the command line is invalid.

    Parameters
    ----------
    arguments : list of str, optional
        Arguments after the name of the program; default: the arguments of the process.
    """
    from asperity import _asperity

    # Python's own handler would run only after the command has ended.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    words = sys.argv[1:] if arguments is None else arguments
    return _asperity.main(["asperity", *words], _program())


def _program() -> Optional[str]:
    """Returns the path of the script ``asperity``, which cluster jobs run."""
    started = os.path.abspath(sys.argv[0])
    if os.path.basename(started) == "asperity" and os.access(started, os.X_OK):
        return started
    beside = os.path.join(sysconfig.get_path("scripts"), "asperity")
    return beside if os.access(beside, os.X_OK) else shutil.which("asperity")
