//! Half-spaces with a boundary condition ([`HalfSpace`]) and a hardness ([`Hardness`]), and the
//! convolution from displacements to pressures ([`Stiffness`]).
//!
//! Periodic pressures and displacements are convolved on the mesh of the map. For an isolated patch
//! the mesh of pressures has four times the nodes, so that periodic images do not interact. The
//! mesh of displacements needs only a margin in which they decay. Without the margin, corrections
//! near the edges would be too large by a factor of up to 2.3 (the largest eigenvalue of S⁻¹ Eᵀ K
//! E, see `extension`). With 1.25 times the nodes along both axes the factor is 1.44, and with 1.5
//! or 2 times 1.37, as for periodic maps.

use thiserror::Error;

use super::{Solver, bytes_per_node};
use crate::elasticity;
use crate::elasticity::{ElasticOperator, FreeHalfSpace, PeriodicHalfSpace};
use crate::fft::{Band, Kernel, Row, Rows, Scratch, Transform, in_corner};
use crate::grid::{Boundary, Grid};
use crate::threads::Threads;

/// Half-space that a surface is pressed into.
///
/// ```
/// use asperity_contact::grid::{Boundary, Grid};
/// use asperity_contact::solver::{HalfSpace, Hardness, Settings};
///
/// // A ball of radius 4 on a material that yields at less than half of Hertz' peak pressure.
/// let grid = Grid::square(64, 1.0)?;
/// let from_centre = |index: usize| (index as f64 + 0.5) / 64.0 - 0.5;
/// let height = |[i, j]: [usize; 2]| -(from_centre(i).powi(2) + from_centre(j).powi(2)) / 8.0;
/// let heights: Vec<f64> = (0..grid.count()).map(|node| height(grid.indices(node))).collect();
/// let hardness = Hardness::new(0.012)?;
/// let body = HalfSpace { boundary: Boundary::Free, hardness: Some(hardness) };
/// let mut solver = body.solver(grid, &heights);
///
/// let load = 8e-4;
/// hardness.check_load(load)?;
/// let outcome = solver.press(load, &Settings::default(), &|| false);
/// assert_eq!(outcome.peak_pressure, hardness.pressure());
/// assert!(outcome.saturated_nodes > 0 && outcome.yielded_depth > 0.0);
/// // A material that yields needs a larger contact area.
/// let elastic = HalfSpace { hardness: None, ..body };
/// let without = elastic.solver(grid, &heights).press(load, &Settings::default(), &|| false);
/// assert!(outcome.contact_nodes > without.contact_nodes);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HalfSpace {
    /// Boundary condition, periodic or free (no pressure beyond the edges of the map).
    pub boundary: Boundary,
    /// Highest pressure that the material bears; `None` for an elastic material.
    pub hardness: Option<Hardness>,
}

impl HalfSpace {
    /// Prepares a surface, as [`Solver::new`] does.
    pub fn solver(&self, grid: Grid, heights: &[f64]) -> Solver {
        self.solver_with_threads(Threads::one(), grid, heights)
    }

    /// Prepares a surface with several threads, which later [share the work](Solver::set_threads).
    pub fn solver_with_threads(&self, threads: Threads, grid: Grid, heights: &[f64]) -> Solver {
        let body: Box<dyn ElasticOperator> = match self.boundary {
            Boundary::Periodic => Box::new(PeriodicHalfSpace::new(grid)),
            Boundary::Free => Box::new(FreeHalfSpace::new(grid)),
        };
        Solver::with_threads(threads, body, self.hardness, heights)
    }

    /// Returns the bytes per node that such a solver needs for this tolerance, preparation
    /// included.
    pub fn bytes_per_node(&self, tolerance: f64) -> f64 {
        let around = match self.boundary {
            Boundary::Periodic => 0.0,
            Boundary::Free => FREE_BYTES,
        };
        let yielding = self.hardness.map_or(0.0, |_| YIELDING_BYTES);
        bytes_per_node(tolerance) + around + yielding
    }
}

/// Additional bytes per node of a free half-space, which has no coarser meshes: a mesh with twice
/// the nodes along both axes for the factors of its kernels, and these kernels. 100 bytes a node in
/// all were measured at the peak of runs on 2048², 4096² and 8192² nodes.
const FREE_BYTES: f64 = 44.0;

/// Additional bytes per node for lists of nodes that may change, measured at the peak of a run on
/// 2048² nodes where many nodes change together.
const YIELDING_BYTES: f64 = 10.0;

/// Upper bound of the pressure, in units of E* × rms slope: positive and finite.
///
/// ```
/// use asperity_contact::solver::{Hardness, HardnessError};
///
/// // Steel of 2 GPa, E* = 230 GPa, on a surface of rms slope 0.2.
/// let hardness = Hardness::new(2e9 / (230e9 * 0.2))?;
/// assert!(hardness.check_load(0.01).is_ok());
/// assert_eq!(
///     hardness.check_load(0.06),
///     Err(HardnessError::Overloaded { load: 0.06, hardness: hardness.pressure() })
/// );
/// assert!(Hardness::new(0.0).is_err());
/// # Ok::<(), HardnessError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Hardness(f64);

