//! Arrays with named axes and attributes, as netCDF, HDF5, NeXus and HyperSpy files hold them, and
//! the conventions that turn them into maps.
//!
//! - **Axes.** The attributes `axis` and `standard_name` of coordinates (CF conventions 1.11), the
//!   name of the axis (module [`direction`](super::direction)) and `long_name` tell x and y; width
//!   and column(s) are x, height, row(s) and line(s) are y. If nothing tells, the container says
//!   whether the last axis is x (images) or y (NumPy arrays `[x, y]`, as SurfaceTopography, Tamaas
//!   and h5py scripts store them). Axes of length one are dropped (frames of Tamaas 2.9.0 and
//!   ContactMechanics 1.8.3); a longer third axis counts channels.
//! - **Coordinates beside a map.** Arrays x and y of h5py scripts, `numpy.savez` and `save -v7.3`
//!   of MATLAB are its axes if they have its numbers of lines, or its shape as of `meshgrid`.
//! - **Sides.** A side is the attribute `length` of the axis (SurfaceTopography 1.27.1), or nodes ×
//!   step of its coordinates (netCDF4 1.7.5, xarray 2026.9, GMT 6, GDAL 3.10), whether the
//!   coordinates are those of nodes or of pixel centres. Descending coordinates turn the map.
//! - **Numbers.** A height is number × `scale_factor` + `add_offset`. `_FillValue`,
//!   `missing_value`, the default fill of netCDF, and numbers outside of `valid_range`, `valid_min`
//!   and `valid_max` are missing points, compared before scaling (netCDF User's Guide,
//!   conventions of 2006).
//! - **Units.** The attribute `units` or `unit`, also in capitals (`UNIT` in files of Delmic's
//!   Odemis, 2025). A unit that cannot be read is an error.

use super::FormatError;
use super::channel::{Channel, Sides, Size};
use super::direction::Direction;
use super::input::{factor, finite};
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes};
use super::unit::Unit;

// Reasons of the versions of readers.
pub(crate) const CONVENTIONS: &str =
    "fill values, valid ranges, scale factors and coordinates count for all variables";
pub(crate) const DEGREES: &str =
    "coordinates that descend turn the map in any unit, such as degrees";
pub(crate) const AXES: &str = "`axis`, `standard_name` and more names tell x and y";

/// Maximum number of maps in a stack.
const MAX_FRAMES: usize = 10_000;
/// Maximum length of a last axis without a name that is taken for colours or components.
const MAX_COMPONENTS: usize = 4;

/// Value of an attribute.
#[derive(Debug, Clone)]
pub(crate) enum Value {
    Texts(Vec<String>),
    Numbers(Vec<f64>),
    /// Value that could not be decoded, with the reason.
    Unreadable(String),
    /// Value of a type that no convention uses.
    Other,
}

/// Attributes of an array, an axis or a group.
#[derive(Debug, Clone, Default)]
pub(crate) struct Attributes(pub Vec<(String, Value)>);

impl Attributes {
    pub(crate) fn get(&self, name: &str) -> Option<&Value> {
        self.0.iter().find(|(known, _)| known == name).map(|(_, value)| value)
    }

    /// Returns the texts of an attribute; none if it is missing or of another type.
    pub(crate) fn texts(&self, name: &str) -> Result<&[String], FormatError> {
        match self.get(name) {
            Some(Value::Texts(texts)) => Ok(texts),
            Some(Value::Unreadable(reason)) => {
                Err(FormatError::damaged(&format!("attribute `{name}`"), reason))
            }
            _ => Ok(&[]),
        }
    }

    /// Returns the text of an attribute, or the first of its texts.
    pub(crate) fn text(&self, name: &str) -> Result<Option<&str>, FormatError> {
        Ok(self.texts(name)?.first().map(String::as_str))
    }

    pub(crate) fn numbers(&self, name: &str) -> &[f64] {
        match self.get(name) {
            Some(Value::Numbers(numbers)) => numbers,
            _ => &[],
        }
    }

    /// Returns the number of an attribute, or the first of its numbers.
    pub(crate) fn number(&self, name: &str) -> Option<f64> {
        self.numbers(name).first().copied()
    }

