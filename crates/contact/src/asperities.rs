//! Asperity models on the very surface that a solver presses: Hertz' contacts of its summits, which
//! act on each other through the elastic body.
//!
//! Summit i stands at height zᵢ and bends by two principal curvatures. Under an overlap dᵢ it
//! carries the force of Hertz' elliptic contact, Fᵢ = Cᵢ dᵢ^(3/2), and touches on an ellipse of
//! area Bᵢ dᵢ. The overlap is what the reference plane and the displacement of the
//! body by all other forces leave of the height,
//!
//! ```text
//! dᵢ = zᵢ − z_ref − uᵢ,     uᵢ = Σⱼ Gᵢⱼ Fⱼ,     Σᵢ Fᵢ = p₀ A₀
//! ```
//!
//! and z_ref follows from the load. What u is, [`Interaction`] says. The model holds as long as
//! contacts stay apart: those whose ellipses overlap are counted, with the area that they have.
//!
//! Units are those of the solver: lengths along the plane in longer sides of the cell, heights and
//! displacements in rms slope × longer side, pressures in E* × rms slope, and so E* = 1.
//!
//! `summits` says where they are, how they bend and which contacts overlap, `equilibrium` which
//! forces they bear under a load, and what a force does to the body at a distance.

use super::grid::Grid;
use super::solver::{Outcome, Settings};

mod equilibrium;
mod summits;

use equilibrium::Body;
use summits::Summit;

/// How asperities act on each other.
///
/// The mean pressure displaces all asperities by u = w p₀ L/E*, with w L the mean displacement of
/// a square of side L under unit pressure (Ciavarella, Delfine & Demelio, J. Mech. Phys. Solids 54,
/// 2569 (2006), to first order). Explicit forces are summed over the periodic cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Interaction {
    /// Not at all.
    None,
    /// Through the mean pressure, which displaces the body uniformly: areas and forces under a load
    /// are those without interaction.
    MeanField,
    /// Each through its own force.
    Explicit,
}

impl Interaction {
    /// Every one.
    pub const ALL: [Interaction; 3] =
        [Interaction::None, Interaction::MeanField, Interaction::Explicit];

    /// The word in manifests and tables.
    pub fn word(self) -> &'static str {
        match self {
            Interaction::None => "none",
            Interaction::MeanField => "mean-field",
            Interaction::Explicit => "explicit",
        }
    }
}

/// The mean displacement of a square of side one on a half-space with E* = 1 under unit pressure:
/// (4/π) [ln(1 + √2) − (√2 − 1)/3].
const MEAN_OF_A_SQUARE: f64 = 0.946_402_008_818_677;

/// What is known of a load on asperities, beside what solvers tell of any.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AsperityOutcome {
    /// As of a solver. The contact nodes are those within the ellipses, the mean gap is the
    /// distance of the mean planes, the residual the largest change of a displacement that another
    /// iteration would make.
    pub outcome: Outcome,
    /// Summits that touch.
    pub contacts: usize,
    /// Those among them whose ellipse overlaps another.
    pub overlapping: usize,
    /// Σ of the ellipses' areas over the nominal area.
    pub area_fraction: f64,
    /// Share of that area in ellipses that overlap another.
    pub overlapping_share: f64,
    /// What the mean pressure displaces the body by, as the mean field has it; zero without
    /// interaction. The reference plane is that much nearer to the unloaded body.
    pub nominal_displacement: f64,
}

/// The summits of a surface on an elastic half-space.
pub struct Asperities {
    grid: Grid,
    interaction: Interaction,
    mean_height: f64,
    summits: Vec<Summit>,
    body: Option<Body>,
    /// Displacements and loads solved for before, the last one first.
    known: Vec<(f64, Vec<f64>)>,
    pressure: Vec<f64>,
}

/// A surface has no summit: it is flat, or rises towards one place on a ridge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the surface has no node above its eight neighbours, and so no asperity to press")]
pub struct NoSummits;

impl Asperities {
    /// The summits of heights on a periodic grid, in units of rms slope × longer side.
    ///
    /// # Errors
    /// When there is none.
    pub fn new(grid: Grid, heights: &[f64], interaction: Interaction) -> Result<Self, NoSummits> {
        assert_eq!(heights.len(), grid.count());
        let summits = summits::of(grid, heights);
        if summits.is_empty() {
            return Err(NoSummits);
        }
        Ok(Self {
            grid,
            interaction,
            mean_height: heights.iter().sum::<f64>() / heights.len() as f64,
            summits,
            body: (interaction == Interaction::Explicit).then(|| Body::new(grid)),
            known: Vec::new(),
            pressure: vec![0.0; heights.len()],
        })
    }

    /// Number of summits.
    pub fn summits(&self) -> usize {
        self.summits.len()
    }

    /// The forces under a load y = p₀/(E* h′), and what follows from them.
    pub fn press(&mut self, load: f64, settings: &Settings) -> AsperityOutcome {
        let found = self.equilibrium(load, settings);
        let area = nominal_area(self.grid);
        let contacts = summits::contacts(&self.summits, &found.overlaps);
        let overlapping = summits::overlapping(self.grid, &contacts);
        summits::draw(self.grid, &contacts, &mut self.pressure);
        let areas = || contacts.iter().map(|contact| contact.area);
        let all: f64 = areas().sum();
        let merged = areas().zip(&overlapping);
        let merged: f64 = merged.filter(|(_, overlaps)| **overlaps).map(|(one, _)| one).sum();
        let peaks = contacts.iter().map(|contact| contact.peak_pressure);
        AsperityOutcome {
            outcome: Outcome {
                stop: found.stop,
                pairs: found.pairs,
                residual: found.residual,
                contact_nodes: self.pressure.iter().filter(|p| **p > 0.0).count(),
                saturated_nodes: 0,
                mean_gap: found.reference - self.mean_height,
                yielded_depth: 0.0,
                energy: found.energy / area,
                peak_pressure: peaks.fold(0.0, f64::max),
            },
            contacts: contacts.len(),
            overlapping: overlapping.iter().filter(|overlaps| **overlaps).count(),
            area_fraction: all / area,
            overlapping_share: merged / all,
            nominal_displacement: match self.interaction {
                Interaction::None => 0.0,
                Interaction::MeanField | Interaction::Explicit => {
                    MEAN_OF_A_SQUARE * load * area.sqrt()
                }
            },
        }
    }

    /// The pressures of the last load, Hertz' within each ellipse, in units of E* × rms slope.
    pub fn pressure(&self) -> &[f64] {
        &self.pressure
    }
}

/// Area of the cell in units of its longer side.
fn nominal_area(grid: Grid) -> f64 {
    let [aspect_x, aspect_y] = grid.cell().aspect();
    1.0 / (aspect_x * aspect_y)
}

/// Distance between neighbours along x and y in units of the longer side.
fn steps(grid: Grid) -> [f64; 2] {
    let (nodes, aspect) = (grid.nodes(), grid.cell().aspect());
    [0, 1].map(|axis| 1.0 / (aspect[axis] * nodes[axis] as f64))
}

#[cfg(test)]
mod tests;
