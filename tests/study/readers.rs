//! Readers always find complete files, old or new, while runs replace them.

use std::fs::{self, File};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use asperity::tables::parquet;
use asperity::tables::parquet::Columns;

use crate::bench::{Bench, STUDY};

fn study(surfaces: u32) -> String {
    let surfaces = format!("realizations = {surfaces}");
    STUDY.replace("realizations = 2", &surfaces)
}

fn rows(table: &Path) -> usize {
    let file = File::open(table).expect("the file always exists");
    let (table, _) = parquet::decode(file, Columns::All).expect("the file is always complete");
    table.rows()
}

#[test]
fn a_table_a_page_and_its_owner_are_whole_at_every_moment_of_runs_that_replace_them() {
    let bench = Bench::new();
    bench.run(&study(2));
    let manifest = bench.path("study.toml");
    let report = || bench.output(&["report", manifest.to_str().unwrap()]);
    assert!(report().status.success());
    let folder = bench.data().join("results/small");
    let (is_over, reads) = (AtomicBool::new(false), AtomicUsize::new(0));
    thread::scope(|scope| {
        for stage in ["surfaces", "area", "law"] {
            let (table, is_over, reads) =
                (folder.join(format!("{stage}.parquet")), &is_over, &reads);
            let possible: &[usize] = match stage {
                "area" => &[8, 16, 24],
                "surfaces" => &[2, 4, 6],
                _ => &[4],
            };
            scope.spawn(move || {
                while !is_over.load(Ordering::Relaxed) {
                    assert!(possible.contains(&rows(&table)), "{stage}");
                    reads.fetch_add(1, Ordering::Relaxed);
                }
            });
        }
        scope.spawn(|| {
            while !is_over.load(Ordering::Relaxed) {
                let page = fs::read_to_string(folder.join("report.html")).unwrap();
                assert!(page.trim_end().ends_with("-->"));
                let owner = fs::read(folder.join("owner.json")).unwrap();
                serde_json::from_slice::<serde_json::Value>(&owner).unwrap();
            }
        });
        // A panic here would let the readers run forever.
        let runs = [3, 1, 2, 3, 1, 2].map(|surfaces| {
            fs::write(&manifest, study(surfaces)).unwrap();
            let run = bench.output(&["run", manifest.to_str().unwrap()]);
            run.status.success()
        });
        let reported = report().status.success();
        is_over.store(true, Ordering::Relaxed);
        assert!(runs.iter().all(|success| *success) && reported);
    });
    assert!(reads.into_inner() > 100);
}
