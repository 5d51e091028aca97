"""What a study would compute, what a run has, and where its report is."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple


class Reason(NamedTuple):
    """Why tasks would run.

    Attributes
    ----------
    tasks : int
        How many tasks.
    seconds : float
        Seconds of one core that they are expected to take.
    causes : list of str
        Why.
    """

    tasks: int
    seconds: float
    causes: List[str]


class PlannedStage(NamedTuple):
    """What a stage has and what it would compute.

    Attributes
    ----------
    name, kind : str
        The stage and what it does.
    cached, to_run : int
        Tasks that are in the store, and those that are not.
    core_hours : float
        What these are expected to take.
    reasons : list of Reason
        Why they would run.
    """

    name: str
    kind: str
    cached: int
    to_run: int
    core_hours: float
    reasons: List[Reason]


class Plan:
    """What a study has, what it would compute, why, and at what cost.

    Attributes
    ----------
    study : str
        Its name.
    stages : list of PlannedStage
        Its stages, in order.
    core_hours : float
        What all that is missing is expected to take.
    memory : int
        Bytes that it takes at least.
    warnings : list of str
        What should be known of the study.
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
        """Tasks that would be computed."""
        return sum(stage.to_run for stage in self.stages)

    def _rows(self) -> List[Tuple[str, ...]]:
        return [
            (stage.name, stage.kind, str(stage.cached), str(stage.to_run), _why(stage.reasons))
            for stage in self.stages
        ]

    def __repr__(self) -> str:
        lines = [f"<asperity.Plan of {self.study}: {self.to_run} tasks to run, {self.core_hours:.3g} core-hours>"]
        for name, kind, cached, to_run, why in self._rows():
            lines.append(f"  {name:16} {kind:9} {cached:>7} cached {to_run:>7} to run  {why}".rstrip())
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        heads = "".join(f"<th>{head}</th>" for head in ("stage", "kind", "cached", "to run", "why"))
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
    """What came of a run.

    Attributes
    ----------
    study : str
        The study's name.
    computed, failed : int
        Tasks that were computed, and that could not be.
    stages : list of dict
        ``name``, ``kind``, ``tasks``, ``computed``, ``failed`` and ``path`` of each stage.
    sampling : list of str
        How well means are known, or which claims are decided, of stages that draw surfaces until they are.
    failures : Path or None
        The table of failures, if there is one.
    halted : bool
        Whether nothing more could be stored.
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


class Report(NamedTuple):
    """Where a report is; a notebook links to it.

    Attributes
    ----------
    page : Path
        The page.
    figures : Path
        The folder of figures, each as SVG and PNG.
    """

    page: Path
    figures: Path

    def _repr_html_(self) -> str:
        return f'<a href="{escape(str(self.page))}">{escape(str(self.page))}</a>'
