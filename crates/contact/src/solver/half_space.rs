//! Half-spaces with a boundary condition ([`HalfSpace`]) and a hardness ([`Hardness`]), and the
//! convolution from displacements to pressures ([`Stiffness`]).
//!
//! For periodic bodies, pressures and displacements are convolved on the mesh of the map. For an
//! isolated patch, pressures are convolved on a mesh of four times the nodes, so that periodic
//! images do not interact. Displacements need only a margin around the map, in which they decay.
//! Without the margin, corrections near the edges would be too large by a factor of up to 2.3,
//! which is the largest eigenvalue of S⁻¹ Eᵀ K E (see `extension`). With 1.25 times the nodes along
//! both axes the factor is 1.44, and with 1.5 or 2 times 1.37, as for periodic maps.

use thiserror::Error;

use super::{Solver, bytes_per_node};
use crate::elasticity;
use crate::elasticity::{ElasticOperator, FreeHalfSpace, PeriodicHalfSpace};
use crate::fft::{Band, Kernel, Row, Rows, Scratch, Transform, in_corner};
use crate::grid::{Boundary, Grid};
use crate::threads::Threads;

/// Elastic half-space with a boundary condition and, if it yields, a hardness.
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
    /// Creates the solver of a surface on this body, with one height for each node of `grid`, as
    /// [`Solver::with_hardness`] does.
    pub fn solver(&self, grid: Grid, heights: &[f64]) -> Solver {
        self.solver_with_threads(Threads::one(), grid, heights)
    }

    /// Creates the solver as [`HalfSpace::solver`] does, with several threads.
    ///
    /// The threads also share the work of all loads, until [`Solver::set_threads`] replaces them.
    pub fn solver_with_threads(&self, threads: Threads, grid: Grid, heights: &[f64]) -> Solver {
        let body: Box<dyn ElasticOperator> = match self.boundary {
            Boundary::Periodic => Box::new(PeriodicHalfSpace::new(grid)),
            Boundary::Free => Box::new(FreeHalfSpace::new(grid)),
        };
        Solver::with_threads(threads, body, self.hardness, heights)
    }

    /// Returns the memory that the solver of this body needs for `tolerance`, including its
    /// creation, in bytes per node.
    pub fn bytes_per_node(&self, tolerance: f64) -> f64 {
        let around = match self.boundary {
            Boundary::Periodic => 0.0,
            Boundary::Free => FREE_BYTES,
        };
        let yielding = self.hardness.map_or(0.0, |_| YIELDING_BYTES);
        bytes_per_node(tolerance) + around + yielding
    }

    /// Returns the memory that each [sibling](Solver::sibling) of a solver of this body needs for
    /// `tolerance`, in bytes per node.
    pub fn sibling_bytes_per_node(&self, tolerance: f64) -> f64 {
        let shared = match self.boundary {
            Boundary::Periodic => SHARED_BYTES,
            Boundary::Free => SHARED_BYTES_FREE,
        };
        self.bytes_per_node(tolerance) - shared
    }
}

/// Additional memory of the solver of a free half-space, in bytes per node.
///
/// It is needed for the kernels, and for a mesh with twice the nodes along both axes on which they
/// are computed. Coarser meshes are not used. Runs on 2048², 4096² and 8192² nodes had a peak of
/// 100 bytes per node in total.
const FREE_BYTES: f64 = 44.0;

/// Memory that siblings share, in bytes per node: heights in both precisions take 12 bytes and three
/// kernels 4. Heights and kernels of coarser meshes take 6 bytes per node of these meshes, 2 in
/// total.
const SHARED_BYTES: f64 = 18.0;

/// Memory that siblings share on a free half-space, in bytes per node. Kernels of pressures are on
/// a mesh of four times the nodes, and the body keeps their factors.
const SHARED_BYTES_FREE: f64 = 32.0;

/// Additional memory of a solver with a hardness, in bytes per node, for lists of nodes whose
/// pressure may change.
///
/// It was measured at the peak of a run on 2048² nodes in which many nodes change in the same
/// iteration.
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

    /// Checks that the mean pressure `load`, in units of E* × rms slope, is below the hardness.
    pub fn check_load(self, load: f64) -> Result<(), HardnessError> {
        if load < self.0 {
            Ok(())
        } else {
            let hardness = self.0;
            Err(HardnessError::Overloaded { load, hardness })
        }
    }
}

/// Convolution of displacements with the stiffness, which gives pressures.
///
/// On the mesh of the map, its methods use the transform `single` and the scratch with which
/// pressures are convolved. On a larger mesh, they use a transform and a scratch of their own.
pub struct Stiffness {
    /// Numbers of nodes of the map along x and y. The map is a corner of the mesh or the whole
    /// mesh.
    map: [usize; 2],
    kernel: Kernel<f32>,
    /// Transform of a mesh that is larger than the map.
    larger: Option<Transform<f32>>,
}