    /// Returns the unit, or `None` if the attributes name no unit.
    pub(crate) fn unit(&self) -> Result<Option<Unit>, FormatError> {
        let named = |wanted: &str| {
            let mut names = self.0.iter().map(|(name, _)| name.as_str());
            names.find(|name| name.eq_ignore_ascii_case(wanted))
        };
        let text = match named("units").or_else(|| named("unit")) {
            Some(name) => self.text(name)?,
            None => None,
        };
        // The unit of numbers without a unit is `1` by the convention of UDUNITS.
        Ok(text.filter(|text| !matches!(text.trim(), "" | "1")).map(Unit::parse))
    }
}

/// Axis of an array.
#[derive(Debug, Clone, Default)]
pub(crate) struct Axis {
    pub(crate) name: String,
    pub(crate) side: Option<f64>,
    /// Distance between neighbouring nodes; negative if the coordinates descend.
    pub(crate) step: Option<f64>,
    pub(crate) unit: Option<Unit>,
    /// Reason why the nodes are not evenly spaced.
    pub(crate) uneven: Option<String>,
    /// Direction that attributes tell.
    pub(crate) direction: Option<Direction>,
}

impl Axis {
    pub(crate) fn named(name: impl Into<String>) -> Axis {
        Axis { name: name.into(), ..Axis::default() }
    }

    /// Creates an axis with a side.
    pub(crate) fn of_side(name: &str, side: f64, unit: Option<Unit>) -> Axis {
        Axis { side: Some(side), unit, ..Axis::named(name) }
    }

    /// Creates an axis from its coordinates and their attributes.
    pub(crate) fn new(
        name: impl Into<String>,
        coordinates: &[f64],
        attributes: &Attributes,
    ) -> Result<Axis, FormatError> {
        let mut axis = Axis { unit: attributes.unit()?, ..Axis::named(name) };
        axis.side = attributes.number("length");
        let told = |name| attributes.text(name).map(|text| text.and_then(Direction::of_name));
        axis.direction = told("axis")?.or(told("standard_name")?);
        axis.direction = axis.direction().or(told("long_name")?);
        if let [first, .., last] = *coordinates
            && axis.side.is_none()
        {
            let step = (last - first) / (coordinates.len() - 1) as f64;
            let largest = first.abs().max(last.abs());
            // Coordinates in single precision have seven digits.
            let allowed = 1e-3 * step.abs() + 1.2e-7 * largest;
            let expected = (0..).map(|index| first + f64::from(index) * step);
            let is_off =
                |(at, expected): (&f64, f64)| at.is_nan() || (at - expected).abs() > allowed;
            let is_length = !matches!(axis.unit, Some(Unit::Other(_)));
            if is_length && coordinates.iter().zip(expected).any(is_off) {
                axis.uneven = Some(format!(
                    "the coordinates of `{}` are not evenly spaced; interpolate the map first",
                    axis.name
                ));
            } else if step != 0.0 {
                axis.step = Some(step);
            }
        }
        Ok(axis)
    }

    /// Returns the side of an axis of `nodes` nodes.
    fn side(&self, nodes: usize) -> Option<f64> {
        self.side.or_else(|| Some(self.step?.abs() * nodes as f64))
    }

    fn direction(&self) -> Option<Direction> {
        let of_image = || match self.name.trim().to_lowercase().as_str() {
            "width" | "column" | "columns" => Some(Direction::X),
            "height" | "row" | "rows" | "line" | "lines" => Some(Direction::Y),
            _ => None,
        };
        self.direction.or_else(|| Direction::of_name(&self.name)).or_else(of_image)
    }
}

/// Coordinates of the points of a map, which a file has beside it.
pub(crate) struct Coordinates {
    pub(crate) name: String,
    pub(crate) shape: Vec<usize>,
    pub(crate) numbers: Vec<f64>,
    pub(crate) attributes: Attributes,
}

impl Coordinates {
    /// Returns the axes of a map with two dimensions whose points have the coordinates x and y, or
    /// `None` if their numbers do not fit. Of a square map with a list for each axis, the first
    /// axis is x.
    pub(crate) fn axes(
        shape: [usize; 2],
        x: &Coordinates,
        y: &Coordinates,
    ) -> Result<Option<Vec<Axis>>, FormatError> {
        let axes = |first: &Coordinates, second: &Coordinates| {
            let (first, second) = (first.along(shape, 0)?, second.along(shape, 1)?);
            Some([first, second].into_iter().collect::<Result<Vec<Axis>, FormatError>>())
        };
        axes(x, y).or_else(|| axes(y, x)).transpose()
    }

