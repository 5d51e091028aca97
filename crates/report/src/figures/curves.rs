//! Curves beside the data of a figure: theories, expressions and fitted laws.

use std::collections::BTreeSet;

use asperity_manifest::expression::Expression;
use asperity_pipeline::study::figures::{AREAS, Curve, Law, PanelSpec, Quantity, has_surfaces};
use asperity_stages::aggregate::{Model, nayak_parameters};
use asperity_stages::columns::LOAD;
use asperity_stages::ensemble::grouped;
use asperity_tables::column::Role;
use asperity_tables::table::{Table, TableError};

use crate::charts::axis::Spacing;
use crate::charts::chart::Series;
use crate::charts::style::{Colour, Dash, Style};
use crate::plotted::{Points, is_selected, mean, reals};

/// Number of points at which a curve is computed. Asperity models take milliseconds for each.
const STEPS: usize = 60;

/// Points of a series beside which curves are drawn.
pub struct DataSeries<'a> {
    /// Points as (x, table row).
    pub points: Vec<(f64, usize)>,
    pub data: &'a Points,
    pub quantity: &'a Quantity,
    pub colour: Colour,
}

/// The curves of a panel.
pub struct Curves<'a> {
    pub panel: &'a PanelSpec,
    pub spacing: Spacing,
    /// Factors that convert x and y to the units of the axes.
    pub factors: [f64; 2],
    /// Function that returns the tables of a stage.
    pub tables: &'a dyn Fn(&str) -> Vec<&'a Table>,
    /// Function that returns the colour of the curve of a row of such a table.
    pub colour: &'a dyn Fn(&Table, usize) -> Colour,
    /// Function that returns the name of a theory in the legend.
    pub name: &'a dyn Fn(Model) -> String,
}

/// Points of a curve and its colour.
type Drawn = (Vec<(f64, f64)>, Colour);
/// The parameters of a curve: means over these rows of a table.
type Parameters<'a> = (&'a Table, &'a [usize]);

