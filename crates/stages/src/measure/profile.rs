//! Parameters of profiles, ISO 21920-2 and ISO 4287.

use arrow::array::ArrayRef;
use serde::Serialize;

use crate::StageError;
use crate::columns::*;
use crate::surface::Origin;
use crate::version::Version;
use asperity_mechanics::topography::material_ratio::Stratified;
use asperity_mechanics::topography::profile_parameters::Evaluation;
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::column::{Column, integers, optional_reals, reals};

/// Version of the numbers, which is part of every key of these parameters.
pub const VERSION: Version = Version::new(1, &[]);

/// Settings of the parameters of profiles; `None` for those that the manifest does not contain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Profile {
    /// Section length. By default it is λc or, if there is no λc, a fifth of the profile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub section_length: Option<f64>,
    /// Height c of the material ratio Rmr(c), above the mean line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smr_height: Option<f64>,
    /// Material ratio mr at which the column Rmc has the height.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smc_ratio: Option<f64>,
    pub version: u32,
}

impl Profile {
    /// All settings, for the list of all columns.
    pub const ALL: Profile = Profile {
        section_length: Some(0.25),
        smr_height: Some(0.0),
        smc_ratio: Some(0.5),
        version: VERSION.number(),
    };

    fn settings(&self) -> impl Iterator<Item = (Column, f64)> {
        let settings = [
            (SECTION_LENGTH_GIVEN, self.section_length),
            (SMR_HEIGHT, self.smr_height),
            (SMC_RATIO, self.smc_ratio),
        ];
        settings.into_iter().filter_map(|(column, setting)| Some((column, setting?)))
    }

    /// Returns the columns without the parameter columns of the profile.
    pub fn columns(&self) -> Vec<Column> {
        let settings = self.settings().map(|(column, _)| column);
        let further = [self.smr_height.map(|_| RMR), self.smc_ratio.map(|_| RMC)];
        settings.chain(PROFILE_ROUGHNESS).chain(further.into_iter().flatten()).collect()
    }

    /// Computes the columns of one profile, each with one value.
    ///
    /// # Errors
    /// If the profile is shorter than a section.
    pub fn measure(
        &self,
        profile: &Surface,
        origin: &Origin,
    ) -> Result<Vec<(Column, ArrayRef)>, StageError> {
        let cutoff = match origin {
            Origin::File(file) => file.preparation.high_pass,
            _ => None,
        };
        let length = self.section_length.or(cutoff);
        let evaluation = Evaluation::new(profile, length).ok_or_else(|| {
            let section =
                length.map_or(0.0, |length| (length / profile.grid().spacing()[0]).round());
            StageError::Unsuitable(format!(
                "the profile has {} points, and a section {section}; `section_length` must be from \
                 two steps to the length of the profile",
                profile.grid().nodes()[0]
            ))
        })?;
        let of = evaluation.parameters();
        let lengths = [of.ra, of.rq].map(Some);
        let heights = [of.rp, of.rv, of.rz, of.rt].map(Some);
        let Stratified { sk, spk, svk, smr1, smr2 } = of.stratified;
        let rest = [of.rq_of_sections, sk, spk, svk, smr1, smr2].map(Some);
        let values = lengths
            .into_iter()
            .chain([of.rsk, of.rku])
            .chain(heights)
            .chain([of.rsm, of.rdq])
            .chain(rest);
        let settings = self.settings().map(|(column, value)| (column, reals([value])));
        let [sections_column, length_column, columns @ ..] = PROFILE_ROUGHNESS;
        let first = [
            (sections_column, integers([of.sections as i64])),
            (length_column, reals([of.section_length])),
        ];
        let measured = columns.into_iter().zip(values.map(|value| optional_reals([value])));
        let ratio = self.smr_height.map(|height| (RMR, reals([evaluation.curve.ratio_at(height)])));
        let height = self.smc_ratio.map(|ratio| (RMC, reals([evaluation.curve.height_at(ratio)])));
        Ok(settings.chain(first).chain(measured).chain(ratio).chain(height).collect())
    }
}
