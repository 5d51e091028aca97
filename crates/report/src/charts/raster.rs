//! Maps of heights, pressures or contact as pictures.
//!
//! x runs to the right and y upwards, as on paper: node (i, j) of a map with N nodes a side is the
//! pixel in column i and row N − 1 − j.

use std::ops::RangeInclusive;

use colorous::{CIVIDIS, Gradient, INFERNO, PLASMA, RED_BLUE, VIRIDIS, YELLOW_GREEN_BLUE};

use asperity_mechanics::morphology::map::ContactMap;

pub type Pixel = [u8; 3];

/// Colour of nodes out of contact.
pub const GAP: Pixel = [255, 255, 255];
/// Colour of missing heights, which is not in any scale.
pub const HOLE: Pixel = [213, 46, 35];
/// Colour of nodes in contact.
pub const CONTACT: Pixel = [38, 38, 38];
/// Colours of nodes in contact with adhesion: pulled nodes and pushed ones, like negative and
/// positive pressures.
pub const PULLED: Pixel = [67, 147, 195];
pub const PUSHED: Pixel = [178, 24, 43];

/// Largest number of colours in a file with one byte per pixel.
const PALETTE: usize = 256;

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Raster {
    width: usize,
    height: usize,
    /// Pixels by rows, from the top.
    pixels: Vec<Pixel>,
}

/// Mapping of numbers to colours.
#[derive(Debug, Clone, Copy)]
pub struct Scale {
    gradient: Gradient,
    lowest: f64,
    highest: f64,
    /// True if the middle of the gradient stands for zero, and its ends for the two ends of the
    /// range. Negative and positive numbers then have different colours.
    diverges: bool,
}

impl Scale {
    /// Creates a scale from the lowest to the highest height.
    pub fn from_heights(heights: &[f64]) -> Scale {
        Scale::over(CIVIDIS, heights)
    }

    /// Creates a scale from zero to the highest pressure.
    pub fn from_pressures(pressures: &[f64]) -> Scale {
        let scale = Scale::over(INFERNO, pressures);
        Scale { lowest: 0.0, ..scale }
    }

    /// Creates a scale of pressures of both signs, with zero between blue (negative) and red
    /// (positive).
    pub fn from_signed_pressures(pressures: &[f64]) -> Scale {
        let scale = Scale::over(RED_BLUE, pressures);
        let (lowest, highest) = (scale.lowest.min(0.0), scale.highest.max(0.0));
        Scale { lowest, highest, diverges: true, ..scale }
    }

    /// Creates a scale from zero to the largest gap. If the material yields, the scale begins at
    /// the deepest negative gap.
    pub fn from_gaps(gaps: &[f64]) -> Scale {
        let scale = Scale::over(VIRIDIS, gaps);
        // Gaps are solved to a tolerance, so slightly negative gaps do not mean yielding.
        let yields = scale.lowest < -1e-3 * scale.highest;
        Scale { lowest: if yields { scale.lowest } else { 0.0 }, ..scale }
    }

    /// Creates a scale from the lowest to the highest displacement.
    pub fn from_displacements(displacements: &[f64]) -> Scale {
        Scale::over(PLASMA, displacements)
    }

    /// Extends the scale such that it covers another one.
    pub fn covering(self, other: Scale) -> Scale {
        let kind = if other.diverges { other } else { self };
        Scale {
            lowest: self.lowest.min(other.lowest),
            highest: self.highest.max(other.highest),
            ..kind
        }
    }

    fn over(gradient: Gradient, values: &[f64]) -> Scale {
        let values = || values.iter().copied();
        Scale {
            gradient,
            lowest: values().fold(f64::INFINITY, f64::min),
            highest: values().fold(f64::NEG_INFINITY, f64::max),
            diverges: false,
        }
    }

    /// Returns the numbers at both ends of the scale.
    pub fn range(&self) -> RangeInclusive<f64> {
        self.lowest..=self.highest
    }

    /// Returns the colours of the scale, from the lowest to the highest number.
    pub fn bar(&self) -> Raster {
        let colour = |step: usize| {
            let share = step as f64 / (PALETTE - 1) as f64;
            self.colour(self.lowest + share * (self.highest - self.lowest))
        };
        Raster { width: PALETTE, height: 1, pixels: (0..PALETTE).map(colour).collect() }
    }

