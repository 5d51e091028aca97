//! Checks of the stages that measure, correct and fit.

use std::collections::BTreeMap;
use std::ops::Bound;
use std::sync::Arc;

use super::flow::Rows;
use crate::contact::morphology::correction::{PI_OVER_EIGHT, YASTREBOV_2017};
use crate::diagnostics::{Problem, Problems};
use crate::manifest::Form;
use crate::manifest::evaluate::{
    self, CorrectTable, Correction as WrittenCorrection, CorrectionWord, DEFAULT_BINS,
    DEFAULT_LEVEL, DEFAULT_RANGE, DEFAULT_RESAMPLINGS, EvolutionTable, KappaWord, LawTable,
    MOST_BINS, MOST_RESAMPLINGS, MeasureTable,
};
use crate::stages::correct::{self, AS_COUNTED, Correction, OF_2015, OF_2017};
use crate::stages::fit;
use crate::stages::fit::contact_evolution::{self, Datum, EvolutionChoices, Kappa};
use crate::stages::fit::laws::{Law, PlainLaw};
use crate::stages::measure;
use crate::written::Section;
use crate::written::checks::{Checks, NOT_NEGATIVE, POSITIVE, SHARE, report_equal_points};
use crate::written::{Key, Written};

/// What a measure stage measures, which follows from what it reads.
pub fn measurement(
    section: &Section<MeasureTable>,
    read: Option<Rows>,
    problems: &mut Problems,
) -> Option<measure::Params> {
    let point = section.points.first()?;
    let checks = &mut Checks::of(section, point, problems);
    let bins = checks.whole_or("bins", &point.table.bins, 1..=MOST_BINS, DEFAULT_BINS);
    let range = checks.number_or("range", &point.table.range, POSITIVE, DEFAULT_RANGE);
    if read? == Rows::Surfaces {
        let (bins, range) = (bins?, range?);
        let pool = point.table.pool.written().is_some_and(|pool| pool.value);
        return Some(match pool {
            true => measure::Params::Pool { bins, range },
            false => measure::Params::Heights { bins, range },
        });
    }
    let why = "for the heights of surfaces; this stage reads contacts";
    let bins = checks.forbidden("bins", &point.table.bins, why);
    checks.forbidden("range", &point.table.range, why)?;
    checks.forbidden("pool", &point.table.pool, why)?;
    bins.map(|()| measure::Params::Contacts)
}

/// The estimators of a correct stage.
pub fn corrections(
    section: &Section<CorrectTable>,
    problems: &mut Problems,
) -> Option<Arc<correct::Params>> {
    let point = section.points.first()?;
    let checks = &mut Checks::of(section, point, problems);
    let Some(written) = point.table.correction.written() else {
        let corrections = vec![known(CorrectionWord::Of2017)];
        return Some(Arc::new(correct::Params { corrections }));
    };
    if written.value.is_empty() {
        let label = "must name at least one estimator";
        let problem = Problem::new("`correction` is empty", written.span.clone(), label);
        checks.report("correction", problem);
        return None;
    }
    let corrections: Vec<_> = written
        .value
        .iter()
        .map(|entry| correction(entry, checks))
        .collect();
    let mut seen = BTreeMap::new();
    for (correction, written) in corrections.iter().zip(&written.value) {
        let Some(correction) = correction else {
            continue;
        };
        if let Some(before) = seen.insert(&correction.name, &written.span) {
            let message = format!("two corrections are called {:?}", correction.name);
            let problem = Problem::new(message, written.span.clone(), "here again")
                .and(before.clone(), "first here");
            checks
                .problems
                .push(problem.help("`{ name = \"…\", coefficient = … }` gives a name"));
        }
    }
    let corrections = corrections.into_iter().collect::<Option<_>>()?;
    Some(Arc::new(correct::Params { corrections }))
}

fn correction(written: &Written<WrittenCorrection>, checks: &mut Checks) -> Option<Correction> {
    let coefficients = (Bound::Included(0.0), Bound::Excluded(10.0));
    match &written.value {
        WrittenCorrection::Word(word) => Some(known(*word)),
        WrittenCorrection::Coefficient(value) => {
            let value = Written {
                value: *value,
                span: written.span.clone(),
            };
            let coefficient = checks.holds("correction", &value, coefficients)?;
            let name = coefficient.to_string();
            Some(Correction { name, coefficient })
        }
        WrittenCorrection::Named(named) => {
            let coefficient = checks.is_in("coefficient", &named.coefficient, coefficients);
            let name = &named.name.value;
            let words = [
                CorrectionWord::None,
                CorrectionWord::PiOver8,
                CorrectionWord::Of2017,
            ];
            let label = match words.map(known).iter().find(|known| known.name == *name) {
                Some(_) => "this name is taken by a known estimator",
                None if name.trim().is_empty() => "a name must not be empty",
                None if name.len() > crate::names::LONGEST => "too long",
                None => {
                    let name = name.clone();
                    return Some(Correction {
                        name,
                        coefficient: coefficient?,
                    });
                }
            };
            let message = format!("a correction cannot be called {name:?}");
            checks
                .problems
                .push(Problem::new(message, named.name.span.clone(), label));
            None
        }
    }
}

