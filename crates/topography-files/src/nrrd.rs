//! NRRD files (nearly raw raster data, `.nrrd`), with a text header, an empty line, and numbers.
//!
//! The first axis is x; lines run along x, and the first has y = 0. A third axis is a list of
//! channels; axes of length one are dropped. The sides are `spacings` × points, the lengths of
//! `space directions` × points (pynrrd 1.0, ITK), or the range of `axis mins` and `axis maxs`, to
//! which a step is added if `centerings` says that points are nodes. `units` and `space units` have
//! the units of the axes and, in files of Gwyddion 2.62, `sampleunits` that of the heights. NaN
//! marks missing points. Numbers may be raw, text or compressed by gzip; files with separate data
//! are refused.

use flate2::read::GzDecoder;

use super::channel::{Channel, Sides};
use super::input::{Entries, after, decode_text, inflate};
use super::number;
use super::raster::{ByteOrder, Element, Raster, checked_nodes, map_bytes};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format = Format::new("nrrd", "nearly raw raster data", read)
    .changed(&["`space directions` give the sides"]);

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    after(bytes, b"NRRD000")?;
    let (header, data) = header(bytes)?;
    for name in ["datafile", "lineskip", "byteskip"] {
        if let Some(value) = header.get(name).filter(|value| *value != "0") {
            return Err(FormatError::value(name, value, "none, with the data in the same file"));
        }
    }
    let sizes: Vec<i64> = list(&header, "sizes")?;
    let long: Vec<usize> = (0..sizes.len()).filter(|&axis| sizes[axis] != 1).collect();
    // Axes of x and y; those of length one are left out unless too few are left.
    let axes = if long.len() < 2 { (0..sizes.len()).collect() } else { long };
    let kept: Vec<i64> = axes.iter().map(|&axis| sizes[axis]).collect();
    let (nodes, count) = match kept[..] {
        [x, y] => (checked_nodes([x, y])?, 1),
        [x, y, count] if (1..=1024).contains(&count) => (checked_nodes([x, y])?, count as usize),
        _ => {
            let found = header.text("sizes")?;
            return Err(FormatError::value("sizes", found, "two or three numbers"));
        }
    };
    let element = element(header.text("type")?)?;
    let order = ByteOrder::new(header.get("endian") == Some("big"));
    let size = size(&header, nodes, [axes[0], axes[1]])?;
    let name = header.get("content").filter(|name| !name.is_empty()).unwrap_or("heights");
    let unit = Unit::parse(header.get("sampleunits").unwrap_or_default());
    let one = map_bytes(nodes, element);
    let points = nodes[0] * nodes[1];
    let mut rasters: Vec<Raster<'_>> = Vec::new();
    match header.text("encoding")? {
        "raw" => {
            for index in 0..count {
                let part = data.get(index * one..).unwrap_or_default();
                rasters.push(Raster::rows(nodes, element, order, part)?);
            }
        }
        "gzip" | "gz" => {
            let inflated = inflate("the gzip data", GzDecoder::new(data), data.len(), one * count)?;
            for part in inflated.chunks_exact(one) {
                rasters.push(Raster::rows(nodes, element, order, part.to_vec())?);
            }
        }
        "ascii" | "text" | "txt" => {
            let numbers = numbers(data)?;
            for index in 0..count {
                let part = numbers.iter().copied().skip(index * points).take(points);
                rasters.push(Raster::from_words(nodes, part.collect())?);
            }
        }
        other => return Err(FormatError::value("encoding", other, "raw, text or gzip")),
    }
    let channels = rasters.into_iter().enumerate().map(|(index, raster)| {
        let name = if count == 1 { name.to_owned() } else { format!("{name} {}", index + 1) };
        Ok(Channel::new(name, unit.clone(), size.clone(), raster))
    });
    at_least_one(channels, "sizes")
}

