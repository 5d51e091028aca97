//! Channels of a file, their height maps and the statistics of a map.

use super::FormatError;
use super::raster::{Raster, is_marker};
use super::unit::{Unit, y_ratio};

/// Words of the names of channels that are heights.
const HEIGHTS: [&str; 13] = [
    "height",
    "heights",
    "z",
    "zsensor",
    "topography",
    "topo",
    "surface",
    "elevation",
    "original",
    "profile",
    "dem",
    "band1",
    "hgt",
];
/// Words of the names of channels that are no heights, also if they have the unit of heights.
const OTHERS: [&str; 30] = [
    "error",
    "err",
    "deflection",
    "amplitude",
    "phase",
    "friction",
    "lateral",
    "adhesion",
    "current",
    "mask",
    "contact",
    "pressure",
    "displacement",
    "gap",
    "traction",
    "force",
    "stiffness",
    "intensity",
    "potential",
    "dissipation",
    "modulus",
    "deformation",
    "quality",
    "confidence",
    "image",
    "valid",
    "weight",
    "bounds",
    "indentation",
    "count",
];

/// Reason of the version of a reader: it takes another default channel.
pub(crate) const NAME_FIRST: &str =
    "the name of a channel decides before its unit which one is read";

/// Physical quantity of the numbers of a channel.
#[derive(Debug, Clone, PartialEq)]
pub enum Quantity {
    /// Heights, converted to metres when decoded.
    Height,
    /// Numbers without a unit, which may be heights.
    Unitless,
    /// Another quantity, such as a voltage, with its unit as in the file.
    Other(String),
}

/// Side lengths of a map; a side is nodes × step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// Side lengths in metres, along x and y.
    Metres([f64; 2]),
    /// Side lengths without a unit, along x and y.
    Unitless([f64; 2]),
    /// The file gives no side lengths, or gives them in a unit that is not a length.
    Unknown,
}

/// One map of a file, with its name, quantity and size. [`Channel::map`] decodes its numbers.
#[derive(Debug, Clone)]
pub struct Channel<'a> {
    pub(crate) name: String,
    quantity: Quantity,
    size: Size,
    raster: Raster<'a>,
    /// Number of points under a mask that a user of the file drew.
    masked: usize,
    /// Unit of the sides, if it is no known unit of length.
    unknown_side_unit: Option<String>,
    notes: Vec<String>,
}

/// Heights at the nodes of a rectangular grid, some of which may be missing. A height is finite
/// unless it is missing.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    nodes: [usize; 2],
    size: Size,
    quantity: Quantity,
    heights: Vec<f64>,
    missing: Vec<bool>,
}

/// Number in a file that probably marks missing points although the format does not say so, such as
/// −9999: it stands far from all others, which changes slopes and contacts completely.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SuspectNumber {
    /// Number as in the file, before it is converted to a height.
    pub number: f64,
    /// Number of points that have it.
    pub count: usize,
}

/// Distance from the other numbers, in ranges of these, from which on a number is suspect.
const FAR: f64 = 3.0;
/// Magnitudes of numbers that mark missing points in many programs.
const USUAL_MARKERS: [f64; 14] = [
    999.0,
    9999.0,
    99999.0,
    999999.0,
    32767.0,
    32768.0,
    65535.0,
    2147483647.0,
    2147483648.0,
    1e10,
    1e20,
    1e30,
    1.70141e38,
    3.402823e38,
];

/// Summary of a map as measured, before any correction, in the unit of its heights.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Statistics {
    /// Number of missing points in the map.
    pub missing: usize,
    /// Statistics of the points that are not missing; `None` if all points are missing.
    pub heights: Option<HeightStatistics>,
    /// Heights at the four corners of the map.
    pub corners: Corners,
}

/// Statistics of the points of a map that are not missing.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct HeightStatistics {
    /// Root-mean-square deviation of the heights from their mean.
    pub rms_height: f64,
    /// Root-mean-square slope, √(⟨(Δh/Δx)²⟩ + ⟨(Δh/Δy)²⟩).
    ///
    /// The differences are taken at all nodes that have a following node along both axes, or along
    /// x for a profile, except where one of the two points is missing. The slope is `None` if the
    /// size is unknown or has another unit than the heights. It is also `None` if an axis has no
    /// pair of neighbouring points.
    pub rms_slope: Option<f64>,
    /// Smallest height of the map.
    pub lowest: f64,
    /// Largest height of the map.
    pub highest: f64,
}

