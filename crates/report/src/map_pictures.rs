//! Pictures of single maps with a title, a scale bar and a colour bar, as PNG, SVG or PDF.
//!
//! Lengths and pressures have the unit that the manifest names. Without a unit, lengths are shown
//! relative to the longer side L of the map, and pressures relative to E*.

use crate::charts::map_panel::{BarNumbers, ColourBar, MapPanel, ScaleBar};
use crate::charts::raster::{CONTACT, GAP, PULLED, PUSHED, Pixel, Raster, Scale};
use crate::charts::svg::{self, PixelsError};
use crate::charts::{Figure, Panel, panel_of_map, pdf};
use crate::units::{Scaled, Unit, digits, scale_bar};
use asperity_mechanics::grid::Grid;
use asperity_mechanics::morphology::map::ContactMap;

/// Width of the longer side of a map in a picture, in units of the drawing.
const SIDE: f64 = 480.0;
/// Smallest number of pixels per unit of the drawing.
const LEAST_SCALE: f64 = 2.0;
/// Largest number of ticks of a colour bar.
const MOST_TICKS: f64 = 6.0;

/// Quantity of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    Height,
    /// 1 at nodes in contact and 0 at the others.
    Contact,
    /// 1 at nodes in contact that are pulled, 2 at nodes with positive pressure, and 0 at the
    /// others.
    AdhesiveContact,
    /// 1 at nodes with positive pressure of a contact with adhesion, and 0 at the others.
    Repulsive,
    Pressure,
    Gap,
    Displacement,
}

/// Values of the nodes of a mesh with their units.
#[derive(Debug, Clone, Copy)]
pub struct NodeValues<'a> {
    pub quantity: Quantity,
    /// Values, row-major.
    pub values: &'a [f64],
    pub grid: Grid,
    /// Unit of the values, if it is known.
    pub unit: Option<&'a str>,
    pub length_unit: Option<&'a str>,
    /// Effective modulus E* in the unit of the pressures.
    pub effective_modulus: f64,
}

impl NodeValues<'_> {
    /// Returns the colour scale of the values.
    pub fn scale(&self) -> Scale {
        match self.quantity {
            Quantity::Height => Scale::from_heights(self.values),
            Quantity::Pressure if self.values.iter().any(|value| *value < 0.0) => {
                Scale::from_signed_pressures(self.values)
            }
            Quantity::Contact
            | Quantity::AdhesiveContact
            | Quantity::Repulsive
            | Quantity::Pressure => Scale::from_pressures(self.values),
            Quantity::Gap => Scale::from_gaps(self.values),
            Quantity::Displacement => Scale::from_displacements(self.values),
        }
    }

    /// Draws one pixel for each node. Nodes out of contact are white in maps of pressures, and
    /// nodes in contact are white in maps of gaps.
    pub fn raster(&self, scale: &Scale) -> Raster {
        let colour = |value: f64| -> Pixel {
            match self.quantity {
                Quantity::Contact if value > 0.0 => CONTACT,
                Quantity::AdhesiveContact if value == 1.0 => PULLED,
                Quantity::AdhesiveContact | Quantity::Repulsive if value > 0.0 => PUSHED,
                Quantity::Contact | Quantity::AdhesiveContact | Quantity::Repulsive => GAP,
                Quantity::Pressure | Quantity::Gap if value == 0.0 => GAP,
                _ => scale.colour(value),
            }
        };
        Raster::from_values(self.grid.nodes(), self.values, colour)
    }

    /// Returns the colour bar of the values, or `None` for contact without adhesion.
    pub fn colour_bar(&self, scale: &Scale) -> Option<ColourBar> {
        match self.quantity {
            Quantity::Contact | Quantity::Repulsive => return None,
            Quantity::AdhesiveContact => return Some(adhesive_contact_bar()),
            Quantity::Height | Quantity::Pressure | Quantity::Gap | Quantity::Displacement => {}
        }
        let (lowest, highest) = scale.range().into_inner();
        let (factor, label) = self.shown(lowest.abs().max(highest.abs()));
        let ticks = ticks([factor * lowest, factor * highest]);
        Some(ColourBar { colours: scale.bar(), numbers: BarNumbers::Axis { ticks, label } })
    }

    /// Returns the factor that converts values up to `largest` to the unit in which they are shown,
    /// and the name, symbol and unit of the quantity.
    fn shown(&self, largest: f64) -> (f64, String) {
        let name = match self.quantity {
            Quantity::Height => "height h",
            Quantity::Contact
            | Quantity::AdhesiveContact
            | Quantity::Repulsive
            | Quantity::Pressure => "pressure p",
            Quantity::Gap => "gap g",
            Quantity::Displacement => "displacement u",
        };
        let in_unit = |factor: f64, unit: &str| (factor, format!("{name} ({unit})"));
        if self.quantity == Quantity::Pressure {
            return match self.unit {
                Some(unit) => {
                    let Scaled { factor, unit } = Unit::of_pressures(unit).scaled(largest);
                    in_unit(factor, &unit)
                }
                None => (1.0 / self.effective_modulus, format!("{name}/E*")),
            };
        }
        let lengths = Unit::of_lengths([self.unit]);
        if lengths.name().is_none() {
            return (1.0 / self.grid.cell().longer_side(), format!("{name}/L"));
        }
        let to_common = lengths.factor(self.unit);
        let Scaled { factor, unit } = lengths.scaled(to_common * largest);
        in_unit(to_common * factor, &unit)
    }

    /// Returns the map with its bars.
    pub fn panel(&self, title: String, scale: &Scale) -> MapPanel {
        let panel = map_panel(title, self.raster(scale), self.grid, self.length_unit);
        MapPanel { colour_bar: self.colour_bar(scale).map(Box::new), ..panel }
    }
}

