//! Colours, markers and labels of parameter points, the same in all figures of a page.
//!
//! Colours stand for lower cutoffs and markers for upper cutoffs, or for other varying parameters.
//! If more than two parameters vary, every point has its own pair of colour and marker instead.
//! Labels contain the parameters that vary, and the file of a measured surface.

use std::collections::{BTreeMap, BTreeSet};

use crate::charts::style::{self, Colour, Dash, GRADIENT_STEPS, SERIES_COLOURS, Style};
use crate::ensembles::Point;
use crate::plotted::rank;
use crate::symbols::{Files, symbol};
use crate::units::{LengthUnit, Scaled, digits};
use asperity_stages::columns::{
    CONTENT, HARDNESS, HARDNESS_REDUCED, K_LOWER, K_UPPER, METHOD, NODES, NODES_X, NODES_Y,
    RMS_SLOPE,
};

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Styles {
    points: Vec<Point>,
    files: Files,
    /// Parameters that differ between points, each with the values in ascending order.
    varying: Vec<(String, Vec<String>)>,
    colour: Option<usize>,
    marker: Option<usize>,
    /// Combinations of the varying parameters in ascending order, as indices of their values, if
    /// more than two parameters vary.
    combinations: Vec<Vec<usize>>,
    lengths: Lengths,
}

/// Parameters that are lengths, and the unit in which labels state them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lengths {
    pub columns: BTreeSet<String>,
    pub shared: LengthUnit,
    /// Unit of the values of the points.
    pub own: Option<String>,
}

impl Lengths {
    /// Returns the value of a parameter as a person writes it.
    fn told(&self, name: &str, value: &str) -> String {
        let number = value.parse::<f64>().ok().filter(|_| self.columns.contains(name));
        let Some(number) = number.filter(|_| self.shared != LengthUnit::Unknown) else {
            return value.to_owned();
        };
        let length = self.shared.factor(self.own.as_deref()) * number;
        let Scaled { factor, unit } = self.shared.scaled(length.abs());
        format!("{} {unit}", digits(factor * length, 4))
    }
}

/// Parameters that follow from the file of a measured surface, and are not part of the label.
const FOLLOW_FROM_A_FILE: [&str; 5] =
    [CONTENT.name, NODES.name, NODES_X.name, NODES_Y.name, RMS_SLOPE.name];

