//! Stages that measure contact maps and surfaces.
//!
//! The scatter of height distributions between surfaces requires the histograms of about a thousand
//! surfaces, which would be millions of rows. `pool` therefore measures all surfaces of a parameter
//! point in one task that stores only sums. If a study is extended, all surfaces are measured
//! again, which takes seconds because no contact is solved.

pub mod areal;
mod conduction;
mod contacts;
pub mod distributions;
pub mod friction;
mod from_profiles;
pub mod keys;
mod profile;
pub mod statistics;
mod stitched;

use std::borrow::Cow;

use serde::Serialize;

use crate::columns::*;
use crate::measure::conduction::SPOTS_VERSION;
use crate::measure::contacts::ADHESION_VERSION;
use crate::measure::friction::DISSIPATION_VERSION;
use crate::measure::statistics::{AUTOCORRELATION_VERSION, Statistic, YIELDED_VERSION};
use crate::stage::{largest, range};
use crate::version::{PartVersion, Version};
use crate::{
    Context, Definition, Effort, Extent, Footprint, Input, InputScope, Kind, Reads, Recipe,
    RowKind, Series, Stage, StageError, beside_coordinates, stacked, surface,
    table_beside_coordinates,
};
use asperity_manifest::diagnostics::counted;
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::height_distribution::{Histogram, HistogramPool};
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::column::{Column, Role, integers, optional_reals, reals};
use asperity_tables::parquet::Columns;
use asperity_tables::source::TableSource;
use asperity_tables::store::series::{Part, SeriesRows};
use asperity_tables::table::Table;

pub use contacts::{ContactMeasures, NodeSet};
pub use distributions::Distribution;

/// Version of the numbers, which is part of every key; raise it whenever they change.
pub const VERSION: Version = Version::new(4, &[]);

/// Memory for the map of filled nodes, the measured map and the search of spikes, in bytes per
/// node.
const FILLED_BYTES_PER_NODE: f64 = 80.0;

/// Share of the contact area on filled nodes above which summaries warn.
const MUCH_FILLED: f64 = 0.03;

/// Definition of the kind of stage `measure`.
pub const STAGE: Definition = Definition {
    name: "measure",
    version: VERSION,
    reads: Reads {
        rows: &[RowKind::Loads, RowKind::Surfaces, RowKind::Profiles],
        from: Cow::Borrowed("either `solve` or `generate` stages"),
    },
    row_kind: |read| match read? {
        RowKind::Surfaces | RowKind::Profiles => Some(RowKind::Heights),
        _ => Some(RowKind::Contacts),
    },
    columns: || {
        let contacts = contacts::all_columns();
        let of_surfaces = statistics::all_columns();
        let distributions = distributions::all_columns();
        let lists: [&[Column]; 8] = [
            &contacts,
            &distributions,
            &friction::columns().all(),
            &HEIGHT_MEASURES,
            &POOLED_HEIGHTS[1..],
            &of_surfaces,
            &[SCANS, OVERLAP_RATIO, OVERLAP_SCATTER],
            &from_profiles::own_columns(),
        ];
        lists.concat()
    },
    summary: |table, _| {
        let parts = [
            Some(counted(table.rows(), "row")),
            range(table, AREA_FRACTION.name, "contact covers")?,
            much_filled(table)?,
            range(table, CONTACT_PRESSURE.name, "pressures from")?,
            range(table, GAP.name, "gaps from")?,
            range(table, BIN.name, "heights from")?,
            range(table, WAVENUMBER.name, "wavenumbers from")?,
            stitched::summary(table)?,
            range(table, SLOPE_AT_SCALE.name, "slopes from")?,
            range(table, ROUGHNESS[0].name, "Sq")?,
            from_profiles::summary(table)?,
            range(table, PROFILE_ROUGHNESS[3].name, "Rq")?,
        ];
        Ok(parts.into_iter().flatten().collect())
    },
};