/// Heights at the corners of a map, `None` at missing points. They show whether axes are swapped.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Corners {
    /// Height at the first x and the first y.
    pub first: Option<f64>,
    /// Height at the last x and the first y.
    pub x_end: Option<f64>,
    /// Height at the first x and the last y.
    pub y_end: Option<f64>,
    /// Height at the last x and the last y.
    pub last: Option<f64>,
}

/// Size of a map, with the unit that the file gives if it is no known unit of length: then the size
/// is unknown, and messages name the unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sides {
    size: Size,
    unknown_unit: Option<String>,
}

impl From<Size> for Sides {
    fn from(size: Size) -> Sides {
        Sides { size, unknown_unit: None }
    }
}

impl Sides {
    /// The file gives no sides.
    pub(crate) const UNKNOWN: Sides = Sides { size: Size::Unknown, unknown_unit: None };

    /// Creates a size from sides in the given unit.
    ///
    /// # Errors
    /// Returns an error if a side is not positive and finite.
    pub(crate) fn new(sides: [f64; 2], unit: &Unit) -> Result<Sides, FormatError> {
        let per_metre = unit.per_metre().unwrap_or(1.0);
        let scaled = sides.map(|side| side / per_metre);
        let is_length = |side: f64| side > 0.0 && side.is_finite();
        let wrong = sides.iter().zip(scaled).find(|(_, side)| !is_length(*side));
        if let Some((side, _)) = wrong {
            let allowed = "a positive, finite number";
            return Err(FormatError::value("side of the map", side, allowed));
        }
        match unit {
            Unit::Length(_) => Ok(Size::Metres(scaled).into()),
            Unit::None => Ok(Size::Unitless(sides).into()),
            Unit::Other(unit) => {
                Ok(Sides { size: Size::Unknown, unknown_unit: Some(unit.clone()) })
            }
        }
    }

    /// Creates a size from sides in the given unit if the file has them.
    pub(crate) fn given(sides: Option<[f64; 2]>, unit: &Unit) -> Result<Sides, FormatError> {
        sides.map_or(Ok(Sides::UNKNOWN), |sides| Sides::new(sides, unit))
    }

    /// Creates a size from numbers of nodes and their distances in the given unit.
    pub(crate) fn of_steps(
        nodes: [usize; 2],
        steps: [f64; 2],
        unit: &Unit,
    ) -> Result<Sides, FormatError> {
        Sides::new([0, 1].map(|axis| nodes[axis] as f64 * steps[axis]), unit)
    }

    /// Creates a size from sides whose units may differ.
    pub(crate) fn in_units(
        [x, y]: [f64; 2],
        [unit_x, unit_y]: [&str; 2],
    ) -> Result<Sides, FormatError> {
        Sides::new([x, y * y_ratio(unit_y, unit_x)?], &Unit::parse(unit_x))
    }
}

impl Size {
    /// Creates a size from sides in metres.
    ///
    /// # Errors
    /// Returns an error if a side is not positive and finite.
    pub(crate) fn metres(sides: [f64; 2]) -> Result<Size, FormatError> {
        Ok(Sides::new(sides, &Unit::Length(1.0))?.size)
    }

    /// Returns the sides along x and y, in metres or without a unit, if they are known.
    pub fn sides(&self) -> Option<[f64; 2]> {
        match self {
            Size::Metres(sides) | Size::Unitless(sides) => Some(*sides),
            Size::Unknown => None,
        }
    }
}

