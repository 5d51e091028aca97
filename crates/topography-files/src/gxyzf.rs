//! Gwyddion XYZ field: lines `Name = value`, zero padding to eight bytes, and points of `f64`.
//!
//! Each point has x, y and a number for each channel. The points must lie on a grid; the sides are
//! nodes × step, and grid points without a point in the file are missing. Channels are numbered
//! from 1; Gwyddion 2.62 numbers their titles from 0 and their units from 1.

use super::channel::{Channel, Sides};
use super::grid::Grid;
use super::input::Entries;
use super::raster::Raster;
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format =
    Format::new("gxyzf", "Gwyddion XYZ field", read).changed(&["titles that count from 0"]);

const SIGNATURE: &[u8] = b"Gwyddion XYZ Field 1.0\n";

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let (entries, stored) = Entries::of_gwyddion(bytes, SIGNATURE, 8)?;
    let count = entries.whole("NChannels")?;
    let stated = usize::try_from(count).ok().filter(|count| (1..=1024).contains(count));
    let count = stated.ok_or_else(|| {
        FormatError::value("NChannels", entries.get("NChannels").unwrap_or_default(), "1 to 1024")
    })?;
    let point = 8 * (count + 2);
    if let Some(points) = entries.get("NPoints") {
        let found = stored.len() / point;
        if points.parse() != Ok(found) || !stored.len().is_multiple_of(point) {
            let allowed = format!("{found}, the number of points in the file");
            return Err(FormatError::value("NPoints", points, &allowed));
        }
    }
    let number = |point: &[u8], index: usize| {
        let number = point[8 * index..].first_chunk();
        f64::from_le_bytes(*number.expect("a point has all its numbers"))
    };
    let unit = |name: &str| Unit::parse(entries.get(name).unwrap_or_default());
    let numbered = |name: &str, channel: usize| {
        let from = usize::from(entries.get(&format!("{name}0")).is_none());
        format!("{name}{}", channel - 1 + from)
    };
    let channels = (1..=count).map(|channel| {
        let points = stored.chunks_exact(point);
        let triplets =
            points.flat_map(|at| [number(at, 0), number(at, 1), number(at, channel + 1)]);
        let grid = Grid::from_triplets(&triplets.collect::<Vec<f64>>())?;
        let size = Sides::new(grid.sides, &unit("XYUnits"))?;
        // `ZUnits` without a number is the unit of all channels.
        let own = numbered("ZUnits", channel);
        let z = unit(if entries.get("ZUnits").is_some() { "ZUnits" } else { &own });
        let name = entries.get(&numbered("Title", channel)).unwrap_or("heights");
        let raster = Raster::from_columns(grid.nodes, grid.heights);
        Ok(Channel::new(name, z, size, raster))
    });
    at_least_one(channels, "NChannels")
}
