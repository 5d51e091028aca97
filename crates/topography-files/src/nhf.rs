//! NHF files of Nanosurf Studio, which are HDF5 files.
//!
//! A group of a measurement states points and lines of the scan and its sides in metres; groups in
//! it, such as `Forward`, have a one-dimensional dataset for each channel. Version 1 names them
//! `image_points_per_line`, `image_number_of_lines`, `image_size_x` and `image_size_y`, and
//! version 2 `rect_axis_size` and `rect_axis_range`, both in the order y, x. Lines run along x; the
//! first line has y = 0. The integers of the type span the calibrated range. The smallest integer,
//! which is also the fill of the dataset, marks a point that was not measured; in version 2 it is
//! no part of the range.
//!
//! The layout is that of a file of 2023 in nanosurf-apps 2.0.7 (version 1.1) and of the reader of
//! nanosurf-utils 2.0.7. NSFopen 2.2.4 returns the marker as a height, and folds rectangular scans
//! of version 1. Channels without calibration have numbers without a unit.

use hdf5_reader::Dataset;

use super::channel::{Channel, Size};
use super::hdf5::Container;
use super::input::finite;
use super::jpk::directed;
use super::labelled::Attributes;
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format = Format::new("nhf", "Nanosurf NHF", read);

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let container = Container::of_format(bytes)?;
    let root = container.root().map_err(|_| FormatError::Signature)?;
    let attributes = container.group_attributes(&root).map_err(|_| FormatError::Signature)?;
    if attributes.get("nsf_file_version_major").is_none() {
        return Err(FormatError::Signature);
    }
    let version = attributes.number("nsf_file_version_major").unwrap_or(2.0);
    let mut channels = Vec::new();
    for group in container.members(&root, "the root group")?.groups {
        let attributes = container.group_attributes(&group)?;
        let Some(scan) = Scan::new(&attributes, version)? else { continue };
        let members = container.members(&group, group.name())?;
        let mut parts = vec![(String::new(), members.datasets)];
        for part in members.groups {
            let attributes = container.group_attributes(&part)?;
            let direction = attributes.text("name")?.unwrap_or_default();
            parts.push((direction.to_owned(), container.members(&part, part.name())?.datasets));
        }
        for (direction, datasets) in &parts {
            // Other datasets hold curves for each point.
            let count = (scan.nodes[0] * scan.nodes[1]) as u64;
            for dataset in datasets.iter().filter(|dataset| *dataset.shape() == [count]) {
                channels.push(scan.channel(&container, direction, dataset));
            }
        }
    }
    at_least_one(channels, "channel of a scan")
}

/// Grid of a measurement.
struct Scan {
    nodes: [usize; 2],
    size: Size,
    /// True if the marker of missing points is no part of the calibrated range (version 2).
    excludes_marker: bool,
}

impl Scan {
    /// Returns `None` if the group is not a measurement of a rectangle.
    fn new(attributes: &Attributes, version: f64) -> Result<Option<Scan>, FormatError> {
        // The order is y, x.
        let pair = |name: &str| match *attributes.numbers(name) {
            [y, x] => Some([x, y]),
            _ => None,
        };
        let two = |x: &str, y: &str| Some([attributes.number(x)?, attributes.number(y)?]);
        let nodes = two("image_points_per_line", "image_number_of_lines")
            .or_else(|| two("grid_number_of_columns", "grid_number_of_rows"))
            .or_else(|| pair("rect_axis_size"));
        let Some(nodes) = nodes else { return Ok(None) };
        let nodes = checked_nodes(nodes.map(|count| count as i64))?;
        let sides = two("image_size_x", "image_size_y").or_else(|| pair("rect_axis_range"));
        let size = sides.map_or(Ok(Size::Unknown), Size::metres)?;
        Ok(Some(Scan { nodes, size, excludes_marker: version >= 2.0 }))
    }

    fn channel(
        &self,
        container: &Container,
        direction: &str,
        dataset: &Dataset,
    ) -> Result<Channel<'static>, FormatError> {
        let attributes = container.attributes(dataset)?;
        let given = attributes.text("signal_name")?.or(attributes.text("name")?);
        let name = given.unwrap_or(dataset.name()).to_owned();
        let is_back = direction.eq_ignore_ascii_case("backward");
        let (element, order, bytes) = container.bytes(dataset)?;
        let (raster, unit) = self.calibrated(&attributes, element, order, bytes)?;
        Ok(Channel::new(directed(name, is_back), unit, self.size, raster))
    }

    fn calibrated(
        &self,
        attributes: &Attributes,
        element: Element,
        order: ByteOrder,
        bytes: Vec<u8>,
    ) -> Result<(Raster<'static>, Unit), FormatError> {
        // The marker is the smallest number of signed types, and in version 2 the largest number
        // of unsigned types.
        let (limits, marker) = match element.limits() {
            Some([lowest, highest]) if lowest < 0.0 => {
                let first = if self.excludes_marker { lowest + 1.0 } else { lowest };
                (Some([first, highest]), Some(lowest))
            }
            Some([lowest, highest]) if self.excludes_marker => {
                (Some([lowest, highest - 1.0]), Some(highest))
            }
            limits => (limits, None),
        };
        let marker = marker.map_or(Missing::None, Missing::Value);
        let raster = Raster::rows(self.nodes, element, order, bytes)?.missing(marker);
        let calibration = ["signal_calibration", "base_calibration"].into_iter().find_map(|name| {
            let [low, high] = ["min", "max"].map(|end| attributes.number(&format!("{name}_{end}")));
            Some((name, low?, high?))
        });
        let (Some((name, low, high)), Some([lowest, highest])) = (calibration, limits) else {
            return Ok((raster, Unit::None));
        };
        let [low, high] = [finite(name, low)?, finite(name, high)?];
        let scale = (high - low) / (highest - lowest);
        let unit = attributes.text(&format!("{name}_unit"))?.unwrap_or_default();
        // The unit may be written out, with the symbol in parentheses.
        let symbol = unit.split_once('(').and_then(|(_, rest)| rest.split(')').next());
        let unit = Unit::parse(symbol.unwrap_or(unit));
        Ok((raster.scaled(scale, low - scale * lowest), unit))
    }
}
