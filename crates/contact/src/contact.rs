//! Contact of a surface with an elastic body, under one load after another.

use std::fmt;
use std::marker::PhantomData;
use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, PoisonError};

use asperity_mechanics::grid::Boundary;
use asperity_mechanics::reduced::{ReducedHeights, Units};
use asperity_mechanics::solver::{
    Body, Elastic, Hardness, Outcome, PreparedSurface, Prescribed, Settings, Solver, Stop,
};
use asperity_mechanics::threads::{Threads, available_cores};
use thiserror::Error;

use crate::scale::{ContactPressure, LoadOf, Scale};
use crate::{Grid, Length, Material, Pressed, Pressure, Surface};

/// Contact of a rough surface with an elastic body.
///
/// Each load is solved alone, from the undeformed surface: the result depends on the surface, the
/// material, the load and the tolerance, and on nothing else, to the last bit. Results stay valid
/// when other loads are solved, and several threads can solve loads at the same time.
///
/// ```
/// use asperity_contact::{Contact, Grid, Length, Material, Pressure, RandomSurface, Spectrum};
///
/// let grid = Grid::square(64, Length::micrometres(100.0))?;
/// let surface = RandomSurface::with_rms_slope(Spectrum::new(0.8, 2..=16)?, 0.1).draw(grid)?;
/// let contact = Contact::periodic(&surface, Material::elastic(Pressure::gigapascals(70.0))?)?;
/// let light = contact.press(Pressure::megapascals(70.0))?;
/// let heavy = contact.press(Pressure::megapascals(700.0))?;
/// assert!(light.area_fraction() < heavy.area_fraction());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// A load that is not positive and finite is an error. Without a modulus, a pressure in pascals
/// does not compile:
///
/// ```compile_fail,E0277
/// # use asperity_contact::{Contact, Grid, Length, Material, Pressure, RandomSurface, Spectrum};
/// # let grid = Grid::square(64, Length::micrometres(100.0))?;
/// # let surface = RandomSurface::with_rms_slope(Spectrum::new(0.8, 2..=16)?, 0.1).draw(grid)?;
/// let contact = Contact::periodic(&surface, Material::reduced())?;
/// contact.press(Pressure::megapascals(70.0))?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Contact<P = Pressure> {
    prepared: Arc<Prepared>,
    threads: Threads,
    settings: Settings,
    pressure: PhantomData<P>,
}

/// Surface and body, with the solvers that are idle. Results keep it to compute gaps and
/// displacements from their pressures.
pub(crate) struct Prepared {
    surface: PreparedSurface,
    idle: Mutex<Vec<Solver>>,
    pub grid: Grid,
    pub boundary: Boundary,
    pub scale: Scale,
    pub hardness: Option<Hardness>,
    /// Compression of a layer on a rigid base under a uniform unit pressure, in units of the
    /// solver.
    pub uniform_compliance: Option<f64>,
    full_contact_load: Option<f64>,
}

/// Reason why a contact cannot be prepared.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum ContactError {
    /// The surface is not periodic, but the contact is.
    #[error(
        "the opposite edges of the surface need not match; use `Contact::isolated`, `Surface::assume_periodic` if \
         they do match, or `MeasuredMap::edges`"
    )]
    NotPeriodic,
    /// The surface is flat.
    #[error("the surface is flat: it touches everywhere under any load")]
    Flat,
    /// The rms slope is far above one, so that heights and sides probably have different units.
    #[error(
        "the rms slope is {rms_slope:.3e}; a half-space needs slopes well below 1: give heights and sides their units"
    )]
    #[non_exhaustive]
    Steep {
        /// Rms slope of the surface.
        rms_slope: f64,
    },
    /// A layer lies below an isolated patch.
    #[error("a layer needs `Contact::periodic`")]
    LayerOfPatch,
    /// A quantity is beyond the numbers of the solver.
    #[error(
        "the {quantity} is {value:e} in reduced units, beyond the numbers of the solver; check its unit"
    )]
    #[non_exhaustive]
    Range {
        /// Name of the quantity.
        quantity: &'static str,
        /// Its value in units of E* h′ and h′ L.
        value: f64,
    },
    /// Layer or hardness with adhesion.
    #[error("adhesion needs an elastic half-space, without layer and hardness")]
    AdhesionOfMaterial,
    /// The mesh is too coarse for the attraction.
    #[error(
        "mesh step × work/(E* range²) is {number:.2}: single nodes jump into contact above 1.57, and 0.3 is accurate; \
         use more nodes or a longer range"
    )]
    #[non_exhaustive]
    TooCoarse {
        /// Δx w/(E* ρ²).
        number: f64,
    },
}

