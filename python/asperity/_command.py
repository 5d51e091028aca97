"""The ``asperity`` command: an entry point into the extension."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import sysconfig
from typing import List, Optional


def main(arguments: Optional[List[str]] = None) -> int:
    """Runs the command line that the process was started with; it returns the exit code.

    The process is the command's: its signals are heard, and what is misspelt ends it.

    Parameters
    ----------
    arguments : list of str, optional
        The words after the name of the program; those of the process when left out.
    """
    from asperity import _asperity

    # Otherwise Ctrl-C would wait for Python, which does not run before the command is done.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    words = sys.argv[1:] if arguments is None else arguments
    return _asperity.main(["asperity", *words], _program())


def _program() -> Optional[str]:
    """The script that was started, for the jobs of a cluster to start it again."""
    started = os.path.abspath(sys.argv[0])
    if os.path.basename(started) == "asperity" and os.access(started, os.X_OK):
        return started
    beside = os.path.join(sysconfig.get_path("scripts"), "asperity")
    return beside if os.access(beside, os.X_OK) else shutil.which("asperity")