/// Quantities that a task measures.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "of", rename_all = "lowercase")]
pub enum Params {
    /// Contact maps of a `solve` stage.
    Contacts(ContactMeasures),
    /// Height distribution of the surfaces of a `generate` stage.
    Heights {
        /// Number of bins of the histogram.
        bins: u32,
        /// Half width of the histogram, in rms heights.
        range: f64,
    },
    /// Mean and scatter of the height distributions of all surfaces of a parameter point.
    Pool {
        /// Number of bins of the histogram.
        bins: u32,
        /// Half width of the histograms, in rms heights.
        range: f64,
    },
    /// One power spectrum of all surfaces, which are scans of different size of one surface.
    Stitched {
        /// Number of bins per decade of wavenumbers.
        bins: u32,
        /// Longest trusted wavelength, as a fraction of the shorter side of a scan.
        trusted_fraction: f64,
        /// Version of the spectra of surfaces that have yielded, if a scan has.
        #[serde(skip_serializing_if = "Option::is_none")]
        yielded_version: Option<u32>,
    },
    /// One power spectrum of an isotropic surface from all surfaces, which are profiles of it or
    /// maps with lines.
    FromProfiles {
        /// Number of nodes per decade of wavenumbers.
        bins: u32,
        /// Longest trusted wavelength, as a fraction of the length of a profile.
        trusted_fraction: f64,
        /// Maximum number of lines of a map. Omitted from the recipe for all lines.
        #[serde(skip_serializing_if = "Option::is_none")]
        lines: Option<u32>,
        version: u32,
    },
    /// Partial slip under tangential loads of the contacts of a `solve` stage.
    Friction(friction::Params),
    /// Another statistic of each single surface of a `generate` stage.
    #[serde(untagged)]
    Surface(Statistic),
    /// Distribution under each load of a `solve` stage.
    #[serde(untagged)]
    Distribution(Distribution),
}

impl Stage for Params {
    fn kind(&self) -> Kind {
        Kind::Measure
    }

    fn part_versions(&self) -> Vec<PartVersion> {
        match self {
            Params::Contacts(_) => vec![
                PartVersion::new("spots_version", "formula of separate spots", SPOTS_VERSION),
                PartVersion::new("adhesion_version", "measures with adhesion", ADHESION_VERSION),
            ],
            Params::Friction(_) => {
                let (parameter, version) = ("dissipation_version", DISSIPATION_VERSION);
                vec![PartVersion::new(parameter, "dissipated energy", version)]
            }
            Params::Surface(Statistic::Autocorrelation { .. }) => {
                vec![PartVersion::new("version", "autocorrelation", AUTOCORRELATION_VERSION)]
            }
            Params::Surface(Statistic::Areal(_)) => {
                vec![PartVersion::new("version", "texture parameters", areal::VERSION)]
            }
            Params::Surface(Statistic::Profile(_)) => {
                vec![PartVersion::new("version", "parameters of profiles", profile::VERSION)]
            }
            Params::FromProfiles { .. } => {
                vec![PartVersion::new("version", "spectra from profiles", from_profiles::VERSION)]
            }
            Params::Surface(Statistic::Spectrum { .. }) | Params::Stitched { .. } => {
                let of = "spectra of yielded surfaces";
                vec![PartVersion::new("yielded_version", of, YIELDED_VERSION)]
            }
            _ => Vec::new(),
        }
    }