impl Curves<'_> {
    /// Returns the curves beside the series of a panel, with entries of the legend.
    ///
    /// A curve without parameters is common to all series. An area against another column than the
    /// load is computed for the load and the parameters of each point of the data.
    pub fn beside(&self, series: &[DataSeries]) -> Result<Vec<Series>, TableError> {
        const DASHES: [Dash; 4] = [Dash::Dashed, Dash::Dotted, Dash::DashDot, Dash::Solid];
        let mut drawn = Vec::new();
        let mut dashed = 0;
        for curve in &self.panel.curves {
            let found = match &curve.from {
                Some(from) => self.of_rows(curve, from, series)?,
                None => self.of_series(curve, series)?,
            };
            if found.is_empty() {
                continue;
            }
            let theory = match curve.law {
                Law::Theory { model, .. } => Some((self.name)(model)),
                Law::Value(_) | Law::Area(_) => None,
            };
            let name = curve.label.clone().or(theory);
            // Fitted curves and those without a name belong to the data of the same colour.
            let (dash, width) = if curve.is_fit_along(&self.panel.x) || name.is_none() {
                (Dash::Solid, 1.6)
            } else if curve.from.is_some() {
                (Dash::Dotted, 1.4)
            } else {
                dashed += 1;
                (DASHES[(dashed - 1) % DASHES.len()], if dashed > DASHES.len() { 2.8 } else { 1.6 })
            };
            let is_alone = found.len() == 1;
            let is_constant = matches!(&curve.law, Law::Value(law) if law.columns().is_empty());
            for (points, colour) in found {
                let [x, y] = self.factors;
                let points = points.into_iter().map(|point| (x * point.0, y * point.1));
                let line = Series::new(points, Style::line(colour, dash, width));
                let label = name.clone().filter(|_| is_alone);
                drawn.push(Series { label, is_held: is_constant, ..line });
            }
            if let Some(name) = name.filter(|_| !is_alone) {
                let entry = Style::line(Colour::Text, dash, width);
                drawn.push(Series::new([], entry).named(name));
            }
        }
        Ok(drawn)
    }

    /// Returns a common curve, or one for each series.
    fn of_series(&self, curve: &Curve, series: &[DataSeries]) -> Result<Vec<Drawn>, TableError> {
        let mut own: Vec<Drawn> = Vec::new();
        for one in series {
            let is_common = self.is_smooth(curve) && self.has_no_parameters(curve);
            let first = one.points.first().map(|point| point.1);
            let Some(row) =
                first.filter(|&row| is_selected(&one.data.table, row, &curve.selection))
            else {
                continue;
            };
            let points = if self.is_smooth(curve) {
                self.smooth(curve, one.quantity, (&one.data.table, &[row]), series)?
            } else {
                self.at_points(curve, one)?
            };
            match own.iter_mut().find(|(known, _)| *known == points) {
                Some((_, shared)) if *shared == one.colour => {}
                Some((_, shared)) => *shared = Colour::Text,
                None if is_common => own.push((points, Colour::Text)),
                None => own.push((points, one.colour)),
            }
        }
        if let ([(_, colour)], 1) = (own.as_mut_slice(), series.len()) {
            *colour = Colour::Text;
        }
        Ok(own)
    }

    /// Returns a curve for each selected row of another stage, or for each parameter point if the
    /// rows are surfaces.
    fn of_rows(
        &self,
        curve: &Curve,
        from: &str,
        series: &[DataSeries],
    ) -> Result<Vec<Drawn>, TableError> {
        let Some(quantity) = series.first().map(|one| one.quantity) else { return Ok(Vec::new()) };
        let needed = self.parameters(curve);
        let mut found = Vec::new();
        for table in (self.tables)(from) {
            if !needed.iter().all(|name| table.has(name)) {
                continue;
            }
            let mut selection = curve.selection.clone();
            selection.retain(|name, _| table.has(name));
            let selected = (0..table.rows()).filter(|&row| is_selected(table, row, &selection));
            let mut groups: Vec<Vec<usize>> = selected.map(|row| vec![row]).collect();
            if has_surfaces(table) {
                let rows = groups.concat();
                let points = grouped(&table.in_role(Role::Parameter).pick(&rows));
                let of_point = |own: Vec<usize>| own.into_iter().map(|at| rows[at]).collect();
                groups = points.into_iter().map(of_point).collect();
            }
            for rows in groups {
                let points = self.smooth(curve, quantity, (table, &rows), series)?;
                if !points.is_empty() {
                    found.push((points, (self.colour)(table, rows[0])));
                }
            }
        }
        Ok(found)
    }

    /// Returns whether a curve can be computed anywhere along x.
    fn is_smooth(&self, curve: &Curve) -> bool {
        matches!(curve.law, Law::Value(_)) || self.panel.x == LOAD.name
    }

    /// Returns the columns of a curve besides x.
    fn parameters<'c>(&self, curve: &'c Curve) -> BTreeSet<&'c str> {
        let mut names = match &curve.law {
            Law::Value(law) | Law::Area(law) => law.columns(),
            Law::Theory { .. } => BTreeSet::new(),
        };
        names.remove(self.panel.x.as_str());
        names.extend(curve.range.iter().flatten().flat_map(Expression::columns));
        names
    }

    fn has_no_parameters(&self, curve: &Curve) -> bool {
        let needs_spectrum = match curve.law {
            Law::Theory { model, nayak } => nayak.is_none() && model.asperities().is_some(),
            Law::Value(_) | Law::Area(_) => false,
        };
        !needs_spectrum && self.parameters(curve).is_empty()
    }

    /// Returns points of a curve along the range of these series.
    fn smooth(
        &self,
        curve: &Curve,
        quantity: &Quantity,
        parameters: Parameters,
        shown: &[DataSeries],
    ) -> Result<Vec<(f64, f64)>, TableError> {
        let data = shown.iter().flat_map(|one| one.points.iter().map(|point| point.0));
        let ends = data.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], x| {
            [least.min(x), most.max(x)]
        });
        let [mut from, mut to] = ends;
        if let Some([first, last]) = &curve.range {
            from = from.max(value(first, parameters)?);
            to = to.min(value(last, parameters)?);
        }
        let step = |step: usize| {
            let share = step as f64 / (STEPS - 1) as f64;
            match self.spacing {
                Spacing::Linear => from + share * (to - from),
                Spacing::Logarithmic | Spacing::Octaves => from * (to / from).powf(share),
            }
        };
        if from.is_nan() || to.is_nan() || from >= to {
            return Ok(Vec::new());
        }
        let xs: Vec<f64> = (0..STEPS).map(step).collect();
        let ys = match &curve.law {
            Law::Value(law) => values(law, &self.panel.x, &xs, parameters)?,
            law => of_areas(quantity, &areas(law, &xs, parameters)?, &xs),
        };
        Ok(finite(xs.into_iter().zip(ys)))
    }

    /// Returns the curve of an area at the points of a series, under the load of each point.
    fn at_points(&self, curve: &Curve, series: &DataSeries) -> Result<Vec<(f64, f64)>, TableError> {
        let table = &series.data.table;
        let known = reals(table, LOAD.name)?;
        let (mut loads, mut found) = (Vec::new(), Vec::new());
        for &(_, row) in &series.points {
            let load = known[row].unwrap_or(f64::NAN);
            loads.push(load);
            found.extend(areas(&curve.law, &[load], (table, &[row]))?);
        }
        let ys = of_areas(series.quantity, &found, &loads);
        Ok(finite(series.points.iter().map(|point| point.0).zip(ys)))
    }
}

