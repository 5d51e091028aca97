//! Warnings about valid studies that may not do what the user expects.

mod coarse_mesh;
mod files;
mod loads;

use std::fmt;

use serde::Serialize;

use self::files::file_warnings;
pub(crate) use self::loads::improbable_contact;
use self::loads::{improbable_modulus, rearranged_loads};
use crate::study::summary::solved;
use crate::study::{Stage, Study, pairs};
use asperity_manifest::diagnostics::listed;
use asperity_stages::{Recipe, measure};

/// Largest magnitude of Dundurs' constant β of bodies that count as elastically similar. Tractions
/// of this relative size are smaller than the coupling through ν, which is neglected, too.
const SIMILAR: f64 = 0.01;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Warning {
    pub stage: String,
    /// Text of the warning, which says what to do.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "stage `{}`: {}", self.stage, self.message)
    }
}

impl Study {
    /// Returns the warnings about a study that are shown before it runs. Each warning states one of
    /// these problems:
    ///
    /// - A mesh overestimates the contact area, or is too coarse for multilevel means.
    /// - Lists of `nodes` and `side` are ambiguous.
    /// - Loads have no unit, although other pressures have one.
    /// - Loads were probably meant in another unit, or all of them close the gap.
    /// - Loads are out of order or repeated.
    /// - E* exceeds that of all materials.
    /// - A mesh resolves the adhesion poorly.
    /// - Two rough bodies are not pressed against each other, or both are the same surface.
    /// - The file of a measured surface has several channels or missing points, or its slope comes
    ///   mainly from waves that the instrument did not resolve.
    /// - Opposite edges of a map that is said to be periodic do not match.
    /// - Heights or sides of a surface were probably read in another unit.
    /// - Partial slip is computed for bodies that are not elastically similar.
    pub fn warnings(&self) -> Vec<Warning> {
        let stages = self.stages.iter().enumerate();
        let warnings = stages.flat_map(|(index, stage)| {
            let own = [
                ambiguous_pairs(stage),
                self.coarse_mesh(index, stage),
                self.coarse_levels(index, stage),
                self.plain_loads(stage),
                self.improbable_loads(stage),
                rearranged_loads(stage),
                improbable_modulus(stage),
                self.pressed_alone(stage),
                self.coarse_for_adhesion(stage),
                self.dissimilar_bodies(stage),
                pairs::of_equal_bodies(&stage.work),
            ];
            let messages = own.into_iter().flatten().chain(self.steep_surfaces(stage));
            let all = messages.chain(file_warnings(stage, &self.sources));
            all.map(|message| Warning { stage: stage.name.clone(), message })
        });
        warnings.collect()
    }

    /// Warns that a `solve` stage with two bodies and two stages of surfaces does not press these
    /// surfaces against each other.
    fn pressed_alone(&self, stage: &Stage) -> Option<String> {
        let mut contacts = stage.work.recipes().iter().filter_map(solved);
        let is_meant = stage.inputs.len() == 2 && contacts.any(|params| params.bodies.count == 2);
        is_meant.then(|| {
            let names = stage.inputs.iter().map(|&input| &*self.stages[input].name);
            format!(
                "each surface of {} is pressed alone against a smooth body, with the E* of both \
                 `bodies`; to press the surfaces of one stage against those of another, name one of \
                 them in `against` instead of `from`",
                listed(names, "and")
            )
        })
    }