/// Reason why a load cannot be solved.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum PressError {
    /// The load is not positive and finite.
    #[error("the mean pressure is {0:e} E* × rms slope; it must be between 1e-15 and 1e15")]
    Load(f64),
    /// The mean pressure is not below the hardness.
    #[error(
        "the mean pressure {load:e} is not below the hardness {hardness:e} (in units of E* × rms slope)"
    )]
    #[non_exhaustive]
    AboveHardness {
        /// Mean pressure in units of E* h′.
        load: f64,
        /// Hardness in units of E* h′.
        hardness: f64,
    },
    /// The mean gap is not positive and finite.
    #[error("the mean gap is {0}; it must be positive and finite")]
    MeanGap(Length),
    /// The surfaces do not touch at the mean gap.
    #[error("the surfaces do not touch at this mean gap; choose a smaller one")]
    NoContact,
    /// No load gives the mean gap, or an adhesive contact jumps past it.
    #[error("no load gives this mean gap; choose a larger one, or another path with adhesion")]
    NotReached,
    /// The residual is above the tolerance.
    #[error(
        "the contact did not converge within {pairs} pairs of transforms: the residual is {residual:.1e}; raise \
         `tolerance` or `max_pairs` of `Contact`, or take shorter steps along the path of an `AdhesiveContact`"
    )]
    #[non_exhaustive]
    NotConverged {
        /// Pairs of transforms used.
        pairs: u32,
        /// Largest violation of the contact conditions.
        residual: f64,
    },
}

/// Reason why the settings of a contact are invalid.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("a tolerance of {0}; it must be at least 1e-12 and at most 0.01")]
pub struct ToleranceError(f64);

/// Rms slope above which heights and sides have different units.
const STEEP: f64 = 10.0;

/// Range of tolerances: rounding below, and no contact solved above.
const TOLERANCES: [f64; 2] = [1e-12, 1e-2];

/// Range of reduced loads and of other pressures.
pub(crate) const LOADS: [f64; 2] = [1e-15, 1e15];

impl<P: ContactPressure> Contact<P> {
    /// Prepares the contact of a periodic surface.
    ///
    /// # Errors
    /// Fails if the surface is not periodic, flat, or steeper than any surface whose heights and
    /// sides have the same unit.
    pub fn periodic(surface: &Surface, material: Material<P>) -> Result<Self, ContactError> {
        Self::new(surface, Boundary::Periodic, material)
    }

    /// Prepares the contact of an isolated patch on a half-space: the pressure outside the map is
    /// zero.
    ///
    /// # Errors
    /// Fails if the material has a layer, or if the surface is flat or steeper than any surface
    /// whose heights and sides have the same unit.
    pub fn isolated(surface: &Surface, material: Material<P>) -> Result<Self, ContactError> {
        Self::new(surface, Boundary::Free, material)
    }

