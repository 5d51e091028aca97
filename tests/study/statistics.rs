//! Statistics of surfaces, random surfaces with a given spectrum, and anisotropic surfaces.

use std::collections::BTreeMap;
use std::fs;
use std::sync::LazyLock;

use asperity::tables::table::Table;

use crate::bench::{Bench, is_idle, text};
use crate::columns::assert_kept;
use crate::manifest::manifest;

/// Study of a random surface as a scan, its statistics, and random surfaces with its spectrum.
static ENSEMBLE: LazyLock<String> = LazyLock::new(|| {
    manifest("ensemble", "seed = 3")
        .generate(
            "scan",
            "nodes = 64; side = 5.0; hurst = 0.8; k_lower = 2; k_rolloff = 4; k_upper = 31; \
             rms_slope = 0.1",
        )
        .measure("spectrum", "what = 'spectrum'")
        .generate(
            "drawn",
            "from = 'spectrum'; method = 'spectrum'; nodes = 64; side = 5.0; realizations = 20",
        )
        .measure("drawn_spectrum", "what = 'spectrum'")
        .measure("scan_roughness", "from = 'scan'; what = 'roughness'")
        .measure("drawn_roughness", "from = 'drawn'; what = 'roughness'")
        .solve("contact", "from = 'drawn'; loads = [0.02]")
        .measure("area", "")
        .text()
});

fn values(table: &Table, name: &str) -> Vec<f64> {
    let column = table.reals(name).unwrap().iter();
    column.map(|value| value.expect("no nulls")).collect()
}

/// Returns means and standard deviations of a column, grouped by another column.
fn by(table: &Table, key: &str, name: &str) -> BTreeMap<u64, (f64, f64)> {
    let mut groups: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
    for (key, value) in values(table, key).into_iter().zip(values(table, name)) {
        groups.entry(key.to_bits()).or_default().push(value);
    }
    groups.into_iter().map(|(key, values)| (key, mean_and_sd(&values))).collect()
}

fn mean_and_sd(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / (count - 1.0)).sqrt())
}

#[test]
fn surfaces_drawn_from_a_measured_spectrum_have_it_within_their_scatter() {
    let bench = Bench::new();
    bench.run(&ENSEMBLE);
    let table = |stage: &str| bench.table("ensemble", stage);
    let (scan, drawn) = (table("spectrum"), table("drawn_spectrum"));
    let drawn = by(&drawn, "wavenumber", "spectral_density");
    let rings = values(&scan, "wavenumber").into_iter();
    let densities = values(&scan, "spectral_density");
    // Beyond the cutoff, only rounding errors of the transforms remain.
    let least = 1e-20 * densities.iter().copied().fold(0.0, f64::max);
    let mut compared = 0;
    for (wavenumber, density) in rings.zip(densities).filter(|ring| ring.1 > least) {
        let (mean, sd) = drawn[&wavenumber.to_bits()];
        // None of 30 rings deviates by four standard errors; each is a mean of 20 skewed densities.
        let error = sd / 20_f64.sqrt();
        assert!((mean - density).abs() <= 4.5 * error, "{wavenumber}: {mean} {density}");
        compared += 1;
    }
    assert_eq!(compared, 30, "rings from the second to the last before the cutoff");

    let (scan, drawn) = (table("scan_roughness"), table("drawn_roughness"));
    for name in ["Sq", "Sdq"] {
        let (mean, sd) = mean_and_sd(&values(&drawn, name));
        let scan = values(&scan, name)[0];
        assert!((mean - scan).abs() <= 4.0 * sd / 20_f64.sqrt() + 0.02 * scan, "{name}");
    }
    assert_kept(&bench, "ensemble", &bench.path("study.toml"));
}