impl Styles {
    /// Assigns colours and markers to these points.
    pub fn new<'a>(points: impl IntoIterator<Item = &'a Point>, files: &Files) -> Styles {
        let points: Vec<Point> = points.into_iter().cloned().collect();
        let mut values: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for name in points.iter().flat_map(|point| point.keys()) {
            values.entry(name.clone()).or_default();
        }
        for (name, known) in &mut values {
            for point in &points {
                let value = point.get(name).cloned().unwrap_or_default();
                if !known.contains(&value) {
                    known.push(value);
                }
            }
            let word = |value: &String| files.get(value).unwrap_or(value).clone();
            known.sort_by(|one, other| ascending(&word(one), &word(other)));
        }
        // Studies with a hardness in both units contain it twice.
        if values.contains_key(HARDNESS.name) {
            values.remove(HARDNESS_REDUCED.name);
        }
        let varying = values.into_iter().filter(|(_, values)| values.len() > 1);
        let mut varying: Vec<_> = varying.collect();
        // Cutoffs come first in the name of a spectrum, and what often follows from them last.
        let rank = |name: &str| match name {
            "k_lower" => 0,
            "k_upper" => 1,
            _ => 2 + rank(name),
        };
        varying.sort_by_key(|(name, _)| rank(name));
        varying.retain({
            let mut known: Vec<String> = Vec::new();
            let points = &points;
            move |(name, _)| {
                let is_new = is_independent(points, &known, name);
                if is_new {
                    known.push(name.clone());
                }
                is_new
            }
        });
        let index_of = |wanted: &str| varying.iter().position(|(name, _)| name == wanted);
        let marker = index_of(K_UPPER.name);
        let colour = index_of(K_LOWER.name);
        let other = |taken: Option<usize>| (0..varying.len()).find(|&at| Some(at) != taken);
        let colour = colour.or_else(|| other(marker));
        let marker = marker.filter(|_| marker != colour).or_else(|| other(colour));
        let (files, lengths) = (files.clone(), Lengths::default());
        let combinations = Vec::new();
        let mut styles = Styles { points, files, varying, colour, marker, combinations, lengths };
        if styles.varying.len() > 2 {
            let all = styles.points.iter().map(|point| styles.combination(point));
            let all: BTreeSet<Vec<usize>> = all.collect();
            styles.combinations = all.into_iter().collect();
        }
        styles
    }

    /// Returns the sentence on the meaning of colours and markers, or `None` if no parameter
    /// varies.
    pub fn meaning(&self) -> Option<String> {
        let name = |at: usize| &self.varying[at].0;
        match (self.colour, self.marker) {
            _ if !self.combinations.is_empty() => {
                Some("Every parameter point has its own colour and marker.".to_owned())
            }
            (Some(colour), Some(marker)) => Some(format!(
                "Colours stand for `{}` and markers for `{}`.",
                name(colour),
                name(marker)
            )),
            (Some(only), None) | (None, Some(only)) => {
                Some(format!("Colours or markers stand for `{}`.", name(only)))
            }
            (None, None) => None,
        }
    }

    /// Sets the unit of the parameters that are lengths.
    pub fn with_lengths(self, lengths: Lengths) -> Styles {
        Styles { lengths, ..self }
    }

    /// Returns the label of a point among the others: `k_lower 4 · k_upper 32`, or `wear.npy` for a
    /// measured surface. Returns `None` if there are no other points.
    pub fn label(&self, point: &Point) -> Option<String> {
        let file = self.file(point).map(str::to_owned);
        let parts = self.varying.iter().filter_map(|(name, _)| {
            let value = point.get(name)?;
            let follows = file.is_some() && FOLLOW_FROM_A_FILE.contains(&name.as_str());
            let told = || format!("{} {}", symbol(name), self.lengths.told(name, value));
            (!follows && self.tells_apart(name, point)).then(told)
        });
        let parts: Vec<String> = parts.collect();
        // The file is the same for all points.
        let is_common = self.files.len() == 1
            && self.points.iter().all(|one| self.file(one) == file.as_deref());
        let named = file.clone().filter(|_| parts.is_empty() || !is_common);
        let words: Vec<String> = named.into_iter().chain(parts).collect();
        let method = |of: &Point| of.get(METHOD.name).cloned();
        if words.is_empty() && self.points.iter().any(|other| method(other) != method(point)) {
            // Only the method distinguishes this surface from measured ones.
            return method(point).map(|method| format!("method {method}"));
        }
        (!words.is_empty()).then(|| words.join(" · "))
    }

    /// Returns the label of a point, or `alone` if there are no other points.
    pub fn name(&self, point: &Point, alone: &str) -> String {
        self.label(point).unwrap_or_else(|| alone.to_owned())
    }

    /// Returns the file name of a measured surface.
    fn file(&self, point: &Point) -> Option<&str> {
        self.files.get(point.get(CONTENT.name)?).map(String::as_str)
    }

    /// Returns true if the parameter `name` differs between this point and another point with the
    /// same file. Points without a file are compared with each other.
    fn tells_apart(&self, name: &str, point: &Point) -> bool {
        let alike = |other: &&Point| self.file(other) == self.file(point);
        let mut others = self.points.iter().filter(alike);
        others.any(|other| other.get(name) != point.get(name))
    }

    /// Returns the colour of a point. Lower cutoffs and words have distinct colours, other numbers
    /// and many values have ascending ones.
    pub fn colour(&self, point: &Point) -> Colour {
        const MOST: usize = 7;
        if let Some(own) = self.own_index(point) {
            return Colour::Series(own % SERIES_COLOURS);
        }
        let index = self.index(self.colour, point);
        let Some((name, values)) = self.colour.map(|at| &self.varying[at]) else {
            return Colour::Series(index);
        };
        let are_numbers = values.iter().all(|value| value.parse::<f64>().is_ok());
        if are_numbers && (name != K_LOWER.name || values.len() > MOST) {
            let last = (values.len() - 1) as f64;
            return Colour::Gradient((index as f64 / last * (GRADIENT_STEPS - 1) as f64) as usize);
        }
        Colour::Series(index)
    }

    /// Returns the style of separate markers for a point.
    pub fn markers(&self, point: &Point) -> Style {
        Style::marker(self.colour(point), style::marker(self.marker_index(point)))
    }

    /// Returns the style of the thin line that joins the markers of a point.
    pub fn joins(&self, point: &Point) -> Style {
        Style::line(self.colour(point), Dash::Solid, 1.0)
    }

    fn marker_index(&self, point: &Point) -> usize {
        self.own_index(point)
            .map_or_else(|| self.index(self.marker, point), |own| own / SERIES_COLOURS)
    }

    /// Returns the index of a point among all combinations of parameters, if more than two vary. A
    /// point without some of the parameters, such as a surface without the correction of its area,
    /// has the index of the first combination with its values.
    fn own_index(&self, point: &Point) -> Option<usize> {
        let own = self.combination(point);
        let is_same = |combination: &&Vec<usize>| {
            let mut parameters = self.varying.iter().zip(combination.iter().zip(&own));
            parameters.all(|((name, _), (one, other))| one == other || !point.contains_key(name))
        };
        self.combinations.iter().position(|combination| is_same(&combination))
    }

    fn combination(&self, point: &Point) -> Vec<usize> {
        (0..self.varying.len()).map(|at| self.index(Some(at), point)).collect()
    }

    fn index(&self, coordinate: Option<usize>, point: &Point) -> usize {
        let Some((name, values)) = coordinate.map(|at| &self.varying[at]) else {
            return 0;
        };
        let value = point.get(name).map_or("", String::as_str);
        values.iter().position(|known| known == value).unwrap_or(0)
    }
}

