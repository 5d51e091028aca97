use std::path::Path;

use super::*;
use crate::study::Study;

/// Three surfaces, each pressed.
const STUDY: &str = r#"
[study]
name = "small"

[stage.surfaces]
kind = "generate"
nodes = 16
hurst = 0.8
k_lower = 1
k_upper = 4
realizations = 3

[stage.light]
kind = "solve"
from = "surfaces"
loads = [0.1]
"#;

/// Hears nothing.
struct Silence;

impl TaskObserver for Silence {
    fn started(&self, _: usize) {}
    fn advanced(&self, _: usize, _: f64) {}
    fn finished(&self, _: usize, _: Duration) {}
}

#[test]
fn memory_that_the_system_does_not_give_fails_its_task_and_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let study = Study::parse(STUDY, "small.toml", Path::new(""), crate::study::no_claims).unwrap();
    let mut plan = Plan::of(&study);
    // Petabytes.
    plan.tasks[0].nodes = [1 << 24; 2];
    let store = Store::open(&folder.path().join("store")).unwrap();
    let means = Resources {
        cores: NonZeroUsize::new(2).unwrap(),
        room: ByteSize(u64::MAX),
        checkpoint_every: Duration::MAX,
    };
    let missing = missing(&plan, &store);
    let stopped = AtomicBool::new(false);
    let sources = &study.sources;
    let archive = Archive::of(store, &folder.path().join("results"));
    let outcome = run(&plan, &missing, &archive, sources, means, &Silence, &stopped);
    let (first, error) = &outcome.failed[0];
    assert_eq!(*first, 0);
    assert!(matches!(error, TaskError::Memory { .. }), "{error}");
    assert!(error.to_string().contains("the system does not give"));
    let others = &outcome.failed[1..];
    assert!(others.iter().all(|(_, error)| matches!(error, TaskError::Upstream(_))));
    let all = outcome.computed.len() + outcome.failed.len();
    assert_eq!(all, plan.tasks.len());
    assert!(outcome.computed.len() > others.len());
}
