//! The text below a declared or automatic figure.

use std::collections::BTreeSet;

use arrow::array::Array;

use asperity_pipeline::study::figures::{
    BarSource, EndsMeaning, ErrorBars, Quantity, Value as Selected,
};
use asperity_stages::Kind;
use asperity_stages::columns::{AREA_FRACTION, EFFECTIVE_MODULUS, LOAD, PRESSURE};
use asperity_tables::column::Value;

use super::Plot;
use crate::points::distinct;
use crate::symbols::symbol;

impl Plot<'_> {
    pub(super) fn caption(&self, hidden: usize, unshown: Vec<String>) -> String {
        let mut sentences: Vec<String> =
            self.figure.caption.iter().cloned().chain(unshown).collect();
        let counts = self.points().filter_map(|point| point.surfaces);
        let counts: BTreeSet<usize> = counts.collect();
        let is_fit = self.stage.kind == Kind::Fit;
        sentences.extend(match (counts.first(), counts.last()) {
            (Some(least), Some(most)) if is_fit => Some(match (least == most, most) {
                (true, 1) => "Each point is fitted to one surface.".to_owned(),
                (true, _) => format!("Each point is fitted to {most} surfaces."),
                (false, _) => format!("Each point is fitted to {least} to {most} surfaces."),
            }),
            (Some(1), Some(1)) => Some("Each point is one surface, without an error.".to_owned()),
            (Some(least), Some(most)) if least == most => {
                Some(format!("Points are means over {most} surfaces."))
            }
            (Some(least), Some(most)) => {
                Some(format!("Points are means over {least} to {most} surfaces."))
            }
            _ => None,
        });
        let has_bars = self.points().any(|point| point.bar.is_some());
        sentences.extend(bars_of(self.drawings[0].quantity).filter(|_| has_bars));
        sentences.extend(self.moduli());
        sentences.extend(self.conditions().filter(|_| self.looks.is_none()));
        if hidden > 0 {
            sentences.push(format!(
                "{hidden} points at or below zero are missing, because the axis is logarithmic."
            ));
        }
        let unconverged = self.drawings[0].points.unconverged;
        if unconverged > 0 {
            sentences.push(format!("{unconverged} rows are loads that did not converge."));
        }
        let mut quantities = self.drawings.iter().map(|one| one.quantity);
        let is_counted = quantities.clone().any(|one| match &one.expression {
            Some(expression) => expression.columns().contains(AREA_FRACTION.name),
            None => one.column == AREA_FRACTION.name,
        });
        if self.looks.is_some() && is_counted && !self.data.mesh_error.is_empty() {
            sentences.push(self.data.mesh_error.clone());
        }
        let text = sentences.join(" ");
        let has_theories = self.has_curves() && quantities.any(Quantity::is_of_areas);
        if has_theories { text + &self.data.caveat } else { text }
    }

    /// Returns a sentence with E*, by which readers convert pressures to loads, if pressures are on
    /// the horizontal axis.
    fn moduli(&self) -> Option<String> {
        let shown = self.drawings.iter().find(|one| one.panel.x == PRESSURE.name)?;
        let column = shown.points.table.batch().column_by_name(EFFECTIVE_MODULUS.name)?.clone();
        let values = (0..column.len()).filter_map(|row| Value::from_array(column.as_ref(), row));
        let told: BTreeSet<String> = values
            .map(|value| self.labels.told(EFFECTIVE_MODULUS.name, Some(&value), &self.data.files))
            .collect();
        Some(format!("{}.", told.into_iter().collect::<Vec<_>>().join(", ")))
    }

    /// Returns a sentence with the selected values, and with the load if there is only one.
    fn conditions(&self) -> Option<String> {
        let selection = self.figure.selection.iter().map(|(name, values)| {
            let told = |value: Value| self.labels.told(name, Some(&value), &self.data.files);
            let values = values.iter().map(|value| match value {
                Selected::Number(number) => told(Value::Real(*number)),
                Selected::Word(word) => told(Value::Text(word.clone())),
                Selected::Range(range) => {
                    let given = [("from", range.from), ("to", range.to)]
                        .into_iter()
                        .filter(|(_, end)| end.is_finite())
                        .map(|(word, end)| {
                            let told = told(Value::Real(end));
                            format!("{word} {}", told.split_once(" = ").map_or(&*told, |of| of.1))
                        });
                    format!("{} {}", symbol(name), given.collect::<Vec<_>>().join(" "))
                }
            });
            values.collect::<Vec<_>>().join(" or ")
        });
        let mut parts: Vec<String> = selection.collect();
        let table = &self.drawings[0].points.table;
        for name in [LOAD.name, PRESSURE.name] {
            let is_told =
                self.figure.selection.contains_key(name) || self.drawings[0].panel.x == name;
            if table.has(name) && !is_told && distinct(table, name) == 1 {
                let column = table.batch().column_by_name(name)?;
                let value = Value::from_array(column.as_ref(), 0);
                parts.push(self.labels.told(name, value.as_ref(), &self.data.files));
                break;
            }
        }
        (!parts.is_empty()).then(|| format!("At {}.", parts.join(", ")))
    }
}

/// Returns the sentence on the error bars of a quantity.
fn bars_of(quantity: &Quantity) -> Option<String> {
    let meaning = match &quantity.bars {
        BarSource::None => return None,
        BarSource::Surfaces(kind) | BarSource::Half { meaning: kind, .. } => match kind {
            ErrorBars::Ci95 => "95 % confidence intervals of the means (Student's t)",
            ErrorBars::Sem => "standard errors of the means",
            ErrorBars::Sd => "standard deviations over the surfaces",
            ErrorBars::None => return None,
        },
        BarSource::Ends { meaning: EndsMeaning::OfFit, .. } => "intervals of the fits",
        BarSource::Ends { .. } | BarSource::Student { .. } => {
            "95 % confidence intervals of the means (Student's t)"
        }
    };
    Some(format!("Bars are {meaning}."))
}