    /// Returns the axis if the numbers are those along a dimension of a map.
    fn along(&self, shape: [usize; 2], dimension: usize) -> Option<Result<Axis, FormatError>> {
        let long: Vec<usize> = self.shape.iter().copied().filter(|&length| length > 1).collect();
        let numbers = if long == [shape[dimension]] {
            self.numbers.clone()
        } else if long == shape {
            let stride = if dimension == 0 { shape[1] } else { 1 };
            let line = (0..shape[dimension]).map(|index| self.numbers[index * stride]).collect();
            let index = |at: usize| if dimension == 0 { at / shape[1] } else { at % shape[1] };
            let mut all = self.numbers.iter().enumerate();
            Some(line)
                .filter(|line: &Vec<f64>| all.all(|(at, number)| line[index(at)] == *number))?
        } else {
            return None;
        };
        Some(Axis::new(&self.name, &numbers, &self.attributes))
    }
}

/// Array of stored numbers in row-major order.
#[derive(Debug, Clone)]
pub(crate) struct Array {
    pub(crate) name: String,
    pub(crate) shape: Vec<usize>,
    /// One axis for each dimension.
    pub(crate) axes: Vec<Axis>,
    pub(crate) attributes: Attributes,
    pub(crate) element: Element,
    pub(crate) order: ByteOrder,
    pub(crate) bytes: Vec<u8>,
    /// Unit of the numbers, unless an attribute names one.
    pub(crate) unit: Option<Unit>,
    /// Number that stands at points that were not written.
    pub(crate) unwritten: Option<f64>,
    /// True if the last axis is x, unless the names of the axes tell.
    pub(crate) last_is_x: bool,
    /// Numbers of the same shape that are nonzero at missing points.
    pub(crate) mask: Option<Box<Array>>,
}

impl Array {
    /// Creates an array without attributes, whose axes have no names and no coordinates.
    pub(crate) fn new(
        name: impl Into<String>,
        shape: &[u64],
        element: Element,
        order: ByteOrder,
        bytes: Vec<u8>,
    ) -> Array {
        let whole = |&length: &u64| usize::try_from(length).unwrap_or(usize::MAX);
        Array {
            name: name.into(),
            shape: shape.iter().map(whole).collect(),
            axes: vec![Axis::default(); shape.len()],
            attributes: Attributes::default(),
            element,
            order,
            bytes,
            unit: None,
            unwritten: None,
            last_is_x: false,
            mask: None,
        }
    }

    /// Returns true if the array is a map or a stack of maps by its shape.
    pub(crate) fn is_map_of(shape: &[u64]) -> bool {
        shape.iter().filter(|&&length| length > 1).count() >= 2 && !shape.contains(&0)
    }

