//! Quantities for each surface and load: distributions of contact pressures, sealing areas, and the
//! values of κ = A/(A₀ y) from which limits of κ are fitted.

use std::collections::{BTreeMap, BTreeSet};

use crate::evidence::{Evidence, Spectrum, key, number, spectrum};
use crate::setting::Setting;
use asperity_manifest::decimal;
use asperity_manifest::expression::Expression;
use asperity_stages::columns::*;
use asperity_stages::correct::OF_2017;
use asperity_stages::ensemble::{Ensemble, ParameterPoint, ensembles};
use asperity_stages::fit::limits::{LimitChoices, groups};
use asperity_stages::fit::percolation::Measured;
use asperity_statistics::Window;
use asperity_statistics::intervals::Weights;
use asperity_statistics::limits::{LimitPoint, Observed, TermForm};
use asperity_statistics::percolation::{Channels, Interface, PercolationProblem};
use asperity_tables::column::Role;
use asperity_tables::table::{Table, TableError};

/// One value per surface and load for one spectrum, at the loads at which all surfaces have a
/// value.
#[derive(Debug, Clone, PartialEq)]
pub struct PerLoad {
    pub spectrum: Spectrum,
    /// Ascending loads, in units of E* × rms slope.
    pub loads: Vec<f64>,
    /// Values, `[load][surface]`, with surfaces in the order of seed and realization.
    pub values: Vec<Vec<f64>>,
}

/// Distributions of contact pressure on the surfaces of a spectrum under one load.
#[derive(Debug, Clone, PartialEq)]
pub struct Pressures {
    pub spectrum: Spectrum,
    /// Load in units of E* × rms slope.
    pub load: f64,
    /// Edges of the bins, ascending, in units of E* × rms slope.
    pub bins: Vec<[f64; 2]>,
    /// Fractions of the nominal area with a pressure in the bin, `[bin][surface]`.
    pub shares: Vec<Vec<f64>>,
}

/// Contact areas at which the gap stops percolating, for the surfaces of a spectrum, corrected with
/// the estimator `2017`.
#[derive(Debug, Clone, PartialEq)]
pub struct SealingAreas {
    pub spectrum: Spectrum,
    /// Area fractions in the order of seed and realization.
    pub values: Vec<f64>,
    /// Standard error of the mean due to the spacing of the loads.
    pub rounding: f64,
    /// True if the loads are close enough to determine the scatter of the areas.
    pub scatter_is_resolved: bool,
}

impl PerLoad {
    pub fn surfaces(&self) -> usize {
        self.values.first().map_or(0, Vec::len)
    }

    /// Returns the index of the load nearest to `load`, if it is within 10 %.
    pub fn at(&self, load: f64) -> Option<usize> {
        nearest(&self.loads, load)
    }

    /// Returns the values at those of these loads that have values.
    pub fn at_loads(&self, loads: &[f64]) -> PerLoad {
        let all = self.loads.iter().copied().zip(self.values.iter().cloned());
        let (loads, values) = all.filter(|(load, _)| loads.contains(load)).unzip();
        PerLoad { spectrum: self.spectrum.clone(), loads, values }
    }
}

impl Pressures {
    pub fn surfaces(&self) -> usize {
        self.shares.first().map_or(0, Vec::len)
    }

    /// Returns the fraction of the nominal area with a pressure from `low` to `high` for each
    /// surface. Returns `None` if `low` or `high` is not an edge of a bin.
    pub fn between(&self, low: f64, high: f64) -> Option<Vec<f64>> {
        let first = self.bins.iter().position(|bin| decimal::is_same(bin[0], low))?;
        let last = self.bins.iter().position(|bin| decimal::is_same(bin[1], high))?;
        let inside = self.shares.get(first..=last)?;
        let sum = |surface: usize| inside.iter().map(|shares| shares[surface]).sum();
        Some((0..self.surfaces()).map(sum).collect())
    }
}