    /// Returns the colour of a number. Numbers beyond an end have the colour of the end.
    pub fn colour(&self, value: f64) -> Pixel {
        let share = if self.diverges {
            let end = if value < 0.0 { -self.lowest } else { self.highest };
            let share = if end > 0.0 { (value / end).clamp(-1.0, 1.0) } else { 0.0 };
            0.5 - 0.5 * share
        } else {
            (value - self.lowest) / (self.highest - self.lowest)
        };
        // A constant map has no range, so it has one colour.
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.5 };
        // A palette holds more colours than the eye distinguishes.
        let step = ((PALETTE - 1) as f64 * share).round();
        self.gradient.eval_rational(step as usize, PALETTE).into_array()
    }
}

/// Returns the colour of nodes whose contact begins at load number `load` of `count` ascending
/// loads. Heavier loads have lighter colours.
pub fn colour_of_load(load: usize, count: usize) -> Pixel {
    let share = 1.0 - 0.85 * load as f64 / count.max(1) as f64;
    YELLOW_GREEN_BLUE.eval_continuous(share).into_array()
}

impl Raster {
    /// Draws the heights of nodes, row-major, with NaN for missing ones.
    pub fn from_heights(nodes: [usize; 2], heights: &[f64]) -> Raster {
        Raster::from_heights_on(&Scale::from_heights(heights), nodes, heights)
    }

    pub fn from_heights_on(scale: &Scale, nodes: [usize; 2], heights: &[f64]) -> Raster {
        Raster::from_nodes(nodes, |node| {
            if heights[node].is_nan() { HOLE } else { scale.colour(heights[node]) }
        })
    }

    /// Draws the pressures of nodes, row-major, with zero for nodes out of contact.
    pub fn from_pressures(nodes: [usize; 2], pressures: &[f64]) -> Raster {
        let scale = Scale::from_pressures(pressures);
        Raster::from_nodes(nodes, |node| {
            if pressures[node] > 0.0 { scale.colour(pressures[node]) } else { GAP }
        })
    }

    /// Draws the values of nodes, row-major.
    pub fn from_values(nodes: [usize; 2], values: &[f64], colour: impl Fn(f64) -> Pixel) -> Raster {
        Raster::from_nodes(nodes, |node| colour(values[node]))
    }

    pub fn from_contact(map: &ContactMap) -> Raster {
        let row_nodes = map.nodes()[1];
        let touches = |node: usize| map.get(node / row_nodes, node % row_nodes);
        Raster::from_nodes(map.nodes(), |node| if touches(node) { CONTACT } else { GAP })
    }

    /// Draws the contact maps of a surface at ascending loads in one picture: each node has the
    /// colour of the lightest load at which it is in contact.
    ///
    /// # Panics
    /// If the maps have different meshes, or there are none.
    pub fn from_contacts(maps: &[ContactMap]) -> Raster {
        let nodes = maps[0].nodes();
        Raster::from_nodes(nodes, |node| {
            let touches = |map: &ContactMap| map.get(node / nodes[1], node % nodes[1]);
            let first = maps.iter().position(touches);
            first.map_or(GAP, |load| colour_of_load(load, maps.len()))
        })
    }

    /// Returns the colours of ascending loads in [`Raster::from_contacts`].
    pub fn from_loads(count: usize) -> Raster {
        let pixels = (0..count).map(|load| colour_of_load(load, count)).collect();
        Raster { width: count, height: 1, pixels }
    }

    /// Creates a picture from its pixels by rows, from the top.
    ///
    /// # Panics
    /// If the number of pixels is not `width` × `height`.
    pub fn from_pixels([width, height]: [usize; 2], pixels: Vec<Pixel>) -> Raster {
        assert_eq!(pixels.len(), width * height, "a picture is a rectangle");
        Raster { width, height, pixels }
    }

    /// Draws nodes with x to the right and y upwards.
    fn from_nodes([nodes_x, nodes_y]: [usize; 2], colour: impl Fn(usize) -> Pixel) -> Raster {
        let rows = (0..nodes_y).rev();
        let pixels = rows.flat_map(|j| (0..nodes_x).map(move |i| i * nodes_y + j));
        Raster { width: nodes_x, height: nodes_y, pixels: pixels.map(colour).collect() }
    }

    /// Returns the pixels by rows, from the top.
    pub fn as_slice(&self) -> &[Pixel] {
        &self.pixels
    }

