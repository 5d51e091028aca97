"""Functions that press a surface without a study."""

from __future__ import annotations

from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from asperity import _asperity
from asperity._arrays import Size
from asperity._contact import Contact, ContactState
from asperity._topography import Topography
from asperity.errors import ArgumentError, MissingArgumentError, SurfaceError

#: One load, several loads, or ``{"from", "to", "steps", "spacing"}``.
Loads = Union[ArrayLike, Mapping[str, Any]]


def press(
    heights: Union[Topography, ArrayLike],
    *,
    size: Optional[Size] = None,
    loads: Optional[Loads] = None,
    pressures: Optional[Loads] = None,
    effective_modulus: Optional[float] = None,
    bodies: Optional[Sequence[Mapping[str, float]]] = None,
    boundary: Optional[str] = None,
    hardness: Optional[float] = None,
    hardness_unit: Optional[str] = None,
    tolerance: Optional[float] = None,
    max_pairs: Optional[int] = None,
    fields: bool = True,
    jobs: Optional[int] = None,
) -> Contact:
    """Presses a rigid rough surface into an elastic half-space under a sequence of loads.

    Solves frictionless contact without adhesion by preconditioned conjugate gradients with FFT. The results
    are bitwise equal to those of a `solve` stage. Other Python threads run during the computation, and Ctrl-C
    interrupts it.

    Parameters
    ----------
    heights : Topography or array_like, shape (n_x, n_y)
        The surface; heights are positive towards the elastic body.
    size : float or (float, float), optional
        Sides along x and y, in the unit of the heights. Required for arrays, not allowed for a topography.
    loads : float, array_like or mapping
        Ascending mean pressures in units of E* × rms slope: numbers, or
        ``{"to": 0.1, "steps": 10, "from": 0, "spacing": "linear"}``.
    pressures : float, array_like or mapping
        Mean pressures in the unit of `effective_modulus`; alternative to `loads`.
    effective_modulus : float, optional
        Effective modulus E*, 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂; default: 1.
    bodies : sequence of mappings, optional
        ``{"youngs_modulus", "poisson_ratio"}`` of both bodies, or of one body if the other is rigid;
        alternative to `effective_modulus`.
    boundary : ``"periodic"`` or ``"free"``, optional
        Boundary condition: periodic, or free (an isolated patch). Required for arrays; default for a
        topography: ``"periodic"``. A topography that is not periodic requires ``"free"``.
    hardness : float, optional
        Maximum pressure of the material, in the unit of the modulus, or in the unit given by `hardness_unit`
        (``"absolute"`` or ``"relative"``); default: no limit.
    tolerance : float, optional
        Maximum error of the gap, in units of rms slope × mesh step: the gap in contact and the penetration
        outside it; default: 5e-5.
    max_pairs : int, optional
        Maximum number of pairs of transforms per load; default: 2000. The column ``stop`` marks loads that
        have not converged.
    fields : bool
        True to store the pressures, which takes 8 bytes per contact node; False to store contact maps only.
    jobs : int, optional
        Number of cores for surfaces of 512 × 512 nodes or more; default: all. The results do not depend on
        it.

    Returns
    -------
    Contact
        A table, and maps for each load: ``pressure(i)``, ``gap(i)``, ``displacement(i)``, ``contact(i)``.

    Raises
    ------
    ArgumentError
        If an argument is invalid.
    MissingArgumentError
        If `size` or `boundary` is missing for an array, or if both `loads` and `pressures` are missing. It is
        a TypeError and an ArgumentError.
    SurfaceError
        If points are missing, or if `boundary` is ``"periodic"`` but the map is not periodic.

    Notes
    -----
    Method: I. A. Polonsky & L. M. Keer, *Wear* 231 (1999) 206; V. A. Yastrebov, G. Anciaux & J.-F. Molinari,
    *Int. J. Solids Struct.* 52 (2015) 83. With `hardness`: A. Almqvist et al., *Tribol. Int.* 40 (2007) 574.

    Examples
    --------
    Westergaard's wave is flattened at the mean pressure π E* Δ/λ:

    >>> import numpy
    >>> x = numpy.arange(64) / 64
    >>> wave = 0.01 * numpy.cos(2 * numpy.pi * x)[:, None] * numpy.ones(64)
    >>> pressures = [0.5 * numpy.pi * 0.01, numpy.pi * 0.01]
    >>> contact = press(wave, size=1.0, boundary="periodic", pressures=pressures)
    >>> contact.area.round(1)
    array([0.5, 1. ])
    >>> bool(abs(contact.displacement(1) - wave).max() < 1e-12)
    True
    >>> contact.table["stop"]
    ['converged', 'full-contact']
    """
    keys = _keys(
        loads, pressures, effective_modulus, bodies, boundary, hardness, hardness_unit, tolerance, max_pairs
    )
    pressing, topography = _pressing(heights, size, boundary, keys, fields, jobs)
    while pressing.press():
        pass
    return Contact(pressing, topography)


