//! Values of claims from the tables of a study: groups of rows that agree in their parameters, with
//! one value per surface and load.

use std::collections::BTreeMap;

use arrow::array::Array;

use crate::limits::{KappaPoints, LimitsFit, kappa_points};
use crate::setting::{Setting, Varied, of_asperities, spectrum};
use asperity_manifest::decimal;
use asperity_manifest::expression::Expression;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::study::Study;
use asperity_pipeline::study::claims::{AskedLoad, DataSpec, Loads, SelectedValue, Source};
use asperity_stages::aggregate::Statistic;
use asperity_stages::columns::*;
use asperity_stages::ensemble::{Ensemble, Load, ParameterPoint, ensembles, load_column};
use asperity_stages::fit::laws::Law;
use asperity_stages::fit::meshes::refinements;
use asperity_stages::fit::percolation::Measured;
use asperity_stages::{Kind, Recipe};
use asperity_statistics::Window;
use asperity_statistics::percolation::{Channels, PercolationProblem};
use asperity_tables::column::{Role, Value};
use asperity_tables::table::{Table, TableError};

/// Table of the finished tasks of a stage.
#[derive(Debug, Clone)]
pub struct StageTable {
    pub name: String,
    pub kind: Kind,
    pub table: Table,
}

/// Results of a study that claims use.
#[derive(Debug, Clone)]
pub struct Evidence {
    stages: Vec<StageTable>,
    /// Rows in the setting, by kind: surfaces, asperity models, contacts and corrected areas.
    of_kind: BTreeMap<Kind, Table>,
    /// Distributions of contact pressures in the setting.
    pressures: Table,
    /// Values of κ = A/(A₀ y) for the fits of the limits of κ, one item for each load.
    pub(crate) kappa: Vec<KappaPoints>,
    varied: Varied,
    /// Setting that all rows by kind share, and the rows left out.
    pub setting: Setting,
}

/// Values of the surfaces that agree in all parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Group {
    pub point: ParameterPoint,
    pub name: String,
    /// Ascending loads in units of E* × rms slope, or one NaN if the values have no load.
    pub loads: Vec<f64>,
    /// The same loads in the unit of the manifest.
    pub given: Vec<f64>,
    /// Values, `[load][surface]`, with surfaces in the order of seed and realization.
    pub values: Vec<Vec<f64>>,
    /// Standard error of the mean that more surfaces do not reduce.
    pub systematic: f64,
    /// True if the differences between surfaces are known.
    pub has_scatter: bool,
    /// Standard errors at the loads and number of surfaces, if the values are results of fits or
    /// means and not of single surfaces.
    pub estimate: Option<(Vec<f64>, usize)>,
}

impl Group {
    /// Creates a group of values that have no load, without parameters.
    pub fn without_loads(values: Vec<Vec<f64>>) -> Group {
        let loads = vec![f64::NAN; values.len()];
        Group { given: loads.clone(), loads, values, ..Group::default() }
    }

    pub fn surfaces(&self) -> usize {
        self.values.first().map_or(0, Vec::len)
    }

    /// Returns the number of a parameter.
    pub fn number(&self, name: &str) -> Option<f64> {
        match self.point.get(name)? {
            Value::Real(number) => Some(*number),
            Value::Integer(number) => Some(*number as f64),
            _ => None,
        }
    }

    /// Returns the index of the load nearest to the requested one, if it is within 10 %.
    pub fn at(&self, asked: AskedLoad) -> Option<usize> {
        nearest(if asked.is_pressure { &self.given } else { &self.loads }, asked.value)
    }

    /// Returns the indices of the requested loads.
    pub fn indices(&self, loads: &Loads) -> Vec<Option<usize>> {
        match loads {
            Loads::All => (0..self.loads.len()).map(Some).collect(),
            Loads::Lightest => vec![(!self.loads.is_empty()).then_some(0)],
            Loads::Heaviest => vec![self.loads.len().checked_sub(1)],
            Loads::At(loads) => loads.iter().map(|load| self.at(*load)).collect(),
        }
    }
}

/// Returns the index of the load nearest to `load`, if it is within 10 %.
pub fn nearest(loads: &[f64], load: f64) -> Option<usize> {
    let nearest = (0..loads.len()).min_by(|&one, &other| {
        let distance = |index: usize| (loads[index] - load).abs();
        distance(one).total_cmp(&distance(other))
    })?;
    ((loads[nearest] / load - 1.0).abs() < 0.1).then_some(nearest)
}

