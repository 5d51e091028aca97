//! From the counted area to the true one: estimators that a discrete map allows.

use std::f64::consts::{LN_2, PI};

/// The coefficient π/8 of eq. (corrected_area) of Yastrebov, Anciaux & Molinari 2015: half way
/// between counting edge nodes and not counting them. It takes away three to four times the error
/// of solved contacts.
pub const PI_OVER_EIGHT: f64 = PI / 8.0;

/// The coefficient (π − 1 + ln 2)/24 of Yastrebov, Anciaux & Molinari, Tribol. Int. 114 (2017) 161.
pub const YASTREBOV_2017: f64 = (PI - 1.0 + LN_2) / 24.0;

/// S_d Δx/(L_x L_y), what a coefficient is multiplied with: a cell for each change between contact and
/// non-contact, as a fraction of all. Cells are square.
pub fn edge_fraction(switches: usize, [nodes_x, nodes_y]: [usize; 2]) -> f64 {
    switches as f64 / (nodes_x as f64 * nodes_y as f64)
}

/// What corrections of the area are made of.
///
/// A node counts as in contact with its whole cell, although the true edge crosses that cell. A
/// corrected fraction is a − c S_d Δx/(L_x L_y), where S_d is the Manhattan perimeter and c a
/// coefficient. Coefficients are those of square cells.
///
/// What a mesh adds is mechanical: counting the nodes within an edge is right on cells of any shape. It
/// depends on the directions of edges, and so on the shape of cells. Of Hertzian contacts on a free
/// half-space, 4 to 20 nodes in radius, it is 0.0896 ± 0.0016 switches × cells on square cells,
/// 0.084 ± 0.002 where Δy = 2 Δx, and 0.075 ± 0.003 where Δy = 4 Δx; as S_d √(Δx Δy) it is 0.091, 0.090
/// and 0.095. For edges that run along one axis neither holds, and nothing is known of rough contacts:
/// the `correct` stage refuses cells that are not square.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CountedArea {
    /// Nodes of the map.
    pub nodes: usize,
    /// Nodes in contact.
    pub contact_nodes: usize,
    /// Changes between contact and non-contact along all rows and columns.
    pub switches: usize,
}

impl CountedArea {
    /// Fraction a of the nodes in contact, as counted.
    pub fn fraction(&self) -> f64 {
        self.contact_nodes as f64 / self.nodes as f64
    }

    /// Corrected fraction of the area; negative where contact is little but perimeter.
    pub fn corrected(&self, coefficient: f64) -> f64 {
        self.fraction() - self.absolute_error(coefficient)
    }

    /// Lower and upper bound of the fraction: without the nodes on the edge, π/4 S_d Δx in area, but
    /// not below 0, and with them. Where the lower one is above 0, π/8 is half way between them.
    pub fn bounds(&self) -> [f64; 2] {
        let edge = self.absolute_error(PI / 4.0);
        [(self.fraction() - edge).max(0.0), self.fraction()]
    }

    /// What a correction takes away, as a fraction of the cell: c S_d Δx/(L_x L_y).
    pub fn absolute_error(&self, coefficient: f64) -> f64 {
        coefficient * self.switches as f64 / self.nodes as f64
    }

