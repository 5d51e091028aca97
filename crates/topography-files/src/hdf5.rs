//! HDF5 files with maps, and helpers for the formats that are built on HDF5.
//!
//! The crate `hdf5-reader` decodes the container: it is pure Rust and reads what h5py and netCDF4
//! write, that is, old and new groups, chunks with all kinds of index, deflate, shuffle, checksums
//! and text of variable length. An own reader of this subset would need a thousand lines.
//!
//! A file of the format `hdf5` follows no convention. Its channels are the two-dimensional datasets
//! of numbers in the root group or, if there are none, in all groups. The first index is x, as in
//! the reader of SurfaceTopography and in the 2048 × 2048 surface of the contact-mechanics
//! challenge. The attribute `unit` or `units` of a dataset is its unit. The size is unknown.
//!
//! Files of TopoStats have a dataset `pixel_to_nm_scaling`, which is the step in nanometres. Lines
//! of their images run along x, the first line has y = 0, and heights are in nanometres.

mod lzf;

use std::cell::Cell;
use std::collections::BTreeSet;

use hdf5_reader::group::Group;
use hdf5_reader::{Attribute, Dataset, Datatype, Hdf5File, OpenOptions};

use self::lzf::filters;
use super::channel::{Channel, Size};
use super::input::decoded_limit;
use super::raster::{ByteOrder, Element, Raster, checked_nodes};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub const FORMAT: Format =
    Format { name: "hdf5", title: "HDF5", version: 1, has_signature: true, read };

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Maximum number of groups that are searched for datasets.
const MAX_GROUPS: usize = 10_000;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let container = Container::open(bytes)?;
    let root = container.root()?;
    let (groups, datasets) = members(&root, "the root group")?;
    if let Some(step) = datasets.iter().find(|dataset| dataset.name() == "pixel_to_nm_scaling") {
        return topostats(&container, &datasets, step);
    }
    let mut maps = maps_of("", datasets);
    if maps.is_empty() {
        maps = nested_maps(groups)?;
    }
    let channels = maps.iter().map(|(name, dataset)| container.plain_map(name, dataset));
    at_least_one(channels, "two-dimensional dataset of numbers")
}

/// Reads the images of a file of TopoStats.
fn topostats(
    container: &Container,
    datasets: &[Dataset],
    step: &Dataset,
) -> Result<Vec<Channel<'static>>, FormatError> {
    let step = container.numbers(step)?;
    let &[step] = step.as_slice() else {
        let allowed = "one number";
        return Err(FormatError::value("pixel_to_nm_scaling", step.len(), allowed));
    };
    let images = datasets.iter().filter(|dataset| is_map(dataset));
    let images = images.filter(|dataset| dataset.name().starts_with("image"));
    let channels = images.map(|dataset| {
        let raster = container.raster(dataset, Lines::AlongX)?;
        let nanometres = Unit::parse("nm");
        let size = Size::new(raster.nodes().map(|nodes| nodes as f64 * step), &nanometres)?;
        Ok(Channel::new(dataset.name(), nanometres, size, raster))
    });
    at_least_one(channels, "image")
}

/// Opened file.
pub struct Container {
    file: Hdf5File,
    /// Number of bytes that may still be decoded. It keeps a damaged size from allocating memory.
    budget: Cell<usize>,
}

/// Direction of the stored lines of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lines {
    /// The second index of the dataset is x.
    AlongX,
    /// The second index of the dataset is y.
    AlongY,
}

/// Stored numbers: those that a [`Raster`] decodes, or integers of 64 bits.
#[derive(Debug, Clone, Copy)]
enum Stored {
    Element(Element),
    I64,
    U64,
}

impl Container {
    pub fn open(bytes: &[u8]) -> Result<Container, FormatError> {
        // A block of the user may precede the signature; its length is a power of two.
        let starts = std::iter::once(0).chain((9..u32::BITS - 1).map(|power| 1_usize << power));
        let mut starts = starts.take_while(|start| *start < bytes.len());
        if !starts.any(|start| bytes[start..].starts_with(SIGNATURE)) {
            return Err(FormatError::Signature);
        }
        let budget = decoded_limit(bytes.len());
        let options = OpenOptions::default()
            .with_filter_registry(filters())
            .with_max_chunk_bytes(budget)
            .with_max_read_bytes(budget);
        let file = Hdf5File::from_vec_with_options(bytes.to_vec(), options);
        let file = file.map_err(|error| FormatError::damaged("the HDF5 file", error))?;
        let needed = usize::try_from(file.superblock().eof_address).unwrap_or(usize::MAX);
        if needed > bytes.len() {
            return Err(FormatError::CutOff { needed, found: bytes.len() });
        }
        Ok(Container { file, budget: Cell::new(budget) })
    }

