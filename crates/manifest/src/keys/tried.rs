//! Answers to keys that people try and that no table has: physics that the program does not model,
//! and other words for keys that it has.

use crate::diagnostics::{Problem, Span};

/// Answer to some unknown keys.
struct Answer {
    /// Keys in lower case, with `_` between words.
    keys: &'static [&'static str],
    /// Keys that do what is wanted; the first one that the table has is suggested.
    instead: &'static [&'static str],
    /// Label of the key if the table has none of the keys in `instead`.
    label: &'static str,
    help: &'static str,
}

const ANSWERS: [Answer; 17] = [
    Answer {
        keys: &[
            "adhesive",
            "adhesion_energy",
            "interaction_range",
            "interfacial_energy",
            "surface_energy",
            "tabor",
            "work_of_adhesion",
        ],
        instead: &["adhesion"],
        label: "belongs to a `solve` stage, as `adhesion`",
        help: "`adhesion = { work = …, range = … }` of a `solve` stage holds the work of adhesion and \
               the range of the attraction",
    },
    Answer {
        keys: &[
            "coefficient_of_friction",
            "friction_coefficient",
            "partial_slip",
            "shear",
            "shear_stress",
            "sliding",
            "slip",
            "tangential_force",
            "tangential_load",
            "tangential_loads",
        ],
        instead: &["friction"],
        label: "belongs to a `measure` stage, as `friction`",
        help: "`friction = { coefficient = …, loads = […] }` of a `measure` stage computes the partial \
               slip of solved contacts under tangential loads",
    },
    Answer {
        keys: &[
            "elastoplastic",
            "flow_pressure",
            "flow_stress",
            "plastic",
            "plasticity",
            "saturation_pressure",
            "yield",
            "yield_pressure",
            "yield_strength",
            "yield_stress",
        ],
        instead: &["hardness"],
        label: "belongs to a `solve` stage, as `hardness`",
        help: "`hardness` of a `solve` stage is the largest pressure that the material bears. \
               Indentation of metals gives about three times the yield stress",
    },
    Answer {
        keys: &["hardening", "hardening_modulus", "strain_hardening", "tangent_modulus"],
        instead: &[],
        label: "hardening is not modelled",
        help: "the `hardness` of a `solve` stage is constant. Tamaas solves elastic-plastic \
               volumes with hardening",
    },
    Answer {
        keys: &[
            "coating",
            "coating_thickness",
            "film_thickness",
            "layer_thickness",
            "layers",
            "thickness",
        ],
        instead: &["layer"],
        label: "belongs to a `solve` stage, as `layer`",
        help: "`layer = { thickness = …, poisson_ratio = … }` of a `solve` stage is a layer on a rigid \
               base, or with `modulus_ratio` a coating of the half-space `substrate`",
    },
    Answer {
        keys: &[
            "creep",
            "duration",
            "dwell_time",
            "loss_modulus",
            "relaxation_time",
            "relaxation_times",
            "sliding_velocity",
            "speed",
            "storage_modulus",
            "strain_rate",
            "time",
            "time_step",
            "velocity",
            "viscoelastic",
            "viscoelasticity",
        ],
        instead: &[],
        label: "time is not modelled",
        help: "the deformation of a body does not depend on time. Tamaas solves viscoelastic contacts \
               (generalised Maxwell model)",
    },
    Answer {
        keys: &[
            "conductance",
            "conductivity",
            "contact_conductance",
            "contact_resistance",
            "electrical_conductivity",
            "electrical_resistance",
            "electrical_resistivity",
            "resistance",
            "resistivity",
            "thermal_conductance",
            "thermal_conductivity",
            "thermal_resistance",
        ],
        instead: &["stiffness", "bodies"],
        label: "belongs to a `solve` stage, as `stiffness` and in `bodies`",
        help: "the conductance of a contact is proportional to its stiffness (Barber 2003): \
               `stiffness = true` of a `solve` stage computes it, and `conductivity` or \
               `resistivity` of the `bodies` adds columns in W/(m² K) or ohms",
    },
    Answer {
        keys: &["heat_flux", "temperature", "thermal_expansion"],
        instead: &[],
        label: "temperatures and heat flows are not modelled",
        help: "`stiffness = true` of a `solve` stage computes the conductance of the contact",
    },
    Answer {
        keys: &["wear", "wear_coefficient", "wear_rate"],
        instead: &[],
        label: "wear is not modelled",
        help: "no material is removed: all loads press the same undeformed heights",
    },
    Answer {
        keys: &["cycles", "cyclic", "reload", "reloading", "unload", "unloading"],
        instead: &["path"],
        label: "belongs to a `solve` stage, as `path`",
        help: "`path = \"as-given\"` of a `solve` stage follows loads up and down, with a `hardness` or \
               with `adhesion`. Other contacts unload along the curve of loading",
    },
    Answer {
        keys: &[
            "approach",
            "displacement",
            "gap",
            "indentation",
            "indentation_depth",
            "mean_gap",
            "separation",
        ],
        instead: &[],
        label: "only a `solve` stage with `adhesion` prescribes distances, as `gaps`",
        help: "with `adhesion`, `control = \"gap\"` prescribes the mean gaps in `gaps`. Otherwise a \
               `solve` stage prescribes `loads`, and distances are results: the column `mean_gap` \
               has the distance of the mean planes under each load",
    },
    Answer {
        keys: &[
            "applied_pressure",
            "force",
            "forces",
            "mean_pressure",
            "nominal_pressure",
            "normal_force",
            "normal_load",
            "p0",
            "pressure",
        ],
        instead: &["loads"],
        label: "belongs to a `solve` stage, as `loads`",
        help: "`loads` of a `solve` stage are mean pressures: multiples of E* × rms slope, or \
               with a unit, as in `loads = [\"10 MPa\"]`",
    },
    Answer {
        keys: &["nu", "poisson", "poisson_number", "poisson_ratio", "poissons_ratio"],
        instead: &["poisson_ratio", "bodies"],
        label: "belongs to a `solve` stage, in `bodies`",
        help: "elastic constants are in `bodies = [{ youngs_modulus, poisson_ratio }]` \
               of a `solve` stage",
    },
    Answer {
        keys: &[
            "contact_modulus",
            "e",
            "e_star",
            "elastic_modulus",
            "modulus",
            "reduced_modulus",
            "young",
            "young_modulus",
            "youngs_modulus",
        ],
        instead: &["youngs_modulus", "effective_modulus"],
        label: "belongs to a `solve` stage, as `effective_modulus` or in `bodies`",
        help: "a `solve` stage has either `effective_modulus`, which is E*, or \
               `bodies = [{ youngs_modulus, poisson_ratio }]`",
    },
    Answer {
        keys: &["fluid", "fluid_pressure", "leak_rate", "leakage", "lubricant", "viscosity"],
        instead: &["flow"],
        label: "belongs to a `solve` stage, as `flow`",
        help: "`flow = true` of a `solve` stage computes the flow of a thin film through the gap. \
               The film does not deform the bodies, and the table has conductivities, \
               which do not depend on the viscosity",
    },
    Answer {
        keys: &["rms", "rms_roughness", "roughness", "rq", "sigma", "sq", "standard_deviation"],
        instead: &["rms_height"],
        label: "belongs to a `generate` stage, as `rms_height`",
        help: "random surfaces of a `generate` stage have either `rms_height` (Sq) or `rms_slope` \
               (Sdq)",
    },
    Answer {
        keys: &["d_f", "df", "fractal_dimension"],
        instead: &["hurst"],
        label: "belongs to a `generate` stage, as `hurst`",
        help: "the fractal dimension of a self-affine surface is 3 − `hurst`",
    },
];

