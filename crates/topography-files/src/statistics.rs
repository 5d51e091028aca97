//! What a map is like, before anything is done to it.

use super::channel::HeightMap;

/// Numbers of a map over its points that are not missing, in the unit of its heights.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistics {
    /// Points that are missing.
    pub missing: usize,
    /// The rest, if there is any.
    pub heights: Option<HeightStatistics>,
    /// The corners of the map; none where it is missing.
    pub corners: Corners,
}

/// Numbers of heights, of which there is at least one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeightStatistics {
    /// Standard deviation of the heights.
    pub rms_height: f64,
    /// Root of ⟨(Δh/Δx)²⟩ + ⟨(Δh/Δy)²⟩, from each node that has a next one along both axes to either.
    /// Slopes from or to missing points do not count. None when the size is unknown or in another unit
    /// than the heights, or no two points are neighbours along an axis.
    pub rms_slope: Option<f64>,
    /// The lowest height.
    pub lowest: f64,
    /// The highest height.
    pub highest: f64,
}

/// Heights at the corners of a map, by which axes that were taken for each other are seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corners {
    /// First x, first y.
    pub first: Option<f64>,
    /// Last x, first y.
    pub x_end: Option<f64>,
    /// First x, last y.
    pub y_end: Option<f64>,
    /// Last x, last y.
    pub last: Option<f64>,
}

impl Statistics {
    /// Those of a map.
    pub fn of(map: &HeightMap) -> Statistics {
        let [end_x, end_y] = map.nodes().map(|nodes| nodes - 1);
        Statistics {
            missing: map.missing().iter().filter(|missing| **missing).count(),
            heights: HeightStatistics::of(map),
            corners: Corners {
                first: map.get(0, 0),
                x_end: map.get(end_x, 0),
                y_end: map.get(0, end_y),
                last: map.get(end_x, end_y),
            },
        }
    }
}

impl HeightStatistics {
    fn of(map: &HeightMap) -> Option<HeightStatistics> {
        let valid = || map.heights().iter().copied().filter(|h| !h.is_nan());
        let mean = mean(valid())?;
        let square = |height: f64| (height - mean) * (height - mean);
        let variance = self::mean(valid().map(square))?;
        Some(HeightStatistics {
            rms_height: variance.sqrt(),
            rms_slope: rms_slope(map),
            lowest: valid().fold(f64::INFINITY, f64::min),
            highest: valid().fold(f64::NEG_INFINITY, f64::max),
        })
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.fold((0_usize, 0.0), |(count, sum), value| (count + 1, sum + value));
    (count > 0).then(|| sum / count as f64)
}

fn rms_slope(map: &HeightMap) -> Option<f64> {
    let [nodes_x, nodes_y] = map.nodes();
    let [step_x, step_y] = map.steps()?;
    let heights = map.heights();
    let mean_square_slope = |next: usize, step: f64| {
        let lines = (0..nodes_x - 1).map(|i| i * nodes_y);
        let nodes = lines.flat_map(|line| line..line + nodes_y - 1);
        let slopes = nodes.map(|node| (heights[node + next] - heights[node]) / step);
        mean(slopes.filter(|slope| !slope.is_nan()).map(|slope| slope.powi(2)))
    };
    Some((mean_square_slope(nodes_y, step_x)? + mean_square_slope(1, step_y)?).sqrt())
}
