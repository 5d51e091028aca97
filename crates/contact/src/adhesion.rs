//! Adhesive contact along a path of mean gaps or mean pressures.

use std::fmt;
use std::num::NonZeroUsize;

use asperity_mechanics::adhesion as mechanics;
use asperity_mechanics::adhesion::{AdhesivePath, BISTABLE, Settings, Stop, Target};
use asperity_mechanics::elasticity::{ElasticOperator, FreeHalfSpace, PeriodicHalfSpace};
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::threads::{Threads, available_cores};
use thiserror::Error;

use crate::contact::{LOADS, reduced};
use crate::scale::Scale;
use crate::scale::sealed::OfContact;
use crate::{ContactError, EnergyPerArea, Grid, Length, Material, PressError, Pressure, Surface};

/// Attraction between the surfaces: the energy per area is −w exp(−g/ρ) at the gap g, with the work
/// of adhesion w and the range ρ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adhesion {
    work: EnergyPerArea,
    range: Length,
}

/// Reason why an attraction is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum AdhesionError {
    /// The work of adhesion is negative or not finite.
    #[error("a work of adhesion of {0}; it must be finite and not negative")]
    Work(EnergyPerArea),
    /// The range is not positive and finite.
    #[error("a range of {0}; it must be positive and finite")]
    Range(Length),
}

impl Adhesion {
    /// Creates an attraction from the work of adhesion and the range.
    ///
    /// # Errors
    /// Fails if the work is negative or not finite, or if the range is not positive and finite.
    pub fn new(work: EnergyPerArea, range: Length) -> Result<Self, AdhesionError> {
        let (joules, metres) = (work.in_joules_per_square_metre(), range.in_metres());
        if !(joules >= 0.0 && joules.is_finite()) {
            return Err(AdhesionError::Work(work));
        }
        if !(metres > 0.0 && metres.is_finite()) {
            return Err(AdhesionError::Range(range));
        }
        Ok(Self { work, range })
    }
}

/// Adhesive contact, whose states follow each other: under one load there can be several, and each
/// starts from the one before it. The surfaces are apart in the beginning.
///
/// The steps of a path should be small beside the range of the attraction.
///
/// ```
/// use asperity_contact::{Adhesion, AdhesiveContact, EnergyPerArea, Grid, Length, Material};
/// use asperity_contact::{Pressure, RandomSurface, Spectrum};
///
/// let grid = Grid::square(32, Length::nanometres(400.0))?;
/// let surface = RandomSurface::with_rms_slope(Spectrum::new(0.8, 1..=4)?, 0.05).draw(grid)?;
/// let work = EnergyPerArea::millijoules_per_square_metre(50.0);
/// let adhesion = Adhesion::new(work, Length::nanometres(1.0))?;
/// let modulus = Pressure::gigapascals(10.0);
/// let mut contact = AdhesiveContact::periodic(&surface, Material::elastic(modulus)?, adhesion)?;
/// let touching = contact.press(Pressure::megapascals(5.0))?;
/// assert!(touching.contact_fraction() > 0.0);
/// let apart = contact.press(Pressure::megapascals(-60.0))?;
/// assert!(apart.is_apart() && apart.pull_off_pressure().is_some());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct AdhesiveContact {
    path: AdhesivePath,
    grid: Grid,
    scale: Scale,
}

impl AdhesiveContact {
    /// Prepares the contact of a periodic surface.
    ///
    /// # Errors
    /// Fails as [`Contact::periodic`](crate::Contact::periodic), if the material has a layer or a
    /// hardness, or if the mesh is too coarse for the attraction.
    pub fn periodic(
        surface: &Surface,
        material: Material,
        adhesion: Adhesion,
    ) -> Result<Self, ContactError> {
        Self::new(surface, Boundary::Periodic, material, adhesion)
    }

