"""Persson's theory of contact: the distribution of pressures obeys a diffusion equation.

Pressure zero is an absorbing boundary: where the pressure reaches zero, the surfaces separate.

Loads y are mean pressures in units of E* × rms slope, and areas are fractions of the apparent area. For any
spectrum, a = erf(√2 y) (B. N. J. Persson, *J. Chem. Phys.* 115, 2001, 3840).

Every function accepts a number or an array of any shape and returns the same shape.

>>> from asperity import persson
>>> round(persson.area(0.5), 6)
0.682689
>>> persson.load([0.0, 0.5]).round(6)
array([0.      , 0.337245])
"""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from asperity import _asperity
from asperity._arrays import each

__all__ = [
    "approach",
    "area",
    "curvature",
    "load",
    "load_leaving",
    "noncontact",
    "pressure_density",
    "slope",
    "slope_curvature",
]


def _of(function: str, values: ArrayLike, load: float = 0.0) -> Any:
    return each(lambda values: _asperity.persson(function, values, load), values)


def area(load: ArrayLike) -> Any:
    """Returns the area fraction a = erf(√2 y).

    Parameters
    ----------
    load : array_like
        Loads y ≥ 0, in units of E* × rms slope.

    Returns
    -------
    ndarray or float
        Area fractions.

    Examples
    --------
    >>> area([0.0, 0.01]).round(8)
    array([0.        , 0.01595663])
    """
    return _of("area", load)


def noncontact(load: ArrayLike) -> Any:
    """Returns the non-contact fraction 1 − a, with full relative precision up to y ≈ 18.

    Examples
    --------
    >>> f"{noncontact(3.0):.6e}"
    '1.973175e-09'
    """
    return _of("noncontact", load)


def slope(load: ArrayLike) -> Any:
    """Returns the slope da/dy, which is √(8/π) at zero load.

    Examples
    --------
    >>> round(slope(0.0), 12)
    1.595769121606
    """
    return _of("slope", load)


def curvature(load: ArrayLike) -> Any:
    """Returns the curvature d²a/dy².

    Examples
    --------
    >>> curvature(0.0)
    -0.0
    """
    return _of("curvature", load)


def slope_curvature(load: ArrayLike) -> Any:
    """Returns d³a/dy³, the curvature of the slope, which vanishes at y = 1/2.

    Examples
    --------
    >>> slope_curvature(0.5)
    0.0
    """
    return _of("slope_curvature", load)


def load(area: ArrayLike) -> Any:
    """Returns the load at an area fraction; NaN outside [0, 1).

    Examples
    --------
    >>> round(load(0.5), 12)
    0.337244875098
    """
    return _of("load", area)


def load_leaving(noncontact: ArrayLike) -> Any:
    """Returns the load at a non-contact fraction; NaN outside (0, 1].

    Near full contact, it is more precise than :func:`load`, which loses digits in 1 − a.

    Examples
    --------
    >>> round(load_leaving(1e-20), 6)
    4.668022
    """
    return _of("load_leaving", noncontact)


def approach(load: ArrayLike) -> Any:
    """Returns F(y) = −ln[(1 − a) y √(2π)], which tends to 2y² near full contact.

    Eq. (10) of Yastrebov, Anciaux & Molinari, *Int. J. Solids Struct.* 52 (2015) 83.

    Examples
    --------
    >>> round(approach(5.0) / 50, 4)
    1.0002
    """
    return _of("approach", load)


def pressure_density(load: float, pressure: ArrayLike) -> Any:
    """Returns the probability density of the contact pressure; its integral is the area fraction.

    Parameters
    ----------
    load : float
        Load y, in units of E* × rms slope.
    pressure : array_like
        Pressures in the same unit; the density is zero for pressures ≤ 0.

    Examples
    --------
    >>> import numpy
    >>> pressure = numpy.linspace(0, 8, 4001)
    >>> density = pressure_density(0.1, pressure)
    >>> round(float(density.sum() * 0.002), 6) == round(area(0.1), 6)
    True
    """
    return _of("pressure_density", pressure, float(load))
