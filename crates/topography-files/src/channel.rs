//! One map of a file, and what it is like before anything is done to it.

use super::FormatError;
use super::raster::Raster;
use super::unit::Unit;

/// What the numbers of a channel are.
#[derive(Debug, Clone, PartialEq)]
pub enum Quantity {
    /// Heights in metres.
    Height,
    /// Numbers in no unit, which may well be heights.
    Unitless,
    /// Something else, in the unit that the file gives.
    Other(String),
}

/// Sides of a map along x and y: nodes × step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// In metres.
    Metres([f64; 2]),
    /// In no unit.
    Unitless([f64; 2]),
    /// The file does not say, or gives no lengths.
    Unknown,
}

/// One map of a file, decoded when it is asked for.
#[derive(Debug, Clone)]
pub struct Channel<'a> {
    name: String,
    quantity: Quantity,
    size: Size,
    raster: Raster<'a>,
}

/// Heights on the nodes of a rectangle, some of which may be missing.
///
/// Holding one means: there is a number for each node, and it is finite unless the point is
/// missing.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    nodes: [usize; 2],
    size: Size,
    quantity: Quantity,
    heights: Vec<f64>,
    missing: Vec<bool>,
}

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
    /// Root of ⟨(Δh/Δx)²⟩ + ⟨(Δh/Δy)²⟩, from each node that has a next one along both axes to
    /// either. Slopes from or to missing points do not count. None when the size is unknown or in
    /// another unit than the heights, or no two points are neighbours along an axis.
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

impl Size {
    /// Sides in a unit of length, or in none; in any other they are no sides.
    ///
    /// # Errors
    /// When a side is not positive and finite.
    pub(super) fn of(sides: [f64; 2], unit: &Unit) -> Result<Size, FormatError> {
        let per_metre = unit.per_metre().unwrap_or(1.0);
        let scaled = sides.map(|side| side / per_metre);
        let is_length = |side: f64| side > 0.0 && side.is_finite();
        let wrong = sides.iter().zip(scaled).find(|(_, side)| !is_length(*side));
        if let Some((side, _)) = wrong {
            let allowed = "positive and finite";
            return Err(FormatError::value("side of the map", side, allowed));
        }
        match unit {
            Unit::Length(_) => Ok(Size::Metres(scaled)),
            Unit::None => Ok(Size::Unitless(sides)),
            Unit::Other(_) => Ok(Size::Unknown),
        }
    }

    /// Sides in metres.
    ///
    /// # Errors
    /// When a side is not positive and finite.
    pub(super) fn metres(sides: [f64; 2]) -> Result<Size, FormatError> {
        Size::of(sides, &Unit::Length(1.0))
    }

    /// The sides, in metres or in no unit.
    pub fn sides(&self) -> Option<[f64; 2]> {
        match self {
            Size::Metres(sides) | Size::Unitless(sides) => Some(*sides),
            Size::Unknown => None,
        }
    }
}

impl<'a> Channel<'a> {
    /// A channel whose numbers are in a unit; lengths become metres.
    pub(super) fn new(
        name: impl Into<String>,
        unit: Unit,
        size: Size,
        raster: Raster<'a>,
    ) -> Channel<'a> {
        let (quantity, raster) = match unit {
            Unit::None => (Quantity::Unitless, raster),
            Unit::Length(per_metre) => (Quantity::Height, raster.in_metres(per_metre)),
            Unit::Other(unit) => (Quantity::Other(unit), raster),
        };
        Channel { name: name.into(), quantity, size, raster }
    }

    /// What the file calls it, or `heights` where it says nothing. Several may have one name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        self.raster.nodes()
    }

    /// Sides along x and y.
    pub fn size(&self) -> Size {
        self.size
    }

    /// What its numbers are.
    pub fn quantity(&self) -> &Quantity {
        &self.quantity
    }

    /// The unit of its numbers: `m` of heights.
    pub fn unit(&self) -> Option<&str> {
        match &self.quantity {
            Quantity::Height => Some("m"),
            Quantity::Unitless => None,
            Quantity::Other(unit) => Some(unit),
        }
    }

    /// Whether its numbers are heights, or may be.
    pub fn may_be_heights(&self) -> bool {
        !matches!(self.quantity, Quantity::Other(_))
    }

    /// Decodes the map: its numbers are in [`Channel::unit`].
    pub fn map(&self) -> HeightMap {
        let heights = self.raster.decode();
        HeightMap {
            nodes: self.nodes(),
            size: self.size,
            quantity: self.quantity.clone(),
            missing: heights.iter().map(|height| height.is_nan()).collect(),
            heights,
        }
    }
}

impl HeightMap {
    /// Nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        self.nodes
    }

    /// Sides along x and y.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Distances between neighbours along x and y, in the unit of the heights; none where there is
    /// no such unit.
    pub fn steps(&self) -> Option<[f64; 2]> {
        let sides = match (&self.quantity, self.size) {
            (Quantity::Height, Size::Metres(sides)) => sides,
            (Quantity::Unitless, Size::Unitless(sides)) => sides,
            _ => return None,
        };
        Some([0, 1].map(|axis| sides[axis] / self.nodes[axis] as f64))
    }

    /// The heights, row-major with x along the first axis; NaN at missing points.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// Which points are missing: not measured, or marked as wrong.
    pub fn missing(&self) -> &[bool] {
        &self.missing
    }

    /// The height at node (i, j), if it is not missing.
    ///
    /// # Panics
    /// When the map has no such node.
    pub fn get(&self, i: usize, j: usize) -> Option<f64> {
        let height = self.heights[i * self.nodes[1] + j];
        (!height.is_nan()).then_some(height)
    }

    /// The heights as they are stored here, and which of them are missing.
    pub fn into_parts(self) -> (Vec<f64>, Vec<bool>) {
        (self.heights, self.missing)
    }
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