    /// Prepares the contact of an isolated patch.
    ///
    /// # Errors
    /// Fails as [`AdhesiveContact::periodic`], except that the surface need not be periodic.
    pub fn isolated(
        surface: &Surface,
        material: Material,
        adhesion: Adhesion,
    ) -> Result<Self, ContactError> {
        Self::new(surface, Boundary::Free, material, adhesion)
    }

    fn new(
        surface: &Surface,
        boundary: Boundary,
        material: Material,
        Adhesion { work, range }: Adhesion,
    ) -> Result<Self, ContactError> {
        let (modulus, None, None) = material.parts() else {
            return Err(ContactError::AdhesionOfMaterial);
        };
        let (heights, scale) = reduced(surface, boundary, modulus)?;
        let grid = surface.map().grid();
        let (length, pressure) = (scale.units.length(), scale.units.pressure());
        let (joules, metres) = (work.in_joules_per_square_metre(), range.in_metres());
        let (work, range) = (joules / (pressure * length), metres / length);
        let adhesion = mechanics::Adhesion::new(work, range).map_err(|error| match error {
            mechanics::AdhesionError::Work(value) => {
                ContactError::Range { quantity: "work of adhesion", value }
            }
            _ => ContactError::Range { quantity: "range of the attraction", value: range },
        })?;
        let [step_x, step_y] = grid.spacing();
        let number = adhesion.mesh_number(step_x.max(step_y) / grid.cell().longer_side());
        if number > BISTABLE {
            return Err(ContactError::TooCoarse { number });
        }
        let body: &dyn ElasticOperator = match boundary {
            Boundary::Periodic => &PeriodicHalfSpace::new(grid),
            Boundary::Free => &FreeHalfSpace::new(grid),
        };
        let path = AdhesivePath::new(Threads::one(), body, adhesion, &heights);
        Ok(Self { path, grid: surface.grid(), scale })
    }

    /// Sets the number of threads that share the work of one state; 0 is the number of cores. By
    /// default it is one. Results do not depend on it.
    pub fn threads(mut self, count: usize) -> Self {
        let count = NonZeroUsize::new(count).unwrap_or_else(available_cores);
        self.path.set_threads(Threads::for_mesh(count, self.grid.inner().count()));
        self
    }

    /// Solves the next state of the path, at a mean pressure over the map; negative under tension.
    ///
    /// If no state in contact bears the tension, the surfaces are [apart](AdhesiveState::is_apart).
    ///
    /// # Errors
    /// Fails if the pressure is not finite, or if the state does not converge. The path then
    /// returns to the state before.
    pub fn press(&mut self, mean_pressure: Pressure) -> Result<AdhesiveState, PressError> {
        let load = mean_pressure.reduced(&self.scale);
        if load.is_nan() || load.abs() > LOADS[1] {
            return Err(PressError::Load(load));
        }
        let state = self.step(Target::Load(load))?;
        Ok(if state.is_apart() { state } else { AdhesiveState { mean_pressure, ..state } })
    }

    /// Solves the next state of the path, at a mean gap over the map.
    ///
    /// # Errors
    /// Fails if the gap is not positive and finite, if the state does not converge, or if an
    /// isolated patch jumps past the gap. The path then returns to the state before.
    pub fn press_to_gap(&mut self, mean_gap: Length) -> Result<AdhesiveState, PressError> {
        let gap = mean_gap.in_metres() / self.scale.units.length();
        if !(gap > 0.0 && gap.is_finite()) {
            return Err(PressError::MeanGap(mean_gap));
        }
        let state = self.step(Target::MeanGap(gap))?;
        Ok(AdhesiveState { mean_gap: Some(mean_gap), ..state })
    }

    fn step(&mut self, target: Target) -> Result<AdhesiveState, PressError> {
        let before = self.path.gap().map(<[f64]>::to_vec);
        let state = self.path.step(target, &Settings::OF_STUDIES, &|| false);
        let error = match state.stop {
            Stop::Converged | Stop::PulledOff => return Ok(self.state(&state)),
            Stop::GapNotReached => PressError::NotReached,
            Stop::PairLimit | Stop::Stalled | Stop::Interrupted => {
                PressError::NotConverged { pairs: state.pairs, residual: state.residual }
            }
        };
        self.path.resume(before);
        Err(error)
    }

