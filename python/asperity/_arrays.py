"""Conversion of user arguments to arrays for the extension module."""

from __future__ import annotations

from typing import Any, Callable, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity import _asperity

#: A number, or a text with a unit such as ``"100 um"``.
Quantity = Union[float, str]

#: One side for squares, or the sides along x and y; each may be a text with a unit.
Size = Union[Quantity, Sequence[Quantity]]

Reals = NDArray[np.float64]


def heights_of(heights: ArrayLike) -> Reals:
    """Returns heights as a C-contiguous float64 array, with NaN where masked; copies only if necessary."""
    if np.iscomplexobj(heights):
        from asperity.errors import SurfaceError

        raise SurfaceError("heights must be real numbers, but are complex")
    if isinstance(heights, np.ma.MaskedArray):
        heights = np.ma.filled(heights.astype(np.float64), np.nan)
    array = np.ascontiguousarray(heights, dtype=np.float64)
    if array.ndim != 2:
        from asperity.errors import SurfaceError

        raise SurfaceError(f"heights must be a two-dimensional array [x, y], but have the shape {array.shape}")
    return array


def sides_of(size: Size, unit: Optional[str] = None) -> Tuple[Tuple[float, float], Optional[str]]:
    """Returns the sides along x and y with their unit: `unit`, or if it is None that of the first text."""
    both = (size, size) if isinstance(size, (int, float, str, np.integer, np.floating)) else tuple(size)
    if len(both) != 2:
        from asperity.errors import ArgumentError

        raise ArgumentError(f"size is {size!r}, but must be one side or a pair of sides")
    if unit is None:
        unit = next((_asperity.length(side)[1] for side in both if isinstance(side, str)), None)
        if unit is not None and not all(isinstance(side, str) for side in both):
            from asperity.errors import ArgumentError

            raise ArgumentError(f"size is {size!r}, but only one of the sides has a unit")
    along_x, along_y = (_asperity.length(side, unit)[0] if isinstance(side, str) else float(side) for side in both)
    return (along_x, along_y), unit


def each(function: Callable[[Reals], Reals], values: ArrayLike) -> Any:
    """Applies a function of 1-d arrays to an array of any shape; returns a float for a scalar."""
    array = np.asarray(values, dtype=np.float64)
    result = function(np.ascontiguousarray(array).reshape(-1)).reshape(array.shape)
    return float(result) if result.ndim == 0 else result


def as_array(values: NDArray[Any], dtype: Any, copy: Optional[bool]) -> NDArray[Any]:
    """Converts values as NumPy's `__array__` requires; `copy` is None if a copy is made only if necessary."""
    if copy:
        return np.array(values, dtype=dtype)
    array = np.asarray(values, dtype=dtype)
    if copy is False and not np.shares_memory(array, values):
        raise ValueError(f"values of type {values.dtype} cannot be converted to {array.dtype} without a copy")
    return array
