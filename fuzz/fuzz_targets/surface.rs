//! Fuzz target that reads any bytes as a NumPy file of a measured surface.
#![no_main]

use asperity_mechanics::grid::{Cell, Grid};
use asperity_mechanics::topography::periodic::Edges;
use asperity_mechanics::topography::surface::{Surface, check_range};
use asperity::topography_files::npy_array;
use libfuzzer_sys::fuzz_target;

/// Largest number of nodes of a map whose edges are closed. Larger maps are valid but slow.
const MOST_NODES: usize = 64 * 64;

fn surface(bytes: &[u8]) -> Result<Surface, Box<dyn std::error::Error>> {
    let (nodes, heights) = npy_array(bytes)?;
    let grid = Grid::new(nodes, Cell::square(1.0)?)?;
    check_range(grid, &heights)?;
    Ok(Surface::new(grid, heights)?)
}

fuzz_target!(|bytes: &[u8]| {
    match surface(bytes) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(surface) => {
            let nodes = surface.grid().count();
            assert_eq!(surface.heights().len(), nodes);
            assert!(surface.heights().iter().all(|height| height.is_finite()));
            if (1..=MOST_NODES).contains(&nodes) {
                let taper_fraction = 0.1;
                for edges in [Edges::Mirror, Edges::Taper { taper_fraction }] {
                    edges.close(surface.clone());
                }
            }
        }
    }
});
