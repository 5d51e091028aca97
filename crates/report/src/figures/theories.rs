//! The theories that stand beside the data, as curves.

use crate::charts::axis::Spacing;
use crate::charts::chart::Series;
use crate::charts::colour::Colour;
use crate::charts::style::{Dash, Style};
use asperity_contact::theory::law::KAPPA_BGT;
use asperity_contact::theory::models::{Asperities, AsperityModel};
use asperity_contact::theory::persson;

/// Nayak's parameters for which the paper draws asperity models.
const NAYAK: [(f64, Colour); 2] = [(2.0, Colour::Text), (10.0, Colour::Muted)];

/// A quantity made of the area under a load, and the load.
pub type Quantity = fn(f64, f64) -> f64;

/// The area itself.
pub const AREA: Quantity = |area, _| area;
/// The area over the load.
pub const SECANT: Quantity = |area, load| area / load;

/// A curve that does not begin at zero may be seen on an axis of logarithms, where it bends most at
/// its light end.
fn steps([from, _]: [f64; 2]) -> Spacing {
    match from > 0.0 {
        true => Spacing::Logarithmic,
        false => Spacing::Linear,
    }
}

/// Persson's theory.
pub fn persson_curve(quantity: Quantity, range: [f64; 2]) -> Series {
    let style = Style::line(Colour::Text, Dash::Dashed, 1.8);
    let curve = |load| quantity(persson::area(load), load);
    Series::curve(curve, range, steps(range), style).named("Persson 2001")
}

/// What asperity models tend to at light load.
pub fn asymptote(quantity: Quantity, range: [f64; 2]) -> Series {
    let style = Style::line(Colour::Muted, Dash::Dotted, 1.6);
    let curve = |load| quantity(KAPPA_BGT * load, load);
    Series::curve(curve, range, steps(range), style).named("asymptote √(2π) y of BGT")
}

/// The asperity models of the paper.
pub fn asperity_curves(quantity: Quantity, range: [f64; 2]) -> Vec<Series> {
    let models = [
        (AsperityModel::BushGibsonThomas, "BGT 1975", Dash::Solid),
        (AsperityModel::SimplifiedElliptic, "Greenwood 2006", Dash::DashDot),
    ];
    let curves = models.into_iter().flat_map(|(model, name, dash)| {
        NAYAK.map(|(nayak, colour)| {
            let asperities = Asperities::new(model, nayak).expect("both are above 3/2");
            let area = |load| asperities.at_load(load).map_or(f64::NAN, |contact| contact.area);
            let curve = |load| quantity(area(load), load);
            let style = Style::line(colour, dash, 1.4);
            let label = format!("{name}, α = {nayak}");
            Series::curve(curve, range, steps(range), style).named(label)
        })
    });
    curves.collect()
}
