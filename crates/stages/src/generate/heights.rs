//! Checks of the keys that prescribe the height distribution of random surfaces.

use crate::surface::Heights;
use crate::surface::planned::PlannedSurfaces;
use crate::surface::prescribed_heights::PrescribedHeights;
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::{Key, Spanned};
use asperity_mechanics::topography::johnson::{MomentsError, check_moments};

/// Keys of the height distribution of a random surface.
pub struct HeightKeys<'a> {
    pub skewness: &'a Key<f64>,
    pub kurtosis: &'a Key<f64>,
    pub height_distribution: &'a Key<String>,
    pub heights: &'a Key<Heights>,
}

impl HeightKeys<'_> {
    /// Returns the prescribed height distribution, or `Some(None)` for Gaussian surfaces. `others`
    /// are the surfaces of the stage in `height_distribution`.
    pub fn read(
        &self,
        others: Option<&[PlannedSurfaces]>,
        checks: &mut Checks,
    ) -> Option<Option<PrescribedHeights>> {
        let skewness = checks.optional_number("skewness", self.skewness)?;
        let kurtosis = checks.optional_number("kurtosis", self.kurtosis)?;
        let stage = checks.optional("height_distribution", self.height_distribution)?;
        let prescribed = match (skewness, kurtosis, stage) {
            (None, None, None) => return Some(None),
            (None, None, Some(stage)) => from_surface(stage, others?, checks)?,
            (_, _, Some(stage)) => {
                let [skewness, kurtosis] = [self.skewness, self.kurtosis].map(Key::written);
                let moment = skewness.or(kurtosis)?;
                let message = "`height_distribution` excludes `skewness` and `kurtosis`";
                let problem = Problem::new(message, moment.span.clone(), "gives a moment")
                    .and(stage.span.clone(), "gives the whole distribution");
                return checks.reject(problem.help("remove the moments or `height_distribution`"));
            }
            (Some(skewness), None, None) => {
                let span = &self.skewness.written()?.span;
                let gamma = 3.0 + 1.5 * skewness * skewness;
                let message = "`skewness` needs `kurtosis`";
                let label = format!("a gamma distribution with it has `kurtosis = {gamma}`");
                return checks.refuse("kurtosis", message, span, label);
            }
            (skewness, Some(kurtosis), None) => {
                self.moments(skewness.unwrap_or(0.0), kurtosis, checks)?
            }
        };
        if let Some(written) = self.heights.written().filter(|one| one.value == Heights::None) {
            let message = "surfaces with a prescribed height distribution need heights";
            let label = "must be \"keep\" or \"redraw\": the phases of their modes depend on it";
            return checks.refuse("heights", message, &written.span, label);
        }
        Some(Some(prescribed))
    }

    fn moments(
        &self,
        skewness: f64,
        kurtosis: f64,
        checks: &mut Checks,
    ) -> Option<PrescribedHeights> {
        let Err(error) = check_moments(skewness, kurtosis) else {
            return Some(PrescribedHeights::Moments { skewness, kurtosis });
        };
        let label = match error {
            MomentsError::Impossible { .. } => "too small for this skewness",
            MomentsError::OutOfRange { .. } => "out of range",
        };
        let span = self.kurtosis.written()?.span.clone();
        let problem = Problem::new(error.to_string(), span, label);
        let problem = match self.skewness.written() {
            Some(written) => problem.and(written.span.clone(), "the skewness"),
            None => problem,
        };
        checks.report("kurtosis", problem);
        None
    }
}

/// Returns the height distribution of the surface of another stage, which must have a single
/// parameter point.
fn from_surface(
    stage: &Spanned<String>,
    others: &[PlannedSurfaces],
    checks: &mut Checks,
) -> Option<PrescribedHeights> {
    let [other] = others else {
        let message = format!("`{}` has {} parameter points", stage.value, others.len());
        let label = "must have a single parameter point";
        return checks.refuse("height_distribution", message, &stage.span, label);
    };
    let from = other.params.realization(0).with(Heights::Redraw);
    Some(PrescribedHeights::Surface { from: Box::new(from) })
}
