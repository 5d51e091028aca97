//! Surfaces and contacts in memory, without a study.
//!
//! The input consists of the keys of a `generate` or `solve` stage, which are checked as in a
//! manifest. The results are the same as those of such a stage, bit for bit. [`draw`] generates one
//! surface, [`placed`] places a second one against it, and [`Pressing`] solves the contact, load
//! after load. Nothing is written to disk.
//!
//! ```
//! use asperity_pipeline::direct::{Map, Pressing, draw};
//!
//! let surface = "nodes = 64\nhurst = 0.8\nk_lower = 2\nk_upper = 16\nseed = 1".parse()?;
//! let drawn = draw(&surface, 0)?;
//! assert_eq!(drawn.rms_slope, 1.0);
//! let (slope, is_periodic) = (Some(drawn.rms_slope), drawn.is_periodic);
//! let map = Map { surface: drawn.surface, unit: drawn.unit, rms_slope: slope, is_periodic };
//! let mut pressing = Pressing::new(map, &"loads = [0.01, 0.1]".parse()?)?;
//! while pressing.press(&|| false)? {}
//! let table = pressing.table()?;
//! let nodes = table.integers("contact_nodes")?;
//! assert!(nodes.value(0) < nodes.value(1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod checks;
mod loads;
mod states;

use std::num::NonZeroUsize;
use std::path::Path;

use toml::Table as Keys;

pub use self::checks::KeyErrors;
use self::checks::{Checked, CheckedContact, checked, expected_one, placeholder_surface};
use self::loads::Loads;
use self::states::States;
use crate::study::improbable_contact;
use asperity_mechanics::grid::{Boundary, Grid};
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::descriptors::Descriptors;
use asperity_mechanics::topography::differences;
use asperity_mechanics::topography::surface::{Surface, SurfaceError};
use asperity_stages::columns::RMS_SLOPE;
use asperity_stages::generate::plausibility::{EnteredMap, slope_and_span};
use asperity_stages::measure::friction;
use asperity_stages::surface::Origin;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::{StageError, grids};
use asperity_tables::column::Value;
use asperity_tables::table::{Table, TableError};

/// Error of generating a surface or solving its contact.
#[derive(Debug, thiserror::Error)]
pub enum DirectError {
    #[error(transparent)]
    Keys(#[from] KeyErrors),
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The map is not periodic, but the boundary condition is.
    #[error(
        "the map is not periodic, but the boundary is: press it with `boundary = \"free\"` as an \
         isolated patch, or declare it periodic if its opposite edges match"
    )]
    NotPeriodic,
    #[error(transparent)]
    Stage(#[from] StageError),
}

/// A generated surface with its row in the table of a `generate` stage.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Heights, in the unit of the sides.
    pub surface: Surface,
    /// Rms slope √⟨|∇h|²⟩. For a random surface, it is the slope to which the surface was scaled.
    pub rms_slope: f64,
    /// True if the surface is periodic. Maps from files may not be.
    pub is_periodic: bool,
    /// Name of the unit of heights and sides; empty if the keys name none.
    pub unit: String,
    /// Row that describes the surface in the table of the stage, without the heights.
    pub row: Table,
    /// Warnings of a study with this surface.
    pub warnings: Vec<String>,
}

/// Generates the surface that the keys of a `generate` stage describe, for one realization.
///
/// The heights equal the stored heights of such a stage, bit for bit. Paths of files are relative
/// to the working directory.
///
/// # Errors
/// Returns an error if a key is invalid, if the keys describe several surfaces, or if a file cannot
/// be read.
pub fn draw(keys: &Keys, realization: u32) -> Result<Drawn, DirectError> {
    let (planned, warnings) = checks::surface(keys)?;
    let params = planned.params.realization(realization);
    let surface = params.draw(&SurfaceFiles::new(Path::new("")), &Threads::one())?;
    let row = params.described(&surface);
    let rms_slope = row.reals(RMS_SLOPE.name).map_err(of_table)?.value(0);
    let (unit, is_periodic) = (params.origin.unit().to_owned(), !params.origin.is_open());
    Ok(Drawn { surface, rms_slope, is_periodic, unit, row, warnings })
}

