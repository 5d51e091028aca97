//! Shaded pictures of surfaces in perspective, as if seen from the front and above.
//!
//! x runs to the right, y to the back, and heights upwards, enlarged by a round factor. The colours
//! of the nodes are those of any map of the surface. Light falls from the upper left. Walls at the
//! edges show the profile of the surface.

use crate::charts::raster::{GAP, Pixel, Raster, reduced};
use asperity_contact::grid::Grid;

/// Largest number of quadrilaterals along a side.
const MOST_NODES: usize = 512;
/// Width of a picture before it is reduced, in pixels.
const WIDTH: usize = 1920;
/// Pixels before the reduction per pixel after it.
const SUPERSAMPLING: usize = 2;
/// Largest height of the relief relative to the longer side.
const RELIEF: f64 = 0.22;
/// Thickness of the block below the lowest point, relative to the longer side.
const BASE: f64 = 0.06;
/// Margin around the block, as a fraction of the width.
const MARGIN: f64 = 0.02;
/// Sine and cosine of the rotation of the block about its vertical axis.
const ROTATION: [f64; 2] = [-8.0 / 17.0, 15.0 / 17.0];
/// Sine and cosine of the elevation of the camera above the horizon.
const ELEVATION: [f64; 2] = [0.6, 0.8];
/// Distance of the camera from the centre of the block, in longer sides.
const DISTANCE: f64 = 3.2;
/// Direction towards the light: x, y and up.
const LIGHT: [f64; 3] = [-0.56, -0.36, 0.75];
/// Brightness in the shadow, from 0 to 1.
const AMBIENT: f64 = 0.38;
/// Colour of nodes that are white in a map, such as nodes out of contact.
const PLAIN: [f64; 3] = [214.0, 211.0, 205.0];
/// Colour of the walls.
const WALL: [f64; 3] = [150.0, 150.0, 155.0];
const PAPER: Pixel = [255, 255, 255];

/// Picture of a surface, with the factor by which heights are enlarged.
#[derive(Debug, Clone, PartialEq)]
pub struct Relief {
    pub raster: Raster,
    pub factor: f64,
}

type Vector = [f64; 3];

/// Corner of a triangle: position in the scene, and shaded colour.
#[derive(Debug, Clone, Copy)]
struct Corner {
    position: Vector,
    colour: [f64; 3],
}

impl Relief {
    /// Draws a surface with heights in the unit of its sides. `colours` is a map of the surface.
    pub fn draw(grid: Grid, heights: &[f64], colours: &Raster) -> Relief {
        let longer = grid.cell().longer_side();
        let (nodes, heights) = reduced(grid.nodes(), heights, MOST_NODES);
        let (lowest, highest) = heights
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(*h), high.max(*h)));
        let factor = round_factor(RELIEF * longer / (highest - lowest));
        let block = Block {
            nodes,
            size: grid.cell().size().map(|side| side / longer),
            heights: heights.iter().map(|h| factor * (h - lowest) / longer).collect(),
        };
        let triangles = [block.top(colours), block.walls()].concat();
        Relief { raster: render(&triangles), factor }
    }
}

/// Rounds a factor down to 1, 2 or 5 times a power of ten; 1 for a flat surface.
fn round_factor(most: f64) -> f64 {
    if !(most > 0.0 && most.is_finite()) {
        return 1.0;
    }
    let power = 10f64.powf(most.log10().floor());
    let step = [5.0, 2.0].into_iter().find(|step| step * power <= most);
    step.unwrap_or(1.0) * power
}

/// A block whose top is the surface, in units of the longer side.
struct Block {
    nodes: [usize; 2],
    size: [f64; 2],
    heights: Vec<f64>,
}

impl Block {
    fn height(&self, i: usize, j: usize) -> f64 {
        self.heights[i * self.nodes[1] + j]
    }

