//! Three ways to make a measured map periodic, and what each does to its statistics.
//!
//! A measured map is a window on a larger surface: its opposite edges do not meet. Taken as
//! periodic, the steps where they should meet have a white tail in the spectrum, |ĥ|² ~ q^(−2)
//! along the axes, which dominates the slope and the curvature.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::surface::Surface;

/// How a measured map is made periodic.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "edges", rename_all = "lowercase")]
pub enum Edges {
    /// It is periodic as it is; nothing is done.
    Periodic,
    /// Its mean plane goes, then it is continued by its mirror images, see [`mirror`].
    Mirror,
    /// Its mean plane goes, then it fades to the mean at its edges, see [`taper`].
    Taper {
        /// Share of the side over which it fades at each edge, at most one half.
        taper_fraction: f64,
    },
}

impl Edges {
    /// The word used in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Edges::Periodic => "periodic",
            Edges::Mirror => "mirror",
            Edges::Taper { .. } => "taper",
        }
    }

    /// The map with edges that meet.
    pub fn close(self, map: Surface) -> Surface {
        match self {
            Edges::Periodic => map,
            Edges::Mirror => mirror(&detrend(&map)),
            Edges::Taper { taper_fraction } => taper(&detrend(&map), taper_fraction),
        }
    }
}

/// The map without its least-squares mean plane.
///
/// Takes away the tilt of the sample, and with it the part of the longest waves that looks like a
/// plane; the mean height becomes zero. The edges still do not meet.
pub fn detrend(surface: &Surface) -> Surface {
    let nodes = surface.nodes();
    let middle = (nodes as f64 - 1.0) / 2.0;
    let offset = |index: usize| index as f64 - middle;
    let (mut sum, mut along_x, mut along_y) = (0.0, 0.0, 0.0);
    for (node, height) in surface.heights().iter().enumerate() {
        sum += height;
        along_x += offset(node / nodes) * height;
        along_y += offset(node % nodes) * height;
    }
    // Offsets from the middle are orthogonal to each other and to a constant on a full mesh.
    let mean = sum / (nodes * nodes) as f64;
    let square_offsets: f64 = (0..nodes).map(|index| offset(index).powi(2)).sum();
    let norm = (nodes as f64 * square_offsets).max(f64::MIN_POSITIVE);
    let (slope_x, slope_y) = (along_x / norm, along_y / norm);
    let plane =
        |node: usize| mean + slope_x * offset(node / nodes) + slope_y * offset(node % nodes);
    map_nodes(surface, |node, height| height - plane(node))
}

/// The map and its three mirror images, on a cell of twice the side.
///
/// The heights meet at all edges and their distribution is untouched; slopes jump there where the
/// map has a slope across its edge. The four images are correlated: the larger cell holds no more
/// independent asperities than the map, and directions ±45° of an anisotropic map are mixed.
pub fn mirror(surface: &Surface) -> Surface {
    let (nodes, doubled) = (surface.nodes(), 2 * surface.nodes());
    let fold = |index: usize| index.min(doubled - 1 - index);
    let heights = (0..doubled * doubled)
        .map(|node| surface.heights()[fold(node / doubled) * nodes + fold(node % doubled)])
        .collect();
    Surface::new(doubled, 2.0 * surface.side(), heights).expect("copies of finite heights")
}

/// The map, faded to its mean height over a fraction `edge` of the side along each edge, at most
/// one half; a Tukey window, at one half that of Hann.
///
/// Heights and slopes meet at the edges and the interior is untouched, but the faded rim has lower
/// peaks: rms height and slope fall, for Hann's window the variance by (3/8)² on average, and the
/// fade itself adds slopes of order rms height / (`edge` × side).
pub fn taper(surface: &Surface, edge: f64) -> Surface {
    let nodes = surface.nodes();
    let faded = edge.min(0.5) * nodes as f64;
    let window: Vec<f64> = (0..nodes)
        .map(|index| index.min(nodes - 1 - index) as f64 + 0.5)
        .map(|depth| {
            if depth < faded {
                libm::sin(PI / 2.0 * depth / faded).powi(2)
            } else {
                1.0
            }
        })
        .collect();
    let mean = surface.heights().iter().sum::<f64>() / (nodes * nodes) as f64;
    map_nodes(surface, |node, height| {
        mean + window[node / nodes] * window[node % nodes] * (height - mean)
    })
}

