//! Keys of the stages that fit, and how they are checked.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::fmt;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::de::value::StrDeserializer;
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer};
use toml::de::DeTable;

use super::contact_evolution::{self, Datum, EvolutionChoices, Kappa};
use super::laws::{Fits, Law, PlainLaw};
use super::limits::keys::LimitTable;
use super::{Params, limits};
use crate::{Given, Reads, Recipe, Rows};
use asperity_manifest::diagnostics::{Problem, Problems, Span};
use asperity_manifest::written::advice::Wanted;
use asperity_manifest::written::checks::{
    Checks, NOT_NEGATIVE, POSITIVE, SHARE, report_equal_points,
};
use asperity_manifest::written::{
    Key, Layout, Section, Table, Written, deserialize_either, reader, table,
};

/// The largest `bootstrap`.
pub const MOST_RESAMPLINGS: u32 = 1_000_000;
/// `bootstrap` when left out.
pub const DEFAULT_RESAMPLINGS: u32 = 1000;
/// `level` when left out.
pub const DEFAULT_LEVEL: f64 = 0.95;

/// Fits the contact evolution law of Yastrebov, Anciaux & Molinari (2015).
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EvolutionTable {
    /// What the law is fitted to: the slope of the mean curve, or the curve.
    #[schemars(extend("default" = "slope"))]
    pub to: Key<Datum>,
    /// What is known of κ: its value, `"free"`, or `"minimal-convex"`.
    #[schemars(extend("default" = "free"))]
    pub kappa: Key<WrittenKappa>,
    /// Smallest and largest load that count, in units of E* × rms slope.
    #[schemars(length(equal = 2), inner(range(min = 0)))]
    #[schemars(extend("default" = contact_evolution::WINDOW))]
    pub window: Key<Vec<Written<f64>>>,
    /// Resamplings of whole surfaces for the intervals; 0 for none.
    #[schemars(range(min = 0, max = MOST_RESAMPLINGS), extend("default" = DEFAULT_RESAMPLINGS))]
    pub bootstrap: Key<i64>,
    /// Probability that an interval covers its parameter.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_LEVEL))]
    pub level: Key<f64>,
    /// Seed of the resampling; that of the study when left out.
    #[schemars(range(min = 0))]
    pub seed: Key<i64>,
}

table!(EvolutionTable, swept: ["to", "kappa"], lists: []);

/// Fits a law that has only its own parameters free.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LawTable {
    /// Smallest and largest load that count, in units of E* × rms slope: 0 to 0.06 when left out,
    /// for `"scaled-erf"` 0.3 to 2, for `"load-separation"` 0.01 to 0.1, for `"mesh-convergence"`
    /// and `"gap-percolation"` all. For `"self-affine"` the smallest and largest wavenumber, all
    /// when left out: a window leaves out what the instrument does not resolve.
    #[schemars(length(equal = 2), inner(range(min = 0)))]
    pub window: Key<Vec<Written<f64>>>,
    /// Resamplings of whole surfaces for the intervals; 0 for none.
    #[schemars(range(min = 0, max = MOST_RESAMPLINGS), extend("default" = DEFAULT_RESAMPLINGS))]
    pub bootstrap: Key<i64>,
    /// Probability that an interval covers its parameter.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_LEVEL))]
    pub level: Key<f64>,
    /// Seed of the resampling; that of the study when left out.
    #[schemars(range(min = 0))]
    pub seed: Key<i64>,
}

table!(LawTable, swept: [], lists: []);

/// What is known of κ.
#[derive(Debug, Clone, Copy, JsonSchema)]
#[schemars(untagged)]
pub enum WrittenKappa {
    /// Its value.
    Given(#[schemars(extend("exclusiveMinimum" = 0))] f64),
    /// How to find it.
    Word(KappaWord),
}

/// How κ is found.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum KappaWord {
    /// It is fitted like the other parameters.
    Free,
    /// The smallest for which the slopes of all curves of the stage are convex.
    MinimalConvex,
}

