//! Asperity models on a given surface: Hertz contacts of its summits, with elastic interaction.
//!
//! Summit i has the height zᵢ and two principal curvatures. Under the approach dᵢ it carries the
//! force of the elliptic Hertz contact, Fᵢ = Cᵢ dᵢ^(3/2), on an ellipse of area Bᵢ dᵢ. The approach
//! is the height of the summit above the reference plane, minus the displacement uᵢ of the body by
//! the other forces:
//!
//! ```text
//! dᵢ = zᵢ − z_ref − uᵢ,     uᵢ = Σⱼ Gᵢⱼ Fⱼ,     Σᵢ Fᵢ = p₀ A₀
//! ```
//!
//! The load determines z_ref, and [`Interaction`] determines u. The model is valid while contacts
//! are separate; [`AsperityOutcome`] counts contacts whose ellipses overlap.
//!
//! Units are those of the solver: in-plane lengths in units of the longer side L of the cell,
//! heights and displacements in h′ L, pressures in E* h′ with the rms slope h′. In these units
//! E* = 1.
//!
//! Module `summits` finds the summits, their curvatures and overlapping contacts. Module
//! `equilibrium` solves for the forces under a load.

use super::grid::Grid;
use super::reduced::ReducedHeights;
use super::solver::{Outcome, Settings};

mod equilibrium;
mod summits;

use equilibrium::Body;
#[cfg(test)]
pub(crate) use equilibrium::samples;
use summits::Summit;

/// Elastic interaction of asperities through the half-space.
///
/// In the mean-field interaction, the mean pressure displaces all asperities by u = w p₀ L/E*
/// (Ciavarella, Delfine & Demelio, J. Mech. Phys. Solids 54, 2569 (2006), to first order). Here w
/// L/E* is the mean displacement of a square of side L under unit pressure. The explicit
/// interaction includes the periodic images of all forces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Interaction {
    /// No interaction between asperities.
    None,
    /// Uniform displacement by the mean pressure. It does not change areas and forces under a given
    /// load.
    MeanField,
    /// Displacement of each asperity by the forces of all others.
    Explicit,
}

impl Interaction {
    /// All kinds of interaction, from none to explicit.
    pub const ALL: [Interaction; 3] =
        [Interaction::None, Interaction::MeanField, Interaction::Explicit];

    /// Returns the name used in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Interaction::None => "none",
            Interaction::MeanField => "mean-field",
            Interaction::Explicit => "explicit",
        }
    }
}

/// Mean displacement of a unit square on a half-space with E* = 1 under unit pressure:
/// (4/π) [ln(1 + √2) − (√2 − 1)/3].
const MEAN_OF_A_SQUARE: f64 = 0.946_402_008_818_677;

/// Solution of the asperity model under a load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AsperityOutcome {
    /// Results in the form of the boundary-element solver.
    ///
    /// Contact nodes are the nodes inside the ellipses. The mean gap is the distance of the mean
    /// planes. The residual is the largest change of a displacement in one more iteration, in units
    /// of h′ min(Δx, Δy).
    pub outcome: Outcome,
    /// Number of summits in contact.
    pub contacts: usize,
    /// Number of contact ellipses that overlap another ellipse.
    pub overlapping: usize,
    /// Sum of the areas of the ellipses divided by the nominal area.
    pub area_fraction: f64,
    /// Area of the ellipses that overlap another ellipse, as a fraction of the area of all
    /// ellipses.
    pub overlapping_fraction: f64,
    /// Displacement of the body by the mean pressure, in units of h′ L. It is zero without
    /// interaction.
    ///
    /// The reference plane is closer to the unloaded body by this amount.
    pub nominal_displacement: f64,
}

/// Asperity model of a surface on an elastic half-space.
pub struct Asperities {
    grid: Grid,
    interaction: Interaction,
    mean_height: f64,
    summits: Vec<Summit>,
    body: Option<Body>,
    pressure: Vec<f64>,
}

/// Error for a surface without summits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the surface has no node above its eight neighbours, so there is no asperity to press")]
pub struct NoSummits;

impl Asperities {
    /// Creates the model from heights on a periodic grid.
    ///
    /// # Errors
    /// Fails if the surface has no summit.
    pub fn new(heights: &ReducedHeights, interaction: Interaction) -> Result<Self, NoSummits> {
        let (grid, heights) = (heights.grid(), heights.as_slice());
        let summits = summits::find(grid, heights);
        if summits.is_empty() {
            return Err(NoSummits);
        }
        Ok(Self {
            grid,
            interaction,
            mean_height: heights.iter().sum::<f64>() / heights.len() as f64,
            summits,
            body: (interaction == Interaction::Explicit).then(|| Body::new(grid)),
            pressure: vec![0.0; heights.len()],
        })
    }

    /// Returns the number of summits.
    pub fn summits(&self) -> usize {
        self.summits.len()
    }

    /// Solves for the forces of the summits under a load y = p₀/(E* h′), and updates
    /// [`Asperities::pressure()`]. The result does not depend on loads that were solved before.
    pub fn press(&mut self, load: f64, settings: &Settings) -> AsperityOutcome {
        let found = self.equilibrium(load, settings);
        let area = nominal_area(self.grid);
        let contacts = summits::contacts(&self.summits, &found.overlaps);
        let overlapping = summits::overlapping(self.grid, &contacts);
        summits::draw(self.grid, &contacts, &mut self.pressure);
        let areas = || contacts.iter().map(|contact| contact.area);
        let all: f64 = areas().sum();
        let merged: f64 =
            areas().zip(&overlapping).filter(|(_, overlaps)| **overlaps).map(|(one, _)| one).sum();
        let peaks = contacts.iter().map(|contact| contact.peak_pressure);
        AsperityOutcome {
            outcome: Outcome {
                stop: found.stop,
                pairs: found.pairs,
                residual: found.residual,
                contact_nodes: self.pressure.iter().filter(|p| **p > 0.0).count(),
                mean_gap: found.reference - self.mean_height,
                energy: found.energy / area,
                peak_pressure: peaks.fold(0.0, f64::max),
                ..Outcome::default()
            },
            contacts: contacts.len(),
            overlapping: overlapping.iter().filter(|overlaps| **overlaps).count(),
            area_fraction: all / area,
            overlapping_fraction: merged / all,
            nominal_displacement: match self.interaction {
                Interaction::None => 0.0,
                Interaction::MeanField | Interaction::Explicit => {
                    MEAN_OF_A_SQUARE * load * area.sqrt()
                }
            },
        }
    }

    /// Returns the Hertz pressure at each node under the last load, in units of E* h′.
    pub fn pressure(&self) -> &[f64] {
        &self.pressure
    }
}

/// Returns the area of the cell, L_x L_y/L².
pub(crate) fn nominal_area(grid: Grid) -> f64 {
    let [aspect_x, aspect_y] = grid.cell().aspect();
    1.0 / (aspect_x * aspect_y)
}

/// Returns Δx/L and Δy/L.
pub(crate) fn steps(grid: Grid) -> [f64; 2] {
    let (nodes, aspect) = (grid.nodes(), grid.cell().aspect());
    [0, 1].map(|axis| 1.0 / (aspect[axis] * nodes[axis] as f64))
}

#[cfg(test)]
mod tests;