/// Reads a length with a unit, such as `100 um`. Returns it in the unit `unit`, or with its own
/// unit if that is `None`.
///
/// # Errors
/// Returns an error if the text is no length, or if `unit` is no unit of length.
pub fn length(text: &str, unit: Option<&str>) -> Result<(f64, String), KeyErrors> {
    checks::length(text, unit)
}

/// Returns warnings if the heights or the sides of a map were probably read in a wrong unit, as a
/// study with this map would give. Heights that are not finite are missing.
pub fn implausible(grid: Grid, heights: &[f64], unit: &str, has_given_sides: bool) -> Vec<String> {
    let (rms_slope, height_span) = slope_and_span(grid, heights);
    let map = EnteredMap { grid, unit, rms_slope, height_span, has_given_sides };
    map.warnings("the map")
}

/// Returns the map of a second rough surface in the position in which its heights are added to
/// those of the first one.
///
/// `keys` are the keys `shift`, `mirror` and `boundary` of a `solve` stage with `against`.
///
/// # Errors
/// Returns an error if a key is invalid.
pub fn placed(against: Surface, keys: &Keys) -> Result<Surface, DirectError> {
    let mut contact = checks::stage("solve", keys);
    contact.insert("from".to_owned(), "surface".into());
    contact.insert("against".to_owned(), "against".into());
    contact.insert("loads".to_owned(), vec![1.0].into());
    let surface = checks::stage("generate", &placeholder_surface(against.grid(), ""));
    let stages = vec![("surface", surface.clone()), ("against", surface), ("contact", contact)];
    let study = checks::study(stages)?;
    let surfaces = study.stages.iter().flat_map(|stage| stage.work.surfaces());
    let pairs = surfaces.filter_map(|surfaces| match &surfaces.params.origin {
        Origin::Pair(pair) => Some(pair),
        _ => None,
    });
    match pairs.collect::<Vec<_>>()[..] {
        [pair] => Ok(pair.placed(against)),
        ref several => Err(expected_one(several.len(), "shifts").into()),
    }
}

fn of_table(error: TableError) -> DirectError {
    StageError::from(error).into()
}

/// Heights of a surface whose contact is to be solved, with slope and periodicity.
#[derive(Debug, Clone)]
pub struct Map {
    /// Heights, with peaks pointing towards the elastic body.
    pub surface: Surface,
    /// Name of the unit of heights and sides, to which lengths with a unit are converted; empty if
    /// it is unknown.
    pub unit: String,
    /// Rms slope h′ that defines the reduced load p₀/(E* h′), if it is known more exactly than from
    /// the heights. For a random surface, it is the slope of the Fourier modes.
    pub rms_slope: Option<f64>,
    /// True if the map is periodic. If `rms_slope` is `None`, the slope is computed from Fourier
    /// modes for a periodic map, and from differences between nodes for any other map.
    pub is_periodic: bool,
}

/// Contact of one surface, which is solved under one load after the other.
///
/// With adhesion, the loads or mean gaps are the states of a path, in its order. "Load" then stands
/// for a state in the methods. On a path of a material with a hardness, the loads are those of one
/// branch after the other, each in ascending order, as in the table of a stage.
///
/// Pressures are in the unit of the effective modulus, lengths in the unit of the sides. The
/// contact map of every finished load is kept in memory, one bit per node. The pressures are kept
/// too, and with adhesion the gaps, unless [`Pressing::without_fields`] was called.
pub struct Pressing {
    solved: Box<dyn Solved>,
    cores: NonZeroUsize,
    grid: Grid,
    keeps_fields: bool,
    friction: Option<friction::Params>,
    warnings: Vec<String>,
}

/// Finished loads of a contact, and the solver for the next one. The methods are those of
/// [`Pressing`].
trait Solved: Send {
    fn set_threads(&mut self, threads: Threads);
    fn press(
        &mut self,
        keeps_fields: bool,
        interrupted: &dyn Fn() -> bool,
    ) -> Result<bool, StageError>;
    fn count(&self) -> usize;
    fn table(&self) -> Result<Table, StageError>;
    fn contact(&self, load: usize) -> Option<Vec<bool>>;
    fn repulsive(&self, load: usize) -> Option<Vec<bool>>;
    fn pressure(&self, load: usize) -> Option<Vec<f64>>;
    fn displacement(&mut self, load: usize) -> Option<Vec<f64>>;
    fn gap(&mut self, load: usize) -> Option<Vec<f64>>;
}

