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
//! let map = Map { surface: drawn.surface, rms_slope: slope, is_periodic };
//! let mut pressing = Pressing::new(map, &"loads = [0.01, 0.1]".parse()?)?;
//! while pressing.press(&|| false)? {}
//! let table = pressing.table()?;
//! let nodes = table.integers("contact_nodes")?;
//! assert!(nodes.value(0) < nodes.value(1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod loads;
mod states;

use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;

use toml::Table as Keys;

use self::loads::Loads;
use self::states::States;
use crate::study::{Study, Work};
use asperity_contact::grid::{Boundary, Grid};
use asperity_contact::threads::Threads;
use asperity_contact::topography::differences;
use asperity_contact::topography::moments::Moments;
use asperity_contact::topography::surface::{Surface, SurfaceError};
use asperity_manifest::diagnostics::ManifestErrors;
use asperity_stages::columns::RMS_SLOPE;
use asperity_stages::generate::Origin;
use asperity_stages::generate::growth::PlannedSurfaces;
use asperity_stages::measure::{self, friction};
use asperity_stages::solve::{self, ListedLoads};
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::{Recipe, StageError, grids};
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
    /// Row that describes the surface in the table of the stage, without the heights.
    pub row: Table,
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
    let params = surface(keys)?.params.realization(realization);
    let surface = params.draw(&SurfaceFiles::new(Path::new("")), &Threads::one())?;
    let row = params.described(&surface);
    let rms_slope = row.reals(RMS_SLOPE.name).map_err(of_table)?.value(0);
    Ok(Drawn { surface, rms_slope, is_periodic: !params.origin.is_open(), row })
}

