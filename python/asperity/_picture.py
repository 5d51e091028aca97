"""Pictures for notebooks."""

from __future__ import annotations

import base64
import io
from typing import Any, Callable


def picture(draw: Callable[[Any], Any]) -> str:
    """What `draw` puts on axes, as an image in HTML; nothing where there is no matplotlib."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return ""
    # Beside pyplot, so that no figure of the user's is touched.
    figure = Figure(figsize=(4.4, 3.3), dpi=110, layout="constrained")
    draw(figure.subplots())
    file = io.BytesIO()
    figure.savefig(file, format="png")
    encoded = base64.b64encode(file.getvalue()).decode()
    return f'<img alt="map" src="data:image/png;base64,{encoded}">'
