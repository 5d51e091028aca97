//! Columns of fits of limits.

use arrow::array::ArrayRef;

use crate::columns::{K_ROLLOFF, LOAD, columns, parameter, parameter_text, real};
use crate::fit::Params;
use crate::fit::fitted_point::{
    BOOTSTRAP, BOOTSTRAP_FAILED, CHI_SQUARE, DATA, Estimate, FitParameter, LAW, RMS_RESIDUAL,
    SURFACES, UNCONVERGED, names,
};
use crate::fit::limits::{FormChoice, LimitChoices, LimitRow, MAX_TERMS, Outcome, WORD};
use crate::fit::status::{self, FITTED, STATUS};
use asperity_tables::column::{Column, Role, integers, optional_reals, texts};
use asperity_tables::table::Table;

/// Unit of the columns whose unit is that of the observable.
pub const AS_QUANTITY: &str = "as `quantity`";

columns! {
    /// observable Q whose limit is fitted
    const QUANTITY: Column = parameter_text("quantity");
    /// k_rolloff/k_lower, the same at all points of the fit
    const ROLLOFF_RATIO: Column = parameter("rolloff_ratio", "1");
    /// Akaike's criterion χ² + 2 × number of free parameters; among forms for the same points, the
    /// smallest value is best
    const AKAIKE: Column = real("akaike", "1");
    /// Akaike weight: exp(−Δ/2) divided by its sum over all forms for the same points, where Δ is
    /// the difference of `akaike` from its smallest value
    const AKAIKE_WEIGHT: Column = real("akaike_weight", "1");
    /// fraction of the resamplings in which these forms have the smallest `akaike`
    const BEST_SHARE: Column = real("best_share", "1");
    /// root mean square error with which the other points predict each point, with the weights of
    /// the fit
    const LEAVE_ONE_OUT: Column = real("leave_one_out_error", AS_QUANTITY);
    /// limit Q₀ of the observable where all small parameters vanish. With a logarithmic term there
    /// is no limit, and Q₀ is the value where the small parameter of this term is 1
    const LIMIT: FitParameter =
        FitParameter::of_unit(AS_QUANTITY, names!("limit")).with_label("Q₀");
}

/// Columns of one term of the law.
struct TermColumns {
    small: Column,
    form: Column,
    coefficient: FitParameter,
    exponent: FitParameter,
}

macro_rules! term_columns {
    ($number:literal) => {
        TermColumns {
            small: parameter_text(concat!("term_", $number))
                .with_meaning(concat!("small parameter x of term ", $number)),
            form: parameter_text(concat!("form_", $number)).with_meaning(concat!(
                "form of term ",
                $number,
                ": `power E` with the given exponent E, `power, free` or `logarithm`"
            )),
            coefficient: FitParameter::of_unit(AS_QUANTITY, names!("coefficient_", $number))
                .with_meaning(concat!("coefficient c of term ", $number, ", c xᵉ or c ln x")),
            exponent: FitParameter::number(names!("exponent_", $number)).with_meaning(concat!(
                "exponent e of term ",
                $number,
                ", c xᵉ; a given exponent has no interval"
            )),
        }
    };
}

const TERMS: [TermColumns; MAX_TERMS] =
    [term_columns!("1"), term_columns!("2"), term_columns!("3"), term_columns!("4")];

/// Returns the parameters of laws with the maximum number of terms.
pub fn parameters() -> impl Iterator<Item = FitParameter> {
    let of_terms = TERMS.iter().flat_map(|term| [term.coefficient, term.exponent]);
    [LIMIT].into_iter().chain(of_terms)
}

/// Returns the columns that only this law has, without its fitted parameters.
pub fn columns() -> Vec<Column> {
    let of_terms = TERMS.iter().flat_map(|term| [term.small, term.form]);
    let first = [QUANTITY, ROLLOFF_RATIO].into_iter();
    let last = [AKAIKE, AKAIKE_WEIGHT, BEST_SHARE, LEAVE_ONE_OUT];
    first.chain(of_terms).chain(last).collect()
}

/// Creates the table of fits.
pub fn table(input: &Table, choices: &LimitChoices, params: &Params, lines: &[LimitRow]) -> Table {
    let mut columns = law_columns(input, choices, lines);
    columns.extend(estimates(choices, lines));
    columns.extend(quality(params, lines));
    let mut varied: Vec<&str> = choices.over.iter().map(String::as_str).collect();
    if columns.iter().any(|(column, _)| *column == ROLLOFF_RATIO) {
        varied.push(K_ROLLOFF.name);
    }
    // If the input is a table of fits, it has columns such as `law`, too.
    let own: Vec<&str> = columns.iter().map(|(column, _)| column.name).collect();
    let of_groups: Vec<usize> = lines.iter().map(|line| line.group.row).collect();
    let coordinates = input.in_role(Role::Parameter).without(&varied).without(&own);
    coordinates.pick(&of_groups).with(columns)
}

