//! Keys of the fits of limits, and how they are checked.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::collections::BTreeSet;
use std::fmt;
use std::ops::Bound;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::de::value::{SeqAccessDeserializer, StrDeserializer};
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::{Form, LimitChoices, MOST_COMBINATIONS, MOST_TERMS, Term, WINDOW};
use crate::columns::{LOAD, SURFACE};
use crate::fit::keys::{
    DEFAULT_LEVEL, DEFAULT_RESAMPLINGS, MOST_RESAMPLINGS, fits, number_or_word,
};
use crate::fit::laws::Law;
use crate::{Given, Recipe, Rows};
use asperity_manifest::diagnostics::{Problem, did_you_mean, listed};
use asperity_manifest::expression::Expression;
use asperity_manifest::written::checks::{Bounds, Checks, POSITIVE};
use asperity_manifest::written::{Key, Section, Written, deserialize_either, table};
use asperity_statistics::limits::EXPONENTS;
use asperity_tables::column::Role;
use asperity_tables::table::Table;

/// Fits Q = Q₀ + Σ cⱼ fⱼ(xⱼ): what an observable tends to where small numbers vanish.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LimitTable {
    /// The observable Q, a column or an expression in columns, of one surface under one load:
    /// `"mean_gap"`, `"area_corrected / load"`, `"-1 / slope(mean_gap)"` (by neighbouring loads),
    /// or a parameter that another stage has fitted, with its standard error.
    #[schemars(required)]
    pub of: Key<String>,
    /// What is to vanish, and how the observable depends on it:
    /// `[{ of = "1 / k_lower", exponent = 1 }, …]`.
    #[schemars(required, length(min = 1, max = MOST_TERMS))]
    pub terms: Key<Vec<Written<TermTable>>>,
    /// The loads at which the observable is looked at, in units of E* × rms slope; all loads of the
    /// window when left out.
    #[schemars(inner(range(min = 0)))]
    pub loads: Key<Vec<Written<f64>>>,
    /// Parameters that vary among the points of one fit; those that the terms name when left out.
    /// A plateau that ends at the same multiple of `k_lower` goes along with it.
    pub over: Key<Vec<Written<String>>>,
    /// Smallest and largest load that count where no `loads` are given, in units of E* × rms slope.
    #[schemars(length(equal = 2), inner(range(min = 0)), extend("default" = WINDOW))]
    pub window: Key<Vec<Written<f64>>>,
    /// Resamplings of whole surfaces for the intervals, the same realizations in all points; 0 for
    /// none.
    #[schemars(range(min = 0, max = MOST_RESAMPLINGS), extend("default" = DEFAULT_RESAMPLINGS))]
    pub bootstrap: Key<i64>,
    /// Probability that an interval covers its parameter.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_LEVEL))]
    pub level: Key<f64>,
    /// Seed of the resampling; that of the study when left out.
    #[schemars(range(min = 0))]
    pub seed: Key<i64>,
}

table!(LimitTable, swept: ["of"], lists: ["terms", "loads", "over"]);

/// One small number.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TermTable {
    /// The small number, an expression in parameters: `"k_lower / k_upper"`.
    pub of: Written<String>,
    /// `"power"` or `"logarithm"`; with both in a list, both are fitted and compared.
    #[serde(default)]
    #[schemars(extend("default" = "power"))]
    pub form: Key<OneOrMore<FormWord>>,
    /// The exponent of the power: a number, `"free"`, or a list of which each is fitted and
    /// compared.
    #[serde(default)]
    #[schemars(extend("default" = "free"))]
    pub exponent: Key<OneOrMore<WrittenExponent>>,
}

/// A value, or a list of which each is tried.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum OneOrMore<T> {
    /// One.
    One(T),
    /// Several.
    More(Vec<T>),
}

impl<T: Copy> OneOrMore<T> {
    /// All of them.
    pub fn all(&self) -> Vec<T> {
        match self {
            OneOrMore::One(one) => vec![*one],
            OneOrMore::More(more) => more.clone(),
        }
    }
}

