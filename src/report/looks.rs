//! One colour for each lower cutoff and one marker for each upper one, on every figure of a page.

use std::collections::BTreeMap;

use super::ensembles::Point;
use crate::figures::ink::Ink;
use crate::figures::style::{Dash, Marker, Style};
use crate::stages::columns::{K_LOWER, K_UPPER};

/// How the points of a study look.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Looks {
    /// What tells points apart, each coordinate with its values in ascending order.
    varying: Vec<(String, Vec<String>)>,
    /// The coordinate that the colour stands for.
    colour: Option<usize>,
    /// The coordinate that the marker stands for.
    marker: Option<usize>,
}

impl Looks {
    /// Looks that tell these points apart as well as colours and markers can.
    pub fn of<'a>(points: impl IntoIterator<Item = &'a Point>) -> Looks {
        let points: Vec<&Point> = points.into_iter().collect();
        let mut values: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        for name in points.iter().flat_map(|point| point.keys()) {
            values.entry(name).or_default();
        }
        for (name, known) in &mut values {
            for point in &points {
                let value = point.get(*name).cloned().unwrap_or_default();
                if !known.contains(&value) {
                    known.push(value);
                }
            }
            known.sort_by(|one, other| ascending(one, other));
        }
        let varying = values.into_iter().filter(|(_, values)| values.len() > 1);
        let varying = varying.map(|(name, values)| (name.to_owned(), values));
        let mut varying: Vec<_> = varying.collect();
        // Cutoffs name a spectrum before anything else does.
        let rank = |name: &str| match name {
            "k_lower" => 0,
            "k_upper" => 1,
            _ => 2,
        };
        varying.sort_by_key(|(name, _)| rank(name));
        let place = |wanted: &str| varying.iter().position(|(name, _)| name == wanted);
        let marker = place(K_UPPER.name);
        let colour = place(K_LOWER.name);
        let other = |taken: Option<usize>| (0..varying.len()).find(|&at| Some(at) != taken);
        let colour = colour.or_else(|| other(marker));
        let marker = marker
            .filter(|_| marker != colour)
            .or_else(|| other(colour));
        Looks {
            varying,
            colour,
            marker,
        }
    }

    /// What tells a point from the others: `k_lower 4 · k_upper 32`.
    pub fn label(&self, point: &Point) -> String {
        let parts = self.varying.iter().filter_map(|(name, _)| {
            let value = point.get(name)?;
            Some(format!("{name} {value}"))
        });
        let label = parts.collect::<Vec<_>>().join(" · ");
        match label.is_empty() {
            true => "mean of the surfaces".to_owned(),
            false => label,
        }
    }

    /// What the colour of a point stands for, if for anything: `k_lower 4`.
    pub fn label_of_colour(&self, point: &Point) -> Option<String> {
        let (name, _) = &self.varying[self.colour?];
        Some(format!("{name} {}", point.get(name)?))
    }

    /// The colour of a point.
    pub fn ink(&self, point: &Point) -> Ink {
        Ink::Series(self.place(self.colour, point))
    }

    /// Separate points in the colour and with the marker of a point of the study.
    pub fn markers(&self, point: &Point) -> Style {
        Style::marker(self.ink(point), Marker::of(self.place(self.marker, point)))
    }

    /// A thin line in the colour of a point of the study, to join its markers.
    pub fn joins(&self, point: &Point) -> Style {
        Style::line(self.ink(point), Dash::Solid, 1.0)
    }

    /// A line in the colour of a point of the study, its pattern for its marker.
    pub fn line(&self, point: &Point) -> Style {
        const DASHES: [Dash; 4] = [Dash::Solid, Dash::Dashed, Dash::DashDot, Dash::Dotted];
        let dash = DASHES[self.place(self.marker, point) % DASHES.len()];
        Style::line(self.ink(point), dash, 1.5)
    }

    fn place(&self, coordinate: Option<usize>, point: &Point) -> usize {
        let Some((name, values)) = coordinate.map(|at| &self.varying[at]) else {
            return 0;
        };
        let value = point.get(name).map_or("", String::as_str);
        values.iter().position(|known| known == value).unwrap_or(0)
    }
}

/// Numbers by size, anything else by the alphabet.
fn ascending(one: &str, other: &str) -> std::cmp::Ordering {
    match (one.parse::<f64>(), other.parse::<f64>()) {
        (Ok(one), Ok(other)) => one.total_cmp(&other),
        _ => one.cmp(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(k_lower: u32, k_upper: u32) -> Point {
        let entry = |name: &str, value: u32| (name.to_owned(), value.to_string());
        [
            entry("k_lower", k_lower),
            entry("k_upper", k_upper),
            entry("nodes", 256),
        ]
        .into()
    }

    #[test]
    fn a_colour_stands_for_a_lower_cutoff_and_a_marker_for_an_upper_one() {
        let points = [point(1, 32), point(1, 128), point(16, 32), point(4, 128)];
        let looks = Looks::of(&points);
        let inks = points.each_ref().map(|point| looks.ink(point));
        assert_eq!(inks, [0, 0, 2, 1].map(Ink::Series), "ascending by number");
        let markers = points.each_ref().map(|point| looks.markers(point).marker);
        assert_eq!(markers[0], markers[2]);
        assert_ne!(markers[0], markers[1]);
    }

    #[test]
    fn a_label_says_what_varies_and_nothing_else() {
        let looks = Looks::of(&[point(1, 32), point(16, 32)]);
        assert_eq!(looks.label(&point(16, 32)), "k_lower 16");
    }

    #[test]
    fn a_colour_has_a_name_of_its_own() {
        let points = [point(1, 32), point(1, 128), point(16, 32)];
        let looks = Looks::of(&points);
        assert_eq!(
            looks.label_of_colour(&points[1]).as_deref(),
            Some("k_lower 1")
        );
        assert_eq!(Looks::of(&points[..1]).label_of_colour(&points[0]), None);
    }

    #[test]
    fn where_no_cutoff_varies_something_else_has_the_colours() {
        let with = |hurst: &str| Point::from([("hurst".to_owned(), hurst.to_owned())]);
        let looks = Looks::of(&[with("0.3"), with("0.8")]);
        assert_ne!(looks.ink(&with("0.3")), looks.ink(&with("0.8")));
    }
}