fn known(word: CorrectionWord) -> Correction {
    let (name, coefficient) = match word {
        CorrectionWord::None => (AS_COUNTED, 0.0),
        CorrectionWord::PiOver8 => (OF_2015, PI_OVER_EIGHT),
        CorrectionWord::Of2017 => (OF_2017, YASTREBOV_2017),
    };
    Correction {
        name: name.to_owned(),
        coefficient,
    }
}

/// The fits of the contact evolution law, point by point of the grid.
pub fn evolutions(
    section: &Section<EvolutionTable>,
    seed: u64,
    problems: &mut Problems,
) -> Option<Vec<Arc<fit::Params>>> {
    let mut fits = Vec::with_capacity(section.points.len());
    for point in &section.points {
        let checks = &mut Checks::of(section, point, problems);
        let table = &point.table;
        let to = match table.to.written().map(|to| to.value) {
            Some(evaluate::Datum::Area) => Datum::Area,
            Some(evaluate::Datum::Slope) | None => Datum::Slope,
        };
        let keys = CommonKeys {
            window: &table.window,
            bootstrap: &table.bootstrap,
            level: &table.level,
            seed: &table.seed,
        };
        let kappa = kappa(table, checks);
        let law = kappa.map(|kappa| Law::ContactEvolution(EvolutionChoices { to, kappa }));
        fits.push(fit(law, &keys, contact_evolution::WINDOW, seed, checks));
    }
    let fits = fits.into_iter().collect::<Option<Vec<_>>>()?;
    report_equal_points(section, fits.iter().map(Arc::as_ref), problems);
    Some(fits)
}

fn kappa(table: &EvolutionTable, checks: &mut Checks) -> Option<Kappa> {
    let Some(written) = table.kappa.written() else {
        return Some(Kappa::Free);
    };
    match written.value {
        evaluate::Kappa::Word(KappaWord::Free) => Some(Kappa::Free),
        evaluate::Kappa::Word(KappaWord::MinimalConvex) => Some(Kappa::MinimalConvex),
        evaluate::Kappa::Given(value) => {
            let span = written.span.clone();
            let value = checks.is_in("kappa", &Written { value, span }, POSITIVE)?;
            Some(Kappa::Given(value))
        }
    }
}

/// The fits of a law that has nothing to sweep.
pub fn laws(
    form: Form,
    section: &Section<LawTable>,
    seed: u64,
    problems: &mut Problems,
) -> Option<Vec<Arc<fit::Params>>> {
    let point = section.points.first()?;
    let table = &point.table;
    let keys = CommonKeys {
        window: &table.window,
        bootstrap: &table.bootstrap,
        level: &table.level,
        seed: &table.seed,
    };
    let law = match form {
        Form::ScaledErf => PlainLaw::ScaledErf,
        Form::LoadSeparation => PlainLaw::LoadSeparation,
        Form::MeshConvergence => PlainLaw::MeshConvergence,
        _ => PlainLaw::MeanPressure,
    };
    let window = law.definition().window;
    let checks = &mut Checks::of(section, point, problems);
    Some(vec![fit(
        Some(Law::Plain(law)),
        &keys,
        window,
        seed,
        checks,
    )?])
}

/// Keys that every law has.
struct CommonKeys<'a> {
    window: &'a Key<Vec<Written<f64>>>,
    bootstrap: &'a Key<i64>,
    level: &'a Key<f64>,
    seed: &'a Key<i64>,
}

fn fit(
    law: Option<Law>,
    keys: &CommonKeys,
    default_window: [f64; 2],
    study_seed: u64,
    checks: &mut Checks,
) -> Option<Arc<fit::Params>> {
    let window = window(keys.window, default_window, checks);
    let bootstrap = checks.whole_or(
        "bootstrap",
        keys.bootstrap,
        0..=MOST_RESAMPLINGS,
        DEFAULT_RESAMPLINGS,
    );
    let level = checks.number_or("level", keys.level, SHARE, DEFAULT_LEVEL);
    let seed = checks.whole_or("seed", keys.seed, 0..=i64::MAX as u64, study_seed);
    Some(Arc::new(fit::Params {
        law: law?,
        window: window?,
        bootstrap: bootstrap?,
        level: level?,
        seed: seed?,
    }))
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
