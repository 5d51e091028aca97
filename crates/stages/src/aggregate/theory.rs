//! Columns with predicted contact areas, and with the approach to full contact F = −ln[(1 − a) y
//! √(2π)].

use std::collections::BTreeMap;

use arrow::array::{Array, ArrayRef};
use arrow::datatypes::Schema;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::StageError;
use crate::aggregate::statistics::{LOAD_MIDPOINT, LOAD_OF_GROUP, mean_of};
use crate::aggregate::{Groups, Statistic};
use crate::columns::{HURST, K_LOWER, K_ROLLOFF, K_UPPER, SIDE_X, SIDE_Y, columns, real};
use crate::surface::coordinates::is_altered;
use asperity_mechanics::grid::Cell;
use asperity_mechanics::theory::law::KAPPA_BGT;
use asperity_mechanics::theory::models::{Asperities, AsperityModel, full_contact};
use asperity_mechanics::theory::persson;
use asperity_mechanics::topography::spectrum::Spectrum;
use asperity_tables::column::{Column, optional_reals};
use asperity_tables::table::{Table, TableError};

/// Declares the theories: word in manifests, asperity model, beginning of the names of the columns,
/// name of the theory, and details for the meaning of the area.
macro_rules! theories {
    ($($(#[$doc:meta])+ $model:ident = $word:literal, $asperities:expr, $area:literal,
        $theory:literal, $details:literal;)+) => {
        /// Theory of the contact area.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        pub enum Model {
            $($(#[$doc])+ #[serde(rename = $word)] $model),+
        }

        impl Model {
            /// All theories.
            pub const ALL: [Model; [$($word),+].len()] = [$(Model::$model),+];

            /// Returns the word that names the theory in manifests.
            pub fn word(self) -> &'static str {
                match self {
                    $(Model::$model => $word),+
                }
            }

            /// Returns the asperity model, if the theory is one. Asperity models need Nayak's
            /// parameter.
            pub fn asperities(self) -> Option<AsperityModel> {
                match self {
                    $(Model::$model => $asperities),+
                }
            }

            /// Returns the columns for area, slope, secant and approach to full contact.
            pub fn columns(self) -> [Column; 4] {
                match self {
                    $(Model::$model => [
                        real($area, "1").with_meaning(concat!(
                            "area fraction predicted by ", $theory, ", ", $details
                        )),
                        real(concat!($area, "_slope"), "1 per load").with_meaning(concat!(
                            "slope of the area predicted by ", $theory, ", at `load_midpoint`"
                        )),
                        real(concat!($area, "_secant"), "1 per load").with_meaning(concat!(
                            "area predicted by ", $theory, ", divided by the load"
                        )),
                        real(concat!($area, "_approach"), "1").with_meaning(concat!(
                            "F = −ln[(1 − a) y √(2π)] of the area a predicted by ", $theory
                        )),
                    ]),+
                }
            }
        }
    };
}

theories! {
    /// Theory of Persson (2001), a diffusion equation in the magnification.
    Persson = "persson", None, "area_persson",
        "Persson 2001", "for isotropic Gaussian roughness";
    /// Theory of Bush, Gibson & Thomas (1975).
    BushGibsonThomas = "bush-gibson-thomas", Some(AsperityModel::BushGibsonThomas),
        "area_bush_gibson_thomas", "Bush, Gibson & Thomas 1975",
        "for isotropic Gaussian roughness with Nayak's parameter α of the modes of the cell";
    /// The simplified elliptic model of Greenwood 2006.
    Greenwood2006 = "greenwood-2006", Some(AsperityModel::SimplifiedElliptic),
        "area_greenwood_2006", "Greenwood 2006",
        "for isotropic Gaussian roughness with Nayak's parameter α of the modes of the cell";
    /// Spheres of the mean curvature of each summit, after Nayak and Thomas.
    MeanCurvature = "mean-curvature", Some(AsperityModel::MeanCurvature), "area_mean_curvature",
        "the model of spheres with the mean curvature of each summit",
        "for isotropic Gaussian roughness with Nayak's parameter α of the modes of the cell";
    /// Theory of Greenwood & Williamson (1966) with the parameters of McCool (1986).
    GreenwoodMccool = "greenwood-mccool", Some(AsperityModel::GreenwoodWilliamson),
        "area_greenwood_mccool", "Greenwood & Williamson 1966 with the parameters of McCool 1986",
        "for isotropic Gaussian roughness with Nayak's parameter α of the modes of the cell";
    /// Limit of asperity models at light load, √(2π) times the load.
    BgtAsymptote = "bgt-asymptote", None, "area_bgt_asymptote",
        "the asymptote of asperity models at light load",
        "√(2π) times the load, for isotropic Gaussian roughness";
    /// Isolated cracks near full contact: 1 − (3/4) erfc(√2 y).
    PennyCrack = "penny-crack", None, "area_penny_crack",
        "the model of isolated cracks near full contact",
        "1 − (3/4) erfc(√2 y), for isotropic Gaussian roughness";
}

/// Predicted area fraction and its derivative with respect to the load.
#[derive(Debug, Clone, Copy)]
struct Prediction {
    area: f64,
    slope: f64,
}

impl Model {
    /// Returns whether the theory integrates over heights and curvatures of summits for each load,
    /// which takes seconds per table.
    pub fn integrates_over_summits(self) -> bool {
        matches!(self, Model::BushGibsonThomas | Model::Greenwood2006 | Model::MeanCurvature)
    }

    /// Returns the predicted area fraction under a load; see [`nayak_parameters`] for `nayak`.
    /// Returns `None` if an asperity model has no solution.
    pub fn area(self, load: f64, nayak: Option<f64>) -> Option<f64> {
        let prediction = if load > 0.0 { self.predict(load, nayak)? } else { return None };
        Some(prediction.area)
    }

    /// Returns the prediction under a load > 0. `nayak` is Nayak's parameter α, which only asperity
    /// models need. Returns `None` if an asperity model has no `nayak` or no solution at this load.
    fn predict(self, load: f64, nayak: Option<f64>) -> Option<Prediction> {
        if let Some(model) = self.asperities() {
            let contact = Asperities::new(model, nayak?).ok()?.at_load(load)?;
            let (area, slope) = (contact.area, contact.slope);
            return Some(Prediction { area, slope });
        }
        let (area, slope) = match self {
            Model::BgtAsymptote => (KAPPA_BGT * load, KAPPA_BGT),
            Model::PennyCrack => {
                let share = full_contact::noncontact(load) / persson::noncontact(load);
                (1.0 - full_contact::noncontact(load), share * persson::slope(load))
            }
            _ => (persson::area(load), persson::slope(load)),
        };
        Some(Prediction { area, slope })
    }

    /// Returns F(y) = −ln[(1 − a) y √(2π)] for the predicted area a at the load y, or `None` if the
    /// predicted contact is full.
    fn approach(self, load: f64, nayak: Option<f64>) -> Option<f64> {
        match self {
            Model::Persson => Some(persson::approach(load)),
            Model::PennyCrack => Some(full_contact::approach(load)),
            _ => {
                let open = 1.0 - self.predict(load, nayak)?.area;
                persson::approach_to_full_contact(load, open)
            }
        }
    }
}

/// Columns of the spectrum that determine Nayak's parameter in a square cell.
pub const SPECTRUM_COLUMNS: [&str; 4] = [HURST.name, K_LOWER.name, K_ROLLOFF.name, K_UPPER.name];

/// Adds the approach to full contact and the predictions of theories to reduced rows.
///
/// # Errors
/// Returns an error if the rows lack the load or parameters of the spectrum that a model needs.
pub fn with_theories(reduced: &Table, groups: &Groups) -> Result<Table, StageError> {
    let asks_for = |statistic| groups.statistics.contains(&statistic);
    // These columns hold means and the load of the group.
    let means: Vec<String> = groups.over.iter().map(|name| mean_of(name)).collect();
    let hidden: Vec<&str> = means.iter().map(String::as_str).chain([LOAD_OF_GROUP]).collect();
    let mut table = reduced.without(&hidden);
    if asks_for(Statistic::Approach) {
        for name in &groups.over {
            let field = APPROACH.field().with_name(Statistic::Approach.column_of(name));
            let values = vec![approach(reduced, name)?];
            table =
                table.beside(&Table::from_arrays(reduced.rows(), Schema::new(vec![field]), values));
        }
    }
    let mut predicted = Vec::new();
    for &model in &groups.models {
        predicted.extend(predictions(reduced, model, &asks_for)?);
    }
    Ok(table.with(predicted))
}

/// Computes F(y) = −ln[(1 − a) y √(2π)] from the mean a of a column of areas, for each row of
/// `reduced`; null at full contact.
fn approach(reduced: &Table, name: &str) -> Result<ArrayRef, StageError> {
    let (means, loads) = (reduced.reals(&mean_of(name))?, reduced.reals(LOAD_OF_GROUP)?);
    let rows = means.iter().zip(loads);
    Ok(optional_reals(
        rows.map(|(mean, load)| persson::approach_to_full_contact(load?, 1.0 - mean?)),
    ))
}

fn predictions(
    table: &Table,
    model: Model,
    asks_for: &impl Fn(Statistic) -> bool,
) -> Result<Vec<(Column, ArrayRef)>, TableError> {
    let nayak = match model.asperities() {
        Some(_) => nayak_parameters(table)?,
        None => vec![None; table.rows()],
    };
    let at = |name: &str, value: &dyn Fn(f64, Option<f64>) -> Option<f64>| {
        let loads = table.reals(name)?;
        let row = |(load, &nayak): (Option<f64>, _)| value(load.filter(|&y| y > 0.0)?, nayak);
        Ok::<_, TableError>(optional_reals(loads.iter().zip(&nayak).map(row)))
    };
    let [area, slope, secant, approach] = model.columns();
    let prediction = |load, nayak| model.predict(load, nayak);
    let mut columns =
        vec![(area, at(LOAD_OF_GROUP, &|y, nayak| Some(prediction(y, nayak)?.area))?)];
    if asks_for(Statistic::Slope) {
        let values = at(LOAD_MIDPOINT.name, &|y, nayak| Some(prediction(y, nayak)?.slope))?;
        columns.push((slope, values));
    }
    if asks_for(Statistic::Secant) {
        let values = at(LOAD_OF_GROUP, &|y, nayak| Some(prediction(y, nayak)?.area / y))?;
        columns.push((secant, values));
    }
    if asks_for(Statistic::Approach) {
        let values = at(LOAD_OF_GROUP, &|y, nayak| model.approach(y, nayak))?;
        columns.push((approach, values));
    }
    Ok(columns)
}

/// Computes Nayak's parameter for each row, by sums over the modes of the cell; `None` for rows
/// without a spectrum, for pairs of surfaces, and for surfaces that have yielded.
///
/// Anisotropy is ignored, because the theories assume isotropic roughness.
///
/// # Errors
/// Returns an error if the table lacks one of [`SPECTRUM_COLUMNS`].
pub fn nayak_parameters(table: &Table) -> Result<Vec<Option<f64>>, TableError> {
    let hurst = table.reals(HURST.name)?;
    let lower = table.integers(K_LOWER.name)?;
    let rolloff = table.integers(K_ROLLOFF.name)?;
    let upper = table.integers(K_UPPER.name)?;
    let sides = [SIDE_X, SIDE_Y].map(|side| table.reals(side.name).ok());
    let cell = |row: usize| {
        let [Some(x), Some(y)] = sides.map(|side| side.filter(|side| side.is_valid(row))) else {
            return Cell::square(1.0).ok();
        };
        Cell::new([x.value(row), y.value(row)]).ok()
    };
    let mut known: BTreeMap<[u64; 6], Option<f64>> = BTreeMap::new();
    let mut of_row = |row: usize| {
        let cutoffs = [lower, rolloff, upper];
        if is_altered(table, row) || hurst.is_null(row) || cutoffs.iter().any(|k| k.is_null(row)) {
            return None;
        }
        let [k_lower, k_rolloff, k_upper] = cutoffs.map(|k| u32::try_from(k.value(row)).ok());
        let spectrum = Spectrum {
            hurst: hurst.value(row),
            k_lower: k_lower?,
            k_rolloff: k_rolloff?,
            k_upper: k_upper?,
            anisotropy: None,
        };
        let cell = cell(row)?;
        let [aspect_x, aspect_y] = cell.aspect().map(f64::to_bits);
        let cutoffs = [k_lower?, k_rolloff?, k_upper?].map(u64::from);
        let key =
            [cutoffs[0], cutoffs[1], cutoffs[2], spectrum.hurst.to_bits(), aspect_x, aspect_y];
        let nayak = known.entry(key);
        *nayak.or_insert_with(|| spectrum.moments(cell).nayak())
    };
    Ok((0..table.rows()).map(&mut of_row).collect())
}

columns! {
    /// F = −ln[(1 − a) y √(2π)] of the mean area a under the load y
    const APPROACH: Column = real("approach", "1");
}

#[cfg(test)]
mod tests;
