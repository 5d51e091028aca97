"""Pictures of maps, and pictures for notebooks."""

from __future__ import annotations

import base64
import io
from typing import TYPE_CHECKING, Any, Callable, Dict, Mapping, Optional, Tuple

from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_map(
    axes: "Optional[Axes]",
    values: NDArray[Any],
    size: Tuple[float, float],
    length_unit: str,
    label: str,
    image: Mapping[str, Any],
) -> "Axes":
    """Draws values [x, y] with a colour bar on `axes`, or on new axes; `image` are arguments of ``imshow``.

    A map of flags has two grey values and no colour bar.
    """
    if axes is None:
        import matplotlib.pyplot

        axes = matplotlib.pyplot.figure(figsize=(4, 3.2), layout="constrained").subplots()
    is_flags = values.dtype == bool
    defaults: Dict[str, Any] = {"origin": "lower", "extent": (0.0, size[0], 0.0, size[1])}
    if is_flags:
        defaults.update(cmap="Greys", vmin=0, vmax=1, interpolation="nearest")
    # The first index of a picture is the row, so the array is transposed.
    shown = axes.imshow(values.T, **{**defaults, **image})
    axes.locator_params(nbins=5)
    axes.ticklabel_format(style="sci", scilimits=(-2, 4))
    axes.set_xlabel(f"x ({length_unit})")
    axes.set_ylabel(f"y ({length_unit})")
    if is_flags:
        axes.set_title(label, fontsize="small")
    elif axes.figure is not None:
        axes.figure.colorbar(shown, ax=axes, label=label)
    return axes


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