impl<'a> Channel<'a> {
    /// Creates a channel of numbers in the given unit; lengths are converted to metres.
    pub(crate) fn new(
        name: impl Into<String>,
        unit: Unit,
        sides: impl Into<Sides>,
        raster: Raster<'a>,
    ) -> Channel<'a> {
        let (quantity, raster) = match unit {
            Unit::None => (Quantity::Unitless, raster),
            Unit::Length(per_metre) => (Quantity::Height, raster.in_metres(per_metre)),
            Unit::Other(unit) => (Quantity::Other(unit), raster),
        };
        let Sides { size, unknown_unit: unknown_side_unit } = sides.into();
        let name = name.into();
        Channel { name, quantity, size, raster, masked: 0, unknown_side_unit, notes: vec![] }
    }

    /// Copies the bytes that the channel borrows from a file.
    pub(crate) fn into_owned(self) -> Channel<'static> {
        let Channel { name, quantity, size, raster, masked, unknown_side_unit, notes } = self;
        let raster = raster.into_owned();
        Channel { name, quantity, size, raster, masked, unknown_side_unit, notes }
    }

    /// Declares points missing where the number in `mask` exceeds one half, unless the caller of
    /// the library ignores the mask.
    pub(crate) fn under_mask(mut self, mask: Raster<'a>) -> Channel<'a> {
        self.masked = mask.count_masked();
        self.raster = self.raster.masked(Some(mask));
        self
    }

    /// Returns the channel without the mask that a user drew, whose points then have their heights.
    /// Points that the format itself marks stay missing.
    pub fn without_mask(mut self) -> Channel<'a> {
        if self.masked > 0 {
            (self.masked, self.raster) = (0, self.raster.masked(None));
        }
        self
    }

    /// Adds notes, which are sentences without a full stop that start in lower case.
    pub(crate) fn noted<S: Into<String>>(
        mut self,
        notes: impl IntoIterator<Item = S>,
    ) -> Channel<'a> {
        self.notes.extend(notes.into_iter().map(S::into));
        self
    }

    /// Returns the name of the channel, or `heights` if the file gives no name. Several channels of
    /// a file may have the same name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the numbers of nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        self.raster.nodes()
    }

    /// Returns whether the channel is a profile: one line of heights along x. The side along y is
    /// then one step.
    pub fn is_profile(&self) -> bool {
        self.nodes()[1] == 1
    }

    /// Returns the side lengths along x and y.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Returns the physical quantity of the numbers.
    pub fn quantity(&self) -> &Quantity {
        &self.quantity
    }

    /// Returns the unit of the decoded numbers, which is `m` for heights.
    pub fn unit(&self) -> Option<&str> {
        match &self.quantity {
            Quantity::Height => Some("m"),
            Quantity::Unitless => None,
            Quantity::Other(unit) => Some(unit),
        }
    }

    /// Returns the unit that the file gives for the sides if it is no known unit of length. The
    /// size is then unknown.
    pub fn unknown_side_unit(&self) -> Option<&str> {
        self.unknown_side_unit.as_deref()
    }

    /// Returns what the reader guessed, and which parts of the file it did not use, such as `first
    /// line and first column taken for axes`. A note about the whole file is a note of each
    /// channel.
    pub fn notes(&self) -> Vec<String> {
        let under_mask = match self.masked {
            0 => None,
            1 => Some("1 point is under a mask and counts as missing".to_owned()),
            count => Some(format!("{count} points are under a mask and count as missing")),
        };
        let under_mask =
            under_mask.map(|note| format!("{note}; `mask = false` keeps their heights"));
        self.notes.iter().cloned().chain(under_mask).collect()
    }

    /// Returns true if the numbers are heights or have no unit.
    pub fn may_be_heights(&self) -> bool {
        !matches!(self.quantity, Quantity::Other(_))
    }

    /// Returns the rank of the channel as the one to read if none is chosen: the lowest is first.
    ///
    /// The name decides before the unit, because deflections and errors may be in nanometres. A
    /// scan in the forward direction comes before one in the backward direction.
    pub(crate) fn rank(&self) -> (u8, bool, bool) {
        let name = self.name.to_lowercase();
        let has = |words: &[&str]| {
            let parts = name.split(|letter: char| !letter.is_alphanumeric());
            parts.into_iter().any(|part| words.contains(&part))
        };
        let class = match (has(&OTHERS), has(&HEIGHTS)) {
            // `Height error` is an error, `image_original` the measured map of TopoStats.
            (true, false) => 2,
            (true, true) if !has(&["original"]) => 2,
            (_, true) => 0,
            (false, false) => 1,
        };
        let is_back = has(&["retrace", "backward", "bwd"]);
        (class, self.quantity != Quantity::Height, is_back)
    }

    /// Decodes the map. Its numbers are in the unit that [`Channel::unit`] returns.
    pub fn map(&self) -> HeightMap {
        self.map_of(self.raster.decode())
    }

    /// Decodes the map. Points whose number in the file is `marker` are missing, too.
    ///
    /// The marker is compared before the numbers are converted to heights, in single precision.
    pub fn map_without(&self, marker: f64) -> HeightMap {
        self.map_of(self.raster.decode_without(marker))
    }

    /// Returns the number in the file that probably marks missing points, if there is one.
    pub fn suspect_number(&self) -> Option<SuspectNumber> {
        SuspectNumber::find(&self.raster.numbers_of_file())
    }

    fn map_of(&self, heights: Vec<f64>) -> HeightMap {
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
    /// Returns the numbers of nodes along x and y.
    pub fn nodes(&self) -> [usize; 2] {
        self.nodes
    }

    /// Returns the side lengths along x and y.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Returns the distances between neighbouring nodes along x and y, in the unit of the heights.
    /// Returns `None` if the size is unknown or has another unit than the heights.
    pub fn steps(&self) -> Option<[f64; 2]> {
        let sides = match (&self.quantity, self.size) {
            (Quantity::Height, Size::Metres(sides)) => sides,
            (Quantity::Unitless, Size::Unitless(sides)) => sides,
            _ => return None,
        };
        Some([0, 1].map(|axis| sides[axis] / self.nodes[axis] as f64))
    }

    /// Returns the heights in row-major order with x along the first axis; NaN at missing points.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// Returns one flag for each height, true if the point is missing (not measured or masked).
    pub fn missing(&self) -> &[bool] {
        &self.missing
    }

    /// Returns the height at node (i, j), or `None` if the point is missing or outside of the map.
    pub fn get(&self, i: usize, j: usize) -> Option<f64> {
        let [nodes_x, nodes_y] = self.nodes;
        let is_inside = i < nodes_x && j < nodes_y;
        is_inside.then(|| self.heights[i * nodes_y + j]).filter(|height| !height.is_nan())
    }

    /// Returns the vectors behind [`HeightMap::heights`] and [`HeightMap::missing`].
    pub fn into_parts(self) -> (Vec<f64>, Vec<bool>) {
        (self.heights, self.missing)
    }
}

