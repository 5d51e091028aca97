//! Fuzz target that reads, validates and plans any text as a manifest.
#![no_main]

use std::path::{Component, Path};

use asperity::plan::Plan;
use asperity::session::DataFolder;
use asperity::study::Study;
use libfuzzer_sys::fuzz_target;

/// Largest number of surfaces of a study that is planned. Larger studies are valid but slow.
const MOST_SURFACES: u64 = 20;

fuzz_target!(|text: &str| {
    // Folder of the surface files.
    let folder = Path::new("maps");
    match Study::parse(text, "fuzz.toml", folder) {
        Err(errors) => assert!(!errors.render(false).is_empty()),
        Ok(study) => {
            if study.surfaces() <= MOST_SURFACES {
                check(&Plan::new(&study));
            }
        }
    }
});

/// Checks that inputs precede the tasks that read them, that keys follow from provenance, and that
/// tables stay in the folder of results.
fn check(plan: &Plan) {
    for (number, task) in plan.tasks.iter().enumerate() {
        assert!(task.inputs.iter().all(|&input| input < number));
        assert_eq!(plan.provenance(number).key(), task.key);
    }
    for stage in &plan.stages {
        let path = DataFolder::new("").table(&plan.study, &stage.name);
        let parts: Vec<_> = path.components().collect();
        assert_eq!(parts.len(), 3);
        assert!(parts.iter().all(|part| matches!(part, Component::Normal(_))));
    }
}
