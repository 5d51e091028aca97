//! Spots of a contact, and the conductance of separate spots.
//!
//! The conductance per area h_c of an interface follows from its stiffness: h_c L/k_s = (L/E*)
//! dp₀/dδ, with 2/k_s = 1/k₁ + 1/k₂ (Barber, *Proc. R. Soc. A* 459, 2003, 53);
//! [`Solver::contact_stiffness`](crate::solver::Solver::contact_stiffness) computes it. The formula
//! of Greenwood (*Br. J. Appl. Phys.* 17, 1966, 1621) approximates it by circular spots whose
//! currents are proportional to their radii a:
//!
//! 1/G = [1/(2 Σ a) + Σ a_i a_j/(π s_ij)/(Σ a)²]/k_s,
//!
//! with the distance s_ij of the centres of two spots. In a periodic cell, the sum includes the
//! periodic images of all spots.
//!
//! In a layer, a current does not spread as displacements do: [`conduction`](crate::conduction)
//! describes it, and [`Conductor`](crate::solver::Conductor) computes the conductance.

mod point_sources;

use std::f64::consts::PI;

use self::point_sources::PointSources;
use crate::grid::{Boundary, Grid};
use crate::morphology::clusters::Spot;
use crate::morphology::map::ContactMap;

/// Largest number of spots of an isolated map whose pairs are summed.
const MAX_PAIRED: usize = 20_000;

/// Conductance of the separate spots of contact maps on one grid.
pub struct SpotConductance {
    grid: Grid,
    boundary: Boundary,
    /// Sums over the images of a periodic cell.
    images: Option<PointSources>,
}

/// Spots of one contact map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactSpots {
    /// Number of spots: 4-connected clusters of contact nodes.
    pub count: usize,
    /// Mean of the radii √(A/π) of circles with the areas A of the spots, in units of the longer
    /// side; `None` without contact.
    pub mean_radius: Option<f64>,
    /// Conductance per area by Greenwood's formula, h_c L/k_s with the longer side L. `None`
    /// without contact, and if spots are so close that the formula gives no positive conductance.
    pub greenwood: Option<f64>,
}

impl SpotConductance {
    /// Prepares the conductance on a grid with this boundary condition.
    pub fn new(grid: Grid, boundary: Boundary) -> Self {
        let images = boundary.is_periodic().then(|| PointSources::new(grid));
        Self { grid, boundary, images }
    }

    /// Computes the spots of a map.
    ///
    /// ```
    /// use asperity_mechanics::conductance::SpotConductance;
    /// use asperity_mechanics::grid::{Boundary, Grid};
    /// use asperity_mechanics::morphology::map::ContactMap;
    ///
    /// // One square of 4 × 4 nodes is a spot with the radius of a circle of the same area.
    /// let grid = Grid::square(32, 1.0)?;
    /// let is_inside = |node: usize| grid.indices(node).iter().all(|index| *index < 4);
    /// let pressure = |node| if is_inside(node) { 1.0 } else { 0.0 };
    /// let pressures: Vec<f64> = (0..grid.count()).map(pressure).collect();
    /// let map = ContactMap::from_pressures(grid.nodes(), &pressures);
    /// let spots = SpotConductance::new(grid, Boundary::Free).of_map(&map);
    /// let radius = 4.0 / 32.0 / std::f64::consts::PI.sqrt();
    /// assert_eq!(spots.count, 1);
    /// assert!((spots.mean_radius.unwrap() - radius).abs() < 1e-15);
    /// assert!((spots.greenwood.unwrap() - 2.0 * radius).abs() < 1e-15);
    /// # Ok::<(), asperity_mechanics::grid::GridError>(())
    /// ```
    pub fn of_map(&mut self, map: &ContactMap) -> ContactSpots {
        let spots = Spot::all(&map.clone().with_boundary(self.boundary));
        let aspect = self.grid.cell().aspect();
        let nominal_area = 1.0 / (aspect[0] * aspect[1]);
        let cell = nominal_area / self.grid.count() as f64;
        let radius = |spot: &Spot| (spot.nodes as f64 * cell / PI).sqrt();
        let radii: Vec<f64> = spots.iter().map(radius).collect();
        let total: f64 = radii.iter().sum();
        let count = spots.len();
        if count == 0 {
            return ContactSpots { count, mean_radius: None, greenwood: None };
        }
        let shares: Vec<f64> = radii.iter().map(|radius| radius / total).collect();
        let interaction = match &mut self.images {
            Some(images) => {
                let centres: Vec<[f64; 2]> = spots.iter().map(|spot| spot.centre).collect();
                Some(images.energy(&centres, &shares))
            }
            None => (count <= MAX_PAIRED).then(|| of_pairs(self.grid, &spots, &shares)),
        };
        let resistance = interaction.map(|interaction| 0.5 / total + interaction);
        let greenwood = resistance.filter(|resistance| *resistance > 0.0);
        ContactSpots {
            count,
            mean_radius: Some(total / count as f64),
            greenwood: greenwood.map(|resistance| 1.0 / (resistance * nominal_area)),
        }
    }
}

