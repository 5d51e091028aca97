//! States of adhesive contacts against closed forms and against independent solvers.

use super::*;
use crate::elasticity::PeriodicHalfSpace;
use crate::grid::samples::square;
use crate::reduced::samples::on;
use crate::solver::tests::npy_array;

mod closed_forms;
mod free;
mod reference;

/// Returns the path of a square surface on a periodic half-space.
fn path(nodes: usize, heights: &[f64], adhesion: Adhesion) -> AdhesivePath {
    let body = PeriodicHalfSpace::new(square(nodes, 1.0));
    AdhesivePath::new(Threads::one(), &body, adhesion, &on(body.grid(), heights))
}

fn step(path: &mut AdhesivePath, target: Target) -> AdhesiveState {
    path.step(target, &Settings::default(), &|| false)
}

fn solved(path: &mut AdhesivePath, target: Target) -> AdhesiveState {
    let state = step(path, target);
    assert_eq!(state.stop, Stop::Converged, "{target:?}: {state:?}");
    state
}

fn file(name: &str) -> Vec<u8> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/adhesion/");
    std::fs::read(format!("{folder}{name}")).unwrap()
}

/// Returns the heights of the surface `rough64_a`, which has unit rms slope.
fn rough64() -> Vec<f64> {
    npy_array(&file("rough64_a.npy")).1
}

/// Returns the rows of numbers of a file.
fn rows(name: &str) -> Vec<Vec<f64>> {
    let text = String::from_utf8(file(name)).unwrap();
    let lines = text.lines().filter(|line| line.starts_with(|first: char| first.is_numeric()));
    lines.map(|line| line.split(',').map(|number| number.parse().unwrap()).collect()).collect()
}
