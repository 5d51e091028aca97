"""Contact evolution law and corrections of the contact area."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from asperity import _asperity
from asperity._arrays import each
from asperity.errors import ArgumentError


@dataclass(frozen=True)
class EvolutionLaw:
    """Contact evolution law a = [β + (κy)^(−μ)]^(−1/μ).

    Eq. (cel) of Yastrebov, Anciaux & Molinari, *Int. J. Solids Struct.* 52 (2015) 83. Loads y are in units
    of E* × rms slope, and areas are fractions of the apparent area. All parameters are positive. Use a law
    only in the range of loads where it was fitted.

    Attributes
    ----------
    kappa : float
        Slope of the area at zero load: √(2π) in asperity models, √(8/π) in Persson's theory.
    beta, mu : float
        Factor and exponent of the growth of the mean contact pressure p̄ = p₀/a with the nominal pressure p₀:
        dp̄/dp₀ = β a^(μ−1).

    Examples
    --------
    >>> law = EvolutionLaw(kappa=2.5, beta=1.0, mu=1.0)
    >>> round(law.area(0.4), 12)
    0.5
    >>> round(law.load(0.5), 12)
    0.4
    """

    kappa: float
    beta: float
    mu: float

    def area(self, load: ArrayLike) -> Any:
        """Returns the area fraction at loads ≥ 0; the result has the shape of the loads, as in all methods."""
        return self._of("area", load)

    def slope(self, load: ArrayLike) -> Any:
        """Returns the slope da/dy."""
        return self._of("slope", load)

    def curvature(self, load: ArrayLike) -> Any:
        """Returns the curvature d²a/dy², which is never positive."""
        return self._of("curvature", load)

    def load(self, area: ArrayLike) -> Any:
        """Returns the load at an area fraction; NaN if the law never reaches the fraction."""
        return self._of("load", area)

    def mean_pressure(self, load: ArrayLike) -> Any:
        """Returns the mean contact pressure y/a, in units of E* × rms slope."""
        return self._of("mean_pressure", load)

    @classmethod
    def fit(
        cls,
        loads: ArrayLike,
        areas: ArrayLike,
        *,
        kappa: Union[float, str] = math.sqrt(2 * math.pi),
        window: Tuple[float, float] = (0.0, math.inf),
        quantity: str = "area",
    ) -> "EvolutionLaw":
        """Fits the law to area fractions at given loads, weighted by their scatter.

        Parameters
        ----------
        loads : array_like, shape (n,)
            Ascending loads in units of E* × rms slope.
        areas : array_like, shape (n,) or (surfaces, n)
            Area fractions of one surface or of several surfaces.
        kappa : float or ``"free"`` or ``"least-convex"``
            A fixed value, ``"free"`` to fit it, or ``"least-convex"`` for the smallest value that gives a convex
            fitted slope.
        window : tuple of float
            Smallest and largest load of the fit.
        quantity : ``"area"`` or ``"slope"``
            Fitted quantity: areas or their difference quotients.

        Returns
        -------
        EvolutionLaw
            The fitted law.

        Raises
        ------
        ArgumentError
            If `kappa` or `quantity` is not one of the values above.
        FitError
            If there are too few data, or if the fit fails.

        Examples
        --------
        >>> law = EvolutionLaw(kappa=2.5, beta=1.2, mu=0.6)
        >>> loads = np.linspace(0.01, 0.2, 20)
        >>> found = EvolutionLaw.fit(loads, law.area(loads), kappa=2.5)
        >>> round(found.beta, 6), round(found.mu, 6)
        (1.2, 0.6)
        """
        rows = np.ascontiguousarray(np.atleast_2d(np.asarray(areas, dtype=np.float64)))
        abscissae = np.ascontiguousarray(loads, dtype=np.float64)
        value: Optional[float] = None if isinstance(kappa, str) else float(kappa)
        if isinstance(kappa, str) and kappa not in ("free", "least-convex"):
            raise ArgumentError(f'kappa is "{kappa}", but must be a number, "free" or "least-convex"')
        parameters = _asperity.fit_evolution(
            abscissae, rows, window, quantity, value, kappa == "least-convex"
        )
        return cls(*parameters)

    def _of(self, function: str, values: ArrayLike) -> Any:
        law = (self.kappa, self.beta, self.mu)
        return each(lambda values: _asperity.evolution(law, function, values), values)


class CorrectedArea(NamedTuple):
    """Area of a contact map as fractions of the apparent area.

    Attributes
    ----------
    counted : float
        Fraction of the nodes in contact, which overestimates the area.
    corrected : float
        Counted area minus c S_d Δx: coefficient × Manhattan perimeter × mesh step.
    lower, upper : float
        Bounds of the area: without and with the contact nodes on the edge.
    """

    counted: float
    corrected: float
    lower: float
    upper: float


def corrected_area(
    contact: ArrayLike, *, coefficient: str = "2017", boundary: str = "periodic"
) -> CorrectedArea:
    """Corrects the contact area for the finite mesh, whose cells must be square.

    Parameters
    ----------
    contact : array_like of bool, shape (n_x, n_y)
        True for nodes in contact.
    coefficient : ``"2017"``, ``"pi/8"`` or ``"none"``
        Coefficient c: (π − 1 + ln 2)/24 (Yastrebov, Anciaux & Molinari, *Tribol. Int.* 114 (2017) 161), π/8
        (their paper of 2015), or 0.
    boundary : ``"periodic"`` or ``"free"``
        Boundary condition of the map: periodic, or an isolated patch.

    Raises
    ------
    ArgumentError
        If `contact` is not a two-dimensional array, or another argument is not one of the values above.

    Examples
    --------
    >>> square = np.zeros((16, 16), dtype=bool)
    >>> square[4:8, 4:8] = True
    >>> area = corrected_area(square)
    >>> area.counted, round(area.corrected, 6)
    (0.0625, 0.055118)
    """
    if boundary not in ("periodic", "free"):
        raise ArgumentError(f'boundary is "{boundary}", but must be "periodic" or "free"')
    contact = np.ascontiguousarray(contact, dtype=bool)
    if contact.ndim != 2:
        raise ArgumentError(f"contact has the shape {contact.shape}, but must be a map [x, y], such as `contact(0)`")
    return CorrectedArea(*_asperity.corrected_area(contact, coefficient, boundary == "periodic"))
