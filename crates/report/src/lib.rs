//! The page of a study, `report.html`, and its figures as files.
//!
//! [`write()`] draws all figures for which a study has the data, each parameter point with the same
//! style. For other figures the page lists the lines of a manifest that would add the data. The
//! page contains the figures, the tables and their provenance.
//!
//! | module | content |
//! |---|---|
//! | `finished` | the finished stages, with the units of their tables |
//! | `figure_data` | what all figures of a study share, and notes for captions |
//! | `points` | parameter points as figures name them; parameters that do not follow from others |
//! | `surface_curves` | means against wavenumber or distance |
//! | `samples` | one surface of each parameter point, and measured maps |
//! | `styles`, `units`, `loads` | colours, markers and labels; units with prefixes; unit of loads |
//! | `plotted` | points of declared and automatic figures, from the rows of a table |
//! | `symbols` | labels of axes and legends for columns of tables |
//! | `figures` | all figures, in files by subject |
//! | `map_pictures` | pictures of single maps |
//! | `animation` | sweeps of loads as GIF and APNG files |
//! | `charts` | drawing: axes, series, legends, maps; SVG, PNG and PDF |
//! | `page` | the HTML page: summary, figures, tables, provenance |
//! | `index` | the page of all studies of a data folder |
//! | `integrity` | contents of a report, changes of its files, and replacement by a new one |

// Pictures and texts are rounded to a few digits.
#![allow(clippy::disallowed_methods)]

pub mod animation;
mod charts;
mod figure_data;
mod figures;
mod finished;
pub mod index;
mod integrity;
mod loads;
pub mod map_pictures;
mod page;
mod plotted;
mod points;
mod samples;
mod styles;
mod surface_curves;
mod symbols;
#[cfg(test)]
mod tests;
mod units;

pub use charts::map_panel::{BarNumbers, ColourBar, MapPanel, ScaleBar};
pub use charts::raster::{Raster, Scale};
pub use charts::svg::PixelsError;
pub use integrity::{check_folder, problems};
pub use units::{digits, length_in_words, pressure_in_words};

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::charts::{Figure, pdf, svg};
use crate::figure_data::FigureData;
use crate::figures::{Drawn, DrawnFigure, Group, Planned};
use crate::finished::FinishedStages;
use crate::integrity::Basis;
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::FIGURES;
use asperity_pipeline::results::StageRows;
use asperity_pipeline::results::reader::ResultReader;
use asperity_pipeline::study::figures::ErrorBars;
use asperity_pipeline::study::{Study, Warning};
use asperity_stages::StageError;
use asperity_tables::parallel;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{lock_to_write, make_folder, write_whole};
use asperity_tables::table::TableError;

const PAGE: &str = "report.html";
/// Pixels of a PNG file per pixel of the figure.
const SCALE: f32 = 2.0;

/// Quantity that error bars show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bars {
    /// Standard errors of the mean.
    #[default]
    Sem,
    /// Standard deviations over the surfaces, as in the paper.
    Sd,
}

impl From<Bars> for ErrorBars {
    fn from(bars: Bars) -> ErrorBars {
        match bars {
            Bars::Sem => ErrorBars::Sem,
            Bars::Sd => ErrorBars::Sd,
        }
    }
}

/// Paths of a written report, with the figures that it contains and those that could not be drawn.
#[derive(Debug, Serialize)]
pub struct Report {
    pub page: PathBuf,
    pub figures: PathBuf,
    /// Titles of the figures on the page.
    pub drawn: Vec<String>,
    pub missing: Vec<NotDrawn>,
    /// Size of the page in bytes.
    #[serde(skip)]
    pub size: usize,
}

/// A figure that is not drawn, and the data that it needs.
#[derive(Debug, Serialize)]
pub struct NotDrawn {
    /// Title of the figure.
    pub figure: String,
    /// Name of the files that the figure would have; NAME of a table `[figure.NAME]`.
    pub name: String,
    pub reason: Reason,
    pub needs: String,
}

