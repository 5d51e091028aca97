"""Pictures for notebooks."""

from __future__ import annotations

import base64
import io
from typing import Any, Callable


def picture(draw: Callable[[Any], Any]) -> str:
    """Draws with `draw` on new axes and returns an HTML image, or "" without matplotlib."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return ""
    # Not with pyplot, to leave the user's figures unchanged.
    figure = Figure(figsize=(4.4, 3.3), dpi=110, layout="constrained")
    draw(figure.subplots())
    file = io.BytesIO()
    figure.savefig(file, format="png")
    encoded = base64.b64encode(file.getvalue()).decode()
    return f'<img alt="map" src="data:image/png;base64,{encoded}">'
