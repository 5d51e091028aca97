//! Percolation thresholds of the gap of the surfaces of a parameter point.

use arrow::array::{BooleanArray, Float64Array, Int64Array, StringArray};

use super::Params;
use super::rows::{self, Row};
use super::status;
use crate::columns::*;
use crate::ensemble::{Ensemble, Member, ensembles};
use crate::grids::Meshes;
use crate::solve::is_unconverged;
use asperity_contact::morphology::area::{CountedArea, YASTREBOV_2017};
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
    let fit = |ensemble: &Ensemble| Row {
        unconverged: measured.unconverged(ensemble),
        ..measured.fit(ensemble, params)
    };
    let fits: Vec<Row> = points.iter().map(fit).collect();
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
        })
    }

    /// Computes three thresholds: for the mean of both directions, along x, and along y. Each
    /// consists of an area, a corrected area and a load. If a surface has no threshold along a
    /// direction, the values of this direction are missing and the row gives the reason.
    fn fit(&self, ensemble: &Ensemble, params: &Params) -> Row {
        let surfaces: Vec<Vec<Interface>> =
            (0..ensemble.members.len()).map(|member| self.interfaces(ensemble, member)).collect();
        let problem = |channels| PercolationProblem::new(&surfaces, params.window(), channels);
        let [both, x, y] = [Channels::AlongBoth, Channels::AlongX, Channels::AlongY].map(problem);
        let failure = match (&x, &y) {
            (Ok(_), Ok(_)) => None,
            (Err(error), Ok(_)) | (Ok(_), Err(error)) => Some(error),
            (Err(_), Err(_)) => both.as_ref().err(),
        };
        let failure = failure.map(status::from_error);
        let is_isotropic = is_isotropic(ensemble);
        let thresholds = [both.ok().filter(|_| is_isotropic), x.ok(), y.ok()];
        if thresholds.iter().all(Option::is_none) {
            return Row { failure, ..Row::default() };
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
        Row {
            values: thresholds.iter().flat_map(values).collect(),
            intervals: intervals.map(|intervals| intervals.concat()),
            data: surfaces.len(),
            failure,
            ..Row::default()
        }
    }

    /// Returns the contacts of the surface with index `member`, at ascending loads.
    pub fn interfaces(&self, ensemble: &Ensemble, member: usize) -> Vec<Interface> {
        let rows = (0..ensemble.loads.len()).filter_map(|load| ensemble.row(member, load));
        rows.map(|row| self.interface(row)).collect()
    }

    /// Returns the contact of one row.
    pub fn interface(&self, row: usize) -> Interface {
        let count = |counts: &Int64Array| counts.value(row).unsigned_abs() as usize;
        let area = CountedArea {
            nodes: self.meshes.nodes(row).into_iter().product(),
            contact_nodes: count(self.contact_nodes),
            switches: count(self.switches),
        };
        Interface {
            load: self.loads.value(row),
            area: area.fraction(),
            area_corrected: area.corrected(YASTREBOV_2017),
            is_open: self.is_open.map(|flags| flags.value(row)),
        }
    }

    fn unconverged(&self, ensemble: &Ensemble) -> usize {
        let stops = self.stops;
        ensemble.states().filter(|&(_, _, row)| is_unconverged(stops.value(row))).count()
    }
}
