"""Maps of a finished study: pressure, gap, displacement and contact under one load."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any, Optional, Tuple

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import ArrayLike, NDArray

from asperity._arrays import Size, as_array, sides_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Map(NDArrayOperatorsMixin):
    """Values on the nodes of a rectangle, with their quantity, unit and size.

    NumPy functions, operators and indices use the array ``values`` and return plain arrays and numbers.

    Attributes
    ----------
    values : ndarray, shape (n_x, n_y)
        Values at the nodes; booleans for contact maps.
    quantity : str
        ``"pressure"``, ``"gap"``, ``"displacement"`` or ``"contact"``.
    unit : str or None
        Unit of the values; None for contact maps, and if the study gives no unit.
    size : (float, float)
        Sides along x and y: nodes × spacing.
    length_unit : str or None
        Unit of the sides; None if the study gives no unit.
    load : float
        Load of the map, as in the manifest.
    load_unit : str or None
        Unit of the load: ``"E* × rms slope"``, or the unit of pressures.

    Examples
    --------
    >>> gap = Map([[0.0, 0.2], [0.1, 0.3]], size=2.0, quantity="gap", unit="µm", length_unit="µm",
    ...           load=10.0, load_unit="MPa")
    >>> gap.spacing, round(float(gap.values.mean()), 12)
    ((1.0, 1.0), 0.15)
    >>> 2.0 * gap > 0.3
    array([[False,  True],
           [False,  True]])
    """

    def __init__(
        self,
        values: ArrayLike,
        size: Size,
        *,
        quantity: str,
        unit: Optional[str],
        length_unit: Optional[str],
        load: float,
        load_unit: Optional[str],
    ) -> None:
        self.values: NDArray[Any] = np.asarray(values)
        self.size, _ = sides_of(size)
        self.quantity = quantity
        self.unit = unit
        self.length_unit = length_unit
        self.load = load
        self.load_unit = load_unit

    @property
    def nodes(self) -> Tuple[int, int]:
        """Numbers of nodes along x and y."""
        along_x, along_y = self.values.shape
        return along_x, along_y

    @property
    def spacing(self) -> Tuple[float, float]:
        """Distances between neighbouring nodes along x and y."""
        (nodes_x, nodes_y), (size_x, size_y) = self.nodes, self.size
        return size_x / nodes_x, size_y / nodes_y

    def plot(self, axes: "Optional[Axes]" = None, **image: Any) -> "Axes":
        """Draws the map with a colour bar; requires matplotlib.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Axes to draw on; default: new axes.
        **image
            Arguments for ``Axes.imshow``.
        """
        from asperity._picture import draw_map

        label = f"{self.quantity} ({self.unit})" if self.unit else self.quantity
        return draw_map(axes, self.values, self.size, self.length_unit or "length", label, image)

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> NDArray[Any]:
        return as_array(self.values, dtype, copy)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        arrays = (value.values if isinstance(value, Map) else value for value in inputs)
        return getattr(ufunc, method)(*arrays, **options)

    def __getitem__(self, index: Any) -> Any:
        return self.values[index]

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        (nodes_x, nodes_y), (size_x, size_y) = self.nodes, self.size
        # `repr` escapes control characters in units that come from files.
        unit, load_unit, length_unit = (
            repr(unit)[1:-1] if unit else "" for unit in (self.unit, self.load_unit, self.length_unit)
        )
        quantity = f"{self.quantity} in {unit}" if unit else self.quantity
        load = f"{self.load:g} {load_unit}".rstrip()
        size = f"{size_x:g} × {size_y:g} {length_unit}".rstrip()
        return f"<asperity.Map: {quantity} under {load}, {nodes_x} × {nodes_y} nodes, {size}>"

    def _repr_html_(self) -> str:
        from asperity._picture import picture

        return f"<p>{escape(repr(self))}</p>{picture(self.plot)}"
