"""Arrays of the user's, as the extension takes them."""

from __future__ import annotations

from typing import Any, Callable, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: One side, or both.
Size = Union[float, Sequence[float]]

Reals = NDArray[np.float64]


def heights_of(heights: ArrayLike) -> Reals:
    """Heights as 64-bit numbers, row after row; NaN where they are masked. No copy, where they are that."""
    if np.iscomplexobj(heights):
        from asperity.errors import SurfaceError

        raise SurfaceError("heights are complex numbers, they must be real ones")
    if isinstance(heights, np.ma.MaskedArray):
        heights = np.ma.filled(heights.astype(np.float64), np.nan)
    array = np.ascontiguousarray(heights, dtype=np.float64)
    if array.ndim != 2:
        from asperity.errors import SurfaceError

        raise SurfaceError(f"heights have the shape {array.shape}, they must be an array [x, y]")
    return array


def sides_of(size: Size) -> Tuple[float, float]:
    """Sides along x and y."""
    if isinstance(size, (int, float, np.integer, np.floating)):
        return float(size), float(size)
    along_x, along_y = size
    return float(along_x), float(along_y)


def each(function: Callable[[Reals], Reals], values: ArrayLike) -> Any:
    """A function of lists of numbers, of an array of any shape: a number for a number."""
    array = np.asarray(values, dtype=np.float64)
    result = function(np.ascontiguousarray(array).reshape(-1)).reshape(array.shape)
    return float(result) if result.ndim == 0 else result
