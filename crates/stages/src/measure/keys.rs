//! Keys of `measure` stages, and checks of their values.
//!
//! Editors show the doc comments of keys, and messages quote them.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::bodies::Conduction;
use crate::check_context::{Property, StageChecks, Surfaces, exclude, in_unit_of_surfaces};
use crate::measure::areal::{Areal, DECAY, DEFAULT, PEAKS, Parameter, Settings, VERSION, VOLUMES};
use crate::measure::conduction::SPOTS_VERSION;
use crate::measure::contacts::{ADHESION_VERSION, ContactMeasures};
use crate::measure::distributions::Distribution;
use crate::measure::friction::{self, DISSIPATION_VERSION, FrictionTable, complete, find};
use crate::measure::profile::{self, Profile};
use crate::measure::statistics::{Statistic, YIELDED_VERSION};
use crate::measure::{NodeSet, Params, from_profiles, stitched};
use crate::stage_points::{StagePoints, Work};
use crate::{CheckContext, Recipe, RowKind};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Span, listed};
use asperity_manifest::keys::checks::{Checks, report_equal_points};
use asperity_manifest::keys::declare::{length, list, swept};
use asperity_manifest::keys::{Key, Section, Spanned, quantity, table};

/// Maximum value of the key `bins`.
const MAX_BINS: u32 = 1_000_000;
/// Default value of `bins` for surfaces.
const DEFAULT_BINS: u32 = 1000;
/// Maximum value of `bins` for clusters.
const MAX_BINS_PER_DECADE: u32 = 1000;
/// Default value of `bins` for clusters.
const DEFAULT_BINS_PER_DECADE: u32 = 5;
/// Maximum value of the key `lines`.
const MAX_LINES: u32 = 1_000_000;
/// Default value of the key `range`.
const DEFAULT_RANGE: f64 = 5.0;
/// Minimum and maximum of the key `range`. No height of a surface with n nodes exceeds √n rms
/// heights, and bins narrower than the rounding errors of heights count nothing.
const RANGES: [f64; 2] = [1e-6, 1e6];