/// Returns the problem of an unknown key that has an answer, and the key that does what is wanted.
/// `has` says whether the table has a key.
pub fn answer(
    message: &str,
    key: &str,
    span: Span,
    has: impl Fn(&str) -> bool,
) -> Option<(Problem, Option<&'static str>)> {
    let folded = key.to_lowercase().replace('-', "_");
    let answer = ANSWERS.iter().find(|answer| answer.keys.contains(&folded.as_str()))?;
    let instead = answer.instead.iter().copied().find(|key| has(key));
    let label = match instead {
        Some(instead) => format!("use `{instead}`"),
        None => answer.label.to_owned(),
    };
    let help = match answer.instead {
        [] => format!("{}; see “What it cannot do” in the guide", answer.help),
        _ => answer.help.to_owned(),
    };
    Some((Problem::new(message, span, label).help(help), instead))
}

/// Returns all keys that have an answer.
pub fn keys() -> impl Iterator<Item = &'static str> {
    ANSWERS.iter().flat_map(|answer| answer.keys).copied()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_key_has_one_answer() {
        let distinct: BTreeSet<_> = keys().collect();
        assert_eq!(distinct.len(), keys().count());
    }

    #[test]
    fn the_first_key_that_the_table_has_is_suggested() {
        for (has, expected) in [
            (&["bodies"][..], Some("bodies")),
            (&["poisson_ratio", "bodies"], Some("poisson_ratio")),
            (&["loads"], None),
        ] {
            let found = answer("", "Nu", Span::default(), |key| has.contains(&key));
            assert_eq!(found.unwrap().1, expected);
        }
    }
}