/// Returns the quantity of a panel for these areas under these loads.
fn of_areas(quantity: &Quantity, areas: &[f64], loads: &[f64]) -> Vec<f64> {
    let column = |name: &str| {
        if AREAS.contains(&name) { areas.to_vec() } else { loads.to_vec() }
    };
    match &quantity.expression {
        None => areas.to_vec(),
        Some(expression) => expression.values(&column, loads),
    }
}

/// Returns the areas of a law under these loads.
fn areas(law: &Law, loads: &[f64], parameters: Parameters) -> Result<Vec<f64>, TableError> {
    match law {
        Law::Area(law) | Law::Value(law) => values(law, LOAD.name, loads, parameters),
        Law::Theory { model, nayak } => {
            let (table, rows) = parameters;
            let nayak = match (nayak, model.asperities()) {
                (Some(nayak), _) => Some(*nayak),
                (None, Some(_)) => nayak_parameters(&table.pick(&rows[..1]))?[0],
                (None, None) => None,
            };
            let area = |&load: &f64| model.area(load, nayak).unwrap_or(f64::NAN);
            Ok(loads.iter().map(area).collect())
        }
    }
}

/// Returns the values of an expression along the column `free`, with the means of its parameters.
fn values(
    expression: &Expression,
    free: &str,
    along: &[f64],
    (table, rows): Parameters,
) -> Result<Vec<f64>, TableError> {
    let mut cells = Vec::new();
    for name in expression.columns().into_iter().filter(|name| *name != free) {
        let column = reals(table, name)?;
        let known: Vec<f64> = rows.iter().filter_map(|&row| column[row]).collect();
        cells.push((name, if known.is_empty() { f64::NAN } else { mean(&known) }));
    }
    let column = |name: &str| match cells.iter().find(|(known, _)| *known == name) {
        Some((_, cell)) => vec![*cell; along.len()],
        None => along.to_vec(),
    };
    Ok(expression.values(&column, along))
}

fn value(expression: &Expression, parameters: Parameters) -> Result<f64, TableError> {
    Ok(values(expression, "", &[f64::NAN], parameters)?[0])
}

fn finite(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    points.filter(|(_, y)| y.is_finite()).collect()
}

/// Returns the usual name of a theory in legends.
pub fn name(model: Model) -> &'static str {
    match model {
        Model::Persson => "Persson 2001",
        Model::BushGibsonThomas => "Bush, Gibson & Thomas 1975",
        Model::Greenwood2006 => "Greenwood 2006",
        Model::MeanCurvature => "spheres of the mean curvature",
        Model::GreenwoodMccool => "Greenwood & Williamson 1966, McCool 1986",
        Model::BgtAsymptote => "asymptote √(2π) y of BGT",
        Model::PennyCrack => "isolated cracks",
    }
}
