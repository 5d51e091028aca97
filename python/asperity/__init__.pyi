from asperity import errors as errors, models as models, persson as persson
from asperity._asperity import __version__ as __version__
from asperity._command import main as main
from asperity._laws import (
    CorrectedArea as CorrectedArea,
    EvolutionLaw as EvolutionLaw,
    corrected_area as corrected_area,
)
from asperity._contact import Contact as Contact, ContactState as ContactState
from asperity._map import Map as Map
from asperity._plan import Diff as Diff, Plan as Plan, Report as Report, Run as Run
from asperity._press import press as press, press_each as press_each
from asperity._study import Study as Study
from asperity._surfaces import (
    from_surfacetopography as from_surfacetopography,
    read as read,
    surface as surface,
)
from asperity._table import Column as Column, Table as Table
from asperity._topography import Topography as Topography
from asperity.errors import (
    ArgumentError as ArgumentError,
    Error as Error,
    FitError as FitError,
    ManifestError as ManifestError,
    MissingArgumentError as MissingArgumentError,
    NotComputedError as NotComputedError,
    Problem as Problem,
    QueryError as QueryError,
    StoreError as StoreError,
    StudyWarning as StudyWarning,
    SurfaceError as SurfaceError,
    UnknownNameError as UnknownNameError,
)

__all__ = [
    "ArgumentError",
    "Column",
    "Contact",
    "ContactState",
    "CorrectedArea",
    "Diff",
    "Error",
    "EvolutionLaw",
    "FitError",
    "ManifestError",
    "Map",
    "MissingArgumentError",
    "NotComputedError",
    "Plan",
    "Problem",
    "QueryError",
    "Report",
    "Run",
    "StoreError",
    "Study",
    "StudyWarning",
    "SurfaceError",
    "Table",
    "Topography",
    "UnknownNameError",
    "__version__",
    "corrected_area",
    "errors",
    "from_surfacetopography",
    "main",
    "models",
    "persson",
    "press",
    "press_each",
    "read",
    "surface",
]
