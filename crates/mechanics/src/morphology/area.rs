//! Contact area and perimeter of a contact map, and corrections of the area for the mesh.

use std::f64::consts::{LN_2, PI};

use super::map::ContactMap;
use crate::grid::{Boundary, Grid};

/// Numbers of contact nodes, edge nodes and switches (cell edges between contact and gap) of a
/// contact map.
///
/// A *switch* is the common cell edge of two neighbouring nodes of which only one is in contact. On
/// a periodic map, all nodes have neighbours on all sides. On an isolated map, neighbours outside
/// the map are missing, and they do not make a contact node an edge node.
///
/// ```
/// use asperity_mechanics::grid::Grid;
/// use asperity_mechanics::morphology::area::ContactArea;
/// use asperity_mechanics::morphology::map::ContactMap;
///
/// // A square of 4 × 4 nodes in a cell of side 1: its perimeter is four times 4/16.
/// let grid = Grid::square(16, 1.0)?;
/// let in_square = |node: usize| (6..10).contains(&(node / 16)) && (2..6).contains(&(node % 16));
/// let pressures: Vec<f64> = (0..256).map(|node| f64::from(u8::from(in_square(node)))).collect();
/// let area = ContactArea::from_map(&ContactMap::from_pressures(grid.nodes(), &pressures));
/// assert_eq!(area.fraction(), 1.0 / 16.0);
/// assert_eq!(area.manhattan_perimeter(grid), 1.0);
/// assert_eq!([area.edge_nodes_4, area.interior_nodes], [12, 4]);
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ContactArea {
    /// Numbers of nodes along x and y.
    pub nodes: [usize; 2],
    /// Number of nodes in contact.
    pub contact_nodes: usize,
    /// Number of switches (cell edges between contact and gap) between nodes (i, j) and (i, j + 1).
    /// They have the length Δx.
    pub switches_along_rows: usize,
    /// Number of switches (cell edges between contact and gap) between nodes (i, j) and (i + 1, j).
    /// They have the length Δy.
    pub switches_along_columns: usize,
    /// Number of contact nodes with at least one of the 4 nearest neighbours out of contact.
    pub edge_nodes_4: usize,
    /// Number of contact nodes with at least one of the 8 nearest neighbours out of contact.
    pub edge_nodes_8: usize,
    /// Number of contact nodes with all 8 nearest neighbours in contact.
    pub interior_nodes: usize,
}

impl ContactArea {
    /// Counts the contact nodes, the edge nodes and the cell edges between contact and gap of a
    /// map.
    pub fn from_map(map: &ContactMap) -> Self {
        let nodes = map.nodes();
        let mut area = Self {
            nodes,
            contact_nodes: 0,
            switches_along_rows: 0,
            switches_along_columns: 0,
            edge_nodes_4: 0,
            edge_nodes_8: 0,
            interior_nodes: 0,
        };
        let (count, last) = (nodes[0], nodes[0] - 1);
        // On an isolated map, a boundary row counts as its own neighbour, which adds no switches.
        let (before, after): (usize, &dyn Fn(usize) -> usize) = match map.boundary() {
            Boundary::Periodic => (last, &|i| i % count),
            Boundary::Free => (0, &|i| i.min(last)),
        };
        let mut rows = [before, 0, after(1)].map(|i| Row::new(map, i));
        for i in 0..count {
            let [above, here, below] = &rows;
            area.add_row(above, here, below);
            rows.rotate_left(1);
            rows[2].read(map, after(i + 2));
        }
        area
    }

    /// Returns the numbers that [`CountedArea::corrected`] needs.
    pub fn counted(&self) -> CountedArea {
        CountedArea {
            nodes: self.nodes[0] * self.nodes[1],
            contact_nodes: self.contact_nodes,
            switches: self.switches(),
        }
    }

    /// Returns the fraction of the nodes in contact, without correction.
    pub fn fraction(&self) -> f64 {
        self.counted().fraction()
    }

    /// Returns the total number of switches (cell edges between contact and gap), along rows and
    /// along columns.
    pub fn switches(&self) -> usize {
        self.switches_along_rows + self.switches_along_columns
    }

