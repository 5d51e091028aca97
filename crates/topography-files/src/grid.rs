//! Maps assembled from points x, y and height that lie on a grid.

use super::FormatError;
use super::raster::checked_nodes;

/// Maximum distance of a coordinate from its node, in steps. Coordinates in files may be rounded.
const TOLERANCE: f64 = 0.1;
/// Maximum gap between coordinates that are considered equal, as a fraction of the largest gap.
const EQUAL: f64 = 0.01;
/// Minimum fraction of the grid points that must have a triplet.
const MIN_FILLED: f64 = 0.05;

/// Map assembled from triplets of x, y and height.
pub(crate) struct Grid {
    pub(crate) nodes: [usize; 2],
    /// Sides (nodes × step) in the unit of the coordinates.
    pub(crate) sides: [f64; 2],
    /// Heights with x along the first axis; NaN at nodes without a triplet.
    pub(crate) heights: Vec<f64>,
}

/// Evenly spaced coordinates along one axis.
struct Axis {
    first: f64,
    step: f64,
    nodes: usize,
    /// Number of different coordinates among the triplets.
    different: usize,
}

impl Grid {
    /// Assembles a map from triplets in any order. `triplets` has x, y and height of the first
    /// triplet, then of the second, and so on.
    ///
    /// # Errors
    /// Returns an error if the triplets do not lie on a grid, or if two of them lie on the same
    /// node.
    pub(crate) fn from_triplets(triplets: &[f64]) -> Result<Grid, FormatError> {
        let (points, _) = triplets.as_chunks::<3>();
        let x = Axis::from_coordinates("x", points.iter().map(|point| point[0]).collect())?;
        let y = Axis::from_coordinates("y", points.iter().map(|point| point[1]).collect())?;
        if x.different.max(y.different) == points.len() {
            let count = points.len();
            let what = format!("{count} triplets along a line are a profile, not a map");
            return Err(FormatError::unsupported(what));
        }
        let nodes = checked_nodes([x.nodes, y.nodes])?;
        let count = nodes[0] * nodes[1];
        if (points.len() as f64) < MIN_FILLED * count as f64 {
            return Err(FormatError::unsupported(format!(
                "the {} triplets do not lie on a grid: a grid through them has {} × {} nodes",
                points.len(),
                nodes[0],
                nodes[1]
            )));
        }
        let mut heights = vec![f64::NAN; count];
        let mut is_taken = vec![false; count];
        for point in points {
            let (i, j) = (x.index_of("x", point[0])?, y.index_of("y", point[1])?);
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
}

impl Axis {
    /// Finds an evenly spaced axis that contains the given coordinates.
    ///
    /// The step is the range divided by the number of different coordinates minus one. If the
    /// coordinates do not fit this step because whole lines are missing, the step is about the
    /// smallest gap.
    fn from_coordinates(name: &str, mut coordinates: Vec<f64>) -> Result<Axis, FormatError> {
        if let Some(wrong) = coordinates.iter().find(|x| !x.is_finite()) {
            return Err(FormatError::value(name, wrong, "a finite number"));
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
            let what = format!("all triplets have the same {name}: they are a profile, not a map");
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
        let fits = |axis: &Axis| coordinates.iter().all(|&x| axis.index_of(name, x).is_ok());
        axes.into_iter().find(fits).ok_or_else(|| {
            let what = format!("the {name} coordinates of the triplets are not evenly spaced");
            FormatError::unsupported(what)
        })
    }

    /// Returns the index of the node at a coordinate, or an error if there is no node.
    fn index_of(&self, name: &str, coordinate: f64) -> Result<usize, FormatError> {
        let steps = (coordinate - self.first) / self.step;
        let node = steps.round();
        if (steps - node).abs() <= TOLERANCE && node >= 0.0 && node < self.nodes as f64 {
            Ok(node as usize)
        } else {
            Err(FormatError::value(name, coordinate, "a node of the grid"))
        }
    }
}
