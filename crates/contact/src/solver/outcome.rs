//! What a solution is asked for, and what is known of it.

/// At this tolerance contact counts on 1024² nodes are within 2 nodes of those at 1e-10 at each of 1320 loads on twelve
/// surfaces of three spectra; of the nodes, 0.07 are wrong on average.
pub const DEFAULT_TOLERANCE: f64 = 5e-5;
/// Far more than any load of a rough surface takes.
pub const DEFAULT_PAIR_LIMIT: u32 = 2000;

/// When a load counts as solved, and when to give up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest [`Outcome::residual`] of a solution, yielding or not. It is held to a tenth, too, of what the mean
    /// pressure in contact displaces one node by: less than the default only where that pressure is
    /// below 5e-4 E* × rms slope.
    pub tolerance: f64,
    /// Transform pairs, forward and inverse, after which a load is given up; asked once an
    /// iteration, so that a few more may be spent.
    pub pair_limit: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { tolerance: DEFAULT_TOLERANCE, pair_limit: DEFAULT_PAIR_LIMIT }
    }
}

/// How a load ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// Within the tolerance.
    Converged,
    /// Every node is in contact, and the pressure follows from a formula.
    FullContact,
    /// Out of transform pairs; the pressure is the best known.
    PairLimit,
    /// Told to stop.
    Interrupted,
}

/// What is known of a load besides its pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub stop: Stop,
    /// Transform pairs spent, in both precisions; those on coarser meshes by their nodes.
    pub pairs: u32,
    /// The largest violation of the conditions of contact by the pressures that are kept, evaluated in
    /// double precision, in units of rms slope × the smaller mesh step: |g| in elastic contact, the
    /// penetration −g outside contact, and g at saturated nodes, where only yielding may make it
    /// negative. The gap is measured from its mean in elastic contact; the bounds of the pressure hold
    /// exactly.
    pub residual: f64,
    /// Nodes with pressure.
    pub contact_nodes: usize,
    /// Of these, the ones that bear the hardness: none without one.
    pub saturated_nodes: usize,
    /// Mean gap over the map, in units of rms slope × its longer side. Where the material has
    /// yielded there is none.
    pub mean_gap: f64,
    /// The depth to which saturated nodes have yielded, −g ≥ 0, as its mean over the map: the volume
    /// that has yielded, per area. In units of rms slope × longer side; zero without a hardness.
    pub yielded_depth: f64,
    /// Elastic energy per area ½⟨p u⟩, in units of E* × rms slope² × longer side. What is dissipated
    /// by yielding is not in it: the hardness × [`Outcome::yielded_depth`].
    pub energy: f64,
    /// In units of E* × rms slope: the hardness, where a node is saturated.
    pub peak_pressure: f64,
}
