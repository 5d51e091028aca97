//! Areal surface texture parameters of ISO 25178-2 beyond those of `what = "roughness"` alone.
//!
//! The keys `parameters`, `smr_height` and `smc_ratio` select the parameters. Only these are
//! computed. Settings that the standard leaves open are keys, which can be swept: each value gives
//! further rows, with the value in a parameter column.

use std::collections::BTreeSet;

use arrow::array::ArrayRef;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::columns::*;
use crate::version::Version;
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::topography::areal::{developed_area_ratio, texture_direction};
use asperity_mechanics::topography::autocorrelation::Autocorrelation;
use asperity_mechanics::topography::descriptors::Roughness;
use asperity_mechanics::topography::material_ratio::MaterialRatioCurve;
use asperity_mechanics::topography::peaks::Peaks;
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::column::{Column, optional_reals};

/// Version of the numbers, which is part of every key of these parameters.
pub const VERSION: Version = Version::new(1, &[]);

/// Default material ratio p of the peak material volume.
pub const PEAK_RATIO_DEFAULT: f64 = 0.1;
/// Default material ratio q of the dale void volume.
pub const DALE_RATIO_DEFAULT: f64 = 0.8;
/// Default threshold s of the autocorrelation length.
pub const THRESHOLD_DEFAULT: f64 = 0.2;
/// Default height of significant hills, as a fraction of Sz.
pub const PRUNING_DEFAULT: f64 = 0.05;

/// Areal surface texture parameter of ISO 25178-2.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
pub enum Parameter {
    /// All parameters of this list.
    #[serde(rename = "iso-25178")]
    All,
    /// Root mean square height.
    Sq,
    /// Skewness.
    Ssk,
    /// Kurtosis.
    Sku,
    /// Maximum peak height.
    Sp,
    /// Maximum pit depth.
    Sv,
    /// Maximum height.
    Sz,
    /// Arithmetic mean height.
    Sa,
    /// Root mean square gradient.
    Sdq,
    /// Developed interfacial area ratio.
    Sdr,
    /// Autocorrelation length.
    Sal,
    /// Texture aspect ratio.
    Str,
    /// Texture direction.
    Std,
    /// Core height.
    Sk,
    /// Reduced peak height.
    Spk,
    /// Reduced dale height.
    Svk,
    /// Material ratio of the peaks.
    Smr1,
    /// Material ratio above the dales.
    Smr2,
    /// Peak material volume.
    Vmp,
    /// Core material volume.
    Vmc,
    /// Core void volume.
    Vvc,
    /// Dale void volume.
    Vvv,
    /// Density of peaks.
    Spd,
    /// Arithmetic mean peak curvature.
    Spc,
}

use Parameter::*;

/// Parameters that need the heights alone, or their gradient.
const HEIGHTS: [Parameter; 8] = [Sq, Ssk, Sku, Sp, Sv, Sz, Sa, Sdq];
pub const DECAY: [Parameter; 2] = [Sal, Str];
pub const VOLUMES: [Parameter; 4] = [Vmp, Vmc, Vvc, Vvv];
const FUNCTIONAL: [Parameter; 9] = [Sk, Spk, Svk, Smr1, Smr2, Vmp, Vmc, Vvc, Vvv];
pub const PEAKS: [Parameter; 2] = [Spd, Spc];

/// Parameters that `what = "roughness"` has without the key `parameters`.
pub const DEFAULT: [Parameter; 6] = [Sq, Sa, Sz, Ssk, Sku, Sdq];

impl Parameter {
    /// All parameters in the order of their columns.
    pub const EACH: [Parameter; 23] = [
        Sq, Ssk, Sku, Sp, Sv, Sz, Sa, Sdq, Sdr, Sal, Str, Std, Sk, Spk, Svk, Smr1, Smr2, Vmp, Vmc,
        Vvc, Vvv, Spd, Spc,
    ];

    pub fn column(self) -> Column {
        let index = Parameter::EACH.iter().position(|other| *other == self);
        AREAL[index.expect("`All` stands for the others")]
    }
}

/// Parameters to compute, with the settings that the manifest gives.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Areal {
    pub parameters: BTreeSet<Parameter>,
    #[serde(flatten)]
    pub settings: Settings,
    pub version: u32,
}