    /// Returns the position of a node, with the origin at the centre of the base.
    fn position(&self, i: usize, j: usize) -> Vector {
        let along = |axis: usize, index: usize| {
            let share = index as f64 / (self.nodes[axis].max(2) - 1) as f64;
            self.size[axis] * (share - 0.5)
        };
        [along(0, i), along(1, j), BASE + self.height(i, j)]
    }

    /// Returns the upward normal from the differences between neighbours.
    fn normal(&self, i: usize, j: usize) -> Vector {
        let [last_i, last_j] = self.nodes.map(|nodes| nodes - 1);
        let [west, east] = [(i.saturating_sub(1), j), ((i + 1).min(last_i), j)];
        let [south, north] = [(i, j.saturating_sub(1)), (i, (j + 1).min(last_j))];
        let along = |from: (usize, usize), to: (usize, usize)| {
            let (from, to) = (self.position(from.0, from.1), self.position(to.0, to.1));
            [0, 1, 2].map(|axis| to[axis] - from[axis])
        };
        let (x, y) = (along(west, east), along(south, north));
        cross(x, y)
    }

    /// Returns two triangles for each cell between four nodes.
    fn top(&self, colours: &Raster) -> Vec<[Corner; 3]> {
        let [nodes_x, nodes_y] = self.nodes;
        let [width, height] = colours.size();
        let corner = |i: usize, j: usize| {
            // A map has y upwards.
            let (column, row) = (i * width / nodes_x, (nodes_y - 1 - j) * height / nodes_y);
            let pixel = colours.as_slice()[row * width + column];
            let colour = if pixel == GAP { PLAIN } else { pixel.map(f64::from) };
            let shade = brightness(self.normal(i, j));
            Corner { position: self.position(i, j), colour: colour.map(|part| part * shade) }
        };
        let corners: Vec<Corner> =
            (0..nodes_x * nodes_y).map(|node| corner(node / nodes_y, node % nodes_y)).collect();
        let at = |i: usize, j: usize| corners[i * nodes_y + j];
        let cells = (1..nodes_x).flat_map(|i| (1..nodes_y).map(move |j| (i, j)));
        let halves = |(i, j): (usize, usize)| {
            let [a, b, c, d] = [at(i - 1, j - 1), at(i, j - 1), at(i, j), at(i - 1, j)];
            [[a, b, c], [a, c, d]]
        };
        cells.flat_map(halves).collect()
    }

