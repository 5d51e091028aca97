//! Formats that are built on HDF5: netCDF-4, DATX of Zygo, NHF of Nanosurf and fast scans of JPK.
//! The constant of each format documents its layout.

use hdf5_reader::group::Group;
use hdf5_reader::{Attribute, Dataset, Datatype};

use super::channel::{Channel, Size, directed};
use super::hdf5::{Container, maps};
use super::input::{factor, finite};
use super::labelled::{AXES, Attributes, CONVENTIONS, DEGREES};
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

/// NetCDF-4 files, as netCDF4, xarray and `to_netcdf` of SurfaceTopography write them. The
/// container is HDF5; variables and attributes are those of the classic format (see
/// [`netcdf`](super::netcdf)).
///
/// A file is recognized by the attribute `_NCProperties` of its root group, which netCDF 4.4.1
/// (2016) and later write, or by the attributes of dimensions. Its maps are read as those of other
/// [`hdf5`](super::hdf5) files.
pub(crate) const NETCDF4: Format =
    Format::new("netcdf4", "netCDF-4", read_netcdf4).changed(&[CONVENTIONS, DEGREES, AXES]);

fn read_netcdf4(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let container = Container::of_format(bytes)?;
    let root = container.root().map_err(|_| FormatError::Signature)?;
    let attributes = container.group_attributes(&root).map_err(|_| FormatError::Signature)?;
    let members = container.members(&root, "the root group").map_err(|_| FormatError::Signature)?;
    let is_variable = |dataset: &Dataset| {
        ["_Netcdf4Dimid", "DIMENSION_LIST"].iter().any(|name| dataset.attribute(name).is_ok())
    };
    if attributes.get("_NCProperties").is_none() && !members.datasets.iter().any(is_variable) {
        return Err(FormatError::Signature);
    }
    maps(&container, &root, members)
}

/// DATX files of Zygo, which are HDF5 files.
///
/// The datasets in `Data/Surface` or, in older files, the dataset `Measurement/Surface` are maps.
/// Lines run along x; the first line has y = 0. The sides are nodes × step; the step is the second
/// parameter of the attributes `X Converter` and `Y Converter`, in metres per pixel. The attribute
/// `Unit` names a unit of length or `Fringes`. A fringe is the product of `Wavelength` in metres,
/// `Interferometric Scale Factor` and `Obliquity Factor`. The number `No Data` marks missing
/// points.
///
/// The layout was taken from the readers of SurfaceTopography, prysm, Gwyddion and datxpy.
pub(crate) const DATX: Format = Format::new("datx", "Zygo DATX", read_datx)
    .changed(&["integers may have fewer bits than their bytes"]);

fn read_datx(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let container = Container::of_format(bytes)?;
    let datasets = datx_surfaces(&container).ok_or(FormatError::Signature)?;
    let channels = datasets.iter().map(|dataset| datx_channel(&container, dataset));
    at_least_one(channels, "surface")
}

/// Returns the datasets with surfaces, or `None` if the file has none that Zygo wrote.
fn datx_surfaces(container: &Container) -> Option<Vec<Dataset>> {
    let root = container.root().ok()?;
    let datasets = match root.group("Data").and_then(|data| data.group("Surface")) {
        Ok(group) => container.members(&group, "Data/Surface").ok()?.datasets,
        Err(_) => vec![root.group("Measurement").ok()?.dataset("Surface").ok()?],
    };
    let is_surface = |dataset: &Dataset| dataset.attribute("Unit").is_ok();
    let surfaces: Vec<Dataset> = datasets.into_iter().filter(is_surface).collect();
    (!surfaces.is_empty()).then_some(surfaces)
}

fn datx_channel(container: &Container, dataset: &Dataset) -> Result<Channel<'static>, FormatError> {
    let attributes = container.attributes(dataset)?;
    let marker = attributes.number("No Data").map_or(Missing::None, Missing::Around);
    let raster = container.raster(dataset)?.missing(marker);
    let unit = attributes.text("Unit")?.ok_or_else(|| FormatError::missing("Unit"))?;
    let (unit, scale) = if unit == "Fringes" {
        let names = ["Wavelength", "Interferometric Scale Factor", "Obliquity Factor"];
        let required = |name| attributes.number(name).ok_or_else(|| FormatError::missing(name));
        let [wavelength, scale, obliquity] = names.map(|name| factor(name, required(name)?));
        ("m", wavelength? * scale? * obliquity?)
    } else {
        (unit, 1.0)
    };
    let [nodes_x, nodes_y] = raster.nodes();
    let size = match (datx_step(dataset, 'X')?, datx_step(dataset, 'Y')?) {
        (Some(x), Some(y)) => Size::metres([nodes_x as f64 * x, nodes_y as f64 * y])?,
        _ => Size::Unknown,
    };
    Ok(Channel::new("surface", Unit::parse(unit), size, raster.scaled(scale, 0.0)))
}

