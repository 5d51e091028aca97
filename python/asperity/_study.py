"""A manifest and the folder of what is computed of it."""

from __future__ import annotations

import os
import warnings
from html import escape
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from asperity import _asperity
from asperity._plan import Plan, Report, Run
from asperity._progress import Progress, Teller
from asperity._table import Column, Table
from asperity.errors import ManifestError, StudyWarning

PathLike = Union[str, "os.PathLike[str]"]


class Study:
    """A manifest and a folder of data.

    The manifest is read again whenever something is asked, so that it may be edited meanwhile.

    Parameters
    ----------
    path : str or path
        The manifest.
    data : str or path
        The folder of what is computed; it need not exist.

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

    def __init__(self, path: PathLike, data: PathLike = "data") -> None:
        self._path = Path(path)
        self._data = Path(data)
        self._session = _asperity.Session(str(self._path), str(self._data))

    @classmethod
    def parse(
        cls,
        manifest: Union[str, Mapping[str, Any]],
        data: PathLike = "data",
        path: Optional[PathLike] = None,
    ) -> "Study":
        """A study of a manifest's text, or of its tables.

        The manifest is kept in a file, so that the command line, a cluster and the table of failures know it.

        Parameters
        ----------
        manifest : str or mapping
            TOML, or its tables.
        data : str or path
            The folder of what is computed.
        path : str or path, optional
            The file; ``DATA/NAME.toml``, which is written anew each time, when left out. Surface files that
            the manifest names are relative to its folder.

        Raises
        ------
        ManifestError
            If it makes no sense.
        FileExistsError
            If `path` is another manifest.
        """
        text = manifest if isinstance(manifest, str) else _asperity.toml(dict(manifest))
        folder = Path(data) if path is None else Path(path).parent
        name = _asperity.study_name(text, str(folder))
        place = folder / f"{name}.toml" if path is None else Path(path)
        if path is not None and place.exists() and place.read_text(encoding="utf-8") != text:
            raise FileExistsError(f"`{place}` is another manifest")
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, encoding="utf-8")
        return cls(place, data)

    @property
    def path(self) -> Path:
        """The manifest."""
        return self._path

    @property
    def data(self) -> Path:
        """The folder of what is computed."""
        return self._data

    def check(self) -> str:
        """Whether the manifest makes sense, and what it amounts to, in a sentence.

        Warns
        -----
        StudyWarning
            For what should be known before it is run.

        Raises
        ------
        ManifestError
            With file, line and column of everything that is wrong.
        """
        name, stages, tasks, grows, told = self._session.check()
        _warn([("warning", words) for words in told])
        at_least = "at least " if grows else ""
        return f"study `{name}`: {len(stages)} stages, {at_least}{tasks} tasks"

    def plan(self) -> Plan:
        """What the study has and what it would compute. Nothing is written.

        Raises
        ------
        ManifestError
            If the manifest makes no sense.
        """
        return Plan(self._session.status())

    def explain(self) -> str:
        """Why tasks would run, reason by reason.

        Raises
        ------
        ManifestError
            If the manifest makes no sense.
        """
        lines = []
        for stage in self.plan().stages:
            lines.append(f"{stage.name} ({stage.kind}): {stage.cached} reused, {stage.to_run} to run")
            lines += [f"  {reason.tasks} tasks: {'; '.join(reason.causes)}" for reason in stage.reasons]
        return "\n".join(lines)

    def run(
        self,
        jobs: Optional[int] = None,
        memory: Union[int, str, None] = None,
        progress: Union[bool, Teller] = True,
        replace: bool = False,
    ) -> Run:
        """Computes what is missing and writes the tables.

        Other threads of Python run meanwhile. Ctrl-C, and the button of a notebook, end it within two
        seconds; finished tasks are kept, and the next run goes on from there.

        Parameters
        ----------
        jobs : int, optional
            Surfaces to work on at once; as many as there are cores when left out.
        memory : int or str, optional
            Memory to keep to, in bytes or as ``"16GB"``; seven eighths of what there is when left out.
        progress : bool or callable
            Whether to tell how far it has come, or who is to be told: he is called with a dict of ``study``,
            ``doing``, ``tasks``, ``tasks_done``, ``cached``, ``share`` and ``seconds_left``.
        replace : bool
            Whether to take the place of another manifest whose study has the same name.

        Warns
        -----
        StudyWarning
            For damaged tables, failed tasks, and whatever should be known of the study.

        Raises
        ------
        ManifestError
            If the manifest makes no sense.
        StoreError
            If the data cannot be read or written.
        Error
            If a task takes more memory than there is, or the tables are another manifest's.
        KeyboardInterrupt
            If it was interrupted.
        """
        size = None if memory is None else str(memory)
        with Progress(progress) as tell:
            report, notices = self._session.run(jobs, size, replace, tell)
        run = Run(report)
        if run.failed:
            notices.append(("warning", f"{run.failed} tasks failed, see `failures()`"))
        if run.halted:
            notices.append(("warning", "nothing more can be stored: make room, and run again to go on"))
        _warn(notices)
        return run

    def table(self, name: str) -> Table:
        """A stage's table, as far as it is computed.

        Raises
        ------
        UnknownNameError
            If there is no such stage.
        NotComputedError
            If nothing of it is computed.
        StoreError
            If a table is damaged.
        """
        table, notices = self._session.table(name)
        _warn(notices)
        return Table(table)

    def sql(self, query: str) -> Table:
        """The answer to a query in the SQL of polars, in which every stage is a table.

        Raises
        ------
        QueryError
            If it cannot be answered.
        UnknownNameError
            If it names what is not there.
        """
        table, notices = self._session.sql(query)
        _warn(notices)
        return Table(table)

    def failures(self) -> Table:
        """What the last runs could not compute, a row each: its task, why, and what computes it alone."""
        return Table(self._session.failures())

    def columns(self, name: Optional[str] = None) -> Union[List[Column], Dict[str, List[Column]]]:
        """What the columns of a stage mean, or those of all stages by name; nothing need be computed.

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

    def claims(self) -> List[Dict[str, Any]]:
        """What the paper of 2015 says, judged by the tables.

        Returns
        -------
        list of dict
            ``name``, ``kind``, ``says``, ``where``, ``quantity``, ``because``, ``data``, ``expected``,
            ``verdict``, and of those that are judged ``quantities`` and ``more_surfaces``.
        """
        return self._session.claims()

    def report(self, output: Optional[PathLike] = None, replace: bool = False) -> Report:
        """Writes the page of figures and tables, and each figure.

        Parameters
        ----------
        output : str or path, optional
            The folder to write into; that of the tables when left out.
        replace : bool
            Whether to replace a page that shows more, or files of another study.
        """
        page, figures = self._session.report(None if output is None else os.fspath(output), replace)
        return Report(Path(page), Path(figures))

    def __repr__(self) -> str:
        return f"Study({str(self._path)!r}, data={str(self._data)!r})"

    def _repr_html_(self) -> str:
        try:
            return f"<p>{escape(repr(self))}</p>{self.plan()._repr_html_()}"
        except ManifestError as error:
            return f"<p>{escape(repr(self))}</p><pre>{escape(str(error))}</pre>"


def _warn(notices: Sequence[Tuple[str, str]]) -> None:
    for _, words in notices:
        warnings.warn(words, StudyWarning, stacklevel=3)