/// Returns the legend of the nodes of a contact with adhesion.
pub fn adhesive_contact_bar() -> ColourBar {
    let colours = Raster::from_pixels([3, 1], vec![GAP, PULLED, PUSHED]);
    let words = ["apart", "pulled", "pushed"].into_iter().enumerate();
    let ticks = words.map(|(index, word)| ((index as f64 + 0.5) / 3.0, word.to_owned()));
    let numbers = BarNumbers::Axis { ticks: ticks.collect(), label: "state of a node".to_owned() };
    ColourBar { colours, numbers }
}

/// Returns the contacts of a surface at ascending loads in one map, with the numbers of the loads
/// on the colour bar. `label` names the load and its unit.
pub fn contacts_panel(
    title: String,
    grid: Grid,
    maps: &[ContactMap],
    loads: &[String],
    label: String,
    length_unit: Option<&str>,
) -> MapPanel {
    let raster = Raster::from_contacts(maps);
    let colours = Raster::from_loads(maps.len());
    let last = loads.len().saturating_sub(1);
    let mut shown = vec![0, last / 2, last];
    shown.dedup();
    let share = |load: usize| (load as f64 + 0.5) / loads.len() as f64;
    let ticks = shown.into_iter().filter_map(|load| Some((share(load), loads.get(load)?.clone())));
    let numbers = BarNumbers::Axis { ticks: ticks.collect(), label };
    let panel = map_panel(title, raster, grid, length_unit);
    MapPanel { colour_bar: Some(Box::new(ColourBar { colours, numbers })), ..panel }
}

/// Returns a map with a scale bar.
fn map_panel(title: String, raster: Raster, grid: Grid, length_unit: Option<&str>) -> MapPanel {
    let size = grid.cell().size();
    let scale_bar = scale_bar(size[0], length_unit).or_else(|| relative_scale_bar(grid));
    MapPanel { scale_bar, ..MapPanel::new(title, raster, size) }
}

/// Returns a scale bar relative to the longer side of the map.
fn relative_scale_bar(grid: Grid) -> Option<ScaleBar> {
    let longer = grid.cell().longer_side();
    // As if the longer side were one pixel long, which is not a unit of length.
    let bar = scale_bar(grid.cell().size()[0] / longer, Some("L"))?;
    Some(ScaleBar { length: bar.length * longer, label: bar.label })
}

