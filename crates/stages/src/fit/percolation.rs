//! Percolation thresholds of the gap of the surfaces of a parameter point.

use arrow::array::{Array, BooleanArray, Float64Array, Int64Array, StringArray};

use super::fitted_point::FittedPoint;
use super::{Params, rows, status};
use crate::columns::*;
use crate::ensemble::{Ensemble, Member, ensembles};
use crate::grids::Meshes;
use crate::solve::is_unconverged;
use asperity_mechanics::morphology::area::{CountedArea, YASTREBOV_2017};
use asperity_statistics::bootstrap::Interval;
use asperity_statistics::percolation::{Channels, Interface, PercolationProblem};
use asperity_tables::column::{Role, Value};
use asperity_tables::table::{Table, TableError};

/// Computes the percolation thresholds of the gap for every parameter point.
///
/// # Errors
/// Returns an error if the input lacks the columns of measured contacts.
pub fn run(table: &Table, params: &Params) -> Result<Table, TableError> {
    let measured = Measured::new(table)?;
    let points = ensembles(table)?;
    let fit = |ensemble: &Ensemble| FittedPoint {
        unconverged: measured.unconverged(ensemble),
        ..measured.fit(ensemble, params)
    };
    let fits: Vec<FittedPoint> = points.iter().map(fit).collect();
    let fitted: Vec<(usize, usize)> =
        points.iter().map(|point| (point.first, point.members.len())).collect();
    let table = rows::table(&table.in_role(Role::Parameter), &fitted, params, &fits);
    // A threshold has no residuals.
    Ok(table.without(&["masked", "rms_residual", "r_squared", "reduced_chi_square"]))
}

/// Returns whether the surfaces are random with an isotropic spectrum.
fn is_isotropic(ensemble: &Ensemble) -> bool {
    let is_drawn = ensemble.members.iter().all(|&member| member != Member::Sole);
    let ratio = ensemble.point.get(ANISOTROPY_RATIO.name);
    is_drawn && ratio.is_none_or(|ratio| *ratio == Value::Real(1.0))
}

/// Columns of measured contacts from which thresholds are computed.
pub struct Measured<'a> {
    meshes: Meshes<'a>,
    loads: &'a Float64Array,
    contact_nodes: &'a Int64Array,
    switches: &'a Int64Array,
    /// Flags that tell whether the gap percolates along x and along y.
    is_open: [&'a BooleanArray; 2],
    stops: &'a StringArray,
    /// Work of adhesion, if some contacts attract.
    works: Option<&'a Float64Array>,
}

impl<'a> Measured<'a> {
    /// Finds the columns of measured contacts in a table.
    ///
    /// # Errors
    /// Returns an error if the table lacks the columns of measured contacts.
    pub fn new(table: &'a Table) -> Result<Self, TableError> {
        Ok(Self {
            meshes: Meshes::new(table)?,
            loads: table.reals(LOAD.name)?,
            contact_nodes: table.integers(CONTACT_NODES.name)?,
            switches: table.integers(SWITCHES.name)?,
            is_open: [table.flags(GAP_PERCOLATES_X.name)?, table.flags(GAP_PERCOLATES_Y.name)?],
            stops: table.texts(STOP.name)?,
            works: table.reals(WORK_OF_ADHESION.name).ok(),
        })
    }

    /// Computes three thresholds: for the mean of both directions, along x, and along y. Each
    /// consists of an area, a corrected area and a load. If a surface has no threshold along a
    /// direction, the values of this direction are missing and the row gives the reason.
    fn fit(&self, ensemble: &Ensemble, params: &Params) -> FittedPoint {
        let surfaces: Vec<Vec<Interface>> =
            (0..ensemble.members.len()).map(|member| self.interfaces(ensemble, member)).collect();
        let problem = |channels| PercolationProblem::new(&surfaces, params.window(), channels);
        let [both, x, y] = [Channels::AlongBoth, Channels::AlongX, Channels::AlongY].map(problem);
        let error = match (&x, &y) {
            (Ok(_), Ok(_)) => None,
            (Err(error), Ok(_)) | (Ok(_), Err(error)) => Some(error),
            (Err(_), Err(_)) => both.as_ref().err(),
        };
        let failure = error.map(status::from_error);
        let is_isotropic = is_isotropic(ensemble);
        let thresholds = [both.ok().filter(|_| is_isotropic), x.ok(), y.ok()];
        if thresholds.iter().all(Option::is_none) {
            return FittedPoint { failure, ..FittedPoint::default() };
        }
        let values = |problem: &Option<PercolationProblem>| match problem {
            Some(problem) => problem.mean().values(),
            None => [f64::NAN; 3],
        };
        let intervals = |problem: &Option<PercolationProblem>| match problem {
            Some(problem) => problem.bootstrap(&params.bootstrap()).intervals,
            None => Some(vec![Interval::UNKNOWN; 3]),
        };
        let intervals: Option<Vec<Vec<Interval>>> = thresholds.iter().map(intervals).collect();
        FittedPoint {
            values: thresholds.iter().flat_map(values).collect(),
            intervals: intervals.map(|intervals| intervals.concat()),
            data: surfaces.len(),
            failure,
            ..FittedPoint::default()
        }
    }

