//! Interaction of point sources that lie anywhere in a periodic cell.
//!
//! The displacement G by a unit force is the Ewald sum of
//! [`asperities::equilibrium`](crate::asperities). Here, the near sum is over pairs of sources. For
//! the far sum, each source is spread over the nodes around it by a Gaussian, and the Fourier
//! transform of the map is divided by that of the Gaussian (Lindbo & Tornberg, *J. Comput. Phys.*
//! 230, 8744 (2011)). Lengths are in units of the longer side.

use std::f64::consts::PI;

use rustfft::num_complex::Complex;

use crate::asperities::{nominal_area, steps};
use crate::fft::{Scratch, Transform};
use crate::grid::Grid;

/// Argument above which erfc is neglected, because it is below 2e-14.
const NEGLIGIBLE: f64 = 5.4;

/// Standard deviation of the Gaussian in grid spacings. Waves that alias on the nodes, and the
/// Gaussian beyond [`REACH`], contribute less than 1e-12.
const DEVIATION: f64 = 1.6;

/// Number of nodes on either side of a source over which it is spread.
const REACH: isize = 12;

/// Distance in grid spacings below which two sources coincide, because centres have rounding
/// errors.
const COINCIDENT: f64 = 1e-9;

/// Sums over the point sources of a periodic cell and over their images.
pub struct PointSources {
    nodes: [usize; 2],
    steps: [f64; 2],
    /// Parameter that divides the Ewald sum into its near and its far part.
    alpha: f64,
    transform: Transform<f64>,
    scratch: Scratch<f64>,
    map: Vec<f64>,
    spectrum: Vec<Complex<f64>>,
    /// Factors of the squares of `spectrum` in the far sum.
    factors: Vec<f64>,
}

impl PointSources {
    pub fn new(grid: Grid) -> Self {
        let (nodes, steps) = (grid.nodes(), steps(grid));
        let transform = Transform::new(nodes);
        // The grid resolves the fewest waves along the axis of the larger step.
        let alpha = PI / steps[0].max(steps[1]) / (2.0 * NEGLIGIBLE);
        let columns = transform.spectrum_columns();
        let factor = |index: usize| {
            let [i, k_y] = [index / columns, index % columns];
            let waves = [i.min(nodes[0] - i) as f64, k_y as f64];
            let q = 2.0 * PI * grid.cell().wavenumber(waves);
            let far = if q > 0.0 {
                2.0 * libm::erfc(q / (2.0 * alpha)) / q
            } else {
                -2.0 / (PI.sqrt() * alpha)
            };
            let [along_x, along_y] = [0, 1].map(|axis| {
                let angle = 2.0 * PI * waves[axis] / nodes[axis] as f64;
                2.0 * PI * DEVIATION.powi(2) * libm::exp(-(angle * DEVIATION).powi(2))
            });
            // The other columns stand for k and −k.
            let modes = if k_y == 0 || 2 * k_y == nodes[1] { 1.0 } else { 2.0 };
            modes * far / (nominal_area(grid) * along_x * along_y)
        };
        Self {
            nodes,
            steps,
            alpha,
            scratch: transform.scratch(),
            map: vec![0.0; grid.count()],
            spectrum: vec![Complex::default(); transform.spectrum_len()],
            factors: (0..transform.spectrum_len()).map(factor).collect(),
            transform,
        }
    }

    /// Returns Σ f_i f_j G(r_i − r_j) over all pairs of sources, without the term 1/(π r) where
    /// r = 0. `places` are the positions in grid spacings, from 0 to the number of nodes.
    pub fn energy(&mut self, places: &[[f64; 2]], forces: &[f64]) -> f64 {
        self.map.fill(0.0);
        for (place, force) in places.iter().zip(forces) {
            self.spread(*place, *force);
        }
        self.transform.forward(&self.map, &mut self.spectrum, &mut self.scratch);
        let modes = self.spectrum.iter().zip(&self.factors);
        let far: f64 = modes.map(|(value, factor)| factor * value.norm_sqr()).sum();
        far + self.near(places, forces)
    }

    /// Adds a source to the map.
    fn spread(&mut self, place: [f64; 2], force: f64) {
        let [along_x, along_y] = [0, 1].map(|axis| {
            let (at, nodes) = (place[axis], self.nodes[axis] as isize);
            let middle = at.round() as isize;
            let weight = |node: isize| {
                let distance = (node as f64 - at) / DEVIATION;
                (node.rem_euclid(nodes) as usize, libm::exp(-0.5 * distance * distance))
            };
            (middle - REACH..=middle + REACH).map(weight).collect::<Vec<_>>()
        });
        for (i, weight) in along_x {
            for (j, other) in &along_y {
                self.map[i * self.nodes[1] + j] += force * weight * other;
            }
        }
    }

