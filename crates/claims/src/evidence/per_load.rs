//! A number of every surface under every load, and how contact pressures are distributed.

use std::collections::BTreeMap;

use super::{Evidence, Spectrum, key, number, spectrum};
use asperity_manifest::decimal;
use asperity_stages::columns::*;
use asperity_stages::ensemble::{Ensemble, ensembles};
use asperity_stages::fit::percolation::Measured;
use asperity_statistics::Window;
use asperity_statistics::percolation::{Channels, Interface, PercolationProblem};
use asperity_tables::table::{Table, TableError};

/// One number of every surface of a spectrum under the loads that all of them have.
#[derive(Debug, Clone, PartialEq)]
pub struct PerLoad {
    /// The spectrum.
    pub spectrum: Spectrum,
    /// The loads, ascending, in units of E* × rms slope.
    pub loads: Vec<f64>,
    /// The numbers, `[load][surface]`, surfaces by seed and realization.
    pub values: Vec<Vec<f64>>,
}

/// How contact pressures are distributed on the surfaces of a spectrum under one load.
#[derive(Debug, Clone, PartialEq)]
pub struct Pressures {
    /// The spectrum.
    pub spectrum: Spectrum,
    /// The load, in units of E* × rms slope.
    pub load: f64,
    /// Ends of the bins, ascending, in units of E* × rms slope.
    pub bins: Vec<[f64; 2]>,
    /// Shares of the nominal area whose pressure lies in a bin, `[bin][surface]`.
    pub shares: Vec<Vec<f64>>,
}

/// The area, corrected as in 2017, at which the gap of each surface of a spectrum stops percolating.
#[derive(Debug, Clone, PartialEq)]
pub struct SealingAreas {
    /// The spectrum.
    pub spectrum: Spectrum,
    /// The areas, by seed and realization.
    pub values: Vec<f64>,
    /// The standard error that the distance of the loads adds to that of their mean.
    pub rounding: f64,
    /// Whether the loads are close enough to tell how they scatter.
    pub scatter_is_resolved: bool,
}

impl PerLoad {
    /// Number of surfaces.
    pub fn surfaces(&self) -> usize {
        self.values.first().map_or(0, Vec::len)
    }

    /// The place of the load nearest to one, if it is within a tenth of it.
    pub fn at(&self, load: f64) -> Option<usize> {
        nearest(&self.loads, load)
    }
}

impl Pressures {
    /// Number of surfaces.
    pub fn surfaces(&self) -> usize {
        self.shares.first().map_or(0, Vec::len)
    }

    /// Shares of the area whose pressure lies between two ends of bins, surface by surface; `None` where
    /// they are no ends of bins.
    pub fn between(&self, low: f64, high: f64) -> Option<Vec<f64>> {
        let first = self.bins.iter().position(|bin| decimal::is_same(bin[0], low))?;
        let last = self.bins.iter().position(|bin| decimal::is_same(bin[1], high))?;
        let inside = self.shares.get(first..=last)?;
        let sum = |surface: usize| inside.iter().map(|shares| shares[surface]).sum();
        Some((0..self.surfaces()).map(sum).collect())
    }
}

/// The place of the load nearest to one, if it is within a tenth of it.
pub(super) fn nearest(loads: &[f64], load: f64) -> Option<usize> {
    let nearest = (0..loads.len()).min_by(|&one, &other| {
        let distance = |place: usize| (loads[place] - load).abs();
        distance(one).total_cmp(&distance(other))
    })?;
    ((loads[nearest] / load - 1.0).abs() < 0.1).then_some(nearest)
}

impl Evidence {
    /// A column of the measured contacts, by spectrum.
    pub fn along_loads(&self, column: &str) -> Vec<PerLoad> {
        per_load(&self.contacts, |row| number(&self.contacts, column, row))
    }

    /// A column of the asperity models of one interaction, by spectrum.
    pub fn asperities_along_loads(&self, interaction: &str, column: &str) -> Vec<PerLoad> {
        let Ok(interactions) = self.asperities.texts(INTERACTION.name) else {
            return Vec::new();
        };
        per_load(&self.asperities, |row| {
            let is_meant = interactions.value(row) == interaction;
            number(&self.asperities, column, row).filter(|_| is_meant)
        })
    }

    /// The area, corrected as in 2017, at which the gap of each surface stops percolating, by spectrum;
    /// none of a spectrum that has surfaces without a threshold among its loads, for the mean of the
    /// others would be biased.
    pub fn percolation_areas(&self) -> Vec<SealingAreas> {
        let table = &self.contacts;
        let is_told = [GAP_PERCOLATES_X, GAP_PERCOLATES_Y, STOP, SWITCHES]
            .iter()
            .all(|column| table.has(column.name));
        match is_told {
            true => thresholds(table).unwrap_or_default(),
            false => Vec::new(),
        }
    }

    /// How contact pressures are distributed, by spectrum and load.
    pub fn pressures(&self) -> Vec<Pressures> {
        distributions(&self.pressures).unwrap_or_default()
    }
}

/// The first ensemble of each spectrum, by spectrum.
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

/// A value of each row, under the loads at which all surfaces have one.
fn per_load(table: &Table, value: impl Fn(usize) -> Option<f64>) -> Vec<PerLoad> {
    let spectra = by_spectrum(table).unwrap_or_default().into_iter();
    let found = spectra.filter_map(|(spectrum, all)| {
        let curves = all.iter().map(|ensemble| curve(ensemble, &value));
        // Several tolerances of one spectrum: the first stands for them.
        let (loads, values) = curves.into_iter().find(|(loads, _)| !loads.is_empty())?;
        Some(PerLoad { spectrum, loads, values })
    });
    found.collect()
}

fn curve(ensemble: &Ensemble, value: &impl Fn(usize) -> Option<f64>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let complete = ensemble.loads.iter().enumerate().filter_map(|(place, load)| {
        let rows = ensemble.complete(place)?.into_iter();
        Some((load.reduced, rows.map(value).collect::<Option<Vec<f64>>>()?))
    });
    complete.unzip()
}

fn thresholds(table: &Table) -> Result<Vec<SealingAreas>, TableError> {
    let measured = Measured::of(table)?;
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
            rounding: problem.rounding().area_corrected,
            scatter_is_resolved: problem.resolves_scatter(),
        })
    };
    let spectra = by_spectrum(table)?.into_iter();
    Ok(spectra.filter_map(of_spectrum).collect())
}

/// Ends of a bin, and the share of the area in it, surface by surface.
type Bin = ([f64; 2], Vec<f64>);

fn distributions(table: &Table) -> Result<Vec<Pressures>, TableError> {
    let mut distributions = Vec::new();
    for (spectrum, bins) in by_spectrum(table)? {
        let mut under: BTreeMap<u64, Vec<Bin>> = BTreeMap::new();
        // Every bin is an ensemble of its own: its middle is a parameter.
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
                // Loads are positive: their bits are in their order.
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
