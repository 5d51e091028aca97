//! Slopes and curvatures of a map from differences over a distance: what a surface looks like at a
//! scale (scale-dependent roughness parameters, Sanner et al. 2022, doi:10.1016/j.apsadv.2021.100190).

use super::lines::{Axis, for_each_line};
use super::surface::Surface;
use crate::grid::Boundary;

/// A map at one distance of its nodes along an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// The distance ℓ, in nodes.
    pub steps: usize,
    /// √⟨((h(x + ℓ) − h(x))/ℓ)²⟩.
    pub slope: f64,
    /// √⟨((h(x + ℓ) − 2 h(x) + h(x − ℓ))/ℓ²)²⟩; 1/length.
    pub curvature: f64,
}

/// The map at distances of 1, 2, 3, 4, 6, 8, 12, … nodes along an axis, as far as second differences
/// fit it; a periodic one up to half its side.
///
/// Means are over all pairs, or triples, of nodes: around the cell of a periodic map, inside of any
/// other.
///
/// ```
/// use asperity_contact::grid::{Boundary, Grid};
/// use asperity_contact::topography::lines::Axis;
/// use asperity_contact::topography::scales::along;
/// use asperity_contact::topography::shapes::Shape;
///
/// // A paraboloid of radius R is as curved at every scale.
/// let dome = Shape::Paraboloid { radius: 0.25 }.draw(Grid::square(16, 1.0)?);
/// for scale in along(&dome, Axis::X, Boundary::Free) {
///     assert!((scale.curvature - 4.0).abs() < 1e-11);
/// }
/// # Ok::<(), asperity_contact::grid::GridError>(())
/// ```
pub fn along(surface: &Surface, axis: Axis, boundary: Boundary) -> Vec<Scale> {
    let nodes = axis.of(surface.grid().nodes());
    let spacing = axis.of(surface.grid().spacing());
    let longest = match boundary {
        Boundary::Periodic => nodes / 2,
        Boundary::Free => nodes.saturating_sub(1) / 2,
    };
    let distances: Vec<usize> = distances(longest).collect();
    let mut sums = vec![Sums::default(); distances.len()];
    for_each_line(surface, axis, |line| {
        for (sums, &steps) in sums.iter_mut().zip(&distances) {
            sums.add(line, steps, boundary);
        }
    });
    let scale = |(&steps, sums): (&usize, Sums)| {
        let length = steps as f64 * spacing;
        Scale {
            steps,
            slope: sums.first.root_mean() / length,
            curvature: sums.second.root_mean() / (length * length),
        }
    };
    distances.iter().zip(sums).map(scale).collect()
}

/// Powers of two and what lies half way between them, up to a longest.
fn distances(longest: usize) -> impl Iterator<Item = usize> {
    let powers = (0..usize::BITS).map(|power| 1_usize << power);
    let both = powers.flat_map(|power| [power, power + power / 2]);
    let mut before = 0;
    both.take_while(move |steps| *steps <= longest)
        .filter(move |steps| std::mem::replace(&mut before, *steps) < *steps)
}

#[derive(Clone, Copy, Default)]
struct MeanSquare {
    sum: f64,
    count: usize,
}

impl MeanSquare {
    fn add(&mut self, value: f64) {
        self.sum += value * value;
        self.count += 1;
    }

    fn root_mean(self) -> f64 {
        (self.sum / self.count as f64).sqrt()
    }
}

/// Differences over one distance.
#[derive(Clone, Copy, Default)]
struct Sums {
    first: MeanSquare,
    second: MeanSquare,
}

impl Sums {
    fn add(&mut self, line: &[f64], steps: usize, boundary: Boundary) {
        let nodes = line.len();
        match boundary {
            Boundary::Periodic => {
                for (i, height) in line.iter().enumerate() {
                    let after = line[(i + steps) % nodes] - height;
                    let before = height - line[(i + nodes - steps) % nodes];
                    self.first.add(after);
                    self.second.add(after - before);
                }
            }
            Boundary::Free => {
                for i in 0..nodes - steps {
                    self.first.add(line[i + steps] - line[i]);
                }
                for i in steps..nodes - steps {
                    let (before, after) = (line[i] - line[i - steps], line[i + steps] - line[i]);
                    self.second.add(after - before);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::grid::samples::rectangle;
    use crate::topography::differences;
    use crate::topography::shapes::Shape;

    #[test]
    fn distances_double_in_two_steps() {
        let found: Vec<usize> = distances(20).collect();
        assert_eq!(found, [1, 2, 3, 4, 6, 8, 12, 16]);
        assert_eq!(distances(0).count(), 0);
    }

    #[test]
    fn a_wave_has_the_slope_of_its_chords() {
        let (amplitude, waves) = (0.1, 2);
        let wave = Shape::Wave { amplitude, waves }.draw(rectangle([64, 8], [3.0, 1.0]));
        for scale in along(&wave, Axis::X, Boundary::Periodic) {
            let half = PI * 2.0 * scale.steps as f64 / 64.0;
            let length = 3.0 * scale.steps as f64 / 64.0;
            // h(x + ℓ) − h(x) has the amplitude 2 Δ sin(qℓ/2), twice differenced 4 Δ sin²(qℓ/2).
            let chord = 2.0 * amplitude * half.sin().abs() / 2_f64.sqrt() / length;
            let bend = 4.0 * amplitude * half.sin().powi(2) / 2_f64.sqrt() / length.powi(2);
            assert!((scale.slope - chord).abs() < 1e-13);
            assert!((scale.curvature - bend).abs() < 1e-11);
        }
    }

    #[test]
    fn one_step_gives_differences_of_neighbours() {
        // The same in every line, so that leaving out the last one changes nothing.
        let grid = rectangle([12, 9], [2.0, 1.0]);
        let height = |node: usize| libm::sin((grid.place(node)[0] as f64).powi(2));
        let surface = Surface::new(grid, (0..grid.count()).map(height).collect()).unwrap();
        let of_neighbours = differences::moments(&surface);
        let scale = along(&surface, Axis::X, Boundary::Free)[0];
        assert!((scale.slope.powi(2) / of_neighbours.m20 - 1.0).abs() < 1e-13);
        assert!((scale.curvature.powi(2) / of_neighbours.m40 - 1.0).abs() < 1e-13);
    }

    #[test]
    fn a_line_of_two_nodes_has_no_second_difference() {
        let surface = Shape::Paraboloid { radius: 1.0 }.draw(rectangle([2, 1], [1.0, 1.0]));
        assert_eq!(along(&surface, Axis::X, Boundary::Free), []);
        assert_eq!(along(&surface, Axis::Y, Boundary::Free), []);
    }
}
