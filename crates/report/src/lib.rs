//! The page of a study, `report.html`, and its figures as files for a paper.
//!
//! [`write()`] reads the finished tables of a study into `FigureData`: curves of ensembles, which
//! have one style on all figures. Each figure draws what it finds there, or says which stage would
//! add it. The page holds the figures, the tables, and where all of it comes from.
//!
//! | module | what it holds |
//! |---|---|
//! | `figure_data` | the finished stages, sorted for figures; what captions say besides; advice |
//! | `ensembles` | means over equal surfaces under ascending loads, and their error bars |
//! | `surface_curves` | means against another coordinate than the load |
//! | `samples` | single surfaces, one of each parameter point, and measured maps |
//! | `styles`, `units` | colours, markers and labels; metres, pascals and their prefixes |
//! | `figures` | every figure, in files by subject |
//! | `charts` | drawing: axes, series, legends, maps; SVG and PNG |
//! | `page` | the HTML page and its provenance |
//! | `earlier` | an earlier report: what it shows, and whether it may be replaced |

mod charts;
mod earlier;
mod ensembles;
#[cfg(test)]
mod every_consumer;
mod figure_data;
mod figures;
mod page;
mod samples;
mod styles;
mod surface_curves;
mod units;

pub use charts::raster::{Raster, Scale};
pub use charts::svg::PixelsError;
pub use earlier::{changed_files, check_folder};
pub use ensembles::Bars;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::charts::svg;
use crate::earlier::Basis;
use crate::figure_data::{FigureData, FinishedStages};
use crate::figures::{Definition, Drawn, DrawnFigure, MissingFigure};
use asperity_pipeline::plan::Plan;
use asperity_pipeline::results::FIGURES;
use asperity_pipeline::results::StageRows;
use asperity_pipeline::results::reader::ResultReader;
use asperity_pipeline::study::Warning;
use asperity_stages::StageError;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_tables::parallel;
use asperity_tables::store::StoreError;
use asperity_tables::store::files::{Existing, lock_to_write, make_folder, write_whole};
use asperity_tables::table::TableError;

const PAGE: &str = "report.html";
/// Pixels of a PNG file to one of a figure.
const SCALE: f32 = 2.0;

/// A report that has been written.
#[derive(Debug, Serialize)]
pub struct Report {
    pub page: PathBuf,
    pub figures: PathBuf,
    /// The titles of the figures that are there.
    pub drawn: Vec<&'static str>,
    pub missing: Vec<NotDrawn>,
    /// Bytes of the page.
    #[serde(skip)]
    pub size: usize,
}

/// The title of a figure that is not drawn, and what it needs.
#[derive(Debug, Serialize)]
pub struct NotDrawn {
    pub figure: &'static str,
    pub needs: &'static str,
}

/// A report cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A table cannot be read, or a file not be written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A table is not what its kind of stage writes.
    #[error("cannot read a table of the study")]
    Table(#[from] TableError),
    /// Means over surfaces cannot be taken.
    #[error("cannot determine to which surfaces the theories do not apply")]
    Caveats(#[source] StageError),
    /// A surface cannot be drawn again.
    #[error("cannot draw a surface for a figure")]
    Surface(#[source] StageError),
    /// A figure cannot be turned into pixels.
    #[error("cannot convert `{name}.svg` to PNG")]
    Pixels { name: &'static str, source: PixelsError },
    /// Another page is there, which shows what this one would not.
    #[error(
        "`{}` shows more than a new page would: {}; compute the missing results with `asperity \
         run`, choose another folder with `--output FOLDER`, or overwrite the page with \
         `--replace`",
        page.display(),
        lacks.join(", "),
    )]
    ShowsLess { page: PathBuf, lacks: Vec<String> },
    /// The file in the page's place is not a report.
    #[error(
        "`{}` was not written by `asperity report` and will not be overwritten; choose another \
         folder with `--output`",
        page.display()
    )]
    NoReport { page: PathBuf },
    /// A file in the report's place is not part of an earlier report of the study.
    #[error(
        "`{}` is not part of a report of `{study}`, or was changed since; overwrite it with \
         `--replace`, or choose another folder with `--output`",
        path.display()
    )]
    Taken { path: PathBuf, study: String },
    /// A figure of an earlier report cannot be taken away.
    #[error("cannot remove `{}`, a figure of an earlier report", path.display())]
    Remove { path: PathBuf, source: io::Error },
}