    fn new(
        surface: &Surface,
        boundary: Boundary,
        material: Material<P>,
    ) -> Result<Self, ContactError> {
        let (modulus, hardness, layer) = material.parts();
        let (heights, scale) = reduced(surface, boundary, modulus)?;
        let reduced = hardness.map(|hardness| within("hardness", hardness.reduced(&scale)));
        let bound = reduced.transpose()?.and_then(|reduced| Hardness::new(reduced).ok());
        let layer = match layer {
            Some(_) if boundary == Boundary::Free => return Err(ContactError::LayerOfPatch),
            Some(layer) => {
                let side = surface.map().grid().cell().longer_side();
                let outside =
                    ContactError::Range { quantity: "thickness of the layer", value: 0.0 };
                Some(layer.below(side).map_err(|_| outside)?)
            }
            None => None,
        };
        let elastic = layer.map_or(boundary.into(), Elastic::Layer);
        let body = Body { elastic, hardness: bound };
        let solver = body.solver(&heights);
        let prepared = Prepared {
            surface: solver.prepared(),
            grid: surface.grid(),
            boundary,
            scale,
            hardness: bound,
            uniform_compliance: layer.and_then(|layer| layer.uniform_compliance()),
            full_contact_load: solver.full_contact_load(),
            idle: Mutex::new(vec![solver]),
        };
        Ok(Self {
            prepared: Arc::new(prepared),
            threads: Threads::one(),
            settings: Settings::default(),
            pressure: PhantomData,
        })
    }

    /// Sets the number of threads that share the work of one load; 0 is the number of cores. By
    /// default it is one. Results do not depend on it. Maps of less than 512 × 512 nodes use one.
    pub fn threads(self, count: usize) -> Self {
        let count = NonZeroUsize::new(count).unwrap_or_else(available_cores);
        let threads = Threads::for_mesh(count, self.prepared.grid.inner().count());
        Self { threads, ..self }
    }

    /// Sets the largest accepted gap in contact and penetration outside it, in units of rms slope ×
    /// mesh step; 5e-5 by default.
    ///
    /// # Errors
    /// Fails if the tolerance is not between 1e-12 and 0.01.
    pub fn tolerance(self, tolerance: f64) -> Result<Self, ToleranceError> {
        if !(TOLERANCES[0]..=TOLERANCES[1]).contains(&tolerance) {
            return Err(ToleranceError(tolerance));
        }
        Ok(Self { settings: Settings { tolerance, ..self.settings }, ..self })
    }

    /// Sets the maximum number of pairs of Fourier transforms for one load; 2000 by default, where
    /// rough surfaces take 15.
    pub fn max_pairs(self, pair_limit: u32) -> Self {
        Self { settings: Settings { pair_limit, ..self.settings }, ..self }
    }

    /// Presses the surface with a mean pressure over the map, or with a force on it.
    ///
    /// # Errors
    /// Fails if the load is not positive and finite, or not below the hardness, or if the solver
    /// does not converge.
    pub fn press(&self, load: impl LoadOf<P>) -> Result<Pressed<P>, PressError> {
        let (load, mean) = load.resolve(&self.prepared.scale);
        if !(LOADS[0]..=LOADS[1]).contains(&load) {
            return Err(PressError::Load(load));
        }
        if let Some(hardness) = self.prepared.hardness.filter(|bound| load >= bound.pressure()) {
            return Err(PressError::AboveHardness { load, hardness: hardness.pressure() });
        }
        self.solve(|solver| (load, solver.press(load, &self.settings, &|| false)), Some(mean))
    }

    /// Presses the surface to a mean gap over the map. The load is a result.
    ///
    /// # Errors
    /// Fails if the gap is not positive and finite, if the surfaces do not touch at it, if no load
    /// gives it, or if the solver does not converge.
    pub fn press_to_gap(&self, mean_gap: Length) -> Result<Pressed<P>, PressError> {
        let reduced = mean_gap.in_metres() / self.prepared.scale.units.length();
        if !(reduced > 0.0 && reduced.is_finite()) {
            return Err(PressError::MeanGap(mean_gap));
        }
        let gap = Prescribed::MeanGap(reduced);
        self.solve(|solver| solver.press_to(gap, &self.settings, &|| false), None)
    }

