//! Names of the members of a group.
//!
//! `hdf5-reader` 0.12.1 lists members only if it can open all of them; a virtual dataset, whose
//! layout it does not know, hides the others.

use hdf5_reader::Hdf5File;
use hdf5_reader::btree_v1::collect_btree_v1_leaves_storage;
use hdf5_reader::btree_v2::{BTreeV2Header, BTreeV2Record, collect_btree_v2_records_storage};
use hdf5_reader::error::Result;
use hdf5_reader::fractal_heap::FractalHeap;
use hdf5_reader::group::Group;
use hdf5_reader::io::Cursor;
use hdf5_reader::local_heap::LocalHeap;
use hdf5_reader::messages::link_info::LinkInfoMessage;
use hdf5_reader::messages::symbol_table_msg::SymbolTableMessage;
use hdf5_reader::messages::{HdfMessage, link};
use hdf5_reader::symbol_table::SymbolTableNode;

/// Returns the names of all links of a group.
pub(crate) fn names(file: &Hdf5File, group: &Group) -> Result<Vec<String>> {
    let header = file.get_or_parse_header(group.address())?;
    let mut names = Vec::new();
    for message in &header.messages {
        match message {
            HdfMessage::SymbolTable(table) => names.extend(old(file, group, table)?),
            HdfMessage::Link(link) => names.push(link.name.clone()),
            HdfMessage::LinkInfo(info) => names.extend(dense(file, group, info)?),
            _ => {}
        }
    }
    Ok(names)
}

/// Reads the symbol table of groups that HDF5 writes by default.
fn old(file: &Hdf5File, group: &Group, table: &SymbolTableMessage) -> Result<Vec<String>> {
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
fn dense(file: &Hdf5File, group: &Group, info: &LinkInfoMessage) -> Result<Vec<String>> {
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
