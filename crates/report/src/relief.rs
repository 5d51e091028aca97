//! Shaded pictures of surfaces in perspective, as if seen from the front and above.
//!
//! x runs to the right, y to the back, and heights upwards, enlarged by a round factor. The colours
//! of the nodes are those of any map of the surface. Light falls from the upper left. Walls at the
//! edges show the profile of the surface.

use crate::charts::raster::{GAP, Pixel, Raster, reduced};
use asperity_mechanics::grid::Grid;

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

/// Triangle of the top or of a wall.
#[derive(Debug, Clone, Copy)]
struct Triangle {
    /// Positions in the scene.
    corners: [Vector; 3],
    face: Face,
}

#[derive(Debug, Clone, Copy)]
enum Face {
    /// Part of the top. Each corner has its place on the mesh, in nodes along x and y.
    Top([[f64; 2]; 3]),
    /// Part of a wall, with its shaded colour.
    Wall([f64; 3]),
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
        let triangles = [block.top(), block.walls()].concat();
        Relief { raster: render(&triangles, &Top::new(&block, colours)), factor }
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
    fn top(&self) -> Vec<Triangle> {
        let [nodes_x, nodes_y] = self.nodes;
        let triangle = |nodes: [(usize, usize); 3]| Triangle {
            corners: nodes.map(|(i, j)| self.position(i, j)),
            face: Face::Top(nodes.map(|(i, j)| [i as f64, j as f64])),
        };
        let cells = (1..nodes_x).flat_map(|i| (1..nodes_y).map(move |j| (i, j)));
        let halves = |(i, j): (usize, usize)| {
            let [a, b, c, d] = [(i - 1, j - 1), (i, j - 1), (i, j), (i - 1, j)];
            [triangle([a, b, c]), triangle([a, c, d])]
        };
        cells.flat_map(halves).collect()
    }

    /// Returns the walls from the edges of the top to the base.
    fn walls(&self) -> Vec<Triangle> {
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
            let face = Face::Wall(WALL.map(|part| part * brightness(normal)));
            let corner = |(i, j): (usize, usize), on_top: bool| {
                let [x, y, z] = self.position(i, j);
                [x, y, if on_top { z } else { 0.0 }]
            };
            for pair in edge.windows(2) {
                let [a, b] = [corner(pair[0], true), corner(pair[1], true)];
                let [c, d] = [corner(pair[1], false), corner(pair[0], false)];
                triangles.extend([[a, b, c], [a, c, d]].map(|corners| Triangle { corners, face }));
            }
        }
        triangles
    }
}

/// Normals and colours of the top. Both are interpolated in the cell between four nodes and not in
/// its triangles, whose diagonals would otherwise be seen as fringes of slopes and spots.
struct Top<'a> {
    nodes: [usize; 2],
    normals: Vec<Vector>,
    colours: &'a Raster,
}

impl Top<'_> {
    fn new<'a>(block: &Block, colours: &'a Raster) -> Top<'a> {
        let [nodes_x, nodes_y] = block.nodes;
        let nodes = (0..nodes_x).flat_map(|i| (0..nodes_y).map(move |j| (i, j)));
        let normals = nodes.map(|(i, j)| block.normal(i, j)).collect();
        Top { nodes: block.nodes, normals, colours }
    }

    /// Returns the shaded colour at a place on the mesh, in nodes along x and y.
    fn colour(&self, place: [f64; 2]) -> [f64; 3] {
        let (cell, weights) = cell_of(place, self.nodes);
        let normals = cell.map(|[i, j]| self.normals[i * self.nodes[1] + j]);
        let shade = brightness(mixed(normals, weights));
        self.colour_in_map(place).map(|part| part * shade)
    }

    /// Returns the colour of the map at a place, interpolated between the four nodes around it. If
    /// one of these nodes has no colour, the colour is that of the nearest node, so that the edge
    /// of a contact spot is sharp.
    fn colour_in_map(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        let size = self.colours.size();
        let along = |axis: usize, place: f64| {
            (place + 0.5) * size[axis] as f64 / self.nodes[axis] as f64 - 0.5
        };
        let (cell, weights) = cell_of([along(0, x), along(1, y)], size);
        // A map has y upwards.
        let pixels = cell.map(|[i, j]| self.colours.as_slice()[(size[1] - 1 - j) * size[0] + i]);
        let colour = |pixel: Pixel| if pixel == GAP { PLAIN } else { pixel.map(f64::from) };
        if pixels.contains(&GAP) {
            let nearest = (0..4).max_by(|&one, &other| weights[one].total_cmp(&weights[other]));
            return colour(pixels[nearest.expect("there are four nodes")]);
        }
        mixed(pixels.map(colour), weights)
    }
}