/// Measurement of the contacts of a `solve` stage, or of the surfaces of a `generate` stage.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MeasureTable {
    /// Quantity that the stage measures. For loads: `"contacts"` (the default), or the distribution
    /// of `"pressures"`, `"gaps"` or areas of `"clusters"`. Pressures and gaps need `pressure_bins`
    /// or `gap_bins` in the `solve` stage. For surfaces, `"heights"` (the default) is the
    /// distribution of heights, `"spectrum"` is the power spectrum C(q) averaged over all
    /// directions, and `"profile-spectrum"` is the spectrum of profiles along x and y. Surfaces
    /// also have the `"autocorrelation"`, slope and curvature by scale (`"scales"`), the
    /// `"bearing"` curve, and the `"roughness"` parameters of ISO 25178-2, which `parameters`
    /// selects. `"stitched-spectrum"` is one spectrum from all surfaces of the stages in `from`:
    /// scans of different size of one surface. `"spectrum-from-profiles"` is the spectrum C(q) of
    /// an isotropic surface from all profiles of the stages in `from`, or from lines of maps. The
    /// `"roughness"` of profiles has the parameters of ISO 21920-2.
    #[schemars(extend("default" = "heights"))]
    pub what: Key<What>,
    /// Number of bins of the height histogram, or of steps of the bearing curve. For clusters it is
    /// the number of bins per decade of area, with the default 5, and for a spectrum that is
    /// stitched or computed from profiles the number of bins per decade of wavenumbers, with the
    /// default 10.
    #[schemars(range(min = 1, max = MAX_BINS), extend("default" = DEFAULT_BINS))]
    pub bins: Key<u32>,
    /// Half width of the height histogram or of the bearing curve, in units of the rms height. For
    /// surfaces only.
    #[schemars(extend("minimum" = RANGES[0], "maximum" = RANGES[1], "default" = DEFAULT_RANGE))]
    pub range: Key<f64>,
    /// Longest wavelength of a scan that a stitched spectrum uses, as a fraction of the shorter
    /// side of the scan, or of a profile as a fraction of its length. The shortest is
    /// `reliable_wavelength` or two mesh steps. Periodic surfaces are used up to their side.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    #[schemars(extend("default" = stitched::DEFAULT_FRACTION))]
    pub trusted_fraction: Key<f64>,
    /// Maximum number of lines along x, at even distances, that `what = "spectrum-from-profiles"`
    /// uses of each map. By default it uses all lines.
    #[schemars(range(min = 1, max = MAX_LINES), transform = swept)]
    pub lines: Key<u32>,
    /// Section length of the parameters of profiles, ISO 21920-2 (sampling length, ISO 4287), for
    /// `what = "roughness"`. The default is the cutoff `high_pass` of the profile, or a fifth of
    /// the profile without a cutoff.
    #[schemars(extend("exclusiveMinimum" = 0), transform = length, transform = swept)]
    pub section_length: Key<f64>,
    /// `true` gives one height histogram for all surfaces of a parameter point, with mean and
    /// standard deviation over the surfaces. `false` gives each surface its own histogram. For
    /// surfaces only.
    #[schemars(extend("default" = false))]
    pub pool: Key<bool>,
    /// `true` adds the incremental stiffness of the interface to `"contacts"`: the derivative of
    /// the mean pressure with respect to the approach of the bodies. It is a finite difference
    /// between neighbouring loads of the stage that differ by at most 10 %. For loads only.
    #[schemars(extend("default" = false))]
    pub stiffness: Key<bool>,
    /// Nodes that `"contacts"` measures: `"contact"`, or `"repulsive"` for the nodes with positive
    /// pressure of contacts with adhesion.
    #[schemars(extend("default" = "contact"))]
    pub set: Key<NodeSet>,
    /// Friction `{ coefficient, loads }`: measures the partial slip under tangential loads Q/(f N),
    /// instead of `what`. The `solve` stage must also have the loads N (1 − Q/(f N)). For elastic
    /// contacts without adhesion.
    pub friction: Key<FrictionTable>,
    /// Names of the parameters of ISO 25178-2 that `what = "roughness"` computes, such as
    /// `["Sq", "Sdr", "Sk"]`, or `"iso-25178"` for all of them. The default is Sq, Sa, Sz, Ssk, Sku
    /// and Sdq. `smr_height` and `smc_ratio` add Smr(c) and Smc(mr).
    #[schemars(length(min = 1), transform = list)]
    pub parameters: Key<Vec<Parameter>>,
    /// Height c above the mean, which adds the areal material ratio Smr(c) to
    /// `what = "roughness"`, or Rmr(c) of profiles. It is a length in the unit of the surfaces or
    /// with a unit.
    #[schemars(transform = length, transform = swept)]
    pub smr_height: Key<f64>,
    /// Material ratio mr, which adds the inverse areal material ratio Smc(mr) to
    /// `what = "roughness"`, or Rmc(mr) of profiles: the height above the mean that this fraction
    /// of the surface reaches.
    #[schemars(range(min = 0, max = 1), transform = swept)]
    pub smc_ratio: Key<f64>,
    /// Material ratio p of the volumes Vmp, Vmc and Vvc, by default 0.1.
    #[schemars(range(min = 0, max = 1), transform = swept)]
    pub peak_ratio: Key<f64>,
    /// Material ratio q of the volumes Vmc, Vvc and Vvv, by default 0.8.
    #[schemars(range(min = 0, max = 1), transform = swept)]
    pub dale_ratio: Key<f64>,
    /// Fraction s of its value at lag zero to which the autocorrelation function falls over the
    /// length Sal, by default 0.2.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1), transform = swept)]
    pub correlation_threshold: Key<f64>,
    /// Height of the lowest hills that count as peaks in Spd and Spc (Wolf pruning), as a fraction
    /// of Sz, by default 0.05.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0), transform = swept)]
    pub pruning: Key<f64>,
}

table!(MeasureTable);