/// Reason why a figure is not drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// The manifest declares the figure, and the table has no values for it.
    Declared,
    /// A figure of the paper, whose data are lost.
    Lost,
    /// A figure of the paper that does not apply to the study.
    DoesNotApply,
}

/// A figure that is not drawn, with the lines of a manifest that would add its data.
#[derive(Debug, Serialize)]
struct MissingFigure {
    #[serde(flatten)]
    told: NotDrawn,
    lines: Option<String>,
}

impl MissingFigure {
    fn new(planned: &Planned, needs: String, lines: Option<String>) -> MissingFigure {
        let reason = match (planned.group, &lines) {
            (Group::Declared, _) => Reason::Declared,
            (_, None) => Reason::Lost,
            (_, Some(_)) => Reason::DoesNotApply,
        };
        let (figure, name) = (planned.title.clone(), planned.name.clone());
        MissingFigure { told: NotDrawn { figure, name, reason, needs }, lines }
    }
}

/// Error in writing a report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A table cannot be read or a file cannot be written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A table does not have the columns of its kind of stage.
    #[error("cannot read a table of the study")]
    Table(#[from] TableError),
    /// The surfaces cannot be compared with the assumptions of the theories.
    #[error("cannot check which surfaces satisfy the assumptions of the theories")]
    Caveats(#[source] StageError),
    /// A surface cannot be drawn for a figure.
    #[error("cannot draw a surface for a figure")]
    Surface(#[source] StageError),
    /// A figure cannot be converted to PNG or PDF.
    #[error("cannot convert `{name}.svg` to PNG and PDF")]
    Pixels { name: String, source: PixelsError },
    /// Not returned any more: a page that shows more than the new one is overwritten.
    #[error("`{}` shows more than a new page would", page.display())]
    ShowsLess { page: PathBuf, lacks: Vec<String> },
    /// The existing file is not a report.
    #[error(
        "`{}` was not written by `asperity report` and will not be overwritten; choose another \
         folder with `--output`",
        page.display()
    )]
    NoReport { page: PathBuf },
    /// The existing file is not a page of studies.
    #[error(
        "`{}` was not written by `asperity report --index`; move it away, or overwrite it with \
         `--replace`",
        page.display()
    )]
    NoIndex { page: PathBuf },
    /// An existing file is not part of an earlier report of the study, or was changed.
    #[error(
        "`{}` is not part of a report of `{study}`, or was changed since; overwrite it with \
         `--replace`, or choose another folder with `--output`",
        path.display()
    )]
    Taken { path: PathBuf, study: String },
    /// A figure of an earlier report cannot be removed.
    #[error("cannot remove `{}`, a figure of an earlier report", path.display())]
    Remove { path: PathBuf, source: io::Error },
}

/// A study and its results.
pub struct Subject<'a> {
    pub study: &'a Study,
    pub plan: &'a Plan,
    pub rows: &'a [StageRows],
    /// Finished tasks with their maps.
    pub archive: &'a ResultReader,
    /// Warnings that the page shows.
    pub warnings: &'a [Warning],
}

impl Subject<'_> {
    /// Returns the numbers of finished and of planned tasks.
    fn tasks(&self) -> (usize, usize) {
        let done: BTreeSet<usize> = self.rows.iter().flat_map(|rows| rows.tasks.clone()).collect();
        (done.len(), self.plan.tasks.len())
    }
}