    /// Returns the Manhattan perimeter S_d, the total length of all cell edges between contact and
    /// gap.
    ///
    /// The edge between neighbours in a row has the length Δx, the edge between neighbours in a
    /// column Δy.
    pub fn manhattan_perimeter(&self, grid: Grid) -> f64 {
        let [step_x, step_y] = grid.spacing();
        // On square cells this sum is an integer, so that the perimeter is exact.
        let steps_x = self.switches_along_rows as f64
            + self.switches_along_columns as f64 * (step_y / step_x);
        steps_x * grid.cell().size()[0] / self.nodes[0] as f64
    }

    /// Returns the perimeter π/4 S_d, with [`S_d`](Self::manhattan_perimeter). It is unbiased if
    /// all directions of edges are equally frequent.
    pub fn euclidean_perimeter(&self, grid: Grid) -> f64 {
        PI / 4.0 * self.manhattan_perimeter(grid)
    }

    fn add_row(&mut self, above: &Row, here: &Row, below: &Row) {
        for (word, &bits) in here.bits.iter().enumerate() {
            let [above_bits, below_bits] = [above.bits[word], below.bits[word]];
            let interior_4 = here.solid[word] & above_bits & below_bits;
            let interior_8 = here.solid[word] & above.solid[word] & below.solid[word];
            let count = |word: u64| word.count_ones() as usize;
            self.contact_nodes += count(bits);
            self.switches_along_rows += count(bits ^ here.next[word]);
            self.switches_along_columns += count(bits ^ below_bits);
            self.edge_nodes_4 += count(bits & !interior_4);
            self.edge_nodes_8 += count(bits & !interior_8);
            self.interior_nodes += count(interior_8);
        }
    }
}

/// Row of a map as bits, with 64 nodes per word. Outside an isolated map, the node at the edge is
/// repeated as its own neighbour.
struct Row {
    /// Bit j is set if node j is in contact.
    bits: Vec<u64>,
    /// Bit j is set if node j + 1 is in contact.
    next: Vec<u64>,
    /// Bit j is set if nodes j − 1, j and j + 1 are in contact.
    solid: Vec<u64>,
}

impl Row {
    fn new(map: &ContactMap, i: usize) -> Self {
        let empty = vec![0; map.row_words()];
        let mut row = Self { bits: empty.clone(), next: empty.clone(), solid: empty };
        row.read(map, i);
        row
    }

    fn read(&mut self, map: &ContactMap, i: usize) {
        let nodes = map.nodes()[1];
        map.copy_row(i, &mut self.bits);
        let last = (nodes - 1) % 64;
        let ends = [self.bits[0] & 1, self.bits[self.bits.len() - 1] >> last & 1];
        // In a periodic row, the first and the last node are neighbours. In an isolated row, each
        // counts as its own neighbour.
        let [mut previous, following_last] = match map.boundary() {
            Boundary::Periodic => [ends[1], ends[0]],
            Boundary::Free => ends,
        };
        for (word, &bits) in self.bits.iter().enumerate() {
            let following = self.bits.get(word + 1).copied().unwrap_or(0);
            self.next[word] = bits >> 1 | following << 63;
            self.solid[word] = bits & (bits << 1 | previous);
            previous = bits >> 63;
        }
        let end = self.next.len() - 1;
        self.next[end] |= following_last << last;
        for (solid, next) in self.solid.iter_mut().zip(&self.next) {
            *solid &= next;
        }
    }
}

/// Correction coefficient π/8, eq. (12) of Yastrebov, Anciaux & Molinari 2015.
///
/// With it, the corrected area is the mean of the areas with and without edge nodes. For solved
/// contacts, the correction is three to four times as large as the error.
pub const PI_OVER_EIGHT: f64 = PI / 8.0;

/// Correction coefficient (π − 1 + ln 2)/24 of Yastrebov, Anciaux & Molinari, Tribol. Int. 114
/// (2017) 161.
pub const YASTREBOV_2017: f64 = (PI - 1.0 + LN_2) / 24.0;

/// Returns S_d Δx/(L_x L_y) for square cells: the number of contact-gap cell edges per node.
///
/// The correction of the area fraction is this number multiplied by a coefficient.
pub fn edge_fraction(switches: usize, [nodes_x, nodes_y]: [usize; 2]) -> f64 {
    switches as f64 / (nodes_x as f64 * nodes_y as f64)
}

