//! Columns of the states of a path with adhesion.

use super::{
    CONTACT_NODES, CONTACT_PRESSURE, PRESSURE_BIN_WIDTH, PRESSURE_DENSITY,
    PRESSURE_DENSITY_PERSSON, PRESSURE_NODES, PRESSURE_NODES_BEYOND, RESIDUAL, STOP, TOLERANCE,
    codes, columns, heavy, integer, parameter, parameter_text, real,
};
use asperity_tables::column::Column;
use asperity_tables::column::ColumnKind::{Bytes, Reals};

// Settings.
columns! {
    /// work of adhesion w: energy per area that separates two flat surfaces in contact
    pub const WORK_OF_ADHESION: Column = parameter("work_of_adhesion", "pressure × length");
    /// range ρ of the attraction: the energy per area at the gap g is −w exp(−g/ρ)
    pub const INTERACTION_RANGE: Column = parameter("interaction_range", "length");
    /// quantity that the contact prescribes; without adhesion the column exists only if this is not
    /// the load
    pub const CONTROL: Column = parameter_text("control").with_codes(codes![
        /// the mean pressure is prescribed
        "load",
        /// the mean gap is prescribed
        "gap",
        /// the rigid approach of the bodies since first touch is prescribed
        "displacement",
    ]);
    /// direction of the path at the state: `approach` while the load grows or the mean gap falls,
    /// `separation` otherwise. Later branches in the same direction are numbered: `approach-2`
    pub const BRANCH: Column = parameter_text("branch");
    /// largest accepted error of the pressures
    pub const ADHESIVE_TOLERANCE: Column = Column { unit: "E* × rms slope", ..TOLERANCE };

    // Results of a state.
    /// mean gap that `control = "gap"` prescribes; `mean_gap` is that of the contact, and differs
    /// by more than the tolerance only where `stop` says so. With adhesion, only for free
    /// boundaries
    pub const PRESCRIBED_GAP: Column = real("prescribed_gap", "length");
    /// rigid approach of the bodies since first touch that `control = "displacement"` prescribes:
    /// highest height − mean_gap + mean_yielded_depth + mean displacement of the elastic surface,
    /// with the height above the mean plane; on a layer also uniform_compression. The mean
    /// displacement is zero on a periodic half-space
    pub const PRESCRIBED_DISPLACEMENT: Column = real("prescribed_displacement", "length");
    /// number of the state along the path; the first state is 1
    pub const STEP: Column = integer("step", "1");
    /// number of nodes in contact, whose gap is zero
    pub const ADHESIVE_CONTACT_NODES: Column = CONTACT_NODES;
    /// fraction of the nodes in contact, whose gap is zero
    pub const CONTACT_FRACTION: Column = real("contact_fraction", "1");
    /// number of nodes with positive pressure
    pub const REPULSIVE_NODES: Column = integer("repulsive_nodes", "1");
    /// fraction of the nodes with positive pressure
    pub const REPULSIVE_FRACTION: Column = real("repulsive_fraction", "1");
    /// mean over the nominal area of the negative pressures, as a positive number; `pressure` is
    /// the mean of the positive pressures minus this
    pub const ATTRACTIVE_PRESSURE: Column = real("attractive_pressure", "pressure");
    /// mean over the nominal area of the positive pressures
    pub const REPULSIVE_PRESSURE: Column = real("repulsive_pressure", "pressure");
    /// mean over the nominal area of the pressures of the nodes in contact, negative ones included
    pub const PRESSURE_IN_CONTACT: Column = real("pressure_in_contact", "pressure");
    /// elastic energy per unit of nominal area
    pub const ELASTIC_ENERGY: Column = real("elastic_energy", "pressure × length");
    /// mean interaction energy per unit of nominal area, −w⟨exp(−g/ρ)⟩
    pub const ADHESION_ENERGY: Column = real("adhesion_energy", "pressure × length");
    /// energy per unit of nominal area that was lost along the path up to this state: the work of
    /// the mean pressure on the approach, minus the change of elastic and adhesion energy. The work
    /// is a sum of trapezoids, whose error falls with the square of the steps of the path. It is
    /// zero in the first state, and again in the first state after the surfaces have been apart,
    /// because the work of a tension on surfaces that part has no limit
    pub const DISSIPATED_ENERGY: Column = real("dissipated_energy", "pressure × length");
    /// largest tension that the contact bears, as a negative load. It is given in the row of the
    /// first load below it; null in all other rows
    pub const PULL_OFF_LOAD: Column = real("pull_off_load", "E* × rms slope");
    /// pull-off load as a mean pressure over the nominal area, in the unit of `pressure`
    pub const PULL_OFF_PRESSURE: Column = real("pull_off_pressure", "pressure");
    /// Tabor parameter (R w²/E*²)^(1/3)/ρ of the surface with the radius of curvature R = 1/√m₄,
    /// where m₄ is computed from finite differences under a free boundary; null for flat surfaces.
    /// Small values are near the limit of Derjaguin, Muller & Toporov, large ones near that of
    /// Johnson, Kendall & Roberts
    pub const TABOR: Column = real("tabor", "1");
    /// 2w/(E* ρ h′) (κ ρ/h′²)^(2/3), the reciprocal of criterion 10 of Pastewka & Robbins (PNAS
    /// 111, 2014, 3298) with the rms slope h′ and half the rms Laplacian κ. Above 1, randomly rough
    /// surfaces are expected to stick, if ρ is short beside h′²/κ; null for flat surfaces
    pub const STICKINESS: Column = real("stickiness", "1");
    /// largest error of a pressure: outside contact the difference between elastic and attractive
    /// pressure, in contact a missing repulsion
    pub const ADHESIVE_RESIDUAL: Column = Column { unit: "E* × rms slope", ..RESIDUAL };
}
pub const ADHESIVE_STOP: Column = STOP.with_codes(codes![
    /// the residual is within the tolerance
    "converged",
    /// no state bears the tension: the surfaces are apart, and most results are null
    "pulled-off",
    /// `max_pairs` pairs of transforms were not enough: the residual exceeds the tolerance, or
    /// the search for `pull_off_load` did not end and most results are null
    "pair-limit",
    /// the state no longer moves, although its residual exceeds the tolerance
    "stalled",
    /// the state is in balance, but its mean gap is not `prescribed_gap`: the contact of an
    /// isolated patch jumps past it
    "gap-not-reached",
]);