    /// What a correction takes away, as a fraction of the contact area; none without contact.
    pub fn relative_error(&self, coefficient: f64) -> Option<f64> {
        (self.contact_nodes > 0).then(|| self.absolute_error(coefficient) / self.fraction())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::rectangle;
    use crate::morphology::area::ContactArea;
    use crate::morphology::map::samples::map;

    /// Semi-axes of the ellipses below.
    const AXES: [f64; 2] = [0.3, 0.16];

    /// Means over ellipses in all directions on the same cell of 240 × `nodes_y` nodes: π/4 S_d, the
    /// counted area, and switches times the area of a node.
    fn mean_over_ellipses(nodes_y: usize) -> [f64; 3] {
        const DIRECTIONS: u32 = 48;
        let nodes = [240, nodes_y];
        let grid = rectangle(nodes, [1.0, 1.0]);
        let node = 1.0 / grid.count() as f64;
        let [step_x, step_y] = grid.spacing();
        let mut sums = [0.0; 3];
        for direction in 0..DIRECTIONS {
            let (sine, cosine) = (PI * f64::from(direction) / f64::from(DIRECTIONS)).sin_cos();
            // Centres anywhere within a node.
            let shift = |golden: f64| (golden * f64::from(direction + 1)).fract();
            let centre = [0.5 + step_x * shift(0.618_034), 0.5 + step_y * shift(0.414_214)];
            let contact = map(nodes, |i, j| {
                let [x, y] = [i as f64 * step_x - centre[0], j as f64 * step_y - centre[1]];
                let [along, across] = [cosine * x + sine * y, cosine * y - sine * x];
                (along / AXES[0]).hypot(across / AXES[1]) < 1.0
            });
            let area = ContactArea::of(&contact);
            let found =
                [area.euclidean_perimeter(grid), area.fraction(), area.switches() as f64 * node];
            for (sum, value) in sums.iter_mut().zip(found) {
                *sum += value / f64::from(DIRECTIONS);
            }
        }
        sums
    }

    #[test]
    fn on_cells_of_any_shape_perimeters_are_those_of_cauchy_and_crofton() {
        // Ramanujan 1914: 3e-5 of the circumference at most, at this eccentricity 1e-7.
        let [a, b] = AXES;
        let h = ((a - b) / (a + b)).powi(2);
        let circumference = PI * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
        for nodes_y in [240, 120, 60] {
            let [perimeter, _, _] = mean_over_ellipses(nodes_y);
            // Rows and columns that meet an ellipse are whole numbers: 0.4 of one of 60, 48 times.
            let error = perimeter / circumference - 1.0;
            assert!(error.abs() < 1e-3, "{nodes_y}: {error}");
        }
    }

    #[test]
    fn on_cells_of_any_shape_counting_nodes_within_an_edge_leaves_nothing_to_correct() {
        for nodes_y in [240, 120, 60] {
            let [_, area, switches] = mean_over_ellipses(nodes_y);
            let excess = (area - PI * AXES[0] * AXES[1]) / switches;
            // A fortieth of the smallest coefficient.
            assert!(excess.abs() < 0.003, "{nodes_y}: {excess}");
        }
    }

    fn counted(contact_nodes: usize, switches: usize) -> CountedArea {
        CountedArea { nodes: 64 * 64, contact_nodes, switches }
    }

    #[test]
    fn corrections_vanish_at_full_contact_and_without_contact() {
        for (contact_nodes, share, error) in [(4096, 1.0, Some(0.0)), (0, 0.0, None)] {
            let area = counted(contact_nodes, 0);
            assert_eq!(area.bounds(), [share; 2]);
            assert_eq!(area.corrected(PI_OVER_EIGHT), share);
            assert_eq!(area.relative_error(YASTREBOV_2017), error);
        }
    }

    #[test]
    fn corrections_are_ordered_and_the_first_one_halves_the_bounds() {
        let area = counted(480, 88);
        assert_eq!(area.corrected(0.0), area.fraction());
        let [lower, upper] = area.bounds();
        let middle = area.corrected(PI_OVER_EIGHT);
        assert!((middle - (lower + upper) / 2.0).abs() < 1e-15);
        assert!(middle < area.corrected(YASTREBOV_2017));
        let removed = 0.1 * 88.0 / 4096.0;
        assert!((area.fraction() - area.corrected(0.1) - removed).abs() < 1e-15);
    }

    #[test]
    fn the_coefficient_of_2017_is_the_published_one() {
        assert!((YASTREBOV_2017 - 0.11811416).abs() < 5e-9);
    }
}
