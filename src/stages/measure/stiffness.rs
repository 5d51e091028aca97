//! The incremental stiffness of an interface, from neighbouring loads.
//!
//! How fast the pressure rises as the bodies approach: K = −dp₀/dū, with ū the mean gap. Pressures grow
//! about exponentially with the approach (Persson, *Phys. Rev. Lett.* 99, 2007, 125502), so that ū is
//! taken as a parabola in ln p₀ through a load and its two neighbours: K = −p₀/(dū/d ln p₀) is exact
//! where p₀ ∝ exp(−ū/u₀), and K = p₀/u₀ there. The first load of a block and the last one have no
//! neighbour on one side, and no stiffness; nor have loads that were given up, or that lie beside such.

/// One load of a block.
#[derive(Debug, Clone, Copy)]
pub struct Approach {
    pub pressure: f64,
    pub mean_gap: f64,
    /// Whether it was solved for.
    pub is_solved: bool,
}

/// The stiffness at each load of an ascending block, in units of pressure over length.
pub fn of_block(loads: &[Approach]) -> Vec<Option<f64>> {
    let between = loads
        .windows(3)
        .map(|three| at_middle([three[0], three[1], three[2]]));
    let ends = loads.len().min(2);
    let first = (ends > 0).then_some(None);
    let last = (ends > 1).then_some(None);
    first.into_iter().chain(between).chain(last).collect()
}

fn at_middle(three: [Approach; 3]) -> Option<f64> {
    if three.iter().any(|load| !load.is_solved) {
        return None;
    }
    let [before, here, after] = three;
    let run = |to: Approach, from: Approach| libm::log(to.pressure / from.pressure);
    let slope = |to: Approach, from: Approach| (to.mean_gap - from.mean_gap) / run(to, from);
    let (left, right) = (run(here, before), run(after, here));
    let slope = (right * slope(here, before) + left * slope(after, here)) / (left + right);
    // In full contact the gap falls no more.
    (slope < 0.0).then(|| -here.pressure / slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(pressures: &[f64], mean_gap: impl Fn(f64) -> f64) -> Vec<Approach> {
        let load = |&pressure: &f64| Approach {
            pressure,
            mean_gap: mean_gap(pressure),
            is_solved: true,
        };
        pressures.iter().map(load).collect()
    }

    #[test]
    fn an_exponential_relation_has_a_stiffness_in_proportion_to_the_pressure() {
        let pressures = [0.01, 0.02, 0.07, 0.1, 0.3];
        let found = of_block(&block(&pressures, |pressure| -0.4 * pressure.ln()));
        assert_eq!((found[0], found[4]), (None, None));
        for (found, pressure) in found[1..4].iter().zip(&pressures[1..]) {
            assert!((found.unwrap() - pressure / 0.4).abs() < 1e-12 * pressure);
        }
    }

    #[test]
    fn a_power_is_met_to_second_order_in_the_step() {
        // Of Hertz: p ∝ d^(3/2), so that K = 3/2 p/d.
        let error = |ratio: f64| {
            let pressures = [1.0 / ratio, 1.0, ratio];
            let found = of_block(&block(&pressures, |pressure| -pressure.powf(2.0 / 3.0)));
            (found[1].unwrap() - 1.5).abs()
        };
        assert!((error(1.2) / error(1.1) - 4.0).abs() < 0.5);
    }

    #[test]
    fn loads_that_were_given_up_have_none_and_neither_have_their_neighbours() {
        let mut loads = block(&[1.0, 2.0, 3.0, 4.0, 5.0], |pressure| -pressure);
        loads[1].is_solved = false;
        let found = of_block(&loads);
        assert_eq!(found.iter().filter(|value| value.is_some()).count(), 1);
        assert!(found[3].is_some());
    }

    #[test]
    fn full_contact_and_few_loads_have_none() {
        let flat = of_block(&block(&[1.0, 2.0, 3.0], |_| 0.0));
        assert_eq!(flat, [None; 3]);
        for count in 0..3 {
            let loads = block(&[1.0, 2.0][..count.min(2)], |pressure| -pressure);
            assert_eq!(of_block(&loads), vec![None; count.min(2)]);
        }
    }
}
