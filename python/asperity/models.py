"""Asperity models: rough contact as the sum of independent Hertz contacts of the summits.

Isotropic Gaussian roughness enters only by Nayak's parameter α = m0 m4/m2² ≥ 3/2. Separations s are in
units of the rms height, loads y in units of E* × rms slope, and areas are fractions of the apparent area.

>>> from asperity import models
>>> model = models.bush_gibson_thomas(5.0)
>>> contact = model.at_load([0.001, 0.01])
>>> (contact.area / contact.load).round(3)
array([2.171, 1.987])
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from asperity import _asperity

__all__ = [
    "AsperityModel",
    "Contacts",
    "bush_gibson_thomas",
    "greenwood_williamson",
    "mean_curvature",
    "simplified_elliptic",
]


class Contacts(NamedTuple):
    """Contacts at several separations or loads; each attribute is a number or an array.

    Attributes
    ----------
    separation : ndarray or float
        Distance s of the flat from the mean plane, in units of the rms height.
    load : ndarray or float
        Mean pressure y, in units of E* × rms slope.
    area : ndarray or float
        Contact area a as a fraction of the apparent area. It exceeds 1 at heavy loads, where the models are
        invalid.
    slope : ndarray or float
        Derivative da/dy.
    stiffness : ndarray or float
        Derivative −dy/ds.
    """

    separation: Any
    load: Any
    area: Any
    slope: Any
    stiffness: Any


class AsperityModel:
    """Asperity model for roughness with a given Nayak parameter.

    Parameters
    ----------
    name : str
        ``bush-gibson-thomas``, ``simplified-elliptic``, ``mean-curvature`` or
        ``greenwood-williamson``.
    nayak : float
        Nayak's parameter α, at least 3/2.
    """

    def __init__(self, name: str, nayak: float) -> None:
        self.name = name
        self.nayak = float(nayak)
        # Raises an error for an invalid Nayak parameter.
        self.at_separation(0.0)

    def at_separation(self, separation: ArrayLike) -> Contacts:
        """Returns the contacts at these separations, in units of the rms height.

        Examples
        --------
        >>> round(bush_gibson_thomas(5.0).at_separation(2.0).load, 5)
        0.00416
        """
        return self._at("separation", separation)

    def at_load(self, load: ArrayLike) -> Contacts:
        """Returns the contacts at these loads, in units of E* × rms slope.

        The result is NaN for loads that no separation gives.

        Examples
        --------
        >>> round(bush_gibson_thomas(5.0).at_load(0.01).load, 12)
        0.01
        """
        return self._at("load", load)

    def _at(self, at: str, values: ArrayLike) -> Contacts:
        array = np.asarray(values, dtype=np.float64)
        flat = np.ascontiguousarray(array).reshape(-1)
        columns = _asperity.asperities(self.name, self.nayak, at, flat)
        shaped = (column.reshape(array.shape) for column in columns)
        return Contacts(*(float(one) if one.ndim == 0 else one for one in shaped))

    def __repr__(self) -> str:
        return f"<asperity.models.AsperityModel: {self.name}, α = {self.nayak}>"


def bush_gibson_thomas(nayak: float) -> AsperityModel:
    """Returns the model of elliptic Hertz contacts of all summits (Bush, Gibson & Thomas, *Wear* 35, 1975, 87).

    Examples
    --------
    >>> bush_gibson_thomas(3.0)
    <asperity.models.AsperityModel: bush-gibson-thomas, α = 3.0>
    """
    return AsperityModel("bush-gibson-thomas", nayak)


def simplified_elliptic(nayak: float) -> AsperityModel:
    """Returns the model of spheres whose curvature is the geometric mean of the principal curvatures.

    Source: Greenwood, *Wear* 261 (2006) 191.
    """
    return AsperityModel("simplified-elliptic", nayak)


def mean_curvature(nayak: float) -> AsperityModel:
    """Returns the Nayak-Thomas model: spheres of the arithmetic mean of the principal curvatures."""
    return AsperityModel("mean-curvature", nayak)


def greenwood_williamson(nayak: float) -> AsperityModel:
    """Returns the model of spheres with one radius.

    Sources: Greenwood & Williamson (1966), with the parameters of McCool (1986).
    """
    return AsperityModel("greenwood-williamson", nayak)