    /// Returns the pixels by rows, from the top.
    #[cfg(test)]
    pub(super) fn pixels(&self) -> impl Iterator<Item = &Pixel> {
        self.pixels.iter()
    }

    /// Returns the different colours, sorted.
    pub fn palette(&self) -> Vec<Pixel> {
        let mut palette = self.pixels.clone();
        palette.sort_unstable();
        palette.dedup();
        palette
    }

    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Returns the picture with square pixels for a map with these sides. If the mesh step is
    /// larger along one axis, each node becomes several pixels along this axis.
    pub fn in_proportion(self, [size_x, size_y]: [f64; 2]) -> Raster {
        let [step_x, step_y] = [size_x / self.width as f64, size_y / self.height as f64];
        let pixels = |size: f64| (size / step_x.min(step_y)).round() as usize;
        let [width, height] = [pixels(size_x), pixels(size_y)];
        if [width, height] == self.size() {
            return self;
        }
        let cells = (0..height).flat_map(|row| (0..width).map(move |column| (row, column)));
        let nearest = |(row, column): (usize, usize)| {
            let row = row * self.height / height;
            self.pixels[row * self.width + column * self.width / width]
        };
        Raster { width, height, pixels: cells.map(nearest).collect() }
    }

    /// Reduces the picture to at most `most` pixels per side. Each new pixel is the mean over a
    /// square of old pixels.
    pub fn at_most(&self, most: usize) -> Raster {
        let factor = self.width.max(self.height).div_ceil(most.max(1));
        if factor <= 1 {
            return self.clone();
        }
        let [width, height] = self.size().map(|side| side.div_ceil(factor));
        let cells = (0..height).flat_map(|row| (0..width).map(move |column| (row, column)));
        let mean = |(row, column): (usize, usize)| {
            let rows = factor * row..(factor * (row + 1)).min(self.height);
            let columns = factor * column..(factor * (column + 1)).min(self.width);
            let count = (rows.len() * columns.len()) as u32;
            let mut sum = [0; 3];
            for row in rows {
                for pixel in &self.pixels[row * self.width..][columns.clone()] {
                    let channels = sum.iter_mut().zip(pixel);
                    channels.for_each(|(sum, &channel)| *sum += u32::from(channel));
                }
            }
            sum.map(|sum| ((sum + count / 2) / count) as u8)
        };
        Raster { width, height, pixels: cells.map(mean).collect() }
    }