impl Pressing {
    /// Prepares a surface for the loads that the keys of a `solve` stage describe. The key
    /// `friction` is that of a `measure` stage which reads these loads.
    ///
    /// # Errors
    /// Returns an error if a key is invalid, if the map is not periodic but the boundary is, or if
    /// the hardness of the material is too low for the largest load.
    pub fn new(map: Map, keys: &Keys) -> Result<Pressing, DirectError> {
        Self::new_on(NonZeroUsize::MIN, map, keys)
    }

    /// Prepares a surface as [`Pressing::new`] does, but computes on several cores. The results are
    /// the same, bit for bit. Each method call starts its threads and ends them.
    ///
    /// # Errors
    /// Returns the same errors as [`Pressing::new`].
    pub fn new_on(cores: NonZeroUsize, map: Map, keys: &Keys) -> Result<Pressing, DirectError> {
        let grid = map.surface.grid();
        let rms_slope = map.rms_slope.unwrap_or_else(|| rms_slope(&map));
        let Checked { contact, friction, mut warnings } = checked(keys, grid, &map.unit)?;
        let boundary = match &contact {
            CheckedContact::Path(params) => params.boundary,
            CheckedContact::Branches(branches) => branches[0].boundary,
        };
        if boundary == Boundary::Periodic && !map.is_periodic {
            return Err(DirectError::NotPeriodic);
        }
        let mut row = grids::coordinates(grid.nodes(), grid.cell().size());
        row.push((RMS_SLOPE, Value::Real(rms_slope)));
        let row = Table::row(&row);
        let threads = Threads::for_mesh(cores, grid.count());
        let mut solved: Box<dyn Solved> = match contact {
            CheckedContact::Path(params) => {
                Box::new(States::new(&params, map.surface, row, threads)?)
            }
            CheckedContact::Branches(branches) => {
                let loads = Loads::new(&branches, map.surface, row, threads)?;
                let full = loads.full_contact_load();
                warnings.extend(improbable_contact(&branches[0], rms_slope, full));
                Box::new(loads)
            }
        };
        solved.set_threads(Threads::one());
        Ok(Pressing { solved, cores, grid, keeps_fields: true, friction, warnings })
    }

    /// Disables keeping the pressures of finished loads; their contact maps are still kept.
    pub fn without_fields(self) -> Pressing {
        Pressing { keeps_fields: false, ..self }
    }

    /// Returns the warnings of a study with this contact: about units and the order of loads, the
    /// mesh of a contact with adhesion, and partial slip.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Solves the contact under the next load. Returns false if there is no further load.
    ///
    /// # Errors
    /// Returns an error if `interrupted` returned true. The call can then be repeated.
    pub fn press(&mut self, interrupted: &dyn Fn() -> bool) -> Result<bool, StageError> {
        let keeps_fields = self.keeps_fields;
        self.on_threads(|solved| solved.press(keeps_fields, interrupted))
    }

    /// Returns the number of finished loads.
    pub fn count(&self) -> usize {
        self.solved.count()
    }

    /// Returns the mesh of the surface.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Returns a table with a row for each finished load: the table of a `solve` stage without the
    /// parameter columns of the surface.
    ///
    /// # Errors
    /// Returns an error if the rows do not form a table, which is a bug.
    pub fn table(&self) -> Result<Table, StageError> {
        self.solved.table()
    }

    /// Returns a table of the partial slip under tangential loads: the table of a `measure` stage
    /// without the parameter columns of the surface. Returns `None` without the key `friction`.
    ///
    /// # Errors
    /// Returns an error if the rows do not form a table, which is a bug.
    pub fn partial_slip(&self) -> Result<Option<Table>, StageError> {
        let measured = |friction: &friction::Params| friction.measure(&self.table()?);
        self.friction.as_ref().map(measured).transpose()
    }

    /// Returns the contact map under the load with index `load`, row-major: true for nodes in
    /// contact, whose gap is zero. Returns `None` if the load is not finished.
    pub fn contact(&self, load: usize) -> Option<Vec<bool>> {
        self.solved.contact(load)
    }

    /// Returns the map of the nodes with positive pressure under the load with index `load`,
    /// row-major. It differs from the contact map only with adhesion. Returns `None` if the load is
    /// not finished.
    pub fn repulsive(&self, load: usize) -> Option<Vec<bool>> {
        self.solved.repulsive(load)
    }