    fn run(&self, inputs: &[Input], context: &Context) -> Result<Table, StageError> {
        let input = inputs.first().expect("the plan gives a task its inputs");
        match *self {
            Params::Pool { bins, range } => pool(inputs, bins as usize, range, context),
            Params::Stitched { bins, trusted_fraction, .. } => {
                stitched::measure(inputs, bins, trusted_fraction, context)
            }
            Params::FromProfiles { bins, trusted_fraction, lines, .. } => {
                from_profiles::measure(inputs, bins, trusted_fraction, lines, context)
            }
            Params::Friction(ref friction) => friction.measure(&input.table),
            Params::Heights { bins, range } => heights(input, bins as usize, range, context),
            Params::Surface(ref statistic) => measured(input, statistic, context),
            Params::Distribution(distribution) => distribution.measure(input),
            Params::Contacts(ref measures) => measures.measure(input, context),
        }
    }

    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        Ok(match self {
            Params::Contacts(measures) => {
                let measured = contacts::measure(&stacked(inputs)?, measures, NodeSet::Contact)?;
                let share = measures.filled.then_some(FILLED_AREA_SHARE);
                table_beside_coordinates(&measured.beside(&Table::empty(share.as_slice())), inputs)?
            }
            Params::Friction(friction) => {
                table_beside_coordinates(&friction.measure(&stacked(inputs)?)?, inputs)?
            }
            Params::Heights { .. } => beside_coordinates(&HEIGHT_MEASURES, inputs)?,
            Params::Surface(statistic) => beside_coordinates(&statistic.columns(), inputs)?,
            Params::Distribution(distribution) => {
                let attracts = stacked(inputs)?.has(WORK_OF_ADHESION.name);
                beside_coordinates(distribution.columns(attracts), inputs)?
            }
            Params::Stitched { .. } => stitched::empty_table(inputs)?,
            Params::FromProfiles { lines, .. } => from_profiles::empty_table(*lines, inputs)?,
            Params::Pool { .. } => {
                let points = stacked(inputs)?.in_role(Role::Parameter);
                let names = points.names();
                points.beside(&Table::empty(&POOLED_HEIGHTS).without(&names))
            }
        })
    }

    fn input_scope(&self) -> InputScope {
        match self {
            Params::Pool { .. } => InputScope::ParameterPoint,
            Params::Stitched { .. } | Params::FromProfiles { .. } => InputScope::All,
            _ => InputScope::Single,
        }
    }

    fn columns_depend_on_params(&self) -> bool {
        matches!(
            self,
            Params::Surface(Statistic::Areal(_) | Statistic::Profile(_))
                | Params::FromProfiles { .. }
        )
    }

    /// Returns all columns, but for pooled surfaces only light ones, because the heights are drawn
    /// again.
    fn columns_read(&self) -> Columns {
        match self {
            Params::Pool { .. } => Columns::Light,
            _ => Columns::All,
        }
    }

    /// Returns the rows of the input: every load is measured by itself, except for the stiffness
    /// and partial slip, which are differences between loads.
    fn series(&self, input: Option<&SeriesRows>) -> Option<Series> {
        let is_by_load = match self {
            Params::Contacts(measures) => !measures.stiffness,
            other => matches!(other, Params::Distribution(_)),
        };
        let read = input.filter(|_| is_by_load)?;
        Some(Series {
            recipe: Recipe::Measure(self.clone()),
            rows: SeriesRows {
                column: read.column,
                values: read.values.clone(),
                parts: Vec::new(),
            },
        })
    }

    /// Returns the same recipe: its rows are those of its input.
    fn restricted(&self, _: &[f64], _: &dyn Fn(&Part) -> bool) -> Option<Recipe> {
        Some(Recipe::Measure(self.clone()))
    }

    /// Returns true for the parts that the measurement copies or counts.
    fn reads_part(&self, part: &Part) -> bool {
        let reads = |column: Column| part.columns.contains(&column.name);
        match self {
            Params::Contacts(_) => {
                reads(FLOW_STOP) || reads(FROZEN_STIFFNESS) || reads(CONTACT_CONDUCTANCE)
            }
            Params::Friction(_) => reads(FROZEN_STIFFNESS),
            Params::Distribution(Distribution::Pressures) => reads(PRESSURE_COUNTS),
            Params::Distribution(Distribution::Gaps) => reads(GAP_COUNTS),
            _ => false,
        }
    }

    /// Estimates the memory for drawing a surface again, or for the labels of clusters.
    fn footprint(&self) -> Footprint {
        let additional = match self {
            Params::Contacts(measures) if measures.filled => FILLED_BYTES_PER_NODE,
            Params::Surface(statistic) => statistic.bytes_per_node(),
            Params::Stitched { .. } | Params::FromProfiles { .. } => {
                Statistic::Spectrum { yielded_version: None }.bytes_per_node()
            }
            _ => 0.0,
        };
        Footprint { work: 36.0 + additional, table: 0.0 }
    }

    /// Estimates the transforms for drawing a surface again. Contact maps need less work.
    fn effort(&self, extent: Extent) -> Effort {
        Effort::pairs(match self {
            Params::Contacts(_) | Params::Distribution(_) => 0.2 * extent.rows as f64,
            Params::Friction(_) => 0.0,
            Params::Heights { .. } | Params::Pool { .. } => 6.0 * extent.tables as f64,
            Params::Stitched { .. } | Params::FromProfiles { .. } => 8.0 * extent.tables as f64,
            Params::Surface(statistic) => 6.0 + statistic.pairs(),
        })
    }
}

/// Returns a warning if a large part of a contact area is on filled nodes.
fn much_filled(source: &TableSource) -> Result<Option<String>, StageError> {
    let most = largest(source, FILLED_AREA_SHARE.name)?.filter(|most| *most > MUCH_FILLED);
    Ok(most.map(|most| {
        let percentage = 100.0 * most;
        format!("up to {percentage:.1} % of the contact area is on filled nodes, not measured")
    }))
}

