//! Keys that repair errors of the instrument, and the checks of their values.

use schemars::JsonSchema;
use serde::Deserialize;

use super::FileTable;
use asperity_manifest::decimal;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::length;
use asperity_mechanics::topography::alignment::{Alignment, LineFit};
use asperity_mechanics::topography::level::ThreePoints;
use asperity_mechanics::topography::outliers::Spikes;

/// Function of each scan line that `align` subtracts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum WrittenAlignment {
    /// The median of the line.
    Median,
    /// The sum of the medians of the differences of neighbouring lines.
    Differences,
    /// The least-squares polynomial of degree `align_degree`.
    Polynomial,
}

/// Three positions on the plane that `level_through` subtracts.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WrittenPoints {
    /// First position, as `[x, y]`.
    #[schemars(transform = length)]
    pub a: [f64; 2],
    /// Second position, as `[x, y]`.
    #[schemars(transform = length)]
    pub b: [f64; 2],
    /// Third position, as `[x, y]`.
    #[schemars(transform = length)]
    pub c: [f64; 2],
}

/// Returns the spikes to remove, or `Some(None)` if the manifest has no key `spikes`.
pub fn spikes(table: &FileTable, checks: &mut Checks) -> Option<Option<Spikes>> {
    let threshold = checks.optional_number("spikes", &table.spikes)?;
    let Some(threshold) = threshold else {
        return Some(None);
    };
    let window: u32 = checks.value("spike_window", &table.spike_window)?;
    match table.spike_window.written().filter(|_| window.is_multiple_of(2)) {
        Some(written) => {
            let message = format!("`spike_window` is {window}");
            checks.refuse("spike_window", message, &written.span, "must be an odd number")
        }
        None => Some(Some(Spikes { threshold, window })),
    }
}

/// Returns the alignment of the scan lines, or `Some(None)` if the manifest has no key `align`.
pub fn alignment(table: &FileTable, checks: &mut Checks) -> Option<Option<Alignment>> {
    let written = checks.optional("align", &table.align)?.map(|written| written.value);
    let Some(written) = written else {
        return Some(None);
    };
    let along = checks.value("align_along", &table.align_along)?;
    let by = match written {
        WrittenAlignment::Median => LineFit::Median,
        WrittenAlignment::Differences => LineFit::Differences,
        WrittenAlignment::Polynomial => {
            LineFit::Polynomial { degree: checks.value("align_degree", &table.align_degree)? }
        }
    };
    Some(Some(Alignment { along, by }))
}

/// Returns the positions on the plane to subtract, or `Some(None)` if the manifest has no key
/// `level_through`.
pub fn level_through(table: &FileTable, checks: &mut Checks) -> Option<Option<ThreePoints>> {
    let Some(written) = checks.optional("level_through", &table.level_through)? else {
        return Some(None);
    };
    let [a, b, c] = [written.value.a, written.value.b, written.value.c]
        .map(|point| point.map(decimal::nearest));
    Some(Some(ThreePoints { a, b, c }))
}
