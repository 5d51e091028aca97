//! Triplets of x, y and height that lie on a grid.

use crate::error::FormatError;
use crate::raster::checked_nodes;

/// Coordinates may miss their grid by this share of a step, as they do when they are written with
/// few digits.
const TOLERANCE: f64 = 0.1;
/// Coordinates that differ by less than this share of the largest distance of two that follow each
/// other are one.
const EQUAL: f64 = 0.01;
/// A grid of which less than this share was measured is none.
const LEAST_FILLED: f64 = 0.05;

/// The map that triplets make.
pub struct Grid {
    pub nodes: [usize; 2],
    /// Nodes × step, in the unit of the coordinates.
    pub sides: [f64; 2],
    /// x along the first axis; NaN where there is no triplet.
    pub heights: Vec<f64>,
}

/// Evenly spaced coordinates along one axis.
struct Axis {
    first: f64,
    step: f64,
    nodes: usize,
    /// How many coordinates there are, each counted once.
    different: usize,
}

/// Puts triplets, one behind the other, onto the grid that their coordinates span, in whatever
/// order they come.
///
/// # Errors
/// When there is no such grid, or two triplets lie on one node of it.
pub fn grid(triplets: &[f64]) -> Result<Grid, FormatError> {
    let (points, _) = triplets.as_chunks::<3>();
    let x = Axis::of("x", points.iter().map(|point| point[0]).collect())?;
    let y = Axis::of("y", points.iter().map(|point| point[1]).collect())?;
    if x.different.max(y.different) == points.len() {
        let count = points.len();
        let what = format!("{count} triplets along a line are a profile and no map");
        return Err(FormatError::unsupported(what));
    }
    let nodes = [x.nodes, y.nodes];
    let nodes = checked_nodes(nodes.map(|nodes| i64::try_from(nodes).unwrap_or(i64::MAX)))?;
    let count = nodes[0] * nodes[1];
    if (points.len() as f64) < LEAST_FILLED * count as f64 {
        return Err(FormatError::unsupported(format!(
            "{} triplets on no grid: one with their coordinates has {} × {} nodes",
            points.len(),
            nodes[0],
            nodes[1]
        )));
    }
    let mut heights = vec![f64::NAN; count];
    let mut is_taken = vec![false; count];
    for point in points {
        let (i, j) = (x.place("x", point[0])?, y.place("y", point[1])?);
        let node = i * nodes[1] + j;
        if is_taken[node] {
            let [x, y, _] = point;
            let what = format!("two triplets have x = {x}, y = {y}");
            return Err(FormatError::unsupported(what));
        }
        is_taken[node] = true;
        heights[node] = point[2];
    }
    Ok(Grid { nodes, sides: [x, y].map(|axis| axis.nodes as f64 * axis.step), heights })
}

impl Axis {
    /// The axis of these coordinates: from the number of different ones, or, where whole lines are
    /// missing, from the smallest distance between two.
    fn of(name: &str, mut coordinates: Vec<f64>) -> Result<Axis, FormatError> {
        if let Some(wrong) = coordinates.iter().find(|x| !x.is_finite()) {
            return Err(FormatError::value(name, wrong, "finite"));
        }
        coordinates.sort_by(f64::total_cmp);
        let (Some(&first), Some(&last)) = (coordinates.first(), coordinates.last()) else {
            return Err(FormatError::missing(name));
        };
        let range = last - first;
        let gaps = |coordinates: &[f64]| -> Vec<f64> {
            let pairs = coordinates.windows(2);
            pairs.map(|pair| pair[1] - pair[0]).collect()
        };
        let largest = gaps(&coordinates).into_iter().fold(0.0, f64::max);
        if largest == 0.0 || !range.is_finite() {
            let what = format!("all triplets have one {name}: a profile and no map");
            return Err(FormatError::unsupported(what));
        }
        coordinates.dedup_by(|x, before| *x - *before <= EQUAL * largest);
        let smallest = gaps(&coordinates).into_iter().fold(f64::INFINITY, f64::min);
        let different = coordinates.len();
        let whole = (range / smallest).round();
        let axes = [(different - 1) as f64, whole].map(|steps| Axis {
            first,
            step: range / steps,
            nodes: steps as usize + 1,
            different,
        });
        let fits = |axis: &Axis| coordinates.iter().all(|&x| axis.place(name, x).is_ok());
        axes.into_iter().find(fits).ok_or_else(|| {
            FormatError::unsupported(format!("the triplets' {name} are not evenly spaced"))
        })
    }

    /// The node at a coordinate.
    fn place(&self, name: &str, coordinate: f64) -> Result<usize, FormatError> {
        let steps = (coordinate - self.first) / self.step;
        let node = steps.round();
        match (steps - node).abs() <= TOLERANCE && node >= 0.0 && node < self.nodes as f64 {
            true => Ok(node as usize),
            false => Err(FormatError::value(name, coordinate, "on the grid")),
        }
    }
}