/// Numbers of nodes and switches from which the contact area is corrected for the mesh.
///
/// A contact node counts with its whole cell, although the edge of the contact crosses the cell.
/// The corrected fraction is a − c S_d Δx/(L_x L_y), with the uncorrected fraction a, the Manhattan
/// perimeter S_d and a coefficient c, for example [`YASTREBOV_2017`]. The coefficients are valid
/// for square cells.
///
/// The error of the area is mechanical: the mesh changes the solved contact. Counting nodes inside
/// a given curve has no bias, on cells of any aspect ratio. The error depends on the direction of
/// edges and therefore on the aspect ratio of cells. For Hertz contacts on a free half-space, with
/// radii of 4 to 20 nodes, the measured errors are:
///
/// | cells | error / (switches × cell area) | error / (S_d √(Δx Δy)) |
/// |---|---|---|
/// | Δy = Δx | 0.0896 ± 0.0016 | 0.091 |
/// | Δy = 2 Δx | 0.084 ± 0.002 | 0.090 |
/// | Δy = 4 Δx | 0.075 ± 0.003 | 0.095 |
///
/// These values do not hold for edges along one axis, and values for rough contacts are unknown.
/// The stage `correct` therefore rejects cells that are not square.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CountedArea {
    /// Number of nodes of the map.
    pub nodes: usize,
    /// Number of nodes in contact.
    pub contact_nodes: usize,
    /// Number of switches (cell edges between a contact and a gap node) along all rows and columns.
    pub switches: usize,
}

impl CountedArea {
    /// Returns the fraction of the nodes in contact, without correction.
    pub fn fraction(&self) -> f64 {
        self.contact_nodes as f64 / self.nodes as f64
    }

    /// Returns the corrected contact fraction a − c S_d Δx/(L_x L_y) with c = `coefficient`. It can
    /// be negative for contacts of few nodes.
    pub fn corrected(&self, coefficient: f64) -> f64 {
        self.fraction() - self.absolute_error(coefficient)
    }

    /// Returns a lower and an upper bound of the contact fraction.
    ///
    /// The upper bound a counts all contact nodes. The lower bound, max(a − π/4 S_d Δx/(L_x L_y),
    /// 0), omits the edge nodes. If it is positive, the mean of both bounds is the fraction
    /// corrected with [`PI_OVER_EIGHT`].
    pub fn bounds(&self) -> [f64; 2] {
        let edge = self.absolute_error(PI / 4.0);
        [(self.fraction() - edge).max(0.0), self.fraction()]
    }

    /// Returns the correction c S_d Δx/(L_x L_y) with c = `coefficient`, as a fraction of the
    /// nominal area.
    pub fn absolute_error(&self, coefficient: f64) -> f64 {
        coefficient * self.switches as f64 / self.nodes as f64
    }

    /// Returns the correction of [`absolute_error`](Self::absolute_error) divided by the
    /// uncorrected contact fraction, or `None` without contact.
    pub fn relative_error(&self, coefficient: f64) -> Option<f64> {
        (self.contact_nodes > 0).then(|| self.absolute_error(coefficient) / self.fraction())
    }
}

#[cfg(test)]
mod tests {
    use super::{ContactArea, PI_OVER_EIGHT, YASTREBOV_2017, *};
    use crate::grid::samples as grids;
    use crate::grid::samples::rectangle;
    use crate::morphology::map::samples::{MESHES, map, random, square};

    fn count(nodes: usize, contact: impl Fn(usize, usize) -> bool) -> ContactArea {
        ContactArea::from_map(&square(nodes, contact))
    }

    /// Counts node by node, as the documentation of the fields defines them.
    fn count_slowly(map: &ContactMap) -> ContactArea {
        let [rows, row_nodes] = map.nodes();
        // Indices are shifted by one so that they are not negative.
        let inside = |index: usize, nodes: usize| match map.boundary() {
            Boundary::Periodic => (index + nodes - 1) % nodes,
            Boundary::Free => index.saturating_sub(1).min(nodes - 1),
        };
        let at = |i: usize, j: usize| map.get(inside(i, rows), inside(j, row_nodes));
        let all: Vec<_> =
            (0..rows).flat_map(|i| (0..row_nodes).map(move |j| (i + 1, j + 1))).collect();
        let among =
            |test: &dyn Fn(usize, usize) -> bool| all.iter().filter(|(i, j)| test(*i, *j)).count();
        let nearest = [(0, 1), (2, 1), (1, 0), (1, 2)];
        let diagonal = [(0, 0), (0, 2), (2, 0), (2, 2)];
        let touch = |i: usize, j: usize, around: &[(usize, usize)]| {
            let mut around = around.iter();
            around.all(|(down, right)| at(i + down - 1, j + right - 1))
        };
        let interior = among(&|i, j| at(i, j) && touch(i, j, &nearest) && touch(i, j, &diagonal));
        ContactArea {
            nodes: map.nodes(),
            contact_nodes: among(&at),
            switches_along_rows: among(&|i, j| at(i, j) != at(i, j + 1)),
            switches_along_columns: among(&|i, j| at(i, j) != at(i + 1, j)),
            edge_nodes_4: among(&|i, j| at(i, j) && !touch(i, j, &nearest)),
            edge_nodes_8: among(&at) - interior,
            interior_nodes: interior,
        }
    }

