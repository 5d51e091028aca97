//! Surfaces and contacts without a study: what `generate` and `solve` stages compute, of values in
//! memory and into memory, with the same bytes.
//!
//! What is asked for are the keys of such a stage, as a manifest has them, and they are checked as
//! those of a manifest are: [`draw`] makes one surface, a [`Pressing`] presses one, load after load.
//! Nothing is stored.
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
//! while pressing.press(&|| false)?.is_some() {}
//! let table = pressing.table();
//! let nodes = table.integers("contact_nodes")?;
//! assert!(nodes.value(0) < nodes.value(1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::num::NonZeroUsize;
use std::path::Path;

use toml::Table as Keys;

use crate::study::{Study, Work};
use asperity_contact::grid::{Boundary, Grid};
use asperity_contact::solver::Outcome;
use asperity_contact::threads::Threads;
use asperity_contact::topography::differences;
use asperity_contact::topography::moments::Moments;
use asperity_contact::topography::surface::{Surface, SurfaceError};
use asperity_manifest::diagnostics::ManifestErrors;
use asperity_stages::columns::RMS_SLOPE;
use asperity_stages::generate::growth::PlannedSurfaces;
use asperity_stages::solve::block::Block;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::{Recipe, StageError, grids, solve};
use asperity_tables::column::Value;
use asperity_tables::table::{Table, TableError};

/// Why there is no surface, or no contact.
#[derive(Debug, thiserror::Error)]
pub enum DirectError {
    /// The keys make no sense.
    #[error(transparent)]
    Keys(#[from] KeyErrors),
    /// Heights are no surface.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// A map that is not periodic was to be pressed as if it repeated itself.
    #[error(
        "the map is not periodic, and would be pressed as if it repeated itself: `boundary = \
         \"free\"` presses it as it is, with nothing beyond its edges; a map whose opposite edges \
         meet has to be said to be periodic"
    )]
    Open,
    /// The stage failed.
    #[error(transparent)]
    Stage(#[from] StageError),
}

/// A surface, and what a `generate` stage says of it.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Its heights, in the unit of its sides.
    pub surface: Surface,
    /// √⟨|∇h|²⟩, as the stage takes it: of a random surface the slope that it was scaled to.
    pub rms_slope: f64,
    /// Whether it repeats itself: a map of a file may not.
    pub is_periodic: bool,
    /// The row of its stage, but for the heights.
    pub row: Table,
}

/// Draws the surface that the keys of a `generate` stage describe, with a number of its realization:
/// the heights that such a stage stores, to the last bit. Paths are relative to the working directory.
///
/// # Errors
/// When a key makes no sense, several surfaces are described, or a file cannot be read.
pub fn draw(keys: &Keys, realization: u32) -> Result<Drawn, DirectError> {
    let params = surface(keys)?.params.realization(realization);
    let surface = params.draw(&SurfaceFiles::new(Path::new("")), &Threads::one())?;
    let row = params.described(&surface);
    let rms_slope = row.reals(RMS_SLOPE.name).map_err(of_table)?.value(0);
    Ok(Drawn { surface, rms_slope, is_periodic: !params.origin.is_open(), row })
}

fn of_table(error: TableError) -> DirectError {
    StageError::from(error).into()
}

/// Heights that are to be pressed, and what is known of them.
#[derive(Debug, Clone)]
pub struct Map {
    /// The heights, peaks towards the elastic body.
    pub surface: Surface,
    /// The slope by which loads are reduced, where it is known better than from these nodes: of a
    /// random surface that of its modes.
    pub rms_slope: Option<f64>,
    /// Whether the map repeats itself: then its slope is that of its Fourier modes, and otherwise that
    /// of differences between nodes.
    pub is_periodic: bool,
}

/// One surface under a block of loads, as far as it has been pressed.
///
/// Pressures are in the unit of the effective modulus, lengths in that of the sides. The contact
/// under every load stays at hand, one bit a node, and its pressures where they are kept.
pub struct Pressing {
    block: Block,
    row: Table,
    keeps_fields: bool,
    /// Pressures of the nodes in contact under each load, in units of E* × rms slope.
    pressures: Vec<Vec<f64>>,
    cores: NonZeroUsize,
}

impl Pressing {
    /// Prepares a surface for the loads that the keys of a `solve` stage describe.
    ///
    /// # Errors
    /// When a key makes no sense, a map that is not periodic would be pressed as one that is, or the
    /// material does not bear the heaviest load.
    pub fn new(map: Map, keys: &Keys) -> Result<Pressing, DirectError> {
        Self::new_on(NonZeroUsize::MIN, map, keys)
    }