    /// Opens a file for a format that is built on HDF5. If the file is damaged, the error is that
    /// it does not have this format; the reader of HDF5 files then reports the damage.
    pub fn of_format(bytes: &[u8]) -> Result<Container, FormatError> {
        Container::open(bytes).map_err(|_| FormatError::Signature)
    }

    pub fn root(&self) -> Result<Group, FormatError> {
        self.file.root_group().map_err(|error| FormatError::damaged("the root group", error))
    }

    /// Reads a map of a file that follows no convention.
    fn plain_map(&self, name: &str, dataset: &Dataset) -> Result<Channel<'static>, FormatError> {
        let raster = self.raster(dataset, Lines::AlongY)?;
        let attributes = dataset.attributes();
        let unit = text(&attributes, "unit").or_else(|| text(&attributes, "units"));
        Ok(Channel::new(name, Unit::parse(&unit.unwrap_or_default()), Size::Unknown, raster))
    }

    /// Reads a two-dimensional dataset.
    pub fn raster(&self, dataset: &Dataset, lines: Lines) -> Result<Raster<'static>, FormatError> {
        let shape = dataset.shape().iter().map(|&count| i64::try_from(count).unwrap_or(i64::MAX));
        let shape: Vec<i64> = shape.collect();
        let &[first, second] = shape.as_slice() else {
            let dimensions = format!("dimensions of {}", dataset.name());
            return Err(FormatError::value(&dimensions, shape.len(), "2"));
        };
        let nodes = match lines {
            Lines::AlongX => [second, first],
            Lines::AlongY => [first, second],
        };
        let nodes = checked_nodes(nodes)?;
        let (stored, order, bytes) = self.bytes(dataset)?;
        match lines {
            Lines::AlongX => rows(nodes, stored, order, bytes),
            Lines::AlongY => match stored {
                Stored::Element(element) => Raster::columns(nodes, element, order, bytes),
                _ => Ok(Raster::from_columns(nodes, wide(stored, order, &bytes))),
            },
        }
    }

    /// Reads the frames of a two-dimensional dataset with a row for each node, in lines along x,
    /// and a column for each frame.
    pub fn frames(
        &self,
        dataset: &Dataset,
        nodes: [usize; 2],
    ) -> Result<Vec<Raster<'static>>, FormatError> {
        let (stored, order, bytes) = self.bytes(dataset)?;
        let size = match stored {
            Stored::Element(element) => element.size(),
            Stored::I64 | Stored::U64 => size_of::<u64>(),
        };
        let count = bytes.len() / size / (nodes[0] * nodes[1]);
        let frames = (0..count).map(|frame| {
            let column = bytes.chunks_exact(size).skip(frame).step_by(count);
            rows(nodes, stored, order, column.flatten().copied().collect())
        });
        frames.collect()
    }

    /// Reads the numbers of a dataset of any shape.
    fn numbers(&self, dataset: &Dataset) -> Result<Vec<f64>, FormatError> {
        let (stored, order, bytes) = self.bytes(dataset)?;
        match stored {
            Stored::Element(element) => {
                let nodes = [bytes.len() / element.size(), 1];
                Ok(Raster::rows(nodes, element, order, bytes)?.decode())
            }
            Stored::I64 | Stored::U64 => Ok(wide(stored, order, &bytes)),
        }
    }

    fn bytes(&self, dataset: &Dataset) -> Result<(Stored, ByteOrder, Vec<u8>), FormatError> {
        let part = format!("dataset {}", dataset.name());
        let Some((stored, order)) = stored(dataset.dtype()) else {
            let found = format!("{:?}", dataset.dtype());
            let allowed = "integers, or floats of 32 or 64 bits";
            return Err(FormatError::value(&format!("type of {part}"), found, allowed));
        };
        let damaged = |error| FormatError::damaged(&part, error);
        let needed = dataset.raw_byte_len().map_err(damaged)?;
        let Some(left) = self.budget.get().checked_sub(needed).filter(|_| needed > 0) else {
            let reason = format!("the file is too short for the {needed} bytes that are needed");
            return Err(FormatError::damaged(&part, reason));
        };
        self.budget.set(left);
        Ok((stored, order, dataset.read_raw_bytes().map_err(damaged)?))
    }
}

