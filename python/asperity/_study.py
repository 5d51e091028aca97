"""Studies: a manifest with its data folder."""

from __future__ import annotations

import json
import os
import warnings
from html import escape
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from asperity import _asperity
from asperity._map import Map
from asperity._plan import Diff, Plan, Report, Run
from asperity._progress import Callback, Progress
from asperity._table import Column, Table
from asperity._topography import Topography
from asperity.errors import ManifestError, StudyWarning

#: Value of a column that identifies a surface.
Coordinate = Union[float, int, str]
PathLike = Union[str, "os.PathLike[str]"]


class Study:
    """Manifest of a study with its data folder.

    Each method reads the manifest again, so the manifest may change between calls.

    Parameters
    ----------
    path : str or path
        Path of the manifest.
    data : str or path
        Data folder, which need not exist.
    set : mapping, optional
        Values for keys of the manifest, as in ``{"stage.surfaces.realizations": 20}``, like ``--set`` of the
        command. The file of the manifest does not change.

    Raises
    ------
    ArgumentError
        If a name in `set` is not a key. Values are checked when the manifest is read.

    Examples
    --------
    >>> import tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> study = Study.parse({
    ...     "study": {"name": "small", "seed": 1},
    ...     "stage": {
    ...         "surfaces": {"kind": "generate", "nodes": 32, "hurst": 0.8, "k_lower": 1, "k_upper": 2},
    ...         "contact": {"kind": "solve", "from": "surfaces", "loads": [0.05, 0.1]},
    ...     },
    ... }, data=folder.name)
    >>> study.plan().to_run
    2
    >>> study.run(progress=False)
    <asperity.Run of small: 2 tasks computed>
    >>> study.table("contact")["load"]
    array([0.05, 0.1 ])
    >>> float(study.sql("select max(load) as load from contact")["load"][0])
    0.1
    >>> folder.cleanup()
    """

    def __init__(
        self, path: PathLike, data: PathLike = "data", *, set: Optional[Mapping[str, Any]] = None
    ) -> None:
        self._path = Path(path)
        self._data = Path(data)
        self._settings = dict(set or {})
        self._session = _asperity.Session(str(self._path), str(self._data), self._settings)

    @classmethod
    def parse(
        cls,
        manifest: Union[str, Mapping[str, Any]],
        data: PathLike = "data",
        path: Optional[PathLike] = None,
    ) -> "Study":
        """Creates a study from the text or the tables of a manifest.

        The manifest is written into a file, so that the command line, cluster jobs and the commands in the
        table of failures can use it.

        Parameters
        ----------
        manifest : str or mapping
            TOML text, or a mapping of its tables.
        data : str or path
            Data folder.
        path : str or path, optional
            File to write; default: ``DATA/NAME.toml``, which is overwritten. Paths of surface files in the
            manifest are relative to its folder.

        Raises
        ------
        ManifestError
            If the manifest is invalid.
        FileExistsError
            If `path` exists with different text.
        """
        text = manifest if isinstance(manifest, str) else _asperity.toml(dict(manifest))
        folder = Path(data) if path is None else Path(path).parent
        name = _asperity.study_name(text, str(folder))
        file = folder / f"{name}.toml" if path is None else Path(path)
        if path is not None and file.exists() and file.read_text(encoding="utf-8") != text:
            raise FileExistsError(f"`{file}` already exists with a different text; choose another `path`")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        return cls(file, data)

    @property
    def path(self) -> Path:
        """Path of the manifest."""
        return self._path

    @property
    def data(self) -> Path:
        """Path of the data folder."""
        return self._data

    @property
    def settings(self) -> Dict[str, Any]:
        """Values that override keys of the manifest."""
        return dict(self._settings)

    def check(self) -> str:
        """Validates the manifest and returns a one-line summary.

        Warns
        -----
        StudyWarning
            For possible problems of the study.

        Raises
        ------
        ManifestError
            If the manifest is invalid, with file, line and column of every problem.
        """
        name, stages, tasks, grows, messages = self._session.check()
        _warn([("warning", message) for message in messages])
        at_least = "at least " if grows else ""
        return f"study `{name}`: {len(stages)} stages, {at_least}{tasks} tasks"

    def plan(self) -> Plan:
        """Returns finished and missing tasks with reasons and costs, without writing anything.

        Raises
        ------
        ManifestError
            If the manifest is invalid.
        """
        return Plan(self._session.status())

    def explain(self) -> str:
        """Explains why tasks will run, with one line per reason.

        Raises
        ------
        ManifestError
            If the manifest is invalid.
        """
        lines = []
        for stage in self.plan().stages:
            lines.append(f"{stage.name} ({stage.kind}): {stage.cached} finished, {stage.to_run} to run")
            lines += [f"  {reason.tasks} tasks: {'; '.join(reason.causes)}" for reason in stage.reasons]
        return "\n".join(lines)

    def run(
        self,
        jobs: Optional[int] = None,
        memory: Union[int, str, None] = None,
        progress: Union[bool, Callback] = True,
        replace: bool = False,
    ) -> Run:
        """Computes the missing tasks and writes the tables.

        Other Python threads run during the computation. Ctrl-C and the interrupt button of a notebook stop the
        run within two seconds. Finished tasks are kept, and the next run computes only the others.

        Parameters
        ----------
        jobs : int, optional
            Number of cores; default: all.
        memory : int or str, optional
            Memory limit in bytes or as ``"16GB"``; default: 7/8 of the available memory.
        progress : bool or callable
            True to show the progress: a bar in terminals and notebooks, and plain lines on standard error
            elsewhere. False to hide it. A function is called 20 times a second, and at the end, with a dict:
            ``text`` (as in ``"123 of 480 tasks, 2 min 5 s left"``), ``share`` of the work from 0 to 1,
            ``seconds_left`` or None, ``tasks``, ``tasks_done``, ``cached``, ``doing`` (kind of stage),
            ``batch`` (numbers of tasks at the start, as text) and ``study``.
        replace : bool
            True to overwrite the results of another manifest with the same study name.

        Returns
        -------
        Run
            Numbers of computed and failed tasks, and paths of the tables.

        Warns
        -----
        StudyWarning
            For damaged tables, failed tasks and possible problems of the study.

        Raises
        ------
        ManifestError
            If the manifest is invalid.
        StoreError
            If the data cannot be read or written.
        Error
            If a task needs more memory than available, or if the tables belong to another manifest.
        KeyboardInterrupt
            If the run was interrupted.
        """
        size = None if memory is None else str(memory)
        with Progress(progress) as on_progress:
            report, notices = self._session.run(jobs, size, replace, on_progress)
        run = Run(report)
        if run.failed:
            notices.append(("warning", f"{run.failed} tasks failed; `failures()` lists them"))
        if run.halted:
            notices.append(("warning", "cannot store more tables; free disk space and run again to continue"))
        _warn(notices)
        return run

    def table(self, name: str) -> Table:
        """Reads the finished rows of the table of a stage.

        Raises
        ------
        UnknownNameError
            If there is no such stage.
        NotComputedError
            If the stage has no results.
        StoreError
            If a table is damaged.
        """
        table, notices = self._session.table(name)
        _warn(notices)
        return Table(table)

    def sql(self, query: str) -> Table:
        """Runs an SQL query (polars dialect) in which every stage is a table.

        Raises
        ------
        QueryError
            If the query is invalid.
        UnknownNameError
            If the query contains an unknown table or column.
        """
        table, notices = self._session.sql(query)
        _warn(notices)
        return Table(table)

    def heights(self, stage: str, **coordinates: Coordinate) -> Topography:
        """Returns the heights of one surface; computes them if the study has not stored them.

        Parameters
        ----------
        stage : str
            Name of a `generate` stage, or of a stage that reads its surfaces.
        **coordinates : float, int or str
            Values of columns that choose the surface, such as ``realization=0, hurst=0.8``. Numbers may have
            a unit, as in ``side="100 um"``. A column with a single value can be omitted.

        Returns
        -------
        Topography
            The surface, which :func:`press` presses to the results of the study. `values` or
            ``numpy.asarray`` give its heights, shape (n_x, n_y).

        Raises
        ------
        ArgumentError
            If several surfaces match, or none; the text lists the values that can be chosen.
        UnknownNameError
            If there is no such stage or column.
        NotComputedError
            If the stage has no results.

        Examples
        --------
        See :meth:`pressure`.
        """
        (values, size, unit, is_periodic, rms_slope), notices = self._session.heights(
            stage, _written(coordinates)
        )
        _warn(notices)
        heights = Topography._of(values, size, unit, is_periodic)
        heights._rms_slope = rms_slope
        return heights

    def pressure(self, stage: str, *, load: Union[float, str, None] = None, **coordinates: Coordinate) -> Map:
        """Returns the contact pressure of one surface under one load, exactly zero outside the contact.

        If the study has not stored the pressures of this load, they are computed again, which takes the time
        of one load. The values are the same. ``pressures = "all"`` in a `solve` stage stores them.

        Parameters
        ----------
        stage : str
            Name of a `solve` stage, or of a `measure` stage that reads one.
        load : float or str, optional
            One of the loads of the study: a number as in the manifest, a pressure such as ``"10 MPa"``, or a
            mean gap such as ``"20 nm"`` if the manifest prescribes gaps; default: the largest load.
        **coordinates : float, int or str
            Values of columns that choose the surface, such as ``realization=0, hurst=0.8``. Numbers may have
            a unit, as in ``side="100 um"``. A column with a single value can be omitted.

        Returns
        -------
        Map
            Pressures with unit, size and load, shape (n_x, n_y).

        Raises
        ------
        ArgumentError
            If several surfaces match, or none; the text lists the values that can be chosen. If the load was
            not solved; the text names the nearest loads.
        UnknownNameError
            If there is no such stage or column.
        NotComputedError
            If the stage has no results.
        KeyboardInterrupt
            If the computation was interrupted.

        Examples
        --------
        >>> import tempfile
        >>> folder = tempfile.TemporaryDirectory()
        >>> study = Study.parse({
        ...     "study": {"name": "maps", "seed": 1},
        ...     "stage": {
        ...         "surfaces": {"kind": "generate", "nodes": 32, "hurst": 0.8, "k_lower": 1, "k_upper": 4,
        ...                      "realizations": 2},
        ...         "contact": {"kind": "solve", "from": "surfaces", "loads": [0.05, 0.1]},
        ...     },
        ... }, data=folder.name)
        >>> _ = study.run(progress=False)
        >>> pressure = study.pressure("contact", load=0.1, realization=1)
        >>> pressure
        <asperity.Map: pressure under 0.1 E* × rms slope, 32 × 32 nodes, 1 × 1>
        >>> round(float(pressure.values.mean()), 12)
        0.1
        >>> study.heights("surfaces", realization=1)
        <asperity.Topography: 32 × 32 nodes, 1 × 1, periodic>
        >>> study.pressure("contact", load=0.1)
        Traceback (most recent call last):
        ...
        asperity.errors.ArgumentError: 2 tasks of `contact` match; choose one by
          realization=0 | 1
        >>> folder.cleanup()
        """
        return self._map(stage, coordinates, "pressure", load)

    def gap(self, stage: str, *, load: Union[float, str, None] = None, **coordinates: Coordinate) -> Map:
        """Returns the gap between the surfaces under one load, shape (n_x, n_y).

        The gap is zero in elastic contact. Where the material yields, it is negative, and its magnitude is
        the depth of the yielding. Arguments and errors are those of :meth:`pressure`.
        """
        return self._map(stage, coordinates, "gap", load)

    def displacement(self, stage: str, *, load: Union[float, str, None] = None, **coordinates: Coordinate) -> Map:
        """Returns the displacement of the elastic body under one load, shape (n_x, n_y), positive into the body.

        The mean displacement of a periodic body is zero. Arguments and errors are those of :meth:`pressure`.
        """
        return self._map(stage, coordinates, "displacement", load)

    def contact(self, stage: str, *, load: Union[float, str, None] = None, **coordinates: Coordinate) -> Map:
        """Returns the contact map under one load: booleans, shape (n_x, n_y), True for nodes in contact.

        Arguments and errors are those of :meth:`pressure`.
        """
        return self._map(stage, coordinates, "contact", load)

    def _map(
        self,
        stage: str,
        coordinates: Mapping[str, Coordinate],
        quantity: str,
        load: Union[float, str, None],
    ) -> Map:
        chosen = None if load is None else str(load)
        found, notices = self._session.map(stage, _written(coordinates), quantity, chosen)
        _warn(notices, stacklevel=4)
        return Map(quantity=quantity, **found)

    def failures(self) -> Table:
        """Reads the table of failures: task, reason, and a command that computes the task again."""
        return Table(self._session.failures())

    def columns(self, name: Optional[str] = None) -> Union[List[Column], Dict[str, List[Column]]]:
        """Describes the columns of one stage, or of all stages by name; the study need not have run.

        Raises
        ------
        UnknownNameError
            If there is no such stage.
        """
        stages = {
            stage or "": [Column(*column) for column in columns]
            for stage, columns in self._session.columns(name)
        }
        return stages if name is None else stages[name]

    def units(self, name: str) -> Dict[str, str]:
        """Returns the units of the columns of a stage by name; the study need not have run.

        ``1`` stands for pure numbers and an empty text for texts. :attr:`Table.units` has the same units for
        each table, including answers to queries.

        Raises
        ------
        UnknownNameError
            If there is no such stage.
        """
        described = [Column(*column) for _, columns in self._session.columns(name) for column in columns]
        return {column.name: column.unit for column in described}

    def diff(self, other: "Study") -> Diff:
        """Compares the study with another one: parameters, rows, and means of all numeric columns.

        Means are compared surface by surface if both studies have the same surfaces.

        Returns
        -------
        Diff
            Whether the studies are equal, a table of all means with their differences, and a text.

        Raises
        ------
        ManifestError
            If a manifest is invalid.
        StoreError
            If a table is damaged.
        """
        (means, text, details), notices = self._session.diff(other._session)
        _warn(notices)
        return Diff(Table(means), text, json.loads(details))

    def errors(self, stage: Optional[str] = None, column: Optional[str] = None) -> Dict[str, Any]:
        """Estimates how wrong means and fitted limits are, and what halving an error costs.

        Parameters
        ----------
        stage : str, optional
            Stage with the means: an ``aggregate`` stage, a ``solve``, ``measure`` or ``correct`` stage, or a fit of
            limits. Default: all ``aggregate`` stages and fits of limits.
        column : str, optional
            Column whose means to judge. Default: all of the stage.

        Returns
        -------
        dict
            The content of ``asperity errors --json``: ``means``, each with ``loads`` whose ``terms`` are the errors
            of sampling, mesh, cell and solver with their 95 % intervals; ``additions``, the lines of the manifest
            that show further terms; and ``limits``, the fits of limits.

        Raises
        ------
        UnknownNameError
            If there is no such stage or column.
        """
        errors, notices = self._session.errors(stage, column)
        _warn(notices)
        found: Dict[str, Any] = json.loads(errors)
        return found

    def claims(self) -> List[Dict[str, Any]]:
        """Tests the statements of Yastrebov, Anciaux & Molinari (2015) against the tables.

        Returns
        -------
        list of dict
            The claims of ``asperity claims --json``: ``name``, ``kind``, ``says``, ``where``, ``quantity``,
            ``because``, ``data``, ``expected``, ``verdict``, ``quantities``, ``more_surfaces`` and others, None or
            empty if a claim has none.
        """
        claims: List[Dict[str, Any]] = json.loads(self._session.claims())["claims"]
        return claims

    def report(self, output: Optional[PathLike] = None, replace: bool = False) -> Report:
        """Writes an HTML page of figures and tables, and each figure as SVG, PNG and PDF.

        Parameters
        ----------
        output : str or path, optional
            Folder to write into; default: the folder of the tables.
        replace : bool
            True to overwrite files of another study.
        """
        page, figures = self._session.report(None if output is None else os.fspath(output), replace)
        return Report(Path(page), Path(figures))

    def __repr__(self) -> str:
        settings = f", set={self._settings!r}" if self._settings else ""
        return f"Study({str(self._path)!r}, data={str(self._data)!r}{settings})"

    def _repr_html_(self) -> str:
        try:
            return f"<p>{escape(repr(self))}</p>{self.plan()._repr_html_()}"
        except ManifestError as error:
            return f"<p>{escape(repr(self))}</p><pre>{escape(str(error))}</pre>"


def _written(coordinates: Mapping[str, Coordinate]) -> List[Tuple[str, str]]:
    return [(column, str(value)) for column, value in coordinates.items()]


def _warn(notices: Sequence[Tuple[str, str]], stacklevel: int = 3) -> None:
    for _, words in notices:
        warnings.warn(words, StudyWarning, stacklevel=stacklevel)