/// Returns round numbers in a range with their positions from 0 to 1.
fn ticks([lowest, highest]: [f64; 2]) -> Vec<(f64, String)> {
    let range = highest - lowest;
    if !(range > 0.0 && range.is_finite()) {
        return vec![(0.5, digits(lowest, 3))];
    }
    let power = 10f64.powf((range / MOST_TICKS).log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * power);
    let step = steps.into_iter().find(|step| range / step <= MOST_TICKS).unwrap_or(10.0 * power);
    // Tolerate rounding at both ends.
    let [first, last] = [(lowest / step - 1e-9).ceil(), (highest / step + 1e-9).floor()];
    let count = (last - first) as usize + 1;
    let ticks = (0..count).map(|index| step * (first + index as f64));
    ticks.map(|tick| (((tick - lowest) / range).clamp(0.0, 1.0), digits(tick, 4))).collect()
}

/// Format of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StillFormat {
    Png,
    Svg,
    Pdf,
}

/// Returns a map with its bars as a file. Frame, texts and bars of SVG and PDF files are vectors.
///
/// # Errors
/// If the picture is too large.
pub fn still(panel: &MapPanel, format: StillFormat) -> Result<Vec<u8>, PixelsError> {
    match format {
        StillFormat::Png => Ok(pixels(panel)?.to_png()),
        StillFormat::Svg => Ok(drawing(panel).into_bytes()),
        StillFormat::Pdf => pdf::to_pdf(&drawing(panel)),
    }
}

/// Draws a map with its bars as pixels. Each node has the same whole number of pixels.
///
/// # Errors
/// If the picture is too large.
pub fn pixels(panel: &MapPanel) -> Result<Raster, PixelsError> {
    let longer = panel.size[0].max(panel.size[1]);
    let width = SIDE * panel.size[0] / longer;
    let per_unit = panel.raster.size()[0] as f64 / width;
    let pixels_per_node = (LEAST_SCALE / per_unit).ceil().max(1.0);
    svg::to_raster(&drawing(panel), (pixels_per_node * per_unit) as f32)
}