    /// Returns the pressures under the load with index `load`, row-major. With adhesion, they are
    /// negative where the surfaces attract each other. Returns `None` if the load is not finished
    /// or its pressures were not kept.
    pub fn pressure(&self, load: usize) -> Option<Vec<f64>> {
        self.solved.pressure(load)
    }

    /// Returns the displacements of the elastic body under the load with index `load`, positive
    /// into the body, row-major. Their mean is zero if the boundary is periodic.
    ///
    /// Returns `None` if the load is not finished or its pressures were not kept.
    pub fn displacement(&mut self, load: usize) -> Option<Vec<f64>> {
        self.on_threads(|solved| solved.displacement(load))
    }

    /// Returns the gaps under the load with index `load`, row-major, as defined by
    /// [`Solver::gap_under`](asperity_mechanics::solver::Solver::gap_under). Surfaces with adhesion
    /// that are pulled off have infinite gaps.
    ///
    /// Returns `None` if the load is not finished or its pressures were not kept.
    pub fn gap(&mut self, load: usize) -> Option<Vec<f64>> {
        self.on_threads(|solved| solved.gap(load))
    }

    /// Runs `work` on all cores. The threads end before the method returns, so that the process can
    /// be forked between calls.
    fn on_threads<T>(&mut self, work: impl FnOnce(&mut dyn Solved) -> T) -> T {
        self.solved.set_threads(Threads::for_mesh(self.cores, self.grid.count()));
        let done = work(self.solved.as_mut());
        self.solved.set_threads(Threads::one());
        done
    }
}

/// Reads a map of `nodes` bits, row-major, the lowest bit of a byte first.
fn bits(bytes: &[u8], nodes: usize) -> Vec<bool> {
    (0..nodes).map(|node| bytes[node / 8] >> (node % 8) & 1 == 1).collect()
}

/// Returns the rms slope of a map, computed as a `generate` stage does, so that loads are equal to
/// the last bit.
fn rms_slope(map: &Map) -> f64 {
    if map.is_periodic {
        Descriptors::from_surface(&map.surface).rms_slope
    } else {
        differences::moments(&map.surface).rms_slope()
    }
}

#[cfg(test)]
mod tests {

    use super::*;

    fn wave() -> Map {
        let keys = "method = \"wave\"\nnodes = 64\nside = 2.0\namplitude = 0.01".parse();
        Map {
            surface: draw(&keys.unwrap(), 0).unwrap().surface,
            unit: String::new(),
            rms_slope: None,
            is_periodic: true,
        }
    }

    fn pressed(keys: &str) -> Pressing {
        let mut pressing = Pressing::new(wave(), &keys.parse().unwrap()).unwrap();
        while pressing.press(&|| false).unwrap() {}
        pressing
    }

    #[test]
    fn pressures_have_the_mean_that_was_asked_for() {
        let keys = "effective_modulus = 3.0\nload_unit = \"absolute\"\nloads = [0.001, 0.01]";
        let pressing = pressed(keys);
        for (load, asked) in [0.001, 0.01].into_iter().enumerate() {
            let pressure = pressing.pressure(load).unwrap();
            let mean = pressure.iter().sum::<f64>() / pressure.len() as f64;
            assert!((mean / asked - 1.0).abs() < 1e-10, "{mean}");
            let contact = pressing.contact(load).unwrap();
            assert!(contact.iter().zip(&pressure).all(|(c, p)| *c == (*p > 0.0)));
        }
        assert!(pressing.pressure(2).is_none());
    }

    #[test]
    fn a_wave_is_flattened_by_its_closed_form() {
        // Westergaard: under p* = π E* Δ/λ the contact is full, so displacement equals height.
        let pressure = 2.0 * std::f64::consts::PI * 0.01 / 2.0 * 3.0;
        let keys =
            format!("effective_modulus = 3.0\nload_unit = \"absolute\"\nloads = [{pressure}]");
        let mut pressing = pressed(&keys);
        assert!(pressing.contact(0).unwrap().into_iter().all(|touches| touches));
        let displacement = pressing.displacement(0).unwrap();
        let heights = wave().surface.into_heights();
        let differ = displacement.iter().zip(&heights).map(|(u, h)| (u - h).abs());
        assert!(differ.fold(0.0, f64::max) < 1e-14);
        assert!(pressing.gap(0).unwrap().into_iter().all(|gap| gap == 0.0));
    }

