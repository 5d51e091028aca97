//! Opened HDF5 files: groups, datasets and their numbers.

use std::cell::Cell;

use hdf5_reader::group::Group;
use hdf5_reader::messages::HdfMessage;
use hdf5_reader::messages::layout::{ChunkIndexing, DataLayout};
use hdf5_reader::{Attribute, Dataset, Datatype, Hdf5File, OpenOptions, chunk_index, fixed_array};

use super::super::FormatError;
use super::super::input::{decode_text, decoded_limit};
use super::super::labelled::Attributes;
use super::super::raster::{ByteOrder, Element, Raster, checked_nodes};
use super::filters::{filters, unknown};
use super::links;
use super::stored::{self, Stored};

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Opened file.
pub(crate) struct Container {
    file: Hdf5File,
    /// Number of bytes that may still be decoded. It keeps a damaged size from allocating memory.
    budget: Cell<usize>,
}

/// Members of a group.
pub(crate) struct Members {
    pub(crate) groups: Vec<Group>,
    pub(crate) datasets: Vec<Dataset>,
    /// Reasons why other members could not be opened.
    pub(crate) unreadable: Vec<FormatError>,
}

impl Container {
    pub(crate) fn open(bytes: &[u8]) -> Result<Container, FormatError> {
        // A block of the user may precede the signature; its length is a power of two.
        let all = std::iter::once(0).chain((9..u32::BITS - 1).map(|power| 1_usize << power));
        let mut starts = all.take_while(|start| *start < bytes.len());
        if !starts.any(|start| bytes[start..].starts_with(SIGNATURE)) {
            return Err(FormatError::Signature);
        }
        let budget = decoded_limit(bytes.len());
        let options = OpenOptions::default()
            .with_filter_registry(filters(budget))
            .with_max_chunk_bytes(budget)
            .with_max_read_bytes(budget);
        let opened = Hdf5File::from_vec_with_options(bytes.to_vec(), options);
        let file = opened.map_err(|error| FormatError::damaged("the HDF5 file", error))?;
        let needed = usize::try_from(file.superblock().eof_address).unwrap_or(usize::MAX);
        if needed > bytes.len() {
            return Err(FormatError::CutOff { needed, found: bytes.len() });
        }
        Ok(Container { file, budget: Cell::new(budget) })
    }

    /// Opens a file for a format that is built on HDF5. If the file is damaged, the error is that
    /// it does not have this format; the reader of HDF5 files then reports the damage.
    pub(crate) fn of_format(bytes: &[u8]) -> Result<Container, FormatError> {
        Container::open(bytes).map_err(|_| FormatError::Signature)
    }

    pub(crate) fn file(&self) -> &Hdf5File {
        &self.file
    }

    pub(crate) fn root(&self) -> Result<Group, FormatError> {
        self.file.root_group().map_err(|error| FormatError::damaged("the root group", error))
    }

    /// Returns the groups and datasets of a group. A member that cannot be opened does not hide the
    /// others.
    pub(crate) fn members(&self, group: &Group, name: &str) -> Result<Members, FormatError> {
        if let Ok((groups, datasets)) = group.members() {
            return Ok(Members { groups, datasets, unreadable: vec![] });
        }
        let names =
            links::names(&self.file, group).map_err(|error| FormatError::damaged(name, error))?;
        let mut members = Members { groups: vec![], datasets: vec![], unreadable: vec![] };
        for name in names {
            match (group.dataset(&name), group.group(&name)) {
                (Ok(dataset), _) => members.datasets.push(dataset),
                (_, Ok(group)) => members.groups.push(group),
                (Err(error), _) => members.unreadable.push(unopened(&name, &error.to_string())),
            }
        }
        Ok(members)
    }

    pub(crate) fn attributes(&self, dataset: &Dataset) -> Result<Attributes, FormatError> {
        let encoded = dataset.raw_attributes();
        let raw = encoded.map_err(|error| FormatError::damaged(&part(dataset), error))?;
        Ok(stored::attributes(&self.file, raw))
    }

    pub(crate) fn group_attributes(&self, group: &Group) -> Result<Attributes, FormatError> {
        let raw =
            group.raw_attributes().map_err(|error| FormatError::damaged(group.name(), error))?;
        Ok(stored::attributes(&self.file, raw))
    }