/// Buffers for convolutions on one mesh.
pub struct Buffers {
    pub scratch: Scratch<f32>,
    larger: Option<LargerMesh>,
}

/// Buffers for convolutions with the stiffness on a mesh that is larger than the map.
struct LargerMesh {
    scratch: Scratch<f32>,
    /// Steps of the pressures, which are copied from this mesh to the mesh on which pressures are
    /// convolved.
    steps: Vec<f32>,
}

impl Buffers {
    pub fn set_threads(&mut self, threads: &Threads) {
        self.scratch.set_threads(threads.clone());
        if let Some(larger) = &mut self.larger {
            larger.scratch.set_threads(threads.clone());
        }
    }
}

impl Stiffness {
    pub fn new(threads: &Threads, body: &dyn ElasticOperator) -> Self {
        let map = body.grid().nodes();
        let is_larger = body.stiffness_nodes() != map;
        Self {
            map,
            kernel: elasticity::stiffness_on(threads, body),
            larger: is_larger.then(|| Transform::new(body.stiffness_nodes())),
        }
    }

    /// Creates buffers for convolutions with `single` and with the stiffness.
    pub fn buffers(&self, threads: &Threads, single: &Transform<f32>) -> Buffers {
        Buffers {
            scratch: single.scratch_on(threads.clone()),
            larger: self.larger.as_ref().map(|transform| LargerMesh {
                scratch: transform.scratch_on(threads.clone()),
                steps: vec![0.0; self.map[0] * self.map[1]],
            }),
        }
    }

    /// Returns the transform and the scratch of the mesh of the stiffness.
    fn transform<'a>(
        &'a self,
        single: &'a Transform<f32>,
        buffers: &'a mut Buffers,
    ) -> (&'a Transform<f32>, &'a mut Scratch<f32>) {
        match (&self.larger, &mut buffers.larger) {
            (Some(transform), Some(larger)) => (transform, &mut larger.scratch),
            _ => (single, &mut buffers.scratch),
        }
    }

    /// Begins the convolution of displacements. `rows` writes these displacements into all rows of
    /// the mesh.
    pub fn begin(&self, rows: &mut impl Rows<f32>, single: &Transform<f32>, buffers: &mut Buffers) {
        let (transform, scratch) = self.transform(single, buffers);
        transform.begin(rows, scratch);
    }

    /// Ends the convolution, passes all rows of pressures to `rows`, and stores them as `rows`
    /// leaves them.
    pub fn finish_and_store(
        &self,
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        buffers: &mut Buffers,
    ) {
        let (transform, scratch) = self.transform(single, buffers);
        transform.multiply(&self.kernel, scratch);
        transform.finish_and_store(rows, scratch);
    }

    /// Passes rows 2i and 2i + 1 of the map to `rows`, for each i in `pairs`, as stored by
    /// [`Stiffness::finish_and_store`].
    pub fn peek_stored(
        &self,
        pairs: &[usize],
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        buffers: &mut Buffers,
    ) {
        let (transform, scratch) = self.transform(single, buffers);
        in_corner(self.map, rows, |rows| transform.peek_stored(pairs, rows, scratch));
    }

    /// Passes all rows of the map to `rows`, as stored by [`Stiffness::finish_and_store`].
    pub fn read_stored(
        &self,
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        buffers: &mut Buffers,
    ) {
        let (transform, scratch) = self.transform(single, buffers);
        in_corner(self.map, rows, |rows| transform.read_stored(rows, scratch));
    }

    /// Passes the stored rows of the map to `rows`, which replaces them by steps of the pressures,
    /// and begins the convolution of these steps with the displacement kernel.
    pub fn begin_from_stored(
        &self,
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        buffers: &mut Buffers,
    ) {
        let (Some(transform), Some(larger)) = (&self.larger, &mut buffers.larger) else {
            return single.begin_from_stored(rows, &mut buffers.scratch);
        };
        let mut keeping = CopyRows {
            rows: rows.split_off(Row::new(0, self.map[1])),
            steps: Band::new(&mut larger.steps),
        };
        in_corner(self.map, &mut keeping, |rows| {
            transform.read_stored(rows, &mut larger.scratch);
        });
        rows.append(keeping.rows);
        single.begin_with(&larger.steps, &mut buffers.scratch);
    }
}

/// Pass that runs another pass and copies the rows that it writes.
struct CopyRows<'a, P> {
    rows: P,
    steps: Band<'a, f32>,
}

impl<P: Rows<f32>> Rows<f32> for CopyRows<'_, P> {
    fn row(&mut self, row: Row, values: &mut [f32]) {
        self.rows.row(row, values);
        self.steps.row(row).copy_from_slice(values);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self { rows: self.rows.split_off(row), steps: self.steps.split_off(row) }
    }

    fn append(&mut self, later: Self) {
        self.rows.append(later.rows);
    }
}