/// Returns Σ f_i f_j/(π s_ij) with the shares f of the current, over all pairs of spots.
fn of_pairs(grid: Grid, spots: &[Spot], shares: &[f64]) -> f64 {
    let longer = grid.cell().longer_side();
    let [step_x, step_y] = grid.spacing().map(|step| step / longer);
    let mut sum = 0.0;
    for (i, one) in spots.iter().enumerate() {
        for (j, other) in spots.iter().enumerate().skip(i + 1) {
            let x = step_x * (one.centre[0] - other.centre[0]);
            let y = step_y * (one.centre[1] - other.centre[1]);
            let distance = libm::hypot(x, y);
            if distance > 0.0 {
                sum += 2.0 * shares[i] * shares[j] / (PI * distance);
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asperities::samples::ewald;
    use crate::grid::samples::square;

    /// Returns a map with discs of a radius in nodes around centres in nodes.
    fn discs(nodes: usize, radius: f64, centres: &[[f64; 2]], boundary: Boundary) -> ContactMap {
        let inside = |node: usize| {
            let [x, y] = [node / nodes, node % nodes].map(|index| index as f64);
            centres.iter().any(|[x_0, y_0]| (x - x_0).hypot(y - y_0) < radius)
        };
        let pressures: Vec<f64> =
            (0..nodes * nodes).map(|node| f64::from(u8::from(inside(node)))).collect();
        ContactMap::from_pressures([nodes; 2], &pressures).with_boundary(boundary)
    }

    #[test]
    fn clusters_of_discs_conduct_as_greenwoods_formula_has_it() {
        // The column of equal forces of the reference, in units of k_s a; a is 8 of 96 nodes.
        let two = [[31.5, 47.5], [63.5, 47.5]];
        let five = [[47.5, 47.5], [71.5, 47.5], [23.5, 47.5], [47.5, 71.5], [47.5, 23.5]];
        for (centres, expected) in [(&two[..], 3.4507898), (&five[..], 6.0078191)] {
            let map = discs(96, 8.0, centres, Boundary::Free);
            let found = SpotConductance::new(square(96, 1.0), Boundary::Free).of_map(&map);
            assert_eq!(found.count, centres.len());
            let counted = found.mean_radius.unwrap() * 96.0 / 8.0;
            assert!((counted - 1.0).abs() < 0.02);
            // Discs on the mesh have 2 % more area than circles.
            assert!((found.greenwood.unwrap() * 12.0 / expected - 1.0).abs() < 0.02);
        }
    }

    #[test]
    fn a_lattice_of_discs_conducts_as_its_closed_form_even_across_the_edges() {
        for centre in [[31.5, 31.5], [0.0, 0.0]] {
            let map = discs(64, 4.5, &[centre], Boundary::Periodic);
            let found = SpotConductance::new(square(64, 1.0), Boundary::Periodic).of_map(&map);
            let radius = found.mean_radius.unwrap();
            let closed = 1.0 / (0.5 / radius - 3.900_264_920_001_956 / PI);
            assert_eq!(found.count, 1);
            assert!((found.greenwood.unwrap() / closed - 1.0).abs() < 1e-9, "{found:?}");
        }
    }

    #[test]
    fn spots_conduct_alike_wherever_their_centres_lie_between_nodes() {
        // Two spots of 2 × 2 and 3 × 2 nodes, whose centres lie between nodes, at every offset from
        // the edges of the cell.
        let conductance = |offset: usize| {
            let inside = |node: usize| {
                let [i, j] = [node / 12, node % 12].map(|index| (index + offset) % 12);
                i < 2 && j < 2 || (5..8).contains(&i) && (6..8).contains(&j)
            };
            let pressure = |node| f64::from(u8::from(inside(node)));
            let pressures: Vec<f64> = (0..144).map(pressure).collect();
            let map = ContactMap::from_pressures([12; 2], &pressures);
            SpotConductance::new(square(12, 1.0), Boundary::Periodic).of_map(&map)
        };
        let spots = [(4.0, [0.5, 0.5]), (6.0, [6.0, 6.5])];
        let total: f64 = spots.iter().map(|(nodes, _)| (nodes / PI).sqrt() / 12.0).sum();
        let mut resistance = 0.5 / total;
        for (one, at) in spots {
            for (other, to) in spots {
                let share = |nodes: f64| (nodes / PI).sqrt() / 12.0 / total;
                let distance = [0, 1].map(|axis| (to[axis] - at[axis]) / 12.0);
                resistance += share(one) * share(other) * ewald([1.0; 2], distance);
            }
        }
        for offset in 0..12 {
            let found = conductance(offset).greenwood.unwrap();
            assert!((found * resistance - 1.0).abs() < 1e-11, "{offset}: {found} {resistance}");
        }
    }

    #[test]
    fn without_contact_nothing_is_conducted() {
        let map = discs(16, 0.0, &[], Boundary::Periodic);
        let found = SpotConductance::new(square(16, 1.0), Boundary::Periodic).of_map(&map);
        assert_eq!(found, ContactSpots { count: 0, mean_radius: None, greenwood: None });
    }
}