#[test]
fn more_surfaces_of_a_measured_spectrum_keep_those_that_are_there() {
    let bench = Bench::new();
    let few = ENSEMBLE.replace("realizations = 20", "realizations = 3");
    bench.run(&few);
    let before = bench.table("ensemble", "drawn");
    let again = bench.run(&few);
    assert!(again.values().all(is_idle), "{again:?}");
    bench.run(&ENSEMBLE.replace("realizations = 20", "realizations = 5"));
    let after = bench.table("ensemble", "drawn");
    assert_eq!(values(&before, "rms_height"), values(&after, "rms_height")[..3]);
    // Another scan gives other surfaces.
    bench.run_with(&few.replace("seed = 3", "seed = 4"), &["--replace"]);
    let other = bench.table("ensemble", "drawn");
    assert_ne!(values(&before, "rms_height"), values(&other, "rms_height"));
}

#[test]
fn a_spectrum_in_a_file_is_drawn_in_its_own_unit_or_another() {
    let bench = Bench::new();
    fs::write(
        bench.path("spectrum.csv"),
        "wavenumber [1/µm], density [µm^4]\n0.6, 1e-3\n1.2, 1e-3\n12, 4e-7\n",
    )
    .unwrap();
    let manifest = |keys: &str| {
        manifest("given", "")
            .generate(
                "surfaces",
                &format!(
                    "method = 'spectrum'; path = 'spectrum.csv'; nodes = 64; realizations = 2; \
                     {keys}"
                ),
            )
            .measure("statistics", "what = 'roughness'")
            .text()
    };
    let heights = |keys: &str| {
        bench.run_with(&manifest(keys), &["--replace"]);
        assert_kept(&bench, "given", &bench.path("study.toml"));
        let surfaces = bench.table("given", "surfaces");
        (surfaces.texts("unit").unwrap().value(0).to_owned(), values(&surfaces, "rms_height"))
    };
    let (unit, micrometres) = heights("side = 20");
    assert_eq!(unit, "", "that of the file");
    let (unit, metres) = heights("side = 20e-6\nunit = \"m\"");
    assert_eq!(unit, "m");
    for (micrometre, metre) in micrometres.iter().zip(&metres) {
        assert!((1e6 * metre / micrometre - 1.0).abs() < 1e-10);
    }
    let (_, redrawn) = heights("side = 20\nheights = \"redraw\"");
    assert_eq!(micrometres, redrawn);
    // The results can be read without the file of the scan.
    fs::rename(bench.path("spectrum.csv"), bench.path("elsewhere.csv")).unwrap();
    let path = bench.path("study.toml");
    let shown = bench.output(&["table", path.to_str().unwrap(), "surfaces"]);
    assert!(shown.status.success(), "{}", text(&shown.stderr));
    fs::rename(bench.path("elsewhere.csv"), bench.path("spectrum.csv")).unwrap();
    heights("side = 20\nrms_slope = 0.25");
    let slopes = values(&bench.table("given", "surfaces"), "rms_slope");
    assert_eq!(slopes, [0.25; 2]);
}

#[test]
fn an_ensemble_with_a_measured_spectrum_grows_until_a_mean_is_known() {
    let bench = Bench::new();
    let growing = ENSEMBLE.replace(
        "realizations = 20",
        "realizations = { at_least = 2, at_most = 40, until = \"sem(drawn_roughness.Sq) < 4 %\" }",
    );
    bench.run(&growing);
    let found = values(&bench.table("ensemble", "drawn_roughness"), "Sq");
    assert!(found.len() > 2 && found.len() <= 40, "{}", found.len());
    let (mean, sd) = mean_and_sd(&found);
    assert!(found.len() == 40 || sd / (found.len() as f64).sqrt() < 0.04 * mean);
}

