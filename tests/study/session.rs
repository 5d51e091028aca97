//! Studies through the library, which writes the same bytes as the command.

use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use asperity::session::{Event, Notice, RunOptions, RunReport, Selection, Session, SessionError};
use bytesize::ByteSize;

use crate::bench::{Bench, STUDY, assert_same_files};

fn session(bench: &Bench, manifest: &str) -> Session<'static> {
    Session::new(bench.write(manifest), bench.data())
}

/// Options that compute one task at a time, in the order of the plan.
fn alone() -> RunOptions {
    let mut options = RunOptions::default();
    options.jobs = NonZeroUsize::new(1);
    options
}

fn run(session: &Session) -> RunReport {
    session.run(&alone(), &AtomicBool::new(false)).unwrap()
}

#[test]
fn a_session_writes_what_the_command_writes() {
    let [by_command, by_session] = [Bench::new(), Bench::new()];
    by_command.run(&STUDY);
    let report = run(&session(&by_session, &STUDY));
    let plan = &report.sampled.plan;
    let wanted: Vec<_> = report.wanted.iter().map(|&task| plan.tasks[task].key).collect();
    assert_eq!(report.outcome.computed, wanted);
    assert_same_files(&by_session.files(), &by_command.files());
}

#[test]
fn a_run_that_is_stopped_goes_on_later_and_ends_with_the_same_bytes() {
    let [undisturbed, stopped] = [Bench::new(), Bench::new()];
    run(&session(&undisturbed, &STUDY));
    let stop = AtomicBool::new(false);
    let stop_after_the_first = |event: Event| {
        if let Event::Finished(_) = event {
            stop.store(true, Ordering::SeqCst);
        }
    };
    let observed = session(&stopped, &STUDY).observed_by(&stop_after_the_first);
    let report = observed.run(&alone(), &stop).unwrap();
    assert!(report.outcome.interrupted);
    assert_eq!(report.outcome.computed.len(), 1);
    let session = session(&stopped, &STUDY);
    let missing = session.status().unwrap().missing.len();
    assert_eq!(missing, report.wanted.len() - 1);
    assert_eq!(run(&session).outcome.computed.len(), missing);
    assert_same_files(&stopped.files(), &undisturbed.files());
}

#[test]
fn an_observer_hears_of_every_task_once_and_of_what_was_damaged() {
    let bench = Bench::new();
    let received = Mutex::new((Vec::new(), Vec::new()));
    let on_event = |event: Event| {
        let (finished, damaged) = &mut *received.lock().unwrap();
        match event {
            Event::Finished(task) => finished.push(task),
            Event::Notice(notice @ Notice::Damaged(_)) => damaged.push(notice.to_string()),
            _ => {}
        }
    };
    let session = session(&bench, &STUDY).observed_by(&on_event);
    let report = run(&session);
    let (mut finished, damaged) = std::mem::take(&mut *received.lock().unwrap());
    finished.sort_unstable();
    assert_eq!(finished, report.wanted);
    assert!(damaged.is_empty(), "{damaged:?}");

    // Damage a surface that the next tasks read.
    let surface = session.table("surfaces").unwrap();
    let key = surface.texts("task").unwrap().value(0).to_owned();
    let path = session.data().store().join(&key[..2]);
    std::fs::write(path.join(format!("{key}.parquet")), "nothing").unwrap();
    let more = STUDY.replace("steps = 4", "steps = 5");
    bench.write(&more);
    run(&session);
    let (_, damaged) = std::mem::take(&mut *received.lock().unwrap());
    assert_eq!(damaged.len(), 1, "{damaged:?}");
    assert!(damaged[0].contains("set aside as"), "{}", damaged[0]);
}

#[test]
fn refusals_are_distinguished_from_failures() {
    let bench = Bench::new();
    let session = session(&bench, &STUDY);
    let not_yet = session.table("area").unwrap_err();
    assert!(matches!(&not_yet, SessionError::NotComputed { name, .. } if name == "area"));
    assert!(!not_yet.is_misuse());
    run(&session);
    assert_eq!(session.table("area").unwrap().rows(), 16);
    assert_eq!(session.failures().unwrap().rows(), 0);
    let only = |key: &str| {
        let mut options = alone();
        options.selection = Selection::Task(key.to_owned());
        options
    };
    let refused = |options: &RunOptions| session.prepare(options).map(drop).unwrap_err();
    let mut refusals = vec![
        session.table("aera").map(drop).unwrap_err(),
        session.sql("select none from area").map(drop).unwrap_err(),
        session.claims().unwrap().named("none").map(drop).unwrap_err(),
        refused(&only("no key")),
        refused(&only("0123456789abcdef0123456789abcdef")),
    ];
    assert!(refusals[0].to_string().contains("did you mean `area`?"));
    bench.write(&STUDY.replace("seed = 7", "seed = 8"));
    let mut tiny = alone();
    tiny.memory = Some(ByteSize(1));
    refusals.push(refused(&tiny));
    for refusal in &refusals {
        assert!(refusal.is_misuse(), "{refusal:?}");
    }
}