/// How an observable depends on a small number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FormWord {
    /// c xᵉ.
    Power,
    /// c ln x: then there is no limit, and `limit` is the value at x = 1.
    Logarithm,
}

/// An exponent.
#[derive(Debug, Clone, Copy, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum WrittenExponent {
    /// Its value.
    Given(#[schemars(extend("exclusiveMinimum" = 0))] f64),
    /// It is fitted.
    Word(ExponentWord),
}

/// How an exponent is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ExponentWord {
    /// It is fitted like the coefficients.
    Free,
}

number_or_word!(WrittenExponent, ExponentWord, "a number or `\"free\"`");

deserialize_either! {
    'de, OneOrMore<FormWord>, "`\"power\"`, `\"logarithm\"` or a list of both",

    fn visit_str<E: Error>(self, word: &str) -> Result<OneOrMore<FormWord>, E> {
        FormWord::deserialize(StrDeserializer::new(word)).map(OneOrMore::One)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<OneOrMore<FormWord>, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(list)).map(OneOrMore::More)
    }
}

deserialize_either! {
    'de, OneOrMore<WrittenExponent>, "a number, `\"free\"` or a list of them",

    fn visit_i64<E: Error>(self, number: i64) -> Result<OneOrMore<WrittenExponent>, E> {
        Ok(OneOrMore::One(WrittenExponent::Given(number as f64)))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<OneOrMore<WrittenExponent>, E> {
        Ok(OneOrMore::One(WrittenExponent::Given(number)))
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<OneOrMore<WrittenExponent>, E> {
        let word = ExponentWord::deserialize(StrDeserializer::new(word));
        word.map(|word| OneOrMore::One(WrittenExponent::Word(word)))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<OneOrMore<WrittenExponent>, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(list)).map(OneOrMore::More)
    }
}

/// Exponents that a power may be given.
const GIVEN_EXPONENTS: Bounds = (Bound::Included(EXPONENTS[0]), Bound::Included(EXPONENTS[1]));

/// The fits, observable by observable.
pub fn recipes(section: &Section<LimitTable>, given: &mut Given) -> Option<Vec<Recipe>> {
    let input = Input { table: given.input, rows: given.read };
    fits(section, WINDOW, given, |table, checks| {
        Some(Law::Limits(Arc::new(choices(table, &input, checks)?)))
    })
}

/// What a fit reads, as far as it is known.
struct Input<'a> {
    table: Option<&'a Table>,
    rows: Option<Rows>,
}

fn choices(table: &LimitTable, input: &Input, checks: &mut Checks) -> Option<LimitChoices> {
    let of = checks.required("of", &table.of);
    let of = of.and_then(|of| Some((of, observable(of, input, checks)?)));
    let error = of.as_ref().and_then(|(written, of)| error(written, of, input, checks));
    let terms = terms(table, input, checks);
    let loads = loads(table, input, checks);
    let named: BTreeSet<String> =
        terms.iter().flatten().flat_map(|term| term.of.columns()).map(str::to_owned).collect();
    let over = match table.over.written() {
        Some(written) => {
            let names = written.value.iter();
            let names: Vec<_> = names.map(|name| over(name, input, checks)).collect();
            let given: Option<BTreeSet<String>> = names.into_iter().collect();
            given.map(|given| given.union(&named).cloned().collect())
        }
        None => Some(named),
    };
    Some(LimitChoices { of: of?.1, loads: loads?, terms: terms?, over: over?, error: error? })
}

/// An expression in columns that the input has.
fn expression(
    written: &Written<String>,
    input: &Input,
    wanted: Option<Role>,
    checks: &mut Checks,
) -> Option<Expression> {
    let read = match Expression::parse(&written.value) {
        Ok(read) => read,
        Err(error) => {
            let message = format!("{:?} is no expression in columns", written.value);
            // Within quotes, unless letters are escaped.
            let inside = written.span.start + 1..written.span.end.saturating_sub(1);
            let span = match inside.len() == written.value.len() {
                true => {
                    inside.start + error.at.start..inside.start + error.at.end.max(error.at.start)
                }
                false => written.span.clone(),
            };
            let problem = Problem::new(message, span, error.reason);
            checks.problems.push(problem.help(
                "columns, numbers, `+ - * / ^`, parentheses, `ln(…)`, `sqrt(…)`, `slope(…)`",
            ));
            return None;
        }
    };
    let named: Vec<bool> = read
        .columns()
        .into_iter()
        .map(|name| is_usable(name, written, input, wanted, checks))
        .collect();
    named.into_iter().all(|usable| usable).then_some(read)
}

