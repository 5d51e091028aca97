//! Checks of the theories beside the means.

use crate::aggregate::keys::{AggregateTable, ModelWord};
use crate::aggregate::{Model, OF_THE_SPECTRUM};
use asperity_manifest::diagnostics::{Problem, listed};
use asperity_manifest::written::Written;
use asperity_manifest::written::checks::Checks;
use asperity_tables::table::Table;

/// The theories beside the means; each needs rows with a load, and asperity models a spectrum.
pub fn models(
    table: &AggregateTable,
    input: Option<&Table>,
    checks: &mut Checks,
) -> Option<Vec<Model>> {
    let Some(written) = table.models.written() else {
        return Some(Vec::new());
    };
    let mut models = Vec::new();
    let mut clear = Some(());
    for Written { value, span } in &written.value {
        let model = model(*value);
        let mut report = |message: String, label: &str| {
            let problem = Problem::new(message, span.clone(), label);
            checks.problems.push(problem);
            clear = None;
        };
        if models.contains(&model) {
            report("`models` names one twice".to_owned(), "here again");
        }
        let wanted: &[&str] = match model.asperities() {
            Some(_) => &OF_THE_SPECTRUM,
            None => &[],
        };
        let is_read = |name: &str| input.is_none_or(|input| input.has(name));
        let is_grouped = |name: &str| {
            let names = |column: &Written<String>| {
                column.value == name || (name == "load" && column.value == "pressure")
            };
            let written = table.group_by.written();
            written.is_none_or(|list| list.value.iter().any(names))
        };
        let wanted = || wanted.iter().copied().chain(["load"]);
        if !wanted().all(is_read) {
            let missing = listed(wanted().filter(|name| !is_read(name)), "and");
            let message = format!("a model needs {missing}, which the input has not");
            report(message, "only for surfaces drawn from a spectrum, under loads");
        } else if !wanted().all(is_grouped) {
            let missing = listed(wanted().filter(|name| !is_grouped(name)), "and");
            let message = format!("a model needs {missing}, which `group_by` leaves out");
            report(message, "has one value per row only if these name the group");
        }
        models.push(model);
    }
    clear.map(|()| models)
}

fn model(word: ModelWord) -> Model {
    match word {
        ModelWord::Persson => Model::Persson,
        ModelWord::BushGibsonThomas => Model::BushGibsonThomas,
        ModelWord::Greenwood2006 => Model::Greenwood2006,
        ModelWord::MeanCurvature => Model::MeanCurvature,
        ModelWord::GreenwoodMccool => Model::GreenwoodMccool,
        ModelWord::BgtAsymptote => Model::BgtAsymptote,
        ModelWord::PennyCrack => Model::PennyCrack,
    }
}
