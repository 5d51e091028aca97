//! The incremental stiffness of an interface as a finite difference between neighbouring loads.
//!
//! The stiffness is K = dp₀/dδ, with δ the approach of the bodies. The approach is a parabola in ln
//! p₀ through a load and its two neighbours, so that K = p₀/(dδ/d ln p₀) is exact where p₀ ∝
//! exp(δ/u₀) (Persson, *Phys. Rev. Lett.* 99, 2007, 125502). The error grows with the square of the
//! distance of the loads. A load has no stiffness where a neighbour is missing, was given up, or
//! differs by more than a tenth of the load.

/// One load of a block.
#[derive(Debug, Clone, Copy)]
pub struct Approach {
    pub pressure: f64,
    /// Approach of the bodies from any fixed reference.
    pub approach: f64,
    /// Whether it was solved for.
    pub is_solved: bool,
}

/// Largest relative distance of a neighbouring load, with some slack for the rounding of loads.
const LARGEST_STEP: f64 = 0.1 + 1e-9;

/// The stiffness at each load of an ascending block, in units of pressure over length.
pub fn of_block(loads: &[Approach]) -> Vec<Option<f64>> {
    let between = loads.windows(3).map(|three| at_middle([three[0], three[1], three[2]]));
    let ends = loads.len().min(2);
    let first = (ends > 0).then_some(None);
    let last = (ends > 1).then_some(None);
    first.into_iter().chain(between).chain(last).collect()
}

fn at_middle(three: [Approach; 3]) -> Option<f64> {
    let [before, here, after] = three;
    let is_far =
        |load: &Approach| (load.pressure - here.pressure).abs() > LARGEST_STEP * here.pressure;
    if three.iter().any(|load| !load.is_solved || is_far(load)) {
        return None;
    }
    let run = |to: Approach, from: Approach| libm::log(to.pressure / from.pressure);
    let slope = |to: Approach, from: Approach| (to.approach - from.approach) / run(to, from);
    let (left, right) = (run(here, before), run(after, here));
    let slope = (right * slope(here, before) + left * slope(after, here)) / (left + right);
    // In full contact of a periodic body the approach stops growing.
    (slope > 0.0).then(|| here.pressure / slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(pressures: &[f64], approach: impl Fn(f64) -> f64) -> Vec<Approach> {
        let load =
            |&pressure: &f64| Approach { pressure, approach: approach(pressure), is_solved: true };
        pressures.iter().map(load).collect()
    }

    #[test]
    fn an_exponential_relation_has_a_stiffness_in_proportion_to_the_pressure() {
        let pressures = [0.01, 0.0105, 0.0115, 0.012, 0.013];
        let found = of_block(&block(&pressures, |pressure| 0.4 * pressure.ln()));
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
            let found = of_block(&block(&pressures, |pressure| pressure.powf(2.0 / 3.0)));
            (found[1].unwrap() - 1.5).abs()
        };
        assert!((error(1.1) / error(1.05) - 4.0).abs() < 0.5);
    }

    #[test]
    fn neighbours_farther_than_a_tenth_leave_none() {
        let found = |pressures: [f64; 3]| of_block(&block(&pressures, |pressure| pressure))[1];
        for near in [[0.9, 1.0, 1.1], [0.009, 0.01, 0.011], [45.0, 50.0, 55.0]] {
            assert!((found(near).unwrap() - 1.0).abs() < 0.01, "{near:?}");
        }
        for far in [[0.89, 1.0, 1.1], [0.9, 1.0, 1.11], [0.5, 1.0, 2.0]] {
            assert_eq!(found(far), None);
        }
    }

    #[test]
    fn loads_that_were_given_up_have_none_and_neither_have_their_neighbours() {
        let mut loads = block(&[1.0, 1.05, 1.1, 1.15, 1.2], |pressure| pressure);
        loads[1].is_solved = false;
        let found = of_block(&loads);
        assert_eq!(found.iter().filter(|value| value.is_some()).count(), 1);
        assert!(found[3].is_some());
    }

    #[test]
    fn full_contact_and_few_loads_have_none() {
        let flat = of_block(&block(&[1.0, 1.05, 1.1], |_| 0.0));
        assert_eq!(flat, [None; 3]);
        for count in 0..3 {
            let loads = block(&[1.0, 1.05][..count.min(2)], |pressure| pressure);
            assert_eq!(of_block(&loads), vec![None; count.min(2)]);
        }
    }
}