impl Evidence {
    /// Creates the evidence from the tables of a study, one for each stage of the plan, or `None`
    /// for a stage without finished tasks. For each fit of the limits of κ, adds the values of κ of
    /// single surfaces.
    ///
    /// # Errors
    /// If a table lacks a column that its kind of stage writes.
    pub fn from_study(
        study: &Study,
        plan: &Plan,
        tables: &[Option<Table>],
    ) -> Result<Evidence, TableError> {
        let stages = plan.stages.iter().zip(tables);
        let finished = stages.filter_map(|(stage, table)| {
            Some(StageTable { name: stage.name.clone(), kind: stage.kind, table: table.clone()? })
        });
        Evidence::from_tables(finished.collect())?.with_limits(&limits(study, plan, tables)?)
    }

    /// Creates the evidence from the tables of stages.
    ///
    /// # Errors
    /// If a table lacks a column that its kind of stage writes.
    pub fn from_tables(stages: Vec<StageTable>) -> Result<Evidence, TableError> {
        let of = |kind: Kind| {
            let own = stages.iter().filter(move |stage| stage.kind == kind);
            own.map(|stage| &stage.table)
        };
        let is_contacts = |table: &&Table| table.has(CONTACT_NODES.name);
        let contacts: Vec<&Table> = of(Kind::Measure).filter(is_contacts).collect();
        let corrected: Vec<&Table> = of(Kind::Correct).collect();
        let setting = match (contacts.is_empty(), corrected.is_empty()) {
            (false, _) => Setting::most_frequent(contacts.iter().copied()),
            (true, false) => Setting::most_frequent(corrected.iter().copied()),
            (true, true) => Setting::most_frequent(of(Kind::Generate)),
        };
        let stacked = |tables: Vec<&Table>| {
            let in_setting = tables.into_iter().map(|table| setting.rows(table));
            Table::stack(&in_setting.collect::<Vec<_>>())
        };
        let is_pressures = |table: &&Table| table.has(PRESSURE_DENSITY.name);
        let pressures = stacked(of(Kind::Measure).filter(is_pressures).collect())?;
        let asperities = of(Kind::Solve).map(|table| of_asperities(table, &setting));
        let of_kind = BTreeMap::from([
            (Kind::Generate, stacked(of(Kind::Generate).collect())?),
            (Kind::Solve, Table::stack(&asperities.collect::<Vec<_>>())?),
            (Kind::Measure, stacked(contacts)?),
            (Kind::Correct, stacked(corrected)?),
        ]);
        let mut spectra = Vec::new();
        for table in [&of_kind[&Kind::Measure], &of_kind[&Kind::Correct], &pressures] {
            if spectra.is_empty() || !std::ptr::eq(table, &pressures) {
                let parameters = table.in_role(Role::Parameter);
                for rows in asperity_stages::ensemble::grouped(&parameters) {
                    spectra.extend(spectrum(table, rows[0])?);
                }
            }
        }
        let varied = Varied::among(&spectra);
        Ok(Evidence { stages, of_kind, pressures, kappa: Vec::new(), varied, setting })
    }

    /// Adds the values of κ of single surfaces for each fit of the limits of κ.
    ///
    /// # Errors
    /// If a table lacks a column that a fit reads.
    pub fn with_limits(mut self, fits: &[LimitsFit]) -> Result<Evidence, TableError> {
        self.kappa = kappa_points(fits, &self.setting)?;
        Ok(self)
    }

    /// Returns the rows of data by kind, without those that `where` leaves out.
    pub fn rows(&self, data: &DataSpec) -> Table {
        let table = match &data.source {
            Source::Stage(stage) => {
                self.stages.iter().find(|known| known.name == *stage).map(|known| &known.table)
            }
            Source::Spectra(Kind::Measure) if uses_pressures(data) => Some(&self.pressures),
            Source::Spectra(kind) => self.of_kind.get(kind),
        };
        let Some(table) = table else { return Table::empty(&[]) };
        let columns: Vec<_> = data
            .selection
            .iter()
            .map(|(name, values)| (table.batch().column_by_name(name), values))
            .collect();
        let is_selected = |row: &usize| {
            columns.iter().all(|(column, values): &(_, &Vec<SelectedValue>)| {
                let cell = column.and_then(|column| Value::from_array(column, *row));
                cell.is_some_and(|cell| values.iter().any(|value| value.is_same(&cell)))
            })
        };
        let rows: Vec<usize> = (0..table.rows()).filter(is_selected).collect();
        table.pick(&rows)
    }

