//! Tests of the forecast of memory.

use std::path::Path;

use crate::study::Study;

use super::*;

pub fn plan(nodes: usize, more: &str) -> Plan {
    let manifest = format!(
        "
        [study]
        name = \"study\"
        [stage.surfaces]
        kind = \"generate\"
        nodes = {nodes}
        hurst = 0.8
        k_lower = 2
        k_upper = 8
        heights = \"redraw\"
        [stage.contact]
        kind = \"solve\"
        from = \"surfaces\"
        {more}
        "
    );
    Plan::new(&Study::parse(&manifest, "study.toml", Path::new("")).unwrap())
}

pub fn all(plan: &Plan) -> Vec<usize> {
    (0..plan.tasks.len()).collect()
}

/// Returns the memory of the largest task in bytes per node of the mesh.
fn bytes_per_node(nodes: usize, more: &str) -> f64 {
    let plan = plan(nodes, more);
    of_largest(&plan, &all(&plan)).0 as f64 / (nodes * nodes) as f64
}

#[test]
fn memory_is_that_of_the_maps() {
    let few = "loads = [0.1, 0.2]";
    assert_eq!(bytes_per_node(256, few), bytes_per_node(64, few));
    let fine = bytes_per_node(64, "loads = [0.1, 0.2]\ntolerance = 1e-8");
    assert_eq!(fine, bytes_per_node(64, few) + 4.0);
    let free = bytes_per_node(64, "loads = [0.1, 0.2]\nboundary = \"free\"");
    assert_eq!(free, bytes_per_node(64, few) + 63.0);
    let kept = bytes_per_node(64, "loads = [0.1, 0.2]\npressures = \"all\"");
    assert!(kept > bytes_per_node(64, few) + 2.0 * 8.0);
    let contacts = bytes_per_node(64, "loads = { to = 0.2, steps = 90 }");
    assert!(contacts > bytes_per_node(64, few) + 88.0 / 8.0);
}

#[test]
fn surfaces_are_pooled_on_as_many_threads_as_they_fit() {
    let pool = "loads = [0.1]
        [stage.heights]
        kind = \"measure\"
        from = \"surfaces\"
        pool = true";
    let plan = plan(64, pool);
    let pooled = plan.stages[2].tasks.clone();
    let one = of_task(&plan, pooled[0], 1);
    let eight = NonZeroUsize::new(8).unwrap();
    let threads = |room: u64| threads(&plan, &all(&plan), ByteSize(room), eight).get();
    assert_eq!([threads(0), threads(3 * one.0), threads(100 * one.0)], [1, 3, 8]);
}

#[test]
fn more_memory_than_there_are_addresses_is_not_there() {
    assert!(is_available(ByteSize::mib(1)));
    assert!(!is_available(ByteSize(u64::MAX)));
    assert!(!is_available(ByteSize(1 << 62)));
}

fn allowance(size: ByteSize, limit: LimitedBy) -> MemoryLimit {
    MemoryLimit { size, limit }
}

#[test]
fn a_task_fits_to_the_byte_or_is_refused() {
    let plan = plan(64, "loads = [0.1]");
    let takes = PROGRAM + of_largest(&plan, &all(&plan));
    let fits = |size: u64| allowance(ByteSize(size), LimitedBy::Asked).fits(&plan, &all(&plan));
    assert_eq!(fits(takes.0), Ok(()));
    assert!(fits(takes.0 - 1).is_err());
    assert_eq!(
        fits(takes.0).and(allowance(ByteSize(0), LimitedBy::Asked).fits(&plan, &[])),
        Ok(())
    );
}

#[test]
fn a_refusal_says_what_is_too_large_and_what_would_do() {
    let plan = plan(8192, "loads = [0.1]");
    let refusal = |limit| {
        let refused = allowance(ByteSize::gb(1), limit).fits(&plan, &all(&plan));
        refused.unwrap_err().to_string()
    };
    let takes = "a task of stage `contact` needs 3.8GB of memory on its mesh of 8192 × 8192 nodes";
    assert_eq!(
        refusal(LimitedBy::Asked),
        format!(
            "{takes}, more than the 1.0 GB of `--memory`: increase it, or reduce the mesh to \
              4123 × 4123 nodes"
        )
    );
    assert!(refusal(LimitedBy::Machine).contains("try it anyway with `--memory 3.8GB`"));
    assert!(
        refusal(LimitedBy::Addresses)
            .contains("of address space that `ulimit -v` leaves: raise that limit")
    );
    let most = self::plan(4123, "loads = [0.1]");
    let enough = allowance(ByteSize::gb(1), LimitedBy::Asked);
    assert_eq!(enough.fits(&most, &all(&most)), Ok(()));
}

#[test]
fn limits_of_addresses_are_read_as_the_kernel_writes_them() {
    let table = |limit: &str| {
        format!(
            "Limit                     Soft Limit           Hard Limit           Units     \n\
             Max cpu time              unlimited            unlimited            seconds   \n\
             Max address space         {limit:<20} unlimited            bytes     \n"
        )
    };
    assert_eq!(address_limit(&table("3072000000")), Some(3_072_000_000));
    assert_eq!(address_limit(&table("unlimited")), None);
    assert_eq!(address_limit(""), None);
}

#[test]
fn the_machine_has_memory() {
    let memory = of_machine();
    assert!(memory > PROGRAM, "{memory}");
}
