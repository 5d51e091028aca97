//! X3P files of ISO 25178-72 (formerly ISO 5436-2). An X3P file is a zip archive with a description
//! of the axes, `main.xml`, and a binary matrix.
//!
//! Lengths are in metres; the sides are nodes × increment. Lines run along x; the first line has
//! y = 0. A height is number × increment + offset of the z axis. Integers are signed, as in the
//! openGPS library. NaN marks missing points. The file that `ValidPointsLink` names has one bit per
//! point, starting at the lowest bit of a byte; points whose bit is 0 are missing.
//!
//! A profile has the feature type PRF and one line of points along x.
//!
//! Instead of the binary file, `main.xml` may have a `DataList` with the numbers as text in the
//! same order, as x3pio 2.0.0 writes it with `storage = XML`. An empty `Datum` is a missing point.

use encoding_rs::{Encoding, UTF_8};
use roxmltree::Node;

use super::archive::{self, Archive};
use super::channel::{Channel, Sides};
use super::input::{decode_text, factor, finite, latin1, meaning, parsed};
use super::raster::{ByteOrder, Element, Raster, checked_nodes, map_bytes};
use super::unit::Unit;
use super::xml::{self, child, text, text_at};
use super::{Format, FormatError};

pub(crate) const FORMAT: Format =
    Format::new("x3p", "X3P, ISO 25178-72", read).changed(&["files with a list of data"]);

/// Maximum number of bytes of a `main.xml` that are read.
const MAX_XML_BYTES: usize = 16 << 20;
/// Smallest number of bytes of an XML node in a `DataList`. Each datum has two, itself and its
/// text.
const NODE_BYTES: usize = 8;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    if !bytes.starts_with(archive::SIGNATURE) {
        return Err(FormatError::Signature);
    }
    let mut archive = Archive::new(bytes)?;
    let index = index(&archive)?;
    let folder = index.strip_suffix("main.xml").unwrap_or_default();
    // A `DataList` may be long; its digits shrink to a third or less.
    let text = archive.file(&index, MAX_XML_BYTES.max(16 * bytes.len()))?;
    let text = xml_text(&text);
    let nodes_limit = u32::try_from(text.len() / NODE_BYTES).unwrap_or(u32::MAX).max(1 << 16);
    let document = xml::document("main.xml", &text, nodes_limit)?;
    Ok(vec![channel(document.root_element(), &mut archive, folder)?])
}

/// Decodes XML in the encoding of its byte order mark or of its declaration.
///
/// Some programs declare UTF-8 and write ISO-8859-1.
fn xml_text(bytes: &[u8]) -> String {
    let start = latin1(&bytes[..bytes.len().min(200)]);
    let label = start.split_once("encoding=").and_then(|(_, rest)| rest.split(['"', '\'']).nth(1));
    let declared = label.and_then(|label| Encoding::for_label(label.as_bytes())).unwrap_or(UTF_8);
    match declared.decode(bytes) {
        (text, _, false) => text.into_owned(),
        (_, _, true) => decode_text(bytes),
    }
}

/// Returns the path of `main.xml` in the archive. Some programs put all files into a folder.
fn index(archive: &Archive<'_>) -> Result<String, FormatError> {
    let names = || archive.names();
    let found = names().filter(|name| *name == "main.xml" || name.ends_with("/main.xml"));
    let highest = found.min_by_key(|name| (name.matches('/').count(), name.to_string()));
    highest.map(String::from).ok_or_else(|| {
        let listed: Vec<_> = names().take(4).collect();
        let names = listed.join(", ");
        FormatError::unsupported(format!("the zip archive has no `main.xml`; it has {names}"))
    })
}

/// Types of the numbers.
const TYPES: [(&str, Element); 4] =
    [("I", Element::I16), ("L", Element::I32), ("F", Element::F32), ("D", Element::F64)];

