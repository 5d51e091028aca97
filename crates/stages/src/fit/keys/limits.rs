//! Keys of `fit` stages with `law = "limits"`. Their doc comments are shown by editors and quoted
//! in messages.

use std::collections::BTreeSet;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::check_context::{StageChecks, exclude};
use crate::columns::{LOAD, SURFACE};
use crate::fit::keys::{DEFAULT_LEVEL, DEFAULT_RESAMPLINGS, MAX_RESAMPLINGS, fits};
use crate::fit::laws::Law;
use crate::fit::limits::{FormChoice, LimitChoices, MAX_COMBINATIONS, MAX_TERMS, Term, WINDOW};
use crate::stage_points::{StagePoints, Work};
use crate::{CheckContext, Reads, RowKind};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, listed};
use asperity_manifest::expression::Expression;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::{list, positive_items, required, swept};
use asperity_manifest::keys::{Key, Section, Spanned, table};
use asperity_statistics::limits::EXPONENTS;
use asperity_tables::column::Role;

/// Fits Q = Q₀ + Σ cⱼ fⱼ(xⱼ): the limit of an observable where small parameters vanish.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LimitTable {
    /// Observable Q of one surface under one load: a column or an expression in columns, such as
    /// `"mean_gap"`, `"area_corrected / load"` or `"-1 / slope(mean_gap)"` (from neighbouring
    /// loads). If the stage reads fits, Q is a fitted parameter, used with its standard error.
    #[schemars(transform = swept, transform = required)]
    pub of: Key<String>,
    /// Small parameters, and how the observable depends on them:
    /// `[{ of = "1 / k_lower", exponent = 1 }, …]`.
    #[schemars(length(min = 1, max = MAX_TERMS), transform = list, transform = required)]
    pub terms: Key<Vec<Spanned<TermTable>>>,
    /// Loads at which the observable is fitted, in units of E* × rms slope, ascending. The default
    /// is all loads of the `window`.
    #[schemars(transform = positive_items, transform = list)]
    pub loads: Key<Vec<Spanned<f64>>>,
    /// Parameters that vary among the points of one fit, in addition to those in the terms. If
    /// `k_rolloff` is the same multiple of `k_lower` at all points, it varies with `k_lower`.
    #[schemars(transform = list)]
    pub over: Key<Vec<Spanned<String>>>,
    /// Smallest and largest load that enter the fit without `loads`, in units of E* × rms slope.
    #[schemars(inner(range(min = 0)), extend("default" = WINDOW))]
    pub window: Key<[f64; 2]>,
    /// Number of bootstrap samples of whole surfaces for the intervals, with the same realizations
    /// at all points; 0 gives no intervals.
    #[schemars(range(min = 0, max = MAX_RESAMPLINGS), extend("default" = DEFAULT_RESAMPLINGS))]
    pub bootstrap: Key<u32>,
    /// Probability that an interval covers its parameter.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "default" = DEFAULT_LEVEL))]
    pub level: Key<f64>,
    /// Seed of the bootstrap; the default is the seed of the study.
    #[schemars(range(min = 0))]
    pub seed: Key<u64>,
}

table!(LimitTable);

/// A term of the law, with its small parameter.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TermTable {
    /// Small parameter: an expression in parameters, such as `"k_lower / k_upper"`.
    pub of: Spanned<String>,
    /// Dependence on the small parameter: `"power"` or `"logarithm"`. With a list of both, both are
    /// fitted and compared.
    #[serde(default)]
    #[schemars(extend("default" = "power"))]
    pub form: Key<OneOrMore<FormWord>>,
    /// Exponent of the power: a number or `"free"`. With a list, all entries are fitted and
    /// compared.
    #[serde(default)]
    #[schemars(extend("default" = "free"))]
    pub exponent: Key<OneOrMore<WrittenExponent>>,
}

/// One value, or a list of values that are all fitted and compared.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum OneOrMore<T> {
    /// A single value that is fitted.
    One(T),
    /// Several values that are fitted and compared.
    More(Vec<T>),
}

impl<T: Copy> OneOrMore<T> {
    /// Returns all values as a list.
    pub fn all(&self) -> Vec<T> {
        match self {
            OneOrMore::One(one) => vec![*one],
            OneOrMore::More(more) => more.clone(),
        }
    }
}

/// The dependence of an observable on a small parameter x.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FormWord {
    /// Term c xᵉ with an exponent e.
    Power,
    /// Term c ln x. The observable then has no limit, and `limit` is its value at x = 1.
    Logarithm,
}

