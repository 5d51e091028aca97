//! Colours, markers and labels of parameter points, the same in all figures of a page.
//!
//! Colours stand for lower cutoffs and markers for upper cutoffs, or for other varying parameters.
//! If more than two parameters vary, every point has its own pair of colour and marker instead.
//! Labels contain the parameters that vary, and the file of a measured surface.

use std::collections::{BTreeMap, BTreeSet};

use crate::charts::style::{self, Colour, GRADIENT_STEPS, SERIES_COLOURS, Style};
use crate::points::{FORM, Point, number, rank, text};
use crate::symbols::{Files, symbol};
use crate::units::Unit;
use asperity_stages::columns::{
    CONTENT, HARDNESS, HARDNESS_REDUCED, K_LOWER, K_UPPER, METHOD, NODES, NODES_X, NODES_Y,
    RMS_SLOPE,
};
use asperity_tables::column::Value;

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Styles {
    points: Vec<Point>,
    files: Files,
    /// Parameters that differ between points, each with the values in ascending order.
    varying: Vec<(String, Vec<Option<Value>>)>,
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
    pub shared: Unit,
    /// Unit of the values of the points.
    pub own: Option<String>,
}

impl Lengths {
    /// Returns the value of a parameter as a person writes it.
    fn told(&self, name: &str, value: &Value) -> String {
        match number(value) {
            Some(number) if self.columns.contains(name) && self.shared.name().is_some() => {
                self.shared.text(self.shared.factor(self.own.as_deref()) * number, 4)
            }
            _ => value.to_string(),
        }
    }
}

/// Parameters that follow from the file of a measured surface, and are not part of the label.
const FOLLOW_FROM_A_FILE: [&str; 5] =
    [CONTENT.name, NODES.name, NODES_X.name, NODES_Y.name, RMS_SLOPE.name];

impl Styles {
    /// Assigns colours and markers to these points.
    pub fn new(points: &[Point], files: &Files) -> Styles {
        let mut values: BTreeMap<String, BTreeSet<Option<Value>>> = BTreeMap::new();
        for (name, _) in points.iter().flat_map(Point::iter) {
            values.entry(name.to_owned()).or_default();
        }
        for (name, known) in &mut values {
            known.extend(points.iter().map(|point| point.get(name).cloned()));
        }
        // Studies with a hardness in both units contain it twice.
        if values.contains_key(HARDNESS.name) {
            values.remove(HARDNESS_REDUCED.name);
        }
        let file_name = |value: &Option<Value>| match value {
            Some(Value::Text(text)) => files.get(text).cloned().map(Value::Text),
            _ => None,
        };
        let sorted = |(name, values): (String, BTreeSet<Option<Value>>)| {
            let mut ascending: Vec<Option<Value>> = values.into_iter().collect();
            // Colours follow the order of the names of files, not of hashes.
            ascending.sort_by_cached_key(|value| file_name(value).or_else(|| value.clone()));
            (name, ascending)
        };
        let several = values.into_iter().filter(|(_, values)| values.len() > 1);
        let mut varying: Vec<_> = several.map(sorted).collect();
        // Cutoffs come first in the name of a spectrum, and what often follows from them last.
        let rank = |name: &str| match name {
            "k_lower" => 0,
            "k_upper" => 1,
            _ => 2 + rank(name),
        };
        varying.sort_by_key(|(name, _)| rank(name));
        varying.retain({
            let mut known: Vec<String> = Vec::new();
            move |(name, _)| {
                let is_new = is_independent(points, &known, name);
                if is_new {
                    known.push(name.clone());
                }
                is_new
            }
        });
        let index_of = |wanted: &str| varying.iter().position(|(name, _)| name == wanted);
        let other = |taken: Option<usize>| (0..varying.len()).find(|&at| Some(at) != taken);
        let upper = index_of(K_UPPER.name);
        let colour = index_of(K_LOWER.name).or_else(|| other(upper));
        let marker = upper.filter(|_| upper != colour).or_else(|| other(colour));
        let mut styles = Styles {
            points: points.to_vec(),
            files: files.clone(),
            varying,
            colour,
            marker,
            ..Styles::default()
        };
        if styles.varying.len() > 2 {
            let all: BTreeSet<Vec<usize>> =
                styles.points.iter().map(|point| styles.combination(point)).collect();
            styles.combinations = all.into_iter().collect();
        }
        styles
    }

    /// Sets the unit of the parameters that are lengths.
    pub fn with_lengths(self, lengths: Lengths) -> Styles {
        Styles { lengths, ..self }
    }

