//! Columns of contacts in partial slip.

use super::{CONTACT_FRACTION, parameter, parameter_text, real};
use asperity_tables::column::Column;

pub const FRICTION_COEFFICIENT: Column =
    parameter("friction_coefficient", "1", "coefficient f of Coulomb friction");
pub const POISSON_RATIO: Column = parameter(
    "poisson_ratio",
    "1",
    "Poisson's ratio ν of both bodies, on which the tangential compliance depends",
);
pub const TANGENTIAL_LOAD: Column = parameter(
    "tangential_load",
    "f × load",
    "tangential load Q/(f N) with the friction f N of the load N; the whole contact slips at 1",
);
pub const TANGENTIAL_BRANCH: Column = parameter_text(
    "tangential_branch",
    "direction of the path of tangential loads at the state: `loading` while the tangential load \
     grows, `unloading` otherwise. Later branches in the same direction are numbered: `loading-2`",
);
pub const STICK_FRACTION: Column = real(
    "stick_fraction",
    "1",
    "fraction of all nodes that are in contact and have not slipped since the path turned last: \
     the contact area under the load N − Q/f, or N − |Q − Q*|/(2f) after a turn at Q*",
);
pub const SLIP_FRACTION: Column =
    real("slip_fraction", "1", "fraction of all nodes that are in contact and do not stick");
pub const TANGENTIAL_TRACTION: Column =
    real("tangential_traction", "pressure", "tangential load per nominal area, Q/A₀");
pub const TANGENTIAL_DISPLACEMENT: Column = real(
    "tangential_displacement",
    "length",
    "tangential displacement of the bodies since the path started, for elastically similar bodies \
     and without the coupling through ν (Ciavarella 1998, Jäger 1998)",
);
pub const TANGENTIAL_STIFFNESS: Column = real(
    "tangential_stiffness",
    "E*/side",
    "incremental tangential stiffness (side/E*) dQ/(A₀ du) along the branch: the `stiffness` under \
     the load of the stick area, divided by (2 − ν)/(2(1 − ν)); null unless the `solve` stage has \
     `stiffness = true`",
);
pub const FRICTIONAL_DISSIPATION: Column = real(
    "frictional_dissipation",
    "pressure × length",
    "energy per nominal area that friction has dissipated since the path started. It follows from \
     approaches and elastic energies of the loads, without an integral over the path",
);

/// Columns of partial slip. The last four need Poisson's ratio.
pub const PARTIAL_SLIP: [Column; 11] = [
    FRICTION_COEFFICIENT,
    TANGENTIAL_LOAD,
    TANGENTIAL_BRANCH,
    STICK_FRACTION,
    SLIP_FRACTION,
    CONTACT_FRACTION,
    TANGENTIAL_TRACTION,
    POISSON_RATIO,
    TANGENTIAL_DISPLACEMENT,
    TANGENTIAL_STIFFNESS,
    FRICTIONAL_DISSIPATION,
];