columns! {
    /// map of the nodes with positive pressure, in the format of `contact`
    pub const REPULSIVE: Column = heavy("repulsive", Bytes, "");
    /// gaps of the nodes, row-major, at the last state of the path, from which a longer path
    /// continues, or at all states with `pressures = "all"`; null in all other rows, and if the
    /// surfaces are apart
    pub const GAPS: Column = heavy("gaps", Reals, "longer side × rms slope");
}

columns! {
    /// Columns of a distribution of pressures with adhesion, which have the names of those without.
    pub const ADHESIVE_PRESSURE_DISTRIBUTION = [
        /// centre of the bin of pressures; bins have equal width, and zero is an end of a bin.
        /// Negative pressures are attractive
        const ADHESIVE_CONTACT_PRESSURE: Column = CONTACT_PRESSURE;
        /// width of the bin of pressures
        const ADHESIVE_PRESSURE_BIN_WIDTH: Column = PRESSURE_BIN_WIDTH;
        /// number of nodes, in contact or not, whose pressure lies in the bin; a bin includes its
        /// end next to zero
        const ADHESIVE_PRESSURE_NODES: Column = PRESSURE_NODES;
        /// probability density of the pressure over the nominal area. All nodes count, so that its
        /// integral is 1 and its first moment the load, except for the nodes above all bins
        const ADHESIVE_PRESSURE_DENSITY: Column = PRESSURE_DENSITY;
        /// null, because the theory has no adhesion
        const ADHESIVE_PRESSURE_DENSITY_PERSSON: Column = PRESSURE_DENSITY_PERSSON;
        /// number of nodes whose pressure lies above all bins, equal in all rows of a load
        const ADHESIVE_PRESSURE_NODES_BEYOND: Column = PRESSURE_NODES_BEYOND;
    ];
}

columns! {
    /// nodes whose area, edges and clusters are measured; only for contacts with adhesion
    pub const NODE_SET: Column = parameter_text("node_set").with_codes(codes![
        /// nodes whose gap is zero
        "contact",
        /// nodes with positive pressure
        "repulsive",
    ]);
}
