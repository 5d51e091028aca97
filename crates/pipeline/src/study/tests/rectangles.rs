//! Tests of `nodes` and `side` given as lists, which define sweeps or rectangular grids.

use super::*;
use asperity_mechanics::grid::Grid;

const ROUGH: &str = "kind = \"generate\"\nhurst = 0.8\nk_lower = 2\n";

fn text(kind: &str, rest: &str) -> String {
    format!("[study]\nname = \"s\"\n[stage.s]\n{kind}{rest}\n")
}

fn of(kind: &str, rest: &str) -> Vec<([usize; 2], [f64; 2])> {
    let Work::Generate(ensembles) = &study(&text(kind, rest)).stages[0].work else {
        panic!("no surfaces");
    };
    let grids = ensembles.iter().map(|ensemble| ensemble.params.grid());
    let shape = |grid: Grid| (grid.nodes(), grid.cell().size());
    grids.map(|grid| shape(grid.unwrap())).collect()
}

/// Returns the (nodes, side) pairs of random surfaces with a cutoff that fits all meshes used here.
fn rough(rest: &str) -> Vec<([usize; 2], [f64; 2])> {
    of(ROUGH, &format!("k_upper = 4\n{rest}"))
}

fn warnings(rest: &str) -> Vec<String> {
    let study = study(&text(ROUGH, &format!("k_upper = 4\n{rest}")));
    study.warnings().iter().map(ToString::to_string).collect()
}

fn message(kind: &str, rest: &str) -> String {
    let errors = Study::parse(&text(kind, rest), "s.toml", &folder());
    errors.expect_err(rest).render(false)
}

#[test]
fn a_list_of_one_key_alone_is_swept_as_ever() {
    let squares = |sides: &[(usize, f64)]| -> Vec<_> {
        sides.iter().map(|&(nodes, side)| ([nodes; 2], [side; 2])).collect()
    };
    for (rest, expected) in [
        ("nodes = [64, 128]", squares(&[(64, 1.0), (128, 1.0)])),
        ("nodes = [64, 128]\nside = 2", squares(&[(64, 2.0), (128, 2.0)])),
        ("nodes = 64\nside = [1, 2]", squares(&[(64, 1.0), (64, 2.0)])),
        (
            "nodes = [32, 64, 128]\nside = [1, 2]",
            squares(&[(32, 1.0), (32, 2.0), (64, 1.0), (64, 2.0), (128, 1.0), (128, 2.0)]),
        ),
        ("nodes = [64]\nside = [1]", squares(&[(64, 1.0)])),
        (
            "cases = [{ nodes = 64 }, { nodes = 32 }]\nside = [1, 2]",
            squares(&[(64, 1.0), (64, 2.0), (32, 1.0), (32, 2.0)]),
        ),
    ] {
        assert_eq!(rough(rest), expected, "{rest}");
        assert!(warnings(rest).is_empty(), "{rest}");
    }
}

#[test]
fn pairs_of_both_keys_are_one_rectangle_which_is_said() {
    let rest = "nodes = [128, 64]\nside = [2.0, 1.0]";
    assert_eq!(rough(rest), [([128, 64], [2.0, 1.0])]);
    let warnings = warnings(rest);
    assert_eq!(warnings.len(), 1);
    for part in [
        "stage `s`",
        "`nodes = [128, 64]` with `side = [2, 1]` is read as one rectangle",
        "`nodes = [[128, 64]]`",
        "`cases = [{ nodes = 128, side = 2 }, …]`",
    ] {
        assert!(warnings[0].contains(part), "{part} in {warnings:?}");
    }
}

#[test]
fn nobody_asks_where_it_is_clear() {
    let rectangle = [([128, 64], [2.0, 1.0])];
    for rest in [
        "nodes = [[128, 64]]\nside = [[2.0, 1.0]]",
        "nodes = [[128, 64]]\nside = [2.0, 1.0]",
        "nodes = [128, 64]\nside = [[2.0, 1.0]]",
        "cases = [{ nodes = [128, 64], side = [2.0, 1.0] }]",
        "cases = [{ nodes = [128, 64] }]\nside = [2.0, 1.0]",
    ] {
        assert_eq!(rough(rest), rectangle, "{rest}");
        assert!(warnings(rest).is_empty(), "{rest}");
    }
    // A list that repeats one number cannot be a sweep.
    assert_eq!(rough("nodes = [64, 64]\nside = [2, 1]"), [([64, 64], [2.0, 1.0])]);
    assert!(warnings("nodes = [64, 64]\nside = [2, 1]").is_empty());
    assert_eq!(rough("nodes = [64, 64]\nside = [2, 2]"), [([64, 64], [2.0, 2.0])]);
}

