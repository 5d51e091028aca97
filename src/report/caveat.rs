//! What captions say of surfaces that are not what theories assume.

use super::ReportError;
use super::ensembles;
use super::styles::Styles;
use super::tables::{FinishedStage, FinishedStages};
use crate::caveats;
use crate::stages::Kind;

/// A caption names as many parameter points beside which theories do not belong.
const MOST_CAVEATS: usize = 4;

/// Of which surfaces the theories do not speak, and why: a sentence after a space, or nothing.
///
/// # Errors
/// When a table of surfaces lacks a column of its stage.
pub fn caveat(finished: &FinishedStages, styles: &Styles) -> Result<String, ReportError> {
    let mut told = Vec::new();
    let stages = finished.stages.iter();
    for FinishedStage { table, .. } in stages.filter(|stage| stage.kind == Kind::Generate) {
        for point in caveats::points(table).map_err(ReportError::Caveats)? {
            if point.departures.is_empty() {
                continue;
            }
            let label = styles.label(&ensembles::point(&point.place, 0));
            let label = label.unwrap_or_else(|| "these surfaces".to_owned());
            let line = format!("{label} ({})", point.departures.join(", "));
            if !told.contains(&line) {
                told.push(line);
            }
        }
    }
    if told.is_empty() {
        return Ok(String::new());
    }
    let hidden = told.len().saturating_sub(MOST_CAVEATS);
    told.truncate(MOST_CAVEATS);
    if hidden > 0 {
        told.push(format!("{hidden} more"));
    }
    Ok(format!(
        " Theories and Nayak's α are of isotropic Gaussian roughness, unlike {}.",
        told.join("; ")
    ))
}