    /// Reads a two-dimensional dataset whose second index is x.
    pub(crate) fn raster(&self, dataset: &Dataset) -> Result<Raster<'static>, FormatError> {
        let shape: Vec<i64> =
            dataset.shape().iter().map(|&count| i64::try_from(count).unwrap_or(i64::MAX)).collect();
        let &[first, second] = shape.as_slice() else {
            let dimensions = format!("dimensions of {}", dataset.name());
            return Err(FormatError::value(&dimensions, shape.len(), "2"));
        };
        let nodes = checked_nodes([second, first])?;
        let (element, order, bytes) = self.bytes(dataset)?;
        Raster::rows(nodes, element, order, bytes)
    }

    /// Reads the frames of a two-dimensional dataset with a row for each node, in lines along x,
    /// and a column for each frame.
    pub(crate) fn frames(
        &self,
        dataset: &Dataset,
        nodes: [usize; 2],
    ) -> Result<Vec<Raster<'static>>, FormatError> {
        let (element, order, bytes) = self.bytes(dataset)?;
        let size = element.size();
        let count = bytes.len() / size / (nodes[0] * nodes[1]);
        let frames = (0..count).map(|frame| {
            let column = bytes.chunks_exact(size).skip(frame).step_by(count);
            Raster::rows(nodes, element, order, column.flatten().copied().collect::<Vec<_>>())
        });
        frames.collect()
    }

    /// Reads the numbers of a dataset of any shape.
    pub(crate) fn numbers(&self, dataset: &Dataset) -> Result<Vec<f64>, FormatError> {
        let (element, order, bytes) = self.bytes(dataset)?;
        Ok(element.numbers(order, &bytes))
    }

    /// Returns the number that stands at points of a dataset that were never written, if the
    /// program that created the dataset chose one other than zero.
    pub(crate) fn unwritten(&self, dataset: &Dataset) -> Option<f64> {
        let stored = Stored::of_dataset(dataset).ok()?;
        let fill = dataset.fill_value().filter(|fill| fill.defined)?.value.as_ref()?;
        let number = stored.element.numbers(stored.order, &stored.normal(fill.clone()));
        // Every byte may be a number.
        number.first().copied().filter(|number| *number != 0.0 && stored.element.size() > 1)
    }

    /// Returns the numbers of a dataset in row-major order, their type and byte order.
    pub(crate) fn bytes(
        &self,
        dataset: &Dataset,
    ) -> Result<(Element, ByteOrder, Vec<u8>), FormatError> {
        let part = part(dataset);
        let stored = Stored::of_dataset(dataset)?;
        let damaged = |error| FormatError::damaged(&part, error);
        let header = self.file.get_or_parse_header(dataset.address()).map_err(damaged)?;
        let mut layout = None;
        let mut pipeline = &[][..];
        for message in &header.messages {
            match message {
                HdfMessage::DataLayout(message) => layout = Some(&message.layout),
                HdfMessage::FilterPipeline(message) => pipeline = &message.filters,
                HdfMessage::ExternalFiles(_) => {
                    let what = format!(
                        "the numbers of {part} are in another file; copy them into this one with \
                         `h5repack`"
                    );
                    return Err(FormatError::unsupported(what));
                }
                _ => {}
            }
        }
        let mut unknown = pipeline.iter().filter_map(|one| unknown(one.id, one.name.as_deref()));
        if let Some(filter) = unknown.next() {
            return Err(FormatError::unsupported(format!(
                "{part} is compressed by filter {filter}, which is not supported; remove it with \
                 `h5repack -f NONE`"
            )));
        }
        let needed = dataset.raw_byte_len().map_err(damaged)?;
        let Some(left) = self.budget.get().checked_sub(needed).filter(|_| needed > 0) else {
            return Err(FormatError::unsupported(format!(
                "{part} takes {needed} bytes in memory, far more than heights in a file of this \
                 size; crop the map, or remove the compression with `h5repack -f NONE`"
            )));
        };
        self.budget.set(left);
        let bytes = match layout.and_then(|layout| Misplaced::new(dataset, layout)) {
            Some(chunks) => chunks.read(&self.file, dataset, pipeline),
            None => dataset.read_raw_bytes(),
        };
        Ok((stored.element, stored.order, stored.normal(bytes.map_err(damaged)?)))
    }
}

/// Chunks whose places `hdf5-reader` 0.12.1 computes wrongly.
///
/// Chunks of an implicit or fixed-array index are counted along the maximum shape of the dataset,
/// but the crate counts them along the current shape. The two differ if the maximum of an axis
/// other than the first is larger. (HDF5 1.10 and later write such indices with
/// `libver="latest"` and a finite `maxshape`.)
struct Misplaced {
    address: u64,
    chunk: Vec<u32>,
    most: Vec<u64>,
    is_implicit: bool,
}

impl Misplaced {
    /// Returns `None` if `hdf5-reader` places the chunks of a dataset right.
    fn new(dataset: &Dataset, layout: &DataLayout) -> Option<Misplaced> {
        let DataLayout::Chunked { address, chunk_indexing: Some(index), .. } = layout else {
            return None;
        };
        let chunk = dataset.chunks()?;
        let is_implicit = match index {
            ChunkIndexing::Implicit => true,
            ChunkIndexing::FixedArray { .. } => false,
            _ => return None,
        };
        let most = dataset.max_dims()?;
        let lengths = dataset.shape().iter().zip(most).zip(&chunk);
        let mut counts = lengths.map(|((shape, most), chunk)| {
            let chunk = u64::from((*chunk).max(1));
            (shape.div_ceil(chunk), most.div_ceil(chunk))
        });
        counts.next();
        let is_wrong = counts.any(|(current, most)| current != most);
        is_wrong.then(|| Misplaced { address: *address, chunk, most: most.to_vec(), is_implicit })
    }

