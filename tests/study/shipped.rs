//! Manifests that are shipped with the program.

use std::fs;
use std::path::{Path, PathBuf};

use asperity::tables::table::Table;

use crate::bench::Bench;
use crate::columns;

fn manifests() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("manifests")
}

/// Returns every shipped manifest.
pub fn all() -> Vec<PathBuf> {
    let entries = fs::read_dir(manifests()).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let is_manifest = |path: &PathBuf| path.extension().is_some_and(|end| end == "toml");
    paths.filter(is_manifest).collect()
}

/// Runs a manifest and checks that its tables have the listed columns.
fn run(bench: &Bench, name: &str) {
    let path = manifests().join(name).with_extension("toml");
    let output = bench.output(&["run", path.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    columns::assert_kept(bench, name, &path);
}

fn column(table: &Table, name: &str) -> Vec<f64> {
    table.reals(name).unwrap().iter().map(|value| value.unwrap()).collect()
}

#[test]
fn every_shipped_manifest_is_valid() {
    let bench = Bench::new();
    for path in all() {
        let output = bench.output(&["check", path.to_str().unwrap()]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn validation_finds_the_closed_forms() {
    let bench = Bench::new();
    run(&bench, "validation");
    let table = |stage: &str| bench.table("validation", stage);

    // The contact is a strip of whole rows; its width has an error of at most one of 512 nodes per
    // edge.
    let wave = table("westergaard");
    let pairs = column(&wave, "area_fraction").into_iter().zip(column(&wave, "area_exact"));
    for (found, exact) in pairs {
        assert!((found - exact).abs() <= 2.0 / 512.0, "{found} {exact}");
    }

    // The contact has a diameter of 9 to 36 nodes. Single nodes on its edge change the area by a
    // few per cent at first, but hardly the pressure at the centre. Periodic images give errors
    // O((a/L)³).
    let hertz = table("hertz");
    assert!(column(&hertz, "area_error").iter().all(|error| error.abs() < 0.04));
    assert!(column(&hertz, "area_error").last().unwrap().abs() < 0.01);
    assert!(column(&hertz, "peak_pressure_error").iter().all(|error| error.abs() < 5e-3));

    // Both asymptotes hold up to their next order: at p̄/p* of 0.002 to 0.01, and above 0.95.
    let waves = table("waves");
    let share = column(&waves, "pressure_over_full");
    let area = column(&waves, "area_corrected");
    let light = column(&waves, "light_limit");
    let full = column(&waves, "full_limit");
    let mut seen = [0, 0];
    for row in 0..waves.rows() {
        if share[row] < 0.01 {
            seen[0] += 1;
            assert!((area[row] / light[row] - 1.0).abs() < 0.03, "{}", share[row]);
        }
        if share[row] > 0.95 {
            seen[1] += 1;
            let (found, limit) = (1.0 - area[row], 1.0 - full[row]);
            assert!((found / limit - 1.0).abs() < 0.06, "{}: {found} {limit}", share[row]);
        }
    }
    assert!(seen.iter().all(|&count| count >= 3), "{seen:?}");

    // The punch consists of whole nodes, so each edge node gives an error of one in 16 000 nodes.
    let punch = table("punch");
    assert!(column(&punch, "error").iter().all(|error| error.abs() < 2e-3));
}

#[test]
fn a_measured_surface_is_pressed_in_pascals_up_to_full_contact() {
    let bench = Bench::new();
    run(&bench, "measured-mirrored");
    let contact = bench.table("measured-mirrored", "contact");
    let modulus = contact.reals("effective_modulus").unwrap().value(0);
    // 1/E* = (1 − 0.3²)/210 GPa + (1 − 0.17²)/72 GPa.
    assert!((modulus / 56.1e9 - 1.0).abs() < 1e-2, "{modulus}");
    let stops = contact.texts("stop").unwrap();
    assert_eq!(stops.value(contact.rows() - 1), "full-contact");

    let area = bench.table("measured-mirrored", "area");
    let fractions = column(&area, "area_fraction");
    assert!(fractions.is_sorted());
    assert_eq!(fractions.last(), Some(&1.0));
    let pressures = column(&area, "pressure");
    let surface = bench.table("measured-mirrored", "surface");
    let slope = surface.reals("rms_slope").unwrap().value(0);
    let full = surface.reals("full_contact_load").unwrap().value(0) * modulus * slope;
    let is_full = stops.iter().map(|stop| stop == Some("full-contact"));
    assert!(is_full.eq(pressures.iter().map(|pressure| *pressure >= full)));
    let gaps = column(&contact, "mean_gap");
    assert!(gaps.is_sorted_by(|a, b| a >= b));
    // The gap is a few nanometres for a roughness of 35 nm.
    assert!(gaps[0] < 5.0 * 35e-9 && gaps[0] > 35e-9, "{}", gaps[0]);
}

#[test]
fn a_scan_without_its_short_waves_is_smoother_and_touches_more() {
    let bench = Bench::new();
    run(&bench, "measured");
    let scan = bench.table("measured", "scan");
    assert_eq!(scan.rows(), 8);
    let [levels, units] = ["level", "unit"].map(|name| scan.texts(name).unwrap());
    assert!(units.iter().all(|unit| unit == Some("m")));
    let [cutoffs, slopes] = ["low_pass", "rms_slope"].map(|name| column(&scan, name));
    for row in 1..scan.rows() {
        if levels.value(row) == levels.value(row - 1) {
            assert!(cutoffs[row] > cutoffs[row - 1] && slopes[row] < slopes[row - 1]);
        }
    }
    // At equal reduced loads the areas are similar; at equal pressures the area of the smoother
    // surface is larger.
    let table = bench.table("measured", "table");
    assert_eq!(table.rows(), 48);
    let [areas, pressures] = ["area_percent", "pressure_gpa"].map(|name| column(&table, name));
    let slopes = column(&table, "rms_slope");
    for ((area, pressure), slope) in areas.iter().zip(&pressures).zip(&slopes) {
        let kappa = area / 100.0 * slope * 56.1 / pressure;
        // κ is about 2.5 for the first contacts, and up to 1.7 times larger with two nodes per
        // shortest wavelength.
        assert!((1.2..4.3).contains(&kappa), "{kappa}");
    }
    let contact = bench.table("measured", "contact");
    let stops = contact.texts("stop").unwrap();
    assert!(stops.iter().all(|stop| stop == Some("converged")));
}

#[test]
fn two_scans_of_one_surface_agree_in_their_overlap() {
    let bench = Bench::new();
    let path = manifests().join("stitched.toml");
    let output = bench.output(&["run", path.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let table = bench.table("stitched", "stitched");
    let scans = table.integers("scans").unwrap();
    assert_eq!(scans.iter().flatten().max(), Some(2));
    let ratios: Vec<f64> = table.reals("overlap_ratio").unwrap().iter().flatten().collect();
    assert!(ratios.len() > 2 && ratios.iter().all(|ratio| (0.4..2.5).contains(ratio)));
    let wavenumbers = column(&table, "wavenumber");
    assert!(wavenumbers.is_sorted());
    // From a quarter of the wide scan to two steps of the fine one, whose tip resolved its peaks.
    let ends = [wavenumbers[0], wavenumbers[wavenumbers.len() - 1]];
    let [longest, shortest] = ends.map(|q| std::f64::consts::TAU / q);
    assert!((2e-6..=2.5e-6).contains(&longest), "{longest}");
    assert!((7.8e-8..9e-8).contains(&shortest), "{shortest}");
    let roughness = bench.table("stitched", "roughness");
    let slopes = column(&roughness, "Sdq");
    // The ensemble has the short waves of the fine scan, which the wide one lacks.
    let ensemble = &slopes[2..];
    assert_eq!(ensemble.len(), 4);
    assert!(
        ensemble.iter().all(|slope| *slope > 0.9 * slopes[0] && *slope < slopes[1]),
        "{slopes:?}"
    );
}

#[test]
fn lines_of_a_known_surface_give_its_slope_and_its_contact() {
    let bench = Bench::new();
    let path = manifests().join("profile.toml");
    let output = bench.output(&["run", path.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let known = column(&bench.table("profile", "sample"), "rms_slope")[0];
    let slopes = bench.table("profile", "slopes");
    let of = |name: &str| column(&slopes, name);
    for row in 0..3 {
        // The interval holds in 95 % of all studies; twice its width holds here.
        let [lower, slope, upper] =
            ["slope_lower", "slope", "slope_upper"].map(|name| of(name)[row]);
        assert!(known > lower * lower / slope && known < upper * upper / slope, "{row}");
        assert!((of("profile_slope")[row] * 2_f64.sqrt() / slope - 1.0).abs() < 0.05);
    }
    // The interval of a hundred profiles is narrow.
    assert!(of("slope_upper")[2] / of("slope_lower")[2] < 1.1);
    let comparison = bench.table("profile", "comparison");
    assert_eq!(comparison.rows(), 9);
    let [areas, exact] = ["area", "known"].map(|name| column(&comparison, name));
    for (area, exact) in areas[6..].iter().zip(&exact[6..]) {
        assert!((area / exact - 1.0).abs() < 0.1, "{area} should be {exact}");
    }
    // Lines of a scan have the parameters of profiles.
    let parameters = bench.table("profile", "parameters");
    assert_eq!(parameters.rows(), 4);
    let [heights, rt] = ["Rz", "Rt"].map(|name| column(&parameters, name));
    assert!(heights.iter().zip(&rt).all(|(mean, total)| *mean > 0.0 && mean <= total));
}
