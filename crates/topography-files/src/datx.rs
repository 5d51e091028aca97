//! DATX files of Zygo, which are HDF5 files.
//!
//! The datasets in `Data/Surface` or, in older files, the dataset `Measurement/Surface` are maps.
//! Lines run along x; the first line has y = 0. The sides are nodes × step; the step is the second
//! parameter of the attributes `X Converter` and `Y Converter`, in metres per pixel. The attribute
//! `Unit` names a unit of length or `Fringes`. A fringe is the product of `Wavelength` in metres,
//! `Interferometric Scale Factor` and `Obliquity Factor`. The number `No Data` marks missing
//! points.
//!
//! The layout was taken from the readers of SurfaceTopography, prysm, Gwyddion and datxpy.

use hdf5_reader::{Attribute, Dataset, Datatype};

use super::channel::{Channel, Size};
use super::hdf5::Container;
use super::input::factor;
use super::raster::Missing;
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format = Format::new("datx", "Zygo DATX", read)
    .changed(&["integers may have fewer bits than their bytes"]);

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let container = Container::of_format(bytes)?;
    let datasets = surfaces(&container).ok_or(FormatError::Signature)?;
    let channels = datasets.iter().map(|dataset| channel(&container, dataset));
    at_least_one(channels, "surface")
}

/// Returns the datasets with surfaces, or `None` if the file has none that Zygo wrote.
fn surfaces(container: &Container) -> Option<Vec<Dataset>> {
    let root = container.root().ok()?;
    let datasets = match root.group("Data").and_then(|data| data.group("Surface")) {
        Ok(group) => container.members(&group, "Data/Surface").ok()?.datasets,
        Err(_) => vec![root.group("Measurement").ok()?.dataset("Surface").ok()?],
    };
    let is_surface = |dataset: &Dataset| dataset.attribute("Unit").is_ok();
    let surfaces: Vec<Dataset> = datasets.into_iter().filter(is_surface).collect();
    (!surfaces.is_empty()).then_some(surfaces)
}

fn channel(container: &Container, dataset: &Dataset) -> Result<Channel<'static>, FormatError> {
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
    let size = match (step(dataset, 'X')?, step(dataset, 'Y')?) {
        (Some(x), Some(y)) => Size::metres([nodes_x as f64 * x, nodes_y as f64 * y])?,
        _ => Size::Unknown,
    };
    Ok(Channel::new("surface", Unit::parse(unit), size, raster.scaled(scale, 0.0)))
}

/// Returns the step along an axis in metres. It is unknown if the attribute is missing, or zero
/// because the instrument was not calibrated.
fn step(dataset: &Dataset, axis: char) -> Result<Option<f64>, FormatError> {
    let name = format!("{axis} Converter");
    let Ok(converter) = dataset.attribute(&name) else { return Ok(None) };
    let base = member(dataset, &converter, "BaseUnit", 1);
    let unit = base.map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    if unit != "Pixels" {
        return Err(FormatError::value(&format!("unit of {name}"), unit, "Pixels"));
    }
    let parameters = member(dataset, &converter, "Parameters", 8).unwrap_or_default();
    let (parameters, _) = parameters.as_chunks::<8>();
    let step = parameters.get(1).map(|bytes| f64::from_le_bytes(*bytes));
    let step = step.ok_or_else(|| FormatError::missing(format!("second parameter of {name}")))?;
    Ok((step != 0.0).then_some(step))
}

/// Returns the bytes of a member of variable length of a compound attribute. `size` is the size of
/// an element.
fn member(dataset: &Dataset, attribute: &Attribute, name: &str, size: usize) -> Option<Vec<u8>> {
    let Datatype::Compound { fields, .. } = &attribute.datatype else { return None };
    let field = fields.iter().find(|field| field.name == name)?;
    let start = field.byte_offset as usize;
    let end = start.checked_add(dataset.vlen_reference_size())?;
    let reference = attribute.raw_data.get(start..end)?;
    dataset.resolve_vlen_reference_bytes(reference, size).ok()
}