    /// Like [`Pressing::new`], on several cores: results are the same, to the bit. Threads are
    /// started for a call and end with it.
    ///
    /// # Errors
    /// As [`Pressing::new`].
    pub fn new_on(cores: NonZeroUsize, map: Map, keys: &Keys) -> Result<Pressing, DirectError> {
        let params = block(keys)?;
        if params.boundary == Boundary::Periodic && !map.is_periodic {
            return Err(DirectError::Open);
        }
        let grid = map.surface.grid();
        let rms_slope = map.rms_slope.unwrap_or_else(|| rms_slope(&map));
        let mut row = grids::coordinates(grid.nodes(), grid.cell().size());
        row.push((RMS_SLOPE, Value::Real(rms_slope)));
        let threads = Threads::for_mesh(cores, grid.count());
        let mut block = Block::new(&params, map.surface, rms_slope, None, threads)?;
        block.work_on(Threads::one());
        Ok(Pressing {
            block,
            cores,
            row: Table::row(&row),
            keeps_fields: true,
            pressures: Vec::new(),
        })
    }

    /// Keeps contact maps of loads alone, and no pressures.
    pub fn without_fields(self) -> Pressing {
        Pressing { keeps_fields: false, ..self }
    }

    /// Presses by the next load; `None` when there is none, or every node touches under the last one
    /// and all that follow would tell nothing new.
    ///
    /// # Errors
    /// When it was interrupted; the load may be asked for again.
    pub fn press(&mut self, interrupted: &dyn Fn() -> bool) -> Result<Option<Outcome>, StageError> {
        let outcome = self.on_threads(|block| block.press(&interrupted))?;
        if outcome.is_some() && self.keeps_fields {
            let pressure = self.block.solver().pressure().iter().copied();
            self.pressures.push(pressure.filter(|p| *p > 0.0).collect());
        }
        Ok(outcome)
    }

    /// How many loads are done.
    pub fn count(&self) -> usize {
        self.block.count()
    }

    /// Where the nodes lie.
    pub fn grid(&self) -> Grid {
        self.block.grid()
    }

    /// A row for each load that is done, as the table of a `solve` stage has it, but for what its
    /// surface is called.
    pub fn table(&mut self) -> Table {
        self.block.table(&self.row)
    }

    /// Which nodes are in contact under a load, by its number from 0 on; row-major. `None` if it is
    /// not done.
    pub fn contact(&self, load: usize) -> Option<Vec<bool>> {
        let bytes = self.block.contact(load)?;
        let is_set = |node: usize| bytes[node / 8] >> (node % 8) & 1 == 1;
        Some((0..self.grid().count()).map(is_set).collect())
    }

    /// The pressure under a load; row-major. `None` if it is not done, or was not kept.
    pub fn pressure(&self, load: usize) -> Option<Vec<f64>> {
        let unit = self.block.scales().pressure();
        let mut pressure = self.reduced_pressure(load)?;
        pressure.iter_mut().for_each(|p| *p *= unit);
        Some(pressure)
    }

    /// The displacement of the elastic body under a load, positive into it; row-major. Its mean is zero
    /// where the boundary is periodic. `None` as of [`Pressing::pressure`].
    pub fn displacement(&mut self, load: usize) -> Option<Vec<f64>> {
        let pressure = self.reduced_pressure(load)?;
        let displacement = self.on_threads(|block| block.solver().displacement_under(&pressure));
        Some(self.in_length(displacement))
    }

    /// The gap under a load, see
    /// [`Solver::gap_under`](asperity_contact::solver::Solver::gap_under); row-major. `None` as of
    /// [`Pressing::pressure`].
    pub fn gap(&mut self, load: usize) -> Option<Vec<f64>> {
        let pressure = self.reduced_pressure(load)?;
        let gap = self.on_threads(|block| block.solver().gap_under(&pressure));
        Some(self.in_length(gap))
    }

    /// Runs work on all cores. No thread is left between two calls, so that a process may be forked
    /// there.
    fn on_threads<T>(&mut self, work: impl FnOnce(&mut Block) -> T) -> T {
        let nodes = self.grid().count();
        self.block.work_on(Threads::for_mesh(self.cores, nodes));
        let done = work(&mut self.block);
        self.block.work_on(Threads::one());
        done
    }

    /// In units of E* × rms slope.
    fn reduced_pressure(&self, load: usize) -> Option<Vec<f64>> {
        let mut kept = self.pressures.get(load)?.iter();
        let contact = self.contact(load)?.into_iter();
        let pressure = contact.map(|touches| {
            if touches { *kept.next().expect("every node in contact has one") } else { 0.0 }
        });
        Some(pressure.collect())
    }

    fn in_length(&self, mut reduced: Vec<f64>) -> Vec<f64> {
        let unit = self.block.scales().length();
        reduced.iter_mut().for_each(|value| *value *= unit);
        reduced
    }
}

fn rms_slope(map: &Map) -> f64 {
    let moments = if map.is_periodic {
        Moments::of(&map.surface)
    } else {
        differences::moments(&map.surface)
    };
    moments.rms_slope()
}

/// What is wrong with keys, each with what would do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.join("\n"))]
pub struct KeyErrors(Vec<String>);

impl From<ManifestErrors> for KeyErrors {
    fn from(errors: ManifestErrors) -> KeyErrors {
        KeyErrors(errors.problems().iter().map(ToString::to_string).collect())
    }
}

