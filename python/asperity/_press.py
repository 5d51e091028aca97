"""Functions that press a surface without a study."""

from __future__ import annotations

import warnings
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from asperity import _asperity
from asperity._arrays import Quantity, Size
from asperity._contact import Contact, ContactState
from asperity._topography import Topography
from asperity.errors import ArgumentError, MissingArgumentError, StudyWarning, SurfaceError

#: One load or mean gap, several of them, or ``{"from", "to", "steps", "spacing"}``. Each may be a text with a
#: unit, such as ``"50 MPa"``.
Loads = Union[ArrayLike, Mapping[str, Any]]


def press(
    heights: Union[Topography, ArrayLike],
    *,
    size: Optional[Size] = None,
    loads: Optional[Loads] = None,
    pressures: Optional[Loads] = None,
    gaps: Optional[Loads] = None,
    displacements: Optional[Loads] = None,
    adhesion: Optional[Mapping[str, Any]] = None,
    path: Optional[str] = None,
    effective_modulus: Optional[Quantity] = None,
    bodies: Optional[Sequence[Mapping[str, Quantity]]] = None,
    boundary: Optional[str] = None,
    hardness: Optional[Quantity] = None,
    hardness_unit: Optional[str] = None,
    layer: Optional[Mapping[str, Any]] = None,
    substrate: Optional[Mapping[str, Quantity]] = None,
    counter_body: Optional[Mapping[str, Quantity]] = None,
    against: Optional[Union[Topography, ArrayLike]] = None,
    shift: Optional[Tuple[float, float]] = None,
    mirror: Optional[str] = None,
    stiffness: Optional[bool] = None,
    flow: Optional[bool] = None,
    friction: Optional[Mapping[str, Any]] = None,
    tolerance: Optional[float] = None,
    max_pairs: Optional[int] = None,
    fields: bool = True,
    jobs: Optional[int] = None,
) -> Contact:
    """Presses a rigid rough surface into an elastic half-space under a sequence of loads.

    Solves frictionless contact by preconditioned conjugate gradients with FFT. The results are bitwise equal to
    those of a `solve` stage. Other Python threads run during the computation, and Ctrl-C interrupts it.

    Pressures, lengths and works may be texts with a unit, such as ``"50 MPa"``, as in a manifest. A number without
    a unit beside a text of the same kind is refused. Lengths are converted to the unit of the topography.

    With `adhesion`, the surfaces attract each other. The loads or mean gaps are then the states of a path: each
    state starts from the one before, and loads may be negative.

    Parameters
    ----------
    heights : Topography or array_like, shape (n_x, n_y)
        The surface; heights are positive towards the elastic body.
    size : float or str, or a pair of them, optional
        Sides along x and y, in the unit of the heights. Required for arrays, not allowed for a topography.
    loads : float, array_like or mapping
        Ascending mean pressures in units of E* × rms slope: numbers, or
        ``{"to": 0.1, "steps": 10, "from": 0, "spacing": "linear"}``. Texts such as ``"50 MPa"`` are pressures.
    pressures : float, str, array_like or mapping
        Mean pressures in the unit of the moduli; alternative to `loads`. If the moduli are texts with a unit,
        the pressures must be texts, too.
    gaps : float, str, array_like or mapping
        Mean gaps in the unit of the heights: numbers, or ``{"from": 0.2, "to": 0.02, "steps": 10}``. Alternative
        to `loads`, which are then results. With `adhesion` they are in the order of the path.
    displacements : float, str, array_like or mapping
        Rigid approach of the bodies since first touch, in the form of `gaps`. Alternative to `loads` without
        `adhesion`.
    adhesion : mapping, optional
        ``{"work", "range"}``: work of adhesion w in the unit of the modulus × unit of length, and range ρ in the
        unit of the heights. At the gap g the energy per area is −w exp(−g/ρ); default: no attraction. `loads`
        and `pressures` then follow the path, may be negative and need not ascend. ``"override": True`` allows
        a mesh with Δx w/(E* ρ²) > π/2.
    path : ``"as-given"`` or ``"there-and-back"``, optional
        With `adhesion`: the states follow the list, or the list and then the list backwards; default:
        ``"as-given"``. With a `hardness`: the loads follow the list likewise, and the surface keeps its
        plastic depth where they decrease. The table then has the columns ``branch``, ``residual_depth`` and
        ``plastic_work``, and the rows of first loading before those of unloading. Default: no unloading.
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
    layer : mapping, optional
        Elastic layer on a rigid base, ``{"thickness", "poisson_ratio", "base"}`` with the base ``"bonded"`` or
        ``"frictionless"``, or coating of the half-space `substrate`,
        ``{"thickness", "poisson_ratio", "modulus_ratio"}`` with the shear modulus of the coating over that of
        the half-space. The modulus E* is that of the layer. Default: a half-space.
    substrate : mapping, optional
        Half-space below a coating, ``{"poisson_ratio"}``. With a ``"conductivity"`` or a ``"resistivity"`` in
        `layer` and `substrate` and with `stiffness`, the table has the column ``contact_conductance``.
    counter_body : mapping, optional
        ``{"conductivity"}`` or ``{"resistivity"}`` of the rough body, for a `layer` with the same key; default:
        the rough body conducts perfectly.
    against : Topography or array_like, optional
        Heights of a second rough surface, positive towards the first one and in common axes. It has the nodes
        and sides of the first surface. The sum of both heights is pressed, and `loads` are in units of the rms
        slope of this sum. Default: the other body is smooth.
    shift : (float, float), optional
        Lateral shift of `against` along x and y, as fractions of the sides; default: no shift.
    mirror : ``"x"`` or ``"y"``, optional
        Axis along which the map of `against` is reversed before it is shifted, as for a measured map, which
        was seen from its own front; default: none.
    stiffness : bool, optional
        True to compute the stiffness of the contact under each load, the column ``stiffness``; default: False.
    flow : bool, optional
        True to compute the flow of a thin fluid through the periodic gap: the conductivities
        ``flow_conductivity_x`` and ``flow_conductivity_y`` in length³, zero where no channel leads through, and the
        flow factors ``flow_factor_x`` and ``flow_factor_y``; default: False.
    friction : mapping, optional
        ``{"coefficient", "loads", "poisson_ratio"}``: partial slip under tangential loads Q/(f N) between −1
        and 1, in the order of the path. `Contact.partial_slip` is the table. The normal loads N (1 − Q/(f N))
        must be among `loads`. Default: no tangential loads.
    tolerance : float, optional
        Maximum error of the gap, in units of rms slope × mesh step: the gap in contact and the penetration
        outside it; default: 5e-5. With `adhesion`: maximum error of a pressure, in units of E* × rms slope.
    max_pairs : int, optional
        Maximum number of pairs of transforms per load; default: 2000, with `adhesion` 20000. The column
        ``stop`` marks loads that have not converged.
    fields : bool
        True to store the pressures, which takes 8 bytes per contact node; False to store contact maps only.
    jobs : int, optional
        Number of cores for surfaces of 512 × 512 nodes or more; default: all. The results do not depend on
        it.

    Returns
    -------
    Contact
        A table, and maps for each load: ``pressure(i)``, ``gap(i)``, ``displacement(i)``, ``contact(i)``,
        ``repulsive(i)``.

    Raises
    ------
    ArgumentError
        If an argument is invalid.
    MissingArgumentError
        If `size` or `boundary` is missing for an array, or if there are no loads, gaps or displacements. It
        is a TypeError and an ArgumentError.
    SurfaceError
        If points are missing, or if `boundary` is ``"periodic"`` but the map is not periodic.

    Warns
    -----
    StudyWarning
        If the mesh is coarse for the adhesion, if every node touches under all loads, if loads are out of order,
        or if the rms slope of the heights is above 1, so that heights or sides are probably in another unit.

    Notes
    -----
    Method: I. A. Polonsky & L. M. Keer, *Wear* 231 (1999) 206; V. A. Yastrebov, G. Anciaux & J.-F. Molinari,
    *Int. J. Solids Struct.* 52 (2015) 83. With `hardness`: A. Almqvist et al., *Tribol. Int.* 40 (2007) 574.
    With `adhesion`: V. Rey, G. Anciaux & J.-F. Molinari, *Comput. Mech.* 60 (2017) 69.

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

    Two flat surfaces at the distance G attract each other with the pressure (w/ρ) exp(−G/ρ):

    >>> flat = press(numpy.zeros((16, 16)), size=1.0, boundary="periodic",
    ...              adhesion={"work": 0.01, "range": 0.1}, gaps=[0.2, 0.1])
    >>> (flat.mean_pressure / (-0.1 * numpy.exp([-2, -1]))).round(12)
    array([1., 1.])
    """
    keys = {
        **_states(loads, pressures, gaps, displacements, adhesion, path),
        **_setting(
            effective_modulus,
            bodies,
            boundary,
            hardness,
            hardness_unit,
            layer,
            substrate,
            counter_body,
            stiffness,
            flow,
            tolerance,
            max_pairs,
        ),
        "friction": None if friction is None else dict(friction),
    }
    topography = _topography(heights, size, boundary, against, shift, mirror)
    pressing = _pressing(topography, keys, fields, jobs)
    while pressing.press():
        pass
    return Contact(pressing, topography)