/// Returns the index of the load nearest to `load`, if it is within 10 %.
pub(super) fn nearest(loads: &[f64], load: f64) -> Option<usize> {
    let nearest = (0..loads.len()).min_by(|&one, &other| {
        let distance = |index: usize| (loads[index] - load).abs();
        distance(one).total_cmp(&distance(other))
    })?;
    ((loads[nearest] / load - 1.0).abs() < 0.1).then_some(nearest)
}

impl Evidence {
    /// Returns the values of a column of the measured contacts, by spectrum.
    pub fn along_loads(&self, column: &str) -> Vec<PerLoad> {
        per_load(&self.contacts, |row| number(&self.contacts, column, row))
    }

    /// Returns the pressure flow factors, averaged over both directions, by spectrum.
    pub fn flow_factors_along_loads(&self) -> Vec<PerLoad> {
        per_load(&self.contacts, |row| {
            let [x, y] = [FLOW_FACTOR_X, FLOW_FACTOR_Y]
                .map(|column| number(&self.contacts, column.name, row));
            Some(0.5 * (x? + y?))
        })
    }

    /// Returns the contact areas, corrected with the estimator `2017`, by spectrum.
    pub fn corrected_areas_along_loads(&self) -> Vec<PerLoad> {
        let Ok(measured) = Measured::new(&self.contacts) else {
            return Vec::new();
        };
        per_load(&self.contacts, |row| Some(measured.interface(row).area_corrected))
    }

    /// Returns the values of a column of the asperity models with one interaction, by spectrum.
    pub fn asperities_along_loads(&self, interaction: &str, column: &str) -> Vec<PerLoad> {
        let Ok(interactions) = self.asperities.texts(INTERACTION.name) else {
            return Vec::new();
        };
        per_load(&self.asperities, |row| {
            let is_meant = interactions.value(row) == interaction;
            number(&self.asperities, column, row).filter(|_| is_meant)
        })
    }

    /// Returns the areas at which the gap of each surface stops percolating, by spectrum, corrected
    /// with the estimator `2017`. Omits a spectrum if one of its surfaces is open at all loads or
    /// sealed at all loads, because the mean over the other surfaces would be biased.
    pub fn percolation_areas(&self) -> Vec<SealingAreas> {
        let table = &self.contacts;
        let has_columns = [GAP_PERCOLATES_X, GAP_PERCOLATES_Y, STOP, SWITCHES]
            .iter()
            .all(|column| table.has(column.name));
        if has_columns { thresholds(table).unwrap_or_default() } else { Vec::new() }
    }

    /// Returns the distributions of contact pressure, by spectrum and load.
    pub fn pressures(&self) -> Vec<Pressures> {
        distributions(&self.pressures).unwrap_or_default()
    }
}

/// Groups the ensembles of a table by spectrum.
fn by_spectrum(table: &Table) -> Result<Vec<(Spectrum, Vec<Ensemble>)>, TableError> {
    let mut known: BTreeMap<_, (Spectrum, Vec<Ensemble>)> = BTreeMap::new();
    if table.rows() == 0 {
        return Ok(Vec::new());
    }
    for ensemble in ensembles(table)? {
        if let Some(spectrum) = spectrum(table, ensemble.first)? {
            let entry = known.entry(key(&spectrum));
            let (_, own) = entry.or_insert((spectrum, Vec::new()));
            own.push(ensemble);
        }
    }
    Ok(known.into_values().collect())
}

/// Groups the values of the rows by spectrum and load. Keeps the loads at which all surfaces of the
/// spectrum have a value. `value` returns the value of a row.
fn per_load(table: &Table, value: impl Fn(usize) -> Option<f64>) -> Vec<PerLoad> {
    let spectra = by_spectrum(table).unwrap_or_default().into_iter();
    let found = spectra.filter_map(|(spectrum, all)| {
        let curves = all.iter().map(|ensemble| curve(ensemble, &value));
        // If a spectrum was solved with several tolerances, use the first.
        let (loads, values) = curves.into_iter().find(|(loads, _)| !loads.is_empty())?;
        Some(PerLoad { spectrum, loads, values })
    });
    found.collect()
}

