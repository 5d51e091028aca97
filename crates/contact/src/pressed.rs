//! Solution of a contact under one load.

use std::fmt;
use std::sync::Arc;

use asperity_mechanics::flow as mechanics;
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::morphology::area::{ContactArea, YASTREBOV_2017};
use asperity_mechanics::morphology::clusters;
use asperity_mechanics::morphology::map::ContactMap;
use asperity_mechanics::solver::Outcome;
use asperity_mechanics::threads::Threads;
use thiserror::Error;

use crate::contact::Prepared;
use crate::scale::ContactPressure;
use crate::{EnergyPerArea, Grid, Length, Pressure, ReducedPressure};

/// Converged solution of a contact under one load.
///
/// Maps are row-major, as the heights are. A result keeps the prepared surface in memory.
#[derive(Clone)]
pub struct Pressed<P = Pressure> {
    prepared: Arc<Prepared>,
    threads: Threads,
    /// Pressures in units of E* h′.
    pressure: Vec<f64>,
    outcome: Outcome,
    load: f64,
    mean: P,
}

impl<P: ContactPressure> Pressed<P> {
    pub(crate) fn new(
        prepared: Arc<Prepared>,
        threads: Threads,
        pressure: Vec<f64>,
        outcome: Outcome,
        load: f64,
        mean: P,
    ) -> Self {
        Self { prepared, threads, pressure, outcome, load, mean }
    }

    /// Returns the grid of the maps.
    pub fn grid(&self) -> Grid {
        self.prepared.grid
    }

    /// Returns the load p₀/(E* h′).
    pub fn load(&self) -> ReducedPressure {
        ReducedPressure::new(self.load)
    }

    /// Returns the mean pressure p₀ over the map.
    pub fn mean_pressure(&self) -> P {
        self.mean
    }

    /// Returns the largest pressure.
    pub fn peak_pressure(&self) -> P {
        P::of(self.outcome.peak_pressure, &self.prepared.scale)
    }

    /// Returns the fraction of the nodes in contact.
    ///
    /// It exceeds the true contact area, by about the perimeter × half a mesh step.
    pub fn area_fraction(&self) -> f64 {
        self.outcome.contact_nodes as f64 / self.pressure.len() as f64
    }

    /// Returns the fraction of the area in contact, corrected for the mesh by the perimeter
    /// (Yastrebov, Anciaux & Molinari 2017). It can be negative for contacts of few nodes. Returns
    /// `None` if the mesh steps along x and y differ.
    pub fn corrected_area_fraction(&self) -> Option<f64> {
        let counted = ContactArea::from_map(&self.map()).counted();
        self.grid().inner().has_square_cells().then(|| counted.corrected(YASTREBOV_2017))
    }

    /// Returns the fraction of the nodes whose pressure is the hardness.
    pub fn saturated_fraction(&self) -> f64 {
        self.outcome.saturated_nodes as f64 / self.pressure.len() as f64
    }

    /// Returns true if every node is in contact.
    pub fn is_full_contact(&self) -> bool {
        self.outcome.contact_nodes == self.pressure.len()
    }

    /// Returns the mean gap over the map. Nodes that have yielded count as zero gap.
    pub fn mean_gap(&self) -> Length {
        self.length(self.outcome.mean_gap)
    }

    /// Returns the pressure at each node, exactly zero outside the contact.
    pub fn pressures(&self) -> Vec<P> {
        self.pressure.iter().map(|pressure| P::of(*pressure, &self.prepared.scale)).collect()
    }

    /// Returns the gap at each node: zero in contact, negative by the yielded depth where the
    /// pressure is the hardness.
    pub fn gaps(&self) -> Vec<Length> {
        let gaps =
            self.prepared.with_solver(&self.threads, |solver| solver.gap_under(&self.pressure));
        gaps.into_iter().map(|gap| self.length(gap)).collect()
    }

    /// Returns the displacement of the elastic body at each node, positive into the body. Its mean
    /// is zero in a periodic contact; that of an isolated patch is relative to points far away.
    pub fn displacements(&self) -> Vec<Length> {
        let displacements = self
            .prepared
            .with_solver(&self.threads, |solver| solver.displacement_under(&self.pressure));
        displacements.into_iter().map(|displacement| self.length(displacement)).collect()
    }

    /// Returns the contact map: true at nodes in contact.
    pub fn contact_map(&self) -> Vec<bool> {
        self.pressure.iter().map(|pressure| *pressure > 0.0).collect()
    }