/// Reads a number, or a word that says how to find it.
macro_rules! number_or_word {
    ($value:ident, $word:ident, $expected:literal) => {
        deserialize_either! {
            'de, $value, $expected,

            fn visit_i64<E: Error>(self, number: i64) -> Result<$value, E> {
                Ok($value::Given(number as f64))
            }

            fn visit_f64<E: Error>(self, number: f64) -> Result<$value, E> {
                Ok($value::Given(number))
            }

            fn visit_str<E: Error>(self, word: &str) -> Result<$value, E> {
                $word::deserialize(StrDeserializer::new(word)).map($value::Word)
            }
        }
    };
}
pub(super) use number_or_word;

number_or_word!(WrittenKappa, KappaWord, "a number, `\"free\"` or `\"minimal-convex\"`");

/// The word after `law =`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LawWord {
    /// The contact evolution law, which is meant when nothing is said.
    ContactEvolution,
    Limits,
    /// Another.
    Plain(PlainLaw),
}

/// The points of a stage's grid, by what they say.
#[derive(Debug)]
pub enum FitPoints {
    Evolution(Section<EvolutionTable>),
    Limits(Section<LimitTable>),
    Plain(PlainLaw, Section<LawTable>),
}

impl LawWord {
    /// Every word, the one that is meant when nothing is said first.
    pub fn all() -> impl Iterator<Item = LawWord> {
        let plain = PlainLaw::ALL.into_iter().map(LawWord::Plain);
        let first = [LawWord::ContactEvolution].into_iter();
        first.chain(plain).chain([LawWord::Limits])
    }

    pub fn word(self) -> &'static str {
        match self {
            LawWord::ContactEvolution => contact_evolution::WORD,
            LawWord::Limits => limits::WORD,
            LawWord::Plain(law) => law.definition().word,
        }
    }

    /// What it is, in a sentence for editors and the guide.
    pub fn about(self) -> &'static str {
        match self {
            LawWord::ContactEvolution => {
                "The contact evolution law, a = κy (1 + β(κy)^μ)^(−1/μ), of Yastrebov, Anciaux & \
                 Molinari (2015)."
            }
            LawWord::Limits => {
                "Q = Q₀ + Σ c_j f_j(x_j), powers or logarithms of expressions in parameters: an observable \
                 where small numbers vanish."
            }
            LawWord::Plain(law) => law.definition().about,
        }
    }

    /// The keys beside it.
    pub fn layout(self) -> &'static Layout {
        match self {
            LawWord::ContactEvolution => EvolutionTable::layout(),
            LawWord::Limits => LimitTable::layout(),
            LawWord::Plain(_) => LawTable::layout(),
        }
    }

    pub fn read(
        self,
        table: DeTable,
        place: Span,
        wanted: &Wanted,
        problems: &mut Problems,
    ) -> FitPoints {
        match self {
            LawWord::ContactEvolution => {
                FitPoints::Evolution(reader::read(table, place, wanted, problems))
            }
            LawWord::Limits => FitPoints::Limits(reader::read(table, place, wanted, problems)),
            LawWord::Plain(law) => {
                FitPoints::Plain(law, reader::read(table, place, wanted, problems))
            }
        }
    }
}

impl FitPoints {
    /// The fits, point by point of the grid.
    pub fn recipes(&self, given: &mut Given) -> Option<Vec<Recipe>> {
        match self {
            FitPoints::Evolution(section) => {
                fits(section, contact_evolution::WINDOW, given, |table, checks| {
                    let to = table.to.written().map_or(Datum::Slope, |to| to.value);
                    let kappa = kappa(table, checks)?;
                    Some(Law::ContactEvolution(EvolutionChoices { to, kappa }))
                })
            }
            FitPoints::Limits(section) => limits::keys::recipes(section, given),
            FitPoints::Plain(law, section) => {
                fits(section, law.definition().window, given, |_, _| Some(Law::Plain(*law)))
            }
        }
    }

    /// What the law can read, if not what the others can.
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
                rows: &[Rows::PowerSpectra],
                from: format!(
                    "`measure` stages with `what = \"spectrum\"`, where its law is `{}`",
                    law.word
                )
                .into(),
            }),
            // A correction is one of the area: it knows no gap.
            Fits::Gaps(_) | Fits::Percolation => Some(Reads {
                rows: &[Rows::Contacts],
                from: format!(
                    "`measure` stages that read contacts, where its law is `{}`",
                    law.word
                )
                .into(),
            }),
        }
    }
}

