//! What a study has found, to be looked at: one page, and its figures for a paper.
//!
//! The [`tables`] of a study's stages are sorted into [`evidence`]: curves of ensembles, all of
//! which have one look on all figures. Each of the [`figures`] draws what it finds there, or says
//! which stage would add it; the [`page`] holds them, the tables, and where all of it comes from.

pub mod advice;
pub mod ensembles;
pub mod evidence;
pub mod figure;
pub mod figures;
pub mod looks;
pub mod page;
pub mod provenance;
pub mod samples;
pub mod tables;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use self::evidence::Evidence;
use self::figure::{Definition, Drawn};
use self::page::{DrawnFigure, MissingFigure};
use self::provenance::Provenance;
use self::tables::Finished;
use crate::figures::pixels::{self, PixelsError};
use crate::figures::svg;
use crate::plan::Plan;
use crate::results::{FIGURES, StageTable};
use crate::sources::Sources;
use crate::stages::StageError;
use crate::store::files::{Existing, write_whole};
use crate::store::table::TableError;
use crate::store::{Store, StoreError};

/// Pixels of a PNG file to one of a figure.
const SCALE: f32 = 2.0;

/// A report that has been written.
#[derive(Debug)]
pub struct Report {
    /// The page.
    pub page: PathBuf,
    /// The folder of figures.
    pub figures: PathBuf,
    /// The titles of the figures that are there.
    pub drawn: Vec<&'static str>,
    /// The titles of those that are not, and what they need.
    pub missing: Vec<(&'static str, &'static str)>,
    /// Bytes of the page.
    pub size: usize,
}

/// A report cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A table cannot be read, or a file not be written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A table is not what its kind of stage writes.
    #[error("cannot use a table of the study")]
    Table(#[from] TableError),
    /// A surface cannot be drawn again.
    #[error("cannot show a surface")]
    Surface(#[source] StageError),
    /// A figure cannot be turned into pixels.
    #[error("cannot make `{name}.png`")]
    Pixels {
        /// The figure.
        name: &'static str,
        /// Why.
        source: PixelsError,
    },
    /// A figure of an earlier report cannot be taken away.
    #[error("cannot remove `{}`, a figure of an earlier report", path.display())]
    Remove {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

/// A study and what has been published of it.
pub struct Subject<'a> {
    /// Its tasks.
    pub plan: &'a Plan,
    /// Its finished tasks.
    pub store: &'a Store,
    /// The files of its measured surfaces.
    pub sources: &'a Sources,
    /// Its tables.
    pub published: &'a [StageTable],
    /// Its manifest's text.
    pub manifest: &'a str,
}

/// Writes the page `report.html` and the folder `figures` beside the tables of a study.
///
/// # Errors
/// When a table or a surface cannot be read, or a file not be written.
pub fn write(subject: &Subject, folder: &Path) -> Result<Report, ReportError> {
    let finished = Finished::read(subject)?;
    let evidence = Evidence::of(&finished)?;
    let pictures = folder.join(FIGURES);
    // Each figure by itself: on a machine of many cores they take as long as the slowest.
    let drawn = figures::ALL
        .par_iter()
        .map(|definition| draw(definition, &evidence, &pictures));
    let drawn = drawn.collect::<Result<Vec<_>, ReportError>>()?;
    let (there, missing) = parted(drawn);
    let provenance = Provenance::of(&finished, subject);
    let page = page::html(&there, &missing, &finished, &provenance);
    let path = folder.join("report.html");
    write_whole(&path, page.as_bytes(), Existing::Replace, folder)?;
    Ok(Report {
        page: path,
        figures: pictures,
        drawn: there.iter().map(|figure| figure.title).collect(),
        missing: missing
            .iter()
            .map(|figure| (figure.title, figure.needs))
            .collect(),
        size: page.len(),
    })
}

/// Draws one figure and writes its two files, or takes away those of an earlier report.
fn draw(
    definition: &Definition,
    evidence: &Evidence,
    folder: &Path,
) -> Result<Result<DrawnFigure, MissingFigure>, ReportError> {
    let Definition { name, title, draw } = *definition;
    let file = |ending: &str| folder.join(format!("{name}.{ending}"));
    match draw(evidence)? {
        Drawn::Figure { sheet, caption } => {
            let svg = sheet.to_svg(name);
            let alone = svg::alone(&svg);
            let pixels = pixels::to_png(&alone, SCALE);
            let pixels = pixels.map_err(|source| ReportError::Pixels { name, source })?;
            for (ending, bytes) in [("svg", alone.as_bytes()), ("png", &pixels)] {
                write_whole(&file(ending), bytes, Existing::Replace, folder)?;
            }
            Ok(Ok(DrawnFigure {
                name,
                title,
                svg,
                caption,
            }))
        }
        Drawn::Missing { needs, lines } => {
            remove(&file("svg"))?;
            remove(&file("png"))?;
            Ok(Err(MissingFigure {
                title,
                needs,
                lines,
            }))
        }
    }
}

fn remove(path: &Path) -> Result<(), ReportError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(ReportError::Remove {
            path: path.to_owned(),
            source: error,
        }),
        _ => Ok(()),
    }
}

fn parted(
    drawn: Vec<Result<DrawnFigure, MissingFigure>>,
) -> (Vec<DrawnFigure>, Vec<MissingFigure>) {
    let (mut there, mut missing) = (Vec::new(), Vec::new());
    for figure in drawn {
        match figure {
            Ok(figure) => there.push(figure),
            Err(figure) => missing.push(figure),
        }
    }
    (there, missing)
}