/// Settings of parameters; `None` for those that the manifest does not contain.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Settings {
    /// Height c of the areal material ratio Smr(c), above the mean.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smr_height: Option<f64>,
    /// Material ratio mr of the inverse areal material ratio Smc(mr).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smc_ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dale_ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correlation_threshold: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pruning: Option<f64>,
}

impl Settings {
    /// Returns the material ratios p and q of the volumes.
    pub fn volume_ratios(&self) -> [f64; 2] {
        [
            self.peak_ratio.unwrap_or(PEAK_RATIO_DEFAULT),
            self.dale_ratio.unwrap_or(DALE_RATIO_DEFAULT),
        ]
    }

    /// Returns the settings that the manifest contains, each with its column.
    fn given(&self) -> impl Iterator<Item = (Column, f64)> {
        let settings = [
            (SMR_HEIGHT, self.smr_height),
            (SMC_RATIO, self.smc_ratio),
            (PEAK_RATIO, self.peak_ratio),
            (DALE_RATIO, self.dale_ratio),
            (CORRELATION_THRESHOLD, self.correlation_threshold),
            (PRUNING, self.pruning),
        ];
        settings.into_iter().filter_map(|(column, setting)| Some((column, setting?)))
    }
}

impl Areal {
    /// Returns all parameters and settings, for the list of all columns.
    pub fn all() -> Areal {
        Areal {
            parameters: Parameter::EACH.into(),
            settings: Settings {
                smr_height: Some(0.0),
                smc_ratio: Some(0.5),
                peak_ratio: Some(PEAK_RATIO_DEFAULT),
                dale_ratio: Some(DALE_RATIO_DEFAULT),
                correlation_threshold: Some(THRESHOLD_DEFAULT),
                pruning: Some(PRUNING_DEFAULT),
            },
            version: VERSION.number(),
        }
    }

    fn has_any(&self, parameters: &[Parameter]) -> bool {
        parameters.iter().any(|parameter| self.parameters.contains(parameter))
    }

    /// Returns the columns without the parameter columns of the surface.
    pub fn columns(&self) -> Vec<Column> {
        let settings = self.settings.given().map(|(column, _)| column);
        let parameters = self.parameters.iter().map(|parameter| parameter.column());
        let smr = self.settings.smr_height.map(|_| SMR);
        let smc = self.settings.smc_ratio.map(|_| SMC);
        settings.chain(parameters).chain(smr).chain(smc).collect()
    }

    /// Computes the columns of one surface, each with one value.
    pub fn measure(&self, surface: &Surface, boundary: Boundary) -> Vec<(Column, ArrayRef)> {
        let settings = self.settings.given().map(|(column, value)| (column, Some(value)));
        let computed = self.reads_curve().then(|| MaterialRatioCurve::from_surface(surface));
        let curve = computed.as_ref();
        let values = self.values(surface, boundary, curve);
        let height = self.settings.smr_height.zip(curve);
        let smr = height.map(|(height, curve)| (SMR, Some(curve.ratio_at(height))));
        let ratio = self.settings.smc_ratio.zip(curve);
        let smc = ratio.map(|(ratio, curve)| (SMC, Some(curve.height_at(ratio))));
        let columns = settings.chain(values).chain(smr).chain(smc);
        columns.map(|(column, value)| (column, optional_reals([value]))).collect()
    }

    fn reads_curve(&self) -> bool {
        let Settings { smr_height, smc_ratio, .. } = self.settings;
        smr_height.is_some() || smc_ratio.is_some() || self.has_any(&FUNCTIONAL)
    }