/// Returns the indices of the four nodes around a place, and their weights in an interpolation.
fn cell_of(place: [f64; 2], nodes: [usize; 2]) -> ([[usize; 2]; 4], [f64; 4]) {
    let [x, y] = [0, 1].map(|axis| place[axis].clamp(0.0, (nodes[axis] - 1) as f64));
    let [i, j] = [x as usize, y as usize];
    let (u, v) = (x - i as f64, y - j as f64);
    let [next_i, next_j] = [(i + 1).min(nodes[0] - 1), (j + 1).min(nodes[1] - 1)];
    let corners = [[i, j], [next_i, j], [i, next_j], [next_i, next_j]];
    (corners, [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v])
}

fn mixed<const N: usize>(values: [[f64; 3]; N], weights: [f64; N]) -> [f64; 3] {
    [0, 1, 2].map(|part| values.iter().zip(weights).map(|(value, w)| w * value[part]).sum())
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
fn render(triangles: &[Triangle], top: &Top) -> Raster {
    let points = || triangles.iter().flat_map(|triangle| triangle.corners.map(projected));
    let range = |axis: usize| {
        points().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| {
            [low.min(point[axis]), high.max(point[axis])]
        })
    };
    let ([left, right], [bottom, highest]) = (range(0), range(1));
    let margin = MARGIN * WIDTH as f64;
    let scale = (WIDTH as f64 - 2.0 * margin) / (right - left);
    let least_height = (scale * (highest - bottom) + 2.0 * margin).ceil() as usize;
    let height = least_height.next_multiple_of(SUPERSAMPLING);
    let mut canvas = Canvas {
        size: [WIDTH, height],
        pixels: vec![PAPER; WIDTH * height],
        depths: vec![f64::INFINITY; WIDTH * height],
    };
    for Triangle { corners, face } in triangles {
        let on_canvas = corners.map(|position| {
            let [x, y, depth] = projected(position);
            [margin + scale * (x - left), margin + scale * (highest - y), depth]
        });
        canvas.fill(on_canvas, |weights| match face {
            Face::Wall(colour) => *colour,
            Face::Top(places) => top.colour([0, 1].map(|axis| {
                places.iter().zip(weights).map(|(place, weight)| weight * place[axis]).sum()
            })),
        });
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
    /// Fills a triangle. `colour` returns the colour of a point, given the weights of the corners.
    fn fill(&mut self, [a, b, c]: [Vector; 3], colour: impl Fn([f64; 3]) -> [f64; 3]) {
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
                let [_, _, depth] = mixed([a, b, c], weights);
                let index = row * self.size[0] + column;
                if depth < self.depths[index] {
                    self.depths[index] = depth;
                    self.pixels[index] = colour(weights).map(|part| part as u8);
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
    use asperity_mechanics::grid::Cell;

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
            Top::new(&block, &colours).colour([4.3, 4.6])[0]
        };
        assert!(mean(0.2) > mean(0.0) && mean(0.0) > mean(-0.2));
    }

    #[test]
    fn colours_are_interpolated_in_cells_and_sharp_at_the_edge_of_a_spot() {
        let block = Block { nodes: [3, 3], size: [1.0; 2], heights: vec![0.0; 9] };
        let map = |left: Pixel, right: Pixel| {
            let values: Vec<f64> = (0..9).map(|node| f64::from(u8::from(node >= 6))).collect();
            Raster::from_values([3, 3], &values, |value| if value > 0.0 { right } else { left })
        };
        let red =
            |colours: &Raster, x: f64, y: f64| Top::new(&block, colours).colour_in_map([x, y])[0];
        let smooth = map([100, 0, 0], [200, 0, 0]);
        for y in [0.1, 0.5, 0.9] {
            assert!((red(&smooth, 1.25, y) - 125.0).abs() < 1e-9, "independent of y");
        }
        let spot = map(GAP, [200, 0, 0]);
        assert_eq!((red(&spot, 1.4, 0.7), red(&spot, 1.6, 0.7)), (PLAIN[0], 200.0));
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