impl SuspectNumber {
    /// Finds the lowest or highest number if it is repeated, or is a usual marker, and stands
    /// several times as far from the next number as all other numbers from each other.
    ///
    /// Numbers that are not finite are left out.
    pub fn find(numbers: &[f64]) -> Option<SuspectNumber> {
        let below = |number: f64| move |other: &f64| *other < number;
        let extremes = |numbers: &mut dyn Iterator<Item = f64>| {
            let none = [f64::INFINITY, f64::NEG_INFINITY];
            numbers.fold(none, |[low, high], number| [low.min(number), high.max(number)])
        };
        let finite = || numbers.iter().copied().filter(|number| number.is_finite());
        let [lowest, highest] = extremes(&mut finite());
        let [_, below_highest] = extremes(&mut finite().filter(below(highest)));
        let [above_lowest, _] = extremes(&mut finite().filter(|number| *number > lowest));
        let of_lowest = (lowest, above_lowest - lowest, highest - above_lowest);
        let of_highest = (highest, highest - below_highest, below_highest - lowest);
        let found = [of_lowest, of_highest].into_iter().find(|(number, gap, range)| {
            let count = || finite().filter(|other| other == number).count();
            let is_usual = || USUAL_MARKERS.iter().any(|usual| is_marker(number.abs(), *usual));
            *range > 0.0 && *gap > FAR * range && (is_usual() || count() > 1)
        });
        found.map(|(number, ..)| SuspectNumber {
            number,
            count: finite().filter(|other| *other == number).count(),
        })
    }
}

impl Statistics {
    /// Computes the statistics of a map.
    pub fn new(map: &HeightMap) -> Statistics {
        let [end_x, end_y] = map.nodes().map(|nodes| nodes - 1);
        Statistics {
            missing: map.missing().iter().filter(|missing| **missing).count(),
            heights: HeightStatistics::new(map),
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
    fn new(map: &HeightMap) -> Option<HeightStatistics> {
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

/// Returns the name of a channel with its scan direction, as SurfaceTopography writes it.
pub(crate) fn directed(name: String, is_retrace: bool) -> String {
    match name.strip_suffix(')') {
        _ if !is_retrace => name,
        Some(start) => format!("{start}, retrace)"),
        None => format!("{name} (retrace)"),
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
    if nodes_y == 1 {
        let slopes = heights.windows(2).map(|pair| (pair[1] - pair[0]) / step_x);
        return Some(
            mean(slopes.filter(|slope| !slope.is_nan()).map(|slope| slope.powi(2)))?.sqrt(),
        );
    }
    let mean_square_slope = |next: usize, step: f64| {
        let lines = (0..nodes_x - 1).map(|i| i * nodes_y);
        let nodes = lines.flat_map(|line| line..line + nodes_y - 1);
        let slopes = nodes.map(|node| (heights[node + next] - heights[node]) / step);
        mean(slopes.filter(|slope| !slope.is_nan()).map(|slope| slope.powi(2)))
    };
    Some((mean_square_slope(nodes_y, step_x)? + mean_square_slope(1, step_y)?).sqrt())
}
