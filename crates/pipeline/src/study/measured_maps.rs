//! One line about each measured map of a study, with its noise.
//!
//! The files are read again for this, so that only commands that print the lines take the time.

use crate::study::{Study, Warning};
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::topography::periodic::Edges;
use asperity_mechanics::topography::preparation::LowPass;
use asperity_stages::generate::plausibility::DescribedMap;
use asperity_stages::surface::origin::MeasuredSurface;
use asperity_stages::surface::{Origin, Params};

/// What `check` prints about the measured maps of a study.
#[derive(Debug, Default)]
pub struct MeasuredMaps {
    /// A line about each map, with the name of its stage and its path.
    pub lines: Vec<String>,
    /// Warnings of maps whose slope comes from noise that no filter removes.
    pub warnings: Vec<Warning>,
}

impl Study {
    /// Describes each measured map before its filters: each region of each file once, however many
    /// preparations of it there are. Files that cannot be read now are left out.
    pub fn measured_maps(&self) -> MeasuredMaps {
        let mut found = MeasuredMaps::default();
        let mut known = Vec::new();
        for stage in &self.stages {
            for params in stage.work.surfaces().iter().map(|surfaces| &surfaces.params) {
                let Origin::File(file) = &params.origin else { continue };
                let map = (&file.content, &file.choice, &file.preparation.crop);
                if known.contains(&map) {
                    continue;
                }
                known.push(map);
                let Some(described) = self.described(file, params) else { continue };
                let path = self.sources.path_of(&file.content);
                let name = path.map_or_else(String::new, |path| format!("`{}`", path.display()));
                found.lines.push(format!("{}: {name} {described}", stage.name));
                let message = described.warning(&name);
                let is_told = file.unreliable_slope().is_some();
                let is_kept = !is_told && !removes_noise(file, &described);
                let warning = |message| Warning { stage: stage.name.clone(), message };
                found.warnings.extend(message.filter(|_| is_kept).map(warning));
            }
        }
        found
    }

    fn described(&self, file: &MeasuredSurface, params: &Params) -> Option<DescribedMap> {
        let (scan, _) = file.scan(params.sides(), &self.sources).ok()?;
        let levelled = file.preparation.levelled(scan, file.edges).ok()?;
        let is_periodic = file.edges == Edges::Periodic;
        let boundary = if is_periodic { Boundary::Periodic } else { Boundary::Free };
        Some(DescribedMap::new(levelled.scan, &file.unit, boundary))
    }
}

/// Returns whether the low-pass filter of a surface removes the waves in which noise prevails.
fn removes_noise(file: &MeasuredSurface, described: &DescribedMap) -> bool {
    match (&described.noise, file.preparation.low_pass) {
        (Some(noise), Some(LowPass::Wavelength(cutoff))) => cutoff >= noise.floor.wavelength,
        (_, Some(LowPass::Found(_))) | (None, _) => true,
        (Some(_), None) => false,
    }
}
