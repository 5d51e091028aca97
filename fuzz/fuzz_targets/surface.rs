//! Any bytes as a measured surface: a map of finite heights, or refused.
#![no_main]

use asperity::contact::grid::Cell;
use asperity::contact::topography::measured::read_npy;
use asperity::contact::topography::periodic::Edges;
use libfuzzer_sys::fuzz_target;

/// Larger maps are sound, but slow.
const MOST_NODES: usize = 64 * 64;

fuzz_target!(|bytes: &[u8]| {
    let cell = Cell::square(1.0).expect("a side");
    match read_npy(bytes, cell) {
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
