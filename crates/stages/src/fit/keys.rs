//! Keys of `fit` stages, and checks of their values.
//!
//! Editors show the doc comments of keys, and messages quote them.

mod limits;

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::check_context::{Property, StageChecks};
use crate::fit::Params;
use crate::fit::contact_evolution::{self, Datum, EvolutionChoices, Kappa};
use crate::fit::keys::limits::LimitTable;
use crate::fit::laws::{Fits, Law, LawDefinition, PlainLaw};
use crate::fit::limits::WORD as LIMITS;
use crate::stage_points::{StagePoints, StageVariant, Work};
use crate::{CheckContext, Kind, Reads, Recipe, RowKind};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Span};
use asperity_manifest::keys::checks::{Checks, report_equal_points};
use asperity_manifest::keys::declare::swept;
use asperity_manifest::keys::{Key, KeyTable, Section, table};

/// Fit of the contact evolution law of Yastrebov, Anciaux & Molinari (2015).
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EvolutionTable {
    /// Data to which the law is fitted: the mean curve of the area against the load (`"area"`), or
    /// its slope (`"slope"`).
    #[schemars(extend("default" = "slope"), transform = swept)]
    pub to: Key<Datum>,
    /// Parameter κ of the law: a value, `"free"` to fit it, or `"minimal-convex"` for the smallest
    /// value that gives convex slopes.
    #[schemars(extend("default" = "free"), transform = swept)]
    pub kappa: Key<WrittenKappa>,
    /// Smallest and largest load that enter the fit, in units of E* × rms slope.
    #[schemars(inner(range(min = 0)), extend("default" = contact_evolution::WINDOW))]
    pub window: Key<[f64; 2]>,
    /// Number of bootstrap samples of whole surfaces for the confidence intervals; 0 gives no
    /// intervals.
    #[schemars(range(min = 0, max = MAX_RESAMPLINGS), extend("default" = DEFAULT_RESAMPLINGS))]
    pub bootstrap: Key<u32>,
    /// Confidence level of the intervals: the probability that an interval covers its parameter.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_LEVEL))]
    pub level: Key<f64>,
    /// Seed of the bootstrap. The default is the `seed` of `[study]`.
    #[schemars(range(min = 0))]
    pub seed: Key<u64>,
}

table!(EvolutionTable);

/// Keys that all laws without further keys have in a `fit` stage.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LawTable {
    /// Smallest and largest load that enter the fit, in units of E* × rms slope. The default is 0
    /// to 0.06, but 0.3 to 2 for `"scaled-erf"`, 0.01 to 0.1 for `"load-separation"`, and all loads
    /// for `"mesh-convergence"` and `"gap-percolation"`. For `"self-affine"` it is the smallest and
    /// largest wavenumber, by default all; exclude wavenumbers that the instrument does not
    /// resolve.
    #[schemars(inner(range(min = 0)))]
    pub window: Key<[f64; 2]>,
    /// Number of bootstrap samples of whole surfaces for the confidence intervals; 0 gives no
    /// intervals.
    #[schemars(range(min = 0, max = MAX_RESAMPLINGS), extend("default" = DEFAULT_RESAMPLINGS))]
    pub bootstrap: Key<u32>,
    /// Confidence level of the intervals: the probability that an interval covers its parameter.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_LEVEL))]
    pub level: Key<f64>,
    /// Seed of the bootstrap. The default is the `seed` of `[study]`.
    #[schemars(range(min = 0))]
    pub seed: Key<u64>,
}

table!(LawTable);

/// The value of the key `kappa`.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum WrittenKappa {
    /// A given value of κ.
    Given(#[schemars(extend("exclusiveMinimum" = 0))] f64),
    /// A method to determine κ.
    Found(Kappa),
}

/// Returns the variants of `fit` stages in the order of the documentation, the default first.
pub fn variants() -> Vec<StageVariant> {
    let kind = Kind::Fit;
    let evolution = StageVariant::new(kind, |keys: Section<EvolutionTable>| keys).selected_by(
        "law",
        contact_evolution::WORD,
        "The contact evolution law, a = κy (1 + β(κy)^μ)^(−1/μ), of Yastrebov, Anciaux & \
         Molinari (2015).",
    );
    let plain = PlainLaw::ALL.into_iter().map(|law| {
        let LawDefinition { word, about, .. } = law.definition();
        StageVariant::new(kind, move |keys: Section<LawTable>| (law, keys))
            .selected_by("law", word, about)
    });
    let limits = StageVariant::new(kind, |keys: Section<LimitTable>| keys).selected_by(
        "law",
        LIMITS,
        "Q = Q₀ + Σ c_j f_j(x_j), the limit Q₀ of an observable Q for vanishing x_j. Each x_j is an \
         expression in parameters, and each f_j is a power or a logarithm.",
    );
    [evolution].into_iter().chain(plain).chain([limits]).collect()
}

impl StagePoints for Section<EvolutionTable> {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        check_physics(contact_evolution::WORD, &self.span, context)?;
        fits(self, None, context, |table, checks| {
            let to = checks.value("to", &table.to)?;
            let kappa = match checks.optional("kappa", &table.kappa)?.map(|kappa| kappa.value) {
                None => checks.default_of("kappa"),
                Some(WrittenKappa::Given(value)) => Kappa::Given(decimal::nearest(value)),
                Some(WrittenKappa::Found(kappa)) => kappa,
            };
            Some(Law::ContactEvolution(EvolutionChoices { to, kappa }))
        })
    }
}

