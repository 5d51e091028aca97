//! Words that people use for keys which have other names, or for physics that is not modelled.

use crate::diagnostics::{Problem, Span};

/// Words for one key, or for one subject that the program does not model.
struct Synonyms {
    /// Words in lower case, separated by spaces, with `_` in place of `-`.
    words: &'static str,
    /// Keys that do what is wanted; the first one that the table has is suggested.
    keys: &'static [&'static str],
    help: &'static str,
}

const SYNONYMS: [Synonyms; 19] = [
    Synonyms {
        words: "adhesive adhesion_energy interaction_range interfacial_energy surface_energy tabor \
                work_of_adhesion",
        keys: &["adhesion"],
        help: "`adhesion = { work = …, range = … }` of a `solve` stage",
    },
    Synonyms {
        words: "coefficient_of_friction friction_coefficient partial_slip shear shear_stress sliding \
                slip tangential_force tangential_load tangential_loads",
        keys: &["friction"],
        help: "`friction = { coefficient = …, loads = […] }` of a `measure` stage computes the partial \
               slip of solved contacts",
    },
    Synonyms {
        words: "elastoplastic flow_pressure flow_stress plastic plasticity saturation_pressure yield \
                yield_pressure yield_strength yield_stress",
        keys: &["hardness"],
        help: "`hardness` of a `solve` stage is the largest pressure that the material bears, in \
               metals about three times the yield stress",
    },
    Synonyms {
        words: "hardening hardening_modulus strain_hardening tangent_modulus",
        keys: &[],
        help: "the `hardness` of a `solve` stage is constant; Tamaas models hardening",
    },
    Synonyms {
        words: "coating coating_thickness film_thickness layer_thickness layers thickness",
        keys: &["layer"],
        help: "`layer = { thickness = …, poisson_ratio = … }` of a `solve` stage is a layer on a rigid \
               base, or with `modulus_ratio` a coating",
    },
    Synonyms {
        words: "creep duration dwell_time loss_modulus relaxation_time relaxation_times \
                sliding_velocity speed storage_modulus strain_rate time time_step velocity \
                viscoelastic viscoelasticity",
        keys: &[],
        help: "deformation does not depend on time; Tamaas models viscoelastic contacts",
    },
    Synonyms {
        words: "conductance conductivity contact_conductance contact_resistance \
                electrical_conductivity electrical_resistance electrical_resistivity resistance \
                resistivity thermal_conductance thermal_conductivity thermal_resistance",
        keys: &["stiffness", "bodies"],
        help: "`stiffness = true` of a `solve` stage computes the conductance, and `conductivity` or \
               `resistivity` of its `bodies` gives it a unit",
    },
    Synonyms {
        words: "heat_flux temperature thermal_expansion",
        keys: &[],
        help: "`stiffness = true` of a `solve` stage computes the conductance of the contact",
    },
    Synonyms {
        words: "wear wear_coefficient wear_rate",
        keys: &[],
        help: "all loads press the same undeformed heights",
    },
    Synonyms {
        words: "cycles cyclic reload reloading unload unloading",
        keys: &["path"],
        help: "`path = \"as-given\"` of a `solve` stage follows loads up and down, with a `hardness` or \
               with `adhesion`; other contacts unload along the curve of loading",
    },
    Synonyms {
        words: "approach displacement gap indentation indentation_depth mean_gap separation",
        keys: &["gaps"],
        help: "a `solve` stage prescribes `loads`, or with `adhesion` and `control = \"gap\"` the mean \
               `gaps`; the column `mean_gap` is a result",
    },
    Synonyms {
        words: "applied_pressure force forces mean_pressure nominal_pressure normal_force normal_load \
                p0 pressure",
        keys: &["loads"],
        help: "`loads` of a `solve` stage are mean pressures: multiples of E* × rms slope, or with a \
               unit, as in `loads = [\"10 MPa\"]`",
    },
    Synonyms {
        words: "nu poisson poisson_number poisson_ratio poissons_ratio",
        keys: &["poisson_ratio", "bodies"],
        help: "`bodies = [{ youngs_modulus, poisson_ratio }]` of a `solve` stage",
    },
    Synonyms {
        words: "contact_modulus e e_star elastic_modulus modulus reduced_modulus young young_modulus \
                youngs_modulus",
        keys: &["youngs_modulus", "effective_modulus"],
        help: "a `solve` stage has either `effective_modulus`, which is E*, or \
               `bodies = [{ youngs_modulus, poisson_ratio }]`",
    },
    Synonyms {
        words: "fluid fluid_pressure leak_rate leakage lubricant viscosity",
        keys: &["flow"],
        help: "`flow = true` of a `solve` stage computes conductivities of the gap for a thin film, \
               which do not depend on the viscosity",
    },
    Synonyms {
        words: "rms rms_roughness roughness rq sigma sq standard_deviation",
        keys: &["rms_height"],
        help: "random surfaces of a `generate` stage have `rms_height` (Sq) or `rms_slope` (Sdq)",
    },
    Synonyms {
        words: "asymmetry rsk skew ssk",
        keys: &["skewness"],
        help: "`skewness` and `kurtosis` of a `generate` stage with random surfaces; \
               `method = \"file\"` reads measured ones",
    },
    Synonyms {
        words: "excess_kurtosis flatness rku sku",
        keys: &["kurtosis"],
        help: "`kurtosis` of a `generate` stage with random surfaces, 3 for a Gaussian surface; \
               `method = \"file\"` reads measured ones",
    },
    Synonyms {
        words: "d_f df fractal_dimension",
        keys: &["hurst"],
        help: "the fractal dimension of a self-affine surface is 3 − `hurst`",
    },
];

/// Returns the problem of an unknown key that is a known word, and the key that does what is
/// wanted. `has` says whether the table has a key.
pub fn answer(
    message: &str,
    key: &str,
    span: Span,
    has: impl Fn(&str) -> bool,
) -> Option<(Problem, Option<&'static str>)> {
    let folded = key.to_lowercase().replace('-', "_");
    let is_meant = |one: &&Synonyms| one.words.split(' ').any(|word| word == folded);
    let Synonyms { keys, help, .. } = SYNONYMS.iter().find(is_meant)?;
    let key = keys.iter().copied().find(|key| has(key));
    let (label, help) = match (key, keys) {
        (Some(key), _) => (format!("use `{key}`"), (*help).to_owned()),
        (None, []) => {
            ("not modelled".to_owned(), format!("{help}; see “What it cannot do” in the guide"))
        }
        (None, _) => ("belongs to another table".to_owned(), (*help).to_owned()),
    };
    Some((Problem::new(message, span, label).help(help), key))
}

/// Returns all words.
pub fn words() -> impl Iterator<Item = &'static str> {
    SYNONYMS.iter().flat_map(|one| one.words.split(' '))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_word_has_one_answer() {
        let distinct: BTreeSet<_> = words().collect();
        assert_eq!(distinct.len(), words().count());
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
