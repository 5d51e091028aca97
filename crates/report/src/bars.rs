//! Error bars of means over surfaces.

use std::fmt;

/// What error bars are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bars {
    /// Standard errors of the mean: how well it is known.
    #[default]
    Sem,
    /// Standard deviations over the surfaces, as in the paper: how they scatter.
    Sd,
}

impl Bars {
    /// Half the length of a bar, from the standard deviation of so many values.
    pub fn half(self, deviation: f64, count: usize) -> f64 {
        match self {
            Bars::Sem => deviation / (count as f64).sqrt(),
            Bars::Sd => deviation,
        }
    }
}

impl fmt::Display for Bars {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Bars::Sem => "standard errors of the means",
            Bars::Sd => "standard deviations over the surfaces",
        })
    }
}

/// Arithmetic mean and, of more than one value, half the length of its error bar.
pub fn mean_and_half_bar(values: &[f64], bars: Bars) -> (f64, Option<f64>) {
    let half = deviation(values).map(|deviation| bars.half(deviation, values.len()));
    (mean(values), half)
}

/// The ends of a bar about a value.
pub fn ends(value: f64, half: Option<f64>) -> Option<[f64; 2]> {
    half.map(|half| [value - half, value + half])
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation over n − 1, of more than one value.
pub fn deviation(values: &[f64]) -> Option<f64> {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (values.len() > 1).then(|| (squares / (values.len() - 1) as f64).sqrt())
}