/// Reads the map that `main.xml` describes, whose root element is `root`.
fn channel<'a>(
    root: Node<'_, '_>,
    archive: &mut Archive<'a>,
    folder: &str,
) -> Result<Channel<'a>, FormatError> {
    let feature = text_at(root, &["Record1", "FeatureType"])?;
    let allowed = "SUR, a surface, or PRF, a profile";
    let is_profile = meaning("FeatureType", feature, allowed, &[("SUR", false), ("PRF", true)])?;
    // A profile may have no y axis.
    for axis in ["CX", "CY"].into_iter().take(if is_profile { 1 } else { 2 }) {
        let kind = text_at(root, &["Record1", "Axes", axis, "AxisType"])?;
        let allowed = "I, an evenly spaced axis";
        meaning(&format!("AxisType of {axis}"), kind, allowed, &[("I", ())])?;
    }
    let size = |name| {
        let path = ["Record3", "MatrixDimension", name];
        parsed::<i64>(&path.join("/"), text_at(root, &path)?, "an integer")
    };
    meaning("SizeZ", size("SizeZ")?, "1, a single layer", &[(1, ())])?;
    let lines = size("SizeY")?;
    if is_profile && lines != 1 {
        return Err(FormatError::value("SizeY", lines, "1, the single line of a profile"));
    }
    let nodes = checked_nodes([size("SizeX")?, lines])?;
    let axis = |name, entry, otherwise| -> Result<f64, FormatError> {
        let path = ["Record1", "Axes", name, entry];
        let number = xml::number(&path.join("/"), child(root, &path))?;
        Ok(number.unwrap_or(otherwise))
    };
    let step = axis("CX", "Increment", 1.0)?;
    let steps = [step, if is_profile { step } else { axis("CY", "Increment", 1.0)? }];
    let kind = text_at(root, &["Record1", "Axes", "CZ", "DataType"])?;
    let element = meaning("DataType of CZ", kind, "D, F, I or L", &TYPES)?;
    let scale = factor("Increment of CZ", axis("CZ", "Increment", 1.0)?)?;
    let offset = finite("Offset of CZ", axis("CZ", "Offset", 0.0)?)?;
    let path = |link: &str| {
        let link = link.replace('\\', "/");
        format!("{folder}{}", link.trim_start_matches("./"))
    };
    let raster = if let Some(list) = child(root, &["Record3", "DataList"]) {
        Raster::from_words(nodes, data(list)?)?
    } else {
        let numbers = text_at(root, &["Record3", "DataLink", "PointDataLink"])?;
        let stored = archive.exactly(&path(numbers), map_bytes(nodes, element))?;
        let valid = text(child(root, &["Record3", "DataLink", "ValidPointsLink"]));
        let marks = valid.map(|link| marks(archive, &path(link), nodes)).transpose()?;
        Raster::rows(nodes, element, ByteOrder::Little, stored)?.masked(marks)
    };
    let metre = Unit::Length(1.0);
    let size = Sides::of_steps(nodes, steps, &metre)?;
    Ok(Channel::new("heights", metre, size, raster.scaled(scale, offset)))
}

/// Reads the file of the valid points, and returns a mask of the missing ones.
fn marks<'a>(
    archive: &mut Archive<'a>,
    path: &str,
    nodes: [usize; 2],
) -> Result<Raster<'a>, FormatError> {
    let count = nodes[0] * nodes[1];
    let bits = archive.exactly(path, count.div_ceil(8))?;
    let is_missing = |point: usize| 1 - (bits[point / 8] >> (point % 8) & 1);
    let marks: Vec<u8> = (0..count).map(is_missing).collect();
    Raster::rows(nodes, Element::U8, ByteOrder::Little, marks)
}

/// Returns the numbers of a `DataList`; an empty datum is NaN.
fn data(list: Node<'_, '_>) -> Result<Vec<f64>, FormatError> {
    let data = list.children().filter(|child| child.tag_name().name() == "Datum");
    let numbers = data.map(|datum| match datum.text().unwrap_or_default().trim() {
        "" => Ok(f64::NAN),
        text => parsed("Datum", text, "a number or nothing"),
    });
    numbers.collect()
}