    fn state(&self, state: &mechanics::AdhesiveState) -> AdhesiveState {
        let Scale { units, .. } = self.scale;
        let (length, unit) = (units.length(), units.pressure());
        let count = self.grid.inner().count() as f64;
        let lengths = |gaps: &[f64]| gaps.iter().map(|gap| Length::metres(gap * length)).collect();
        let energy = |energy: f64| EnergyPerArea::joules_per_square_metre(energy * (unit * length));
        let gaps: Option<Vec<Length>> = self.path.gap().map(lengths);
        AdhesiveState {
            mean_pressure: Pressure::pascals(state.mean_pressure * unit),
            mean_gap: gaps.is_some().then(|| Length::metres(state.mean_gap * length)),
            pull_off: state.pull_off_load.map(|load| Pressure::pascals(load * unit)),
            contact_fraction: state.contact_nodes as f64 / count,
            repulsive_fraction: state.repulsive_nodes as f64 / count,
            energies: gaps
                .is_some()
                .then(|| [state.elastic_energy, state.adhesion_energy].map(energy)),
            pressures: self.path.pressure().iter().map(|p| Pressure::pascals(p * unit)).collect(),
            gaps,
        }
    }
}

impl fmt::Debug for AdhesiveContact {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("AdhesiveContact").field("grid", &self.grid).finish_non_exhaustive()
    }
}

/// State of an adhesive contact.
#[derive(Debug, Clone, PartialEq)]
pub struct AdhesiveState {
    mean_pressure: Pressure,
    mean_gap: Option<Length>,
    pull_off: Option<Pressure>,
    contact_fraction: f64,
    repulsive_fraction: f64,
    energies: Option<[EnergyPerArea; 2]>,
    pressures: Vec<Pressure>,
    gaps: Option<Vec<Length>>,
}

impl AdhesiveState {
    /// Returns true if the surfaces have been pulled off.
    pub fn is_apart(&self) -> bool {
        self.gaps.is_none()
    }

    /// Returns the largest tension under which the surfaces stay together, a negative mean
    /// pressure, if this state is apart.
    pub fn pull_off_pressure(&self) -> Option<Pressure> {
        self.pull_off
    }

    /// Returns the mean pressure over the map, negative under tension.
    pub fn mean_pressure(&self) -> Pressure {
        self.mean_pressure
    }

    /// Returns the mean gap over the map; `None` if the surfaces are apart.
    pub fn mean_gap(&self) -> Option<Length> {
        self.mean_gap
    }

    /// Returns the fraction of the nodes with zero gap.
    pub fn contact_fraction(&self) -> f64 {
        self.contact_fraction
    }

    /// Returns the fraction of the nodes with positive pressure.
    pub fn repulsive_fraction(&self) -> f64 {
        self.repulsive_fraction
    }

    /// Returns the elastic energy per nominal area; `None` if the surfaces are apart.
    pub fn elastic_energy(&self) -> Option<EnergyPerArea> {
        self.energies.map(|[elastic, _]| elastic)
    }

    /// Returns the energy of the attraction per nominal area, which is not positive; `None` if the
    /// surfaces are apart.
    pub fn adhesion_energy(&self) -> Option<EnergyPerArea> {
        self.energies.map(|[_, adhesion]| adhesion)
    }

    /// Returns the pressure at each node, row-major; negative where the surfaces attract each
    /// other.
    pub fn pressures(&self) -> &[Pressure] {
        &self.pressures
    }

    /// Returns the gap at each node, row-major, exactly zero in contact; `None` if the surfaces are
    /// apart.
    pub fn gaps(&self) -> Option<&[Length]> {
        self.gaps.as_deref()
    }
}
