//! Keys of `fit` stages. Their doc comments are shown by editors and quoted in messages.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use toml::de::DeTable;

use super::contact_evolution::{self, Datum, EvolutionChoices, Kappa};
use super::laws::{Fits, Law, PlainLaw};
use super::limits::keys::LimitTable;
use super::{Params, limits};
use crate::{CheckContext, Reads, Recipe, RowKind};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problems, Span};
use asperity_manifest::written::checks::{Checks, report_equal_points};
use asperity_manifest::written::declare::swept;
use asperity_manifest::written::expected_keys::ExpectedKeys;
use asperity_manifest::written::{Key, KeyTable, Layout, Section, reader, table};

/// Maximum of `bootstrap`.
pub const MAX_RESAMPLINGS: u32 = 1_000_000;
/// Default of `bootstrap`.
pub const DEFAULT_RESAMPLINGS: u32 = 1000;
/// Default of `level`.
pub const DEFAULT_LEVEL: f64 = 0.95;

/// Fits the contact evolution law of Yastrebov, Anciaux & Molinari (2015).
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EvolutionTable {
    /// Data that the law is fitted to: the slope of the mean curve, or the mean curve.
    #[schemars(extend("default" = "slope"), transform = swept)]
    pub to: Key<Datum>,
    /// The parameter κ: its value, `"free"`, or `"minimal-convex"`.
    #[schemars(extend("default" = "free"), transform = swept)]
    pub kappa: Key<WrittenKappa>,
    /// Smallest and largest load that enter the fit, in units of E* × rms slope.
    #[schemars(inner(range(min = 0)), extend("default" = contact_evolution::WINDOW))]
    pub window: Key<[f64; 2]>,
    /// Number of bootstrap samples of whole surfaces for the intervals; 0 gives no intervals.
    #[schemars(range(min = 0, max = MAX_RESAMPLINGS), extend("default" = DEFAULT_RESAMPLINGS))]
    pub bootstrap: Key<u32>,
    /// Probability that an interval covers its parameter.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_LEVEL))]
    pub level: Key<f64>,
    /// Seed of the bootstrap; the default is the seed of the study.
    #[schemars(range(min = 0))]
    pub seed: Key<u64>,
}

table!(EvolutionTable);

/// Fits a law whose only free quantities are its parameters.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LawTable {
    /// Smallest and largest load that enter the fit, in units of E* × rms slope. The default is 0
    /// to 0.06; 0.3 to 2 for `"scaled-erf"`, 0.01 to 0.1 for `"load-separation"`, and all loads for
    /// `"mesh-convergence"` and `"gap-percolation"`. For `"self-affine"` it is the smallest and
    /// largest wavenumber, by default all: exclude those that the instrument does not resolve.
    #[schemars(inner(range(min = 0)))]
    pub window: Key<[f64; 2]>,
    /// Number of bootstrap samples of whole surfaces for the intervals; 0 gives no intervals.
    #[schemars(range(min = 0, max = MAX_RESAMPLINGS), extend("default" = DEFAULT_RESAMPLINGS))]
    pub bootstrap: Key<u32>,
    /// Probability that an interval covers its parameter.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_LEVEL))]
    pub level: Key<f64>,
    /// Seed of the bootstrap; the default is the seed of the study.
    #[schemars(range(min = 0))]
    pub seed: Key<u64>,
}

table!(LawTable);

/// The parameter κ, as a manifest has it.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum WrittenKappa {
    /// The value.
    Given(#[schemars(extend("exclusiveMinimum" = 0))] f64),
    /// The way to find it.
    Found(Kappa),
}

/// The value of `law`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LawWord {
    /// The contact evolution law, the default.
    ContactEvolution,
    /// The limit of an observable.
    Limits,
    /// A law whose only free quantities are its parameters.
    Plain(PlainLaw),
}

/// The points of the grid of a `fit` stage.
#[derive(Debug)]
pub enum FitPoints {
    Evolution(Section<EvolutionTable>),
    Limits(Section<LimitTable>),
    Plain(PlainLaw, Section<LawTable>),
}

impl LawWord {
    /// Returns all laws; the first one is the default.
    pub fn all() -> impl Iterator<Item = LawWord> {
        let plain = PlainLaw::ALL.into_iter().map(LawWord::Plain);
        let first = [LawWord::ContactEvolution].into_iter();
        first.chain(plain).chain([LawWord::Limits])
    }