/// The value of the key `what`: the quantity to measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// Area, perimeter, clusters and percolation of contact maps.
    Contacts,
    /// Distribution of pressures in contact.
    Pressures,
    /// Distribution of gaps out of contact.
    Gaps,
    /// Distribution of the areas of contact clusters, with the lengths of their edges.
    Clusters,
    /// Distribution of the heights of surfaces.
    Heights,
    /// Power spectral density of heights, averaged over all directions.
    Spectrum,
    /// Power spectral density from several scans of different size.
    StitchedSpectrum,
    /// Power spectral density of profiles along x and y.
    ProfileSpectrum,
    /// Power spectral density of an isotropic surface from its profiles.
    SpectrumFromProfiles,
    /// Mean product of two heights as a function of their distance.
    Autocorrelation,
    /// Slope and curvature as functions of the distance over which differences are taken.
    Scales,
    /// Fraction of the surface at or above a height, as a function of the height.
    Bearing,
    /// Roughness parameters of ISO 25178-2, see `parameters`, or of ISO 21920-2 for profiles.
    Roughness,
}

impl What {
    /// Returns the rows of a stage that measures the quantity, or `None` if they are those of most
    /// stages with the same input.
    fn rows(self) -> Option<RowKind> {
        Some(match self {
            What::Contacts | What::Heights => return None,
            What::Pressures => RowKind::PressureDistributions,
            What::Gaps => RowKind::GapDistributions,
            What::Clusters => RowKind::ClusterDistributions,
            What::Spectrum | What::StitchedSpectrum | What::SpectrumFromProfiles => {
                RowKind::PowerSpectra
            }
            What::ProfileSpectrum => RowKind::ProfileSpectra,
            What::Autocorrelation => RowKind::Autocorrelations,
            What::Scales => RowKind::Scales,
            What::Bearing => RowKind::BearingCurves,
            What::Roughness => RowKind::Roughness,
        })
    }

    fn is_of_loads(self) -> bool {
        matches!(self, What::Contacts | What::Pressures | What::Gaps | What::Clusters)
    }
}

impl StagePoints for Section<MeasureTable> {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        Work::evaluate(recipes(self, context))
    }

    fn row_kind(&self) -> Option<RowKind> {
        let table = &self.points.first()?.table;
        if table.friction.written().is_some() {
            return Some(RowKind::PartialSlip);
        }
        table.what.value()?.rows()
    }
}

/// Returns the task of a stage, or `None` after reporting problems. The rows that the stage reads
/// decide which quantities it can measure.
fn recipes(section: &Section<MeasureTable>, context: &mut CheckContext) -> Option<Vec<Recipe>> {
    let read = context.read?;
    let reads_surfaces = matches!(read, RowKind::Surfaces | RowKind::Profiles);
    let mut checked = Vec::with_capacity(section.points.len());
    for point in &section.points {
        let checks = &mut StageChecks::new(section, point, context);
        checked.push(if reads_surfaces {
            of_surfaces(&point.table, read == RowKind::Profiles, checks)
        } else {
            of_loads(&point.table, &section.span, checks)
        });
    }
    let params: Vec<Params> = checked.into_iter().collect::<Option<_>>()?;
    report_equal_points(section, &params, context.problems);
    Some(params.into_iter().map(Recipe::Measure).collect())
}

