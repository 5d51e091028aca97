"""Statistical studies of rough contact.

============================  =====================================================================
:func:`read`                  a map of heights in the file of an instrument
:func:`surface`               a random surface, or a simple shape
:class:`Topography`           heights, with what can be done to them and is to be known of them
:func:`press`                 a surface under loads: areas, gaps, energies, maps
:func:`press_each`            the same, load by load as they are solved
:class:`Study`                a manifest: check, plan, run, tables, SQL, claims, report
:mod:`persson`, :mod:`models` theories, as functions on arrays
:class:`EvolutionLaw`         the contact evolution law, and its fit
:func:`corrected_area`        the contact area, corrected for the mesh
:class:`Error`                what is common to all exceptions
============================  =====================================================================

Heights are arrays ``[x, y]`` and positive towards the elastic body. Loads are mean pressures in units
of E* × rms slope, areas are fractions of the apparent one.

>>> import asperity
>>> rough = asperity.surface(nodes=64, hurst=0.8, k_lower=2, k_upper=16, seed=1)
>>> contact = asperity.press(rough, loads=[0.01, 0.1])
>>> bool(contact.area[0] < contact.area[1])
True
"""

import importlib

# Where everything is: the command, which starts often, needs nothing of it, and no NumPy.
_PLACES = {
    "read": "_surfaces",
    "surface": "_surfaces",
    "Topography": "_topography",
    "press": "_press",
    "press_each": "_press",
    "Contact": "_contact",
    "ContactState": "_contact",
    "Study": "_study",
    "Plan": "_plan",
    "Run": "_plan",
    "Report": "_plan",
    "Table": "_table",
    "Column": "_table",
    "EvolutionLaw": "_laws",
    "corrected_area": "_laws",
    "CorrectedArea": "_laws",
    "ArgumentError": "errors",
    "Error": "errors",
    "FitError": "errors",
    "ManifestError": "errors",
    "NotComputedError": "errors",
    "Problem": "errors",
    "QueryError": "errors",
    "StoreError": "errors",
    "StudyWarning": "errors",
    "SurfaceError": "errors",
    "UnknownNameError": "errors",
    "main": "_command",
    "__version__": "_asperity",
}
_MODULES = ("errors", "models", "persson")

__all__ = sorted([*_PLACES, *_MODULES])


def __getattr__(name):
    if name in _MODULES:
        return importlib.import_module(f"asperity.{name}")
    try:
        module = importlib.import_module(f"asperity.{_PLACES[name]}")
    except KeyError:
        raise AttributeError(f"module 'asperity' has no attribute {name!r}") from None
    return getattr(module, name)


def __dir__():
    return __all__