    /// Returns Σ f_i f_j erfc(α r)/(π r) over all pairs of sources and images. Where r = 0, it
    /// takes the limit without the term 1/(π r).
    fn near(&self, places: &[[f64; 2]], forces: &[f64]) -> f64 {
        let boxes = Boxes::new(self.nodes, self.steps.map(|step| NEGLIGIBLE / self.alpha / step));
        let mut members = vec![Vec::new(); boxes.counts[0] * boxes.counts[1]];
        for (source, place) in places.iter().enumerate() {
            let [i, j] = boxes.indices(*place);
            members[i * boxes.counts[1] + j].push(source);
        }
        let mut sum = 0.0;
        for (place, force) in places.iter().zip(forces) {
            let [i, j] = boxes.indices(*place);
            for (i, shift_x) in boxes.around(0, i) {
                for (j, shift_y) in boxes.around(1, j) {
                    for &other in &members[i * boxes.counts[1] + j] {
                        let x = places[other][0] - place[0] + shift_x;
                        let y = places[other][1] - place[1] + shift_y;
                        sum += force * forces[other] * self.near_pair(x, y);
                    }
                }
            }
        }
        sum
    }

    /// Returns erfc(α r)/(π r) at the offset (x, y) in grid spacings.
    fn near_pair(&self, x: f64, y: f64) -> f64 {
        if x.abs().max(y.abs()) < COINCIDENT {
            return -2.0 * self.alpha / libm::pow(PI, 1.5);
        }
        let r = libm::hypot(x * self.steps[0], y * self.steps[1]);
        if self.alpha * r < NEGLIGIBLE { libm::erfc(self.alpha * r) / (PI * r) } else { 0.0 }
    }
}

/// Boxes into which the cell is divided to find near sources.
struct Boxes {
    nodes: [usize; 2],
    counts: [usize; 2],
    /// Number of boxes on either side that a source reaches.
    reach: [isize; 2],
}

impl Boxes {
    /// Creates boxes for sources that reach so many grid spacings along each axis.
    fn new(nodes: [usize; 2], reach: [f64; 2]) -> Self {
        let per_axis = |axis: usize| {
            let count = (nodes[axis] as f64 / reach[axis]).max(1.0).floor();
            (count as usize, (reach[axis] * count / nodes[axis] as f64).ceil() as isize)
        };
        let [(count_x, reach_x), (count_y, reach_y)] = [0, 1].map(per_axis);
        Self { nodes, counts: [count_x, count_y], reach: [reach_x, reach_y] }
    }

    fn indices(&self, place: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|axis| {
            let index = place[axis] / self.nodes[axis] as f64 * self.counts[axis] as f64;
            (index as usize).min(self.counts[axis] - 1)
        })
    }

    /// Iterates over the boxes around the box `index` along an axis, also across the edges of the
    /// cell: the index of the box, and the grid spacings from the box to its image.
    fn around(&self, axis: usize, index: usize) -> impl Iterator<Item = (usize, f64)> + use<> {
        let (count, reach) = (self.counts[axis] as isize, self.reach[axis]);
        let (index, nodes) = (index as isize, self.nodes[axis] as f64);
        (index - reach..=index + reach).map(move |index| {
            (index.rem_euclid(count) as usize, index.div_euclid(count) as f64 * nodes)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asperities::samples::ewald;
    use crate::grid::samples::{rectangle, square};

    #[test]
    fn sources_interact_as_the_lattice_sum_anywhere_in_the_cell() {
        for (grid, size) in [
            (square(2, 1.0), [1.0, 1.0]),
            (square(7, 3.0), [1.0, 1.0]),
            (square(64, 1.0), [1.0, 1.0]),
            (rectangle([24, 40], [0.5, 1.0]), [0.5, 1.0]),
            (rectangle([6, 50], [1.0, 0.4]), [1.0, 0.4]),
        ] {
            let nodes = grid.nodes().map(|nodes| nodes as f64);
            let mut sources = PointSources::new(grid);
            let mut energy = |places: &[[f64; 2]]| {
                let places = places.iter().map(|[x, y]| [x * nodes[0], y * nodes[1]]);
                let places: Vec<[f64; 2]> = places.collect();
                sources.energy(&places, &[1.0, 0.3][..places.len()])
            };
            let own = ewald(size, [0.0; 2]);
            for place in [[0.0, 0.0], [0.3, 0.71], [0.999, 0.5]] {
                assert!((energy(&[place]) - own).abs() < 1e-11, "{grid:?} {place:?}");
                for other in [[0.31, 0.7], [0.01, 0.98], [0.6, 0.1]] {
                    let between = [0, 1].map(|axis| (other[axis] - place[axis]) * size[axis]);
                    let expected = 1.09 * own + 0.6 * ewald(size, between);
                    let error = (energy(&[place, other]) - expected).abs();
                    assert!(
                        error < 1e-11 * expected.abs().max(1.0),
                        "{grid:?} {place:?} {other:?}"
                    );
                }
            }
            // Two sources at one place are one source.
            assert!((energy(&[[0.2, 0.4]; 2]) - 1.69 * own).abs() < 1e-11, "{grid:?}");
        }
    }
}