fn law_columns(
    input: &Table,
    choices: &LimitChoices,
    lines: &[LimitRow],
) -> Vec<(Column, ArrayRef)> {
    let count = lines.len();
    let text = |text: String| texts(vec![text; count]);
    let mut columns = vec![(LAW, text(WORD.to_owned())), (QUANTITY, text(choices.of.to_string()))];
    if input.has(LOAD.name) {
        columns.push((LOAD, optional_reals(lines.iter().map(|line| line.load))));
    }
    if choices.scales_rolloff(input) {
        let ratios = lines.iter().map(|line| line.group.rolloff_ratio);
        columns.push((ROLLOFF_RATIO, optional_reals(ratios)));
    }
    for (index, (term, own)) in choices.terms.iter().zip(&TERMS).enumerate() {
        columns.push((own.small, text(term.of.to_string())));
        let forms = lines.iter().map(|line| line.forms[index].word());
        columns.push((own.form, texts(forms)));
    }
    columns
}

fn estimates(choices: &LimitChoices, lines: &[LimitRow]) -> Vec<(Column, ArrayRef)> {
    let filled = |parameter: FitParameter, of: &dyn Fn(&LimitRow, &Outcome) -> Option<Estimate>| {
        parameter.filled(lines.iter().map(|line| of(line, line.outcome.as_ref().ok()?)))
    };
    let mut columns =
        filled(LIMIT, &|_, outcome| Some(outcome.estimate(outcome.fit.limit, Some(0)))).to_vec();
    for (term, own) in TERMS.iter().enumerate().take(choices.terms.len()) {
        columns.extend(filled(own.coefficient, &|_, outcome| {
            Some(outcome.estimate(outcome.fit.coefficients[term], Some(1 + term)))
        }));
        columns.extend(filled(own.exponent, &|line, outcome| {
            let is_free = |form: &&FormChoice| **form == FormChoice::FreePower;
            let before = line.forms[..term].iter().filter(is_free).count();
            let interval = 1 + line.forms.len() + before;
            let interval = (line.forms[term] == FormChoice::FreePower).then_some(interval);
            Some(outcome.estimate(outcome.fit.exponents[term]?, interval))
        }));
    }
    columns
}

impl Outcome {
    /// Returns an estimate with the interval at an index of `intervals`.
    fn estimate(&self, value: f64, index: Option<usize>) -> Estimate {
        let intervals = self.intervals.intervals.as_ref();
        let interval = intervals.zip(index).and_then(|(all, index)| all.get(index));
        Estimate { value, interval: interval.copied() }
    }
}

/// Returns the columns about the data, the quality, the comparison and the status of fits.
fn quality(params: &Params, lines: &[LimitRow]) -> Vec<(Column, ArrayRef)> {
    let real = |value: &dyn Fn(&Outcome) -> Option<f64>| {
        let of = |line: &LimitRow| value(line.outcome.as_ref().ok()?);
        optional_reals(lines.iter().map(of).collect::<Vec<_>>())
    };
    let whole = |value: &dyn Fn(&LimitRow) -> usize| {
        integers(lines.iter().map(|line| value(line) as i64).collect::<Vec<_>>())
    };
    let failed = |line: &LimitRow| {
        let outcome = line.outcome.as_ref();
        outcome.map_or(0, |outcome| outcome.intervals.failed)
    };
    let status = lines.iter().map(|line| match &line.outcome {
        Ok(_) => FITTED.word,
        Err(error) => status::from_error(error).word,
    });
    vec![
        (SURFACES, whole(&|line| line.surfaces)),
        (UNCONVERGED, whole(&|line| line.group.unconverged(line.load))),
        (DATA, whole(&|line| line.points)),
        (RMS_RESIDUAL, real(&|one| Some(one.assessment.rms_residual))),
        (CHI_SQUARE, real(&|one| Some(one.assessment.reduced_chi_square))),
        (AKAIKE, real(&|one| Some(one.assessment.akaike))),
        (AKAIKE_WEIGHT, real(&|one| Some(one.comparison.akaike_weight))),
        (BEST_SHARE, real(&|one| one.comparison.best_fraction)),
        (LEAVE_ONE_OUT, real(&|one| one.assessment.leave_one_out)),
        (BOOTSTRAP, integers(vec![i64::from(params.bootstrap); lines.len()])),
        (BOOTSTRAP_FAILED, whole(&failed)),
        (STATUS, texts(status)),
    ]
}
