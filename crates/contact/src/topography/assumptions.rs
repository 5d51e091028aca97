//! Whether surfaces are what theories of rough contact assume: isotropic Gaussian roughness.
//!
//! Persson's theory, the asperity models, and Nayak's α and density of summits speak of such
//! roughness alone. Ground, worn or wavy surfaces have the same moments m₀, m₂ and m₄ and another
//! contact.

/// The largest ratio of moments along two directions that passes for isotropic: among 1600 random
/// isotropic surfaces with H = 0.3 and 0.8 from k = 1, 2, 4, 8 to 32, none reached it.
const ISOTROPIC: f64 = 1.5;
/// The largest skewness that passes for normal: 12 % of the surfaces from k = 1 with H = 0.8 are
/// beyond it, for their heights are five waves, 1 % of those from k = 2, and none from k = 4 on.
const SYMMETRIC: f64 = 0.5;
/// The largest excess kurtosis that passes for normal: 1.5 % and none, in the same order.
const MESOKURTIC: f64 = 1.0;
/// Fewer modes have no normal heights on any single surface: of fixed rms, they lower the kurtosis
/// by 1.5 over their number.
const ENOUGH_MODES: f64 = 10.0;

/// What tells of direction and distribution, averaged over the surfaces of a spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistics {
    /// Spectral moments m₂₀ and m₀₂: mean square slopes along x and y.
    pub slopes: [f64; 2],
    /// Spectral moments m₄₀ and m₀₄: mean square curvatures along x and y.
    pub curvatures: [f64; 2],
    /// Spectral moment m₂₂; a third of m₄ if all directions are alike.
    pub mixed: f64,
    /// Third standardised moment of the heights, where there are heights.
    pub skewness: Option<f64>,
    /// Fourth standardised moment of the heights, less 3.
    pub excess_kurtosis: Option<f64>,
    /// Inverse participation ratio of the modes' powers.
    pub effective_modes: f64,
}

impl Statistics {
    /// In which respects these are no surfaces of isotropic Gaussian roughness, each with its number;
    /// nothing if they may well be.
    pub fn departures(&self) -> Vec<String> {
        let [[along_x, along_y], [bent_x, bent_y]] = [self.slopes, self.curvatures];
        let ratios = [
            ("m₂₀/m₀₂", along_x, along_y),
            ("m₄₀/m₀₄", bent_x, bent_y),
            ("3 m₂₂/m₄", 3.0 * self.mixed, (bent_x + bent_y) / 2.0),
        ];
        let ratios = ratios.into_iter().filter_map(|(name, one, other)| {
            let is_alike = one <= ISOTROPIC * other && other <= ISOTROPIC * one;
            (!is_alike).then(|| match one < 1e3 * other {
                true => format!("{name} = {:.2}", one / other),
                false => format!("{name} > 1000"),
            })
        });
        let skewed = self.skewness.filter(|value| value.abs() > SYMMETRIC);
        let peaked = self.excess_kurtosis.filter(|value| value.abs() > MESOKURTIC);
        let few = (self.effective_modes < ENOUGH_MODES).then_some(self.effective_modes);
        let told = |value: f64| format!("{value:.1}").replace('-', "−");
        let heights = [
            skewed.map(|value| format!("skewness {}", told(value))),
            peaked.map(|value| format!("excess kurtosis {}", told(value))),
            few.map(|value| format!("{} effective modes", told(value))),
        ];
        ratios.chain(heights.into_iter().flatten()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::square;
    use crate::topography::descriptors::Descriptors;
    use crate::topography::random::{Amplitude, RandomSurface};
    use crate::topography::shapes::Shape;
    use crate::topography::spectrum::Spectrum;
    use crate::topography::surface::Surface;

    fn of(surface: &Surface) -> Vec<String> {
        let seen = Descriptors::of(surface);
        let moments = seen.moments;
        let statistics = Statistics {
            slopes: [moments.m20, moments.m02],
            curvatures: [moments.m40, moments.m04],
            mixed: moments.m22,
            skewness: seen.skewness,
            excess_kurtosis: seen.excess_kurtosis,
            effective_modes: moments.effective_modes(),
        };
        statistics.departures()
    }

    fn random(k_lower: u32) -> Surface {
        let surface = RandomSurface {
            spectrum: Spectrum {
                hurst: 0.8,
                k_lower,
                k_rolloff: k_lower,
                k_upper: 32,
                anisotropy: None,
            },
            amplitude: Amplitude::Gaussian,
            rms_slope: 1.0,
            seed: 1,
            realization: 0,
        };
        surface.draw(square(64, 1.0))
    }

    /// The same nodes with other heights.
    fn with(surface: &Surface, height: impl Fn(f64) -> f64) -> Surface {
        let heights = surface.heights().iter().map(|&h| height(h)).collect();
        Surface::new(surface.grid(), heights).unwrap()
    }

    #[test]
    fn random_isotropic_surfaces_are_what_theories_assume() {
        assert_eq!(of(&random(4)), Vec::<String>::new());
    }

    #[test]
    fn long_waves_alone_are_few() {
        let told = of(&random(1)).join(", ");
        assert!(told.contains("effective modes"), "{told}");
    }

    #[test]
    fn worn_summits_make_heights_skewed_and_peaked() {
        let rough = random(4);
        let told = of(&with(&rough, |height| -height.abs().powi(2))).join(", ");
        assert!(told.contains("skewness −") && told.contains("kurtosis"), "{told}");
        // Turned over, the valleys are where the summits were.
        let turned = of(&with(&rough, |height| height.abs().powi(2))).join(", ");
        assert!(turned.contains("skewness ") && !turned.contains("skewness −"), "{turned}");
    }

    #[test]
    fn a_wave_in_one_direction_has_no_slope_in_the_other() {
        let wave = |shape: Shape| of(&shape.draw(square(64, 1.0))).join(", ");
        let along_x = wave(Shape::Wave { amplitude: 0.1, waves: 2 });
        assert!(along_x.contains("m₂₀/m₀₂ > 1000"), "{along_x}");
        // A sum of two is square, not isotropic: no curvature of x twists along y.
        let both = wave(Shape::WaveSum { amplitude: 0.1, waves: 2 });
        assert!(both.contains("3 m₂₂/m₄ = 0.00") && !both.contains("m₂₀/m₀₂"), "{both}");
    }
}
