"""Progress of a run in terminals and notebooks."""

from __future__ import annotations

import sys
import time
from typing import Any, Callable, Dict, Optional, Union

#: Called with the dict that :meth:`Study.run` describes.
Callback = Callable[[Dict[str, Any]], object]

#: Seconds between two lines if the output is not a terminal.
_LINE_EVERY = 10.0


class Progress:
    """Context manager that displays the progress of a run."""

    def __init__(self, wanted: Union[bool, Callback]) -> None:
        self._show: Optional[Callback] = None
        self._end: Callable[[], None] = lambda: None
        if callable(wanted):
            self._show = wanted
        elif wanted and _is_notebook():
            self._show, self._end = _in_notebook()
        elif wanted and _is_terminal():
            self._show, self._end = _in_terminal, _clear_line
        elif wanted:
            self._show = _lines()

    def __enter__(self) -> Optional[Callback]:
        return self._show

    def __exit__(self, *_: object) -> None:
        self._end()


def _is_notebook() -> bool:
    # A notebook has imported IPython already.
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell is not None and hasattr(shell, "kernel")


def _is_terminal() -> bool:
    return sys.stderr is not None and sys.stderr.isatty()


def _in_terminal(advance: Dict[str, Any]) -> None:
    bar = "━" * round(30 * advance["share"])
    print(f"\r{advance['doing']:9} {bar:30} {advance['text']}\x1b[K", end="", file=sys.stderr, flush=True)


def _clear_line() -> None:
    print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def _lines() -> Callback:
    """Returns a callback that prints the same lines as the command `run`."""
    batch, last = "", time.monotonic()

    def show(advance: Dict[str, Any]) -> None:
        nonlocal batch, last
        if advance["batch"] != batch:
            batch, last = advance["batch"], time.monotonic()
            print(batch, file=sys.stderr, flush=True)
        elif time.monotonic() - last >= _LINE_EVERY:
            last = time.monotonic()
            print(advance["text"], file=sys.stderr, flush=True)

    return show


def _in_notebook() -> "tuple[Callback, Callable[[], None]]":
    import IPython.display

    # IPython has no type annotations.
    HTML: Any = IPython.display.HTML
    display: Any = IPython.display.display
    handle = display(HTML(""), display_id=True)
    shown = ""

    def show(advance: Dict[str, Any]) -> None:
        nonlocal shown
        share, doing, text = advance["share"], advance["doing"], advance["text"]
        line = f'<progress value="{share:.2f}" max="1"></progress> {doing} {text}'
        # Each update is a message to the browser.
        if line != shown:
            shown = line
            handle.update(HTML(line))

    return show, lambda: handle.update(HTML(""))