/// Whether a column is there and holds numbers, in the role that is wanted.
fn is_usable(
    name: &str,
    written: &Written<String>,
    input: &Input,
    wanted: Option<Role>,
    checks: &mut Checks,
) -> bool {
    let Some(table) = input.table else {
        return true;
    };
    let problem = if !table.has(name) {
        let usable = table.batch().schema_ref().fields().iter();
        let usable = usable.filter(|field| wanted.is_none() || Role::of(field) == wanted);
        let names: Vec<&str> = usable.map(|field| field.name().as_str()).collect();
        let message = format!("the stages in `from` have no column {name:?}");
        match did_you_mean(name, names.iter().copied()) {
            Some(meant) => {
                let label = format!("did you mean \"{meant}\"?");
                Problem::new(message, written.span.clone(), label)
            }
            None => Problem::new(message, written.span.clone(), "unknown column")
                .help(format!("there is {}", listed(names, "and"))),
        }
    } else if table.reals(name).is_err() && table.integers(name).is_err() {
        let message = format!("the column {name:?} holds no numbers");
        Problem::new(message, written.span.clone(), "cannot be computed with")
    } else if wanted.is_some() && !table.in_role(Role::Parameter).has(name) {
        let parameters = table.in_role(Role::Parameter);
        let message = format!("{name:?} differs between surfaces and loads");
        let label = "must be a parameter, equal for all surfaces of a spectrum";
        Problem::new(message, written.span.clone(), label)
            .help(format!("parameters are {}", listed(parameters.names(), "and")))
    } else {
        return true;
    };
    checks.problems.push(problem);
    false
}

fn observable(of: &Written<String>, input: &Input, checks: &mut Checks) -> Option<Expression> {
    let read = expression(of, input, None, checks)?;
    let lacks_surfaces = input.table.is_some_and(|table| !table.has(SURFACE.name));
    if input.rows == Some(Rows::Statistics) && lacks_surfaces {
        let message = "the rows of the `aggregate` stage in `from` are not about single surfaces";
        let label = "needs the values of every surface";
        let problem = Problem::new(message, of.span.clone(), label);
        checks.problems.push(problem.help(
            "let its `sql` keep `surface`, `seed`, `realization` and every parameter, as in \
             `select area.*, surfaces.rms_height from area join surfaces using (surface)`",
        ));
        return None;
    }
    let lacks_loads = input.table.is_some_and(|table| !table.has(LOAD.name));
    if read.has_slope() && (lacks_loads || input.rows == Some(Rows::Fits)) {
        let message = "`slope` is taken against `load`, along which these rows are no curve";
        let label = "needs rows of surfaces under loads";
        checks.report("of", Problem::new(message, of.span.clone(), label));
        return None;
    }
    Some(read)
}

/// The column with the standard error of a fitted parameter, which must be one.
fn error(
    written: &Written<String>,
    of: &Expression,
    input: &Input,
    checks: &mut Checks,
) -> Option<Option<String>> {
    if input.rows != Some(Rows::Fits) {
        return Some(None);
    }
    let column = match of {
        Expression::Column(name) => Some(format!("{name}_standard_error")),
        _ => None,
    };
    let known = |column: &String| input.table.is_none_or(|table| table.has(column));
    if let Some(column) = column.filter(known) {
        return Some(Some(column));
    }
    let message = format!("{:?} has no standard error among the fits", written.value);
    let label = "must be one fitted parameter";
    checks.report("of", Problem::new(message, written.span.clone(), label));
    None
}