/// Returns the step along an axis in metres. It is unknown if the attribute is missing, or zero
/// because the instrument was not calibrated.
fn datx_step(dataset: &Dataset, axis: char) -> Result<Option<f64>, FormatError> {
    let name = format!("{axis} Converter");
    let Ok(converter) = dataset.attribute(&name) else { return Ok(None) };
    let base = datx_member(dataset, &converter, "BaseUnit", 1);
    let unit = base.map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    if unit != "Pixels" {
        return Err(FormatError::value(&format!("unit of {name}"), unit, "Pixels"));
    }
    let parameters = datx_member(dataset, &converter, "Parameters", 8).unwrap_or_default();
    let (parameters, _) = parameters.as_chunks::<8>();
    let missing = || FormatError::missing(format!("second parameter of {name}"));
    let step = f64::from_le_bytes(*parameters.get(1).ok_or_else(missing)?);
    Ok((step != 0.0).then_some(step))
}

/// Returns the bytes of a member of variable length of a compound attribute. `size` is the size of
/// an element.
fn datx_member(
    dataset: &Dataset,
    attribute: &Attribute,
    name: &str,
    size: usize,
) -> Option<Vec<u8>> {
    let Datatype::Compound { fields, .. } = &attribute.datatype else { return None };
    let field = fields.iter().find(|field| field.name == name)?;
    let start = field.byte_offset as usize;
    let end = start.checked_add(dataset.vlen_reference_size())?;
    let reference = attribute.raw_data.get(start..end)?;
    dataset.resolve_vlen_reference_bytes(reference, size).ok()
}

/// NHF files of Nanosurf Studio, which are HDF5 files.
///
/// A group of a measurement states points and lines of the scan and its sides in metres; groups in
/// it, such as `Forward`, have a one-dimensional dataset for each channel. Version 1 names them
/// `image_points_per_line`, `image_number_of_lines`, `image_size_x` and `image_size_y`, and
/// version 2 `rect_axis_size` and `rect_axis_range`, both in the order y, x. Lines run along x; the
/// first line has y = 0. The integers of the type span the calibrated range. The smallest integer,
/// which is also the fill of the dataset, marks a point that was not measured; in version 2 it is
/// no part of the range.
///
/// The layout is that of a file of 2023 in nanosurf-apps 2.0.7 (version 1.1) and of the reader of
/// nanosurf-utils 2.0.7. NSFopen 2.2.4 returns the marker as a height, and folds rectangular scans
/// of version 1. Channels without calibration have numbers without a unit.
pub(crate) const NHF: Format = Format::new("nhf", "Nanosurf NHF", read_nhf);

fn read_nhf(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
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
        let Some(scan) = NhfScan::new(&attributes, version)? else { continue };
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
struct NhfScan {
    nodes: [usize; 2],
    size: Size,
    /// True if the marker of missing points is no part of the calibrated range (version 2).
    excludes_marker: bool,
}

impl NhfScan {
    /// Returns `None` if the group is not a measurement of a rectangle.
    fn new(attributes: &Attributes, version: f64) -> Result<Option<NhfScan>, FormatError> {
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
        Ok(Some(NhfScan { nodes, size, excludes_marker: version >= 2.0 }))
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
        let raster = Raster::rows(self.nodes, element, order, bytes)?
            .missing(marker.map_or(Missing::None, Missing::Value));
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

/// HDF5 files of JPK instruments (now Bruker) with the extension `h5-jpk`, which hold the images of
/// a fast scan.
///
/// A group `Measurement_000` has the sides of the grid in metres and a group for each channel. The
/// dataset of a channel has a row for each node and a column for each frame. Lines of nodes run
/// along x; the first line has the largest y unless the grid is reflected. The attributes
/// `net-encoder` convert the stored integers to the unit of the default calibration. Each frame is
/// a channel here.
///
/// `sample_0.h5-jpk` in the tests of AFMReader 0.0.7 shows the layout.
pub(crate) const JPK: Format = Format::new("h5-jpk", "JPK HDF5 images", read_jpk)
    .changed(&["integers may have fewer bits than their bytes"]);

fn read_jpk(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
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
        channels.extend(jpk_scan(&container, group, attributes, &prefix)?);
    }
    at_least_one(channels.into_iter().map(Ok), "channel")
}

/// Reads the channels of a scan. Their names start with `prefix`.
fn jpk_scan(
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
        let Some(name) = jpk_name(&attributes)? else { continue };
        let datasets = container.members(&group, group.name())?.datasets;
        let mut datasets = datasets.iter().filter(|dataset| has_jpk_frames(dataset, nodes));
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
fn jpk_name(attributes: &Attributes) -> Result<Option<String>, FormatError> {
    let name = attributes.text("channel.fancy-name")?.or(attributes.text("channel.name")?);
    let is_retrace = attributes.text("retrace")? == Some("true");
    Ok(name.map(|name| directed(name.to_owned(), is_retrace)))
}

/// Returns true if a dataset has a row for each node. The thumbnail of a channel has none.
fn has_jpk_frames(dataset: &Dataset, nodes: [usize; 2]) -> bool {
    let &[rows, frames] = dataset.shape() else { return false };
    dataset.name() != "thumbnail" && rows == (nodes[0] * nodes[1]) as u64 && frames > 0
}
