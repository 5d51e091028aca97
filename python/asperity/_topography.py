"""Height maps with their preparation, statistics and plots."""

from __future__ import annotations

import os
import warnings
from html import escape
from numbers import Real
from typing import TYPE_CHECKING, Any, Callable, Dict, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity import _asperity
from asperity._arrays import Quantity, Reals, Size, as_array, each, heights_of, sides_of
from asperity._table import Table
from asperity.errors import ArgumentError, StudyWarning, SurfaceError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Relative difference up to which sides of two maps are equal, because files contain rounded sides.
_SIZE_TOLERANCE = 1e-9


class PowerSpectrum(NamedTuple):
    """Power spectral density, averaged over rings of wavevectors.

    Attributes
    ----------
    wavenumber : ndarray, shape (n,)
        Angular wavenumbers q = 2π/λ, in 1/length.
    density : ndarray, shape (n,)
        Mean of C(q) over each ring, in length⁴; ∫ C d²q/(2π)² is the mean square height.
    modes : ndarray of int, shape (n,)
        Number of modes of each ring.
    """

    wavenumber: Reals
    density: Reals
    modes: NDArray[np.int64]


class Topography:
    """Heights on the nodes of a rectangle, positive towards the elastic body.

    ``a + b`` and ``a - b`` add and subtract heights node by node; both maps need the same nodes, sides and
    unit, and the result is periodic if both are. ``2.0 * a``, ``a / 2.0`` and ``-a`` scale heights.
    ``numpy.asarray(a)`` returns the heights with NaN where they are missing.

    Parameters
    ----------
    heights : array_like, shape (n_x, n_y)
        Heights; masked and non-finite points are missing. A C-contiguous float64 array is not copied, so do
        not change it afterwards.
    size : float or str, or a pair of them
        Sides of the map along x and y: nodes × spacing. Numbers are in the unit of the heights, and texts such
        as ``"100 um"`` are converted to it.
    unit : str, optional
        Unit of heights and sides; default: the unit of `size`, if that is a text.
    is_periodic : bool
        True if the surface is periodic.

    Raises
    ------
    SurfaceError
        If `heights` is not a two-dimensional array, or if a side is not positive.
    ArgumentError
        If a text is not a length.

    Warns
    -----
    StudyWarning
        If the unit is known and the rms slope is above 1, so that heights or sides are probably in another unit.

    Examples
    --------
    >>> import numpy
    >>> x = numpy.arange(64) / 64
    >>> wave = Topography(0.01 * numpy.cos(2 * numpy.pi * x)[:, None] * numpy.ones(64), size=1.0,
    ...                   is_periodic=True)
    >>> wave.nodes, wave.spacing
    ((64, 64), (0.015625, 0.015625))
    >>> round(wave.statistics()["rms_slope"], 6)
    0.044429
    >>> round((wave + 2.0 * wave).statistics()["rms_slope"], 6)
    0.133286
    """

    unit: Optional[str]
    # Arrays and numbers of NumPy leave operators to this class.
    __array_priority__ = 1.0

    def __init__(
        self,
        heights: ArrayLike,
        size: Size,
        *,
        unit: Optional[str] = None,
        is_periodic: bool = False,
    ) -> None:
        self._set(heights, size, unit, is_periodic)
        # Without a unit, a contact warns: many maps are never pressed, and may have any slope.
        self._is_unchecked = self.unit is None
        if self.unit is not None:
            self._warn(has_given_sides=True)

    @classmethod
    def _of(cls, heights: ArrayLike, size: Size, unit: Optional[str], is_periodic: bool) -> "Topography":
        """Returns a map that the library has made, without a warning about its unit."""
        made = cls.__new__(cls)
        made._set(heights, size, unit, is_periodic)
        return made

    def _set(self, heights: ArrayLike, size: Size, unit: Optional[str], is_periodic: bool) -> None:
        self._is_unchecked = False
        self._heights = heights_of(heights)
        self._size, self.unit = sides_of(size, unit)
        self._is_periodic = bool(is_periodic)
        self._rms_slope: Optional[float] = None
        self._description: Optional[Table] = None
        if not (min(self._size) > 0 and np.isfinite(self._size).all()):
            raise SurfaceError(f"size is {self._size}, but both sides must be positive and finite")
        if self._heights.size == 0:
            raise SurfaceError("a surface needs at least one node")

    def _warn(self, has_given_sides: bool) -> None:
        """Warns if heights or sides are probably in another unit."""
        for message in _asperity.implausible((self._heights, self._size), self.unit, has_given_sides):
            warnings.warn(message, StudyWarning, stacklevel=3)

    @property
    def heights(self) -> "np.ma.MaskedArray[Any, np.dtype[np.float64]]":
        """Heights, shape (n_x, n_y), with missing points masked; a view of the topography's memory."""
        return np.ma.masked_invalid(self._heights, copy=False)

    @property
    def values(self) -> Reals:
        """Heights, shape (n_x, n_y), with NaN where they are missing; the topography's memory."""
        return self._heights

    @property
    def nodes(self) -> Tuple[int, int]:
        """Numbers of nodes along x and y."""
        along_x, along_y = self._heights.shape
        return along_x, along_y

    @property
    def size(self) -> Tuple[float, float]:
        """Sides along x and y: nodes × spacing."""
        return self._size

    @property
    def spacing(self) -> Tuple[float, float]:
        """Distances between neighbouring nodes along x and y."""
        (nodes_x, nodes_y), (size_x, size_y) = self.nodes, self.size
        return size_x / nodes_x, size_y / nodes_y

    @property
    def is_periodic(self) -> bool:
        """True if the surface is periodic."""
        return self._is_periodic

    @property
    def missing(self) -> int:
        """Number of missing points."""
        return int(np.count_nonzero(~np.isfinite(self._heights)))

    @property
    def description(self) -> Optional[Table]:
        """Table row of a `generate` stage for a generated surface; None for other surfaces."""
        return self._description

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> NDArray[Any]:
        return as_array(self._heights, dtype, copy)

    def __add__(self, other: "Topography") -> "Topography":
        return self._combined(other, "added", np.add)

    def __sub__(self, other: "Topography") -> "Topography":
        return self._combined(other, "subtracted", np.subtract)

    def __mul__(self, factor: float) -> "Topography":
        return self._changed(self._heights * _number(factor))

    __rmul__ = __mul__

    def __truediv__(self, divisor: float) -> "Topography":
        return self._changed(self._heights / _number(divisor))

    def __neg__(self) -> "Topography":
        return self._changed(-self._heights)

    def _combined(self, other: "Topography", verb: str, combine: Callable[[Reals, Reals], Reals]) -> "Topography":
        """Returns heights that are combined node by node.

        Raises
        ------
        SurfaceError
            If the maps differ in nodes, sides or unit.
        TypeError
            If `other` is not a topography.
        """
        if not isinstance(other, Topography):
            raise TypeError(
                f"only topographies can be {verb}, but one is of type {type(other).__name__}; create "
                "`asperity.Topography(heights, size=…)` first, or use the array `values`"
            )
        is_same_size = np.allclose(self.size, other.size, rtol=_SIZE_TOLERANCE, atol=0.0)
        for is_same, names, ours, theirs in [
            (self.nodes == other.nodes, "numbers of nodes", self.nodes, other.nodes),
            (is_same_size, "sizes", self.size, other.size),
            (self.unit == other.unit, "units", repr(self.unit), repr(other.unit)),
        ]:
            if not is_same:
                raise SurfaceError(f"maps cannot be {verb}, because their {names} differ: {ours} and {theirs}")
        is_periodic = self._is_periodic and other._is_periodic
        combined = Topography._of(combine(self._heights, other._heights), self._size, self.unit, is_periodic)
        combined._is_unchecked = self._is_unchecked or other._is_unchecked
        return combined

    def mirror(self) -> "Topography":
        """Returns the map reversed along x, as a surface that is turned over towards the other body.

        Examples
        --------
        >>> Topography([[1.0, 2.0], [3.0, 4.0]], size=1.0).mirror().values.tolist()
        [[3.0, 4.0], [1.0, 2.0]]
        """
        return self._changed(self._heights[::-1])

    def detrend(self, form: str = "plane") -> "Topography":
        """Returns the map minus a form that is fitted to the measured points.

        Parameters
        ----------
        form : ``"plane"``, ``"mean"``, ``"quadric"`` or ``"none"``
            Form to subtract: the mean plane, the mean height, the mean quadric, or nothing. (In
            SurfaceTopography: ``height``, ``center``, ``curvature``.)

        Examples
        --------
        >>> tilted = Topography([[0.0, 1.0], [1.0, 2.0]], size=1.0)
        >>> bool(abs(tilted.detrend().heights).max() < 1e-15)
        True
        """
        return self._changed(_asperity.level((self._heights, self._size), form))

    def level_through(self, a: Sequence[float], b: Sequence[float], c: Sequence[float]) -> "Topography":
        """Returns the map minus the plane through the heights of the nodes nearest to three positions.

        Parameters
        ----------
        a, b, c : (float, float)
            Positions x, y relative to the first node, not on one line.

        Raises
        ------
        SurfaceError
            If a position is outside the map or was not measured, or if the positions are on one line.

        Examples
        --------
        >>> tilted = Topography([[0.0, 1.0], [1.0, 5.0]], size=2.0)
        >>> tilted.level_through((0, 0), (0, 1), (1, 0)).values.tolist()
        [[0.0, 0.0], [0.0, 3.0]]
        """
        points = [(float(x), float(y)) for x, y in (a, b, c)]
        return self._changed(_asperity.level_through((self._heights, self._size), points))

    def align(self, by: str = "median", along: str = "x", degree: int = 1) -> "Topography":
        """Returns the map with its scan lines aligned, which removes the offsets between them.

        A tilt and waves across the lines are removed, too. The mean height stays.

        Parameters
        ----------
        by : ``"median"``, ``"differences"`` or ``"polynomial"``
            Function that is subtracted from each line: its median, the sum of the medians of the differences
            of neighbouring lines, or its least-squares polynomial.
        along : ``"x"`` or ``"y"``
            Direction of the lines, the fast axis of the scan.
        degree : int
            Degree of the polynomial, at most 5.

        Examples
        --------
        >>> Topography([[1.0, 11.0], [2.0, 12.0], [3.0, 13.0]], size=1.0).align().values.tolist()
        [[6.0, 6.0], [7.0, 7.0], [8.0, 8.0]]
        """
        return self._changed(_asperity.align((self._heights, self._size), by, along, degree))

    def remove_spikes(self, threshold: float = 8.0, window: int = 5) -> "Topography":
        """Returns the map with its spikes missing; call :meth:`fill` to fill them.

        Align the scan lines first if they have offsets.

        Parameters
        ----------
        threshold : float
            Distance of a spike from the median of its neighbours, in standard deviations of this distance over
            the map, which are estimated from the median absolute distance.
        window : int
            Odd number of points along each side of the window of neighbours.

        Examples
        --------
        >>> import numpy
        >>> x = numpy.arange(32) / 32
        >>> heights = numpy.sin(2 * numpy.pi * x)[:, None] * numpy.cos(2 * numpy.pi * x)
        >>> heights[20, 10] += 1.0
        >>> left = Topography(heights, size=1.0).remove_spikes()
        >>> left.missing, bool(left.heights.mask[20, 10])
        (1, True)
        """
        found = _asperity.remove_spikes((self._heights, self._size), threshold, window, self._is_periodic)
        return self._changed(found)

    def remove_islands(self, points: int) -> "Topography":
        """Returns the map without islands: groups of at most `points` points that missing points surround.

        Examples
        --------
        >>> nan = float("nan")
        >>> Topography([[1.0, 2.0, nan, 9.0]], size=1.0).remove_islands(1).values.tolist()
        [[1.0, 2.0, nan, nan]]
        """
        left = _asperity.remove_islands((self._heights, self._size), points, self._is_periodic)
        return self._changed(left)

    def fill(self, method: str = "harmonic") -> "Topography":
        """Returns the map with its missing points filled.

        Parameters
        ----------
        method : ``"harmonic"``, ``"nearest"`` or ``"lowest"``
            Solution of Laplace's equation in each hole, nearest measured height, or lowest height.

        Raises
        ------
        SurfaceError
            If all points are missing.

        Examples
        --------
        >>> holey = Topography([[1.0, 1.0, 1.0], [1.0, float("nan"), 1.0], [1.0, 1.0, 1.0]], size=1.0)
        >>> holey.missing, float(holey.fill().heights[1, 1])
        (1, 1.0)
        """
        filled = _asperity.fill((self._heights, self._size), method, self._is_periodic)
        return self._changed(filled)

    def crop(self, origin: Sequence[Quantity], size: Size) -> "Topography":
        """Returns a rectangular part of the map, which is not periodic.

        Parameters
        ----------
        origin : (float, float)
            Position of the first node of the part, relative to the first node of the map.
        size : float or str, or a pair of them
            Sides of the part; position and sides are rounded to whole nodes.

        Raises
        ------
        SurfaceError
            If the part exceeds the map.

        Examples
        --------
        >>> import numpy
        >>> whole = Topography(numpy.zeros((8, 8)), size=4.0)
        >>> whole.crop((1.0, 0.0), (2.0, 4.0)).nodes
        (4, 8)
        """
        start, unit_of_origin = sides_of(origin, self.unit)
        part, unit_of_size = sides_of(size, self.unit)
        if not unit_of_origin == unit_of_size == self.unit:
            raise ArgumentError("the map has no unit, so that `origin` and `size` must be numbers")
        heights, sides = _asperity.crop((self._heights, self._size), start, part)
        cropped = Topography._of(heights, sides, self.unit, False)
        cropped._is_unchecked = self._is_unchecked
        return cropped

    def to_surfacetopography(self) -> Any:
        """Returns the map as a ``SurfaceTopography.Topography``, which has to be installed.

        Sides, unit and periodicity stay, and missing points are masked. The heights are a copy.
        """
        from SurfaceTopography import Topography as Converted

        heights = np.ma.masked_invalid(self._heights) if self.missing else self._heights.copy()
        return Converted(heights, self._size, unit=self.unit, periodic=self._is_periodic)

    def to_gwy(self, path: "Union[str, os.PathLike[str]]") -> None:
        """Writes the map to a file of Gwyddion, ``.gwy``, with missing points under a mask.

        Lengths are converted to metres, if the map has a unit of length. The first line of the file has y = 0.
        :func:`read`, SurfaceTopography and surfalize take points under the mask for missing ones.

        Parameters
        ----------
        path : str or path
            Path of the file. Another file of Gwyddion is overwritten.

        Raises
        ------
        ArgumentError
            If the path is that of a file of another kind.

        Examples
        --------
        >>> import asperity, os, tempfile
        >>> path = os.path.join(tempfile.mkdtemp(), "map.gwy")
        >>> Topography([[1.0, 2.0], [3.0, float("nan")]], size="100 um").to_gwy(path)
        >>> back = asperity.read(path)
        >>> back.size, back.unit, back.missing
        ((0.0001, 0.0001), 'm', 1)
        """
        _asperity.write_gwyddion(os.fspath(path), (self._heights, self._size), self.unit)

    def statistics(self) -> Dict[str, float]:
        """Computes statistics of the heights, named like table columns.

        Spectral moments are computed from the Fourier modes of periodic maps, and from differences between nodes
        of other maps. Lengths are in the unit of the map.

        Returns
        -------
        dict
            ``rms_height``, ``rms_slope`` √⟨|∇h|²⟩, ``nayak`` m0 m4/m2², ``skewness``, ``excess_kurtosis``,
            ``sa``, ``sz``, ``summit_density`` (1/length²), and for periodic maps ``effective_modes`` and
            ``full_contact_load`` (E* × rms slope). Undefined values, such as those of flat maps, are NaN.

        Raises
        ------
        SurfaceError
            If points are missing; call :meth:`fill` first.
        """
        found = _asperity.statistics((self._heights, self._size), self._is_periodic)
        return {name: np.nan if value is None else value for name, value in found}

    def areal_parameters(
        self,
        *,
        peak_ratio: float = 0.1,
        dale_ratio: float = 0.8,
        correlation_threshold: float = 0.2,
        pruning: float = 0.05,
    ) -> Dict[str, float]:
        """Computes the areal surface texture parameters of ISO 25178-2, with their names there.

        The map should be levelled and filled first, see :meth:`detrend` and :meth:`fill`. Heights are measured from
        their mean. Lengths are in the unit of the map, ratios such as ``Smr1`` and ``Sdr`` are fractions.

        Parameters
        ----------
        peak_ratio, dale_ratio : float
            Material ratios p and q of the volumes.
        correlation_threshold : float
            Fraction of its value at lag zero to which the autocorrelation function falls over ``Sal``.
        pruning : float
            Height of the lowest hills that count as peaks, as a fraction of ``Sz``.

        Returns
        -------
        dict
            ``Sq``, ``Ssk``, ``Sku``, ``Sp``, ``Sv``, ``Sz``, ``Sa``; ``Sdq``, ``Sdr``; ``Sal``, ``Str``, ``Std`` in
            degrees; ``Sk``, ``Spk``, ``Svk``, ``Smr1``, ``Smr2``; ``Vmp``, ``Vmc``, ``Vvc``, ``Vvv``; ``Spd``,
            ``Spc``. Undefined values are NaN, such as ``Str`` of a grating, whose autocorrelation function does not
            fall along its ridges.

        Raises
        ------
        ArgumentError
            If a ratio, threshold or height is out of range.
        SurfaceError
            If points are missing; call :meth:`fill` first.

        Examples
        --------
        >>> import asperity
        >>> wave = asperity.surface(nodes=256, method="wave-product", amplitude=0.1, waves=2)
        >>> found = wave.areal_parameters()
        >>> [round(found[name], 4) for name in ["Sq", "Sz", "Sku", "Spd"]]
        [0.05, 0.2, 2.25, 8.0]
        """
        ratios = (float(peak_ratio), float(dale_ratio))
        threshold, lowest = float(correlation_threshold), float(pruning)
        found = _asperity.areal_parameters((self._heights, self._size), self._is_periodic, ratios, threshold, lowest)
        return {name: np.nan if value is None else value for name, value in found}

    def smr(self, height: ArrayLike) -> Any:
        """Returns the areal material ratio Smr(c): the fraction of the nodes at or above a height.

        Parameters
        ----------
        height : array_like
            Heights c above the mean.

        Raises
        ------
        SurfaceError
            If points are missing; call :meth:`fill` first.

        Examples
        --------
        >>> Topography([[0.0, 1.0], [2.0, 3.0]], size=1.0).smr([-0.5, 0.0, 2.0])
        array([0.75, 0.5 , 0.  ])
        """
        return each(lambda values: _asperity.material_ratio((self._heights, self._size), "smr", values), height)

    def smc(self, ratio: ArrayLike) -> Any:
        """Returns the inverse areal material ratio Smc(mr): the height above the mean that a fraction reaches.

        Parameters
        ----------
        ratio : array_like
            Material ratios mr from 0 to 1.

        Raises
        ------
        SurfaceError
            If points are missing; call :meth:`fill` first.

        Examples
        --------
        >>> Topography([[0.0, 1.0], [2.0, 3.0]], size=1.0).smc(0.5)
        0.0
        """
        return each(lambda values: _asperity.material_ratio((self._heights, self._size), "smc", values), ratio)

    def power_spectrum(self) -> PowerSpectrum:
        """Computes the power spectral density, averaged over rings of wavevectors.

        A map that is not periodic is multiplied by a Hann window first.

        Raises
        ------
        SurfaceError
            If points are missing; call :meth:`fill` first.

        Examples
        --------
        >>> import asperity
        >>> rough = asperity.surface(nodes=64, hurst=0.8, k_lower=2, k_upper=16, seed=1)
        >>> spectrum = rough.power_spectrum()
        >>> square_height = (spectrum.density * spectrum.modes).sum()
        >>> bool(abs(square_height / rough.statistics()["rms_height"] ** 2 - 1) < 1e-12)
        True
        """
        return PowerSpectrum(*_asperity.power_spectrum((self._heights, self._size), self._is_periodic))

    def plot(self, axes: "Optional[Axes]" = None, **image: Any) -> "Axes":
        """Draws the heights; requires matplotlib.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Axes to draw on; default: new axes.
        **image
            Arguments for ``Axes.imshow``.
        """
        from asperity._picture import draw_map

        unit = self.unit or "length"
        return draw_map(axes, self.heights, self._size, unit, f"height ({unit})", image)

    def _changed(self, heights: Reals) -> "Topography":
        changed = Topography._of(heights, self._size, self.unit, self._is_periodic)
        changed._is_unchecked = self._is_unchecked
        return changed

    def __repr__(self) -> str:
        (nodes_x, nodes_y), (size_x, size_y) = self.nodes, self.size
        # `repr` escapes control characters in units that come from files.
        unit = f" {repr(self.unit)[1:-1]}" if self.unit else ""
        kind = "periodic" if self._is_periodic else "not periodic"
        missing = f", {self.missing} points missing" if self.missing else ""
        return (
            f"<asperity.Topography: {nodes_x} × {nodes_y} nodes, {size_x:g} × {size_y:g}{unit}, "
            f"{kind}{missing}>"
        )

    def _repr_html_(self) -> str:
        from asperity._picture import picture

        return f"<p>{escape(repr(self))}</p>{picture(self.plot)}"


def _number(factor: float) -> float:
    # Not NotImplemented, because NumPy would then multiply arrays with the heights and drop the size.
    if not isinstance(factor, Real):
        raise TypeError(f"heights are scaled by a number, not by {type(factor).__name__}; use the array `values`")
    return float(factor)
