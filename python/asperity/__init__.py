"""Statistical studies of rough contact.

============================  =====================================================================
:func:`read`                  read a height map from a topography file
:func:`surface`               generate a random surface or a simple shape
:class:`Topography`           height map with its preparation and statistics
:func:`press`                 press a surface: areas, gaps, energies, maps
:func:`press_each`            press a surface and yield each load when it is solved
:class:`Study`                study of a manifest: check, plan, run, tables, maps, SQL, claims, report
:mod:`persson`, :mod:`models` theories as functions of arrays
:class:`EvolutionLaw`         contact evolution law and its fit
:func:`corrected_area`        contact area corrected for the mesh
:class:`Error`                base class of all exceptions
============================  =====================================================================

Heights are arrays ``[x, y]`` and positive towards the elastic body. Loads are mean pressures in units
of E* × rms slope, and areas are fractions of the apparent area.

>>> import asperity
>>> rough = asperity.surface(nodes=64, hurst=0.8, k_lower=2, k_upper=16, seed=1)
>>> contact = asperity.press(rough, loads=[0.01, 0.1])
>>> bool(contact.area[0] < contact.area[1])
True
"""

import importlib

# Modules are imported on first use, so that the command line starts without NumPy.
_MODULE_OF = {
    "from_surfacetopography": "_surfaces",
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
    "Diff": "_plan",
    "Report": "_plan",
    "Map": "_map",
    "Table": "_table",
    "Column": "_table",
    "EvolutionLaw": "_laws",
    "corrected_area": "_laws",
    "CorrectedArea": "_laws",
    "ArgumentError": "errors",
    "Error": "errors",
    "FitError": "errors",
    "ManifestError": "errors",
    "MissingArgumentError": "errors",
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

__all__ = sorted([*_MODULE_OF, *_MODULES])


def __getattr__(name):
    if name in _MODULES:
        return importlib.import_module(f"asperity.{name}")
    try:
        module = importlib.import_module(f"asperity.{_MODULE_OF[name]}")
    except KeyError:
        raise AttributeError(f"module 'asperity' has no attribute {name!r}") from None
    return getattr(module, name)


def __dir__():
    return __all__