fn heights(input: &Input, bins: usize, range: f64, context: &Context) -> Result<Table, StageError> {
    let params = surface_params(input);
    let surface = params.surface(&input.table, context.sources, context.threads)?;
    let histogram = Histogram::from_surface(&surface, bins, range);
    let columns = vec![
        (BIN, reals(histogram.bins.iter().map(|bin| bin.center))),
        (COUNT, integers(histogram.bins.iter().map(|bin| bin.count as i64))),
        (DENSITY, reals(histogram.bins.iter().map(|bin| bin.density))),
    ];
    let rows = vec![0; histogram.bins.len()];
    Ok(input.table.coordinates().pick(&rows).with(columns))
}

fn measured(input: &Input, statistic: &Statistic, context: &Context) -> Result<Table, StageError> {
    let params = surface_params(input);
    let surface = params.surface(&input.table, context.sources, context.threads)?;
    let (rows, columns) = statistic.measure(&surface, &params.origin)?;
    Ok(input.table.coordinates().pick(&vec![0; rows]).with(columns))
}

fn pool(inputs: &[Input], bins: usize, range: f64, context: &Context) -> Result<Table, StageError> {
    let histogram = |input: &Input| {
        if (context.interrupted)() {
            return Err(StageError::Interrupted);
        }
        let surface = surface_params(input).draw(context.sources, &Threads::one())?;
        Ok(HistogramPool::from_histogram(&Histogram::from_surface(&surface, bins, range)))
    };
    let mut pooled = HistogramPool::default();
    // Only one surface per thread at a time, so that other tasks can take threads between batches.
    for inputs in inputs.chunks(context.threads.count()) {
        let mut pools: Vec<_> = inputs.iter().map(|input| (input, None)).collect();
        let workers = context.threads.workers_up_to(inputs.len());
        workers.for_each(
            &mut Vec::new(),
            || (),
            &mut pools,
            |(), (input, pool)| {
                *pool = Some(histogram(input));
            },
        );
        for (_, pool) in pools {
            pooled = pooled.and(pool.expect("all were measured")?);
        }
    }
    let bins = pooled.bins();
    let surfaces = i64::from(pooled.surfaces);
    let columns = vec![
        (BIN, reals(bins.iter().map(|bin| bin.center))),
        (SURFACES, integers(bins.iter().map(|_| surfaces))),
        (DENSITY_MEAN, reals(bins.iter().map(|bin| bin.mean))),
        (DENSITY_SD, optional_reals(bins.iter().map(|bin| bin.sd))),
        (DENSITY_NORMAL, reals(bins.iter().map(|bin| bin.normal))),
    ];
    let point = inputs[0].table.in_role(Role::Parameter);
    Ok(point.pick(&vec![0; bins.len()]).with(columns))
}

fn surface_params<'a>(input: &Input<'a>) -> &'a surface::Params {
    let Recipe::Generate(params) = input.recipe else {
        unreachable!("validation accepts only surfaces for these measurements")
    };
    params
}

/// Draws or reads the surface of each input in turn, and returns what `measure` makes of it.
///
/// # Errors
/// Returns an error if a surface cannot be read, if `measure` fails, or if the run is interrupted.
fn of_each<T>(
    inputs: &[Input],
    context: &Context,
    mut measure: impl FnMut(&surface::Params, &Table, Surface) -> Result<T, StageError>,
) -> Result<Vec<T>, StageError> {
    let measured = inputs.iter().map(|input| {
        if (context.interrupted)() {
            return Err(StageError::Interrupted);
        }
        let (params, table) = (surface_params(input), &input.table);
        measure(params, table, params.surface(table, context.sources, context.threads)?)
    });
    measured.collect()
}

/// Returns the joint name of the surfaces.
///
/// # Errors
/// Returns an error if a table is damaged.
fn joint_name(inputs: &[Input]) -> Result<String, StageError> {
    let names = inputs.iter().map(|input| Ok(input.table.texts(SURFACE.name)?.value(0)));
    Ok(names.collect::<Result<Vec<&str>, StageError>>()?.join("+"))
}

/// Returns the unit of length of the surfaces in the rows of a table, the only parameter that all
/// of them share in any study.
fn unit_of(surfaces: &Table) -> Table {
    surfaces.keep(|name, _| name == UNIT.name)
}

/// Returns the unit of length, once for each of `rows` rows.
///
/// # Errors
/// Returns an error if the tables have columns of the same name with different types.
fn common_unit(inputs: &[Input], rows: usize) -> Result<Table, StageError> {
    let tables: Vec<Table> = inputs.iter().map(|input| unit_of(&input.table)).collect();
    Ok(Table::stack(&tables)?.pick(&vec![0; rows]))
}
