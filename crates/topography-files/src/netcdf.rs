//! NetCDF, versions 1 and 2 of the classic format, as SurfaceTopography's `to_netcdf` writes it: a
//! variable `heights` over the dimensions `x` and `y`, whose variables have the attributes `length`
//! and `unit`, and a variable `mask` that is not zero at missing points.
//!
//! `length` is that of the whole map. Where the first dimension is x, as SurfaceTopography has it,
//! lines run along y.

mod classic;

use self::classic::{Dataset, Variable};
use super::channel::{Channel, Size};
use super::error::{FormatError, factor, finite};
use super::format::Format;
use super::raster::{ByteOrder, Missing, Raster, checked_nodes};
use super::unit::Unit;

pub const FORMAT: Format = Format {
    name: "netcdf",
    title: "netCDF of SurfaceTopography",
    version: 1,
    has_signature: true,
    read,
};

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let dataset = Dataset::read(bytes)?;
    let heights = dataset.variable("heights")?;
    let mut raster = raster(&dataset, heights, bytes)?;
    if let Ok(mask) = dataset.variable("mask") {
        let mask = self::raster(&dataset, mask, bytes)?;
        if mask.nodes() != raster.nodes() {
            let found = format!("{:?}", mask.nodes());
            return Err(FormatError::value("size of `mask`", found, "that of `heights`"));
        }
        raster = raster.masked(mask);
    }
    let axis = |name| dataset.variable(name).ok();
    let length = |name| axis(name)?.number("length");
    let unit = |variable: &Variable<'_>| variable.text("unit");
    let lateral = axis("x").and_then(unit);
    let other = axis("y").and_then(unit);
    if let (Some(x), Some(y)) = (&lateral, &other)
        && x != y
    {
        return Err(FormatError::value("unit of `y`", y, &format!("that of `x`, {x}")));
    }
    let size = match (length("x"), length("y")) {
        (Some(x), Some(y)) => Size::of([x, y], &Unit::of(lateral.as_deref().unwrap_or_default()))?,
        _ => Size::Unknown,
    };
    let unit = unit(heights).or(lateral).unwrap_or_default();
    Ok(vec![Channel::new("heights", Unit::of(&unit), size, raster)])
}

fn raster<'a>(
    dataset: &Dataset<'a>,
    variable: &Variable<'a>,
    bytes: &'a [u8],
) -> Result<Raster<'a>, FormatError> {
    let stored = bytes.get(variable.begin()..).unwrap_or_default();
    let (element, order) = (variable.element()?, ByteOrder::Big);
    let dimensions = dataset.dimensions(variable)?;
    let raster = match dimensions[..] {
        [("x", x), ("y", y)] => Raster::columns(checked_nodes([x, y])?, element, order, stored),
        [("y", y), ("x", x)] => Raster::rows(checked_nodes([x, y])?, element, order, stored),
        _ => {
            let names: Vec<&str> = dimensions.iter().map(|(name, _)| *name).collect();
            let allowed = "x and y";
            return Err(FormatError::value("dimensions", names.join(", "), allowed));
        }
    }?;
    let fill = variable.number("_FillValue");
    let missing = fill.or_else(|| variable.number("missing_value"));
    let scale = factor("scale_factor", variable.number("scale_factor").unwrap_or(1.0))?;
    let offset = finite("add_offset", variable.number("add_offset").unwrap_or(0.0))?;
    Ok(raster.missing(missing.map_or(Missing::None, Missing::Value)).scaled(scale, offset))
}