#[test]
fn rectangles_are_swept_as_lists_of_pairs() {
    let both = [([64, 32], [2.0, 1.0]), ([128, 64], [2.0, 1.0])];
    assert_eq!(rough("nodes = [[64, 32], [128, 64]]\nside = [2.0, 1.0]"), both);
    let cases = "cases = [{ nodes = [64, 32], side = [2.0, 1.0] }, { nodes = 64, side = 1.0 }]";
    assert_eq!(rough(cases), [([64, 32], [2.0, 1.0]), ([64, 64], [1.0, 1.0])]);
}

#[test]
fn half_a_rectangle_is_refused() {
    for (rest, parts) in [
        ("nodes = [[128, 64]]", ["`nodes = [128, 64]` is a pair", "give both along both axes"]),
        (
            "nodes = [[128, 64], [64, 32]]\nside = 3.0",
            ["`side` is one number", "give both along both axes"],
        ),
        (
            "nodes = 64\nside = [[2.0, 1.0]]",
            ["`side = [2, 1]` is a pair", "give both along both axes"],
        ),
        (
            "nodes = [[128, 64], 64]\nside = [2.0, 1.0]",
            ["`nodes` is one number", "give both along both axes"],
        ),
        ("nodes = [[128, 64, 32]]\nside = [[2.0, 1.0]]", ["`nodes` has 3 entries", "must have 2"]),
        ("nodes = [[128, 2]]\nside = [[2.0, 1.0]]", ["`nodes` holds 2", "from 4 to 16384"]),
        ("nodes = [[128, 64]]\nside = [[2.0, -1.0]]", ["`side` holds -1.0", "must be above 0"]),
        (
            "nodes = [[128, 64], [128, 64]]\nside = [2.0, 1.0]",
            ["swept over the same value twice", "first here"],
        ),
    ] {
        let message = message(ROUGH, &format!("k_upper = 4\n{rest}"));
        for part in parts {
            assert!(message.contains(part), "{part} in {message}");
        }
    }
}

#[test]
fn waves_must_fit_both_sides() {
    let fits = "k_upper = 64\nnodes = [[128, 64]]\nside = [[2.0, 1.0]]";
    assert_eq!(of(ROUGH, fits), [([128, 64], [2.0, 1.0])]);
    let message = message(ROUGH, &fits.replace("64]", "62]"));
    for part in [
        "`k_upper = 64` needs at least 128 × 64 nodes, but `nodes` is [128, 62]",
        "64 waves along x and 31 along y",
    ] {
        assert!(message.contains(part), "{part} in {message}");
    }
}

#[test]
fn cutoffs_are_waves_along_the_longer_side_or_wavelengths() {
    let by_number = "k_lower = 4\nk_upper = 40\n";
    let by_length = "longest_wavelength = 0.5\nshortest_wavelength = 0.05\n";
    let rectangle = "nodes = [[256, 128]]\nside = [[2.0, 1.0]]\n";
    let head = "kind = \"generate\"\nhurst = 0.8\n";
    let plan = |cutoffs: &str| study(&text(head, &format!("{cutoffs}{rectangle}")));
    assert_eq!(plan(by_number), plan(by_length));
    for (cutoffs, parts) in [
        (
            "k_lower = 4\nshortest_wavelength = 0.06\n",
            ["fits 33.3333 times into the longer side, 2", "0.0606060606061 (33 times) and"],
        ),
        (
            "k_lower = 4\nk_upper = 8\nshortest_wavelength = 0.05\n",
            [
                "`k_upper` and `shortest_wavelength` exclude each other",
                "follows from the other key",
            ],
        ),
        (
            "longest_wavelength = 5\nk_upper = 8\n",
            ["fits 0.4000 times", "must fit from 1 to 8192 times"],
        ),
        (
            "longest_wavelength = 0.05\nshortest_wavelength = 0.5\n",
            ["`longest_wavelength = 0.05` is above `shortest_wavelength = 0.5`", "larger"],
        ),
        (
            "k_upper = 8\n",
            ["`k_lower` is not given", "Give either this key or `longest_wavelength`"],
        ),
    ] {
        let message = message(head, &format!("{cutoffs}{rectangle}"));
        for part in parts {
            assert!(message.contains(part), "{part} in {message}");
        }
    }
}