    #[test]
    fn counts_by_words_and_by_nodes_are_equal() {
        for nodes in MESHES {
            for share in [0.1, 0.5, 0.9, 1.0] {
                for boundary in [Boundary::Periodic, Boundary::Free] {
                    let map = random(nodes, share).with_boundary(boundary);
                    assert_eq!(
                        ContactArea::from_map(&map),
                        count_slowly(&map),
                        "{nodes:?} {share} {boundary:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn edges_of_an_isolated_map_are_not_edges_of_contact() {
        // A corner of 4 × 3 nodes: two of its sides are edges of the map.
        let corner = map([10, 8], |i, j| i < 4 && j < 3);
        let area = ContactArea::from_map(&corner.clone().with_boundary(Boundary::Free));
        assert_eq!(area.switches_along_rows, 4);
        assert_eq!(area.switches_along_columns, 3);
        assert_eq!([area.edge_nodes_4, area.interior_nodes], [6, 6]);
        assert_eq!(ContactArea::from_map(&corner).switches(), 2 * (4 + 3));
        let full = ContactArea::from_map(&map([10, 8], |_, _| true).with_boundary(Boundary::Free));
        assert_eq!([full.switches(), full.interior_nodes], [0, 80]);
    }

    #[test]
    fn perimeter_of_a_rectangle_is_the_sum_of_its_sides() {
        // One rectangle in the middle, one across a corner of the cell.
        for (first, second) in [(20, 30), (95, 90)] {
            let within =
                |start: usize, length: usize, index: usize| (index + 100 - start) % 100 < length;
            let area = count(100, |i, j| within(first, 7, i) && within(second, 20, j));
            assert_eq!(area.contact_nodes, 140);
            assert_eq!(area.switches_along_rows, 2 * 7);
            assert_eq!(area.switches_along_columns, 2 * 20);
            assert!((area.manhattan_perimeter(grids::square(100, 2.0)) - 2.0 * 0.54).abs() < 1e-15);
            assert_eq!(area.interior_nodes, 5 * 18);
            assert_eq!(area.edge_nodes_4, 140 - 90);
            assert_eq!(area.edge_nodes_8, 140 - 90);
        }
    }

    #[test]
    fn perimeter_counts_edges_by_their_own_length() {
        // 4 × 3 nodes; Δy = 2 Δx.
        let grid = grids::rectangle([20, 10], [2.0, 2.0]);
        let contact = map([20, 10], |i, j| i < 4 && j < 3);
        let area = ContactArea::from_map(&contact);
        assert_eq!((area.switches_along_rows, area.switches_along_columns), (8, 6));
        let [along_x, along_y] = [4.0 * 0.1, 3.0 * 0.2];
        let perimeter = area.manhattan_perimeter(grid);
        assert!((perimeter - 2.0 * (along_x + along_y)).abs() < 1e-15);
    }

    #[test]
    fn manhattan_perimeter_of_a_disc_is_four_over_pi_times_its_circumference() {
        let radius = 20.5;
        let area = count(64, |i, j| (i as f64 - 32.0).hypot(j as f64 - 32.0) < radius);
        // 41 rows and 41 columns intersect the disc, with two switches each.
        assert_eq!(area.switches(), 4 * 41);
        let circumference = 2.0 * PI * radius / 64.0;
        let ratio = area.manhattan_perimeter(grids::square(64, 1.0)) / circumference;
        assert!((ratio - 4.0 / PI).abs() < 1e-14);
        assert!(
            (area.euclidean_perimeter(grids::square(64, 1.0)) / circumference - 1.0).abs() < 1e-14
        );
        // With π/8, the correction relative to the area of a disc is Δx/radius. The disc has 1320
        // nodes, up to a few.
        let error = area.counted().relative_error(PI_OVER_EIGHT).unwrap();
        assert!((error * radius - 1.0).abs() < 0.01);
        // Per unit length, an edge in direction θ has |cos θ| + |sin θ| switches, but only
        // max(|cos θ|, |sin θ|) edge nodes: on average √2/2 per switch.
        let share = area.edge_nodes_4 as f64 / area.switches() as f64;
        assert!((share - 0.5_f64.sqrt()).abs() < 0.03);
    }

    #[test]
    fn every_node_of_a_checkerboard_is_an_edge_on_four_sides() {
        let area = count(64, |i, j| (i + j) % 2 == 0);
        assert_eq!(area.contact_nodes, 64 * 32);
        assert_eq!(area.switches(), 2 * 64 * 64);
        assert_eq!([area.edge_nodes_4, area.edge_nodes_8], [64 * 32; 2]);
    }

    #[test]
    fn stripes_switch_across_and_not_along() {
        let area = count(100, |i, _| i % 20 < 5);
        assert_eq!(area.switches_along_rows, 0);
        assert_eq!(area.switches_along_columns, 2 * 5 * 100);
        assert_eq!(area.interior_nodes, 5 * 3 * 100);
    }

    #[test]
    fn a_single_node_has_four_sides_and_no_lower_bound() {
        let area = count(10, |i, j| (i, j) == (0, 9));
        assert_eq!((area.contact_nodes, area.switches()), (1, 4));
        assert_eq!(area.edge_nodes_4, 1);
        // If it could be negative, the lower bound would be 1 − π nodes.
        assert_eq!(area.counted().bounds(), [0.0, 0.01]);
        assert!(area.counted().corrected(PI_OVER_EIGHT) < 0.0);
        assert!(area.counted().corrected(YASTREBOV_2017) > 0.0);
    }

    const SEMI_AXES: [f64; 2] = [0.3, 0.16];

    /// Returns means over ellipses in all directions, on a grid of 240 × `nodes_y` nodes.
    ///
    /// The entries are π/4 S_d, the counted area, and the number of switches multiplied by the area
    /// of a cell.
    fn mean_over_ellipses(nodes_y: usize) -> [f64; 3] {
        const DIRECTIONS: u32 = 48;
        let nodes = [240, nodes_y];
        let grid = rectangle(nodes, [1.0, 1.0]);
        let node = 1.0 / grid.count() as f64;
        let [step_x, step_y] = grid.spacing();
        let mut sums = [0.0; 3];
        for direction in 0..DIRECTIONS {
            let (sine, cosine) = (PI * f64::from(direction) / f64::from(DIRECTIONS)).sin_cos();
            // The centres are quasi-random within one cell of the grid.
            let shift = |golden: f64| (golden * f64::from(direction + 1)).fract();
            let centre = [0.5 + step_x * shift(0.618_034), 0.5 + step_y * shift(0.414_214)];
            let contact = map(nodes, |i, j| {
                let [x, y] = [i as f64 * step_x - centre[0], j as f64 * step_y - centre[1]];
                let [along, across] = [cosine * x + sine * y, cosine * y - sine * x];
                (along / SEMI_AXES[0]).hypot(across / SEMI_AXES[1]) < 1.0
            });
            let area = ContactArea::from_map(&contact);
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
        // Ramanujan 1914: the relative error is at most 3e-5, and 1e-7 at this eccentricity.
        let [a, b] = SEMI_AXES;
        let h = ((a - b) / (a + b)).powi(2);
        let circumference = PI * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
        for nodes_y in [240, 120, 60] {
            let [perimeter, _, _] = mean_over_ellipses(nodes_y);
            // The numbers of rows and columns are integers, which causes errors of 0.4 in 60 that
            // are averaged over 48 directions.
            let error = perimeter / circumference - 1.0;
            assert!(error.abs() < 1e-3, "{nodes_y}: {error}");
        }
    }

    #[test]
    fn counting_nodes_inside_a_curve_has_no_bias_on_cells_of_any_aspect_ratio() {
        for nodes_y in [240, 120, 60] {
            let [_, area, switches] = mean_over_ellipses(nodes_y);
            let excess = (area - PI * SEMI_AXES[0] * SEMI_AXES[1]) / switches;
            // The tolerance is a fortieth of the smallest correction coefficient.
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