    /// Returns the walls from the edges of the top to the base.
    fn walls(&self) -> Vec<[Corner; 3]> {
        let [last_x, last_y] = self.nodes.map(|nodes| nodes - 1);
        let along_x = |j: usize| (0..=last_x).map(move |i| (i, j)).collect::<Vec<_>>();
        let along_y = |i: usize| (0..=last_y).map(move |j| (i, j)).collect::<Vec<_>>();
        let sides = [
            (along_x(0), [0.0, -1.0, 0.0]),
            (along_x(last_y), [0.0, 1.0, 0.0]),
            (along_y(0), [-1.0, 0.0, 0.0]),
            (along_y(last_x), [1.0, 0.0, 0.0]),
        ];
        let mut triangles = Vec::new();
        for (edge, normal) in sides {
            let colour = WALL.map(|part| part * brightness(normal));
            let corner = |(i, j): (usize, usize), on_top: bool| {
                let mut position = self.position(i, j);
                position[2] = if on_top { position[2] } else { 0.0 };
                Corner { position, colour }
            };
            for pair in edge.windows(2) {
                let [a, b] = [corner(pair[0], true), corner(pair[1], true)];
                let [c, d] = [corner(pair[1], false), corner(pair[0], false)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        triangles
    }
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns the brightness of a face with this normal, from the ambient light to 1.
fn brightness(normal: Vector) -> f64 {
    let dot = |a: Vector, b: Vector| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let length = (dot(normal, normal) * dot(LIGHT, LIGHT)).sqrt();
    let cosine = if length > 0.0 { dot(normal, LIGHT) / length } else { 1.0 };
    // A horizontal face is nearly as bright as its colour in the map.
    (AMBIENT + 0.85 * (1.0 - AMBIENT) * cosine.max(0.0) / LIGHT[2]).min(1.0)
}

/// Returns the position on the screen in longer sides, right and up, and the depth.
fn projected([x, y, z]: Vector) -> Vector {
    let [sin, cos] = ROTATION;
    let (right, back) = (x * cos - y * sin, x * sin + y * cos);
    let [sin, cos] = ELEVATION;
    let (up, depth) = (back * sin + z * cos, back * cos - z * sin);
    let perspective = DISTANCE / (DISTANCE + depth);
    [right * perspective, up * perspective, depth]
}

/// Draws triangles with a depth buffer.
fn render(triangles: &[[Corner; 3]]) -> Raster {
    let points = || triangles.iter().flatten().map(|corner| projected(corner.position));
    let range = |axis: usize| {
        points().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| {
            [low.min(point[axis]), high.max(point[axis])]
        })
    };
    let ([left, right], [bottom, top]) = (range(0), range(1));
    let margin = MARGIN * WIDTH as f64;
    let scale = (WIDTH as f64 - 2.0 * margin) / (right - left);
    let height = (scale * (top - bottom) + 2.0 * margin).ceil() as usize;
    let height = height.next_multiple_of(SUPERSAMPLING);
    let mut canvas = Canvas {
        size: [WIDTH, height],
        pixels: vec![PAPER; WIDTH * height],
        depths: vec![f64::INFINITY; WIDTH * height],
    };
    for triangle in triangles {
        canvas.fill(triangle.map(|Corner { position, colour }| {
            let [x, y, depth] = projected(position);
            ([margin + scale * (x - left), margin + scale * (top - y), depth], colour)
        }));
    }
    let picture = Raster::from_pixels(canvas.size, canvas.pixels);
    picture.at_most(WIDTH.max(height) / SUPERSAMPLING)
}

struct Canvas {
    size: [usize; 2],
    pixels: Vec<Pixel>,
    depths: Vec<f64>,
}

impl Canvas {
    /// Fills a triangle, interpolating depth and colour between its corners.
    fn fill(&mut self, corners: [(Vector, [f64; 3]); 3]) {
        let [a, b, c] = corners.map(|(position, _)| position);
        let area = edge(a, b, c);
        if area == 0.0 {
            return;
        }
        let span = |axis: usize| {
            let values = [a, b, c].map(|corner| corner[axis]);
            let low = values.iter().copied().fold(f64::INFINITY, f64::min).max(0.0) as usize;
            let high = values.iter().copied().fold(0.0, f64::max) as usize + 1;
            low..high.min(self.size[axis])
        };
        let (columns, rows) = (span(0), span(1));
        for row in rows {
            for column in columns.clone() {
                let point = [column as f64 + 0.5, row as f64 + 0.5, 0.0];
                let weights =
                    [edge(b, c, point), edge(c, a, point), edge(a, b, point)].map(|w| w / area);
                if weights.iter().any(|weight| *weight < 0.0) {
                    continue;
                }
                let mix = |values: [f64; 3]| {
                    weights.iter().zip(values).map(|(weight, value)| weight * value).sum::<f64>()
                };
                let depth = mix([a[2], b[2], c[2]]);
                let index = row * self.size[0] + column;
                if depth < self.depths[index] {
                    self.depths[index] = depth;
                    let channel = |of: usize| mix(corners.map(|(_, colour)| colour[of])) as u8;
                    self.pixels[index] = [channel(0), channel(1), channel(2)];
                }
            }
        }
    }
}

/// Returns twice the signed area of the triangle on the screen.
fn edge(a: Vector, b: Vector, c: Vector) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_contact::grid::Cell;

    fn grid(nodes: [usize; 2]) -> Grid {
        Grid::new(nodes, Cell::new([1.0, 1.0]).unwrap()).unwrap()
    }

    fn single_colour(nodes: [usize; 2], colour: Pixel) -> Raster {
        Raster::from_pixels(nodes, vec![colour; nodes[0] * nodes[1]])
    }

    #[test]
    fn heights_are_enlarged_by_a_round_factor_that_keeps_the_relief_low() {
        assert_eq!([0.3, 1.0, 4.9, 70.0, 2300.0].map(round_factor), [0.2, 1.0, 2.0, 50.0, 2000.0]);
        assert_eq!([f64::INFINITY, f64::NAN, 0.0].map(round_factor), [1.0; 3]);
    }

    #[test]
    fn slopes_towards_the_light_are_brighter() {
        let colours = single_colour([9, 9], [200, 200, 200]);
        let mean = |slope: f64| {
            let heights: Vec<f64> = (0..81).map(|node| slope * f64::from(node / 9) / 9.0).collect();
            let block = Block { nodes: [9, 9], size: [1.0; 2], heights };
            let corners = block.top(&colours);
            corners.iter().flatten().map(|corner| corner.colour[0]).sum::<f64>()
        };
        assert!(mean(0.2) > mean(0.0) && mean(0.0) > mean(-0.2));
    }

    #[test]
    fn the_front_corner_is_below_the_back_corner_and_nearer() {
        let [front, back] = [[0.0, -0.5, 0.0], [0.0, 0.5, 0.0]].map(projected);
        assert!(front[1] < back[1] && front[2] < back[2]);
        assert!(projected([0.5, 0.0, 0.0])[0] > projected([-0.5, 0.0, 0.0])[0]);
        assert!(projected([0.0, 0.0, 0.1])[1] > projected([0.0; 3])[1]);
    }

    #[test]
    fn nodes_of_one_colour_are_seen_where_they_lie() {
        // The quarter at large x and small y is red. It is on the right of the picture.
        let nodes = [40, 40];
        let red = |i: usize, j: usize| i >= 20 && j < 20;
        let values: Vec<f64> =
            (0..1600).map(|node| f64::from(u8::from(red(node / 40, node % 40)))).collect();
        let colour = |value: f64| if value > 0.0 { [255, 0, 0] } else { GAP };
        let colours = Raster::from_values(nodes, &values, colour);
        let relief = Relief::draw(grid(nodes), &vec![0.0; 1600], &colours);
        let [width, height] = relief.raster.size();
        assert_eq!(width, WIDTH / SUPERSAMPLING);
        let is_red = |pixel: &Pixel| pixel[0] > 100 && pixel[1] < 20;
        let pixels = relief.raster.as_slice().iter().enumerate().filter(|(_, pixel)| is_red(pixel));
        let found: Vec<usize> = pixels.map(|(index, _)| index).collect();
        let mean = |of: &dyn Fn(usize) -> usize| {
            found.iter().map(|index| of(*index) as f64).sum::<f64>() / found.len() as f64
        };
        let share = found.len() as f64 / (width * height) as f64;
        assert!((0.08..0.25).contains(&share), "{share}");
        assert!(mean(&|index| index % width) > 0.55 * width as f64);
        assert!(mean(&|index| index / width) > 0.4 * height as f64);
    }

    #[test]
    fn a_wall_in_front_hides_the_valley_behind_it() {
        let nodes = [41, 41];
        let valley: Vec<f64> =
            (0..41 * 41).map(|node| if node % 41 < 3 { 0.2 } else { 0.0 }).collect();
        let colour = |value: f64| if value > 0.0 { GAP } else { [255, 0, 0] };
        let colours = Raster::from_values(nodes, &valley, colour);
        let red = |heights: &[f64]| {
            let picture = Relief::draw(grid(nodes), heights, &colours).raster;
            picture.as_slice().iter().filter(|pixel| pixel[0] > 100 && pixel[1] < 20).count()
        };
        assert!(red(&valley) < red(&vec![0.0; 41 * 41]) * 9 / 10);
    }
}
