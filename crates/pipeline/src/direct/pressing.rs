//! One surface, pressed by one load after the other.

use std::num::NonZeroUsize;

use toml::Table as Keys;

use super::{DirectError, keys};
use asperity_contact::grid::{Boundary, Grid};
use asperity_contact::solver::Outcome;
use asperity_contact::threads::Threads;
use asperity_contact::topography::differences;
use asperity_contact::topography::moments::Moments;
use asperity_contact::topography::surface::Surface;
use asperity_stages::StageError;
use asperity_stages::columns::RMS_SLOPE;
use asperity_stages::grids;
use asperity_stages::solve::block::Block;
use asperity_tables::column::Value;
use asperity_tables::table::Table;

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
    /// Number of cores to use.
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
        let params = keys::block(keys)?;
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
        let pressure = contact.map(|touches| match touches {
            true => *kept.next().expect("every node in contact has one"),
            false => 0.0,
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
    let moments = match map.is_periodic {
        true => Moments::of(&map.surface),
        false => differences::moments(&map.surface),
    };
    moments.rms_slope()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direct::draw;

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
}
