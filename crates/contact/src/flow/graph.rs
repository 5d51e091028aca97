//! A graph of resistors and its matrix: the currents that leave the nodes under given potentials.
//!
//! One node of each channel is linked to the ground, of potential zero, so that the matrix is regular: no
//! current flows there once those that are given sum to zero. Potentials and currents are pairs, one of
//! the flow along x and one of that along y: both are found at once, since the matrix is what takes time.

/// One number of the flow along x, and one of that along y.
pub type Pair = [f64; 2];

/// Nodes and the conductances between them; each link is kept by the lower number of its ends.
pub struct Graph {
    /// Where the links of each node begin, and last where all end.
    starts: Vec<u32>,
    /// The higher number of each link.
    others: Vec<u32>,
    conductances: Vec<f64>,
    /// Nodes that are linked to the ground, and how well.
    grounds: Vec<(u32, f64)>,
    /// One over the sum of a node's conductances; zero of a node without links.
    inverse_diagonal: Vec<f64>,
}

impl Graph {
    /// So many nodes, their links to the ground, and those between them, which are told twice alike; links
    /// of a node to itself carry nothing that its potential decides, and are left out.
    pub fn of<I>(count: usize, grounds: Vec<(u32, f64)>, links: impl Fn() -> I) -> Graph
    where
        I: Iterator<Item = (u32, u32, f64)>,
    {
        let links = || links().filter(|(one, other, _)| one != other);
        let mut starts = vec![0_u32; count + 1];
        let mut diagonal = vec![0.0; count];
        for &(node, conductance) in &grounds {
            diagonal[node as usize] += conductance;
        }
        for (one, other, conductance) in links() {
            starts[one.min(other) as usize + 1] += 1;
            diagonal[one as usize] += conductance;
            diagonal[other as usize] += conductance;
        }
        for node in 0..count {
            starts[node + 1] += starts[node];
        }
        let all = starts[count] as usize;
        let (mut others, mut conductances) = (vec![0; all], vec![0.0; all]);
        let mut filled = starts.clone();
        for (one, other, conductance) in links() {
            let place = &mut filled[one.min(other) as usize];
            others[*place as usize] = one.max(other);
            conductances[*place as usize] = conductance;
            *place += 1;
        }
        let inverse = |sum: f64| if sum > 0.0 { 1.0 / sum } else { 0.0 };
        Graph {
            starts,
            others,
            conductances,
            grounds,
            inverse_diagonal: diagonal.into_iter().map(inverse).collect(),
        }
    }

    /// How many nodes there are.
    pub fn count(&self) -> usize {
        self.inverse_diagonal.len()
    }

    /// The links of a node to those of higher numbers.
    pub fn above(&self, node: usize) -> impl Iterator<Item = (usize, f64)> {
        let [start, end] = [node, node + 1].map(|node| self.starts[node] as usize);
        let others = self.others[start..end].iter().map(|other| *other as usize);
        others.zip(self.conductances[start..end].iter().copied())
    }

    /// The sum of the conductances of each node, zero where there is none.
    pub fn diagonal(&self) -> impl Iterator<Item = f64> {
        let inverse = self.inverse_diagonal.iter();
        inverse.map(|&inverse| if inverse > 0.0 { 1.0 / inverse } else { 0.0 })
    }

    /// Links to the ground, by the node.
    pub fn grounds(&self) -> &[(u32, f64)] {
        &self.grounds
    }

    /// Every link: both ends, the lower one first, and its conductance.
    pub fn links(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        (0..self.count()).flat_map(|node| {
            let above = self.above(node);
            above.map(move |(other, conductance)| (node, other, conductance))
        })
    }

    /// The currents that leave the nodes under these potentials.
    pub fn currents(&self, potentials: &[Pair], currents: &mut [Pair]) {
        currents.fill([0.0; 2]);
        self.take_off(potentials, currents);
        for current in currents {
            *current = current.map(|current| -current);
        }
    }

    /// Takes those currents off others.
    pub fn take_off(&self, potentials: &[Pair], left: &mut [Pair]) {
        for node in 0..self.count() {
            let [x, y] = potentials[node];
            let mut own = left[node];
            for (other, conductance) in self.above(node) {
                let current = [
                    conductance * (x - potentials[other][0]),
                    conductance * (y - potentials[other][1]),
                ];
                own = [own[0] - current[0], own[1] - current[1]];
                let left = &mut left[other];
                *left = [left[0] + current[0], left[1] + current[1]];
            }
            left[node] = own;
        }
        for &(node, conductance) in &self.grounds {
            let node = node as usize;
            left[node] = [0, 1].map(|of| left[node][of] - conductance * potentials[node][of]);
        }
    }

    /// Solves for the lower triangle of the matrix: potentials after one sweep of Gauss and Seidel, from
    /// none. `work` is overwritten.
    pub fn sweep_up(&self, currents: &[Pair], work: &mut [Pair], potentials: &mut [Pair]) {
        work.copy_from_slice(currents);
        for node in 0..self.count() {
            let potential = work[node].map(|current| current * self.inverse_diagonal[node]);
            potentials[node] = potential;
            for (other, conductance) in self.above(node) {
                let work = &mut work[other];
                *work = [0, 1].map(|of| work[of] + conductance * potential[of]);
            }
        }
    }

    /// What [`Graph::sweep_up`] leaves at a node of the currents that it was given.
    pub fn left_by_sweep(&self, node: usize, potentials: &[Pair]) -> Pair {
        self.with_inflow(node, [0.0; 2], potentials)
    }

    /// Adds to the potentials what the upper triangle of the matrix makes of the currents that are left,
    /// which are overwritten: the same sweep downwards.
    pub fn sweep_down(&self, left: &mut [Pair], potentials: &mut [Pair]) {
        for node in (0..self.count()).rev() {
            let inflow = self.with_inflow(node, left[node], left);
            let change = inflow.map(|current| current * self.inverse_diagonal[node]);
            left[node] = change;
            let potential = &mut potentials[node];
            *potential = [0, 1].map(|of| potential[of] + change[of]);
        }
    }

    /// So much current, and what the potentials of the nodes above send to a node.
    fn with_inflow(&self, node: usize, so_much: Pair, potentials: &[Pair]) -> Pair {
        self.above(node).fold(so_much, |sum, (other, conductance)| {
            [0, 1].map(|of| sum[of] + conductance * potentials[other][of])
        })
    }
}
