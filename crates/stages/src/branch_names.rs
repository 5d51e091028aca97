//! Names of the branches of a path, which goes back and forth between two directions.

/// Returns the branch of each state of a path, given the direction in which the state is reached. A
/// direction that the path takes again after a turn has a number: `loading`, `unloading`,
/// `loading-2`.
pub fn numbered(directions: impl Iterator<Item = &'static str>) -> Vec<String> {
    let mut branches: Vec<&'static str> = Vec::new();
    let name = |direction: &'static str| {
        if branches.last() != Some(&direction) {
            branches.push(direction);
        }
        match branches.iter().filter(|branch| **branch == direction).count() {
            1 => direction.to_owned(),
            turn => format!("{direction}-{turn}"),
        }
    };
    directions.map(name).collect()
}
