//! Mean gap against the load, with its exponential relation; beyond the paper.

use arrow::array::Array;

use crate::ReportError;
use crate::charts::axis::{Axis, Spacing};
use crate::charts::chart::{Chart, Series};
use crate::charts::figure::Figure;
use crate::charts::style::{Dash, Style};
use crate::ensembles;
use crate::ensembles::{EnsembleCurves, Mean, Point};
use crate::figure::{Definition, Drawn, sample};
use crate::figure_data::{FigureData, LOAD_LABEL, series};
use crate::units::{LengthUnit, Scaled};
use asperity_stages::columns::MEAN_GAP;
use asperity_tables::table::{Table, TableError};

pub const FIGURE: Definition = Definition { name: "gap", title: "Mean gap", draw };

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let gaps = gaps(data, data.measured.iter())?;
    let mut chart = Chart::new(Axis::logarithmic(LOAD_LABEL), Axis::linear(gaps.label.clone()));
    for (ensemble, gaps) in data.measured.iter().zip(&gaps.means) {
        let style = data.styles.markers(&ensemble.point);
        chart.series.push(series(gaps, style).named(data.label(ensemble)));
    }
    if chart.series.iter().all(|series| series.points.len() < 2) {
        let lines =
            data.lines_of_loads("{ from = 0.001, to = 1.7, steps = 40, spacing = \"geometric\" }");
        return Ok(Drawn::missing("measured contacts under several loads", lines));
    }
    let drawn = chart.series.len();
    for stage in data.finished.with(&["decay_length", "closing_load", "window_lower"]) {
        chart.series.extend(relations(data, &stage.table, &gaps)?);
    }
    let fits = match chart.series.len() > drawn {
        true => {
            "Lines are least-squares fits of p₀ = p_c exp(−ū/u₀), over the loads that they span."
        }
        false => "A fit with `law = \"load-separation\"` adds the exponential relation.",
    };
    let caption = format!(
        "Mean gap ū against load, from {}. Points are means over the surfaces, bars {}. \
         {fits}",
        sample(&data.sample()),
        data.bars,
    );
    Ok(Drawn::figure(Figure::of(chart), caption))
}

/// Mean gaps of ensembles in one unit.
pub struct Gaps {
    /// What an axis says of them.
    pub label: String,
    /// Under the loads of each ensemble.
    pub means: Vec<Vec<Mean>>,
    shared: LengthUnit,
    factor: f64,
}

impl Gaps {
    /// What a length of a surface at a point is multiplied with.
    fn factor(&self, data: &FigureData, point: &Point) -> f64 {
        self.factor * self.shared.factor(data.units.at(point))
    }
}

/// The mean gaps of measured contacts, in metres with a prefix where their unit allows.
///
/// # Errors
/// When a table has no mean gaps.
pub fn gaps<'a>(
    data: &FigureData,
    ensembles: impl Iterator<Item = &'a EnsembleCurves<'a>>,
) -> Result<Gaps, TableError> {
    let shared = data.unit_of_length();
    let mut means = Vec::new();
    for ensemble in ensembles {
        let factor = shared.factor(data.units.at(&ensemble.point));
        let gaps = ensemble.mean(MEAN_GAP.name)?.into_iter();
        means.push(gaps.map(|gap| gap.times(factor)).collect::<Vec<_>>());
    }
    let largest = means.iter().flatten().fold(0.0_f64, |most, gap| most.max(gap.mean));
    let Scaled { factor, unit } = shared.scaled(largest);
    let scale = |gap: &mut Mean| *gap = gap.times(factor);
    means.iter_mut().flatten().for_each(scale);
    Ok(Gaps { label: format!("mean gap, in {unit}"), means, shared, factor })
}

/// The fitted relations as lines over their windows of loads.
fn relations(data: &FigureData, table: &Table, gaps: &Gaps) -> Result<Vec<Series>, TableError> {
    let column = |name: &str| table.reals(name);
    let (lengths, closing) = (column("decay_length")?, column("closing_load")?);
    let (from, to) = (column("window_lower")?, column("window_upper")?);
    let loads = gaps.means.iter().flatten().map(|mean| mean.load);
    let heaviest = loads.fold(0.0, f64::max);
    let is_fitted = |&row: &usize| lengths.is_valid(row) && closing.is_valid(row);
    let lines = (0..table.rows()).filter(is_fitted).map(|row| {
        let point = ensembles::point(table, row);
        let length = gaps.factor(data, &point) * lengths.value(row);
        let gap = |load: f64| length * (closing.value(row) / load).ln();
        let colour = data.styles.colour(&point);
        // A window may begin at zero, where the relation has no end, or end far beyond all loads.
        let to = to.value(row).min(heaviest);
        let range = [from.value(row).max(1e-3 * to), to];
        let style = Style::line(colour, Dash::Solid, 1.5);
        Series::curve(gap, range, Spacing::Logarithmic, style)
    });
    Ok(lines.collect())
}
