"""Exceptions of asperity, all derived from :class:`Error`."""

from __future__ import annotations

from typing import NamedTuple, Optional, Sequence, Tuple

__all__ = [
    "ArgumentError",
    "Error",
    "FitError",
    "ManifestError",
    "MissingArgumentError",
    "NotComputedError",
    "Problem",
    "QueryError",
    "StoreError",
    "StudyWarning",
    "SurfaceError",
    "UnknownNameError",
]


class Error(Exception):
    """Base class of all exceptions of asperity."""


class Problem(NamedTuple):
    """One problem in a manifest.

    Attributes
    ----------
    message : str
        Description of the problem, with the key and its value.
    line, column : int or None
        Position in the manifest, counted from 1 in lines and characters; None if it has no position.
    help : str or None
        How to correct it.
    """

    message: str
    line: Optional[int]
    column: Optional[int]
    help: Optional[str]


class ManifestError(Error, ValueError):
    """The manifest is invalid, and nothing was computed.

    The text of the exception shows every problem with its position, like ``asperity check``.

    Attributes
    ----------
    file : str
        Path of the manifest.
    problems : tuple of Problem
        All problems in the order of lines.
    line, column : int or None
        Position of the first problem.
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


def _problem(message: str, position: Optional[Sequence[int]], help: Optional[str]) -> Problem:
    line, column = (None, None) if position is None else position
    return Problem(message, line, column, help)


class ArgumentError(Error, ValueError):
    """An argument is invalid; the text names the argument, its value and valid values."""


class MissingArgumentError(ArgumentError, TypeError):
    """A required argument is missing; the text says what to write."""


class SurfaceError(Error, ValueError):
    """Heights cannot be used as a surface, or a file contains no usable heights."""


class StoreError(Error, OSError):
    """A file in the data folder is damaged or cannot be read or written."""


class QueryError(Error, ValueError):
    """An SQL query is invalid."""


class UnknownNameError(Error, LookupError):
    """The name of a stage, column or claim is unknown; the text lists the known names."""


class NotComputedError(Error, LookupError):
    """A stage has no results yet; run the study first."""


class FitError(Error, ArithmeticError):
    """A law cannot be fitted to the data."""


class StudyWarning(UserWarning):
    """Warning about a study, its tables or a run, or about a mesh that is coarse for the adhesion."""
