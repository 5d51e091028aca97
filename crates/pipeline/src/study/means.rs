//! Means over surfaces that a study computes.

use super::{EmptyTables, Stage, Study};
use asperity_stages::aggregate::{Params, Statistic};
use asperity_stages::columns::{AREA_CORRECTED, AREA_FRACTION, LOAD, SURFACE};
use asperity_stages::{Kind, Recipe, StageError};

/// Means of columns over the surfaces of stages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MeansOfStage {
    /// Index of the stage with the means, or with the rows if no stage computes their means.
    pub stage: usize,
    /// Indices of the stages whose rows are surfaces under loads.
    pub rows: Vec<usize>,
    pub columns: Vec<String>,
    pub is_multilevel: bool,
}

impl Study {
    /// Returns the means of `aggregate` stages over surfaces under loads. A study without such
    /// means and without fits of limits has those of the areas of its last stage with areas.
    ///
    /// # Errors
    /// Returns an error if an SQL query of the study cannot be evaluated.
    pub fn means(&self) -> Result<Vec<MeansOfStage>, StageError> {
        let mut means = Vec::new();
        for stage in 0..self.stages.len() {
            if self.stages[stage].work.kind() == Kind::Aggregate {
                means.extend(self.means_of(stage)?);
            }
        }
        let mut recipes = self.stages.iter().flat_map(|stage| stage.work.recipes());
        let fits_limits = recipes.any(Recipe::is_fit_of_limits);
        for kind in [Kind::Correct, Kind::Measure] {
            let last = self.stages.iter().rposition(|stage| stage.work.kind() == kind);
            if let Some(stage) = last.filter(|_| means.is_empty() && !fits_limits) {
                means.extend(self.means_of(stage)?);
            }
        }
        Ok(means)
    }

    /// Returns the means of a stage over surfaces under loads, or `None` if it has none.
    ///
    /// # Errors
    /// As [`Study::means`].
    pub fn means_of(&self, stage: usize) -> Result<Option<MeansOfStage>, StageError> {
        let tables = EmptyTables::new(self);
        let Stage { inputs, work, .. } = &self.stages[stage];
        let (rows, columns, is_multilevel) = match work.recipes() {
            [Recipe::Aggregate(params)] => match &**params {
                Params::Groups(groups)
                    if groups.group_by.is_none()
                        && groups.statistics.contains(&Statistic::Mean) =>
                {
                    (inputs.clone(), groups.over.clone(), false)
                }
                Params::Multilevel(means) => (inputs.clone(), means.over.clone(), true),
                Params::Groups(_) | Params::Sql(_) => return Ok(None),
            },
            _ => {
                let table = tables.of(self, stage)?;
                let areas = [AREA_FRACTION.name, AREA_CORRECTED.name];
                let known = areas.into_iter().filter(|name| table.has(name));
                (vec![stage], known.map(str::to_owned).collect(), false)
            }
        };
        for &input in &rows {
            let kind = self.stages[input].work.kind();
            let is_of_surfaces = kind != Kind::Generate && kind.depends_on_one_surface();
            let table = tables.of(self, input)?;
            if !is_of_surfaces || !table.has(LOAD.name) || !table.has(SURFACE.name) {
                return Ok(None);
            }
        }
        Ok(Some(MeansOfStage { stage, rows, columns, is_multilevel }))
    }
}
