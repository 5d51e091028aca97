//! Files of Gwyddion: fields of single precision (`.gsf`), and channels with a mask (`.gwy`).
//!
//! Their units have no prefix, so that lengths are in metres and pressures in pascals. The first
//! line of numbers has y = 0. Gwyddion draws it at the top, because its y points downwards.
//!
//! The layouts are those of the *Gwyddion user guide*, sections “Gwyddion Simple Field Files” and
//! “Gwyddion Native Data Files”.

use super::array_name;
use crate::session::SessionError;
use crate::session::maps::Map;
use asperity_manifest::keys::quantity::{Dimension, Unit};

/// A channel: a map with the nodes to mark.
pub(crate) struct Channel<'m> {
    pub(crate) map: &'m Map,
    pub(crate) mask: Option<&'m Map>,
}

/// Unit without prefix, and the power of ten that converts numbers to it.
struct Base<'u> {
    unit: &'u str,
    power: i32,
}

impl<'u> Base<'u> {
    /// Units that are only labels stay as they are.
    fn of(unit: Option<&'u str>) -> Base<'u> {
        let unit = unit.unwrap_or_default();
        match Unit::find(unit) {
            Some(Unit { dimension: Dimension::Length, power, .. }) => {
                Base { unit: "m", power: *power }
            }
            Some(Unit { dimension: Dimension::Pressure, power, .. }) => {
                Base { unit: "Pa", power: *power }
            }
            _ => Base { unit, power: 0 },
        }
    }

    fn convert(&self, number: f64) -> f64 {
        // A negative power of ten is not exact.
        match self.power {
            ..0 => number / 10_f64.powi(-self.power),
            _ => number * 10_f64.powi(self.power),
        }
    }
}

/// Returns the numbers of a map in the order of the file: along x, from the first to the last y.
fn lines(map: &Map) -> impl Iterator<Item = f64> {
    let [nodes_x, nodes_y] = map.grid.nodes();
    let base = Base::of(map.unit.as_deref());
    let nodes = (0..nodes_y).flat_map(move |j| (0..nodes_x).map(move |i| i * nodes_y + j));
    nodes.map(move |node| base.convert(map.values[node]))
}

/// Returns a Gwyddion simple field. Gaps of surfaces that have pulled off are not a number.
pub(crate) fn simple_field(map: &Map) -> Vec<u8> {
    let [nodes_x, nodes_y] = map.grid.nodes();
    let lateral = Base::of(map.length_unit.as_deref());
    let [side_x, side_y] = map.grid.cell().size().map(|side| lateral.convert(side));
    let mut header = format!(
        "Gwyddion Simple Field 1.0\nXRes = {nodes_x}\nYRes = {nodes_y}\nXReal = {side_x:e}\n\
         YReal = {side_y:e}\nTitle = {}\n",
        array_name(map.kind)
    );
    for (name, unit) in [("XYUnits", lateral.unit), ("ZUnits", Base::of(map.unit.as_deref()).unit)]
    {
        if !unit.is_empty() {
            header += &format!("{name} = {unit}\n");
        }
    }
    // One to four zeros end the header, so that the numbers begin at a multiple of four bytes.
    let mut bytes = header.into_bytes();
    bytes.resize((bytes.len() + 1).next_multiple_of(4), 0);
    let numbers = lines(map).map(|number| if number.is_finite() { number } else { f64::NAN });
    bytes.extend(numbers.flat_map(|number| (number as f32).to_le_bytes()));
    bytes
}

/// Returns a Gwyddion file.
///
/// # Errors
/// Returns an error if the maps need more than the 4 GB of the format.
pub(crate) fn native(channels: &[Channel<'_>]) -> Result<Vec<u8>, SessionError> {
    let mut container = Object::new("GwyContainer");
    for (number, channel) in channels.iter().enumerate() {
        let path = |rest: &str| format!("/{number}/{rest}");
        container.object(&path("data"), field(channel.map, false)?)?;
        container.text(&path("data/title"), array_name(channel.map.kind));
        container.value(&path("data/visible"), b'b', &[1]);
        // Gwyddion has no number for missing points, but marks them.
        let not_finite = channel.map.values.iter().any(|number| !number.is_finite());
        let mask = channel.mask.or(not_finite.then_some(channel.map));
        if let Some(mask) = mask {
            container.object(&path("mask"), field(mask, true)?)?;
        }
    }
    Ok([b"GWYP".as_slice(), &container.finish()?].concat())
}

/// Returns the field of a map, or of the mask of a map: the nodes of a set, or the numbers that are
/// not finite.
fn field(map: &Map, is_mask: bool) -> Result<Object, SessionError> {
    let nodes = map.grid.nodes();
    let lateral = Base::of(map.length_unit.as_deref());
    let sides = map.grid.cell().size().map(|side| lateral.convert(side));
    let mut field = Object::new("GwyDataField");
    for (name, nodes) in ["xres", "yres"].into_iter().zip(nodes) {
        field.value(name, b'i', &(nodes as u32).to_le_bytes());
    }
    for (name, side) in ["xreal", "yreal"].into_iter().zip(sides) {
        field.value(name, b'd', &side.to_le_bytes());
    }
    let vertical = if is_mask { "" } else { Base::of(map.unit.as_deref()).unit };
    for (name, unit) in [("si_unit_xy", lateral.unit), ("si_unit_z", vertical)] {
        let mut object = Object::new("GwySIUnit");
        object.text("unitstr", unit);
        field.object(name, object)?;
    }
    let count = u32::try_from(map.values.len()).map_err(|_| too_large())?;
    let mut data = Vec::with_capacity(4 + 8 * map.values.len());
    data.extend(count.to_le_bytes());
    data.extend(lines(map).flat_map(|number| {
        let number = match (is_mask && !map.kind.is_set(), number.is_finite()) {
            (true, is_finite) => f64::from(u8::from(!is_finite)),
            (false, true) => number,
            (false, false) => 0.0,
        };
        number.to_le_bytes()
    }));
    field.value("data", b'D', &data);
    Ok(field)
}

fn too_large() -> SessionError {
    SessionError::refused(
        "a `.gwy` file holds at most 4 GB; choose fewer maps with `--map`, or write to `.npz`",
    )
}

/// Object of a Gwyddion file: a name, a length in bytes, and components of a name, the letter of a
/// type and a value.
struct Object {
    name: &'static str,
    components: Vec<u8>,
}

impl Object {
    fn new(name: &'static str) -> Object {
        Object { name, components: Vec::new() }
    }

    fn value(&mut self, name: &str, kind: u8, value: &[u8]) {
        self.components.extend(name.bytes().chain([0, kind]));
        self.components.extend(value);
    }

    fn text(&mut self, name: &str, text: &str) {
        self.value(name, b's', &[text.as_bytes(), &[0]].concat());
    }

    fn object(&mut self, name: &str, object: Object) -> Result<(), SessionError> {
        let bytes = object.finish()?;
        self.value(name, b'o', &bytes);
        Ok(())
    }

    fn finish(self) -> Result<Vec<u8>, SessionError> {
        let length = u32::try_from(self.components.len()).map_err(|_| too_large())?;
        let name = self.name.bytes().chain([0]).chain(length.to_le_bytes());
        Ok(name.chain(self.components).collect())
    }
}
