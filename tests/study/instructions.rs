//! All sets of vector instructions give the same bytes.

use std::sync::LazyLock;

use crate::bench::{Bench, assert_same_files, text};
use crate::manifest::manifest;

/// Study with meshes for both kinds of transform, rows that are no multiple of a register, and
/// tolerances for both kinds of solve.
static MESHES: LazyLock<String> = LazyLock::new(|| {
    manifest("meshes", "")
        .generate("surfaces", "nodes = [50, 64, 96]; hurst = 0.7; k_lower = 2; k_upper = 20")
        .solve("contact", "loads = [1e-9, 0.001, 0.02, 0.3, 1.0]")
        .solve("tight", "from = 'surfaces'; loads = [0.01, 0.2]; tolerance = 1e-8")
        .measure("area", "from = ['contact', 'tight']")
        .text()
});

/// Returns the instruction sets of this processor from the error about an unknown one.
fn available_sets() -> Vec<String> {
    let bench = Bench::new();
    let path = bench.write(&MESHES);
    let refused = bench
        .asperity(&["check", path.to_str().unwrap()])
        .env("ASPERITY_SIMD", "none")
        .output()
        .unwrap();
    assert_eq!(refused.status.code(), Some(2));
    let message = text(&refused.stderr);
    let (_, names) = message.split_once("available on this processor: ").expect(&message);
    let names = names.split('`').skip(1).step_by(2);
    names.map(str::to_owned).collect()
}

#[test]
fn every_set_of_instructions_computes_the_same_bytes() {
    let files = |name: &String| {
        let bench = Bench::new();
        let path = bench.write(&MESHES);
        let run = bench
            .asperity(&["run", path.to_str().unwrap()])
            .env("ASPERITY_SIMD", name)
            .output()
            .unwrap();
        assert!(run.status.success(), "{name}: {}", text(&run.stderr));
        bench.files()
    };
    let all = available_sets();
    assert_eq!(all.last().map(String::as_str), Some("portable"));
    let all: Vec<_> = all.iter().map(files).collect();
    for pair in all.windows(2) {
        assert_same_files(&pair[0], &pair[1]);
    }
}
