//! Partial slip of the contacts of a `solve` stage under tangential loads.
//!
//! Ciavarella and Jäger's superposition needs the normal contact under the load N and under a few
//! shares of it; see [`asperity_mechanics::partial_slip`]. These are other loads of the same
//! `solve` stage, so nothing is solved again. The table has rows for the loads N of which all
//! shares are among the loads of the stage.

use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::columns::*;
use crate::ensemble::load_column;
use crate::grids::Grids;
use crate::table_columns::Values::{OptionalReal, Real, Text};
use crate::table_columns::{TableColumns, column, column_if};
use crate::version::Version;
use crate::{StageError, solve, unloading};
use asperity_manifest::decimal;
use asperity_manifest::keys::{Key, Spanned};
use asperity_mechanics::partial_slip::{self, NormalContact, State};
use asperity_tables::table::Table;

/// Maximum number of tangential loads.
const MAX_LOADS: u32 = 10_000;

/// Friction between the surfaces, the value of `friction`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrictionTable {
    /// Coefficient f of Coulomb friction.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub coefficient: f64,
    /// Tangential loads Q/(f N) in the order of the path, each between −1 and 1, where the whole
    /// contact slips. The path starts without a tangential load.
    #[schemars(length(min = 1, max = MAX_LOADS), transform = partial_loads)]
    pub loads: Spanned<Vec<Spanned<f64>>>,
    /// Poisson's ratio ν of both bodies. It adds the tangential displacement and the dissipated
    /// energy, which depend on it.
    #[serde(default)]
    #[schemars(range(max = 0.5), extend("exclusiveMinimum" = -1))]
    pub poisson_ratio: Key<f64>,
}

/// Declares that no tangential load makes the whole contact slip.
fn partial_loads(schema: &mut Schema) {
    if let Some(items) = schema.get_mut("items").and_then(Value::as_object_mut) {
        items.insert("exclusiveMinimum".to_owned(), (-1).into());
        items.insert("exclusiveMaximum".to_owned(), 1.into());
    }
}

/// Version of the dissipated energy.
pub const DISSIPATION_VERSION: Version =
    Version::new(1, &["the first tangential loading dissipates twice as much as was given"]);

/// Friction and tangential loads.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Params {
    pub coefficient: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poisson_ratio: Option<f64>,
    /// Version of the dissipated energy. Omitted without Poisson's ratio, on which it depends, so
    /// that stick areas keep their keys.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dissipation_version: Option<u32>,
    /// Tangential loads Q/(f N) in the order of the path.
    pub loads: Vec<f64>,
}

impl Params {
    /// Returns the shares of the normal load that the path needs, in descending order.
    pub fn shares(&self) -> Vec<f64> {
        let states = partial_slip::states(&self.loads);
        let mut shares: Vec<f64> = states.iter().flat_map(State::shares).collect();
        shares.sort_by(|one, other| other.total_cmp(one));
        shares.dedup_by(|one, other| decimal::is_same(*one, *other));
        shares
    }

    /// Measures the path under each load of which all shares are solved.
    ///
    /// # Errors
    /// Returns an error if a column is missing.
    pub fn measure(&self, solved: &Table) -> Result<Table, StageError> {
        let grids = Grids::new(solved)?;
        let contacts = Contacts::new(solved, &grids)?;
        let states = partial_slip::states(&self.loads);
        let branches = branches(&self.loads);
        let (mut sources, mut rows) = (Vec::new(), Vec::new());
        for (full, normal) in complete(&contacts.loads, &self.shares()) {
            for (state, branch) in states.iter().zip(&branches) {
                sources.push(full);
                rows.push(SlipRow::new(self, &contacts, (full, normal), state, branch));
            }
        }
        Ok(solved.coordinates().pick(&sources).with(columns().filled(self, &rows)))
    }
}

/// Results of a state. They are `None` where one of the loads did not converge.
pub struct SlipRow<'a> {
    params: &'a Params,
    branch: &'a str,
    load: f64,
    stick: Option<f64>,
    area: Option<f64>,
    traction: f64,
    displacement: Option<f64>,
    stiffness: Option<f64>,
    dissipation: Option<f64>,
}

/// Returns the columns of partial slip, without the parameter columns of the loads.
pub fn columns<'a>() -> TableColumns<Params, SlipRow<'a>> {
    TableColumns::<Params, SlipRow>::new([
        column(FRICTION_COEFFICIENT, Real(|row| row.params.coefficient)),
        column(TANGENTIAL_LOAD, Real(|row| row.load)),
        column(TANGENTIAL_BRANCH, Text(|row| row.branch)),
        column(STICK_FRACTION, OptionalReal(|row| row.stick)),
        column(SLIP_FRACTION, OptionalReal(|row| Some(row.area? - row.stick?))),
        column(CONTACT_FRACTION, OptionalReal(|row| row.area)),
        column(TANGENTIAL_TRACTION, Real(|row| row.traction)),
        column_if(is_compliant, POISSON_RATIO, OptionalReal(|row| row.params.poisson_ratio)),
        column_if(is_compliant, TANGENTIAL_DISPLACEMENT, OptionalReal(|row| row.displacement)),
        column_if(is_compliant, TANGENTIAL_STIFFNESS, OptionalReal(|row| row.stiffness)),
        column_if(is_compliant, FRICTIONAL_DISSIPATION, OptionalReal(|row| row.dissipation)),
    ])
}

