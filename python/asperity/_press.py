"""A surface under loads."""

from __future__ import annotations

from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from asperity import _asperity
from asperity._arrays import Size
from asperity._contact import Contact, ContactState
from asperity._topography import Topography
from asperity.errors import ArgumentError, SurfaceError

#: One load, several, or ``{"from", "to", "steps", "spacing"}``.
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
    """Presses a rigid rough surface into an elastic half-space, load after load.

    Frictionless contact without adhesion, by preconditioned conjugate gradients with FFT: the numbers that a
    `solve` stage computes, to the last bit. Other threads of Python run meanwhile; Ctrl-C ends it.

    Parameters
    ----------
    heights : Topography or array_like, shape (n_x, n_y)
        The surface, peaks towards the body.
    size : float or (float, float), optional
        Sides along x and y, in the unit of the heights. Required with an array; a topography has its own.
    loads : float, array_like or mapping
        Mean pressures in units of E* × rms slope, ascending: numbers, or
        ``{"to": 0.1, "steps": 10, "from": 0, "spacing": "linear"}``.
    pressures : float, array_like or mapping
        The same as pressures, in the unit of `effective_modulus`; instead of `loads`.
    effective_modulus : float, optional
        E*, 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂; 1 when left out.
    bodies : sequence of mappings, optional
        ``{"youngs_modulus", "poisson_ratio"}`` of both bodies, or of one against a rigid one; instead of
        `effective_modulus`.
    boundary : ``"periodic"`` or ``"free"``, optional
        What lies beyond the edges: the surface again, or nothing. Required with an array; of a topography
        ``"periodic"`` when left out. A topography that is not periodic is pressed with ``"free"`` only.
    hardness : float, optional
        The highest pressure that the material bears, in the unit of the modulus, or as `hardness_unit`
        (``"absolute"`` or ``"relative"``) says. None when left out.
    tolerance : float, optional
        Largest gap in contact and penetration outside it, over rms slope × mesh step; 5e-5 when left out.
    max_pairs : int, optional
        Pairs of transforms after which a load is given up; its row says so. 2000 when left out.
    fields : bool
        Whether pressures are kept, 8 bytes for each node in contact; otherwise contact maps alone.
    jobs : int, optional
        Cores that share the work on a surface of 512 × 512 nodes or more; all there are when left out. The
        numbers are the same with any.

    Returns
    -------
    Contact
        A table, and maps for each load: ``pressure(i)``, ``gap(i)``, ``displacement(i)``, ``contact(i)``. Loads
        beyond the one from which every node touches are left out.

    Raises
    ------
    ArgumentError
        If an argument makes no sense, or an array comes without `size` or `boundary`.
    SurfaceError
        If points are missing, or a map that is not periodic would be pressed as one that is.

    Notes
    -----
    I. A. Polonsky & L. M. Keer, *Wear* 231 (1999) 206; V. A. Yastrebov, G. Anciaux & J.-F. Molinari, *Int. J.
    Solids Struct.* 52 (2015) 83. With `hardness`: A. Almqvist et al., *Tribol. Int.* 40 (2007) 574.

    Examples
    --------
    Westergaard's wave, flat under π E* Δ/λ:

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
    """The same as :func:`press`, handing over each load as it is solved.

    What makes no sense is refused at once, before the first load. Whoever stops to ask stops the work.

    Yields
    ------
    ContactState
        The contact under one load after the other.

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
    """The keys of a `solve` stage."""
    if (loads is None) == (pressures is None):
        raise ArgumentError(
            "either `loads`, in units of E* × rms slope, or `pressures`, in the unit of `effective_modulus`"
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
    numbers: List[float] = np.asarray(loads, dtype=np.float64).reshape(-1).tolist()
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
            raise ArgumentError("`size` is that of the topography, and cannot be another one")
    else:
        if size is None:
            raise ArgumentError("an array needs its `size`: the sides along x and y, in the unit of the heights")
        if boundary is None:
            raise ArgumentError(
                'an array needs a `boundary`: "periodic" if the surface repeats itself beyond its edges, '
                '"free" if nothing lies beyond them, as around a measured map'
            )
        topography = Topography(heights, size, is_periodic=boundary == "periodic")
    if topography.missing:
        raise SurfaceError(f"{topography.missing} points are missing: `fill` gives them heights")
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
