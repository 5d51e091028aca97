//! Checks of the stages that read measured surfaces, and of their files.

use std::collections::BTreeMap;
use std::ops::{Bound, RangeBounds};
use std::path::Path;

use super::checks::{NODES, single, surfaces};
use super::growth::PlannedSurfaces;
use super::keys::{self, FileTable};
use super::{MeasuredSurface, Origin};
use crate::contact::grid::Cell;
use crate::contact::topography::measured::read_npy;
use crate::contact::topography::periodic::Edges;
use crate::contact::topography::surface::Surface;
use crate::diagnostics::{Problem, Span};
use crate::stages::Given;
use crate::surface_files::{ContentHash, SurfaceFileError, SurfaceFiles};
use crate::written::Section;
use crate::written::Written;
use crate::written::checks::{Checks, QUANTITY};

/// Measured surfaces.
pub fn files(section: &Section<FileTable>, given: &mut Given) -> Option<Vec<PlannedSurfaces>> {
    let mut seen = BTreeMap::new();
    let sources = &mut *given.sources;
    surfaces(section, given.problems, |table, checks| {
        let path = checks.required("path", &table.path);
        let side = checks.number("side", &table.side, QUANTITY);
        let height_scale = checks.number_or("height_scale", &table.height_scale, QUANTITY, 1.0);
        let edges = edges(table, checks);
        let path = path?;
        let scales = [side, height_scale].map(|scale| scale.unwrap_or(1.0));
        let (content, nodes) = read_map(path, scales, edges.as_ref(), sources, checks)?;
        check_distinct(content, path, &mut seen, checks)?;
        let unit = table.unit.written().map(|unit| unit.value.clone());
        let surface = MeasuredSurface {
            content,
            unit: unit.unwrap_or_default(),
            height_scale: height_scale?,
            edges: edges?,
            nodes,
        };
        Some(single(&table.heights, side?, Origin::File(surface)))
    })
}

fn edges(table: &FileTable, checks: &mut Checks) -> Option<Edges> {
    let fraction = (Bound::Excluded(0.0), Bound::Included(0.5));
    let fraction = checks.number_or("taper_fraction", &table.taper_fraction, fraction, 0.1);
    let is_periodic = checks.required("periodic", &table.periodic)?.value;
    let written = table.edges.written();
    let untapered = "only with `edges = \"taper\"`";
    match (is_periodic, written.map(|edges| edges.value)) {
        (true, _) => {
            let why = "the map is periodic: its edges meet already";
            let edges = checks.forbidden("edges", &table.edges, why);
            checks.forbidden("taper_fraction", &table.taper_fraction, untapered)?;
            edges.map(|()| Edges::Periodic)
        }
        (false, Some(keys::Edges::Mirror)) => {
            checks.forbidden("taper_fraction", &table.taper_fraction, untapered)?;
            Some(Edges::Mirror)
        }
        (false, Some(keys::Edges::Taper)) => Some(Edges::Taper {
            taper_fraction: fraction?,
        }),
        (false, None) => {
            checks.required("edges", &table.edges)?;
            None
        }
    }
}

/// Reads the file once, to find now what would otherwise be found in the middle of a run; its
/// content, and the nodes per side once its edges meet.
fn read_map(
    path: &Written<String>,
    [side, height_scale]: [f64; 2],
    edges: Option<&Edges>,
    sources: &mut SurfaceFiles,
    checks: &mut Checks,
) -> Option<(ContentHash, u32)> {
    let mut refuse = |reason: String, label: &str| {
        let message = format!("{:?} {reason}", path.value);
        checks.report("path", Problem::new(message, path.span.clone(), label));
        None
    };
    let (content, bytes) = match sources.add(Path::new(&path.value)) {
        Ok(found) => found,
        Err(SurfaceFileError::Read { source, .. }) => {
            if let Some(recalled) = sources.recall(Path::new(&path.value)) {
                return Some(recalled);
            }
            return refuse(
                format!("cannot be read: {source}"),
                "relative to the manifest",
            );
        }
        Err(error) => return refuse(format!("cannot be read: {error}"), "this file"),
    };
    let cell = Cell::square(side).expect("the side was checked");
    let surface = match read_npy(&bytes, cell) {
        Ok(surface) => surface,
        Err(error) => return refuse(format!("is no map of heights: {error}"), "this file"),
    };
    let copies = match edges {
        Some(Edges::Mirror) => 2,
        _ => 1,
    };
    let most = NODES.end() / copies;
    let [nodes, columns] = surface.grid().nodes();
    if columns != nodes {
        let reason = format!(
            "is no map of heights: the array has shape [{nodes}, {columns}], a height map must be \
             square, like [256, 256]"
        );
        return refuse(reason, "this file");
    }
    if !(*NODES.start() as usize..=most as usize).contains(&nodes) {
        let reason = format!(
            "has {nodes} nodes per side, here it must be from {} to {most}",
            NODES.start()
        );
        return refuse(reason, "this file");
    }
    let spread = height_scale * spread(surface.heights());
    if spread != 0.0 && !QUANTITY.contains(&spread) {
        let reason = format!("has heights that spread over {spread:?}");
        return refuse(reason, "must be from 1e-30 to 1e30; another unit may help");
    }
    if is_flat(surface, edges) {
        let reason = "is flat: no roughness is left once its edges meet";
        return refuse(reason.to_owned(), "this file");
    }
    Some((content, nodes as u32 * copies))
}

/// Whether a map has no roughness once its edges meet: an inclined plane has none.
fn is_flat(map: Surface, edges: Option<&Edges>) -> bool {
    let before = spread(map.heights());
    let closed = edges.map_or(map.clone(), |edges| edges.close(map));
    spread(closed.heights()) <= 1e-12 * before
}

fn spread(heights: &[f64]) -> f64 {
    let least = heights.iter().copied().fold(f64::INFINITY, f64::min);
    heights.iter().copied().fold(f64::NEG_INFINITY, f64::max) - least
}

/// Two paths to one content would count one surface as two.
fn check_distinct(
    content: ContentHash,
    path: &Written<String>,
    seen: &mut BTreeMap<ContentHash, (String, Span)>,
    checks: &mut Checks,
) -> Option<()> {
    let here = (path.value.clone(), path.span.clone());
    let Some((other, span)) = seen.insert(content, here) else {
        return Some(());
    };
    if span == path.span {
        return Some(());
    }
    let message = format!(
        "{:?} and {other:?} are the same surface, byte for byte",
        path.value
    );
    let problem = Problem::new(message, path.span.clone(), "this file").and(span, "and this one");
    checks.problems.push(problem);
    None
}
