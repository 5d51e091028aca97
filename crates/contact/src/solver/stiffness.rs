//! The convolution from displacements to pressures, and on which mesh it is made.
//!
//! Pressures that repeat are convolved on the mesh of the map, and so are displacements. Where there is
//! nothing around the map, the mesh of pressures is four times as large, so that nothing comes around; that of
//! displacements is only as much larger as they need to fade in. Were they to end with the map, nodes near its
//! edges would ask for up to 2.3 times too much (the largest eigenvalue of S⁻¹ Eᵀ K E, see `extension`), and
//! with 1.25 times the nodes along both axes it is 1.44, with 1.5 or 2 times 1.37: as where the map repeats.

use crate::elasticity;
use crate::elasticity::ElasticOperator;
use crate::fft::{Band, Kernel, Row, Rows, Scratch, Transform, in_corner};
use crate::threads::Threads;

/// A convolution with the stiffness. It shares the transform of pressures, `single`, if that has the nodes of
/// the map.
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
    pub fn work_on(&mut self, threads: &Threads) {
        if let Some(apart) = &mut self.apart {
            apart.scratch.work_on(threads.clone());
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
    pub fn finish_and_keep(
        &mut self,
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        let (transform, scratch) = of_mesh(&mut self.apart, single, scratch);
        transform.multiply(&self.kernel, scratch);
        transform.finish_and_keep(rows, scratch);
    }

    /// Reads these pairs of rows that were kept, on the map.
    pub fn peek_kept(
        &mut self,
        pairs: &[usize],
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        let (transform, scratch) = of_mesh(&mut self.apart, single, scratch);
        in_corner(self.map, rows, |rows| transform.peek_kept(pairs, rows, scratch));
    }

    /// Reads rows that were kept, on the map.
    pub fn finish_kept(
        &mut self,
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        let (transform, scratch) = of_mesh(&mut self.apart, single, scratch);
        in_corner(self.map, rows, |rows| transform.finish_kept(rows, scratch));
    }

    /// The same, and begins the convolution of the pressures by which they are replaced.
    pub fn turn_kept(
        &mut self,
        rows: &mut impl Rows<f32>,
        single: &Transform<f32>,
        scratch: &mut Scratch<f32>,
    ) {
        let Some(apart) = &mut self.apart else {
            return single.turn_kept(rows, scratch);
        };
        let mut keeping = KeepMoves {
            rows: rows.split_off(Row::new(0, self.map[1])),
            moves: Band::of(&mut apart.moves),
        };
        in_corner(self.map, &mut keeping, |rows| {
            apart.transform.finish_kept(rows, &mut apart.scratch);
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