    /// Returns the word for it in manifests.
    pub fn word(self) -> &'static str {
        match self {
            LawWord::ContactEvolution => contact_evolution::WORD,
            LawWord::Limits => limits::WORD,
            LawWord::Plain(law) => law.definition().word,
        }
    }

    /// Returns a sentence about it for editors and the guide.
    pub fn about(self) -> &'static str {
        match self {
            LawWord::ContactEvolution => {
                "The contact evolution law, a = κy (1 + β(κy)^μ)^(−1/μ), of Yastrebov, Anciaux & \
                 Molinari (2015)."
            }
            LawWord::Limits => {
                "Q = Q₀ + Σ c_j f_j(x_j) with powers or logarithms f_j of expressions in parameters: the \
                 limit of an observable where these expressions vanish."
            }
            LawWord::Plain(law) => law.definition().about,
        }
    }

    /// Returns the keys of its table.
    pub fn layout(self) -> &'static Layout {
        match self {
            LawWord::ContactEvolution => EvolutionTable::layout(),
            LawWord::Limits => LimitTable::layout(),
            LawWord::Plain(_) => LawTable::layout(),
        }
    }

    /// Reads its table.
    pub fn read(
        self,
        table: DeTable,
        span: Span,
        expected: &ExpectedKeys,
        problems: &mut Problems,
    ) -> FitPoints {
        match self {
            LawWord::ContactEvolution => {
                FitPoints::Evolution(reader::read(table, span, expected, problems))
            }
            LawWord::Limits => FitPoints::Limits(reader::read(table, span, expected, problems)),
            LawWord::Plain(law) => {
                FitPoints::Plain(law, reader::read(table, span, expected, problems))
            }
        }
    }
}

impl FitPoints {
    /// Returns the fits, one for each point of the grid.
    pub fn recipes(&self, context: &mut CheckContext) -> Option<Vec<Recipe>> {
        match self {
            FitPoints::Evolution(section) => fits(section, None, context, |table, checks| {
                let to = checks.value("to", &table.to)?;
                let kappa = match checks.optional("kappa", &table.kappa)? {
                    None => checks.default_of("kappa"),
                    Some(written) => match written.value {
                        WrittenKappa::Given(value) => Kappa::Given(decimal::nearest(value)),
                        WrittenKappa::Found(kappa) => kappa,
                    },
                };
                Some(Law::ContactEvolution(EvolutionChoices { to, kappa }))
            }),
            FitPoints::Limits(section) => limits::keys::recipes(section, context),
            FitPoints::Plain(law, section) => {
                let window = law.definition().window;
                fits(section, Some(window), context, |_, _| Some(Law::Plain(*law)))
            }
        }
    }

    /// Returns the rows that the law can read, if they differ from those of other laws.
    pub fn reads(&self) -> Option<Reads> {
        let law = match self {
            FitPoints::Evolution(_) => return None,
            FitPoints::Limits(_) => return Some(read_by_limits()),
            FitPoints::Plain(law, _) => law,
        };
        let law = law.definition();
        match law.fits {
            Fits::Areas(_) | Fits::Meshes => None,
            Fits::Spectra => Some(Reads {
                rows: &[RowKind::PowerSpectra],
                from: format!(
                    "`measure` stages with `what = \"spectrum\"`, where its law is `{}`",
                    law.word
                )
                .into(),
            }),
            // A correction applies to the area and has no gaps.
            Fits::Gaps(_) | Fits::Percolation => Some(Reads {
                rows: &[RowKind::Contacts],
                from: format!(
                    "`measure` stages that read contacts, where its law is `{}`",
                    law.word
                )
                .into(),
            }),
        }
    }
}

/// Returns the rows that limits can be fitted to: those with one value a surface, and fits.
fn read_by_limits() -> Reads {
    Reads {
        rows: &[
            RowKind::Surfaces,
            RowKind::Spectra,
            RowKind::Loads,
            RowKind::Contacts,
            RowKind::Roughness,
            RowKind::Corrections,
            RowKind::Fits,
            RowKind::Statistics,
        ],
        from: format!(
            "`generate`, `solve`, `measure`, `correct`, other `fit` stages and `aggregate` stages with `sql`, \
             where its law is `{}`",
            limits::WORD
        )
        .into(),
    }
}

/// A table with the keys that every law has.
pub trait FitTable: KeyTable {
    /// Returns the keys that every law has.
    fn common(&self) -> CommonKeys<'_>;
}

/// Keys that every law has.
pub struct CommonKeys<'a> {
    window: &'a Key<[f64; 2]>,
    bootstrap: &'a Key<u32>,
    level: &'a Key<f64>,
    seed: &'a Key<u64>,
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

/// Returns the fits of a law, one for each point of the grid. `default_window` is for laws whose
/// key `window` declares no default.
pub fn fits<T: FitTable>(
    section: &Section<T>,
    default_window: Option<[f64; 2]>,
    context: &mut CheckContext,
    law: impl Fn(&T, &mut Checks) -> Option<Law>,
) -> Option<Vec<Recipe>> {
    let mut fits = Vec::with_capacity(section.points.len());
    for point in &section.points {
        let checks = &mut Checks::new(section, point, context.problems);
        let law = law(&point.table, checks);
        fits.push(fit(law, &point.table.common(), default_window, context.seed, checks));
    }
    let fits: Vec<Params> = fits.into_iter().collect::<Option<_>>()?;
    report_equal_points(section, &fits, context.problems);
    Some(fits.into_iter().map(|fit| Recipe::Fit(Arc::new(fit))).collect())
}

/// Returns a fit of a law, or none if the law or one of its keys is wrong.
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
