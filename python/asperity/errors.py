"""What goes wrong: every exception of asperity is an :class:`Error`."""

from __future__ import annotations

from typing import NamedTuple, Optional, Sequence, Tuple

__all__ = [
    "ArgumentError",
    "Error",
    "FitError",
    "ManifestError",
    "NotComputedError",
    "Problem",
    "QueryError",
    "StoreError",
    "StudyWarning",
    "SurfaceError",
    "UnknownNameError",
]


class Error(Exception):
    """What is common to all exceptions of asperity."""


class Problem(NamedTuple):
    """One mistake in a manifest.

    Attributes
    ----------
    message : str
        What is wrong, with the name of the thing and its value.
    line, column : int or None
        Where it is written, from 1 on and in characters; None for a mistake of the whole manifest.
    help : str or None
        What would do instead.
    """

    message: str
    line: Optional[int]
    column: Optional[int]
    help: Optional[str]


class ManifestError(Error, ValueError):
    """A manifest makes no sense. Nothing was computed.

    The text of the exception shows every problem at its place, as ``asperity check`` does.

    Attributes
    ----------
    file : str
        The manifest.
    problems : tuple of Problem
        All problems, in the order of the lines.
    line, column : int or None
        The place of the first one.
    """

    def __init__(
        self,
        text: str,
        file: str = "",
        problems: Sequence[Tuple[str, Optional[Sequence[int]], Optional[str]]] = (),
    ) -> None:
        super().__init__(text)
        self.file = file
        self.problems = tuple(_problem(*problem) for problem in problems)
        first = self.problems[0] if self.problems else Problem("", None, None, None)
        self.line, self.column = first.line, first.column


def _problem(message: str, place: Optional[Sequence[int]], help: Optional[str]) -> Problem:
    line, column = (None, None) if place is None else place
    return Problem(message, line, column, help)


class ArgumentError(Error, ValueError):
    """An argument makes no sense: its name, its value, and what would do."""


class SurfaceError(Error, ValueError):
    """Heights are no surface that can be used, or a file holds none."""


class StoreError(Error, OSError):
    """A table or another file of a study's data is damaged, or cannot be read or written."""


class QueryError(Error, ValueError):
    """A query in SQL cannot be answered."""


class UnknownNameError(Error, LookupError):
    """A stage or a column is not there; the text says what is."""


class NotComputedError(Error, LookupError):
    """Nothing of a stage is computed yet: run the study first."""


class FitError(Error, ArithmeticError):
    """No law can be fitted to these data."""


class StudyWarning(UserWarning):
    """Something of a study should be known, and nothing ends for it."""
