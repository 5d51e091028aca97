//! Runs the examples, whose `main` is public for this test.

#[path = "../examples/adhesion.rs"]
mod adhesion;
#[path = "../examples/ensemble.rs"]
mod ensemble;
#[path = "../examples/flow.rs"]
mod flow;
#[path = "../examples/layer.rs"]
mod layer;
#[path = "../examples/measured.rs"]
mod measured;
#[path = "../examples/press.rs"]
mod press;

#[test]
fn every_example_runs() {
    adhesion::main().unwrap();
    ensemble::main().unwrap();
    flow::main().unwrap();
    layer::main().unwrap();
    measured::main().unwrap();
    press::main().unwrap();
}