fn drawing(panel: &MapPanel) -> String {
    let rows = vec![vec![Panel::Map(panel.clone())]];
    let panel = panel_of_map(rows[0].iter(), SIDE);
    svg::alone(&Figure::from_panels(rows, panel).to_svg("map"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_mechanics::grid::Cell;

    fn grid(nodes: [usize; 2], size: [f64; 2]) -> Grid {
        Grid::new(nodes, Cell::new(size).unwrap()).unwrap()
    }

    fn values(quantity: Quantity, values: &[f64], unit: Option<&'static str>) -> ColourBar {
        let grid = grid([2, 2], [4.0, 4.0]);
        let effective_modulus = 5.0;
        let length_unit = Some("µm");
        let map = NodeValues { quantity, values, grid, unit, length_unit, effective_modulus };
        map.colour_bar(&map.scale()).unwrap()
    }

    fn axis(bar: ColourBar) -> (String, Vec<(f64, String)>) {
        let BarNumbers::Axis { ticks, label } = bar.numbers else { panic!("no axis") };
        (label, ticks)
    }

    #[test]
    fn values_have_the_unit_that_is_named_or_are_relative_to_side_and_modulus() {
        let label = |quantity, numbers: &[f64], unit| axis(values(quantity, numbers, unit)).0;
        let heights = [-0.02, 0.0, 0.01, 0.03];
        assert_eq!(label(Quantity::Height, &heights, Some("µm")), "height h (µm)");
        assert_eq!(label(Quantity::Height, &heights, Some("m")), "height h (mm)");
        assert_eq!(label(Quantity::Gap, &heights, Some("px")), "gap g (px)");
        assert_eq!(label(Quantity::Displacement, &heights, None), "displacement u/L");
        let pressures = [0.0, 1e7, 2e7, 2.5e7];
        assert_eq!(label(Quantity::Pressure, &pressures, Some("Pa")), "pressure p (MPa)");
        assert_eq!(label(Quantity::Pressure, &pressures, Some("MPa")), "pressure p (MPa)");
        assert_eq!(label(Quantity::Pressure, &pressures, None), "pressure p/E*");
    }

    #[test]
    fn pulled_nodes_and_pushed_ones_have_different_colours_and_a_legend() {
        let map = NodeValues {
            quantity: Quantity::AdhesiveContact,
            values: &[0.0, 1.0, 2.0, 0.0],
            grid: grid([2, 2], [4.0, 4.0]),
            unit: None,
            length_unit: None,
            effective_modulus: 1.0,
        };
        let scale = map.scale();
        // y points upwards, so the first row has the nodes (0, 1) and (1, 1).
        assert_eq!(map.raster(&scale).as_slice(), [PULLED, GAP, GAP, PUSHED]);
        let bar = map.colour_bar(&scale).unwrap();
        assert_eq!(bar.colours.as_slice(), [GAP, PULLED, PUSHED]);
        let (_, words) = axis(bar);
        assert_eq!(words[1], (0.5, "pulled".to_owned()));
    }

    #[test]
    fn ticks_are_round_numbers_at_their_share_of_the_range() {
        let of = |range| ticks(range);
        let told = |ticks: &[(f64, &str)]| -> Vec<(f64, String)> {
            ticks.iter().map(|(share, number)| (*share, (*number).to_owned())).collect()
        };
        let expected = [(0.0, "0"), (0.4, "10"), (0.8, "20")];
        let found = of([0.0, 25.0]);
        assert!(found.contains(&(0.4, "10".to_owned())), "{found:?}");
        assert!(found.len() >= expected.len());
        assert_eq!(of([-1.0, 1.0])[2], (0.5, "0".to_owned()));
        assert_eq!(of([3.0, 3.0]), told(&[(0.5, "3")]));
        for range in [[0.013, 0.027], [-3e-9, 8e-9], [-120.0, 1.0], [0.0, 999.0]] {
            let count = of(range).len();
            assert!((3..=7).contains(&count), "{count} ticks in {range:?}");
        }
    }

    #[test]
    fn ticks_of_relative_pressures_are_multiples_of_the_modulus() {
        let (_, ticks) = axis(values(Quantity::Pressure, &[0.0, 1.0, 2.0, 5.0], None));
        assert_eq!(ticks.last(), Some(&(1.0, "1".to_owned())));
    }

    #[test]
    fn a_map_without_a_unit_has_a_scale_bar_relative_to_its_longer_side() {
        let bar = relative_scale_bar(grid([4, 2], [8.0, 4.0])).unwrap();
        assert_eq!(bar.label, "0.2 L");
        assert!((bar.length - 1.6).abs() < 1e-12);
    }

    #[test]
    fn every_node_has_the_same_number_of_pixels_and_keeps_its_colour() {
        let nodes = [24, 16];
        let heights: Vec<f64> = (0..24 * 16).map(|node| f64::from(node * 7 % 101)).collect();
        let map = NodeValues {
            quantity: Quantity::Height,
            values: &heights,
            grid: grid(nodes, [3.0, 2.0]),
            unit: Some("mm"),
            length_unit: Some("mm"),
            effective_modulus: 1.0,
        };
        let panel = map.panel("heights".to_owned(), &map.scale());
        let picture = pixels(&panel).unwrap();
        // 480 units for 24 nodes at 40 pixels, which are two pixels per unit; the margin has 8
        // units, and the title 24.
        let at = |i: usize, row: usize| {
            let [x, y] = [16 + 40 * i + 20, 16 + 48 + 40 * row + 20];
            picture.as_slice()[y * picture.size()[0] + x]
        };
        for (index, colour) in panel.raster.as_slice().iter().enumerate() {
            assert_eq!(at(index % 24, index / 24), *colour, "node {index}");
        }
    }
}
