//! Least-squares fits over the groups of a family, and spreads.

use asperity_statistics::line;

/// Points of a regression: abscissae and the ordinate.
pub struct Points {
    pub abscissae: Vec<Vec<f64>>,
    pub ordinates: Vec<f64>,
}

impl Points {
    /// Returns a result of the regression by its name, or `None` if the points do not determine it.
    pub fn result(&self, name: &str) -> Option<f64> {
        let digits = ['1', '2', '3'];
        let variable = digits.iter().position(|digit| name.ends_with(*digit)).unwrap_or(0);
        match name.trim_end_matches(digits) {
            "slope" => self.slopes()?.get(variable).copied(),
            "step" => Some(self.steps(variable)?.0),
            "range" => Some(self.steps(variable)?.1),
            "residual" => self.residual(variable),
            "spread" => {
                let mean = self.ordinates.iter().sum::<f64>() / self.ordinates.len() as f64;
                Some(root_mean_square(self.ordinates.iter().map(|value| value - mean)))
            }
            _ => None,
        }
    }

    fn slopes(&self) -> Option<Vec<f64>> {
        match self.abscissae.as_slice() {
            [x] => (x.len() >= 3)
                .then(|| line(x, &self.ordinates))
                .flatten()
                .map(|(slope, _)| vec![slope]),
            [x, y] => plane(x, y, &self.ordinates).map(Vec::from),
            _ => None,
        }
    }

    /// Returns the smallest step and the range of a variable.
    fn steps(&self, variable: usize) -> Option<(f64, f64)> {
        let mut all = self.abscissae.get(variable)?.clone();
        all.sort_by(f64::total_cmp);
        all.dedup();
        let steps = all.windows(2).map(|pair| pair[1] - pair[0]);
        Some((steps.fold(f64::INFINITY, f64::min), all.last()? - all.first()?))
    }

    /// Returns the rms residual of the least-squares line over one variable, or `None` for fewer
    /// than three points.
    fn residual(&self, variable: usize) -> Option<f64> {
        let x = self.abscissae.get(variable)?;
        if x.len() < 3 {
            return None;
        }
        let (slope, offset) = line(x, &self.ordinates)?;
        let rest = x.iter().zip(&self.ordinates).map(|(x, y)| y - offset - slope * x);
        Some(root_mean_square(rest))
    }
}

fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

/// Returns the slopes s and t of the least-squares plane z = c + s x + t y, or `None` for fewer
/// than four points or nearly collinear (x, y).
fn plane(x: &[f64], y: &[f64], z: &[f64]) -> Option<[f64; 2]> {
    /// Smallest 1 − r² at which a plane is fitted, where r is the correlation of x and y.
    const LEAST_DETERMINANT: f64 = 1e-6;
    let count = x.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
    let product = |one: &[f64], other: &[f64]| {
        let (centre, other_centre) = (mean(one), mean(other));
        let terms = one.iter().zip(other);
        terms.map(|(a, b)| (a - centre) * (b - other_centre)).sum::<f64>() / count
    };
    let (xx, xy, yy) = (product(x, x), product(x, y), product(y, y));
    let (xz, yz) = (product(x, z), product(y, z));
    let determinant = xx * yy - xy * xy;
    if x.len() < 4 || determinant <= LEAST_DETERMINANT * xx * yy {
        return None;
    }
    Some([(xz * yy - yz * xy) / determinant, (yz * xx - xz * xy) / determinant])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_is_found_and_two_proportional_variables_are_none() {
        let x = [1.0, 1.0, 2.0, 2.0, 3.0, 3.0];
        let y = [0.0, 1.0, 0.0, 1.0, 0.0, 1.0];
        let z: Vec<f64> = x.iter().zip(y).map(|(x, y)| 0.3 - 0.04 * x + 0.02 * y).collect();
        let [s, t] = plane(&x, &y, &z).unwrap();
        assert!((s + 0.04).abs() < 1e-15 && (t - 0.02).abs() < 1e-15);
        let doubled = x.map(|x| 2.0 * x);
        assert_eq!(plane(&x, &doubled, &z), None);
    }
}