/// A study and what has been read of it.
pub struct Subject<'a> {
    pub plan: &'a Plan,
    pub rows: &'a [StageRows],
    /// Its finished tasks, and their maps.
    pub archive: &'a ResultReader,
    /// The files of its measured surfaces.
    pub sources: &'a SurfaceFiles,
    pub manifest: &'a str,
    /// What should be known of it.
    pub warnings: &'a [Warning],
}

impl Subject<'_> {
    /// Whether all that the manifest asks for is there.
    fn is_complete(&self) -> bool {
        let mut stages = self.plan.stages.iter().zip(self.rows);
        stages.all(|(stage, rows)| rows.tasks.len() == stage.tasks.len())
    }
}

/// Writes the page `report.html` and the folder `figures` into a folder. Of a study that is not
/// complete, or has lost its maps, a page that shows more is kept.
///
/// # Errors
/// When a surface cannot be drawn, or a file not be written, or a page that shows more is there.
pub fn write(
    subject: &Subject,
    bars: Bars,
    folder: &Path,
    existing: Existing,
) -> Result<Report, ReportError> {
    let finished = FinishedStages::of(subject);
    let data = FigureData::of(&finished, bars)?;
    // Each figure by itself: on a machine of many cores they take as long as the slowest.
    let drawn = parallel::map(&figures::ALL, |definition| draw(definition, &data));
    let (mut there, mut missing) = (Vec::new(), Vec::new());
    for figure in drawn {
        match figure? {
            Some(Ok(figure)) => there.push(figure),
            Some(Err(figure)) => missing.push(figure),
            None => {}
        }
    }
    let basis = Basis::new(&subject.plan.study, &there, &finished.stages);
    let page = folder.join(PAGE);
    let is_complete = subject.is_complete() && missing.iter().all(|figure| figure.lines.is_some());
    if existing == Existing::Keep && !is_complete {
        let lacks = basis.lacks_of(&page);
        if !lacks.is_empty() {
            return Err(ReportError::ShowsLess { page, lacks });
        }
    }
    make_folder(folder)?;
    // The page holds the digests of the figures, so that `verify` must see both or neither.
    let _alone = lock_to_write(folder);
    let pictures = folder.join(FIGURES);
    write_figures(&there, &pictures)?;
    let text = page::html(subject, &finished, &there, &missing, &basis, folder);
    let text = earlier::sealed(text);
    write_whole(&page, text.as_bytes(), Existing::Replace, folder)?;
    Ok(Report {
        page,
        figures: pictures,
        drawn: there.iter().map(|figure| figure.title).collect(),
        missing: missing
            .iter()
            .map(|figure| NotDrawn { figure: figure.title, needs: figure.needs })
            .collect(),
        size: text.len(),
    })
}

/// Draws one figure, if anybody asked for it.
fn draw(
    definition: &Definition,
    data: &FigureData,
) -> Result<Option<Result<DrawnFigure, MissingFigure>>, ReportError> {
    let Definition { name, title, draw } = *definition;
    Ok(Some(match draw(data)? {
        Drawn::Figure { figure, caption, sliders } => {
            let svg = figure.to_svg(name);
            let alone = svg::alone(&svg);
            let png = svg::to_png(&alone, SCALE);
            Ok(DrawnFigure {
                name,
                title,
                svg,
                alone,
                png: png.map_err(|source| ReportError::Pixels { name, source })?,
                caption,
                sliders,
            })
        }
        Drawn::Missing { needs, lines } => Err(MissingFigure { title, needs, lines }),
        Drawn::NotAsked => return Ok(None),
    }))
}

/// Writes two files for each figure, and takes away those that an earlier report has left of
/// others.
fn write_figures(there: &[DrawnFigure], folder: &Path) -> Result<(), ReportError> {
    for (name, bytes) in there.iter().flat_map(DrawnFigure::files) {
        write_whole(&folder.join(name), bytes, Existing::Replace, folder)?;
    }
    let is_gone = |name: &str| there.iter().all(|figure| figure.name != name);
    for definition in figures::ALL.iter().filter(|figure| is_gone(figure.name)) {
        for name in definition.file_names() {
            remove(&folder.join(name))?;
        }
    }
    Ok(())
}

fn remove(path: &Path) -> Result<(), ReportError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(ReportError::Remove { path: path.to_owned(), source: error })
        }
        _ => Ok(()),
    }
}
