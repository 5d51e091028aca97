//! HDF5 files of JPK instruments (now Bruker) with the extension `h5-jpk`, which hold the images of
//! a fast scan.
//!
//! A group `Measurement_000` has the sides of the grid in metres and a group for each channel. The
//! dataset of a channel has a row for each node and a column for each frame. Lines of nodes run
//! along x; the first line has the largest y unless the grid is reflected. The attributes
//! `net-encoder` convert the stored integers to the unit of the default calibration. Each frame is
//! a channel here.
//!
//! `sample_0.h5-jpk` in the tests of AFMReader 0.0.7 shows the layout.

use hdf5_reader::Dataset;
use hdf5_reader::group::Group;

use super::channel::{Channel, Size};
use super::hdf5::Container;
use super::input::finite;
use super::jpk::directed;
use super::labelled::Attributes;
use super::raster::checked_nodes;
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format = Format::new("h5-jpk", "JPK HDF5 images", read)
    .changed(&["integers may have fewer bits than their bytes"]);

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let container = Container::of_format(bytes)?;
    let root = container.root().map_err(|_| FormatError::Signature)?;
    let groups = root.groups().map_err(|_| FormatError::Signature)?;
    let measurement = |group: Group| {
        let attributes = container.group_attributes(&group).ok()?;
        attributes.number("position-pattern.grid.ilength")?;
        Some((group, attributes))
    };
    let measurements: Vec<_> = groups.into_iter().filter_map(measurement).collect();
    if measurements.is_empty() {
        return Err(FormatError::Signature);
    }
    let mut channels = Vec::new();
    for (group, attributes) in &measurements {
        let prefix = match measurements.len() {
            1 => String::new(),
            _ => format!("{}/", group.name()),
        };
        channels.extend(scan(&container, group, attributes, &prefix)?);
    }
    at_least_one(channels.into_iter().map(Ok), "channel")
}

/// Reads the channels of a scan. Their names start with `prefix`.
fn scan(
    container: &Container,
    group: &Group,
    attributes: &Attributes,
    prefix: &str,
) -> Result<Vec<Channel<'static>>, FormatError> {
    let pair = |names: [&str; 2]| -> Result<[f64; 2], FormatError> {
        let [x, y] = names.map(|name| {
            let name = format!("position-pattern.grid.{name}");
            attributes.number(&name).ok_or_else(|| FormatError::missing(&*name))
        });
        Ok([x?, y?])
    };
    let nodes = checked_nodes(pair(["ilength", "jlength"])?.map(|count| count as i64))?;
    let is_reflected = attributes.text("position-pattern.grid.reflect")? == Some("true");
    let size = Size::metres(pair(["ulength", "vlength"])?)?;
    let mut channels = Vec::new();
    for group in container.members(group, group.name())?.groups {
        let attributes = container.group_attributes(&group)?;
        let Some(name) = name(&attributes)? else { continue };
        let datasets = container.members(&group, group.name())?.datasets;
        let mut datasets = datasets.iter().filter(|dataset| has_frames(dataset, nodes));
        let Some(dataset) = datasets.next() else { continue };
        let number = |name: &str, default: f64| {
            let name = format!("net-encoder.scaling.{name}");
            finite(&name, attributes.number(&name).unwrap_or(default))
        };
        let (factor, offset) = (number("multiplier", 1.0)?, number("offset", 0.0)?);
        let unit = attributes.text("net-encoder.scaling.unit.unit")?;
        let unit = Unit::parse(unit.unwrap_or_default());
        let frames = container.frames(dataset, nodes)?;
        let count = frames.len();
        channels.extend(frames.into_iter().enumerate().map(|(index, frame)| {
            let name = match count {
                1 => format!("{prefix}{name}"),
                _ => format!("{prefix}{name}, frame {}", index + 1),
            };
            let frame = if is_reflected { frame } else { frame.upside_down() };
            Channel::new(name, unit.clone(), size, frame.scaled(factor, offset))
        }));
    }
    Ok(channels)
}

/// Returns the name of a channel with its direction, or `None` if the group is not a channel.
fn name(attributes: &Attributes) -> Result<Option<String>, FormatError> {
    let name = attributes.text("channel.fancy-name")?.or(attributes.text("channel.name")?);
    let is_retrace = attributes.text("retrace")? == Some("true");
    Ok(name.map(|name| directed(name.to_owned(), is_retrace)))
}

/// Returns true if a dataset has a row for each node. The thumbnail of a channel has none.
fn has_frames(dataset: &Dataset, nodes: [usize; 2]) -> bool {
    let &[rows, frames] = dataset.shape() else { return false };
    dataset.name() != "thumbnail" && rows == (nodes[0] * nodes[1]) as u64 && frames > 0
}