def press_each(
    heights: Union[Topography, ArrayLike],
    *,
    size: Optional[Size] = None,
    loads: Optional[Loads] = None,
    pressures: Optional[Loads] = None,
    gaps: Optional[Loads] = None,
    displacements: Optional[Loads] = None,
    adhesion: Optional[Mapping[str, Any]] = None,
    path: Optional[str] = None,
    effective_modulus: Optional[Quantity] = None,
    bodies: Optional[Sequence[Mapping[str, Quantity]]] = None,
    boundary: Optional[str] = None,
    hardness: Optional[Quantity] = None,
    hardness_unit: Optional[str] = None,
    layer: Optional[Mapping[str, Any]] = None,
    substrate: Optional[Mapping[str, Quantity]] = None,
    counter_body: Optional[Mapping[str, Quantity]] = None,
    against: Optional[Union[Topography, ArrayLike]] = None,
    shift: Optional[Tuple[float, float]] = None,
    mirror: Optional[str] = None,
    stiffness: Optional[bool] = None,
    flow: Optional[bool] = None,
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
    keys = {
        **_states(loads, pressures, gaps, displacements, adhesion, path),
        **_setting(
            effective_modulus,
            bodies,
            boundary,
            hardness,
            hardness_unit,
            layer,
            substrate,
            counter_body,
            stiffness,
            flow,
            tolerance,
            max_pairs,
        ),
    }
    pressing = _pressing(_topography(heights, size, boundary, against, shift, mirror), keys, fields, jobs)

    def each() -> Iterator[ContactState]:
        while pressing.press():
            yield ContactState(pressing, pressing.count() - 1)

    return each()


_CONTROLS = {"gaps": "gap", "displacements": "displacement"}
"""Values of the key `control` by the arguments that need it."""


def _states(
    loads: Optional[Loads],
    pressures: Optional[Loads],
    gaps: Optional[Loads],
    displacements: Optional[Loads],
    adhesion: Optional[Mapping[str, Any]],
    path: Optional[str],
) -> Dict[str, Any]:
    """Returns the keys of a `solve` stage that describe its loads or the states of its path."""
    given = {"loads": loads, "pressures": pressures, "gaps": gaps, "displacements": displacements}
    named = [name for name, value in given.items() if value is not None]
    if len(named) != 1:
        kind = MissingArgumentError if not named else ArgumentError
        found = f", not both `{named[0]}` and `{named[1]}`" if named else ""
        raise kind(
            "give either `loads` (in units of E* × rms slope), `pressures` (in the unit of the modulus), mean "
            f"`gaps` or `displacements`{found}"
        )
    if not (adhesion is None or isinstance(adhesion, Mapping)):
        raise ArgumentError(f'`adhesion` is {adhesion!r}, but must be {{"work": …, "range": …}}')
    name = named[0]
    listed = _list(name, given[name])
    states: Dict[str, Any] = {
        "adhesion": None if adhesion is None else dict(adhesion),
        "path": path,
        "loads" if name == "pressures" else name: listed,
    }
    if name in _CONTROLS:
        return {**states, "control": _CONTROLS[name]}
    if name == "pressures":
        return {**states, "load_unit": "absolute"}
    # Texts have a unit. Numbers are named as multiples of E* × rms slope by the argument.
    return states if _has_text(listed) else {**states, "load_unit": "relative"}


def _has_text(states: Union[List[Quantity], Dict[str, Any]]) -> bool:
    if isinstance(states, list):
        return any(isinstance(state, str) for state in states)
    return any(isinstance(states.get(end), str) for end in ("from", "to"))


def _setting(
    effective_modulus: Optional[Quantity],
    bodies: Optional[Sequence[Mapping[str, Quantity]]],
    boundary: Optional[str],
    hardness: Optional[Quantity],
    hardness_unit: Optional[str],
    layer: Optional[Mapping[str, Any]],
    substrate: Optional[Mapping[str, Quantity]],
    counter_body: Optional[Mapping[str, Quantity]],
    stiffness: Optional[bool],
    flow: Optional[bool],
    tolerance: Optional[float],
    max_pairs: Optional[int],
) -> Dict[str, Any]:
    """Returns the keys of a `solve` stage that describe the bodies and the solver."""
    return {
        "effective_modulus": effective_modulus,
        "bodies": None if bodies is None else [dict(body) for body in bodies],
        "boundary": boundary,
        "hardness": hardness,
        "hardness_unit": hardness_unit,
        "layer": None if layer is None else dict(layer),
        "substrate": None if substrate is None else dict(substrate),
        "counter_body": None if counter_body is None else dict(counter_body),
        "stiffness": stiffness,
        "flow": flow,
        "tolerance": tolerance,
        "max_pairs": max_pairs,
    }


def _list(name: str, states: Optional[Loads]) -> Union[List[Quantity], Dict[str, Any]]:
    """Returns the numbers and the texts with a unit of the argument `name`, or its range."""
    if isinstance(states, Mapping):
        return dict(states)
    if isinstance(states, str):
        return [states]
    if isinstance(states, (list, tuple)) and any(isinstance(state, str) for state in states):
        return list(states)
    try:
        numbers: List[Quantity] = [*np.asarray(states, dtype=np.float64).reshape(-1).tolist()]
    except (TypeError, ValueError):
        kind, unit = (name, "the unit of the heights") if name in _CONTROLS else (
            "loads", "units of E* × rms slope, or `pressures` in the unit of `effective_modulus`"
        )
        raise ArgumentError(f"{kind} are numbers, not {states!r}: give `{kind}` in {unit}") from None
    return numbers


def _topography(
    heights: Union[Topography, ArrayLike],
    size: Optional[Size],
    boundary: Optional[str],
    against: Optional[Union[Topography, ArrayLike]],
    shift: Optional[Tuple[float, float]],
    mirror: Optional[str],
) -> Topography:
    """Returns the surface to press: the given one, or with `against` the sum of two."""
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
    _refuse_missing(topography)
    if topography._is_unchecked:
        topography._warn(has_given_sides=True)
    if against is None:
        for name, value in {"shift": shift, "mirror": mirror}.items():
            if value is not None:
                raise ArgumentError(f"`{name}` needs `against`, the second surface")
        return topography
    if not isinstance(against, Topography):
        against = Topography._of(against, topography.size, topography.unit, topography.is_periodic)
    _refuse_missing(against)
    keys = {"shift": None if shift is None else list(shift), "mirror": mirror, "boundary": boundary}
    placed = _asperity.placed((against.values, against.size), keys)
    return topography + Topography._of(placed, against.size, against.unit, against.is_periodic)


def _refuse_missing(topography: Topography) -> None:
    if topography.missing:
        raise SurfaceError(f"{topography.missing} points are missing; call `fill` first")


def _pressing(
    topography: Topography,
    keys: Dict[str, Any],
    fields: bool,
    jobs: Optional[int],
) -> "_asperity.Pressing":
    pressing = _asperity.Pressing(
        (topography._heights, topography.size),
        topography.unit,
        topography._rms_slope,
        topography.is_periodic,
        keys,
        fields,
        jobs,
    )
    for message in pressing.warnings():
        warnings.warn(message, StudyWarning, stacklevel=3)
    return pressing