/// The exponent of a power.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum WrittenExponent {
    /// The exponent is fitted like the coefficients.
    Free,
    /// The exponent has this value.
    #[serde(untagged)]
    Given(#[schemars(extend("minimum" = EXPONENTS[0], "maximum" = EXPONENTS[1]))] f64),
}

impl StagePoints for Section<LimitTable> {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        fits(self, None, context, |table, checks| {
            Some(Law::Limits(Arc::new(choices(table, checks)?)))
        })
    }

    /// Returns the kinds of rows with one value per surface, and the kinds of fitted rows.
    fn reads(&self) -> Option<Reads> {
        Some(Reads {
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
            from: "`generate`, `solve`, `measure`, `correct`, other `fit` stages and `aggregate` \
                   stages with `sql`, where its law is `limits`"
                .into(),
        })
    }
}

fn choices(table: &LimitTable, checks: &mut StageChecks) -> Option<LimitChoices> {
    let written = checks.required("of", &table.of);
    let of = written.and_then(|of| Some((of, observable(of, checks)?)));
    let error = of.as_ref().and_then(|(written, of)| error(written, of, checks));
    let terms = terms(table, checks);
    let loads = loads(table, checks);
    let named: BTreeSet<String> =
        terms.iter().flatten().flat_map(|term| term.of.columns()).map(str::to_owned).collect();
    let over = match checks.optional("over", &table.over)? {
        Some(written) => {
            let names: Vec<_> = written.value.iter().map(|name| over(name, checks)).collect();
            let given: Option<BTreeSet<String>> = names.into_iter().collect();
            given.map(|given| given.union(&named).cloned().collect())
        }
        None => Some(named),
    };
    Some(LimitChoices { of: of?.1, loads: loads?, terms: terms?, over: over?, error: error? })
}

/// Parses an expression in columns of the input, which must have the role if one is given.
fn expression(
    written: &Spanned<String>,
    role: Option<Role>,
    checks: &mut StageChecks,
) -> Option<Expression> {
    let read = match Expression::parse(&written.value) {
        Ok(read) => read,
        Err(error) => {
            let message = format!("cannot read the expression {:?}", written.value);
            let span = error.span_in(&written.value, &written.span);
            let problem = Problem::new(message, span, error.reason);
            checks.problems.push(problem.help(
                "an expression has columns, numbers, `+ - * / ^`, parentheses, `ln(…)`, `sqrt(…)` \
                 and `slope(…)`",
            ));
            return None;
        }
    };
    let named: Vec<bool> =
        read.columns().into_iter().map(|name| is_usable(name, written, role, checks)).collect();
    named.into_iter().all(|usable| usable).then_some(read)
}

/// Returns whether a column exists, holds numbers and has the role. Reports a problem if not.
fn is_usable(
    name: &str,
    written: &Spanned<String>,
    role: Option<Role>,
    checks: &mut StageChecks,
) -> bool {
    let Some(table) = checks.input else {
        return true;
    };
    let problem = if !table.has(name) {
        let fields = table.batch().schema_ref().fields().iter();
        let usable = fields.filter(|field| role.is_none() || Role::from_field(field) == role);
        let names: Vec<&str> = usable.map(|field| field.name().as_str()).collect();
        checks.unknown_column(name, &written.span, &names)
    } else if table.reals(name).is_err() && table.integers(name).is_err() {
        let message = format!("the column {name:?} holds no numbers");
        Problem::new(message, written.span.clone(), "must be a column of numbers")
    } else if role.is_some() && !table.in_role(Role::Parameter).has(name) {
        let parameters = table.in_role(Role::Parameter);
        let message = format!("{name:?} differs between surfaces or loads of a parameter point");
        let label = "must be a parameter, equal for all surfaces of a spectrum";
        Problem::new(message, written.span.clone(), label)
            .help(format!("the parameters are {}", listed(parameters.names(), "and")))
    } else {
        return true;
    };
    checks.problems.push(problem);
    false
}

fn observable(of: &Spanned<String>, checks: &mut StageChecks) -> Option<Expression> {
    let read = expression(of, None, checks)?;
    let lacks_surfaces = checks.input.is_some_and(|table| !table.has(SURFACE.name));
    if checks.read == Some(RowKind::Statistics) && lacks_surfaces {
        let message = "the rows of the `aggregate` stage in `from` do not describe single surfaces";
        let label = "needs the values of every surface";
        let problem = Problem::new(message, of.span.clone(), label);
        checks.problems.push(problem.help(
            "select `surface`, `seed`, `realization` and every parameter in its `sql`, as in \
             `select area.*, surfaces.rms_height from area join surfaces using (surface)`",
        ));
        return None;
    }
    let lacks_loads = checks.input.is_some_and(|table| !table.has(LOAD.name));
    if read.has_slope() && (lacks_loads || checks.read == Some(RowKind::Fits)) {
        let message =
            "`slope` is the derivative with respect to `load`, which these rows do not have";
        let label = "needs rows of surfaces under loads";
        return checks.refuse("of", message, &of.span, label);
    }
    Some(read)
}