def press_each(
    heights: Union[Topography, ArrayLike],
    *,
    size: Optional[Size] = None,
    loads: Optional[Loads] = None,
    pressures: Optional[Loads] = None,
    effective_modulus: Optional[float] = None,
    bodies: Optional[Sequence[Mapping[str, float]]] = None,
    boundary: Optional[str] = None,
    hardness: Optional[float] = None,
    hardness_unit: Optional[str] = None,
    tolerance: Optional[float] = None,
    max_pairs: Optional[int] = None,
    fields: bool = True,
    jobs: Optional[int] = None,
) -> Iterator[ContactState]:
    """Presses a surface like :func:`press` and yields each load when it is solved.

    Invalid arguments raise an error before the first load. Loads are solved on demand: leaving the loop ends
    the computation.

    Yields
    ------
    ContactState
        The contact at each load.

    Examples
    --------
    >>> import asperity
    >>> rough = asperity.surface(nodes=64, hurst=0.8, k_lower=2, k_upper=16, seed=1)
    >>> for state in press_each(rough, loads=[0.01, 0.1, 1.0]):
    ...     if state.area > 0.1:
    ...         break
    >>> state.load
    0.1
    """
    keys = _keys(
        loads, pressures, effective_modulus, bodies, boundary, hardness, hardness_unit, tolerance, max_pairs
    )
    pressing, _ = _pressing(heights, size, boundary, keys, fields, jobs)

    def each() -> Iterator[ContactState]:
        while pressing.press():
            yield ContactState(pressing, pressing.count() - 1)

    return each()


def _keys(
    loads: Optional[Loads],
    pressures: Optional[Loads],
    effective_modulus: Optional[float],
    bodies: Optional[Sequence[Mapping[str, float]]],
    boundary: Optional[str],
    hardness: Optional[float],
    hardness_unit: Optional[str],
    tolerance: Optional[float],
    max_pairs: Optional[int],
) -> Dict[str, Any]:
    """Returns the keys of a `solve` stage."""
    if (loads is None) == (pressures is None):
        kind = MissingArgumentError if loads is None else ArgumentError
        raise kind(
            "give either `loads` (in units of E* × rms slope) or `pressures` (in the unit of the modulus)"
        )
    return {
        "loads": _list(loads if pressures is None else pressures),
        "load_unit": "relative" if pressures is None else "absolute",
        "effective_modulus": effective_modulus,
        "bodies": None if bodies is None else [dict(body) for body in bodies],
        "boundary": boundary,
        "hardness": hardness,
        "hardness_unit": hardness_unit,
        "tolerance": tolerance,
        "max_pairs": max_pairs,
    }


def _list(loads: Optional[Loads]) -> Union[List[float], Dict[str, Any]]:
    if isinstance(loads, Mapping):
        return dict(loads)
    try:
        numbers: List[float] = np.asarray(loads, dtype=np.float64).reshape(-1).tolist()
    except (TypeError, ValueError):
        raise ArgumentError(
            f"loads are numbers, not {loads!r}: give `loads` in units of E* × rms slope, or `pressures` in the unit "
            "of `effective_modulus`"
        ) from None
    return numbers


def _pressing(
    heights: Union[Topography, ArrayLike],
    size: Optional[Size],
    boundary: Optional[str],
    keys: Dict[str, Any],
    fields: bool,
    jobs: Optional[int],
) -> Tuple["_asperity.Pressing", Topography]:
    if isinstance(heights, Topography):
        topography = heights
        if size is not None:
            raise ArgumentError("the topography has its own size; omit `size`")
    else:
        if size is None:
            raise MissingArgumentError(
                "an array needs a `size`: write `size=1.0` for a square of this side, or `size=(2.0, 1.0)` for "
                "the sides along x and y, in the unit of the heights"
            )
        if boundary is None:
            raise MissingArgumentError(
                'an array needs a `boundary`: write `boundary="periodic"` if the surface is periodic, or '
                '`boundary="free"` if it is an isolated patch, such as a measured map'
            )
        topography = Topography(heights, size, is_periodic=boundary == "periodic")
    if topography.missing:
        raise SurfaceError(f"{topography.missing} points are missing; call `fill` first")
    pressing = _asperity.Pressing(
        topography._heights,
        topography.size,
        topography._rms_slope,
        topography.is_periodic,
        keys,
        fields,
        jobs,
    )
    return pressing, topography
