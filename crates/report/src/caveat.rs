//! What captions say of surfaces and materials that are not what theories assume.

use super::ReportError;
use super::ensembles;
use super::styles::Styles;
use super::tables::{FinishedStage, FinishedStages};
use asperity_stages::Kind;
use asperity_stages::caveats;
use asperity_stages::columns::HARDNESS;

/// A caption names as many parameter points beside which theories do not belong.
const MOST_CAVEATS: usize = 4;

/// Of which surfaces and materials the theories do not speak, and why: sentences, each after a space,
/// or nothing.
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
    let yields = |stage: &FinishedStage| stage.table.has(HARDNESS.name);
    let of_materials = match finished.stages.iter().any(yields) {
        true => " Theories are of elastic contact, and not of materials with a hardness.",
        false => "",
    };
    if told.is_empty() {
        return Ok(of_materials.to_owned());
    }
    let hidden = told.len().saturating_sub(MOST_CAVEATS);
    told.truncate(MOST_CAVEATS);
    if hidden > 0 {
        told.push(format!("{hidden} more"));
    }
    Ok(format!(
        " Theories and Nayak's α are of isotropic Gaussian roughness, unlike {}.{of_materials}",
        told.join("; ")
    ))
}