    /// Converts the array to channels: one, or one for each map of a stack.
    pub(crate) fn channels(mut self) -> Result<Vec<Channel<'static>>, FormatError> {
        if self.attributes.text("_Unsigned")?.is_some_and(|text| text.eq_ignore_ascii_case("true"))
        {
            self.element = self.element.unsigned();
        }
        let (x, y) = self.plane()?;
        let frames = self.frames(x, y)?;
        let masks = match self.mask.take() {
            Some(mask) if mask.shape == self.shape => {
                mask.frames(x, y)?.into_iter().map(Some).collect()
            }
            Some(mask) => {
                let found = format!("{:?}", mask.shape);
                let allowed = format!("{:?}, the shape of `{}`", self.shape, self.name);
                return Err(FormatError::value("shape of `mask`", found, &allowed));
            }
            None => vec![None; frames.len()],
        };
        let (size, size_note) = self.size(x, y)?;
        let plane_note = self.plane_note(x, y);
        let unit = self.attributes.unit()?.or(self.unit.clone()).unwrap_or(Unit::None);
        let count = frames.len();
        let further =
            (0..self.shape.len()).find(|axis| *axis != x && *axis != y && self.shape[*axis] > 1);
        let stack =
            further.map(|axis| self.axes[axis].name.as_str()).filter(|name| !name.is_empty());
        let channels = frames.into_iter().zip(masks).enumerate().map(|(index, (frame, mask))| {
            let raster = self.unpacked(frame)?.masked(mask);
            let name = match count {
                1 => self.name.clone(),
                _ => format!("{}, {} {}", self.name, stack.unwrap_or("frame"), index + 1),
            };
            let channel = Channel::new(name, unit.clone(), size.clone(), raster);
            Ok(channel.noted(size_note.iter().chain(&plane_note)))
        });
        channels.collect()
    }

    /// Returns the dimensions that are x and y.
    fn plane(&self) -> Result<(usize, usize), FormatError> {
        let long: Vec<usize> = (0..self.shape.len()).filter(|&axis| self.shape[axis] > 1).collect();
        let &[.., before, last] = long.as_slice() else {
            return Err(FormatError::unsupported(format!("`{}` is not a map", self.name)));
        };
        let find = |wanted: Direction| {
            let mut axes = long.iter().rev().copied().chain(0..self.shape.len());
            axes.find(|&at| self.axes[at].direction() == Some(wanted))
        };
        let other = |taken: usize| if last == taken { before } else { last };
        let told = match (find(Direction::X), find(Direction::Y)) {
            (Some(x), Some(y)) => Some((x, y)),
            (Some(x), None) => Some((x, other(x))),
            (None, Some(y)) => Some((other(y), y)),
            (None, None) => None,
        };
        // A scan along a line has an axis of length one; its maps are those of a detector.
        match told.filter(|&(x, y)| self.shape[x] > 1 && self.shape[y] > 1) {
            Some(plane) => Ok(plane),
            None if long.len() > 2 && self.shape[last] <= MAX_COMPONENTS => {
                let shape: Vec<String> = self.shape.iter().map(usize::to_string).collect();
                Err(FormatError::unsupported(format!(
                    "`{}` has {} dimensions ({}), and its axes have no names that tell x and y; \
                     save a map of two dimensions",
                    self.name,
                    shape.len(),
                    shape.join(" × ")
                )))
            }
            None if self.last_is_x => Ok((last, before)),
            None => Ok((before, last)),
        }
    }

    /// Returns a note if the names of the axes x and y tell nothing.
    fn plane_note(&self, x: usize, y: usize) -> Option<String> {
        let [x, y] = [x, y].map(|axis| &self.axes[axis]);
        let is_guess =
            [x, y].iter().all(|axis| axis.direction().is_none() && !axis.name.is_empty());
        is_guess.then(|| {
            let [x, y] = [&x.name, &y.name];
            format!("axis `{x}` is taken for x and `{y}` for y; their names do not tell")
        })
    }

    /// Returns the maps of a stack, or the only map, in the plane of the dimensions x and y.
    fn frames(&self, x: usize, y: usize) -> Result<Vec<Raster<'static>>, FormatError> {
        let nodes = checked_nodes([self.shape[x], self.shape[y]])?;
        let count = self.shape.iter().product::<usize>() / (nodes[0] * nodes[1]);
        if count > MAX_FRAMES {
            let entry = format!("number of maps in `{}`", self.name);
            return Err(FormatError::value(&entry, count, &format!("at most {MAX_FRAMES}")));
        }
        let descends = |axis: usize| self.axes[axis].step.is_some_and(|step| step < 0.0);
        let frames = (0..count).map(|index| {
            let bytes = self.gathered([x.min(y), x.max(y)], index);
            let raster = if x > y {
                Raster::rows(nodes, self.element, self.order, bytes)
            } else {
                Raster::columns(nodes, self.element, self.order, bytes)
            }?;
            let raster = if descends(x) { raster.mirrored() } else { raster };
            Ok(if descends(y) { raster.upside_down() } else { raster })
        });
        frames.collect()
    }

    /// Collects the bytes of the map along two dimensions. `index` counts the maps along the other
    /// dimensions.
    fn gathered(&self, [first, second]: [usize; 2], mut index: usize) -> Vec<u8> {
        let size = self.element.size();
        let strides: Vec<usize> =
            (0..self.shape.len()).map(|axis| self.shape[axis + 1..].iter().product()).collect();
        let mut start = 0;
        for axis in (0..self.shape.len()).rev().filter(|axis| *axis != first && *axis != second) {
            start += index % self.shape[axis] * strides[axis];
            index /= self.shape[axis];
        }
        let [lines, length] = [self.shape[first], self.shape[second]];
        let [outer, inner] = [strides[first], strides[second]];
        if [outer, inner] == [length, 1] {
            return self.bytes[start * size..(start + lines * length) * size].to_vec();
        }
        let starts = (0..lines).map(|line| start + line * outer);
        let elements = starts.flat_map(|line| (0..length).map(move |at| line + at * inner));
        elements.flat_map(|at| &self.bytes[at * size..(at + 1) * size]).copied().collect()
    }

    /// Returns the size of the map, and a note if the unit of an axis is not a length.
    fn size(&self, x: usize, y: usize) -> Result<(Sides, Option<String>), FormatError> {
        let axes = [&self.axes[x], &self.axes[y]];
        if let Some(reason) = axes.iter().find_map(|axis| axis.uneven.as_ref()) {
            return Err(FormatError::unsupported(reason));
        }
        // Coordinates such as degrees turn the map, but give no sides.
        let other = axes.iter().find_map(|axis| match &axis.unit {
            Some(Unit::Other(unit)) => {
                Some(format!("`{}` is in `{unit}`, which is not a length", axis.name))
            }
            _ => None,
        });
        let sides = [axes[0].side(self.shape[x]), axes[1].side(self.shape[y])];
        let ([Some(x_side), Some(y_side)], None) = (sides, &other) else {
            return Ok((Sides::UNKNOWN, other));
        };
        let [x_unit, y_unit] = [axes[0], axes[1]].map(|axis| axis.unit.as_ref());
        // SurfaceTopography may leave out one of the units.
        let (Some(x_unit), Some(y_unit)) = (x_unit.or(y_unit), y_unit.or(x_unit)) else {
            return Ok((Sides::new([x_side, y_side], &Unit::None)?, None));
        };
        match (x_unit.per_metre(), y_unit.per_metre()) {
            (Some(x), Some(y)) if x != y => {
                Ok((Size::metres([x_side / x, y_side / y])?.into(), None))
            }
            _ => Ok((Sides::new([x_side, y_side], x_unit)?, None)),
        }
    }

    /// Applies the attributes that mark missing points and scale numbers.
    fn unpacked(&self, raster: Raster<'static>) -> Result<Raster<'static>, FormatError> {
        let number = |name: &str| self.attributes.number(name);
        let scale = factor("scale_factor", number("scale_factor").unwrap_or(1.0))?;
        let offset = finite("add_offset", number("add_offset").unwrap_or(0.0))?;
        let named: Vec<f64> = ["_FillValue", "missing_value"]
            .into_iter()
            .flat_map(|name| self.attributes.numbers(name))
            .map(|&marker| self.element.rounded(marker))
            .collect();
        let unwritten = self.unwritten.filter(|_| self.attributes.get("_FillValue").is_none());
        let markers: Vec<f64> = named.into_iter().chain(unwritten).collect();
        let range = self.attributes.numbers("valid_range");
        let [lowest, highest] = match *range {
            [lowest, highest] => [Some(lowest), Some(highest)],
            _ => [number("valid_min"), number("valid_max")],
        };
        let raster = match (markers.as_slice(), lowest, highest) {
            ([], None, None) => raster,
            (&[marker], None, None) => raster.missing(Missing::Value(marker)),
            _ => {
                let nodes = raster.nodes();
                let is_missing = |number: f64| {
                    markers.contains(&number)
                        || lowest.is_some_and(|lowest| number < self.element.rounded(lowest))
                        || highest.is_some_and(|highest| number > self.element.rounded(highest))
                };
                let numbers =
                    raster.decode().into_iter().map(|h| if is_missing(h) { f64::NAN } else { h });
                Raster::from_columns(nodes, numbers.collect())
            }
        };
        Ok(raster.scaled(scale, offset))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns an array of 2 × 3 numbers 1 to 6 with the axes y and x.
    fn array(y: Axis, x: Axis) -> Array {
        let bytes = vec![1, 2, 3, 4, 5, 6];
        Array {
            axes: vec![y, x],
            ..Array::new("z", &[2, 3], Element::U8, ByteOrder::Little, bytes)
        }
    }

    fn axis(name: &str, coordinates: &[f64], unit: &str) -> Axis {
        let unit = ("units".to_owned(), Value::Texts(vec![unit.to_owned()]));
        Axis::new(name, coordinates, &Attributes(vec![unit])).unwrap()
    }

    #[test]
    fn descending_coordinates_turn_the_map_in_any_unit() {
        for unit in ["µm", "", "degrees_north"] {
            let array = array(axis("lat", &[2.0, 0.0], unit), axis("lon", &[0.0, 1.0, 2.0], unit));
            let channel = &array.channels().unwrap()[0];
            assert_eq!(channel.map().heights(), [4.0, 1.0, 5.0, 2.0, 6.0, 3.0], "{unit}");
        }
    }

    #[test]
    fn sides_in_other_units_than_lengths_are_unknown_with_a_note() {
        let y = axis("y", &[0.0, 1.0], "µm");
        let x = Axis { step: Some(1.0), unit: Some(Unit::parse("V")), ..Axis::named("x") };
        let channel = &array(y, x).channels().unwrap()[0];
        assert_eq!(channel.size(), Size::Unknown);
        assert_eq!(channel.notes(), ["`x` is in `V`, which is not a length"]);
    }

    #[test]
    fn the_units_of_the_sides_may_differ() {
        let array = array(axis("y", &[0.0, 1.0], "mm"), axis("x", &[0.0, 1.0, 2.0], "µm"));
        let sides = array.channels().unwrap()[0].size().sides().unwrap();
        assert!((sides[0] / 3e-6 - 1.0).abs() < 1e-14 && (sides[1] / 2e-3 - 1.0).abs() < 1e-14);
    }

    /// Returns the steps of the axes of a map of 2 × 3 numbers with these coordinates x and y.
    fn steps(x: (&[usize], &[f64]), y: (&[usize], &[f64])) -> Option<Vec<Option<f64>>> {
        let of = |name: &str, (shape, numbers): (&[usize], &[f64])| Coordinates {
            name: name.to_owned(),
            shape: shape.to_vec(),
            numbers: numbers.to_vec(),
            attributes: Attributes::default(),
        };
        let axes = Coordinates::axes([2, 3], &of("x", x), &of("y", y)).unwrap()?;
        Some(axes.iter().map(|axis| axis.step).collect())
    }

    #[test]
    fn coordinates_beside_a_map_tell_its_axes() {
        let (three, two) = ([0.0, 5.0, 10.0], [0.0, 2.0]);
        assert_eq!(steps((&[3], &three), (&[2], &two)), Some(vec![Some(2.0), Some(5.0)]));
        assert_eq!(steps((&[2, 1], &two), (&[1, 3], &three)), Some(vec![Some(2.0), Some(5.0)]));
        let mesh_x = [0.0, 5.0, 10.0, 0.0, 5.0, 10.0];
        let mesh_y = [0.0, 0.0, 0.0, 2.0, 2.0, 2.0];
        let of_mesh = steps((&[2, 3], &mesh_x), (&[2, 3], &mesh_y));
        assert_eq!(of_mesh, Some(vec![Some(2.0), Some(5.0)]));
        // Other lengths, and components of a vector that are called x and y.
        assert_eq!(steps((&[4], &[0.0, 1.0, 2.0, 3.0]), (&[2], &two)), None);
        assert_eq!(steps((&[2, 3], &mesh_x), (&[2, 3], &[1.0, 0.0, 2.0, 0.0, 4.0, 1.0])), None);
    }

    #[test]
    fn names_that_tell_nothing_are_a_note() {
        let channel = &array(Axis::named("i"), Axis::named("j")).channels().unwrap()[0];
        assert_eq!(
            channel.notes(),
            ["axis `i` is taken for x and `j` for y; their names do not tell"]
        );
        let by_attribute = |name: &str, direction: &str| {
            let attribute = ("axis".to_owned(), Value::Texts(vec![direction.to_owned()]));
            Axis::new(name, &[0.0, 1.0, 2.0], &Attributes(vec![attribute])).unwrap()
        };
        let channel = &array(by_attribute("i", "Y"), by_attribute("j", "X")).channels().unwrap()[0];
        assert_eq!((channel.nodes(), channel.notes().len()), ([3, 2], 0));
    }
}
