//! Entries of the legend of a declared or automatic figure.

use asperity_manifest::decimal;
use asperity_pipeline::study::figures::THIS_STUDY;
use asperity_stages::aggregate::Model;
use asperity_tables::column::Value;

use super::Plot;
use super::series_key::SeriesKey;
use crate::charts::chart::{Chart, Series};
use crate::charts::style::{Colour, Dash, Style};
use crate::figures::curves;
use crate::points::number as number_of;

impl Plot<'_> {
    /// Returns the text of a value in the legend and in titles of panels: its name in the manifest,
    /// or its symbol with the value.
    pub(super) fn told(&self, column: &str, value: Option<&Value>) -> String {
        let named = self.figure.legend.iter().find(|(entry, _)| self.is_entry(entry, value));
        named.map_or_else(
            || self.labels.told(column, value, &self.data.files),
            |(_, name)| name.clone(),
        )
    }

    /// Returns the name of an entry in the manifest, or `otherwise`.
    fn named(&self, entry: &str, otherwise: impl Into<String>) -> String {
        self.figure.legend.get(entry).cloned().unwrap_or_else(|| otherwise.into())
    }

    /// Returns the name of a theory in the legend.
    pub(super) fn name_of_theory(&self, model: Model) -> String {
        self.named(model.word(), curves::name(model))
    }

    /// Returns the labels of the entries in `legend_order`.
    pub(super) fn legend_order(&self, key: &SeriesKey) -> Vec<String> {
        let points = &self.drawings[0].points;
        let of_colours = points
            .colour
            .iter()
            .flat_map(|name| key.colours.iter().map(move |value| (name.as_str(), value.as_ref())));
        let others = key.further.iter().flat_map(|(values, _)| values);
        let of_others = others.map(|(name, value)| (name.as_str(), value.as_ref()));
        let values: Vec<_> = of_colours.chain(of_others).collect();
        let labels = self.figure.legend_order.iter().flat_map(|entry| {
            let is_named = |(_, value): &&(&str, Option<&Value>)| self.is_entry(entry, *value);
            let told = values.iter().filter(is_named).map(|(name, value)| self.told(name, *value));
            let model = Model::ALL.into_iter().find(|model| model.word() == entry);
            let own = match model {
                Some(model) => self.name_of_theory(model),
                None if entry == THIS_STUDY => self.named(entry, THIS_STUDY),
                None => self.named(entry, entry.replace('_', " ")),
            };
            // A curve has the label that the manifest gives it.
            told.chain([own, entry.clone()]).collect::<Vec<_>>()
        });
        labels.collect()
    }

    /// Returns a sentence about each name in `legend` that no chart shows.
    pub(super) fn unshown_names(&self, charts: &[Chart]) -> Vec<String> {
        let is_shown = |name: &String| {
            charts.iter().any(|chart| {
                let labels = chart.series.iter().filter_map(|series| series.label.as_ref());
                labels.chain([&chart.title]).any(|text| text.contains(name))
            })
        };
        let unshown = self.figure.legend.iter().filter(|(_, name)| !is_shown(name));
        let sentence =
            |entry| format!("`legend` renames {entry:?}, which the figure does not have.");
        unshown.map(|(entry, _)| sentence(entry)).collect()
    }

    /// Returns whether an entry of the legend, as the manifest names it, is this value.
    fn is_entry(&self, entry: &str, value: Option<&Value>) -> bool {
        match value {
            Some(Value::Text(text)) => {
                entry == text || self.data.files.get(text).is_some_and(|file| file == entry)
            }
            Some(number) => {
                let entry = entry.parse::<f64>().ok();
                entry
                    .zip(number_of(number))
                    .is_some_and(|(one, other)| decimal::is_same(one, other))
            }
            None => false,
        }
    }

    /// Adds the entries of the legend to the first chart, as series without points.
    pub(super) fn add_entries(&self, charts: &mut [Chart], key: &SeriesKey) {
        let points = &self.drawings[0].points;
        let colour_name = points.colour.as_deref().unwrap_or_default();
        let told_colour = |index: usize| {
            let value = key.colours[index].as_ref();
            (!colour_name.is_empty()).then(|| self.told(colour_name, value))
        };
        let told_further = |index: usize| {
            let (values, quantity) = &key.further[index];
            let values = values.iter().map(|(name, value)| self.told(name, value.as_ref()));
            let quantity = quantity.as_ref().map(|name| self.named(name, name.replace('_', " ")));
            values.chain(quantity).collect::<Vec<_>>().join(" · ")
        };
        let mut entries = Vec::new();
        let (colours, further) = (key.colours.len(), key.further.len());
        let has_scale = self.colour_scale(key).is_some();
        if key.is_crossed() {
            for index in 0..if has_scale { 0 } else { colours } {
                let line = Style::line(key.style(index, 0).colour, Dash::Solid, 3.0);
                entries.push((line, told_colour(index).unwrap_or_default()));
            }
            for index in 0..further {
                let style = Style { colour: Colour::Muted, ..key.style(0, index) };
                entries.push((style, told_further(index)));
            }
        } else if colours * further > 1 && !has_scale {
            for colour in 0..colours {
                for index in 0..further {
                    let parts = [told_colour(colour), (further > 1).then(|| told_further(index))];
                    let label: Vec<String> =
                        parts.into_iter().flatten().filter(|part| !part.is_empty()).collect();
                    entries.push((key.style(colour, index), label.join(" · ")));
                }
            }
        } else if colours * further == 1 && self.has_curves() {
            entries.push((key.style(0, 0), self.named(THIS_STUDY, THIS_STUDY)));
        }
        let Some(chart) = charts.first_mut() else { return };
        let entries = entries.into_iter();
        chart.series.extend(entries.map(|(style, label)| Series::new([], style).named(label)));
    }
}