fn curve(ensemble: &Ensemble, value: &impl Fn(usize) -> Option<f64>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let complete = ensemble.loads.iter().enumerate().filter_map(|(index, load)| {
        let rows = ensemble.complete(index)?.into_iter();
        Some((load.reduced, rows.map(value).collect::<Option<Vec<f64>>>()?))
    });
    complete.unzip()
}

fn thresholds(table: &Table) -> Result<Vec<SealingAreas>, TableError> {
    let measured = Measured::new(table)?;
    let of_spectrum = |(spectrum, all): (Spectrum, Vec<Ensemble>)| {
        let ensemble = all.first()?;
        let members = 0..ensemble.members.len();
        let surfaces: Vec<Vec<Interface>> =
            members.map(|member| measured.interfaces(ensemble, member)).collect();
        let problem = PercolationProblem::new(&surfaces, Window::ALL, Channels::AlongBoth).ok()?;
        let thresholds = problem.thresholds().iter();
        Some(SealingAreas {
            spectrum,
            values: thresholds.map(|threshold| threshold.area_corrected).collect(),
            rounding: problem.resolution_error().area_corrected,
            scatter_is_resolved: problem.resolves_scatter(),
        })
    };
    let spectra = by_spectrum(table)?.into_iter();
    Ok(spectra.filter_map(of_spectrum).collect())
}

/// Edges of a bin, and the fraction of the area in it for each surface.
type Bin = ([f64; 2], Vec<f64>);

fn distributions(table: &Table) -> Result<Vec<Pressures>, TableError> {
    let mut distributions = Vec::new();
    for (spectrum, bins) in by_spectrum(table)? {
        let mut under: BTreeMap<u64, Vec<Bin>> = BTreeMap::new();
        // Each bin is a separate ensemble, because its middle is a parameter.
        for bin in &bins {
            let of = |column: &str| number(table, column, bin.first);
            let (Some(middle), Some(width)) =
                (of(CONTACT_PRESSURE.name), of(PRESSURE_BIN_WIDTH.name))
            else {
                continue;
            };
            let ends = [middle - 0.5 * width, middle + 0.5 * width].map(decimal::nearest);
            let share = |row: usize| Some(width * number(table, PRESSURE_DENSITY.name, row)?);
            let (loads, shares) = curve(bin, &share);
            for (load, shares) in loads.into_iter().zip(shares) {
                // Loads are positive, so their bits have the same order.
                under.entry(load.to_bits()).or_default().push((ends, shares));
            }
        }
        distributions.extend(under.into_iter().map(|(load, mut bins)| {
            bins.sort_by(|one, other| one.0[0].total_cmp(&other.0[0]));
            bins.dedup_by(|next, kept| next.0 == kept.0);
            let (bins, shares) = bins.into_iter().unzip();
            Pressures { spectrum: spectrum.clone(), load: f64::from_bits(load), bins, shares }
        }));
    }
    Ok(distributions)
}

/// A fit of the limits of a quantity for vanishing parameters, and the rows that it reads.
#[derive(Debug, Clone)]
pub struct LimitsFit {
    /// Fitted quantity, its terms and their possible forms.
    pub choices: LimitChoices,
    pub window: Window,
    pub table: Table,
}

/// κ = A/(A₀ y) for many spectra and meshes under one load, from areas corrected with the estimator
/// `2017`.
#[derive(Debug, Clone)]
pub struct KappaPoints {
    /// Name that distinguishes the fit: `load 0.01`.
    pub label: String,
    pub load: f64,
    /// One point for each spectrum and mesh: κ of each surface, and the values of 1/k_lower,
    /// k_lower/k_upper and k_upper/nodes in the order of the terms.
    points: Vec<LimitPoint>,
    /// Forms that each term may have, `[term][form]`.
    pub forms: Vec<Vec<TermForm>>,
    /// Index of the term of `k_lower / k_upper` in `forms`.
    pub bandwidth: usize,
    /// Index of the term of `1 / k_lower` in `forms`.
    pub cell: usize,
    /// Index of the term of `k_upper / nodes` in `forms`.
    pub mesh: usize,
}

