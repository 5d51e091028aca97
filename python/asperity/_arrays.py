"""Conversion of user arguments to arrays for the extension module."""

from __future__ import annotations

from typing import Any, Callable, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: One side for squares, or the sides along x and y.
Size = Union[float, Sequence[float]]

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


def sides_of(size: Size) -> Tuple[float, float]:
    """Returns the sides along x and y."""
    if isinstance(size, (int, float, np.integer, np.floating)):
        return float(size), float(size)
    along_x, along_y = size
    return float(along_x), float(along_y)


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
