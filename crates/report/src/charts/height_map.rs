//! Heights as a picture that is small enough for a page, with the numbers of its colours.

use super::raster::{Raster, Scale};

/// A map of heights in colours.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    /// The map.
    pub raster: Raster,
    /// Its colours, from the lowest height to the highest.
    pub colours: Raster,
    /// Those two heights, of all nodes, about the mean; none where no height is known.
    pub range: Option<[f64; 2]>,
}

impl HeightMap {
    /// Heights of the nodes, row-major, NaN where one is missing, on at most so many pixels a side.
    ///
    /// Of a map with more nodes a pixel is a rectangle of them: the mean of its known heights, or a
    /// hole where at least half of its nodes are missing, so that holes keep their area.
    pub fn of(nodes: [usize; 2], heights: &[f64], most: usize) -> HeightMap {
        let scale = Scale::of_heights(heights);
        let (pixels, means) = reduced(nodes, heights, most);
        let (lowest, highest) = scale.range().into_inner();
        // From the lowest on, as an instrument may count from far below.
        let known = heights.iter().filter(|height| !height.is_nan());
        let above: f64 = known.clone().map(|height| height - lowest).sum();
        let mean = above / known.count() as f64;
        HeightMap {
            raster: Raster::of_heights_on(&scale, pixels, &means),
            colours: scale.bar(),
            range: (lowest <= highest).then_some([-mean, highest - lowest - mean]),
        }
    }
}

/// Means over rectangles of nodes, as many along either axis as keep the map within `most` a side.
fn reduced(nodes: [usize; 2], heights: &[f64], most: usize) -> ([usize; 2], Vec<f64>) {
    let [step_x, step_y] = nodes.map(|side| side.div_ceil(most.max(1)));
    let pixels = [nodes[0].div_ceil(step_x), nodes[1].div_ceil(step_y)];
    let mut means = Vec::with_capacity(pixels[0] * pixels[1]);
    for rows in heights.chunks(step_x * nodes[1]) {
        for first in (0..nodes[1]).step_by(step_y) {
            let (mut sum, mut known, mut missing) = (0.0, 0, 0);
            for row in rows.chunks_exact(nodes[1]) {
                for height in &row[first..nodes[1].min(first + step_y)] {
                    match height.is_nan() {
                        true => missing += 1,
                        false => {
                            known += 1;
                            sum += height;
                        }
                    }
                }
            }
            let is_hole = missing >= known;
            means.push(if is_hole { f64::NAN } else { sum / f64::from(known) });
        }
    }
    (pixels, means)
}

#[cfg(test)]
mod tests {
    use super::super::raster::HOLE;
    use super::*;

    #[test]
    fn a_map_that_is_small_enough_is_the_map_itself() {
        let heights: Vec<f64> = (0..12).map(f64::from).collect();
        assert_eq!(reduced([4, 3], &heights, 4), ([4, 3], heights.clone()));
        let map = HeightMap::of([4, 3], &heights, 4);
        assert_eq!(map.raster, Raster::of_heights([4, 3], &heights));
        assert_eq!(map.range, Some([-5.5, 5.5]));
    }

    #[test]
    fn pixels_are_means_over_rectangles_and_the_last_of_what_is_left() {
        // Five nodes along x by four along y, on three pixels by two at most.
        let heights: Vec<f64> = (0..20).map(|node| f64::from(node / 4)).collect();
        let (pixels, means) = reduced([5, 4], &heights, 3);
        assert_eq!(pixels, [3, 2]);
        assert_eq!(means, [0.5, 0.5, 2.5, 2.5, 4.0, 4.0]);
    }

    #[test]
    fn half_of_a_pixel_missing_is_a_hole_and_less_is_the_mean_of_the_rest() {
        let hole = f64::NAN;
        let mut heights = [4.0; 16];
        heights[..8].copy_from_slice(&[1.0, 4.0, hole, 6.0, 4.0, hole, hole, 5.0]);
        let (_, means) = reduced([4, 4], &heights, 2);
        assert_eq!(means[0], 3.0);
        assert!(means[1].is_nan());
        let picture = HeightMap::of([4, 4], &heights, 2);
        assert_eq!(picture.range, Some([-3.0, 2.0]), "of the nodes, not of the pixels");
        let holes = picture.raster.pixels().filter(|pixel| **pixel == HOLE);
        assert_eq!(holes.count(), 1);
    }

    #[test]
    fn nothing_known_has_no_range() {
        assert_eq!(HeightMap::of([1, 2], &[f64::NAN; 2], 8).range, None);
    }
}