impl KappaPoints {
    /// Returns the points with the values of the surfaces that `weights` selects.
    pub fn points(&self, weights: &Weights) -> Vec<LimitPoint> {
        let points = self.points.iter().map(|point| LimitPoint {
            small: point.small.clone(),
            observed: match &point.observed {
                Observed::Surfaces { values, .. } => {
                    Observed::from_realizations(weights.values(values).collect())
                }
                estimate => estimate.clone(),
            },
        });
        points.collect()
    }

    /// Returns the number of surfaces of each point.
    pub fn surfaces(&self) -> Vec<usize> {
        let counts = self.points.iter().map(|point| point.observed.surfaces());
        counts.collect()
    }

    /// Returns ln(k_lower/k_upper) of the widest and the narrowest spectrum.
    pub fn bandwidths(&self) -> [f64; 2] {
        let all = self.points.iter().map(|point| libm::log(point.small[self.bandwidth]));
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], one| {
            [least.min(one), most.max(one)]
        })
    }
}

/// Returns the points of each fit whose quantity is κ = `area_corrected / load` and whose terms are
/// those of 1/k_lower, k_lower/k_upper and k_upper/nodes.
pub fn kappa_points(fits: &[LimitsFit], setting: &Setting) -> Result<Vec<KappaPoints>, TableError> {
    let kappa = Expression::parse("area_corrected / load").expect("this is an expression");
    let mut all: Vec<KappaPoints> = Vec::new();
    for fit in fits {
        let LimitsFit { choices, window, table } = fit;
        let is_meant = choices.of == kappa && choices.error.is_none();
        let Some([cell, bandwidth, mesh]) = small_numbers(choices).filter(|_| is_meant) else {
            continue;
        };
        let Some(table) = corrected_as_in_2017(table, setting)? else {
            continue;
        };
        let groups = groups(&table, choices, *window)?;
        for group in &groups {
            let point = ParameterPoint::from_row(&table.in_role(Role::Parameter), group.row);
            let point = point.only(&[HURST.name]);
            for load in group.loads.iter().flatten().copied() {
                let label = match groups.len() {
                    1 => format!("load {load}"),
                    _ => format!("{point}, load {load}"),
                };
                let points = KappaPoints {
                    points: group.points_under(Some(load)),
                    label,
                    load,
                    forms: forms(choices),
                    bandwidth,
                    cell,
                    mesh,
                };
                // Two stages may read the same rows.
                let is_new = all.iter().all(|known| known.label != points.label);
                all.extend(Some(points).filter(|points| is_new && !points.points.is_empty()));
            }
        }
    }
    Ok(all)
}

/// Returns the rows in the setting with the correction `2017`, or `None` if there are none.
fn corrected_as_in_2017(table: &Table, setting: &Setting) -> Result<Option<Table>, TableError> {
    if !table.has(CORRECTION.name) {
        return Ok(None);
    }
    let table = setting.rows(table);
    let corrections = table.texts(CORRECTION.name)?;
    let own = (0..table.rows()).filter(|&row| corrections.value(row) == OF_2017);
    let own: Vec<usize> = own.collect();
    Ok((!own.is_empty()).then(|| table.pick(&own)))
}

/// Returns the indices of the terms of 1/k_lower, k_lower/k_upper and k_upper/nodes, or `None` if
/// the fit has other terms.
fn small_numbers(choices: &LimitChoices) -> Option<[usize; 3]> {
    let of = |columns: &[&str]| {
        let columns: BTreeSet<&str> = columns.iter().copied().collect();
        let mut terms = choices.terms.iter();
        terms.position(|term| term.of.columns().into_iter().collect::<BTreeSet<_>>() == columns)
    };
    let all = [
        of(&[K_LOWER.name])?,
        of(&[K_LOWER.name, K_UPPER.name])?,
        of(&[K_UPPER.name, NODES.name])?,
    ];
    (choices.terms.len() == all.len()).then_some(all)
}

fn forms(choices: &LimitChoices) -> Vec<Vec<TermForm>> {
    let terms = choices.terms.iter();
    terms.map(|term| term.forms.iter().map(|form| form.term_form()).collect()).collect()
}