#[test]
fn a_grain_is_a_parameter_that_is_swept() {
    let bench = Bench::new();
    let manifest = &manifest("grain", "")
        .generate(
            "surfaces",
            "nodes = 64; hurst = 0.8; k_lower = 4; k_upper = 24; \
             anisotropy = [{ ratio = 1 }, { ratio = 3.0 }, { ratio = 3.0, angle = 90 }]; \
             realizations = 2",
        )
        .measure("scales", "what = 'scales'")
        .aggregate("mean", "from = 'surfaces'; over = ['m20', 'm02']")
        .text();
    bench.run(manifest);
    let mean = bench.table("grain", "mean");
    let (along_x, along_y) = (values(&mean, "m20_mean"), values(&mean, "m02_mean"));
    assert_eq!(along_x.len(), 3);
    let ratios: Vec<f64> = along_y.iter().zip(&along_x).map(|(y, x)| y / x).collect();
    // Means over two surfaces with about 900 modes each, a third of that with anisotropy.
    assert!((ratios[0] - 1.0).abs() < 0.3, "{ratios:?}");
    assert!((ratios[1] / 9.0 - 1.0).abs() < 0.4, "{ratios:?}");
    assert!((ratios[2] * 9.0 - 1.0).abs() < 0.4, "{ratios:?}");

    // The ratio is 1, not null, so grouping a data frame by the ratio keeps these surfaces.
    for table in [bench.table("grain", "surfaces"), bench.table("grain", "mean")] {
        let column = |name| table.reals(name).unwrap();
        let (ratios, angles) = (column("anisotropy_ratio"), column("anisotropy_angle"));
        let points: Vec<_> = ratios.iter().zip(angles).collect();
        let of_point = points.len() / 3;
        let expected = [(1.0, 0.0), (3.0, 0.0), (3.0, 90.0)];
        let expected = expected.map(|(ratio, angle)| (Some(ratio), Some(angle)));
        for (found, expected) in points.chunks(of_point).zip(expected) {
            assert_eq!(found, vec![expected; of_point]);
        }
    }

    // A ratio of 1 gives the same surface with the same key as a stage without anisotropy.
    let plain = manifest.replace(
        "anisotropy = [{ ratio = 1 }, { ratio = 3.0 }, { ratio = 3.0, angle = 90 }]\n",
        "",
    );
    let other = Bench::new();
    other.run(&plain);
    let [swept, plain] = [&bench, &other].map(|bench| bench.table("grain", "surfaces"));
    let surfaces = |table: &Table| {
        table.texts("surface").unwrap().iter().flatten().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(surfaces(&swept)[..2], surfaces(&plain));
    assert!(!plain.has("anisotropy_ratio"));
}

#[test]
fn a_fit_finds_the_hurst_exponent_of_an_ensemble_and_of_one_surface() {
    let bench = Bench::new();
    for realizations in [1, 8] {
        let manifest = manifest("fit", "")
            .generate(
                "surfaces",
                &format!(
                    "nodes = 128; side = 2.0; hurst = 0.7; k_lower = 1; k_rolloff = 8; \
                     k_upper = 63; realizations = {realizations}"
                ),
            )
            .measure("spectrum", "what = 'spectrum'")
            .fit("law", "law = 'self-affine'; window = [1, 190]; bootstrap = 100")
            .text();
        bench.run_with(&manifest, &["--replace"]);
        assert_kept(&bench, "fit", &bench.path("study.toml"));
        let law = bench.table("fit", "law");
        assert_eq!(law.rows(), 1);
        for (name, truth) in
            [("hurst_exponent", 0.7), ("rolloff_wavenumber", std::f64::consts::TAU * 8.0 / 2.0)]
        {
            let of = |end: &str| values(&law, &format!("{name}{end}"))[0];
            let error = of("_standard_error");
            assert!(error > 0.0 && error < 0.1 * truth, "{name} {error}");
            assert!((of("") - truth).abs() < 4.0 * error, "{name} {}", of(""));
            assert!(of("_lower") < of("") && of("") < of("_upper"));
        }
    }
}

#[test]
fn what_cannot_be_drawn_again_cannot_be_pooled() {
    let bench = Bench::new();
    let manifest = format!(
        "{}\n[stage.pooled]\nkind = \"measure\"\nfrom = \"drawn\"\npool = true\n",
        *ENSEMBLE
    );
    let path = bench.write(&manifest);
    let output = bench.output(&["check", path.to_str().unwrap()]);
    let printed = text(&output.stderr);
    assert!(printed.contains("cannot be pooled"), "{printed}");
}
