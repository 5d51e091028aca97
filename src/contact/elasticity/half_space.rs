//! The elastic half-space: what a periodic pressure does to its surface, wavenumber by wavenumber.
//!
//! Lengths are in units of the cell side L and pressures in units of E*, so that an angular
//! wavenumber is |q| = 2πk with an integer vector k. Pressure p lowers the surface by u, with
//! û = 2 p̂ / (E* |q|) (Johnson, *Contact Mechanics*, 1985, §13.2; Stanley & Kato 1997) and
//! û(0) = 0: a uniform pressure moves the far field, not the shape.

use std::f64::consts::PI;

use crate::contact::fft::{Kernel, Real, Scratch, Transform};

/// The kernel from pressure to displacement, 2/|q| and zero at q = 0.
pub fn displacement<T: Real>(nodes: usize) -> Kernel<T> {
    kernel(nodes, displacement_of_wave)
}

/// The kernel from displacement to pressure, |q|/2; the inverse of [`displacement`] on maps of zero
/// mean.
pub fn stiffness<T: Real>(nodes: usize) -> Kernel<T> {
    kernel(nodes, stiffness_of_wave)
}

fn displacement_of_wave(k: f64) -> f64 {
    if k > 0.0 { 1.0 / (PI * k) } else { 0.0 }
}

fn stiffness_of_wave(k: f64) -> f64 {
    PI * k
}

/// The pressure at one node, in units of E* per cell side, that a unit displacement of this node
/// alone asks for: the mean of |q|/2 over the wavenumbers of the mesh.
pub fn nodal_stiffness(nodes: usize) -> f64 {
    mean_over_waves(nodes, stiffness_of_wave)
}

/// The displacement of one node, in units of cell sides, under a unit pressure on this node alone,
/// in units of E*: the mean of 2/|q| over the wavenumbers of the mesh.
pub fn nodal_compliance(nodes: usize) -> f64 {
    mean_over_waves(nodes, displacement_of_wave)
}

fn mean_over_waves(nodes: usize, factor: impl Fn(f64) -> f64) -> f64 {
    // Wavenumbers k and k − N are one on a mesh.
    let magnitude = |k: usize| k.min(nodes - k) as f64;
    let waves = (0..nodes).flat_map(|k_x| (0..nodes).map(move |k_y| (k_x, k_y)));
    let sum: f64 = waves
        .map(|(k_x, k_y)| factor(magnitude(k_x).hypot(magnitude(k_y))))
        .sum();
    sum / (nodes * nodes) as f64
}

/// The pressure, of zero mean, that flattens `heights` altogether: F⁻¹(|q| ĥ)/2, in units of E*
/// when heights are in units of the cell side.
///
/// Full contact under a mean pressure p₀ has the pressure p₀ plus this one. By Parseval's theorem
/// its variance is a quarter of the mean square slope of the heights.
pub fn full_contact_pressure(
    transform: &Transform<f64>,
    heights: &[f64],
    pressure: &mut [f64],
    scratch: &mut Scratch<f64>,
) {
    transform.convolve(&stiffness(transform.nodes()), heights, pressure, scratch);
}

/// A kernel that depends on k = |q|/2π alone.
///
/// Nyquist rows keep the full |q|: on a mesh they are wavenumbers like any other.
fn kernel<T: Real>(nodes: usize, factor: impl Fn(f64) -> f64) -> Kernel<T> {
    Kernel::new(nodes, |k_x, k_y| {
        factor(((k_x * k_x + k_y * k_y) as f64).sqrt())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// cos(2π(a x + b y)) on the mesh.
    fn wave(nodes: usize, a: usize, b: usize) -> Vec<f64> {
        let turns = |node: usize| (a * (node / nodes) + b * (node % nodes)) % nodes;
        (0..nodes * nodes)
            .map(|node| (TAU * turns(node) as f64 / nodes as f64).cos())
            .collect()
    }

    #[test]
    fn a_wave_sinks_by_two_over_its_wavenumber() {
        let (nodes, a, b) = (15, 3, 4);
        let transform = Transform::<f64>::new(nodes);
        let (pressure, mut sunk) = (wave(nodes, a, b), vec![0.0; nodes * nodes]);
        transform.convolve(
            &displacement(nodes),
            &pressure,
            &mut sunk,
            &mut transform.scratch(),
        );
        for (pressure, sunk) in pressure.iter().zip(sunk) {
            assert!((sunk - pressure * 2.0 / (TAU * 5.0)).abs() < 1e-15);
        }
    }

    #[test]
    fn a_wave_is_flattened_by_half_its_wavenumber_times_its_height() {
        // Up to the Nyquist wave, whose full |q| counts.
        for (nodes, a, b) in [(16, 1, 0), (16, 3, 4), (16, 8, 0), (16, 8, 8), (15, 7, 2)] {
            let transform = Transform::<f64>::new(nodes);
            let (heights, mut pressure) = (wave(nodes, a, b), vec![0.0; nodes * nodes]);
            full_contact_pressure(
                &transform,
                &heights,
                &mut pressure,
                &mut transform.scratch(),
            );
            let stiffness = 0.5 * TAU * ((a * a + b * b) as f64).sqrt();
            for (height, pressure) in heights.iter().zip(pressure) {
                assert!((pressure - stiffness * height).abs() < 1e-13 * stiffness);
            }
        }
    }

    #[test]
    fn a_raised_node_asks_for_the_nodal_stiffness() {
        for nodes in [1, 2, 7, 12] {
            let transform = Transform::<f64>::new(nodes);
            let mut raised = vec![0.0; nodes * nodes];
            raised[0] = 1.0;
            let mut pressure = vec![0.0; nodes * nodes];
            full_contact_pressure(&transform, &raised, &mut pressure, &mut transform.scratch());
            let stiffness = nodal_stiffness(nodes);
            assert!((pressure[0] - stiffness).abs() <= 1e-14 * stiffness);
        }
    }

    #[test]
    fn a_pressed_node_sinks_by_the_nodal_compliance() {
        for nodes in [1, 2, 7, 12] {
            let transform = Transform::<f64>::new(nodes);
            let mut pressed = vec![0.0; nodes * nodes];
            pressed[0] = 1.0;
            let (kernel, mut sunk) = (displacement(nodes), vec![0.0; nodes * nodes]);
            transform.convolve(&kernel, &pressed, &mut sunk, &mut transform.scratch());
            let compliance = nodal_compliance(nodes);
            assert!((sunk[0] - compliance).abs() <= 1e-14 * compliance);
        }
    }

    #[test]
    fn uniform_pressure_moves_nothing() {
        let transform = Transform::<f64>::new(6);
        let mut sunk = vec![1.0; 36];
        transform.convolve(
            &displacement(6),
            &[1.0; 36],
            &mut sunk,
            &mut transform.scratch(),
        );
        assert!(sunk.iter().all(|value| value.abs() < 1e-15));
    }
}
