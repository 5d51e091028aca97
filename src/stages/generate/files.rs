//! Checks of the stages that read measured surfaces, and of their files.

use std::collections::BTreeMap;
use std::ops::{Bound, RangeBounds};
use std::path::Path;

use super::checks::{single, surfaces};
use super::growth::PlannedSurfaces;
use super::keys::{self, FileTable};
use super::mesh::{NODES, sides_within, square_cells};
use super::{MeasuredSurface, Origin, PerAxis};
use crate::contact::grid::Cell;
use crate::contact::topography::measured::read_npy;
use crate::contact::topography::periodic::Edges;
use crate::contact::topography::surface::Surface;
use crate::diagnostics::{Problem, Span};
use crate::stages::Given;
use crate::surface_files::{ContentHash, SurfaceFileError, SurfaceFiles};
use crate::written::checks::{Checks, QUANTITY};
use crate::written::{OnAxes, Section, Written};

/// Measured surfaces.
pub fn files(section: &Section<FileTable>, given: &mut Given) -> Option<Vec<PlannedSurfaces>> {
    let mut seen = BTreeMap::new();
    let sources = &mut *given.sources;
    surfaces(section, given.problems, |table, checks| {
        let path = checks.required("path", &table.path);
        let sides = checks.required("side", &table.side);
        let side = sides.and_then(|sides| sides_within(sides, checks));
        let height_scale = checks.number_or("height_scale", &table.height_scale, QUANTITY, 1.0);
        let edges = edges(table, checks);
        let path = path?;
        let scale = height_scale.unwrap_or(1.0);
        let (content, nodes) = read_map(path, scale, edges.as_ref(), sources, checks)?;
        let (sides, side) = (sides?, side?);
        check_sides(path, sides, nodes, checks)?;
        check_distinct(content, path, &mut seen, checks)?;
        let unit = table.unit.written().map(|unit| unit.value.clone());
        let surface = MeasuredSurface {
            content,
            unit: unit.unwrap_or_default(),
            height_scale: height_scale?,
            edges: edges?,
            nodes: PerAxis(nodes),
        };
        Some(single(&table.heights, PerAxis(side), Origin::File(surface)))
    })
}

/// A map of more nodes along one axis has two sides, and only its owner knows them.
fn check_sides(
    path: &Written<String>,
    sides: &Written<OnAxes<f64>>,
    [nodes_x, nodes_y]: [u32; 2],
    checks: &mut Checks,
) -> Option<()> {
    let OnAxes::Both(side) = sides.value else {
        return Some(());
    };
    if nodes_x == nodes_y {
        return Some(());
    }
    let message = format!("{:?} is a rectangle, and `side` is not", path.value);
    let problem = Problem::new(message, sides.span.clone(), "one number")
        .and(path.span.clone(), "has more nodes along one axis");
    checks.problems.push(problem.help(format!(
        "give both sides, along the first axis of the array and along the second; with \
         `side = {}` cells are square",
        square_cells([nodes_x, nodes_y], side)
    )));
    None
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
            checks.forbidden("taper_fraction", &table.taper_fraction, untapered)?;
            Some(Edges::Open)
        }
    }
}

/// Reads the file once, to find now what would otherwise be found in the middle of a run; its
/// content, and the nodes along x and y once its edges meet.
fn read_map(
    path: &Written<String>,
    height_scale: f64,
    edges: Option<&Edges>,
    sources: &mut SurfaceFiles,
    checks: &mut Checks,
) -> Option<(ContentHash, [u32; 2])> {
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
    // Sides scale lengths, and nothing that is looked at here.
    let cell = Cell::square(1.0).expect("a side of one");
    let surface = match read_npy(&bytes, cell) {
        Ok(surface) => surface,
        Err(error) => return refuse(format!("is no map of heights: {error}"), "this file"),
    };
    let copies = match edges {
        Some(Edges::Mirror) => 2,
        _ => 1,
    };
    let most = NODES.end() / copies;
    let nodes = surface.grid().nodes();
    let can_be = *NODES.start() as usize..=most as usize;
    if !nodes.iter().all(|nodes| can_be.contains(nodes)) {
        let found = match nodes {
            [x, y] if x == y => format!("{x} nodes per side"),
            [x, y] => format!("{x} × {y} nodes"),
        };
        let reason = format!(
            "has {found}, here it must be from {} to {most}",
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
    Some((content, nodes.map(|nodes| nodes as u32 * copies)))
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
