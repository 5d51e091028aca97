//! Fits of limits as rows of a table.

use arrow::array::ArrayRef;

use super::{Form, LimitChoices, Line, MOST_TERMS, Outcome, WORD};
use crate::columns::{K_ROLLOFF, LOAD, parameter, parameter_text, real};
use crate::fit::Params;
use crate::fit::rows::{
    BOOTSTRAP, BOOTSTRAP_FAILED, CHI_SQUARE, DATA, Estimate, LAW, Parameter, RMS_RESIDUAL, STATUS,
    SURFACES, UNCONVERGED, names,
};
use crate::fit::status::{self, FITTED};
use asperity_tables::column::{Column, Role, integers, optional_reals, texts};
use asperity_tables::table::Table;

const QUANTITY: Column = parameter_text("quantity", "the observable Q that has a limit");
const ROLLOFF_RATIO: Column =
    parameter("rolloff_ratio", "1", "k_rolloff over k_lower, the same at all points of the fit");
const AKAIKE: Column = real(
    "akaike",
    "1",
    "χ² + 2 × the number of free parameters: of several forms for the same points, less is better",
);
const AKAIKE_WEIGHT: Column = real(
    "akaike_weight",
    "1",
    "exp(−Δ/2) over the sum of all forms that were fitted to the same points, Δ the excess of `akaike` \
     over the least",
);
const BEST_SHARE: Column = real(
    "best_share",
    "1",
    "share of the resamplings in which these forms have the least `akaike` of all",
);
const LEAVE_ONE_OUT: Column = real(
    "leave_one_out_error",
    "as `quantity`",
    "root of the mean square error, weighted as the fit is, with which a point is predicted by the \
     others",
);
const LIMIT: Parameter = Parameter::of_unit(
    "as `quantity`",
    names!("limit"),
    "Q₀: the observable where all small numbers vanish; where a term is a logarithm there is no limit, \
     and it is the value at which that term's number is 1",
)
.called("Q₀");

/// The columns of one term.
struct OfTerm {
    small: Column,
    form: Column,
    coefficient: Parameter,
    exponent: Parameter,
}

macro_rules! of_term {
    ($number:literal) => {
        OfTerm {
            small: parameter_text(
                concat!("term_", $number),
                concat!("the number x that vanishes in term ", $number),
            ),
            form: parameter_text(
                concat!("form_", $number),
                concat!("what term ", $number, " is of its number: a power, or a logarithm"),
            ),
            coefficient: Parameter::of_unit(
                "as `quantity`",
                names!("coefficient_", $number),
                concat!("c of term ", $number, ", c xᵉ or c ln x"),
            ),
            exponent: Parameter::number(
                names!("exponent_", $number),
                concat!("e of term ", $number, ", c xᵉ; without interval where it is given"),
            ),
        }
    };
}

const TERMS: [OfTerm; MOST_TERMS] = [of_term!("1"), of_term!("2"), of_term!("3"), of_term!("4")];

/// The parameters of the law, whatever its terms.
pub fn parameters() -> impl Iterator<Item = Parameter> {
    let of_terms = TERMS.iter().flat_map(|term| [term.coefficient, term.exponent]);
    [LIMIT].into_iter().chain(of_terms)
}

/// What the table has beyond that of other laws, and beyond parameters.
pub fn columns() -> Vec<Column> {
    let of_terms = TERMS.iter().flat_map(|term| [term.small, term.form]);
    let first = [QUANTITY, ROLLOFF_RATIO].into_iter();
    let last = [AKAIKE, AKAIKE_WEIGHT, BEST_SHARE, LEAVE_ONE_OUT];
    first.chain(of_terms).chain(last).collect()
}

/// One row a fit: where it belongs, what was fitted, how well.
pub fn table(input: &Table, choices: &LimitChoices, params: &Params, lines: &[Line]) -> Table {
    let mut columns = placed(input, choices, lines);
    columns.extend(estimates(choices, lines));
    columns.extend(quality(params, lines));
    let mut varied: Vec<&str> = choices.over.iter().map(String::as_str).collect();
    if columns.iter().any(|(column, _)| *column == ROLLOFF_RATIO) {
        varied.push(K_ROLLOFF.name);
    }
    // What a fit has in common with the fit that it reads would have two columns of one name.
    let own: Vec<&str> = columns.iter().map(|(column, _)| column.name).collect();
    let standing: Vec<usize> = lines.iter().map(|line| line.group.row).collect();
    let place = input.in_role(Role::Parameter).without(&varied).without(&own);
    place.pick(&standing).with(columns)
}