/// Refuses a quantity of surfaces if the stage reads loads, and a quantity of loads if it reads
/// surfaces.
fn check_quantity(table: &MeasureTable, reads_loads: bool, checks: &mut Checks) -> Option<()> {
    let written = checks.optional("what", &table.what)?;
    let Some(written) = written.filter(|what| what.value.is_of_loads() != reads_loads) else {
        return Some(());
    };
    let (reads, words) = if reads_loads {
        ("loads", r#""contacts", "pressures", "gaps" or "clusters""#)
    } else {
        ("surfaces", r#""heights", "spectrum", "roughness" or another statistic of heights"#)
    };
    let message = format!("this stage reads {reads}, but `what` is not a quantity of {reads}");
    checks.refuse("what", message, &written.span, format!("must be {words}"))
}

/// Refuses keys that other keys of a stage that reads loads exclude.
fn exclude_of_loads(table: &MeasureTable, what: What, checks: &mut Checks) -> Option<()> {
    let of_contacts = what == What::Contacts;
    exclude! { table, checks,
        true => range, pool, trusted_fraction, lines, section_length, parameters, smr_height,
            smc_ratio, peak_ratio, dale_ratio, correlation_threshold, pruning:
            "for surfaces; this stage reads loads";
        table.friction.written().is_some() => what: "is not measured together with `friction`";
        what != What::Clusters => bins: "applies only to surfaces and to `what = \"clusters\"`";
        !of_contacts && table.stiffness.value() == Some(true) => stiffness:
            "needs `what = \"contacts\"`";
        !of_contacts && table.set.value() == Some(NodeSet::Repulsive) => set:
            "needs `what = \"contacts\"`";
    }
}

/// Refuses keys that other keys of a stage that reads surfaces exclude.
fn exclude_of_surfaces(
    table: &MeasureTable,
    what: What,
    profiles: bool,
    checks: &mut Checks,
) -> Option<()> {
    let from_profiles = what == What::SpectrumFromProfiles;
    let stitched = what == What::StitchedSpectrum || from_profiles;
    let fraction = table.trusted_fraction.value();
    let is_other_fraction = fraction.is_some_and(|value| value != stitched::DEFAULT_FRACTION);
    exclude! { table, checks,
        table.stiffness.value() == Some(true) => stiffness:
            "for loads; this stage reads surfaces";
        table.set.value() == Some(NodeSet::Repulsive) => set:
            "for loads; this stage reads surfaces";
        true => friction: "for loads; this stage reads surfaces";
        what != What::Roughness => parameters, smr_height, smc_ratio, peak_ratio, dale_ratio,
            correlation_threshold, pruning:
            "for roughness parameters, `what = \"roughness\"`";
        profiles => parameters, peak_ratio, dale_ratio, correlation_threshold, pruning:
            "for maps; this stage reads profiles";
        !profiles || what != What::Roughness => section_length:
            "for the roughness parameters of profiles";
        !from_profiles => lines: "for `what = \"spectrum-from-profiles\"`";
        profiles && from_profiles => lines: "for maps; a profile has one line";
        stitched => pool, range: "for the distribution of heights";
        !stitched && is_other_fraction => trusted_fraction:
            "for `what = \"stitched-spectrum\"` or `\"spectrum-from-profiles\"`";
        !stitched && what != What::Heights => pool:
            "for the distribution of heights, `what = \"heights\"`";
        !stitched && what != What::Heights && what != What::Bearing => bins, range:
            "for the distribution of heights and the bearing curve";
    }
}

fn of_loads(table: &MeasureTable, span: &Span, checks: &mut StageChecks) -> Option<Params> {
    check_quantity(table, true, checks)?;
    let what = table.what.value().unwrap_or(What::Contacts);
    exclude_of_loads(table, what, checks)?;
    let stiffness = checks.value("stiffness", &table.stiffness)?;
    let set = set(table, checks)?;
    let bins = bins_per_decade(table, DEFAULT_BINS_PER_DECADE, "for clusters", checks)?;
    if let Some(written) = checks.optional("friction", &table.friction)? {
        return friction(written, checks);
    }
    let with = |property| checks.surfaces.stage_with(property);
    let (distribution, uncounted) = match what {
        What::Pressures => (Distribution::Pressures, with(Property::PressuresUncounted)),
        What::Gaps => (Distribution::Gaps, with(Property::GapsUncounted)),
        What::Clusters => (Distribution::Clusters { bins }, None),
        _ => {
            return Some(Params::Contacts(ContactMeasures {
                stiffness,
                set,
                conduction: conduction(span, checks)?,
                spots_version: with(Property::WithImages).map(|_| SPOTS_VERSION.number()),
                adhesion_version: with(Property::WithAdhesion).map(|_| ADHESION_VERSION.number()),
                filled: with(Property::Filled).is_some(),
            }));
        }
    };
    let Some(stage) = uncounted else {
        return Some(Params::Distribution(distribution));
    };
    let key = if what == What::Pressures { "pressure_bins" } else { "gap_bins" };
    let message = format!("stage `{stage}` has no `{key}`");
    let label = "needs counts that the `solve` stage makes";
    let problem = Problem::new(message, table.what.written()?.span.clone(), label);
    let example = format!("add `{key} = {{ count = 100, to = 5.0 }}` to stage `{stage}`");
    checks.reject(problem.help(example))
}

/// Returns the conductivities of the bodies of all stages that are read. Refuses stages whose
/// bodies differ in them. `span` is the position of the stage.
fn conduction(span: &Span, checks: &mut StageChecks) -> Option<Option<Conduction>> {
    let mut stages = checks.surfaces.conduction.iter();
    let Some((first, conduction)) = stages.next() else {
        return Some(None);
    };
    let Some((other, _)) = stages.find(|(_, other)| other != conduction) else {
        return Some(*conduction);
    };
    let message = format!("stages `{first}` and `{other}` have bodies of different conductivities");
    let problem = Problem::new(message, span.clone(), "reads both stages");
    checks.reject(problem.help("measure each of them in a stage of its own"))
}

/// Returns the nodes that are measured. Only contacts with adhesion have nodes in contact without
/// repulsion.
fn set(table: &MeasureTable, checks: &mut StageChecks) -> Option<NodeSet> {
    let set = checks.value("set", &table.set)?;
    let without_adhesion = checks.surfaces.stage_with(Property::WithoutAdhesion);
    let Some(stage) = without_adhesion.filter(|_| !set.is_contact()) else {
        return Some(set);
    };
    let message = format!("stage `{stage}` has no `adhesion`");
    let label = "every node in contact is repulsive without adhesion";
    checks.refuse("set", message, &table.set.written()?.span, label)
}

/// Returns the number of bins per decade of area.
fn bins_per_decade(
    table: &MeasureTable,
    default: u32,
    what: &str,
    checks: &mut Checks,
) -> Option<u32> {
    let bins = checks.value_or("bins", &table.bins, default)?;
    let written = table.bins.written().filter(|_| bins > MAX_BINS_PER_DECADE);
    let Some(written) = written else {
        return Some(bins);
    };
    let must = format!("must be from 1 to {MAX_BINS_PER_DECADE} {what}");
    checks.refuse("bins", format!("`bins` is {bins}"), &written.span, must)
}

fn of_surfaces(table: &MeasureTable, profiles: bool, checks: &mut StageChecks) -> Option<Params> {
    check_quantity(table, false, checks)?;
    let what = checks.value("what", &table.what)?;
    check_of_profile(table, what, profiles, checks)?;
    exclude_of_surfaces(table, what, profiles, checks)?;
    let bins = checks.value("bins", &table.bins)?;
    let range = checks.number("range", &table.range)?;
    Some(Params::Surface(match what {
        What::StitchedSpectrum | What::SpectrumFromProfiles => return of_all(table, what, checks),
        What::Roughness if profiles => of_profile(table, checks)?,
        What::Roughness => areal(table, checks)?,
        What::ProfileSpectrum if profiles => Statistic::SingleProfileSpectrum,
        What::ProfileSpectrum => Statistic::ProfileSpectrum,
        What::Spectrum => Statistic::Spectrum { yielded_version: yielded_version(checks.surfaces) },
        What::Autocorrelation => Statistic::AUTOCORRELATION,
        What::Scales => Statistic::Scales,
        What::Bearing => Statistic::Bearing { bins, range },
        _ => return heights(table, bins, range, checks),
    }))
}

/// Refuses a quantity of maps if the stage reads profiles.
fn check_of_profile(
    table: &MeasureTable,
    what: What,
    profiles: bool,
    checks: &mut Checks,
) -> Option<()> {
    let is_of_maps = match what {
        What::Spectrum | What::StitchedSpectrum | What::Autocorrelation | What::Scales => true,
        What::Heights => table.pool.value() == Some(true),
        _ => false,
    };
    let Some(written) = table.what.written().filter(|_| profiles && is_of_maps) else {
        return Some(());
    };
    let message = "this stage reads profiles, but `what` is a quantity of maps";
    let problem = Problem::new(message, written.span.clone(), "needs maps");
    checks.reject(problem.help(
        "`\"spectrum-from-profiles\"` is the spectrum of the surface, `\"profile-spectrum\"` that of \
         each profile; profiles also have `\"heights\"`, `\"bearing\"` and `\"roughness\"`",
    ))
}

/// Returns the version of the spectra of yielded surfaces, if there are any.
fn yielded_version(surfaces: &Surfaces) -> Option<u32> {
    surfaces.stage_with(Property::Yielded).map(|_| YIELDED_VERSION.number())
}

/// Returns the spectrum of all surfaces together. Refuses scans without a common unit of length,
/// and profiles of different specimens.
fn of_all(table: &MeasureTable, what: What, checks: &mut StageChecks) -> Option<Params> {
    let trusted_fraction = checks.number("trusted_fraction", &table.trusted_fraction)?;
    let lines = checks.optional("lines", &table.lines)?.map(|lines| lines.value);
    let bins = bins_per_decade(table, stitched::DEFAULT_BINS, "per decade", checks)?;
    let problem = |message: String, label| {
        Some(Problem::new(message, table.what.written()?.span.clone(), label))
    };
    if let [first, second, ..] = checks.surfaces.length_units.as_slice() {
        let message = format!("the scans have lengths in {first:?} and in {second:?}");
        return checks.reject(problem(message, "needs one unit")?.help(
            "lengths of a file with a unit are in metres; give `side`, `unit` and `height_scale` \
             of the other files in metres, too",
        ));
    }
    if what == What::StitchedSpectrum {
        let yielded_version = yielded_version(checks.surfaces);
        return Some(Params::Stitched { bins, trusted_fraction, yielded_version });
    }
    if let Some(stage) = checks.surfaces.stage_with(Property::UnlikeScans) {
        let message = format!("the surfaces of `{stage}` differ in labels or preparation");
        return checks.reject(problem(message, "is one spectrum")?.help(
            "give each specimen and each filter a `generate` and a `measure` stage of its own",
        ));
    }
    let version = from_profiles::VERSION.number();
    Some(Params::FromProfiles { bins, trusted_fraction, lines, version })
}

fn heights(
    table: &MeasureTable,
    bins: u32,
    range: f64,
    checks: &mut StageChecks,
) -> Option<Params> {
    if !checks.value("pool", &table.pool)? {
        return Some(Params::Heights { bins, range });
    }
    let Some(stage) = checks.surfaces.stage_with(Property::NotRedrawable) else {
        return Some(Params::Pool { bins, range });
    };
    let message = "surfaces with a measured spectrum cannot be pooled: they cannot be drawn again";
    let label = format!("stage `{stage}` reads the spectrum of another stage");
    let problem = Problem::new(message, table.pool.written()?.span.clone(), label);
    checks.reject(problem.help("remove `pool`; each surface then has its own histogram"))
}

/// Returns the statistic of `what = "roughness"`, or `None` after reporting problems.
fn areal(table: &MeasureTable, checks: &mut StageChecks) -> Option<Statistic> {
    let names = checks.optional("parameters", &table.parameters)?;
    let parameters: BTreeSet<Parameter> = match names {
        Some(names) if names.value.contains(&Parameter::All) => Parameter::EACH.into(),
        Some(names) => names.value.iter().copied().collect(),
        None => DEFAULT.into(),
    };
    let smr_height = match checks.optional("smr_height", &table.smr_height)? {
        Some(height) => Some(in_unit_of_surfaces(height, checks)?),
        None => None,
    };
    let settings = Settings {
        smr_height,
        smc_ratio: checks.optional_number("smc_ratio", &table.smc_ratio)?,
        peak_ratio: checks.optional_number("peak_ratio", &table.peak_ratio)?,
        dale_ratio: checks.optional_number("dale_ratio", &table.dale_ratio)?,
        correlation_threshold: checks
            .optional_number("correlation_threshold", &table.correlation_threshold)?,
        pruning: checks.optional_number("pruning", &table.pruning)?,
    };
    for (name, key, users) in [
        ("peak_ratio", &table.peak_ratio, &VOLUMES[..]),
        ("dale_ratio", &table.dale_ratio, &VOLUMES),
        ("correlation_threshold", &table.correlation_threshold, &DECAY),
        ("pruning", &table.pruning, &PEAKS),
    ] {
        check_is_used(name, key, users, &parameters, checks)?;
    }
    let [p, q] = settings.volume_ratios();
    if p >= q {
        let (name, key) = match table.peak_ratio.written() {
            Some(_) => ("peak_ratio", &table.peak_ratio),
            None => ("dale_ratio", &table.dale_ratio),
        };
        let message = format!("`peak_ratio` is {p} and `dale_ratio` is {q}");
        let label = "`peak_ratio` must be below `dale_ratio`";
        return checks.refuse(name, message, &key.written()?.span, label);
    }
    let is_default = parameters == DEFAULT.into();
    Some(if is_default && settings == Settings::default() {
        Statistic::Roughness
    } else {
        Statistic::Areal(Areal { parameters, settings, version: VERSION.number() })
    })
}

/// Returns the statistic of `what = "roughness"` of profiles, or `None` after reporting problems.
fn of_profile(table: &MeasureTable, checks: &mut StageChecks) -> Option<Statistic> {
    let mut length = |name: &str, key: &Key<f64>| match checks.optional(name, key)? {
        Some(length) => Some(Some(in_unit_of_surfaces(length, checks)?)),
        None => Some(None),
    };
    let section_length = length("section_length", &table.section_length);
    let smr_height = length("smr_height", &table.smr_height);
    Some(Statistic::Profile(Profile {
        section_length: section_length?,
        smr_height: smr_height?,
        smc_ratio: checks.optional_number("smc_ratio", &table.smc_ratio)?,
        version: profile::VERSION.number(),
    }))
}

/// Refuses a setting if none of the parameters that depend on it is computed.
fn check_is_used(
    name: &str,
    key: &Key<f64>,
    users: &[Parameter],
    parameters: &BTreeSet<Parameter>,
    checks: &mut Checks,
) -> Option<()> {
    let is_used = users.iter().any(|user| parameters.contains(user));
    let Some(written) = key.written().filter(|_| !is_used) else {
        return Some(());
    };
    let names: Vec<&str> = users.iter().map(|user| user.column().name).collect();
    let users = listed(names.iter().copied(), "and");
    let message = format!("`{name}` has no effect here");
    let label = format!("applies only to {users}");
    let problem = Problem::new(message, written.span.clone(), label);
    checks.reject(problem.help("add one of them to `parameters`, or remove this key"))
}

/// Returns the task of a stage with the key `friction`, or `None` after reporting problems.
fn friction(friction: &Spanned<FrictionTable>, checks: &mut StageChecks) -> Option<Params> {
    if let Some((stage, physics)) = &checks.surfaces.not_superposable {
        let message = format!("stage `{stage}` has {physics}");
        let label = "needs loads on elastic half-spaces without adhesion";
        return checks.refuse("friction", message, &friction.span, label);
    }
    let FrictionTable { coefficient, loads, poisson_ratio } = &friction.value;
    let mut before = 0.0;
    for load in &loads.value {
        if decimal::is_same(load.value, before) {
            let message = format!("`friction` has the tangential load {} twice", load.value);
            let label = "differs from the load before it by no more than rounding";
            return checks.refuse("friction", message, &load.span, label);
        }
        before = load.value;
    }
    let poisson_ratio = checks.optional_number("poisson_ratio", poisson_ratio)?;
    let params = friction::Params {
        coefficient: decimal::nearest(*coefficient),
        poisson_ratio,
        dissipation_version: poisson_ratio.map(|_| DISSIPATION_VERSION.number()),
        loads: loads.value.iter().map(|load| decimal::nearest(load.value)).collect(),
    };
    check_loads(&params, &loads.span, checks)?;
    Some(Params::Friction(params))
}

/// Refuses a path for which no load has all its shares among the loads of its stage.
fn check_loads(params: &friction::Params, span: &Span, checks: &mut StageChecks) -> Option<()> {
    let shares = params.shares();
    for (stage, loads, unit) in &checks.surfaces.loads {
        if complete(loads, &shares).next().is_some() {
            continue;
        }
        let Some(largest) = loads.iter().copied().reduce(f64::max) else { continue };
        let missing: Vec<String> = shares
            .iter()
            .map(|share| decimal::nearest(share * largest))
            .filter(|load| find(loads, *load).is_none())
            .map(|load| quantity::written(load, *unit))
            .collect();
        let message = format!("stage `{stage}` lacks loads that partial slip needs");
        let label = "needs the contacts under smaller loads, too";
        let problem = Problem::new(message, span.clone(), label);
        let missing = listed(missing.iter().map(String::as_str), "and");
        return checks.reject(problem.help(format!(
            "add {missing} to `loads` of stage `{stage}` for these tangential loads under {}",
            quantity::written(largest, *unit)
        )));
    }
    Some(())
}