/// The surface that these keys of a `generate` stage describe.
fn surface(keys: &Keys) -> Result<PlannedSurfaces, KeyErrors> {
    let study = study([("surface", stage("generate", keys))])?;
    match &study.stages[0].work {
        Work::Generate(surfaces) => match surfaces.as_slice() {
            [one] => Ok(one.clone()),
            several => Err(not_one(several.len(), "surfaces")),
        },
        Work::Evaluate(_) => unreachable!("a `generate` stage makes surfaces"),
    }
}

/// The block of loads that these keys of a `solve` stage describe, on any surface.
fn block(keys: &Keys) -> Result<solve::Params, KeyErrors> {
    let mut contact = stage("solve", keys);
    contact.insert("from".to_owned(), "surface".into());
    let study = study([("surface", stage("generate", &anything())), ("contact", contact)])?;
    match study.stages[1].work.recipes() {
        // Its rows would be those of another method than the keys ask for.
        [Recipe::Solve(block)] if block.asperities.is_some() => {
            Err(KeyErrors(vec!["`method = \"asperities\"` is for stages of a manifest".to_owned()]))
        }
        [Recipe::Solve(block)] if block.flow => {
            Err(KeyErrors(vec!["`flow = true` is for stages of a manifest".to_owned()]))
        }
        [Recipe::Solve(block)] => Ok(block.as_ref().clone()),
        several => Err(not_one(several.len(), "blocks of loads")),
    }
}

/// A surface on which no check of loads depends: one whose slope is not known beforehand.
fn anything() -> Keys {
    let keys =
        [("method", toml::Value::from("wave")), ("nodes", 16.into()), ("amplitude", 1.0.into())];
    keys.map(|(key, value)| (key.to_owned(), value)).into_iter().collect()
}

/// The table of a stage of this kind.
fn stage(kind: &str, keys: &Keys) -> Keys {
    let mut table = keys.clone();
    table.insert("kind".to_owned(), kind.into());
    table
}

fn study<const N: usize>(stages: [(&str, Keys); N]) -> Result<Study, KeyErrors> {
    let named = stages.map(|(name, table)| (name.to_owned(), toml::Value::from(table)));
    let name = Keys::from_iter([("name".to_owned(), toml::Value::from("direct"))]);
    let manifest = Keys::from_iter([
        ("study".to_owned(), toml::Value::from(name)),
        ("stage".to_owned(), toml::Value::from(Keys::from_iter(named))),
    ]);
    let text = toml::to_string(&manifest).expect("a table of TOML can be written");
    Ok(Study::parse(&text, "keys", Path::new(""), crate::study::no_claims)?)
}

fn not_one(found: usize, what: &str) -> KeyErrors {
    KeyErrors(vec![format!(
        "the keys describe {found} {what}, one is asked for: lists are swept in a manifest alone"
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
        while pressing.press(&|| false).unwrap().is_some() {}
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
        // Westergaard's wave: p* = π E* Δ/λ, under which displacement and height are one.
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

    #[test]
    fn a_map_that_is_not_periodic_is_not_pressed_as_one_that_is() {
        let map = Map { is_periodic: false, ..wave() };
        let keys = "loads = [0.1]".parse().unwrap();
        assert!(matches!(Pressing::new(map.clone(), &keys), Err(DirectError::Open)));
        let keys = "loads = [0.1]\nboundary = \"free\"".parse().unwrap();
        assert!(Pressing::new(map, &keys).is_ok());
    }

    fn table(text: &str) -> Keys {
        text.parse().unwrap()
    }

    #[test]
    fn what_is_wrong_with_keys_is_told_as_in_a_manifest() {
        let keys = table("nodes = 64\nhurst = 1.7\nk_lower = 2\nk_upper = 16");
        let message = surface(&keys).unwrap_err().to_string();
        assert!(message.contains("`hurst`") && message.contains("1.7"), "{message}");
        let message = block(&table("loads = [0.2, 0.1]")).unwrap_err().to_string();
        assert!(message.contains("ascend"), "{message}");
    }

    #[test]
    fn several_points_are_not_one() {
        let keys = table("nodes = 64\nhurst = [0.7, 0.8]\nk_lower = 2\nk_upper = 16");
        let message = surface(&keys).unwrap_err().to_string();
        assert!(message.contains("2 surfaces"), "{message}");
    }

    #[test]
    fn asperities_are_not_pressed_as_if_every_node_were_solved() {
        let keys = table("loads = [0.1]\nmethod = \"asperities\"");
        let message = block(&keys).unwrap_err().to_string();
        assert!(message.contains("`method = \"asperities\"`"), "{message}");
    }

    #[test]
    fn a_hardness_in_either_unit_is_held_against_no_slope() {
        let keys = table("loads = [0.1]\nhardness = 1e-9");
        assert!(block(&keys).unwrap().hardness.is_some());
    }
}