/// Returns whether the tangential compliance is known, which depends on Poisson's ratio.
fn is_compliant(params: &Params) -> bool {
    params.poisson_ratio.is_some()
}

impl<'a> SlipRow<'a> {
    /// Computes the results of a state under the normal load `load`, which is in the row `full` of
    /// the contacts.
    fn new(
        params: &'a Params,
        contacts: &Contacts,
        (full, load): (usize, f64),
        state: &State,
        branch: &'a str,
    ) -> SlipRow<'a> {
        let at = |share: f64| find(&contacts.loads, share * load).and_then(|row| contacts.at(row));
        let friction = params.coefficient;
        let whole = contacts.at(full);
        let ratio = params.poisson_ratio.map(partial_slip::compliance_ratio);
        let displacement = state.terms.iter().map(|term| {
            let run = whole?.normal.approach - at(term.share)?.normal.approach;
            Some(term.weight * friction * ratio? * run)
        });
        let dissipation = state.losses.iter().map(|loss| {
            let [full, stick] = [whole?.normal, at(loss.share)?.normal];
            Some(loss.times * partial_slip::dissipated(full, stick, friction, ratio?))
        });
        let stick = at(state.stick_share());
        SlipRow {
            params,
            branch,
            load: state.load,
            stick: stick.filter(|_| whole.is_some()).map(|stick| stick.area),
            area: whole.map(|whole| whole.area),
            traction: friction * state.load * contacts.pressures[full],
            displacement: displacement.sum(),
            stiffness: stick.and_then(|stick| Some(stick.stiffness? / ratio?)),
            dissipation: dissipation.sum(),
        }
    }
}

/// Solved contacts under the loads of one surface.
struct Contacts {
    /// Loads in the unit of the manifest.
    loads: Vec<f64>,
    pressures: Vec<f64>,
    /// Contact under each load; `None` if it did not converge.
    solved: Vec<Option<Solved>>,
}

#[derive(Debug, Clone, Copy)]
struct Solved {
    area: f64,
    normal: NormalContact,
    /// Normal stiffness, if the stage has it.
    stiffness: Option<f64>,
}

impl Contacts {
    fn new(solved: &Table, grids: &Grids) -> Result<Contacts, StageError> {
        let loads = solved.reals(load_column(solved))?;
        let pressures = solved.reals(PRESSURE.name)?;
        let gaps = solved.reals(MEAN_GAP.name)?;
        let energies = solved.reals(ENERGY.name)?;
        let nodes = solved.integers(CONTACT_NODES.name)?;
        let stops = solved.texts(STOP.name)?;
        let [displacements, stiffnesses] =
            [MEAN_DISPLACEMENT, FROZEN_STIFFNESS].map(|column| solved.reals(column.name).ok());
        let contact = |row: usize| -> Result<Option<Solved>, StageError> {
            let displacement = displacements.map_or(0.0, |displacements| displacements.value(row));
            let normal = NormalContact {
                load: pressures.value(row),
                approach: displacement - gaps.value(row),
                energy: energies.value(row),
            };
            let area = nodes.value(row) as f64 / grids.grid(row)?.count() as f64;
            let is_solved = !solve::is_unconverged(stops.value(row));
            let stiffness = stiffnesses.and_then(|stiffnesses| stiffnesses.iter().nth(row)?);
            Ok(is_solved.then_some(Solved { area, normal, stiffness }))
        };
        Ok(Contacts {
            loads: loads.values().to_vec(),
            pressures: pressures.values().to_vec(),
            solved: (0..solved.rows()).map(contact).collect::<Result<_, _>>()?,
        })
    }

    fn at(&self, row: usize) -> Option<Solved> {
        self.solved[row]
    }
}

/// Returns the index and the value of each load of which all shares are among the loads.
pub fn complete(loads: &[f64], shares: &[f64]) -> impl Iterator<Item = (usize, f64)> {
    loads.iter().copied().enumerate().filter(|(_, load)| {
        shares.iter().all(|share| find(loads, decimal::nearest(share * load)).is_some())
    })
}

/// Returns the index of a load that equals `wanted` up to rounding.
pub fn find(loads: &[f64], wanted: f64) -> Option<usize> {
    loads.iter().position(|load| decimal::is_same(*load, wanted))
}

/// Returns the branch of each tangential load of a path, which starts at zero.
fn branches(loads: &[f64]) -> Vec<String> {
    let before = std::iter::once(&0.0).chain(loads);
    let grows = before.zip(loads).map(|(before, load)| load > before);
    unloading::numbered(grows.map(|grows| if grows { "loading" } else { "unloading" }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cycle_needs_one_share_and_has_numbered_branches() {
        let loads = vec![0.5, -0.5, 0.5, -0.5];
        let params =
            Params { coefficient: 0.3, poisson_ratio: None, dissipation_version: None, loads };
        assert_eq!(params.shares(), [0.5]);
        let expected = ["loading", "unloading", "loading-2", "unloading-2"];
        assert_eq!(branches(&params.loads), expected);
    }

    #[test]
    fn loads_without_their_shares_are_left_out() {
        let loads = [0.05, 0.08, 0.1, 0.2];
        let rows: Vec<usize> = complete(&loads, &[0.8, 0.5]).map(|(row, _)| row).collect();
        assert_eq!(rows, [2]);
    }
}
