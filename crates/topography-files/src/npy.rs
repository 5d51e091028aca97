//! NumPy's arrays of two dimensions, `[x, y]` as everywhere here: floats of single or double
//! precision. There is no size and no unit; what is not finite is missing.

use super::channel::{Channel, Size};
use super::error::FormatError;
use super::format::Format;
use super::raster::{Raster, checked_nodes};
use super::unit::Unit;
use asperity_contact::topography::measured::{MeasuredError, npy_array};

pub const FORMAT: Format =
    Format { name: "npy", title: "NumPy array", version: 1, has_signature: true, read };

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let (nodes, heights) = match npy_array(bytes) {
        Ok(array) => array,
        Err(MeasuredError::Magic) => return Err(FormatError::Signature),
        Err(error) => return Err(FormatError::unsupported(error.to_string())),
    };
    let counts = nodes.map(|count| i64::try_from(count).unwrap_or(i64::MAX));
    let nodes = checked_nodes(counts)?;
    let raster = Raster::of_columns(nodes, heights);
    Ok(vec![Channel::new("heights", Unit::None, Size::Unknown, raster)])
}