/// Returns the column with the standard error of the observable, or `Some(None)` if the stage does
/// not read fits. Reports a problem and returns `None` if the observable is not a fitted parameter.
fn error(
    written: &Spanned<String>,
    of: &Expression,
    checks: &mut StageChecks,
) -> Option<Option<String>> {
    if checks.read != Some(RowKind::Fits) {
        return Some(None);
    }
    let column = match of {
        Expression::Column(name) => Some(format!("{name}_standard_error")),
        _ => None,
    };
    let known = |column: &String| checks.input.is_none_or(|table| table.has(column));
    if let Some(column) = column.filter(known) {
        return Some(Some(column));
    }
    let message = format!("the fits have no standard error of {:?}", written.value);
    let label = "must be the name of a fitted parameter, not an expression";
    checks.refuse("of", message, &written.span, label)
}

fn terms(table: &LimitTable, checks: &mut StageChecks) -> Option<Vec<Term>> {
    let written = checks.required("terms", &table.terms)?;
    let checked: Vec<Option<Term>> =
        written.value.iter().map(|term| self::term(term, checks)).collect();
    let terms = checked.into_iter().collect::<Option<Vec<Term>>>()?;
    let combinations: usize = terms.iter().map(|term| term.forms.len()).product();
    if combinations > MAX_COMBINATIONS {
        let message = format!("the forms of the terms have {combinations} combinations");
        let label = format!("the maximum is {MAX_COMBINATIONS}");
        return checks.refuse("terms", message, &written.span, label);
    }
    Some(terms)
}

fn term(written: &Spanned<TermTable>, checks: &mut StageChecks) -> Option<Term> {
    let table = &written.value;
    let of = expression(&table.of, Some(Role::Parameter), checks);
    if of.as_ref().is_some_and(|of| of.columns().is_empty() || of.has_slope()) {
        let message = format!("{:?} is the same at all points", table.of.value);
        let label = "must name a parameter that varies";
        return checks.refuse("terms", message, &table.of.span, label);
    }
    let given = table.form.written().map(|form| form.value.all());
    let words = given.unwrap_or_else(|| vec![checks.default_of("terms.form")]);
    let mut forms = Vec::new();
    for word in words {
        match word {
            FormWord::Logarithm => forms.push(FormChoice::Logarithm),
            FormWord::Power => forms.extend(powers(table, checks)),
        }
    }
    let repeated = (1..forms.len()).any(|index| forms[..index].contains(&forms[index]));
    if forms.is_empty() || repeated {
        let (message, label) = if repeated {
            ("a term has the same form twice", "repeats a form")
        } else {
            ("a term has no form", "must have at least one form, and a power an exponent")
        };
        return checks.refuse("terms", message, &written.span, label);
    }
    Some(Term { of: of?, forms })
}

/// Returns the powers among the forms of a term.
fn powers(table: &TermTable, checks: &Checks) -> Vec<FormChoice> {
    let given = table.exponent.written().map(|exponent| exponent.value.all());
    let exponents = given.unwrap_or_else(|| vec![checks.default_of("terms.exponent")]);
    let form = |exponent| match exponent {
        WrittenExponent::Free => FormChoice::FreePower,
        WrittenExponent::Given(value) => FormChoice::Power(decimal::nearest(value)),
    };
    exponents.into_iter().map(form).collect()
}

fn loads(table: &LimitTable, checks: &mut StageChecks) -> Option<Vec<f64>> {
    let Some(written) = checks.optional("loads", &table.loads)? else {
        return Some(Vec::new());
    };
    if checks.input.is_some_and(|table| !table.has(LOAD.name)) {
        exclude! { table, checks, true => loads: "the rows that the stage reads have no load"; }?;
    }
    let loads: Vec<f64> = written.value.iter().map(|load| decimal::nearest(load.value)).collect();
    if let Some(index) = (1..loads.len()).find(|&index| loads[index] <= loads[index - 1]) {
        let message = format!("`loads` holds {:?} after {:?}", loads[index], loads[index - 1]);
        return checks.refuse("loads", message, &written.value[index].span, "must ascend");
    }
    Some(loads)
}

fn over(name: &Spanned<String>, checks: &mut StageChecks) -> Option<String> {
    let usable = is_usable(&name.value, name, Some(Role::Parameter), checks);
    usable.then(|| name.value.clone())
}