impl StagePoints for (PlainLaw, Section<LawTable>) {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        let (law, section) = self;
        let LawDefinition { word, window, fits: of, .. } = law.definition();
        if matches!(of, Fits::Areas(_) | Fits::Gaps(_)) {
            check_physics(word, &section.span, context)?;
        }
        fits(section, Some(window), context, |_, _| Some(Law::Plain(*law)))
    }

    fn reads(&self) -> Option<Reads> {
        let law = self.0.definition();
        let (rows, from): (&[RowKind], _) = match law.fits {
            Fits::Areas(_) | Fits::Meshes => return None,
            Fits::Spectra => {
                (&[RowKind::PowerSpectra], "`measure` stages with `what = \"spectrum\"`")
            }
            // Corrected rows have areas but no gaps.
            Fits::Gaps(_) | Fits::Percolation => {
                (&[RowKind::Contacts], "`measure` stages that read `solve` stages")
            }
        };
        Some(Reads { rows, from: format!("{from} if its law is `{}`", law.word).into() })
    }
}

/// Refuses laws of contacts without adhesion. With adhesion the area does not vanish with the
/// load, surfaces are apart under some loads, and loads may be zero or negative.
fn check_physics(law: &str, span: &Span, context: &mut CheckContext) -> Option<()> {
    let stage_with = |property| context.surfaces.stage_with(property);
    let (message, help) = if let Some(stage) = stage_with(Property::WithoutGivenLoads) {
        let message = format!(
            "the law {law:?} is for means under common loads, but the loads of stage `{stage}` \
             are results"
        );
        (message, "press the surfaces under `loads` instead")
    } else if let Some(stage) = stage_with(Property::WithAdhesion) {
        let message = format!(
            "the law {law:?} is for contacts without adhesion, but stage `{stage}` has `adhesion`"
        );
        let help = "remove the stage, or let it read stages without `adhesion`; `aggregate` stages \
                    give means under each load";
        (message, help)
    } else {
        return Some(());
    };
    let problem = Problem::new(message, span.clone(), "this stage fits its contacts");
    context.problems.push(problem.help(help));
    None
}

macro_rules! fit_tables {
    ($($table:ty),*) => {
        $(impl FitTable for $table {
            fn common(&self) -> CommonKeys<'_> {
                let Self { window, bootstrap, level, seed, .. } = self;
                CommonKeys { window, bootstrap, level, seed }
            }
        })*
    };
}

fit_tables!(EvolutionTable, LawTable, LimitTable);

/// Maximum value of the key `bootstrap`.
pub const MAX_RESAMPLINGS: u32 = 1_000_000;
/// Default value of the key `bootstrap`.
pub const DEFAULT_RESAMPLINGS: u32 = 1000;
/// Default value of the key `level`.
pub const DEFAULT_LEVEL: f64 = 0.95;

/// A table with the keys that all laws have.
pub trait FitTable: KeyTable {
    /// Returns the keys that all laws have.
    fn common(&self) -> CommonKeys<'_>;
}

/// The keys that all laws have.
pub struct CommonKeys<'a> {
    pub window: &'a Key<[f64; 2]>,
    pub bootstrap: &'a Key<u32>,
    pub level: &'a Key<f64>,
    pub seed: &'a Key<u64>,
}

/// Returns the recipes of the fits, one for each point of the grid, or `None` after reporting
/// problems. `law` reads the law with its settings at a point. `default_window` is the default of
/// the key `window` for tables that declare no default.
pub fn fits<T: FitTable>(
    section: &Section<T>,
    default_window: Option<[f64; 2]>,
    context: &mut CheckContext,
    law: impl Fn(&T, &mut StageChecks) -> Option<Law>,
) -> Option<Work> {
    let mut checked = Vec::with_capacity(section.points.len());
    for point in &section.points {
        let seed = context.seed;
        let checks = &mut StageChecks::new(section, point, context);
        let law = law(&point.table, checks);
        checked.push(fit(law, &point.table.common(), default_window, seed, checks));
    }
    let fits: Vec<Params> = checked.into_iter().collect::<Option<_>>()?;
    report_equal_points(section, &fits, context.problems);
    Work::evaluate(Some(fits.into_iter().map(|fit| Recipe::Fit(Arc::new(fit))).collect()))
}

/// Returns the fit at one point, or `None` if the law or one of its keys is invalid.
fn fit(
    law: Option<Law>,
    keys: &CommonKeys,
    default_window: Option<[f64; 2]>,
    study_seed: u64,
    checks: &mut Checks,
) -> Option<Params> {
    let window = self::window(keys.window, default_window, checks);
    let bootstrap = checks.value("bootstrap", keys.bootstrap);
    let level = checks.number("level", keys.level);
    let seed = checks.value_or("seed", keys.seed, study_seed);
    Some(Params { law: law?, window: window?, bootstrap: bootstrap?, level: level?, seed: seed? })
}

fn window(key: &Key<[f64; 2]>, default: Option<[f64; 2]>, checks: &mut Checks) -> Option<[f64; 2]> {
    let Some(written) = checks.optional("window", key)? else {
        return Some(default.unwrap_or_else(|| checks.default_of("window")));
    };
    let [low, high] = written.value.map(decimal::nearest);
    if low >= high {
        let message = format!("`window` is empty: {low:?} is not below {high:?}");
        let label = "must be `[smallest, largest]`";
        return checks.refuse("window", message, &written.span, label);
    }
    Some([low, high])
}