/// Parses the header and returns its entries and the bytes after it. Names have lower case and no
/// spaces.
fn header(bytes: &[u8]) -> Result<(Entries, &[u8]), FormatError> {
    let mut entries = Entries::default();
    let mut offset = 0;
    for line in bytes.split_inclusive(|&byte| byte == b'\n') {
        offset += line.len();
        let line = decode_text(line);
        let line = line.trim_end();
        if line.is_empty() {
            return Ok((entries, &bytes[offset..]));
        }
        if let Some((name, value)) = line.split_once(':').filter(|_| !line.starts_with('#')) {
            let name = name.to_lowercase().replace(' ', "");
            entries.insert(&name, value.trim_start_matches('='));
        }
    }
    Err(FormatError::missing("an empty line after the header"))
}

fn list<T: std::str::FromStr>(header: &Entries, name: &str) -> Result<Vec<T>, FormatError> {
    let text = header.text(name)?;
    let words = text.split_whitespace().map(str::parse);
    words.collect::<Result<_, _>>().map_err(|_| FormatError::value(name, text, "numbers"))
}

fn element(name: &str) -> Result<Element, FormatError> {
    Ok(match name {
        "signed char" | "int8" | "int8_t" => Element::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => Element::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
            Element::I16
        }
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Element::U16,
        "int" | "signed int" | "int32" | "int32_t" => Element::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => Element::U32,
        "longlong" | "long long" | "signed long long" | "int64" | "int64_t" => Element::I64,
        "ulonglong" | "unsigned long long" | "uint64" | "uint64_t" => Element::U64,
        "float" => Element::F32,
        "double" => Element::F64,
        _ => return Err(FormatError::value("type", name, "integers of 8 to 64 bits, or floats")),
    })
}

fn numbers(data: &[u8]) -> Result<Vec<f64>, FormatError> {
    let text = decode_text(data);
    let words = text.split(|letter: char| letter.is_whitespace() || letter == ',');
    words.filter(|word| !word.is_empty()).map(number::height).collect()
}

/// Returns the size of a map along the given two of the axes.
fn size(header: &Entries, nodes: [usize; 2], of: [usize; 2]) -> Result<Sides, FormatError> {
    let axes = |name: &str| {
        let list = header.get(name).map(|_| list::<f64>(header, name)).transpose()?;
        let pair = list.and_then(|list| Some([*list.get(of[0])?, *list.get(of[1])?]));
        Ok(pair.filter(|pair| pair.iter().all(|one| one.is_finite())))
    };
    let centering = header.get("centerings").or(header.get("centers"));
    let is_node = centering.is_some_and(|text| text.starts_with("node"));
    let range = axes("axismins")?.zip(axes("axismaxs")?);
    let steps = axes("spacings")?.or(directions(header, of)?);
    let sides = match (steps, range) {
        (Some(steps), _) => [0, 1].map(|axis| steps[axis] * nodes[axis] as f64),
        (None, Some((from, to))) => [0, 1].map(|axis| {
            let range = to[axis] - from[axis];
            let count = nodes[axis] as f64;
            if is_node { range / (count - 1.0) * count } else { range }
        }),
        (None, None) => return Ok(Sides::UNKNOWN),
    };
    let listed = header.get("units").or(header.get("spaceunits")).unwrap_or_default();
    let units: Vec<&str> = listed.split('"').skip(1).step_by(2).collect();
    let [x, y] = of.map(|axis| units.get(axis).copied().unwrap_or_default());
    Sides::in_units(sides, [x, y])
}

/// Returns the lengths of the vectors from one point to the next along two of the axes.
fn directions(header: &Entries, of: [usize; 2]) -> Result<Option<[f64; 2]>, FormatError> {
    let Some(text) = header.get("spacedirections") else { return Ok(None) };
    let wrong = || FormatError::value("space directions", text, "vectors, such as (1,0) (0,1)");
    // An axis of channels has the word `none`.
    let vectors = text.replace(", ", ",");
    let vectors: Vec<&str> = vectors.split_whitespace().collect();
    let length = |axis: usize| -> Option<f64> {
        let vector = vectors.get(axis)?.strip_prefix('(')?.strip_suffix(')')?;
        let parts = vector.split(',').map(|part| part.parse::<f64>().ok());
        let squares: Option<f64> = parts.map(|part| part.map(|part| part * part)).sum();
        squares.map(f64::sqrt)
    };
    let [x, y] = of.map(|axis| length(axis).ok_or_else(wrong));
    Ok(Some([x?, y?]))
}
