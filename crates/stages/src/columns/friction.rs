//! Columns of contacts in partial slip.

use super::{columns, parameter, parameter_text, real};
use asperity_tables::column::Column;

columns! {
    /// coefficient f of Coulomb friction
    pub const FRICTION_COEFFICIENT: Column = parameter("friction_coefficient", "1");
    /// Poisson's ratio ν of both bodies, on which the tangential compliance depends
    pub const POISSON_RATIO: Column = parameter("poisson_ratio", "1");
    /// tangential load Q/(f N) with the friction f N of the load N; the whole contact slips at 1
    pub const TANGENTIAL_LOAD: Column = parameter("tangential_load", "f × load");
    /// direction of the path of tangential loads at the state: `loading` while the tangential load
    /// grows, `unloading` otherwise. Later branches in the same direction are numbered: `loading-2`
    pub const TANGENTIAL_BRANCH: Column = parameter_text("tangential_branch");
    /// fraction of all nodes that are in contact and have not slipped since the path turned last:
    /// the contact area under the load N − Q/f, or N − |Q − Q*|/(2f) after a turn at Q*
    pub const STICK_FRACTION: Column = real("stick_fraction", "1");
    /// fraction of all nodes that are in contact and do not stick
    pub const SLIP_FRACTION: Column = real("slip_fraction", "1");
    /// tangential load per nominal area, Q/A₀
    pub const TANGENTIAL_TRACTION: Column = real("tangential_traction", "pressure");
    /// tangential displacement of the bodies since the path started, for elastically similar bodies
    /// and without the coupling through ν (Ciavarella 1998, Jäger 1998)
    pub const TANGENTIAL_DISPLACEMENT: Column = real("tangential_displacement", "length");
    /// incremental tangential stiffness (side/E*) dQ/(A₀ du) along the branch: the `stiffness`
    /// under the load of the stick area, divided by (2 − ν)/(2(1 − ν)); null unless the `solve`
    /// stage has `stiffness = true`
    pub const TANGENTIAL_STIFFNESS: Column = real("tangential_stiffness", "E*/side");
    /// energy per nominal area that friction has dissipated since the path started. It follows from
    /// approaches and elastic energies of the loads, without an integral over the path
    pub const FRICTIONAL_DISSIPATION: Column = real("frictional_dissipation", "pressure × length");
}