    /// Warns that a stage computes partial slip of bodies that are not elastically similar.
    pub(crate) fn dissimilar_bodies(&self, stage: &Stage) -> Option<String> {
        let slips =
            |recipe: &Recipe| matches!(recipe, Recipe::Measure(measure::Params::Friction(_)));
        if !stage.work.recipes().iter().any(slips) {
            return None;
        }
        let read = stage.inputs.iter().map(|&input| &self.stages[input]);
        let contacts = read.flat_map(|stage| {
            stage
                .work
                .recipes()
                .iter()
                .filter_map(solved)
                .map(|params| (&stage.name, &params.bodies))
        });
        contacts.into_iter().find_map(|(stage, bodies)| {
            let beta = bodies.dundurs.filter(|beta| beta.abs() > SIMILAR)?;
            let bodies = match bodies.count {
                1 => "elastic body and its rigid counterpart",
                _ => "two `bodies`",
            };
            Some(format!(
                "the {bodies} of stage `{stage}` are not elastically similar: Dundurs' constant β, \
                 the normalised difference of (1 − 2ν)/G, is {beta:.2}. The normal pressure then \
                 causes tangential tractions, which partial slip neglects, so that all its results \
                 are approximate"
            ))
        })
    }
}

/// Warns that the lists `nodes` and `side` are read as one rectangle, not as sweeps.
fn ambiguous_pairs(stage: &Stage) -> Option<String> {
    let surfaces = stage.work.surfaces().iter().find(|ensemble| ensemble.may_be_swept)?;
    let ([nodes_x, nodes_y], [side_x, side_y]) = (surfaces.params.nodes(), surfaces.params.size());
    Some(format!(
        "`nodes = [{nodes_x}, {nodes_y}]` with `side = [{side_x}, {side_y}]` is read as one \
         rectangle, not as a sweep of four squares; write `nodes = [[{nodes_x}, {nodes_y}]]` and \
         `side = [[{side_x}, {side_y}]]` to make this explicit, or list squares as \
         `cases = [{{ nodes = {nodes_x}, side = {side_x} }}, …]`"
    ))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const PRESSED: &str = r#"
    [study]
    name = "coarse"

    [stage.rough]
    kind = "generate"
    nodes = 64
    hurst = 0.8
    k_lower = 2
    k_upper = [8, 16, 32]

    [stage.loads]
    kind = "solve"
    from = "rough"
    loads = [0.06]

    [stage.area]
    kind = "measure"
    from = "loads"
    "#;

    const CORRECTED: &str = r#"
    [stage.corrected]
    kind = "correct"
    from = "area"
    correction = ["none", "2017"]
    "#;

    fn warnings(manifest: &str) -> Vec<String> {
        let study = Study::parse(manifest, "coarse.toml", Path::new("")).unwrap();
        study.warnings().iter().map(ToString::to_string).collect()
    }

    #[test]
    fn the_coarsest_mesh_of_a_stage_is_named_with_what_it_adds_and_what_would_do() {
        let warnings = warnings(PRESSED);
        let [warning] = warnings.as_slice() else { panic!("{warnings:?}") };
        for part in [
            "stage `rough`",
            "`nodes = 64` with `k_upper = 32` resolves the shortest wavelength with only 2 nodes",
            "(1 other parameter point also has fewer than 8)",
            "about 25 to 40 %",
            "`nodes = 256`",
            "a `correct` stage",
        ] {
            assert!(warning.contains(part), "{part} in {warning}");
        }
    }

    #[test]
    fn where_cells_are_no_squares_only_a_finer_mesh_is_advised() {
        let warnings =
            warnings(&PRESSED.replace("nodes = 64", "nodes = [[64, 64]]\nside = [[1.0, 0.8]]"));
        let [warning] = warnings.as_slice() else { panic!("{warnings:?}") };
        assert!(warning.contains("lighter loads; set `nodes = 256`"), "{warning}");
    }

    #[test]
    fn a_fine_mesh_and_surfaces_that_nothing_presses_need_no_warning() {
        assert!(warnings(&PRESSED.replace("[8, 16, 32]", "8")).is_empty());
        let unpressed = PRESSED.split("[stage.loads]").next().unwrap();
        assert!(warnings(unpressed).is_empty());
    }

    #[test]
    fn corrections_make_up_for_three_nodes_and_more() {
        let corrected = format!("{PRESSED}{CORRECTED}");
        let warnings_at = |k_upper| warnings(&corrected.replace("[8, 16, 32]", k_upper));
        assert!(warnings_at("[8, 16, 21]").is_empty());
        let [warning] = &warnings_at("32")[..] else {
            panic!("two nodes are too few for corrections")
        };
        assert!(warning.contains("up to 12 %"), "{warning}");
        // The correction "none" and corrections of other contacts do not count.
        let none = corrected.replace("[\"none\", \"2017\"]", "\"none\"");
        assert_eq!(warnings(&none).len(), 1);
        let another = "[stage.more]\nkind = \"solve\"\nfrom = \"rough\"\nloads = [0.1]\n";
        assert_eq!(warnings(&format!("{corrected}{another}")).len(), 1);
    }

    #[test]
    fn of_multilevel_means_the_finest_mesh_counts_and_the_coarsest_needs_three_nodes() {
        let levels = |nodes: &str| {
            let manifest = PRESSED.replace("nodes = 64", &format!("nodes = {nodes}"));
            let means = "[stage.means]\nkind = \"aggregate\"\nfrom = \"area\"\n\
                         estimator = \"multilevel\"\nover = [\"area_fraction\"]\n";
            let manifest = manifest.replace("[8, 16, 32]", "16\nrealizations = 4");
            warnings(&format!("{manifest}{means}"))
        };
        assert_eq!(levels("[64, 128]"), [""; 0]);
        assert!(levels("[32, 128]")[0].contains("begin with `nodes = 48`"));
        assert!(levels("[48, 64]")[0].contains("`nodes = 64` with `k_upper = 16` resolves"));
    }

    #[test]
    fn waves_have_a_shortest_wavelength_and_punches_none() {
        let shape = |lines: &str| {
            let start = PRESSED.find("hurst").unwrap();
            let end = PRESSED.find("[stage.loads]").unwrap();
            warnings(&format!("{}{lines}\n{}", &PRESSED[..start], &PRESSED[end..]))
        };
        let wave = shape("method = \"wave-sum\"\namplitude = 0.1\nwaves = 24");
        let resolution = "`waves = 24` resolves the shortest wavelength with only 2.7 nodes";
        assert!(wave[0].contains(resolution), "{wave:?}");
        let punch = shape("method = \"flat-punch\"\nradius = 0.1\ndepth = 0.1");
        assert!(punch.is_empty(), "{punch:?}");
    }

    #[test]
    fn two_bodies_beside_two_surfaces_are_told_that_each_is_pressed_alone() {
        let steel = "{ youngs_modulus = 2e11, poisson_ratio = 0.3 }";
        let upper = PRESSED.split("[stage.loads]").next().unwrap();
        let lower = "[stage.lower]\nkind = \"generate\"\nmethod = \"wave\"\nnodes = 64\n\
                     amplitude = 0.1\n[stage.pressed]\nkind = \"solve\"\nloads = [0.01]\n";
        let warned = |from: &str, bodies: &str| {
            let warnings = warnings(&format!("{upper}{lower}from = {from}\nbodies = [{bodies}]\n"));
            let mut warnings = warnings.into_iter();
            warnings.find(|warning| warning.contains("pressed alone"))
        };
        let two = format!("{steel}, {steel}");
        let warning = warned("[\"rough\", \"lower\"]", &two).unwrap();
        assert!(warning.starts_with("stage `pressed`: each surface of `rough` and `lower`"));
        assert!(warning.contains("name one of them in `against`"), "{warning}");
        assert_eq!(warned("[\"rough\", \"lower\"]", steel), None);
        assert_eq!(warned("\"rough\"", &two), None);
    }

    #[test]
    fn partial_slip_of_steel_on_glass_is_approximate() {
        let slip = |bodies: &str| {
            let friction = "[stage.slip]\nkind = \"measure\"\nfrom = \"loads\"\n\
                            friction = { coefficient = 0.3, loads = [0.5] }\n";
            let loads = format!("loads = [0.03, 0.06]\nbodies = [{bodies}]");
            let manifest = PRESSED.replace("loads = [0.06]", &loads);
            let warnings = warnings(&format!("{manifest}{friction}"));
            warnings.into_iter().filter(|warning| warning.contains("elastically similar"))
        };
        let steel = "{ youngs_modulus = 210, poisson_ratio = 0.3 }";
        let glass = "{ youngs_modulus = 72, poisson_ratio = 0.17 }";
        let rubber = "{ youngs_modulus = 0.003, poisson_ratio = 0.5 }";
        let warned: Vec<String> = slip(&format!("{steel}, {glass}")).collect();
        let [warning] = warned.as_slice() else { panic!("{warned:?}") };
        assert!(warning.starts_with("stage `slip`: the two `bodies` of stage `loads`"));
        assert!(warning.contains("is -0.23"), "{warning}");
        assert_eq!(slip(steel).count(), 1, "on a rigid body");
        for similar in [format!("{steel}, {steel}"), format!("{steel}, {rubber}"), rubber.into()] {
            assert_eq!(slip(&similar).count(), 0, "{similar}");
        }
    }

    /// Returns the warnings about a `solve` stage with these keys.
    fn warned(keys: &str) -> Vec<String> {
        let text = format!(
            "[study]\nname = \"units\"\n[stage.rough]\nkind = \"generate\"\nnodes = 64\nhurst = 0.8\n\
             k_lower = 2\nk_upper = 8\n[stage.pressed]\nkind = \"solve\"\nfrom = \"rough\"\n{keys}"
        );
        let study = Study::parse(&text, "units.toml", Path::new("")).unwrap();
        let warnings = study.warnings().into_iter();
        let pressed = warnings.filter(|warning| warning.stage == "pressed");
        pressed.map(|warning| warning.message).collect()
    }

    #[test]
    fn pascals_taken_for_loads_are_told_and_so_are_loads_taken_for_pascals() {
        let pascals = warned("loads = { to = 5e7, steps = 4 }");
        assert!(pascals[0].contains("every node touches"), "{pascals:?}");
        let megapascals =
            "loads = [20e6, 40e6]\nload_unit = \"absolute\"\neffective_modulus = 57.0";
        assert!(warned(megapascals)[0].contains("E* is 57"));
        let reduced = "loads = [0.01, 0.1]\nload_unit = \"absolute\"\neffective_modulus = 1e11";
        assert!(warned(reduced)[0].contains("a node or two"));
        assert!(warned("loads = [1e-9, 1e-8]")[0].contains("a node or two"));
    }

    #[test]
    fn loads_out_of_order_and_repeated_are_told() {
        let told = |list: &str| warned(&format!("loads = [{list}]"));
        assert_eq!(told("0.01, 0.02"), [""; 0]);
        assert!(told("0.02, 0.01")[0].contains("`loads` is out of order; loads are solved"));
        assert!(told("0.01, 0.01, 0.02")[0].contains("`loads` repeats the load 0.01;"));
        let megapascals = "loads = [\"2 MPa\", \"1 MPa\", \"2000 kPa\"]\n\
                           effective_modulus = \"100 MPa\"";
        let expected = "`loads` is out of order; loads are solved in ascending order. `loads` \
                        repeats the load 2 MPa; each load is solved once";
        assert_eq!(warned(megapascals), [expected]);
    }

    #[test]
    fn a_modulus_above_that_of_diamond_lacks_a_unit() {
        let pressed = |modulus: &str| {
            let bodies = format!("[{{ youngs_modulus = {modulus}, poisson_ratio = 0.3 }}]");
            warned(&format!("loads = [100]\nload_unit = \"MPa\"\nbodies = {bodies}"))
        };
        let pascals = pressed("210e9");
        let warning = pascals.iter().find(|warning| warning.contains("diamond")).unwrap();
        assert!(warning.starts_with("E* is 2.31e11 MPa, which exceeds"), "{warning}");
        assert!(warning.ends_with("plain numbers are in MPa"), "{warning}");
        assert_eq!(pressed("210e3"), [""; 0]);
        let without_unit = "loads = [1e11]\nload_unit = \"absolute\"\neffective_modulus = 2e13";
        assert_eq!(warned(without_unit), [""; 0]);
    }

    #[test]
    fn plain_loads_beside_moduli_with_units_are_told_with_both_readings() {
        let steel = "bodies = [{ youngs_modulus = \"210 GPa\", poisson_ratio = 0.3 }]";
        let told = warned(&format!("{steel}\nloads = [0.02, 0.01]"));
        assert_eq!(
            told[0],
            "`loads` have no unit, but other pressures have one; 0.02 is read as 0.02 × E* × rms \
             slope, here 4.62 GPa, and not as 0.02 GPa; write \"0.02 GPa\" if it is a pressure, or \
             `load_unit = \"relative\"` if not"
        );
        let heavy = warned(&format!("{steel}\nloads = [10, 20]"));
        let [unit, closed] = heavy.as_slice() else { panic!("{heavy:?}") };
        assert!(unit.contains("20 is read as 20 × E* × rms slope, here 4620 GPa"), "{unit}");
        assert!(closed.contains("so that every node touches; write them with"));
        let path = format!(
            "{steel}\nadhesion = {{ work = 0.0, range = 0.1 }}\nloads = [0.0, -0.02, 0.01]"
        );
        assert!(warned(&path)[0].contains("-0.02 is read as -0.02 × E*"), "{:?}", warned(&path));
        for plain in [
            format!("{steel}\nloads = [0.02]\nload_unit = \"relative\""),
            format!("{steel}\nloads = [\"20 MPa\"]"),
            format!("{steel}\nloads = {{ from = 0, to = \"20 MPa\", steps = 2 }}"),
            "loads = [0.02]\neffective_modulus = 2e11".to_owned(),
        ] {
            assert_eq!(warned(&plain), [""; 0], "{plain}");
        }
    }

    #[test]
    fn loads_that_close_the_gap_of_a_gaussian_surface_are_told() {
        // The surface has an rms slope of 1 and 64 × 64 nodes.
        assert!(warned("loads = [2.6, 3]")[0].contains("so that every node touches"));
        assert_eq!(warned("loads = [2.4, 3]"), [""; 0]);
        let pressures = |lightest: f64| {
            warned(&format!(
                "loads = [{lightest}, 900]\nload_unit = \"absolute\"\neffective_modulus = 100"
            ))
        };
        assert!(
            pressures(260.0)[0].contains("the rms slope at most 1, so that every node touches")
        );
        assert_eq!(pressures(240.0), [""; 0]);
        assert_eq!(warned("loads = [2.6]\nhardness = 5\nhardness_unit = \"relative\""), [""; 0]);
    }

    #[test]
    fn heights_in_a_wrong_unit_are_told_by_the_slope_that_they_mean() {
        let rough = |keys: &str| {
            let start = PRESSED.find("[stage.loads]").unwrap();
            warnings(&format!("{}{keys}\n", PRESSED[..start].replace("[8, 16, 32]", "8")))
        };
        let [warning] = &rough("side = \"100 um\"\nrms_height = \"200 um\"")[..] else {
            panic!("one warning")
        };
        assert!(warning.contains("`rms_height` is 200 µm on a side of 100 µm"), "{warning}");
        assert!(warning.contains("nm in place of µm would give an rms slope of 0.0"), "{warning}");
        for plausible in [
            "side = \"100 um\"\nrms_height = \"200 nm\"",
            "side = \"100 um\"\nrms_slope = 2",
            "side = 100\nrms_height = 200",
        ] {
            assert_eq!(rough(plausible), [""; 0], "{plausible}");
        }
    }

    #[test]
    fn loads_from_first_touch_to_full_contact_are_no_mistake() {
        for keys in [
            "loads = [1e-9, 0.01]",
            "loads = [1.0, 30.0]",
            "loads = [1e5, 1e7]\nload_unit = \"absolute\"\neffective_modulus = 1e11",
        ] {
            assert_eq!(warned(keys), Vec::<String>::new(), "{keys}");
        }
    }
}