    /// Solves a load that the solver returns with its outcome. `given` is the mean pressure, if it
    /// is prescribed.
    fn solve(
        &self,
        solve: impl FnOnce(&mut Solver) -> (f64, Outcome),
        given: Option<P>,
    ) -> Result<Pressed<P>, PressError> {
        let prepared = &self.prepared;
        let (load, mut outcome, pressure) = prepared.with_solver(&self.threads, |solver| {
            let (load, outcome) = solve(solver);
            (load, outcome, solver.pressure().to_vec())
        });
        match outcome.stop {
            Stop::Converged | Stop::FullContact => (),
            Stop::NoContact => return Err(PressError::NoContact),
            Stop::NotReached => return Err(PressError::NotReached),
            Stop::PairLimit | Stop::Interrupted => {
                let Outcome { pairs, residual, .. } = outcome;
                return Err(PressError::NotConverged { pairs, residual });
            }
        }
        if let Some(compliance) = prepared.uniform_compliance {
            // The solver leaves the uniform compression of a layer out.
            outcome.energy += 0.5 * load * (compliance * load);
        }
        let mean = given.unwrap_or_else(|| P::of_load(load, &prepared.scale));
        Ok(Pressed::new(prepared.clone(), self.threads.clone(), pressure, outcome, load, mean))
    }

    /// Returns the smallest mean pressure that brings every node into contact. Returns `None` for
    /// an isolated patch, and if the material yields before.
    pub fn full_contact_pressure(&self) -> Option<P> {
        self.prepared.full_contact_load.map(|load| P::of(load, &self.prepared.scale))
    }
}

impl<P> fmt::Debug for Contact<P> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Prepared { grid, boundary, .. } = &*self.prepared;
        formatter
            .debug_struct("Contact")
            .field("grid", grid)
            .field("boundary", boundary)
            .finish_non_exhaustive()
    }
}

impl Prepared {
    /// Calls a function with an idle solver, or with a new one if all are busy.
    pub fn with_solver<T>(&self, threads: &Threads, work: impl FnOnce(&mut Solver) -> T) -> T {
        let lock = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let waiting = lock().pop();
        let mut solver = waiting.unwrap_or_else(|| self.surface.solver(Threads::one()));
        solver.set_threads(threads.clone());
        let result = work(&mut solver);
        lock().push(solver);
        result
    }
}

/// Returns the heights of a surface in units of the solver, and the scale of the contact.
pub(crate) fn reduced(
    surface: &Surface,
    boundary: Boundary,
    modulus: f64,
) -> Result<(ReducedHeights, Scale), ContactError> {
    let (map, rms_slope) = (surface.map(), surface.rms_slope());
    if boundary == Boundary::Periodic && !surface.is_periodic() {
        return Err(ContactError::NotPeriodic);
    }
    if rms_slope > STEEP {
        return Err(ContactError::Steep { rms_slope });
    }
    if rms_slope == 0.0 {
        return Err(ContactError::Flat);
    }
    let cell = map.grid().cell();
    let of_range = |quantity, value| ContactError::Range { quantity, value };
    let units =
        Units::new(cell, rms_slope, modulus).map_err(|_| of_range("rms slope", rms_slope))?;
    within("unit of length", units.length())?;
    within("unit of pressure", units.pressure())?;
    let heights =
        units.reduced_heights(map.clone()).map_err(|_| of_range("height", f64::INFINITY))?;
    Ok((heights, Scale { units, area: cell.area() }))
}

/// Returns a positive number of the solver.
fn within(quantity: &'static str, value: f64) -> Result<f64, ContactError> {
    if value > 1e-100 && value < 1e100 {
        Ok(value)
    } else {
        Err(ContactError::Range { quantity, value })
    }
}