    /// Encodes the picture as PNG. Equal pictures give equal bytes. Pictures with few colours use a
    /// palette, which takes a third of the space.
    pub fn to_png(&self) -> Vec<u8> {
        let palette = self.palette();
        let size = self
            .size()
            .map(|side| u32::try_from(side).expect("a picture has fewer than 2³² pixels per side"));
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
        encoder.set_compression(png::Compression::High);
        let palette_index = |pixel: &Pixel| {
            palette.binary_search(pixel).expect("the palette contains all colours") as u8
        };
        let pixels = if palette.len() <= PALETTE {
            encoder.set_color(png::ColorType::Indexed);
            encoder.set_palette(palette.as_flattened().to_vec());
            self.pixels.iter().map(palette_index).collect()
        } else {
            encoder.set_color(png::ColorType::Rgb);
            self.pixels.as_flattened().to_vec()
        };
        encoder
            .write_header()
            .and_then(|mut writer| writer.write_image_data(&pixels))
            .expect("writing to memory cannot fail");
        bytes
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    pub raster: Raster,
    /// Colours of the scale, from the lowest to the highest height.
    pub colours: Raster,
    /// Lowest and highest height of all nodes, relative to their mean; `None` if all are missing.
    pub range: Option<[f64; 2]>,
    /// Sides of the map.
    pub size: [f64; 2],
}

impl HeightMap {
    /// Draws the heights of nodes, row-major with NaN for missing ones, on at most `most` pixels
    /// per side.
    ///
    /// On a larger map, a pixel is a rectangle of nodes: the mean of the known heights, or a hole
    /// if at least half of them are missing. So holes keep their area.
    pub fn new(nodes: [usize; 2], size: [f64; 2], heights: &[f64], most: usize) -> HeightMap {
        let scale = Scale::from_heights(heights);
        let (pixels, means) = reduced(nodes, heights, most);
        let (lowest, highest) = scale.range().into_inner();
        // Subtract the lowest height, because an instrument may measure from far below.
        let known = heights.iter().filter(|height| !height.is_nan());
        let above: f64 = known.clone().map(|height| height - lowest).sum();
        let mean = above / known.count() as f64;
        HeightMap {
            raster: Raster::from_heights_on(&scale, pixels, &means),
            colours: scale.bar(),
            range: (lowest <= highest).then_some([-mean, highest - lowest - mean]),
            size,
        }
    }
}

/// Averages the heights over rectangles of nodes. Returns the numbers of rectangles along x and y,
/// each at most `most`, and the means.
fn reduced(nodes: [usize; 2], heights: &[f64], most: usize) -> ([usize; 2], Vec<f64>) {
    let [step_x, step_y] = nodes.map(|side| side.div_ceil(most.max(1)));
    let pixels = [nodes[0].div_ceil(step_x), nodes[1].div_ceil(step_y)];
    let mut means = Vec::with_capacity(pixels[0] * pixels[1]);
    for rows in heights.chunks(step_x * nodes[1]) {
        for first in (0..nodes[1]).step_by(step_y) {
            let (mut sum, mut known, mut missing) = (0.0, 0, 0);
            for row in rows.chunks_exact(nodes[1]) {
                for height in &row[first..nodes[1].min(first + step_y)] {
                    if height.is_nan() {
                        missing += 1
                    } else {
                        known += 1;
                        sum += height;
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
    use super::*;

    fn contact(nodes: usize, touches: impl Fn(usize, usize) -> bool) -> ContactMap {
        let pressure = |node| f64::from(u8::from(touches(node / nodes, node % nodes)));
        let pressures: Vec<f64> = (0..nodes * nodes).map(pressure).collect();
        ContactMap::from_pressures([nodes; 2], &pressures)
    }

    #[test]
    fn x_runs_to_the_right_and_y_upwards() {
        let at_x_axis_end = contact(3, |i, j| (i, j) == (2, 0));
        let picture = Raster::from_contact(&at_x_axis_end);
        let dark = picture.pixels.iter().position(|&pixel| pixel == CONTACT);
        assert_eq!(dark, Some(8), "the lower right corner");
    }

    #[test]
    fn a_rectangle_is_as_wide_as_x_and_as_high_as_y() {
        let picture = Raster::from_pressures([3, 2], &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(picture.size(), [3, 2]);
        let dark = picture.pixels.iter().position(|&pixel| pixel != GAP);
        assert_eq!(dark, Some(2), "the upper right corner");
    }

    #[test]
    fn the_lowest_and_the_highest_node_have_the_ends_of_the_scale() {
        let picture = Raster::from_heights([2, 2], &[-1.0, 0.0, 0.5, 3.0]);
        let ends = [0.0, 1.0].map(|share| CIVIDIS.eval_continuous(share).into_array());
        assert_eq!([picture.pixels[2], picture.pixels[1]], ends);
    }

    #[test]
    fn missing_heights_are_holes_and_change_no_other_colour() {
        let whole = Raster::from_heights([2, 2], &[-1.0, 0.0, 0.5, 3.0]);
        let holed = Raster::from_heights([2, 2], &[-1.0, f64::NAN, 0.5, 3.0]);
        let differ = |node: &usize| whole.pixels[*node] != holed.pixels[*node];
        let holes: Vec<usize> = (0..4).filter(differ).collect();
        assert_eq!(holes, [0], "the upper left corner");
        assert_eq!(holed.pixels[0], HOLE);
    }

    #[test]
    fn a_flat_surface_has_one_colour() {
        let picture = Raster::from_heights([2, 2], &[0.7; 4]);
        assert!(picture.pixels.iter().all(|&p| p == picture.pixels[0]));
    }

    #[test]
    fn nodes_without_pressure_are_a_gap_and_not_the_lowest_pressure() {
        let picture = Raster::from_pressures([2, 2], &[0.0, 1.0, 2.0, 0.0]);
        let gaps = picture.pixels.iter().filter(|&&pixel| pixel == GAP).count();
        assert_eq!(gaps, 2);
    }

    #[test]
    fn a_node_has_the_colour_of_the_lightest_load_under_which_it_touches() {
        let light = contact(2, |i, j| (i, j) == (0, 1));
        let heavy = contact(2, |i, _| i == 0);
        let picture = Raster::from_contacts(&[light, heavy]);
        let expected = [colour_of_load(0, 2), GAP, colour_of_load(1, 2), GAP];
        assert_eq!(picture.pixels, expected);
    }

    #[test]
    fn a_smaller_picture_has_the_mean_of_each_square() {
        let map = contact(5, |i, _| i < 2);
        let small = Raster::from_contact(&map).at_most(3);
        assert_eq!(small.size(), [3, 3]);
        let row: Vec<Pixel> = small.pixels[..3].to_vec();
        assert_eq!(row, [CONTACT, GAP, GAP]);
        let half = contact(4, |i, _| i == 0);
        let mean = Raster::from_contact(&half).at_most(2).pixels[0];
        assert_eq!(mean, [147; 3], "half way from 38 to 255, rounded up");
    }

    #[test]
    fn nodes_that_are_further_apart_along_one_axis_are_longer_along_it() {
        let picture = || Raster::from_heights([3, 2], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(picture().in_proportion([0.3, 0.2]), picture());
        let high = picture().in_proportion([3.0, 4.0]);
        assert_eq!(high.size(), [3, 4]);
        let rows: Vec<&[Pixel]> = high.pixels.chunks(3).collect();
        assert!(rows[0] == rows[1] && rows[1] != rows[2] && rows[2] == rows[3]);
        let wide = picture().in_proportion([7.5, 2.0]);
        assert_eq!(wide.size(), [8, 2]);
        assert_eq!([wide.pixels[0], wide.pixels[7]], [picture().pixels[0], picture().pixels[2]]);
    }

    #[test]
    fn signed_pressures_have_two_colours_and_zero_is_between_them() {
        let scale = Scale::from_signed_pressures(&[-0.1, 0.0, 2.0]);
        let is_red = |value: f64| {
            let [red, _, blue] = scale.colour(value);
            (red > blue, red < blue)
        };
        assert_eq!(
            [2.0, 0.2, -0.01, -0.1].map(is_red).map(|colour| colour.0),
            [true, true, false, false]
        );
        assert!(is_red(-0.01).1 && scale.colour(0.0).iter().all(|&channel| channel > 235));
        // The bar is linear in the pressure, so zero lies at its share of the range.
        let bar = scale.bar();
        assert_eq!(bar.as_slice()[0], scale.colour(-0.1));
        assert_eq!(bar.as_slice()[PALETTE - 1], scale.colour(2.0));
        let zero = (0.1 / 2.1 * (PALETTE - 1) as f64) as usize;
        assert!(bar.as_slice()[zero].iter().all(|&channel| channel > 200));
        let both = Scale::from_pressures(&[0.0, 3.0]).covering(scale);
        assert_eq!(both.range(), -0.1..=3.0);
        assert_eq!(both.colour(-0.1), scale.colour(-0.1));
    }

    #[test]
    fn a_png_holds_the_pixels_and_is_the_same_every_time() {
        let few = Raster::from_heights([3, 3], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        holds_the_pixels(&few);
        let more_than_a_palette =
            Raster::from_nodes([20, 20], |node| [node as u8, (node / 256) as u8, 7]);
        holds_the_pixels(&more_than_a_palette);
    }

    #[track_caller]
    fn holds_the_pixels(picture: &Raster) {
        let bytes = picture.to_png();
        assert_eq!(bytes, picture.to_png());
        let mut decoder = png::Decoder::new(std::io::Cursor::new(&bytes));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, picture.pixels.as_flattened());
    }

    #[test]
    fn a_map_that_is_small_enough_is_the_map_itself() {
        let heights: Vec<f64> = (0..12).map(f64::from).collect();
        assert_eq!(reduced([4, 3], &heights, 4), ([4, 3], heights.clone()));
        let map = HeightMap::new([4, 3], [1.0; 2], &heights, 4);
        assert_eq!(map.raster, Raster::from_heights([4, 3], &heights));
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
        let picture = HeightMap::new([4, 4], [1.0; 2], &heights, 2);
        assert_eq!(picture.range, Some([-3.0, 2.0]), "of the nodes, not of the pixels");
        let holes = picture.raster.pixels().filter(|pixel| **pixel == HOLE);
        assert_eq!(holes.count(), 1);
    }

    #[test]
    fn nothing_known_has_no_range() {
        assert_eq!(HeightMap::new([1, 2], [1.0; 2], &[f64::NAN; 2], 8).range, None);
    }
}
