//! Conductances between neighbouring nodes of a periodic map of gaps.

use crate::grid::Grid;

/// The links of each node to the next one along x, and to the next one along y.
pub struct Links {
    nodes: [usize; 2],
    /// By axis, and by the node that a link leaves.
    conductances: [Vec<f64>; 2],
    /// By axis: links that leave a node of this place along it cross the seam, where the next period of
    /// the pressure begins.
    seams: [usize; 2],
}

/// A link that conducts.
#[derive(Debug, Clone, Copy)]
pub struct Link {
    pub axis: usize,
    pub from: usize,
    pub to: usize,
    pub conductance: f64,
    /// Whether the pressure of the next period begins on the way.
    pub crosses_seam: bool,
}

impl Links {
    /// Those of a map of gaps, in such a unit: none to where the gap is not positive.
    pub fn between(grid: Grid, gap: &[f64], unit: f64) -> Links {
        let cubed = |gap: &f64| (gap.max(0.0) / unit).powi(3);
        let cubed: Vec<f64> = gap.iter().map(cubed).collect();
        let [step_x, step_y] = grid.spacing();
        let mut links =
            Links { nodes: grid.nodes(), conductances: [Vec::new(), Vec::new()], seams: [0; 2] };
        for (axis, aspect) in [step_y / step_x, step_x / step_y].into_iter().enumerate() {
            let conductance =
                |node| aspect * harmonic_mean(cubed[node], cubed[links.next(node, axis)]);
            links.conductances[axis] = (0..cubed.len()).map(conductance).collect();
            links.seams[axis] = links.least_conducting_section(axis);
        }
        links
    }

    /// Nodes of the mesh.
    pub fn count(&self) -> usize {
        self.nodes[0] * self.nodes[1]
    }

    /// Every link that conducts, row by row.
    pub fn each(&self) -> impl Iterator<Item = Link> {
        let [rows, row_nodes] = self.nodes;
        let places = (0..rows).flat_map(move |i| (0..row_nodes).map(move |j| [i, j]));
        let links = places.enumerate().flat_map(|(from, place)| {
            [1, 0].map(|axis| Link {
                axis,
                from,
                to: self.beyond(from, place, axis),
                conductance: self.conductances[axis][from],
                crosses_seam: place[axis] == self.seams[axis],
            })
        });
        links.filter(|link| link.conductance > 0.0)
    }

    /// The link that leaves a node along an axis, whether it conducts or not.
    pub fn leaving(&self, from: usize, axis: usize) -> Link {
        let place = self.place(from);
        Link {
            axis,
            from,
            to: self.beyond(from, place, axis),
            conductance: self.conductances[axis][from],
            crosses_seam: place[axis] == self.seams[axis],
        }
    }

    /// The link that reaches a node along an axis.
    pub fn reaching(&self, to: usize, axis: usize) -> Link {
        let [rows, row_nodes] = self.nodes;
        let place = self.place(to);
        let from = match (axis, place[axis]) {
            (0, 0) => to + (rows - 1) * row_nodes,
            (0, _) => to - row_nodes,
            (_, 0) => to + row_nodes - 1,
            _ => to - 1,
        };
        self.leaving(from, axis)
    }

    fn next(&self, node: usize, axis: usize) -> usize {
        self.beyond(node, self.place(node), axis)
    }

    fn beyond(&self, node: usize, place: [usize; 2], axis: usize) -> usize {
        let [rows, row_nodes] = self.nodes;
        let is_last = place[axis] + 1 == self.nodes[axis];
        match (axis, is_last) {
            (0, false) => node + row_nodes,
            (0, true) => node - (rows - 1) * row_nodes,
            (_, false) => node + 1,
            (_, true) => node + 1 - row_nodes,
        }
    }

    fn place(&self, node: usize) -> [usize; 2] {
        [node / self.nodes[1], node % self.nodes[1]]
    }

    /// Where the links along an axis conduct least, taken together. Any section might be the seam; with
    /// this one rounding takes least from pressures that fall over a single constriction.
    fn least_conducting_section(&self, axis: usize) -> usize {
        let mut sums = vec![0.0; self.nodes[axis]];
        for (node, conductance) in self.conductances[axis].iter().enumerate() {
            sums[self.place(node)[axis]] += conductance;
        }
        let sums = sums.iter().enumerate();
        let least = sums.min_by(|one, other| one.1.total_cmp(other.1));
        least.expect("there is a node").0
    }
}

/// Twice the conductance of two in series.
fn harmonic_mean(one: f64, other: f64) -> f64 {
    match one > 0.0 && other > 0.0 {
        true => 2.0 / (1.0 / one + 1.0 / other),
        false => 0.0,
    }
}