    /// Returns the contacts of the surface with index `member`, at ascending loads.
    pub fn interfaces(&self, ensemble: &Ensemble, member: usize) -> Vec<Interface> {
        let rows = (0..ensemble.loads.len()).filter_map(|load| ensemble.row(member, load));
        let mut interfaces: Vec<Interface> = rows.map(|row| self.interface(row)).collect();
        // Rows of paths that prescribe mean gaps ascend in the gap.
        interfaces.sort_by(|one, other| one.load.total_cmp(&other.load));
        interfaces
    }

    /// Returns the contact of one row. With adhesion the corrected area is NaN, because the
    /// coefficient of the correction was measured without.
    pub fn interface(&self, row: usize) -> Interface {
        let count = |counts: &Int64Array| counts.value(row).unsigned_abs() as usize;
        let area = CountedArea {
            nodes: self.meshes.nodes(row).into_iter().product(),
            contact_nodes: count(self.contact_nodes),
            switches: count(self.switches),
        };
        let attracts = self.works.is_some_and(|works| works.is_valid(row));
        Interface {
            load: self.loads.value(row),
            area: area.fraction(),
            area_corrected: if attracts { f64::NAN } else { area.corrected(YASTREBOV_2017) },
            is_open: self.is_open.map(|flags| flags.value(row)),
        }
    }

    fn unconverged(&self, ensemble: &Ensemble) -> usize {
        let stops = self.stops;
        ensemble.states().filter(|&(_, _, row)| is_unconverged(stops.value(row))).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::laws::{Law, PlainLaw};
    use asperity_tables::column::{flags, integers, optional_reals, reals, texts};

    /// Returns two surfaces at four mean gaps, in the order of the gaps. The gap seals between the
    /// loads 0.2 and 0.3, where the area is 0.25. `work` is the work of adhesion.
    fn at_mean_gaps(work: Option<f64>) -> Table {
        let rows = || [0, 1].into_iter().flat_map(|member| [4, 3, 2, 1].map(|load| (member, load)));
        let open = || flags(rows().map(|(_, load)| load < 3));
        Table::new(
            8,
            vec![
                (NODES, integers([10; 8])),
                (WORK_OF_ADHESION, optional_reals([work; 8])),
                (SEED, integers([0; 8])),
                (REALIZATION, integers(rows().map(|(member, _)| member))),
                (
                    MEAN_GAP.with_role(Role::Load),
                    reals(rows().map(|(_, load)| 0.5 - 0.1 * load as f64)),
                ),
                (LOAD.with_role(Role::Result), reals(rows().map(|(_, load)| 0.1 * load as f64))),
                (CONTACT_NODES, integers(rows().map(|(_, load)| 10 * load))),
                (SWITCHES, integers([20; 8])),
                (GAP_PERCOLATES_X, open()),
                (GAP_PERCOLATES_Y, open()),
                (STOP, texts(["converged"; 8])),
            ],
        )
    }

    #[test]
    fn contacts_with_adhesion_have_no_corrected_area_and_any_order_of_loads() {
        let params = Params {
            law: Law::Plain(PlainLaw::GapPercolation),
            window: [0.0, 10.0],
            bootstrap: 20,
            level: 0.9,
            seed: 1,
        };
        for work in [Some(0.1), None] {
            let fitted = run(&at_mean_gaps(work), &params).unwrap();
            let value = |name: &str| fitted.reals(name).unwrap().iter().next().flatten();
            for axis in ["", "_x", "_y"] {
                let of_axis = |name: &str| value(&format!("percolation_{name}{axis}"));
                assert!((of_axis("load").unwrap() - 0.25).abs() < 1e-14);
                assert!((of_axis("area").unwrap() - 0.25).abs() < 1e-14);
                assert_eq!(of_axis("area_corrected").is_some(), work.is_none());
                let error = value(&format!("percolation_load{axis}_standard_error"));
                assert!(error.is_some_and(|error| error > 0.0), "{error:?}");
                let name = format!("percolation_area_corrected{axis}_standard_error");
                assert_eq!(value(&name).is_some(), work.is_none());
            }
        }
    }
}