    /// Returns the groups of data, without those that other data replace, in the order of their
    /// parameters.
    ///
    /// # Errors
    /// If the columns of the values are not numbers.
    pub fn groups(&self, data: &DataSpec) -> Result<Vec<Group>, TableError> {
        let table = self.rows(data);
        let mut groups = Vec::new();
        if table.rows() > 0 && data.value.columns().iter().all(|column| table.has(column)) {
            let columns = data.value.columns().into_iter().map(str::to_owned);
            let rows = RowValues { table: &table, value: &data.value, columns: columns.collect() };
            for ensemble in ensembles_of(&table)? {
                let Some((point, name)) = self.identity(data, &table, &ensemble)? else {
                    continue;
                };
                groups.push(rows.group(&ensemble, point, name));
            }
            groups.retain(|group| !group.values.is_empty());
        }
        groups.sort_by(|one, other| one.point.cmp(&other.point));
        // If a spectrum was solved with several tolerances, the first one counts.
        groups.dedup_by(|next, kept| next.point == kept.point);
        if let Some(other) = &data.otherwise {
            for group in self.groups(other)? {
                if groups.iter().all(|known| known.point != group.point) {
                    groups.push(group);
                }
            }
            groups.sort_by(|one, other| one.point.cmp(&other.point));
        }
        if matches!(data.source, Source::Spectra(_)) {
            let cutoff = |group: &Group, name: &str| group.number(name).map(|k| k as i64);
            groups.sort_by_key(|group| (cutoff(group, K_LOWER.name), cutoff(group, K_UPPER.name)));
        }
        Ok(groups)
    }

    /// Returns the parameters and the name of a group, or `None` if claims on spectra leave it out.
    fn identity(
        &self,
        data: &DataSpec,
        table: &Table,
        ensemble: &Ensemble,
    ) -> Result<Option<(ParameterPoint, String)>, TableError> {
        if matches!(data.source, Source::Spectra(_)) {
            let spectrum = spectrum(table, ensemble.first)?;
            return Ok(spectrum.map(|point| (point.clone(), self.varied.name(&point))));
        }
        let fixed: Vec<&str> = data
            .selection
            .iter()
            .filter(|(_, values)| values.len() == 1)
            .map(|(name, _)| name.as_str())
            .collect();
        let point = ensemble.point.clone().without(&fixed);
        let shared = ParameterPoint::from_row(&table.common(), 0);
        let name = point.clone().beyond(&shared).to_string();
        Ok(Some((point, name)))
    }

    /// Returns the fractions of the nominal area with pressures from `low` to `high`, by spectrum,
    /// under the loads at which they are known.
    ///
    /// # Errors
    /// If a table of pressures lacks a column.
    pub fn fractions(
        &self,
        data: &DataSpec,
        [low, high]: [f64; 2],
    ) -> Result<Vec<Group>, TableError> {
        let table = self.rows(data);
        let mut bins: BTreeMap<_, Vec<Bin>> = BTreeMap::new();
        if table.rows() == 0 {
            return Ok(Vec::new());
        }
        let density = Expression::Column(PRESSURE_DENSITY.name.to_owned());
        // Each bin is an ensemble of its own, because its middle is a parameter.
        for bin in ensembles(&table)? {
            let of = |column: &str| number(&table, column, bin.first);
            let ends = of(CONTACT_PRESSURE.name).zip(of(PRESSURE_BIN_WIDTH.name));
            let (Some((middle, width)), Some(spectrum)) = (ends, spectrum(&table, bin.first)?)
            else {
                continue;
            };
            let ends = [middle - 0.5 * width, middle + 0.5 * width].map(decimal::nearest);
            let columns = vec![PRESSURE_DENSITY.name.to_owned()];
            let rows = RowValues { table: &table, value: &density, columns };
            let mut group = rows.group(&bin, spectrum.clone(), self.varied.name(&spectrum));
            group.values.iter_mut().flatten().for_each(|value| *value *= width);
            bins.entry(spectrum).or_default().push((ends, group));
        }
        Ok(bins.into_values().filter_map(|bins| sum_between(bins, low, high)).collect())
    }