/// Whatever is known of every surface, and what was fitted to them.
fn read_by_limits() -> Reads {
    Reads {
        rows: &[
            Rows::Surfaces,
            Rows::Spectra,
            Rows::Loads,
            Rows::Contacts,
            Rows::Roughness,
            Rows::Corrections,
            Rows::Fits,
            Rows::Statistics,
        ],
        from: format!(
            "`generate`, `solve`, `measure`, `correct`, other `fit` stages and `aggregate` stages with `sql`, \
             where its law is `{}`",
            limits::WORD
        )
        .into(),
    }
}

fn kappa(table: &EvolutionTable, checks: &mut Checks) -> Option<Kappa> {
    let Some(written) = table.kappa.written() else {
        return Some(Kappa::Free);
    };
    match written.value {
        WrittenKappa::Word(KappaWord::Free) => Some(Kappa::Free),
        WrittenKappa::Word(KappaWord::MinimalConvex) => Some(Kappa::MinimalConvex),
        WrittenKappa::Given(value) => {
            let span = written.span.clone();
            let value = checks.is_in("kappa", &Written { value, span }, POSITIVE)?;
            Some(Kappa::Given(value))
        }
    }
}

/// A table with the keys that every law has.
pub trait FitTable: Table {
    fn common(&self) -> CommonKeys<'_>;
}

/// Keys that every law has.
pub struct CommonKeys<'a> {
    window: &'a Key<Vec<Written<f64>>>,
    bootstrap: &'a Key<i64>,
    level: &'a Key<f64>,
    seed: &'a Key<i64>,
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

/// The fits of a law, point by point of the grid; `window` is meant when none is written.
pub fn fits<T: FitTable>(
    section: &Section<T>,
    window: [f64; 2],
    given: &mut Given,
    law: impl Fn(&T, &mut Checks) -> Option<Law>,
) -> Option<Vec<Recipe>> {
    let mut fits = Vec::with_capacity(section.points.len());
    for point in &section.points {
        let checks = &mut Checks::of(section, point, given.problems);
        let law = law(&point.table, checks);
        fits.push(fit(law, &point.table.common(), window, given.seed, checks));
    }
    let fits: Vec<Params> = fits.into_iter().collect::<Option<_>>()?;
    report_equal_points(section, &fits, given.problems);
    Some(fits.into_iter().map(|fit| Recipe::Fit(Arc::new(fit))).collect())
}

/// A fit of a law, `None` where that could not be read.
fn fit(
    law: Option<Law>,
    keys: &CommonKeys,
    default_window: [f64; 2],
    study_seed: u64,
    checks: &mut Checks,
) -> Option<Params> {
    let window = self::window(keys.window, default_window, checks);
    let bootstrap =
        checks.whole_or("bootstrap", keys.bootstrap, 0..=MOST_RESAMPLINGS, DEFAULT_RESAMPLINGS);
    let level = checks.number_or("level", keys.level, SHARE, DEFAULT_LEVEL);
    let seed = checks.whole_or("seed", keys.seed, 0..=i64::MAX as u64, study_seed);
    Some(Params { law: law?, window: window?, bootstrap: bootstrap?, level: level?, seed: seed? })
}

fn window(
    key: &Key<Vec<Written<f64>>>,
    default: [f64; 2],
    checks: &mut Checks,
) -> Option<[f64; 2]> {
    let Some(written) = key.written() else {
        return Some(default);
    };
    let [low, high] = written.value.as_slice() else {
        let message = format!("`window` has {} entries", written.value.len());
        let label = "must be two loads, `[lowest, highest]`";
        checks.report("window", Problem::new(message, written.span.clone(), label));
        return None;
    };
    let low_load = checks.holds("window", low, NOT_NEGATIVE);
    let high_load = checks.holds("window", high, POSITIVE);
    let (low_load, high_load) = (low_load?, high_load?);
    if low_load >= high_load {
        let message = format!("`window` is empty: {low_load:?} is not below {high_load:?}");
        let problem = Problem::new(message, high.span.clone(), "must be above the lowest load");
        checks.report("window", problem);
        return None;
    }
    Some([low_load, high_load])
}
