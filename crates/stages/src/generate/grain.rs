//! Checks of the grain of random surfaces.

use std::ops::Bound;

use super::keys::AnisotropyTable;
use asperity_contact::grid::Cell;
use asperity_contact::topography::spectrum::{Anisotropy, Spectrum};
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::written::Key;
use asperity_manifest::written::checks::{Bounds, Checks};

const RATIOS: Bounds = (Bound::Included(1.0), Bound::Included(1000.0));
const ANGLES: Bounds = (Bound::Included(0.0), Bound::Excluded(180.0));

/// The grain, if there is any; `None` if what is written is none.
pub fn anisotropy(key: &Key<AnisotropyTable>, checks: &mut Checks) -> Option<Option<Anisotropy>> {
    let Some(written) = key.written() else {
        return Some(None);
    };
    let ratio = match written.value.ratio.written() {
        Some(ratio) => checks.is_in("ratio", ratio, RATIOS),
        None => {
            let message = "`anisotropy` lacks `ratio`";
            let label = "`ratio` is missing here";
            let problem = Problem::new(message, written.span.clone(), label);
            checks.report("anisotropy", problem);
            None
        }
    };
    let angle = checks.number_or("angle", &written.value.angle, ANGLES, 0.0);
    Some(Anisotropy::new(ratio?, angle?))
}

/// Between cutoffs that are close, a grain may leave no wave that fits the cell.
pub fn check_modes(
    key: &Key<AnisotropyTable>,
    spectrum: &Spectrum,
    cell: Cell,
    checks: &mut Checks,
) -> Option<()> {
    let Some(written) = key.written() else {
        return Some(());
    };
    if spectrum.rows(cell).next().is_some() {
        return Some(());
    }
    let message = "with this grain no wave that fits the cell lies between the cutoffs";
    let label = "too close to each other for it";
    checks.report("anisotropy", Problem::new(message, written.span.clone(), label));
    None
}