    /// Returns the corrected areas at which the gaps of surfaces stop percolating. Omits a spectrum
    /// if one of its surfaces is open at all loads or sealed at all loads, because the mean over
    /// the other surfaces would be biased.
    ///
    /// # Errors
    /// If a column has another type.
    pub fn sealing_areas(&self, data: &DataSpec) -> Result<Vec<Group>, TableError> {
        let table = self.rows(data);
        let needed = [GAP_PERCOLATES_X, GAP_PERCOLATES_Y, STOP, SWITCHES];
        if table.rows() == 0 || !needed.iter().all(|column| table.has(column.name)) {
            return Ok(Vec::new());
        }
        let measured = Measured::new(&table)?;
        let mut groups: Vec<Group> = Vec::new();
        for ensemble in ensembles(&table)? {
            let Some((point, name)) = self.identity(data, &table, &ensemble)? else { continue };
            let members = 0..ensemble.members.len();
            let surfaces: Vec<_> =
                members.map(|member| measured.interfaces(&ensemble, member)).collect();
            let Ok(problem) = PercolationProblem::new(&surfaces, Window::ALL, Channels::AlongBoth)
            else {
                continue;
            };
            if groups.iter().any(|known| known.point == point) {
                continue;
            }
            let areas = problem.thresholds().iter().map(|threshold| threshold.area_corrected);
            groups.push(Group {
                point,
                name,
                systematic: problem.resolution_error().area_corrected,
                has_scatter: problem.resolves_scatter(),
                ..Group::without_loads(vec![areas.collect()])
            });
        }
        groups.sort_by(|one, other| one.point.cmp(&other.point));
        Ok(groups)
    }
}

impl Evidence {
    /// Returns the moments of the counted area A_N and the edge S_d Δx over several meshes, which
    /// give the coefficient c of A_N = A* + c S_d Δx: [Cov(A_N, S_d Δx), Var(S_d Δx)], summed over
    /// loads, each with one value per surface, by spectrum.
    ///
    /// # Errors
    /// If a column has another type.
    pub fn mesh_errors(&self, data: &DataSpec) -> Result<Vec<Group>, TableError> {
        let table = self.rows(data);
        let mut groups = Vec::new();
        for point in refinements(&table, Window::ALL).unwrap_or_default() {
            let Some((spectrum, [covariances, variances])) =
                spectrum(&table, point.row)?.zip(point.moments())
            else {
                continue;
            };
            groups.push(Group {
                name: spectrum.clone().only(&[K_LOWER.name, K_UPPER.name]).to_string(),
                point: spectrum,
                ..Group::without_loads(vec![covariances, variances])
            });
        }
        Ok(groups)
    }
}

fn uses_pressures(data: &DataSpec) -> bool {
    data.value.columns().contains(PRESSURE_DENSITY.name)
}

/// Returns the ensembles of a table. If the rows have no loads, each has a single load, NaN.
fn ensembles_of(table: &Table) -> Result<Vec<Ensemble>, TableError> {
    if table.has(load_column(table)) {
        return ensembles(table);
    }
    ensembles(&table.with(vec![(LOAD, asperity_tables::column::reals(vec![1.0; table.rows()]))]))
}

/// Values of an expression in the rows of a table.
struct RowValues<'a> {
    table: &'a Table,
    value: &'a Expression,
    columns: Vec<String>,
}

impl RowValues<'_> {
    fn value(&self, row: usize) -> Option<f64> {
        let known = |column: &String| number(self.table, column, row);
        let values: Vec<f64> = self.columns.iter().map(known).collect::<Option<_>>()?;
        let column = |name: &str| {
            let index = self.columns.iter().position(|column| column == name);
            index.map_or(f64::NAN, |index| values[index])
        };
        let value = self.value.value(&column);
        (!value.is_nan()).then_some(value)
    }

    /// Returns the values at the loads at which all surfaces have one. Areas of surfaces in full
    /// contact, at which their loads end, are 1 at all larger loads.
    fn group(&self, ensemble: &Ensemble, point: ParameterPoint, name: String) -> Group {
        let is_area =
            |column: &String| [AREA_FRACTION.name, AREA_CORRECTED.name].contains(&column.as_str());
        let is_area =
            matches!(self.value, Expression::Column(_)) && self.columns.iter().all(is_area);
        let has_loads = self.table.has(load_column(self.table));
        let members = 0..ensemble.members.len();
        let last = |member: usize| {
            (0..ensemble.loads.len()).rfind(|&load| ensemble.row(member, load).is_some())
        };
        let lasts: Vec<Option<usize>> = members.clone().map(last).collect();
        let value = |member: usize, load: usize| match ensemble.row(member, load) {
            Some(row) => self.value(row),
            None => {
                let last = lasts[member].filter(|&last| is_area && load > last)?;
                self.value(ensemble.row(member, last)?).filter(|area| *area == 1.0)
            }
        };
        let complete = ensemble.loads.iter().enumerate().filter_map(|(index, load)| {
            let values = members.clone().map(|member| value(member, index));
            match has_loads {
                true => Some((*load, values.collect::<Option<Vec<f64>>>()?)),
                // Surfaces without the value do not count.
                false => Some((*load, values.flatten().collect())),
            }
        });
        let (loads, values): (Vec<Load>, Vec<Vec<f64>>) = complete.unzip();
        let of = |load: fn(&Load) -> f64| match has_loads {
            true => loads.iter().map(load).collect(),
            false => vec![f64::NAN; loads.len()],
        };
        let values = if values.iter().all(Vec::is_empty) { Vec::new() } else { values };
        let estimate = self.errors(ensemble, &loads);
        Group {
            point,
            name,
            loads: of(|load| load.reduced),
            given: of(|load| load.given),
            values,
            has_scatter: estimate.is_none(),
            estimate,
            ..Group::default()
        }
    }

    /// Returns the standard errors of results of fits or of means at these loads, and the number of
    /// surfaces. Returns `None` for values of single surfaces.
    fn errors(&self, ensemble: &Ensemble, loads: &[Load]) -> Option<(Vec<f64>, usize)> {
        let Expression::Column(column) = self.value else { return None };
        let of_mean = Statistic::Mean.base_of(column).map(|base| Statistic::Sem.column_of(base));
        let names = [Some(format!("{column}_standard_error")), of_mean];
        let error = names.into_iter().flatten().find(|name| self.table.has(name))?;
        let counted = ["surfaces", "count"].into_iter().find(|name| self.table.has(name))?;
        let row = |load: &Load| {
            let index = ensemble.loads.iter().position(|known| known == load)?;
            ensemble.row(0, index)
        };
        let of = |name: &str| -> Option<Vec<f64>> {
            loads.iter().map(|load| number(self.table, name, row(load)?)).collect()
        };
        let fewest = of(counted)?.into_iter().reduce(f64::min)?;
        (!self.table.has(SURFACE.name)).then_some((of(&error)?, fewest as usize))
    }
}