/// Writes the page `report.html` and the folder `figures` into a folder.
///
/// # Errors
/// If a surface cannot be drawn or a file cannot be written.
pub fn write(subject: &Subject, bars: Bars, folder: &Path) -> Result<Report, ReportError> {
    let finished = FinishedStages::new(subject);
    let derived = subject.study.derived_keys();
    let data = FigureData::new(&finished, bars.into(), derived)?;
    // Draw figures in parallel, one task each.
    let planned = Planned::all(subject.study, &finished);
    let drawn = parallel::map(&planned, |figure| draw(figure, &data));
    let (mut there, mut missing) = (Vec::new(), Vec::new());
    for figure in drawn {
        match figure? {
            Some(Ok(figure)) => there.push(figure),
            Some(Err(figure)) => missing.push(figure),
            None => {}
        }
    }
    let basis = Basis::new(&subject.plan.study, &there);
    let page = folder.join(PAGE);
    make_folder(folder)?;
    // The page contains digests of the figures, so `verify` must see either both or none.
    let _alone = lock_to_write(folder);
    let pictures = folder.join(FIGURES);
    let earlier = integrity::read_page(&page).ok().and_then(|page| Basis::from_page(&page));
    for (name, bytes) in there.iter().flat_map(DrawnFigure::files) {
        write_whole(&pictures.join(&name), bytes, &pictures)?;
    }
    for name in earlier.unwrap_or_default().files.keys() {
        if !basis.files.contains_key(name) {
            remove(&pictures.join(name))?;
        }
    }
    let text = page::html(subject, &data, &there, &missing, &basis, folder);
    let text = integrity::sealed(text);
    write_whole(&page, text.as_bytes(), folder)?;
    Ok(Report {
        page,
        figures: pictures,
        drawn: there.into_iter().map(|figure| figure.title).collect(),
        missing: missing.into_iter().map(|figure| figure.told).collect(),
        size: text.len(),
    })
}

/// Draws a figure, or returns `None` if the study has no stage of the special kind that the figure
/// shows.
fn draw(
    planned: &Planned,
    data: &FigureData,
) -> Result<Option<Result<DrawnFigure, MissingFigure>>, ReportError> {
    let (name, title, mut group) = (planned.name.clone(), planned.title.clone(), planned.group);
    let (mut drawing, mut caption, sliders) = match planned.draw(data)? {
        Drawn::Figure { figure, caption, sliders } => (figure, caption, sliders),
        Drawn::Missing { needs, lines } => {
            return Ok(Some(Err(MissingFigure::new(planned, needs.into_owned(), lines))));
        }
        Drawn::NotAsked => return Ok(None),
    };
    if group == Group::Paper {
        if let Some(note) = data.loads.on_axes(&mut drawing) {
            caption = format!("{} {note}", caption.trim_end());
        }
        if drawing.is_of_maps() {
            group = Group::Maps;
        } else if let Err(axis) = drawing.keep_courses() {
            let lines = match figures::missing(data, &name) {
                Drawn::Missing { lines, .. } => lines,
                _ => None,
            };
            let needs = format!("two or more places along the axis `{axis}`");
            return Ok(Some(Err(MissingFigure::new(planned, needs, lines))));
        }
    }
    let alone = svg::alone(&drawing.to_svg(&name));
    let files =
        svg::to_png(&alone, pixels(&drawing)).and_then(|png| Ok((png, pdf::to_pdf(&alone)?)));
    let (png, pdf) = files.map_err(|source| ReportError::Pixels { name: name.clone(), source })?;
    let drawing = drawing.for_page(&name);
    Ok(Some(Ok(DrawnFigure { name, title, group, drawing, alone, png, pdf, caption, sliders })))
}

/// Returns the number of pixels of a PNG file per pixel of the figure: 300 to the inch if the
/// figure has a size.
fn pixels(figure: &Figure) -> f32 {
    /// Maximum number of pixels along a side of a file.
    const MOST: f64 = 10_000.0;
    figure.sheet.map_or(SCALE, |[width, height]| {
        let finest: f64 = 300.0 / 96.0;
        finest.min(MOST / width.max(height)) as f32
    })
}

fn remove(path: &Path) -> Result<(), ReportError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(ReportError::Remove { path: path.to_owned(), source: error })
        }
        _ => Ok(()),
    }
}