    /// Keys of a path with adhesion on the wave, from apart into contact and back.
    const PATH: &str = "effective_modulus = 3.0\nadhesion = { work = 3e-4, range = 0.005 }\n\
                        control = \"gap\"\ngaps = [0.02, 0.01, 0.005, 0.01]\ntolerance = 1e-10";

    #[test]
    #[expect(clippy::disallowed_methods, reason = "exp need not be the same everywhere")]
    fn maps_of_a_path_fulfil_the_laws_of_wall_and_attraction() {
        let mut pressing = pressed(PATH);
        assert!(pressing.warnings().is_empty());
        let table = pressing.table().unwrap();
        let heights = wave().surface.into_heights();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        for (state, asked) in [0.02, 0.01, 0.005, 0.01].into_iter().enumerate() {
            let (gap, pressure) = (pressing.gap(state).unwrap(), pressing.pressure(state).unwrap());
            assert!((mean(&gap) / asked - 1.0).abs() < 1e-12);
            assert!((mean(&pressure) - table.reals("pressure").unwrap().value(state)).abs() < 1e-9);
            let contact = pressing.contact(state).unwrap();
            let repulsive = pressing.repulsive(state).unwrap();
            for node in 0..gap.len() {
                let attraction = 3e-4 / 0.005 * (-gap[node] / 0.005).exp();
                assert_eq!(contact[node], gap[node] == 0.0);
                assert_eq!(repulsive[node], pressure[node] > 0.0);
                let is_wall = contact[node] && pressure[node] > -attraction - 1e-9;
                assert!(is_wall || (pressure[node] + attraction).abs() < 1e-9);
            }
            // The gap is displacement − height − offset.
            let displacement = pressing.displacement(state).unwrap();
            assert!(mean(&displacement).abs() < 1e-15);
            let offset = |node: usize| displacement[node] - heights[node] - gap[node];
            assert!((0..gap.len()).all(|node| (offset(node) - offset(0)).abs() < 1e-14));
        }
        let nodes = table.integers("repulsive_nodes").unwrap();
        assert!(nodes.value(0) == 0 && nodes.value(2) > 0);
    }

    #[test]
    fn an_interrupted_state_of_a_path_is_solved_again_from_the_state_before() {
        let whole = pressed(PATH).table().unwrap();
        let mut pressing = Pressing::new(wave(), &PATH.parse().unwrap()).unwrap();
        for iterations in [0, 3, 5] {
            let calls = std::cell::Cell::new(0);
            let interrupted = || calls.replace(calls.get() + 1) >= iterations;
            while pressing.press(&interrupted).is_ok_and(|pressed| pressed) {}
        }
        while pressing.press(&|| false).unwrap() {}
        assert_eq!(pressing.table().unwrap(), whole);
    }

    #[test]
    fn a_map_that_is_not_periodic_is_not_pressed_as_one_that_is() {
        let map = Map { is_periodic: false, ..wave() };
        let keys = "loads = [0.1]".parse().unwrap();
        assert!(matches!(Pressing::new(map.clone(), &keys), Err(DirectError::NotPeriodic)));
        let keys = "loads = [0.1]\nboundary = \"free\"".parse().unwrap();
        assert!(Pressing::new(map, &keys).is_ok());
    }

    #[test]
    fn the_second_surface_is_mirrored_and_shifted_by_whole_nodes() {
        let keys = "method = \"wave-sum\"\nnodes = 8\namplitude = 0.1".parse().unwrap();
        let wave = draw(&keys, 0).unwrap().surface;
        let heights = wave.heights().iter().enumerate();
        // The heights differ at all nodes.
        let heights = heights.map(|(node, height)| height + node as f64);
        let surface = Surface::new(wave.grid(), heights.collect()).unwrap();
        let placed =
            placed(surface.clone(), &"shift = [0.25, 0]\nmirror = \"y\"".parse().unwrap()).unwrap();
        for (node, height) in placed.heights().iter().enumerate() {
            let source = (node + 64 - 16) % 64 / 8 * 8 + (7 - node % 8);
            assert!((height - surface.heights()[source]).abs() < 1e-12);
        }
        let message =
            super::placed(surface, &"shift = [2, 0]".parse().unwrap()).unwrap_err().to_string();
        assert!(message.contains("`shift`"), "{message}");
    }
}