/// Edges of a bin of pressures, and the fractions of the area in it.
type Bin = ([f64; 2], Group);

/// Adds the fractions of the bins from `low` to `high`, at the loads that these bins have.
fn sum_between(mut bins: Vec<Bin>, low: f64, high: f64) -> Option<Group> {
    bins.sort_by(|one, other| one.0[0].total_cmp(&other.0[0]));
    bins.dedup_by(|next, kept| next.0 == kept.0);
    let first = bins.iter().position(|(ends, _)| decimal::is_same(ends[0], low))?;
    let last = bins.iter().position(|(ends, _)| decimal::is_same(ends[1], high))?;
    let inside = bins.get(first..=last)?;
    let mut sum = inside.first()?.1.clone();
    for (_, bin) in &inside[1..] {
        let mut kept = Vec::new();
        for (index, load) in sum.loads.iter().enumerate() {
            let other = bin.loads.iter().position(|other| other == load);
            if let Some(other) = other {
                let added = sum.values[index].iter().zip(&bin.values[other]);
                kept.push((index, added.map(|(one, other)| one + other).collect::<Vec<f64>>()));
            }
        }
        sum.loads = kept.iter().map(|(index, _)| sum.loads[*index]).collect();
        sum.given = kept.iter().map(|(index, _)| sum.given[*index]).collect();
        sum.values = kept.into_iter().map(|(_, values)| values).collect();
    }
    Some(sum)
}

/// Returns a number of a row, from a column of reals or integers. Returns `None` if it is null or
/// the column is missing.
pub fn number(table: &Table, name: &str, row: usize) -> Option<f64> {
    if let Ok(reals) = table.reals(name) {
        return reals.is_valid(row).then(|| reals.value(row));
    }
    let integers = table.integers(name).ok()?;
    integers.is_valid(row).then(|| integers.value(row) as f64)
}

/// Returns the fits of the law `limits` in a study, each with the rows that it reads.
fn limits(
    study: &Study,
    plan: &Plan,
    tables: &[Option<Table>],
) -> Result<Vec<LimitsFit>, TableError> {
    let mut fits = Vec::new();
    for (stage, planned) in study.stages.iter().zip(&plan.stages) {
        for &task in &planned.tasks {
            let Recipe::Fit(params) = &plan.tasks[task].recipe else {
                continue;
            };
            let Law::Limits(choices) = &params.law else {
                continue;
            };
            let table_of = |&input: &usize| tables[input].clone();
            let inputs: Vec<Table> = stage.inputs.iter().filter_map(table_of).collect();
            if !inputs.is_empty() {
                fits.push(LimitsFit {
                    choices: choices.as_ref().clone(),
                    window: params.window(),
                    table: Table::stack(&inputs)?,
                });
            }
        }
    }
    Ok(fits)
}