/// Returns the groups and datasets of a group.
pub fn members(group: &Group, name: &str) -> Result<(Vec<Group>, Vec<Dataset>), FormatError> {
    group.members().map_err(|error| FormatError::damaged(name, error))
}

/// Returns the text of an attribute, or the first of its texts.
pub fn text(attributes: &[Attribute], name: &str) -> Option<String> {
    let texts = attribute(attributes, name)?.read_strings().ok()?;
    texts.into_iter().next()
}

/// Returns the number of an attribute, or the first of its numbers.
pub fn number(attributes: &[Attribute], name: &str) -> Option<f64> {
    attribute(attributes, name)?.read_as_f64().ok()
}

pub fn attribute<'a>(attributes: &'a [Attribute], name: &str) -> Option<&'a Attribute> {
    attributes.iter().find(|attribute| attribute.name == name)
}

/// Returns the maps among the datasets with their names, which start with the path of their group.
fn maps_of(path: &str, datasets: Vec<Dataset>) -> Vec<(String, Dataset)> {
    let maps = datasets.into_iter().filter(is_map);
    maps.map(|dataset| (format!("{path}{}", dataset.name()), dataset)).collect()
}

/// Returns the maps of all groups below the given ones.
fn nested_maps(groups: Vec<Group>) -> Result<Vec<(String, Dataset)>, FormatError> {
    let mut maps = Vec::new();
    let mut visited = BTreeSet::new();
    let mut left: Vec<(String, Group)> =
        groups.into_iter().rev().map(|group| (format!("{}/", group.name()), group)).collect();
    while let Some((path, group)) = left.pop() {
        // Links may form loops.
        if !visited.insert(group.address()) || visited.len() > MAX_GROUPS {
            continue;
        }
        let (groups, datasets) = members(&group, &path)?;
        maps.extend(maps_of(&path, datasets));
        let below = groups.into_iter().rev();
        left.extend(below.map(|group| (format!("{path}{}/", group.name()), group)));
    }
    Ok(maps)
}

fn is_map(dataset: &Dataset) -> bool {
    let shape = dataset.shape();
    shape.len() == 2 && !shape.contains(&0) && stored(dataset.dtype()).is_some()
}

/// Returns the type and byte order of stored numbers, or `None` if they are not numbers.
fn stored(datatype: &Datatype) -> Option<(Stored, ByteOrder)> {
    let (stored, order) = match datatype {
        Datatype::FloatingPoint { size: 4, byte_order } => {
            (Stored::Element(Element::F32), byte_order)
        }
        Datatype::FloatingPoint { size: 8, byte_order } => {
            (Stored::Element(Element::F64), byte_order)
        }
        Datatype::FixedPoint { size, signed, byte_order } => {
            let stored = match (size, signed) {
                (1, true) => Stored::Element(Element::I8),
                (1, false) => Stored::Element(Element::U8),
                (2, true) => Stored::Element(Element::I16),
                (2, false) => Stored::Element(Element::U16),
                (4, true) => Stored::Element(Element::I32),
                (4, false) => Stored::Element(Element::U32),
                (8, true) => Stored::I64,
                (8, false) => Stored::U64,
                _ => return None,
            };
            (stored, byte_order)
        }
        _ => return None,
    };
    let order = match order {
        hdf5_reader::ByteOrder::LittleEndian => ByteOrder::Little,
        hdf5_reader::ByteOrder::BigEndian => ByteOrder::Big,
    };
    Some((stored, order))
}

/// Creates a raster of lines along x.
fn rows(
    nodes: [usize; 2],
    stored: Stored,
    order: ByteOrder,
    bytes: Vec<u8>,
) -> Result<Raster<'static>, FormatError> {
    match stored {
        Stored::Element(element) => Raster::rows(nodes, element, order, bytes),
        Stored::I64 | Stored::U64 => Ok(Raster::from_rows(nodes, wide(stored, order, &bytes))),
    }
}

/// Decodes integers of 64 bits.
fn wide(stored: Stored, order: ByteOrder, bytes: &[u8]) -> Vec<f64> {
    let (chunks, _) = bytes.as_chunks::<8>();
    let bits = chunks.iter().map(|chunk| match order {
        ByteOrder::Little => u64::from_le_bytes(*chunk),
        ByteOrder::Big => u64::from_be_bytes(*chunk),
    });
    let is_signed = matches!(stored, Stored::I64);
    bits.map(|bits| if is_signed { bits as i64 as f64 } else { bits as f64 }).collect()
}