fn placed(input: &Table, choices: &LimitChoices, lines: &[Line]) -> Vec<(Column, ArrayRef)> {
    let count = lines.len();
    let text = |text: String| texts(vec![text; count]);
    let mut columns = vec![(LAW, text(WORD.to_owned())), (QUANTITY, text(choices.of.to_string()))];
    if input.has(LOAD.name) {
        columns.push((LOAD, optional_reals(lines.iter().map(|line| line.load))));
    }
    if choices.goes_with_rolloff(input) {
        let ratios = lines.iter().map(|line| line.group.rolloff_ratio);
        columns.push((ROLLOFF_RATIO, optional_reals(ratios)));
    }
    for (place, (term, own)) in choices.terms.iter().zip(&TERMS).enumerate() {
        columns.push((own.small, text(term.of.to_string())));
        let forms = lines.iter().map(|line| line.forms[place].word());
        columns.push((own.form, texts(forms)));
    }
    columns
}

fn estimates(choices: &LimitChoices, lines: &[Line]) -> Vec<(Column, ArrayRef)> {
    let filled = |parameter: Parameter, of: &dyn Fn(&Line, &Outcome) -> Option<Estimate>| {
        parameter.filled(lines.iter().map(|line| of(line, line.outcome.as_ref().ok()?)))
    };
    let mut columns =
        filled(LIMIT, &|_, outcome| Some(outcome.estimate(outcome.fit.limit, Some(0)))).to_vec();
    for (term, own) in TERMS.iter().enumerate().take(choices.terms.len()) {
        columns.extend(filled(own.coefficient, &|_, outcome| {
            Some(outcome.estimate(outcome.fit.coefficients[term], Some(1 + term)))
        }));
        columns.extend(filled(own.exponent, &|line, outcome| {
            let is_free = |form: &&Form| **form == Form::FreePower;
            let before = line.forms[..term].iter().filter(is_free).count();
            let place = 1 + line.forms.len() + before;
            let place = (line.forms[term] == Form::FreePower).then_some(place);
            Some(outcome.estimate(outcome.fit.exponents[term]?, place))
        }));
    }
    columns
}

impl Outcome {
    /// An estimate with the interval at a place, if it has one.
    fn estimate(&self, value: f64, place: Option<usize>) -> Estimate {
        let intervals = self.intervals.intervals.as_ref();
        let interval = intervals.zip(place).and_then(|(all, place)| all.get(place));
        Estimate { value, interval: interval.copied() }
    }
}

/// How much was fitted, how well, how it compares, and how it went.
fn quality(params: &Params, lines: &[Line]) -> Vec<(Column, ArrayRef)> {
    let real = |value: &dyn Fn(&Outcome) -> Option<f64>| {
        let of = |line: &Line| value(line.outcome.as_ref().ok()?);
        optional_reals(lines.iter().map(of).collect::<Vec<_>>())
    };
    let whole = |value: &dyn Fn(&Line) -> usize| {
        integers(lines.iter().map(|line| value(line) as i64).collect::<Vec<_>>())
    };
    let failed = |line: &Line| {
        let outcome = line.outcome.as_ref();
        outcome.map_or(0, |outcome| outcome.intervals.failed)
    };
    let status = lines.iter().map(|line| match &line.outcome {
        Ok(_) => FITTED.word,
        Err(error) => status::of(error).word,
    });
    vec![
        (SURFACES, whole(&|line| line.surfaces)),
        (UNCONVERGED, whole(&|line| line.group.unconverged(line.load))),
        (DATA, whole(&|line| line.points)),
        (RMS_RESIDUAL, real(&|one| Some(one.judged.rms_residual))),
        (CHI_SQUARE, real(&|one| Some(one.judged.reduced_chi_square))),
        (AKAIKE, real(&|one| Some(one.judged.akaike))),
        (AKAIKE_WEIGHT, real(&|one| Some(one.comparison.akaike_weight))),
        (BEST_SHARE, real(&|one| one.comparison.best_share)),
        (LEAVE_ONE_OUT, real(&|one| one.judged.leave_one_out)),
        (BOOTSTRAP, integers(vec![i64::from(params.bootstrap); lines.len()])),
        (BOOTSTRAP_FAILED, whole(&failed)),
        (STATUS, texts(status)),
    ]
}