#[test]
fn a_map_of_more_nodes_along_one_axis_has_two_sides() {
    let head =
        "kind = \"generate\"\nmethod = \"file\"\npath = \"maps/rectangle.npy\"\nperiodic = true\n";
    let grid = [([6, 4], [3.0, 2.0])];
    assert_eq!(of(head, "side = [3.0, 2.0]"), grid);
    let mirrored = head.replace("true", "false\nedges = \"mirror\"");
    assert_eq!(of(&mirrored, "side = [3.0, 2.0]"), [([12, 8], [6.0, 4.0])]);
    let message = message(head, "side = 3.0");
    for part in ["along x and y, but `side`", "the first and the second axis"] {
        assert!(message.contains(part), "{part} in {message}");
    }
}

#[test]
fn an_open_map_is_pressed_with_nothing_beyond_it_or_made_periodic() {
    let head = "kind = \"generate\"\nmethod = \"file\"\npath = \"maps/rough.npy\"\nside = 1.0\n";
    let pressed = |map: &str, boundary: &str| {
        let solve = "[stage.c]\nkind = \"solve\"\nfrom = \"s\"\nloads = [0.1]";
        format!("{map}\n{solve}\n{boundary}")
    };
    for (map, boundary) in [
        ("periodic = false", "boundary = \"free\""),
        ("periodic = false\nedges = \"mirror\"", "boundary = \"periodic\""),
        ("periodic = false\nedges = \"mirror\"", "boundary = [\"free\", \"periodic\"]"),
        ("periodic = true", ""),
    ] {
        study(&text(head, &pressed(map, boundary)));
    }
    for boundary in ["", "boundary = \"periodic\"", "boundary = [\"periodic\", \"free\"]"] {
        let message = message(head, &pressed("periodic = false", boundary));
        for part in ["stage `s` is not periodic", "`boundary = \"free\"`", "`edges = \"mirror\"`"] {
            assert!(message.contains(part), "{part} in {message}");
        }
    }
}

#[test]
fn corrections_of_square_cells_are_refused_on_others() {
    let stages = "nodes = [[64, 64]]\nside = [[2.0, 1.0]]\nk_upper = 4\n\
        [stage.c]\nkind = \"solve\"\nfrom = \"s\"\nloads = [0.1]\n\
        [stage.a]\nkind = \"measure\"\nfrom = \"c\"\n\
        [stage.z]\nkind = \"correct\"\nfrom = \"a\"\ncorrection = ";
    study(&text(ROUGH, &format!("{stages}\"none\"")));
    let square = stages.replace("[[64, 64]]", "[[64, 32]]");
    study(&text(ROUGH, &format!("{square}\"2017\"")));
    for correction in ["\"2017\"", "\"pi/8\"", "0.1", "[\"none\", 0.1]"] {
        let message = message(ROUGH, &format!("{stages}{correction}"));
        for part in [
            "needs square cells, but the cells of stage `s` have Δx/Δy = 2.0000",
            "mesh-convergence",
        ] {
            assert!(message.contains(part), "{part} in {message}");
        }
    }
}

#[test]
fn the_recipe_of_a_periodic_block_says_nothing_of_its_boundary() {
    let of = |boundary: &str| {
        let block = block(&format!("loads = [0.1]\n{boundary}"));
        serde_json::to_string(&block).unwrap()
    };
    assert_eq!(of(""), of("boundary = \"periodic\""));
    assert!(!of("").contains("boundary"));
    let free = "\"boundary\":{\"beyond\":\"free\",\"version\":";
    assert!(of("boundary = \"free\"").contains(free));
}