    /// Computes the parameters of the set, in the order of their columns.
    pub fn values(
        &self,
        surface: &Surface,
        boundary: Boundary,
        curve: Option<&MaterialRatioCurve>,
    ) -> Vec<(Column, Option<f64>)> {
        let Areal { parameters, settings, .. } = self;
        let mut found = Vec::new();
        if self.has_any(&HEIGHTS) {
            let of = Roughness::from_surface(surface, boundary);
            let [sq, sp, sv, sz, sa, sdq] = [of.sq, of.sp, of.sv, of.sz, of.sa, of.sdq].map(Some);
            found.extend([(Sq, sq), (Ssk, of.ssk), (Sku, of.sku), (Sp, sp), (Sv, sv), (Sz, sz)]);
            found.extend([(Sa, sa), (Sdq, sdq)]);
        }
        if parameters.contains(&Sdr) {
            found.push((Sdr, Some(developed_area_ratio(surface, boundary))));
        }
        if self.has_any(&DECAY) {
            let threshold = settings.correlation_threshold.unwrap_or(THRESHOLD_DEFAULT);
            let lengths = Autocorrelation::from_surface(surface, boundary).decay_lengths(threshold);
            found.extend([(Sal, lengths.shortest), (Str, lengths.aspect_ratio())]);
        }
        if parameters.contains(&Std) {
            found.push((Std, texture_direction(surface, boundary)));
        }
        if let Some(curve) = curve.filter(|_| self.has_any(&FUNCTIONAL)) {
            let of = curve.stratified();
            let [sk, spk, svk, smr1, smr2] = [of.sk, of.spk, of.svk, of.smr1, of.smr2].map(Some);
            found.extend([(Sk, sk), (Spk, spk), (Svk, svk), (Smr1, smr1), (Smr2, smr2)]);
            let of = curve.volumes(settings.volume_ratios());
            let [vmp, vmc, vvc, vvv] = [of.vmp, of.vmc, of.vvc, of.vvv].map(Some);
            found.extend([(Vmp, vmp), (Vmc, vmc), (Vvc, vvc), (Vvv, vvv)]);
        }
        if self.has_any(&PEAKS) {
            let pruning = settings.pruning.unwrap_or(PRUNING_DEFAULT);
            let peaks = Peaks::from_surface(surface, boundary, pruning);
            found.extend([(Spd, Some(peaks.density)), (Spc, peaks.curvature)]);
        }
        found.retain(|(parameter, _)| parameters.contains(parameter));
        found.into_iter().map(|(parameter, value)| (parameter.column(), value)).collect()
    }

    /// Returns the cost in pairs of FFTs on the mesh of the surface.
    pub fn pairs(&self) -> f64 {
        let costs = [
            (self.has_any(&HEIGHTS), 2.0),
            (self.has_any(&[Sdr]), 2.0),
            (self.has_any(&DECAY), 6.0),
            (self.has_any(&[Std]), 2.0),
            (self.reads_curve(), 4.0),
            (self.has_any(&PEAKS), 8.0),
        ];
        costs.into_iter().filter(|(is_needed, _)| *is_needed).map(|(_, cost)| cost).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::statistics::Statistic;
    use asperity_mechanics::grid::Grid;
    use asperity_mechanics::topography::shapes::Shape;

    fn recipe(parameters: &[Parameter], settings: Settings) -> String {
        let parameters = parameters.iter().copied().collect();
        let areal = Areal { parameters, settings, version: VERSION.number() };
        serde_json::to_string(&Statistic::Areal(areal)).unwrap()
    }

    #[test]
    fn each_parameter_has_the_column_of_its_name() {
        assert_eq!(AREAL.len(), Parameter::EACH.len());
        for parameter in Parameter::EACH {
            let name = serde_json::to_value(parameter).unwrap();
            assert_eq!(name, parameter.column().name);
        }
    }

    #[test]
    fn a_recipe_has_the_parameters_in_one_order_and_only_given_settings() {
        let short = r#"{"of":"areal","parameters":["Sq","Sk"],"version":1}"#;
        assert_eq!(recipe(&[Sk, Sq, Sk], Settings::default()), short);
        let settings = Settings { smc_ratio: Some(0.5), ..Settings::default() };
        let with_ratio = r#"{"of":"areal","parameters":["Sal"],"smc_ratio":0.5,"version":1}"#;
        assert_eq!(recipe(&[Sal], settings), with_ratio);
    }

    #[test]
    fn any_subset_has_the_values_of_the_whole() {
        let waves = Shape::WaveSum { amplitude: 0.1, waves: 3 };
        let surface =
            waves.draw(Grid::new([48, 32], Grid::square(1, 1.0).unwrap().cell()).unwrap());
        let all = Areal::all().measure(&surface, Boundary::Periodic);
        for parameter in Parameter::EACH {
            let one = Areal { parameters: [parameter].into(), ..Areal::all() };
            let found = one.measure(&surface, Boundary::Periodic);
            assert_eq!(one.columns(), found.iter().map(|(column, _)| *column).collect::<Vec<_>>());
            for value in found {
                assert!(all.contains(&value));
            }
        }
    }
}