/// Returns whether a parameter differs between points that agree in all known parameters, or is one
/// of the cutoffs of a spectrum.
fn is_independent(points: &[Point], known: &[String], name: &str) -> bool {
    if [K_LOWER.name, K_UPPER.name].contains(&name) || known.is_empty() {
        return true;
    }
    let values = |point: &Point| -> Vec<Option<String>> {
        known.iter().map(|name| point.get(name).cloned()).collect()
    };
    let mut by_known: BTreeMap<Vec<Option<String>>, Option<&String>> = BTreeMap::new();
    points.iter().any(|point| {
        let value = point.get(name);
        *by_known.entry(values(point)).or_insert(value) != value
    })
}

/// Compares numbers by size, and other texts alphabetically.
pub fn ascending(one: &str, other: &str) -> std::cmp::Ordering {
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
        [entry("k_lower", k_lower), entry("k_upper", k_upper), entry("nodes", 256)].into()
    }

    #[test]
    fn a_colour_stands_for_a_lower_cutoff_and_a_marker_for_an_upper_one() {
        let points = [point(1, 32), point(1, 128), point(16, 32), point(4, 128)];
        let styles = Styles::new(&points, &Files::new());
        let colours = points.each_ref().map(|point| styles.colour(point));
        assert_eq!(colours, [0, 0, 2, 1].map(Colour::Series), "ascending by number");
        let markers = points.each_ref().map(|point| styles.markers(point).marker);
        assert_eq!(markers[0], markers[2]);
        assert_ne!(markers[0], markers[1]);
    }

    #[test]
    fn a_label_says_what_varies_and_nothing_else() {
        let styles = Styles::new(&[point(1, 32), point(16, 32)], &Files::new());
        assert_eq!(styles.label(&point(16, 32)).as_deref(), Some("k_lower 16"));
        let alone = Styles::new(&[point(1, 32)], &Files::new());
        assert_eq!(alone.label(&point(1, 32)), None);
        // A surface has fewer coordinates than its contacts, and also has no label.
        let mut surface = point(1, 32);
        surface.remove("nodes");
        assert_eq!(alone.label(&surface), None);
    }

    #[test]
    fn a_measured_surface_is_called_by_its_file() {
        let point = |entries: &[(&str, &str)]| -> Point {
            let entries = entries.iter();
            entries.map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect()
        };
        let of_file = |content, slope, edges| {
            let method = ("method", "file");
            point(&[method, ("content", content), ("rms_slope", slope), ("edges", edges)])
        };
        let [worn, new] = [("c1", "4.751345830974993"), ("c0", "0.2")]
            .map(|(content, slope)| of_file(content, slope, "mirror"));
        let files: Files = [("c1", "worn.npy"), ("c0", "new.npy")]
            .map(|(content, file)| (content.to_owned(), file.to_owned()))
            .into();
        let label = |points: &[Point], point: &Point| Styles::new(points, &files).label(point);
        let both = [worn.clone(), new.clone()];
        assert_eq!(label(&both, &worn).as_deref(), Some("worn.npy"));
        assert_eq!(label(&both[..1], &worn).as_deref(), Some("worn.npy"));
        // Colours follow the order of names, not of hashes.
        let styles = Styles::new(&both, &files);
        assert_eq!([&new, &worn].map(|point| styles.colour(point)), [0, 1].map(Colour::Series));
        // A file that is read twice has the difference in its label.
        let faded = of_file("c1", "4.2", "taper");
        let thrice = [worn.clone(), new.clone(), faded.clone()];
        assert_eq!(label(&thrice, &faded).as_deref(), Some("worn.npy · edges taper"));
        assert_eq!(label(&thrice, &new).as_deref(), Some("new.npy"));
        // A random surface does not add its parameters to the labels of files.
        let random = point(&[("k_lower", "4"), ("rms_slope", "0.02"), ("method", "filter")]);
        let mixed = [worn.clone(), random.clone()];
        assert_eq!(label(&mixed, &worn).as_deref(), Some("worn.npy"));
        assert_eq!(label(&mixed, &random).as_deref(), Some("method filter"));
    }

    #[test]
    fn points_of_three_varying_parameters_do_not_look_alike() {
        let points = [0.2, 0.4, 0.6, 0.8].map(|hurst: f64| {
            [point(1, 8), point(1, 16), point(2, 8), point(2, 16)].map(|mut point| {
                point.insert("hurst".to_owned(), hurst.to_string());
                point
            })
        });
        let points = points.concat();
        let styles = Styles::new(&points, &Files::new());
        let looks: Vec<Style> = points.iter().map(|point| styles.markers(point)).collect();
        for (index, look) in looks.iter().enumerate() {
            assert!(!looks[..index].contains(look));
        }
        // A surface has fewer coordinates than its contacts.
        let mut surface = points[5].clone();
        surface.remove("nodes");
        assert_eq!(styles.markers(&surface), looks[5]);
    }

    #[test]
    fn where_no_cutoff_varies_something_else_has_the_colours() {
        let with = |hurst: &str| Point::from([("hurst".to_owned(), hurst.to_owned())]);
        let styles = Styles::new(&[with("0.3"), with("0.8")], &Files::new());
        assert_ne!(styles.colour(&with("0.3")), styles.colour(&with("0.8")));
    }
}