    /// Returns the contact spots: nodes that are connected through their 4 nearest neighbours.
    pub fn spots(&self) -> Vec<Spot> {
        let [step_x, step_y] = self.grid().inner().spacing();
        let spots = clusters::Spot::all(&self.map()).into_iter();
        let spot = |spot: clusters::Spot| Spot {
            nodes: spot.nodes,
            fraction: spot.nodes as f64 / self.pressure.len() as f64,
            centre: [spot.centre[0] * step_x, spot.centre[1] * step_y].map(Length::metres),
        };
        spots.map(spot).collect()
    }

    /// Computes the flow of a thin film through the gap, by Reynolds' equation with periodic
    /// boundaries.
    ///
    /// # Errors
    /// Fails for an isolated patch, and if the bounds of the flow remain too far apart.
    pub fn flow(&self) -> Result<Flow, FlowError> {
        if self.prepared.boundary == Boundary::Free {
            return Err(FlowError::Isolated);
        }
        // Studies compute the flow from stored pressures, in the unit of the modulus.
        let unit = self.prepared.scale.units.pressure();
        let hardness = self.prepared.hardness.map_or(f64::INFINITY, |hardness| hardness.pressure());
        let restored = |pressure: &f64| {
            let stored = pressure * unit;
            if stored >= hardness * unit { hardness } else { stored / unit }
        };
        let pressure: Vec<f64> = self.pressure.iter().map(restored).collect();
        let mut gap =
            self.prepared.with_solver(&self.threads, |solver| solver.gap_under(&pressure));
        for (gap, pressure) in gap.iter_mut().zip(&pressure) {
            *gap = if *pressure > 0.0 { 0.0 } else { *gap };
        }
        let [along_x, along_y] = mechanics::flow_through(self.grid().inner(), &gap);
        let length = self.prepared.scale.units.length();
        let not_converged =
            |mechanics::Unconverged { residual }| FlowError::NotConverged { residual };
        let conductivities = [along_x.map_err(not_converged)?, along_y.map_err(not_converged)?]
            .map(|flow| flow.conductivity * length.powi(3));
        Ok(Flow { conductivities, mean_gap: self.mean_gap() })
    }

    fn map(&self) -> ContactMap {
        ContactMap::from_pressures(self.grid().nodes(), &self.pressure)
            .with_boundary(self.prepared.boundary)
    }

    fn length(&self, reduced: f64) -> Length {
        Length::metres(reduced * self.prepared.scale.units.length())
    }
}

impl Pressed<Pressure> {
    /// Returns the elastic energy per nominal area.
    pub fn elastic_energy(&self) -> EnergyPerArea {
        let units = self.prepared.scale.units;
        EnergyPerArea::joules_per_square_metre(
            self.outcome.energy * (units.pressure() * units.length()),
        )
    }
}

impl<P: fmt::Debug> fmt::Debug for Pressed<P> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Pressed")
            .field("load", &self.load)
            .field("mean_pressure", &self.mean)
            .field("contact_nodes", &self.outcome.contact_nodes)
            .finish_non_exhaustive()
    }
}

/// Contact spot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    nodes: usize,
    fraction: f64,
    centre: [Length; 2],
}

impl Spot {
    /// Returns the number of nodes.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Returns the area as a fraction of the nominal area.
    pub fn area_fraction(&self) -> f64 {
        self.fraction
    }

    /// Returns the position of the centre along x and y. A spot that lies evenly around a periodic
    /// cell has no centre along that axis; its position is zero.
    pub fn centre(&self) -> [Length; 2] {
        self.centre
    }
}

/// Flow of a thin film through the gap, along x and y.
///
/// The mean flow per unit width is −K/(12 μ) × the mean pressure gradient, with the viscosity μ and
/// the effective conductivity K, which is g³ for parallel walls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow {
    conductivities: [f64; 2],
    mean_gap: Length,
}

impl Flow {
    /// Returns the effective conductivities K along x and y in cubic metres, zero where no channel
    /// percolates.
    pub fn conductivities(&self) -> [f64; 2] {
        self.conductivities
    }

    /// Returns the flow factors K/⟨g⟩³ along x and y.
    pub fn flow_factors(&self) -> [f64; 2] {
        let gap = self.mean_gap.in_metres();
        self.conductivities.map(|k| if k > 0.0 { k / gap.powi(3) } else { 0.0 })
    }

    /// Returns whether a channel percolates along x and y.
    pub fn percolates(&self) -> [bool; 2] {
        self.conductivities.map(|k| k > 0.0)
    }
}

/// Reason why a flow cannot be computed.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum FlowError {
    /// The contact is an isolated patch.
    #[error("the flow needs a periodic gap; use `Contact::periodic`")]
    Isolated,
    /// The bounds of the flow remain too far apart.
    #[error("the flow did not converge: its bounds differ by {residual:.1e}")]
    #[non_exhaustive]
    NotConverged {
        /// Relative distance between the bounds.
        residual: f64,
    },
}
