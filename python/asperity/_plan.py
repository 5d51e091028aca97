"""Results of :meth:`Study.plan`, :meth:`Study.run` and :meth:`Study.report`."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from asperity._table import Table


class Reason(NamedTuple):
    """Reason why tasks will run.

    Attributes
    ----------
    tasks : int
        Number of tasks.
    seconds : float
        Expected core-seconds of these tasks.
    causes : list of str
        Causes, each as a phrase.
    """

    tasks: int
    seconds: float
    causes: List[str]


class PlannedStage(NamedTuple):
    """Finished and missing tasks of a stage.

    Attributes
    ----------
    name, kind : str
        Name and kind of the stage.
    cached, to_run : int
        Numbers of finished and of missing tasks.
    core_hours : float
        Expected core-hours of the missing tasks.
    reasons : list of Reason
        Reasons why they will run.
    """

    name: str
    kind: str
    cached: int
    to_run: int
    core_hours: float
    reasons: List[Reason]


class Plan:
    """Finished and missing tasks of a study, with reasons and costs.

    Attributes
    ----------
    study : str
        Name of the study.
    stages : list of PlannedStage
        Stages in the order of the manifest.
    core_hours : float
        Expected core-hours of all missing tasks.
    memory : int
        Minimum memory of a run, in bytes.
    warnings : list of str
        Warnings about the study.
    """

    def __init__(self, status: Mapping[str, Any]) -> None:
        self.study: str = status["study"]
        self.stages = [
            PlannedStage(**{**stage, "reasons": [Reason(*reason) for reason in stage["reasons"]]})
            for stage in status["stages"]
        ]
        self.core_hours: float = status["core_hours"]
        self.memory: int = status["memory"]
        self.warnings: List[str] = status["warnings"]

    @property
    def to_run(self) -> int:
        """Number of missing tasks."""
        return sum(stage.to_run for stage in self.stages)

    def _rows(self) -> List[Tuple[str, ...]]:
        return [
            (stage.name, stage.kind, str(stage.cached), str(stage.to_run), _why(stage.reasons))
            for stage in self.stages
        ]

    def __repr__(self) -> str:
        lines = [f"<asperity.Plan of {self.study}: {self.to_run} tasks to run, {self.core_hours:.3g} core-hours>"]
        for name, kind, cached, to_run, why in self._rows():
            lines.append(f"  {name:16} {kind:9} {cached:>7} finished {to_run:>7} to run  {why}".rstrip())
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        heads = "".join(f"<th>{head}</th>" for head in ("stage", "kind", "finished", "to run", "why"))
        rows = "".join(
            "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in self._rows()
        )
        total = f"{self.study}: {self.core_hours:.3g} core-hours"
        return f"<table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table><p>{escape(total)}</p>"


def _why(reasons: Sequence[Reason]) -> str:
    if not reasons:
        return ""
    first = "; ".join(reasons[0].causes)
    return first if len(reasons) == 1 else f"{first}, and {len(reasons) - 1} other reasons"


class Run:
    """Result of a run.

    Attributes
    ----------
    study : str
        Name of the study.
    computed, failed : int
        Numbers of computed and of failed tasks.
    stages : list of dict
        ``name``, ``kind``, ``tasks``, ``computed``, ``failed`` and ``path`` of each stage.
    sampling : list of str
        State of each adaptive stage, as text: precision of its mean, or decided claims.
    failures : Path or None
        Path of the table of failures, or None.
    halted : bool
        True if the run ended because the data folder is full or cannot be written.
    """

    def __init__(self, report: Mapping[str, Any]) -> None:
        self.study: str = report["study"]
        self.computed: int = report["computed"]
        self.failed: int = report["failed"]
        self.stages: List[Dict[str, Any]] = report["stages"]
        self.sampling: List[str] = report["sampling"]
        self.failures: Optional[Path] = report["failures"]
        self.halted: bool = report["halted"]

    def __repr__(self) -> str:
        failed = f", {self.failed} failed" if self.failed else ""
        done = f"{self.computed} tasks computed{failed}" if self.computed or self.failed else "nothing to do"
        return f"<asperity.Run of {self.study}: {done}>"


class Diff:
    """Comparison of two studies, which prints like the command ``asperity diff``.

    Differences are those of the other study B minus this study A.

    Attributes
    ----------
    equal : bool
        True if parameters, rows and values are equal.
    means : Table
        A row for each mean of a numeric column by parameter point and load: ``stage``, ``column``,
        ``mean_a``, ``mean_b``, ``difference``, its 95 % interval from ``lower`` to ``upper``, and
        ``more_than_noise``.
    details : dict
        The content of ``asperity diff --json``: ``equal``, and ``studies`` with ``parameters``, ``stages`` and
        ``noise``.
    """

    def __init__(self, means: Table, text: str, details: Dict[str, Any]) -> None:
        self.equal: bool = details["equal"]
        self.means = means
        self.details = details
        self._text = text

    def __repr__(self) -> str:
        return self._text.rstrip()


class Report(NamedTuple):
    """Paths of a report, which notebooks display as a link.

    Attributes
    ----------
    page : Path
        Path of the HTML page.
    figures : Path
        Folder of the figures as SVG, PNG and PDF.
    """

    page: Path
    figures: Path

    def _repr_html_(self) -> str:
        return f'<a href="{escape(str(self.page))}">{escape(str(self.page))}</a>'