    /// Returns the label of a point among the others: `k_lower 4 · k_upper 32`, or `wear.npy` for a
    /// measured surface. Returns `None` if there are no other points.
    pub fn label(&self, point: &Point) -> Option<String> {
        let file = self.file(point).map(str::to_owned);
        let told = |(name, _): &(String, Vec<_>)| {
            let value = point.get(name)?;
            let follows = file.is_some() && FOLLOW_FROM_A_FILE.contains(&name.as_str());
            let told = || match name.starts_with(FORM) {
                true => value.to_string(),
                false => format!("{} {}", symbol(name), self.lengths.told(name, value)),
            };
            (!follows && self.tells_apart(name, point)).then(told)
        };
        let parts: Vec<String> = self.varying.iter().filter_map(told).collect();
        // The file is the same for all points.
        let is_common = self.files.len() == 1
            && self.points.iter().all(|one| self.file(one) == file.as_deref());
        let named = file.clone().filter(|_| parts.is_empty() || !is_common);
        let words: Vec<String> = named.into_iter().chain(parts).collect();
        let method = |of: &Point| text(of, METHOD.name).map(str::to_owned);
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
        self.files.get(text(point, CONTENT.name)?).map(String::as_str)
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
        let are_numbers = values.iter().all(|value| value.as_ref().and_then(number).is_some());
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
            parameters.all(|((name, _), (one, other))| one == other || point.get(name).is_none())
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
        values.iter().position(|known| known.as_ref() == point.get(name)).unwrap_or(0)
    }
}

/// Returns whether a parameter differs between points that agree in all known parameters, or is one
/// of the cutoffs of a spectrum.
fn is_independent(points: &[Point], known: &[String], name: &str) -> bool {
    if [K_LOWER.name, K_UPPER.name].contains(&name) || known.is_empty() {
        return true;
    }
    let mut by_known: BTreeMap<Vec<Option<&Value>>, Option<&Value>> = BTreeMap::new();
    points.iter().any(|point| {
        let values = known.iter().map(|name| point.get(name)).collect();
        let value = point.get(name);
        *by_known.entry(values).or_insert(value) != value
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    use asperity_stages::columns::{EDGES, HURST};

    fn of_exponent(hurst: f64) -> Point {
        Point::from_cells([(HURST, Value::Real(hurst))])
    }

    fn point(k_lower: i64, k_upper: i64) -> Point {
        let cells = [(K_LOWER, k_lower), (K_UPPER, k_upper), (NODES, 256)];
        Point::from_cells(cells.map(|(column, value)| (column, Value::Integer(value))))
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
        let surface = point(1, 32).without(&["nodes"]);
        assert_eq!(alone.label(&surface), None);
    }

    #[test]
    fn a_measured_surface_is_called_by_its_file() {
        let of_file = |content: &str, slope: f64, edges: &str| {
            let texts = [(METHOD, "file"), (CONTENT, content), (EDGES, edges)];
            let texts = texts.map(|(column, text)| (column, Value::Text(text.to_owned())));
            Point::from_cells(texts.into_iter().chain([(RMS_SLOPE, Value::Real(slope))]))
        };
        let [worn, new] = [("c1", 4.751345830974993), ("c0", 0.2)]
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
        let faded = of_file("c1", 4.2, "taper");
        let thrice = [worn.clone(), new.clone(), faded.clone()];
        assert_eq!(label(&thrice, &faded).as_deref(), Some("worn.npy · edges taper"));
        assert_eq!(label(&thrice, &new).as_deref(), Some("new.npy"));
        // A random surface does not add its parameters to the labels of files.
        let random = Point::from_cells([
            (K_LOWER, Value::Integer(4)),
            (RMS_SLOPE, Value::Real(0.02)),
            (METHOD, Value::Text("filter".to_owned())),
        ]);
        let mixed = [worn.clone(), random.clone()];
        assert_eq!(label(&mixed, &worn).as_deref(), Some("worn.npy"));
        assert_eq!(label(&mixed, &random).as_deref(), Some("method filter"));
    }

    #[test]
    fn points_of_three_varying_parameters_do_not_look_alike() {
        let points = [0.2, 0.4, 0.6, 0.8].map(|hurst: f64| {
            [point(1, 8), point(1, 16), point(2, 8), point(2, 16)]
                .map(|point| point.and(of_exponent(hurst)))
        });
        let points = points.concat();
        let styles = Styles::new(&points, &Files::new());
        let looks: Vec<Style> = points.iter().map(|point| styles.markers(point)).collect();
        for (index, look) in looks.iter().enumerate() {
            assert!(!looks[..index].contains(look));
        }
        // A surface has fewer coordinates than its contacts.
        let surface = points[5].clone().without(&["nodes"]);
        assert_eq!(styles.markers(&surface), looks[5]);
    }

    #[test]
    fn where_no_cutoff_varies_something_else_has_the_colours() {
        let points = [0.3, 0.8].map(of_exponent);
        let styles = Styles::new(&points, &Files::new());
        assert_ne!(styles.colour(&points[0]), styles.colour(&points[1]));
    }
}