fn terms(table: &LimitTable, input: &Input, checks: &mut Checks) -> Option<Vec<Term>> {
    let written = checks.required("terms", &table.terms)?;
    let count = written.value.len();
    if count == 0 || count > MOST_TERMS {
        let message = format!("`terms` has {count} entries");
        let label = format!("must be from 1 to {MOST_TERMS}");
        checks.report("terms", Problem::new(message, written.span.clone(), label));
        return None;
    }
    let terms: Vec<Option<Term>> =
        written.value.iter().map(|term| self::term(term, input, checks)).collect();
    let terms = terms.into_iter().collect::<Option<Vec<Term>>>()?;
    let combinations: usize = terms.iter().map(|term| term.forms.len()).product();
    if combinations > MOST_COMBINATIONS {
        let message = format!("the forms of the terms make {combinations} combinations");
        let label = format!("{MOST_COMBINATIONS} is the most");
        checks.report("terms", Problem::new(message, written.span.clone(), label));
        return None;
    }
    Some(terms)
}

fn term(written: &Written<TermTable>, input: &Input, checks: &mut Checks) -> Option<Term> {
    let table = &written.value;
    let of = expression(&table.of, input, Some(Role::Parameter), checks);
    if of.as_ref().is_some_and(|of| of.columns().is_empty() || of.has_slope()) {
        let message = format!("{:?} is the same at all points", table.of.value);
        let label = "must name a parameter that varies";
        checks.report("terms", Problem::new(message, table.of.span.clone(), label));
        return None;
    }
    let words = table.form.written();
    let words = words.map_or(vec![FormWord::Power], |form| form.value.all());
    let mut forms = Vec::new();
    for word in words {
        match word {
            FormWord::Logarithm => forms.push(Some(Form::Logarithm)),
            FormWord::Power => forms.extend(powers(table, checks)),
        }
    }
    let forms = forms.into_iter().collect::<Option<Vec<Form>>>()?;
    let repeated = (1..forms.len()).any(|at| forms[..at].contains(&forms[at]));
    if forms.is_empty() || repeated {
        let message = match repeated {
            true => "a term is fitted by the same form twice",
            false => "a term has an empty list of forms",
        };
        let label = "each form once";
        checks.report("terms", Problem::new(message, written.span.clone(), label));
        return None;
    }
    Some(Term { of: of?, forms })
}

/// The powers that are tried.
fn powers(table: &TermTable, checks: &mut Checks) -> Vec<Option<Form>> {
    let Some(written) = table.exponent.written() else {
        return vec![Some(Form::FreePower)];
    };
    let exponents = written.value.all().into_iter();
    let form = |exponent| match exponent {
        WrittenExponent::Word(_) => Some(Form::FreePower),
        WrittenExponent::Given(value) => {
            let span = written.span.clone();
            let value = checks.is_in("exponent", &Written { value, span }, GIVEN_EXPONENTS);
            value.map(Form::Power)
        }
    };
    exponents.map(form).collect()
}

fn loads(table: &LimitTable, input: &Input, checks: &mut Checks) -> Option<Vec<f64>> {
    let Some(written) = table.loads.written() else {
        return Some(Vec::new());
    };
    if input.table.is_some_and(|table| !table.has(LOAD.name)) {
        let why = "the rows that are read have no load";
        checks.forbidden("loads", &table.loads, why)?;
    }
    let loads = written.value.iter();
    let loads: Vec<_> = loads.map(|load| checks.holds("loads", load, POSITIVE)).collect();
    let loads = loads.into_iter().collect::<Option<Vec<f64>>>()?;
    if let Some(place) = (1..loads.len()).find(|&at| loads[at] <= loads[at - 1]) {
        let message = format!("`loads` holds {:?} after {:?}", loads[place], loads[place - 1]);
        let span = written.value[place].span.clone();
        checks.report("loads", Problem::new(message, span, "must ascend"));
        return None;
    }
    Some(loads)
}

fn over(name: &Written<String>, input: &Input, checks: &mut Checks) -> Option<String> {
    let usable = is_usable(&name.value, name, input, Some(Role::Parameter), checks);
    usable.then(|| name.value.clone())
}
