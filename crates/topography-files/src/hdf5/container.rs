//! Opened HDF5 files: groups, datasets and their numbers.

use std::cell::Cell;

use hdf5_reader::btree_v1::collect_btree_v1_leaves_storage;
use hdf5_reader::btree_v2::{BTreeV2Header, BTreeV2Record, collect_btree_v2_records_storage};
use hdf5_reader::error::Error;
use hdf5_reader::fractal_heap::FractalHeap;
use hdf5_reader::group::Group;
use hdf5_reader::io::Cursor;
use hdf5_reader::local_heap::LocalHeap;
use hdf5_reader::messages::layout::{ChunkIndexing, DataLayout};
use hdf5_reader::messages::link_info::LinkInfoMessage;
use hdf5_reader::messages::symbol_table_msg::SymbolTableMessage;
use hdf5_reader::messages::{HdfMessage, link};
use hdf5_reader::symbol_table::SymbolTableNode;
use hdf5_reader::{Dataset, Hdf5File, OpenOptions};

use super::super::FormatError;
use super::super::input::decoded_limit;
use super::super::labelled::Attributes;
use super::super::raster::{ByteOrder, Element, Raster, checked_nodes};
use super::filters::{filters, unknown};
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
            link_names(&self.file, group).map_err(|error| FormatError::damaged(name, error))?;
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
        let &[first, second] = dataset.shape() else {
            let dimensions = format!("dimensions of {}", dataset.name());
            return Err(FormatError::value(&dimensions, dataset.ndim(), "2"));
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
        let mut pipeline = &[][..];
        for message in &header.messages {
            match message {
                HdfMessage::DataLayout(message)
                    if has_misplaced_chunks(dataset, &message.layout) =>
                {
                    return Err(FormatError::unsupported(format!(
                        "the places of the chunks of {part} are not known, because its `maxshape` \
                         is larger than its shape; copy the file with `h5repack`"
                    )));
                }
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
        let bytes = dataset.read_raw_bytes().map_err(damaged)?;
        Ok((stored.element, stored.order, stored.normal(bytes)))
    }
}

/// Returns true if `hdf5-reader` 0.12.1 places the chunks of a dataset wrongly.
///
/// Chunks of an implicit or fixed-array index are counted along the maximum shape of the dataset,
/// but the crate counts them along the current shape. The two differ if the maximum of an axis
/// other than the first is larger. (HDF5 1.10 and later write such indices with
/// `libver="latest"` and a finite `maxshape`.)
fn has_misplaced_chunks(dataset: &Dataset, layout: &DataLayout) -> bool {
    use ChunkIndexing::{FixedArray, Implicit};
    let DataLayout::Chunked { chunk_indexing: Some(FixedArray { .. } | Implicit), .. } = layout
    else {
        return false;
    };
    let (Some(chunk), Some(most)) = (dataset.chunks(), dataset.max_dims()) else { return false };
    let lengths = dataset.shape().iter().zip(most).zip(chunk).skip(1);
    lengths.into_iter().any(|((shape, most), chunk)| {
        let chunk = u64::from(chunk.max(1));
        shape.div_ceil(chunk) != most.div_ceil(chunk)
    })
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

/// Returns the names of all links of a group.
///
/// `hdf5-reader` 0.12.1 lists members only if it can open all of them; a virtual dataset, whose
/// layout it does not know, hides the others.
fn link_names(file: &Hdf5File, group: &Group) -> Result<Vec<String>, Error> {
    let header = file.get_or_parse_header(group.address())?;
    let mut names = Vec::new();
    for message in &header.messages {
        match message {
            HdfMessage::SymbolTable(table) => names.extend(old_link_names(file, group, table)?),
            HdfMessage::Link(link) => names.push(link.name.clone()),
            HdfMessage::LinkInfo(info) => names.extend(dense_link_names(file, group, info)?),
            _ => {}
        }
    }
    Ok(names)
}

/// Reads the symbol table of groups that HDF5 writes by default.
fn old_link_names(
    file: &Hdf5File,
    group: &Group,
    table: &SymbolTableMessage,
) -> Result<Vec<String>, Error> {
    let (storage, offset, length) = (file.storage(), group.offset_size(), group.length_size());
    let heap = LocalHeap::parse_at_storage(storage, table.heap_address, offset, length)?;
    let (address, none) = (table.btree_address, None);
    let nodes = collect_btree_v1_leaves_storage(storage, address, offset, length, none, &[], None)?;
    let mut names = Vec::new();
    for (_, address) in nodes {
        // Signature, version and number of entries, whose size follows from that of an offset.
        let head = storage.read_range(address, 8)?;
        let count = u16::from_le_bytes([head.as_ref()[6], head.as_ref()[7]]);
        let entry = 2 * usize::from(offset) + 24;
        let bytes = storage.read_range(address, 8 + usize::from(count) * entry)?;
        let node = SymbolTableNode::parse(&mut Cursor::new(bytes.as_ref()), offset, length)?;
        for entry in node.entries {
            names.push(heap.get_string_storage(entry.link_name_offset, storage)?);
        }
    }
    Ok(names)
}

/// Reads the links of a large group in the format of HDF5 1.8 and later.
fn dense_link_names(
    file: &Hdf5File,
    group: &Group,
    info: &LinkInfoMessage,
) -> Result<Vec<String>, Error> {
    let (storage, offset, length) = (file.storage(), group.offset_size(), group.length_size());
    if Cursor::is_undefined_offset(info.fractal_heap_address, offset) {
        return Ok(vec![]);
    }
    let heap = FractalHeap::parse_at_storage(storage, info.fractal_heap_address, offset, length)?;
    let address = info.btree_name_index_address;
    let tree = BTreeV2Header::parse_at_storage(storage, address, offset, length)?;
    let records =
        collect_btree_v2_records_storage(storage, &tree, offset, length, None, &[], None)?;
    let mut names = Vec::new();
    for record in records {
        let BTreeV2Record::LinkNameHash { heap_id, .. } = record else { continue };
        let bytes = heap.get_object_storage(&heap_id, storage, offset, length)?;
        names.push(link::parse(&mut Cursor::new(&bytes), offset, length, bytes.len())?.name);
    }
    Ok(names)
}