fn map_nodes(surface: &Surface, change: impl Fn(usize, f64) -> f64) -> Surface {
    let heights = surface
        .heights()
        .iter()
        .enumerate()
        .map(|(node, height)| change(node, *height))
        .collect();
    Surface::new(surface.nodes(), surface.side(), heights)
        .expect("averages of finite heights are finite")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::topography::moments::Moments;

    fn surface(nodes: usize, height: impl Fn(f64, f64) -> f64) -> Surface {
        let heights = (0..nodes * nodes)
            .map(|node| height((node / nodes) as f64, (node % nodes) as f64))
            .collect();
        Surface::new(nodes, 1.0, heights).unwrap()
    }

    fn rough(nodes: usize) -> Surface {
        surface(nodes, |i, j| libm::sin(3.0 * i + i * j) + 0.1 * i - 0.3 * j)
    }

    #[test]
    fn detrended_plane_is_zero() {
        for nodes in [1, 2, 7, 32] {
            let plane = surface(nodes, |i, j| 5.0 + 0.25 * i - 0.5 * j);
            for height in detrend(&plane).heights() {
                assert!(height.abs() < 1e-13, "{nodes}: {height}");
            }
        }
    }

    #[test]
    fn what_remains_has_no_mean_and_no_tilt() {
        let once = detrend(&rough(20));
        for (once, twice) in once.heights().iter().zip(detrend(&once).heights()) {
            assert!((once - twice).abs() < 1e-14);
        }
    }

    #[test]
    fn detrending_leaves_a_saddle_alone() {
        let saddle = surface(5, |i, j| (i - 2.0) * (j - 2.0));
        for (before, after) in saddle.heights().iter().zip(detrend(&saddle).heights()) {
            assert!((before - after).abs() < 1e-14);
        }
    }

    #[test]
    fn mirrored_map_is_even_and_meets_itself_at_the_edges() {
        for nodes in [1, 5, 8] {
            let map = rough(nodes);
            let mirrored = mirror(&map);
            assert_eq!(mirrored.side(), 2.0);
            assert_eq!(mirrored.spacing(), map.spacing());
            let doubled = 2 * nodes;
            let at = |i: usize, j: usize| mirrored.heights()[i * doubled + j];
            for (i, j) in (0..doubled).flat_map(|i| (0..doubled).map(move |j| (i, j))) {
                assert_eq!(at(i, j), at(doubled - 1 - i, j));
                assert_eq!(at(i, j), at(i, doubled - 1 - j));
                if i < nodes && j < nodes {
                    assert_eq!(at(i, j), map.heights()[i * nodes + j]);
                }
            }
        }
    }

    #[test]
    fn mirroring_keeps_the_distribution_of_heights() {
        let map = detrend(&rough(16));
        let (before, after) = (Moments::of(&map), Moments::of(&mirror(&map)));
        assert!((before.rms_height() - after.rms_height()).abs() < 1e-14);
    }

    #[test]
    fn taper_fades_to_the_mean_and_keeps_the_interior() {
        let map = rough(64);
        let mean = map.heights().iter().sum::<f64>() / 4096.0;
        let tapered = taper(&map, 0.25);
        for (node, (before, after)) in map.heights().iter().zip(tapered.heights()).enumerate() {
            let depth = |index: usize| index.min(63 - index);
            let depth = depth(node / 64).min(depth(node % 64));
            if depth >= 16 {
                assert!((before - after).abs() < 1e-14);
            }
            if depth == 0 {
                // sin² of half a node out of sixteen.
                assert!((after - mean).abs() < 0.0025 * (before - mean).abs() + 1e-14);
            }
        }
    }

    #[test]
    fn hann_window_keeps_nine_sixty_fourths_of_the_variance() {
        // A checkerboard has zero mean and unit variance under any smooth weight.
        let checkerboard = surface(64, |i, j| 1.0 - 2.0 * ((i + j) % 2.0));
        let tapered = taper(&checkerboard, 0.5);
        let square: f64 = tapered.heights().iter().map(|h| h * h).sum();
        assert!((square / 4096.0 - 9.0 / 64.0).abs() < 1e-13);
    }

    #[test]
    fn no_edge_means_no_taper() {
        for (before, after) in rough(9)
            .heights()
            .iter()
            .zip(taper(&rough(9), 0.0).heights())
        {
            assert!((before - after).abs() < 1e-15);
        }
    }
}