/// Error of an invalid hardness, or of a load that the hardness does not bear.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum HardnessError {
    /// The hardness is not a positive, finite number.
    #[error("the hardness must be positive and finite, not {0}")]
    NotPositive(f64),
    /// The load is not below the hardness.
    #[error(
        "the mean pressure {load} is not below the hardness {hardness}; \
         use a smaller load or a larger hardness"
    )]
    Overloaded {
        /// Mean pressure of the load.
        load: f64,
        /// Hardness, in the same unit.
        hardness: f64,
    },
}

impl Hardness {
    /// Creates a hardness, in units of E* × rms slope.
    pub fn new(pressure: f64) -> Result<Self, HardnessError> {
        if pressure.is_finite() && pressure > 0.0 {
            Ok(Self(pressure))
        } else {
            Err(HardnessError::NotPositive(pressure))
        }
    }

    /// Returns the hardness in units of E* × rms slope.
    pub fn pressure(self) -> f64 {
        self.0
    }

    /// Checks that the mean pressure `load`, in the same unit, is below the hardness.
    pub fn check_load(self, load: f64) -> Result<(), HardnessError> {
        if load < self.0 {
            Ok(())
        } else {
            let hardness = self.0;
            Err(HardnessError::Overloaded { load, hardness })
        }
    }
}

/// Convolution of displacements with the stiffness.
///
/// It shares the transform of pressures, `single`, if both have the nodes of the map.
pub struct Stiffness {
    /// Nodes of the map, which is a corner of the mesh or all of it.
    map: [usize; 2],
    kernel: Kernel<f32>,
    apart: Option<SeparateTransform>,
}

/// Separate transform for a mesh that is larger than the map.
struct SeparateTransform {
    transform: Transform<f32>,
    scratch: Scratch<f32>,
    /// Moves of pressures, on the way to the mesh of pressures.
    moves: Vec<f32>,
}

impl Stiffness {
    pub fn new(threads: &Threads, body: &dyn ElasticOperator) -> Self {
        let map = body.grid().nodes();
        let is_apart = body.stiffness_nodes() != map;
        let apart = || {
            let transform = Transform::new(body.stiffness_nodes());
            SeparateTransform {
                scratch: transform.scratch_on(threads.clone()),
                transform,
                moves: vec![0.0; map[0] * map[1]],
            }
        };
        Self { map, kernel: elasticity::stiffness_on(threads, body), apart: is_apart.then(apart) }
    }

    pub fn set_threads(&mut self, threads: &Threads) {
        if let Some(apart) = &mut self.apart {
            apart.scratch.set_threads(threads.clone());
        }
    }

    /// Begins the convolution of the displacements that `rows` writes, on all rows of the mesh.
    pub fn begin(
        &mut self,
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        let (transform, scratch) = transform_of_mesh(&mut self.apart, single, scratch);
        transform.begin(rows, scratch);
    }

    /// Ends the convolution, stores all rows of pressures and lets `rows` read them.
    pub fn finish_and_store(
        &mut self,
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        let (transform, scratch) = transform_of_mesh(&mut self.apart, single, scratch);
        transform.multiply(&self.kernel, scratch);
        transform.finish_and_store(rows, scratch);
    }

    /// Reads these pairs of stored rows of the map.
    pub fn peek_stored(
        &mut self,
        pairs: &[usize],
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        let (transform, scratch) = transform_of_mesh(&mut self.apart, single, scratch);
        in_corner(self.map, rows, |rows| transform.peek_stored(pairs, rows, scratch));
    }

    /// Reads the stored rows of the map.
    pub fn read_stored(
        &mut self,
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        let (transform, scratch) = transform_of_mesh(&mut self.apart, single, scratch);
        in_corner(self.map, rows, |rows| transform.read_stored(rows, scratch));
    }

    /// Reads the stored rows of the map, and begins the convolution of the pressures that replace
    /// them.
    pub fn begin_from_stored(
        &mut self,
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        let Some(apart) = &mut self.apart else {
            return single.begin_from_stored(rows, scratch);
        };
        let mut keeping = KeepMoves {
            rows: rows.split_off(Row::new(0, self.map[1])),
            moves: Band::new(&mut apart.moves),
        };
        in_corner(self.map, &mut keeping, |rows| {
            apart.transform.read_stored(rows, &mut apart.scratch);
        });
        rows.append(keeping.rows);
        single.begin_with(&apart.moves, scratch);
    }
}

/// Returns the separate transform, or else the shared one.
fn transform_of_mesh<'a>(
    apart: &'a mut Option<SeparateTransform>,
    single: &'a Transform<f32>,
    scratch: &'a mut Scratch<f32>,
) -> (&'a Transform<f32>, &'a mut Scratch<f32>) {
    match apart {
        None => (single, scratch),
        Some(apart) => (&apart.transform, &mut apart.scratch),
    }
}

/// Keeps a copy of the rows that a pass writes.
struct KeepMoves<'a, P> {
    rows: P,
    moves: Band<'a, f32>,
}

impl<P: Rows<f32>> Rows<f32> for KeepMoves<'_, P> {
    fn row(&mut self, row: Row, values: &mut [f32]) {
        self.rows.row(row, values);
        self.moves.row(row).copy_from_slice(values);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { rows: self.rows.split_off(row), moves: self.moves.split_off(row) }
    }

    fn append(&mut self, later: Self) {
        self.rows.append(later.rows);
    }
}
