//! The half-spaces that there are, by name ([`HalfSpace`]), the pressure that a material bears
//! before it yields ([`Hardness`]), and the convolution from displacements to pressures
//! ([`Stiffness`]).
//!
//! Pressures that repeat are convolved on the mesh of the map, and so are displacements. Where
//! there is nothing around the map, the mesh of pressures is four times as large, so that nothing
//! comes around; that of displacements is only as much larger as they need to fade in. Were they to
//! end with the map, nodes near its edges would ask for up to 2.3 times too much (the largest
//! eigenvalue of S⁻¹ Eᵀ K E, see `extension`), and with 1.25 times the nodes along both axes it is
//! 1.44, with 1.5 or 2 times 1.37: as where the map repeats.

use thiserror::Error;

use super::{Solver, bytes_per_node};
use crate::elasticity;
use crate::elasticity::{ElasticOperator, FreeHalfSpace, PeriodicHalfSpace};
use crate::fft::{Band, Kernel, Row, Rows, Scratch, Transform, in_corner};
use crate::grid::{Boundary, Grid};
use crate::threads::Threads;

/// The half-space that a surface is pressed into.
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
/// hardness.bear(load)?;
/// let outcome = solver.press(load, &Settings::default(), &|| false);
/// assert_eq!(outcome.peak_pressure, hardness.pressure());
/// assert!(outcome.saturated_nodes > 0 && outcome.yielded_depth > 0.0);
/// // Whoever yields needs a larger area.
/// let elastic = HalfSpace { hardness: None, ..body };
/// let without = elastic.solver(grid, &heights).press(load, &Settings::default(), &|| false);
/// assert!(outcome.contact_nodes > without.contact_nodes);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HalfSpace {
    /// What lies beyond the edges of the map: the same pressures again, or none.
    pub boundary: Boundary,
    /// The highest pressure that it bears; without one it is elastic under any.
    pub hardness: Option<Hardness>,
}

impl HalfSpace {
    /// Prepares a surface, as [`Solver::new`] does.
    pub fn solver(&self, grid: Grid, heights: &[f64]) -> Solver {
        self.solver_on(Threads::one(), grid, heights)
    }

    /// The same, prepared by several threads, which [work on it](Solver::set_threads) from then on.
    pub fn solver_on(&self, threads: Threads, grid: Grid, heights: &[f64]) -> Solver {
        let body: Box<dyn ElasticOperator> = match self.boundary {
            Boundary::Periodic => Box::new(PeriodicHalfSpace::new(grid)),
            Boundary::Free => Box::new(FreeHalfSpace::new(grid)),
        };
        Solver::with_threads(threads, body, self.hardness, heights)
    }

    /// Bytes that such a solver takes for each node while it is prepared and solves to this
    /// tolerance.
    pub fn bytes_per_node(&self, tolerance: f64) -> f64 {
        let around = match self.boundary {
            Boundary::Periodic => 0.0,
            Boundary::Free => FREE_BYTES,
        };
        let yielding = self.hardness.map_or(0.0, |_| YIELDING_BYTES);
        bytes_per_node(tolerance) + around + yielding
    }
}

/// What a free half-space takes more, though it has no coarser meshes: one of twice the nodes along
/// both axes, on which the factors of its kernels are made, and these kernels. 100 bytes a node in
/// all were measured at the peak of runs on 2048², 4096² and 8192² nodes.
const FREE_BYTES: f64 = 44.0;

/// What is gathered of nodes that may change, where many do at once: at the peak of a run on 2048²
/// nodes.
const YIELDING_BYTES: f64 = 10.0;

/// A bound to the pressure, in units of E* × rms slope like all pressures of a solver: positive and
/// finite.
///
/// ```
/// use asperity_contact::solver::{Hardness, HardnessError};
///
/// // Steel of 2 GPa, E* = 230 GPa, on a surface of rms slope 0.2.
/// let hardness = Hardness::new(2e9 / (230e9 * 0.2))?;
/// assert!(hardness.bear(0.01).is_ok());
/// assert_eq!(
///     hardness.bear(0.06),
///     Err(HardnessError::Overloaded { load: 0.06, hardness: hardness.pressure() })
/// );
/// assert!(Hardness::new(0.0).is_err());
/// # Ok::<(), HardnessError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Hardness(f64);

