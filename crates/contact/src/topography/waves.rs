//! Waves on a mesh, added up by one inverse transform.

use rustfft::num_complex::Complex;

use crate::fft::Transform;
use crate::threads::Threads;

/// A sum of waves c e^(i q·x) + c* e^(−i q·x) on the nodes of a mesh.
pub(super) struct Waves {
    transform: Transform<f64>,
    nodes: [usize; 2],
    half: Vec<Complex<f64>>,
}

impl Waves {
    /// None so far.
    pub fn on(nodes: [usize; 2]) -> Self {
        let transform = Transform::new(nodes);
        let half = vec![Complex::default(); transform.spectrum_len()];
        Self { transform, nodes, half }
    }

    /// Adds the wave with so many periods along x and y, at most half as many as there are nodes.
    pub fn add(&mut self, [k_x, k_y]: [i32; 2], coefficient: Complex<f64>) {
        let [nodes_x, nodes_y] = self.nodes;
        let columns = self.transform.spectrum_columns();
        let k_y = k_y as usize;
        self.half[row_of(k_x, nodes_x) * columns + k_y] += coefficient;
        // Of the opposite mode only these columns are stored. At Nyquist it is the same entry,
        // which thus receives 2 Re(c), the sample that any finer mesh has there.
        if k_y == 0 || 2 * k_y == nodes_y {
            self.half[row_of(-k_x, nodes_x) * columns + k_y] += coefficient.conj();
        }
    }

    /// Their sum, times a factor.
    pub fn heights(mut self, threads: &Threads, factor: f64) -> Vec<f64> {
        let mut heights = vec![0.0; self.nodes[0] * self.nodes[1]];
        let scratch = &mut self.transform.scratch_on(threads.clone());
        self.transform.inverse(&mut self.half, &mut heights, scratch);
        heights.iter_mut().for_each(|height| *height *= factor);
        heights
    }
}

/// Row of a spectrum that holds the signed wavenumber.
pub(super) fn row_of(k_x: i32, nodes: usize) -> usize {
    let k_x = k_x as isize;
    k_x.rem_euclid(nodes as isize) as usize
}