    /// Reads all chunks.
    fn read(
        &self,
        file: &Hdf5File,
        dataset: &Dataset,
        pipeline: &[hdf5_reader::messages::filter_pipeline::FilterDescription],
    ) -> Result<Vec<u8>, hdf5_reader::error::Error> {
        let size = dataset.raw_element_size()?;
        let storage = file.storage();
        let superblock = file.superblock();
        let entries = if self.is_implicit {
            chunk_index::collect_implicit_chunk_entries(
                self.address,
                &self.most,
                &self.chunk,
                size,
                None,
                storage.len(),
            )
        } else {
            fixed_array::collect_fixed_array_chunk_entries_storage(
                storage,
                self.address,
                superblock.offset_size,
                superblock.length_size,
                &self.most,
                &self.chunk,
                None,
            )
        }?;
        let shape: Vec<usize> = dataset.shape().iter().map(|&length| length as usize).collect();
        let chunk: Vec<usize> = self.chunk.iter().map(|&length| length as usize).collect();
        let stated = dataset.fill_value().and_then(|fill| fill.value.clone());
        let fill = stated.filter(|fill| fill.len() == size).unwrap_or_else(|| vec![0; size]);
        let mut bytes = fill.repeat(shape.iter().product());
        let length = chunk.iter().product::<usize>() * size;
        if length == 0 || chunk.len() != shape.len() || self.most.len() != shape.len() {
            let what = "the shape of its chunks is not that of a part of the dataset";
            return Err(hdf5_reader::error::Error::InvalidData(what.to_owned()));
        }
        let registry = filters(length);
        for entry in entries {
            let start: Vec<usize> = entry.offsets.iter().map(|&offset| offset as usize).collect();
            if start.iter().zip(&shape).any(|(start, length)| start >= length) {
                continue;
            }
            let stored_bytes = if pipeline.is_empty() { length } else { entry.size as usize };
            let stored = storage.read_range(entry.address, stored_bytes)?;
            let decoded = hdf5_reader::filters::apply_pipeline_with_limit(
                stored.as_ref(),
                pipeline,
                entry.filter_mask,
                size,
                Some(&registry),
                Some(length),
            )?;
            if decoded.len() != length {
                let what = format!("a chunk has {} bytes in place of {length}", decoded.len());
                return Err(hdf5_reader::error::Error::InvalidData(what));
            }
            place(&mut bytes, &shape, &decoded, &chunk, &start, size);
        }
        Ok(bytes)
    }
}

/// Copies the part of a chunk inside of the shape of the dataset.
fn place(
    bytes: &mut [u8],
    shape: &[usize],
    chunk_bytes: &[u8],
    chunk: &[usize],
    start: &[usize],
    size: usize,
) {
    let Some((&along, outer)) = chunk.split_last() else { return };
    let last = outer.len();
    let copied = along.min(shape[last] - start[last]) * size;
    for (line, from) in chunk_bytes.chunks_exact(along * size).enumerate() {
        // The indices of this line of the chunk along all dimensions but the last.
        let mut rest = line;
        let mut target = start[last];
        let mut stride = shape[last];
        let mut is_inside = true;
        for axis in (0..last).rev() {
            let at = start[axis] + rest % chunk[axis];
            rest /= chunk[axis];
            is_inside &= at < shape[axis];
            target += at * stride;
            stride *= shape[axis];
        }
        if is_inside {
            bytes[target * size..][..copied].copy_from_slice(&from[..copied]);
        }
    }
}

/// Returns the text of an attribute, or the first of its texts.
pub(crate) fn text(attributes: &[Attribute], name: &str) -> Option<String> {
    let attribute = attribute(attributes, name)?;
    match attribute.read_strings() {
        Ok(texts) => texts.into_iter().next(),
        // Text that is not UTF-8.
        Err(_)
            if matches!(attribute.datatype, Datatype::String { .. } | Datatype::VarLen { .. }) =>
        {
            let text = decode_text(&attribute.raw_data);
            Some(text.trim_end_matches('\0').to_owned())
        }
        Err(_) => None,
    }
}

/// Returns the number of an attribute, or the first of its numbers.
pub(crate) fn number(attributes: &[Attribute], name: &str) -> Option<f64> {
    attribute(attributes, name)?.read_as_f64().ok()
}

pub(crate) fn attribute<'a>(attributes: &'a [Attribute], name: &str) -> Option<&'a Attribute> {
    attributes.iter().find(|attribute| attribute.name == name)
}

fn part(dataset: &Dataset) -> String {
    format!("dataset `{}`", dataset.name())
}

/// Returns the error about a member that could not be opened.
fn unopened(name: &str, error: &str) -> FormatError {
    if error.contains("layout class 3") {
        return FormatError::unsupported(format!(
            "dataset `{name}` is virtual, its numbers are in other files; copy them with \
             `h5repack`"
        ));
    }
    FormatError::damaged(&format!("`{name}`"), error)
}