/// Why a hardness is none, or does not bear a load.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum HardnessError {
    /// Not a positive, finite number.
    #[error("a hardness is positive and finite, not {0}")]
    NotPositive(f64),
    /// Beyond what the material bears.
    #[error(
        "a mean pressure of {load} takes a hardness above it, and this one is {hardness}: \
         saturated all over, the surface bears no more"
    )]
    Overloaded {
        /// The mean pressure,
        load: f64,
        /// and the hardness, in the same unit.
        hardness: f64,
    },
}

impl Hardness {
    /// A hardness in units of E* × rms slope.
    pub fn new(pressure: f64) -> Result<Self, HardnessError> {
        if pressure.is_finite() && pressure > 0.0 {
            Ok(Self(pressure))
        } else {
            Err(HardnessError::NotPositive(pressure))
        }
    }

    /// In units of E* × rms slope.
    pub fn pressure(self) -> f64 {
        self.0
    }

    /// Whether a mean pressure `load`, in the same units, can be borne: one below the hardness.
    pub fn bear(self, load: f64) -> Result<(), HardnessError> {
        if load < self.0 {
            Ok(())
        } else {
            let hardness = self.0;
            Err(HardnessError::Overloaded { load, hardness })
        }
    }
}

/// A convolution with the stiffness. It shares the transform of pressures, `single`, if that has
/// the nodes of the map.
pub struct Stiffness {
    /// Nodes of the map, which is a corner of the mesh, or all of it.
    map: [usize; 2],
    kernel: Kernel<f32>,
    apart: Option<Apart>,
}

/// A mesh and a transform of its own.
struct Apart {
    transform: Transform<f32>,
    scratch: Scratch<f32>,
    /// What pressures moved by, on its way to the other mesh.
    moves: Vec<f32>,
}

impl Stiffness {
    /// The stiffness of a body.
    pub fn new(threads: &Threads, body: &dyn ElasticOperator) -> Self {
        let map = body.grid().nodes();
        let is_apart = body.stiffness_nodes() != map;
        let apart = || {
            let transform = Transform::new(body.stiffness_nodes());
            Apart {
                scratch: transform.scratch_on(threads.clone()),
                transform,
                moves: vec![0.0; map[0] * map[1]],
            }
        };
        Self { map, kernel: elasticity::stiffness_on(threads, body), apart: is_apart.then(apart) }
    }

    /// Lets these threads share the work from now on.
    pub fn set_threads(&mut self, threads: &Threads) {
        if let Some(apart) = &mut self.apart {
            apart.scratch.set_threads(threads.clone());
        }
    }

    /// Begins the convolution of displacements, whose rows are written: all rows of its mesh.
    pub fn begin(
        &mut self,
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        let (transform, scratch) = of_mesh(&mut self.apart, single, scratch);
        transform.begin(rows, scratch);
    }

    /// Ends it: all rows of pressures are read, and kept.
    pub fn finish_and_store(
        &mut self,
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        let (transform, scratch) = of_mesh(&mut self.apart, single, scratch);
        transform.multiply(&self.kernel, scratch);
        transform.finish_and_store(rows, scratch);
    }

    /// Reads these pairs of rows that were kept, on the map.
    pub fn peek_stored(
        &mut self,
        pairs: &[usize],
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        let (transform, scratch) = of_mesh(&mut self.apart, single, scratch);
        in_corner(self.map, rows, |rows| transform.peek_stored(pairs, rows, scratch));
    }

    /// Reads rows that were kept, on the map.
    pub fn read_stored(
        &mut self,
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        let (transform, scratch) = of_mesh(&mut self.apart, single, scratch);
        in_corner(self.map, rows, |rows| transform.read_stored(rows, scratch));
    }

    /// The same, and begins the convolution of the pressures by which they are replaced.
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

/// The transform that is apart, or the one that is shared.
fn of_mesh<'a>(
    apart: &'a mut Option<Apart>,
    single: &'a Transform<f32>,
    scratch: &'a mut Scratch<f32>,
) -> (&'a Transform<f32>, &'a mut Scratch<f32>) {
    match apart {
        None => (single, scratch),
        Some(apart) => (&apart.transform, &mut apart.scratch),
    }
}

/// Keeps what rows are replaced by.
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