/// Returns the map of a second rough surface in the position in which its heights are added to
/// those of the first one.
///
/// `keys` are the keys `shift`, `mirror` and `boundary` of a `solve` stage with `against`.
///
/// # Errors
/// Returns an error if a key is invalid.
pub fn placed(against: Surface, keys: &Keys) -> Result<Surface, DirectError> {
    let mut contact = stage("solve", keys);
    contact.insert("from".to_owned(), "surface".into());
    contact.insert("against".to_owned(), "against".into());
    contact.insert("loads".to_owned(), vec![1.0].into());
    let surface = stage("generate", &placeholder_surface(against.grid()));
    let stages = vec![("surface", surface.clone()), ("against", surface), ("contact", contact)];
    let study = study(stages)?;
    let pairs = study.stages.iter().filter_map(|stage| match &stage.work {
        Work::Generate(surfaces) => Some(surfaces),
        Work::Evaluate(_) => None,
    });
    let pairs = pairs.flatten().filter_map(|surfaces| match &surfaces.params.origin {
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
        let Checked { contact, friction, warnings } = checked(keys, grid)?;
        let boundary = match &contact {
            CheckedContact::Path(params) => params.boundary,
            CheckedContact::Branches(branches) => branches[0].boundary,
        };
        if boundary == Boundary::Periodic && !map.is_periodic {
            return Err(DirectError::NotPeriodic);
        }
        let rms_slope = map.rms_slope.unwrap_or_else(|| rms_slope(&map));
        let mut row = grids::coordinates(grid.nodes(), grid.cell().size());
        row.push((RMS_SLOPE, Value::Real(rms_slope)));
        let row = Table::row(&row);
        let threads = Threads::for_mesh(cores, grid.count());
        let mut solved: Box<dyn Solved> = match contact {
            CheckedContact::Path(params) => {
                Box::new(States::new(&params, map.surface, row, threads)?)
            }
            CheckedContact::Branches(branches) => {
                Box::new(Loads::new(branches, map.surface, row, threads)?)
            }
        };
        solved.set_threads(Threads::one());
        Ok(Pressing { solved, cores, grid, keeps_fields: true, friction, warnings })
    }

    /// Disables keeping the pressures of finished loads; their contact maps are still kept.
    pub fn without_fields(self) -> Pressing {
        Pressing { keeps_fields: false, ..self }
    }

    /// Returns warnings about the mesh of a contact with adhesion.
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
    /// [`Solver::gap_under`](asperity_contact::solver::Solver::gap_under). Surfaces with adhesion
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

fn rms_slope(map: &Map) -> f64 {
    let moments = if map.is_periodic {
        Moments::from_surface(&map.surface)
    } else {
        differences::moments(&map.surface)
    };
    moments.rms_slope()
}

/// Problems with the keys of a stage, each with what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.join("\n"))]
pub struct KeyErrors(Vec<String>);

impl From<ManifestErrors> for KeyErrors {
    fn from(errors: ManifestErrors) -> KeyErrors {
        KeyErrors(errors.problems().iter().map(ToString::to_string).collect())
    }
}

/// Returns the parameters of the single surface that these keys of a `generate` stage describe.
fn surface(keys: &Keys) -> Result<PlannedSurfaces, KeyErrors> {
    let study = study(vec![("surface", stage("generate", keys))])?;
    match &study.stages[0].work {
        Work::Generate(surfaces) => match surfaces.as_slice() {
            [one] => Ok(one.clone()),
            several => Err(expected_one(several.len(), "surfaces")),
        },
        Work::Evaluate(_) => unreachable!("a `generate` stage makes surfaces"),
    }
}

/// Checked keys of a `solve` stage, and of a `measure` stage with `friction` that reads it.
#[derive(Debug)]
struct Checked {
    contact: CheckedContact,
    friction: Option<friction::Params>,
    warnings: Vec<String>,
}

/// Checked parameters of a contact.
#[derive(Debug)]
enum CheckedContact {
    /// Parameters of the branches of a path of loads; a single one without a path.
    Branches(Vec<Arc<solve::Params>>),
    /// Parameters of a path with adhesion.
    Path(Arc<solve::adhesion::Params>),
}

/// Checks the keys of a `solve` stage for a surface on this grid.
fn checked(keys: &Keys, grid: Grid) -> Result<Checked, KeyErrors> {
    let mut contact = stage("solve", keys);
    contact.insert("from".to_owned(), "surface".into());
    let slip = contact.remove("friction").map(|friction| {
        let keys = [("from", "contact".into()), ("friction", friction)];
        stage("measure", &keys.map(|(key, value)| (key.to_owned(), value)).into_iter().collect())
    });
    let surface = stage("generate", &placeholder_surface(grid));
    let stages = [("surface", surface), ("contact", contact)];
    let study = study(stages.into_iter().chain(slip.map(|slip| ("slip", slip))).collect())?;
    let recipes = study.stages[1].work.recipes();
    let contact = match recipes {
        // `Pressing` solves for pressures of nodes and knows no asperity models.
        [Recipe::Solve(params), ..] if params.asperities.is_some() => {
            return Err(KeyErrors(vec![only_in_manifests("method = \"asperities\"")]));
        }
        [Recipe::Solve(params), ..] if params.flow => {
            return Err(KeyErrors(vec![only_in_manifests("flow = true")]));
        }
        [Recipe::Adhesion(params)] => CheckedContact::Path(params.clone()),
        _ => match branches(recipes) {
            Some(branches) => CheckedContact::Branches(branches),
            None => return Err(expected_one(recipes.len(), "parameter points")),
        },
    };
    let friction = match study.stages.get(2).map(|slip| slip.work.recipes()) {
        None => None,
        Some([Recipe::Measure(measure::Params::Friction(friction))]) => Some(friction.clone()),
        Some(several) => return Err(expected_one(several.len(), "values of `friction`")),
    };
    let warnings = study.coarse_for_adhesion(&study.stages[1]).into_iter().collect();
    Ok(Checked { contact, friction, warnings })
}

/// Returns the branches of a path, or the only contact. Returns `None` if the recipes are several
/// parameter points.
fn branches(recipes: &[Recipe]) -> Option<Vec<Arc<solve::Params>>> {
    let branches = recipes.iter().map(|recipe| match recipe {
        Recipe::Solve(params) => Some(params.clone()),
        _ => None,
    });
    let branches = branches.collect::<Option<Vec<_>>>()?;
    let of_point = |branch: &solve::Params| {
        let (loads, listed) = (Vec::new(), ListedLoads::default());
        solve::Params { branch: None, loads, listed, ..branch.clone() }
    };
    let first = branches.first()?;
    let is_path = first.branch.is_some();
    let are_one = branches.iter().all(|branch| of_point(branch) == of_point(first));
    (branches.len() == 1 || is_path && are_one).then_some(branches)
}

/// Returns the keys of a surface with the spacing of `grid`, which the check of a `solve` stage
/// requires. The rms slope of this surface is unknown until the surface is generated. The mesh of
/// an adhesive contact is therefore checked, but no check depends on the heights.
fn placeholder_surface(grid: Grid) -> Keys {
    const NODES: u8 = 16;
    let [along_x, along_y] = grid.spacing();
    let keys = [
        ("method", toml::Value::from("wave")),
        ("nodes", NODES.into()),
        ("side", (f64::from(NODES) * along_x.max(along_y)).into()),
        ("amplitude", 1.0.into()),
    ];
    keys.map(|(key, value)| (key.to_owned(), value)).into_iter().collect()
}

/// Returns the keys of a stage with its kind added.
fn stage(kind: &str, keys: &Keys) -> Keys {
    let mut table = keys.clone();
    table.insert("kind".to_owned(), kind.into());
    table
}

fn study(stages: Vec<(&str, Keys)>) -> Result<Study, KeyErrors> {
    let named = stages.into_iter();
    let named = named.map(|(name, table)| (name.to_owned(), toml::Value::from(table)));
    let name = Keys::from_iter([("name".to_owned(), toml::Value::from("direct"))]);
    let manifest = Keys::from_iter([
        ("study".to_owned(), toml::Value::from(name)),
        ("stage".to_owned(), toml::Value::from(Keys::from_iter(named))),
    ]);
    let text = toml::to_string(&manifest).expect("a table of TOML can be written");
    Ok(Study::parse(&text, "keys", Path::new(""), crate::study::no_claims)?)
}

fn only_in_manifests(key: &str) -> String {
    format!("`{key}` is available only in a stage of a manifest; write a manifest and run it")
}

fn expected_one(found: usize, what: &str) -> KeyErrors {
    KeyErrors(vec![format!(
        "the keys describe {found} {what}, but exactly one is expected; only manifests sweep lists"
    )])
}

#[cfg(test)]
mod tests {

    use super::*;

    fn wave() -> Map {
        let keys = "method = \"wave\"\nnodes = 64\nside = 2.0\namplitude = 0.01".parse();
        Map {
            surface: draw(&keys.unwrap(), 0).unwrap().surface,
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
        let mut pressing = Pressing::new(wave(), &table(PATH)).unwrap();
        for iterations in [0, 3, 5] {
            let calls = std::cell::Cell::new(0);
            let interrupted = || calls.replace(calls.get() + 1) >= iterations;
            while pressing.press(&interrupted).is_ok_and(|pressed| pressed) {}
        }
        while pressing.press(&|| false).unwrap() {}
        assert_eq!(pressing.table().unwrap(), whole);
    }

    #[test]
    fn the_mesh_of_the_surface_and_not_another_is_checked_for_adhesion() {
        let rho =
            |range: f64| format!("adhesion = {{ work = 3e-4, range = {range} }}\nloads = [0.1]");
        // Δx w/(E* ρ²) = 1/32 · 3e-4/ρ².
        assert!(checked(&rho(0.006)).unwrap().warnings.is_empty());
        let warnings = checked(&rho(0.005)).unwrap().warnings;
        assert!(warnings[0].contains("Δx w/(E* ρ²) = 0.37"), "{warnings:?}");
        let message = checked(&rho(0.002)).unwrap_err().to_string();
        assert!(message.contains("too coarse for the adhesion"), "{message}");
    }

    #[test]
    fn a_map_that_is_not_periodic_is_not_pressed_as_one_that_is() {
        let map = Map { is_periodic: false, ..wave() };
        let keys = "loads = [0.1]".parse().unwrap();
        assert!(matches!(Pressing::new(map.clone(), &keys), Err(DirectError::NotPeriodic)));
        let keys = "loads = [0.1]\nboundary = \"free\"".parse().unwrap();
        assert!(Pressing::new(map, &keys).is_ok());
    }

    fn table(text: &str) -> Keys {
        text.parse().unwrap()
    }

    /// Checks the keys of a `solve` stage for the wave of the other tests.
    fn checked(text: &str) -> Result<Checked, KeyErrors> {
        super::checked(&table(text), wave().surface.grid())
    }

    #[test]
    fn what_is_wrong_with_keys_is_told_as_in_a_manifest() {
        let keys = table("nodes = 64\nhurst = 1.7\nk_lower = 2\nk_upper = 16");
        let message = surface(&keys).unwrap_err().to_string();
        assert!(message.contains("`hurst`") && message.contains("1.7"), "{message}");
        let message = checked("loads = [0.1, -0.2]").unwrap_err().to_string();
        assert!(message.contains("`loads`") && message.contains("-0.2"), "{message}");
    }

    #[test]
    fn several_points_are_not_one() {
        let keys = table("nodes = 64\nhurst = [0.7, 0.8]\nk_lower = 2\nk_upper = 16");
        let message = surface(&keys).unwrap_err().to_string();
        assert!(message.contains("2 surfaces"), "{message}");
    }

    #[test]
    fn asperities_are_not_pressed_as_if_every_node_were_solved() {
        let keys = "loads = [0.1]\nmethod = \"asperities\"";
        let message = checked(keys).unwrap_err().to_string();
        assert!(message.contains("`method = \"asperities\"`"), "{message}");
    }

    #[test]
    fn a_hardness_in_either_unit_is_held_against_no_slope() {
        let checked = checked("loads = [0.1]\nhardness = 1e-9").unwrap();
        let CheckedContact::Branches(branches) = &checked.contact else { panic!("loads") };
        assert!(branches.len() == 1 && branches[0].hardness.is_some());
    }

    #[test]
    fn branches_of_a_path_are_one_contact_and_swept_values_are_several() {
        let keys = "loads = [0.1, 0.2, 0.1]\nhardness = 0.5\npath = \"as-given\"";
        let CheckedContact::Branches(branches) = checked(keys).unwrap().contact else {
            panic!("loads")
        };
        assert_eq!(branches.len(), 2);
        for keys in [&keys.replace("0.5", "[0.5, 0.6]"), "loads = [0.1]\nhardness = [0.5, 0.6]"] {
            let message = checked(keys).unwrap_err().to_string();
            assert!(message.contains("parameter points"), "{message}");
        }
    }

    #[test]
    fn the_second_surface_is_mirrored_and_shifted_by_whole_nodes() {
        let keys = "method = \"wave-sum\"\nnodes = 8\namplitude = 0.1".parse().unwrap();
        let wave = draw(&keys, 0).unwrap().surface;
        let heights = wave.heights().iter().enumerate();
        // The heights differ at all nodes.
        let heights = heights.map(|(node, height)| height + node as f64);
        let surface = Surface::new(wave.grid(), heights.collect()).unwrap();
        let placed = placed(surface.clone(), &table("shift = [0.25, 0]\nmirror = \"y\"")).unwrap();
        for (node, height) in placed.heights().iter().enumerate() {
            let source = (node + 64 - 16) % 64 / 8 * 8 + (7 - node % 8);
            assert!((height - surface.heights()[source]).abs() < 1e-12);
        }
        let message = super::placed(surface, &table("shift = [2, 0]")).unwrap_err().to_string();
        assert!(message.contains("`shift`"), "{message}");
    }
}
