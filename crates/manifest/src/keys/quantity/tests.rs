//! Tests of quantities: how they are recognised, converted and written.

use schemars::JsonSchema;
use serde::Deserialize;

use super::*;
use crate::keys::declare::{
    conductivity, length, load, pair, pressure, pressure_or_ratio, resistivity, swept,
    unit_of_lengths, unit_of_pressures, work,
};
use crate::keys::expected_keys::ExpectedKeys;
use crate::keys::{Key, OnAxes, Section, Spanned, reader, table};

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Example {
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0))]
    #[schemars(transform = pair, transform = swept, transform = length)]
    side: Key<OnAxes<f64>>,
    #[schemars(transform = swept, transform = length)]
    wavelength: Key<f64>,
    #[schemars(transform = unit_of_lengths)]
    unit: Key<String>,
    #[schemars(transform = pressure_or_ratio)]
    loads: Key<Vec<Spanned<f64>>>,
    #[schemars(transform = load)]
    pressed_by: Key<Vec<Spanned<f64>>>,
    #[schemars(transform = pressure, transform = swept)]
    modulus: Key<f64>,
    #[schemars(transform = unit_of_pressures)]
    load_unit: Key<Word>,
    bodies: Key<Vec<Body>>,
    #[schemars(transform = work, transform = swept)]
    energy: Key<f64>,
    hurst: Key<f64>,
    #[schemars(transform = conductivity, transform = swept)]
    heat: Key<f64>,
    #[schemars(transform = resistivity, transform = swept)]
    current: Key<f64>,
}

table!(Example);

#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
enum Word {
    MPa,
    Relative,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Body {
    #[schemars(transform = pressure)]
    youngs_modulus: f64,
}

fn read(text: &str) -> (Section<Example>, Vec<String>) {
    let table = DeTable::parse(text).unwrap().into_inner();
    let mut problems = Problems::default();
    let expected = ExpectedKeys::of_table("the example");
    let section = reader::read(table, 0..0, &expected, &mut problems);
    let errors = problems.into_errors("example.toml", text);
    (section, errors.problems().iter().map(ToString::to_string).collect())
}

fn valid(text: &str) -> Section<Example> {
    let (section, problems) = read(text);
    assert_eq!(problems, [""; 0], "{text}");
    section
}

#[test]
fn texts_of_a_number_and_a_unit_are_quantities_and_others_are_not() {
    for (text, parts) in [
        ("100 um", ("100", "um")),
        ("5.5e-3GPa", ("5.5e-3", "GPa")),
        (" -1 N/mm^2 ", ("-1", "N/mm^2")),
        ("2 Mpa", ("2", "Mpa")),
        ("400 W/(m K)", ("400", "W/(m K)")),
        ("1.7 uohm cm", ("1.7", "uohm cm")),
    ] {
        assert_eq!(split(text), Some(parts), "{text}");
    }
    for text in ["8 * k_upper", "all", "1e3", "", "k / 2", "1.2.3 m", "2 mm + 1 m", "um"] {
        assert_eq!(split(text), None, "{text}");
    }
}

#[test]
fn loads_are_pressures_or_forces_in_newtons_or_pure_numbers() {
    let loads = |text: &str| {
        let section = valid(text);
        let point = &section.points[0].table;
        let loads = point.pressed_by.written().unwrap().value.clone();
        let units = &section.units;
        loads
            .into_iter()
            .map(|load| (load.value, units.dimension_of(&load.span)))
            .collect::<Vec<_>>()
    };
    let force = Some(Dimension::Force);
    assert_eq!(loads("pressed_by = [\"10 N\", \"2 kN\"]"), [(10.0, force), (2000.0, force)]);
    assert_eq!(loads("pressed_by = [\"5e-3 uN\", 2]"), [(5e-9, force), (2.0, None)]);
    let pressure = Some(Dimension::Pressure);
    assert_eq!(loads("pressed_by = [\"1 GPa\", \"10 MPa\"]"), [(1.0, pressure), (0.01, pressure)]);
    let (_, problems) = read("pressed_by = [\"1 um\"]");
    assert!(
        problems[0].contains("is a pressure or a force, but `um` is a unit of length"),
        "{problems:?}"
    );
    let (_, problems) = read("loads = [\"1 N\"]");
    assert!(problems[0].contains("`N` is a unit of force"), "{problems:?}");
}

#[test]
fn quantities_keep_their_unit_and_metres_and_pascals_get_a_prefix() {
    for (value, unit, text) in [
        (10.0, "MPa", "10 MPa"),
        (5500.0, "MPa", "5500 MPa"),
        (210_000.0, "MPa", "210000 MPa"),
        (0.000_2, "µm", "0.0002 µm"),
        (5.5e9, "Pa", "5.5 GPa"),
        (1e-6, "m", "1 µm"),
        (2e-4, "px", "0.0002 px"),
        (0.0, "µm", "0 µm"),
        (3.0, "", "3"),
    ] {
        assert_eq!(written(value, Some(unit)), text);
    }
    assert_eq!(written(2e9, None), "2e9");
}

#[test]
fn a_product_of_units_may_be_written_like_in_the_si_brochure_and_in_programs() {
    for (text, symbol) in [
        ("W m^-1 K^-1", "W/(m K)"),
        ("W m⁻¹ K⁻¹", "W/(m K)"),
        ("W/(m*K)", "W/(m K)"),
        ("W/m/K", "W/(m K)"),
        ("W/mK", "W/(m K)"),
        ("W/(cm·K)", "W/(cm K)"),
        ("J m⁻²", "J/m²"),
        ("J m-2", "J/m²"),
        ("mJ/m2", "mJ/m²"),
        ("Pa·m", "J/m²"),
        ("N/m^2", "Pa"),
        ("N/mm^2", "N/mm²"),
        ("N*mm^-2", "MPa"),
        ("Ω*m", "Ω m"),
    ] {
        assert_eq!(Unit::find(text).map(|unit| unit.symbol), Some(symbol), "{text}");
        assert_eq!(split(&format!("3.5 {text}")), Some(("3.5", text)));
    }
    for text in ["W/m K", "W m^ K", "W/", "W//m", "m/m", "(m", "Nm2", "m^999", "", "mPa", "mm mm"] {
        assert_eq!(Unit::find(text), None, "{text}");
    }
}

#[test]
fn a_unit_has_several_spellings() {
    for text in ["um", "µm", "μm"] {
        assert_eq!(Unit::find(text).unwrap().symbol, "µm");
    }
    assert_eq!(Unit::find("N/mm2").unwrap().power, Unit::find("MPa").unwrap().power);
    assert_eq!(Unit::find("mpa"), None);
    let names: Vec<&str> = Dimension::Length.names().collect();
    assert_eq!(names, ["m", "cm", "mm", "µm", "um", "nm", "Å", "angstrom", "pm"]);
    let [nm, m] = ["nm", "m"].map(|unit| Unit::find(unit).unwrap());
    assert_eq!((nm.factor_to(m), m.factor_to(nm)), (1e-9, 1e9));
}

#[test]
fn lengths_are_read_in_the_unit_of_the_first_key_and_conversions_are_exact() {
    let section = valid("wavelength = [\"500 nm\", \"0.1 mm\"]\nside = \"100 um\"\n");
    let [one, other] = section.points.as_slice() else { panic!("two points") };
    assert_eq!(one.table.side.value(), Some(OnAxes::Both(100.0)));
    assert_eq!(one.table.wavelength.value(), Some(0.5));
    assert_eq!(other.table.wavelength.value(), Some(100.0));
    let unit = section.units.length.as_ref().unwrap();
    assert_eq!((unit.unit.symbol, unit.by_key), ("µm", false));
    assert!(section.units.is_quantity(&one.table.wavelength.written().unwrap().span));
}

#[test]
fn a_key_can_name_the_unit_and_then_numbers_without_unit_have_it() {
    let section = valid("side = [\"0.1 mm\", 2]\nwavelength = 7\nunit = \"um\"\n");
    assert_eq!(section.points[0].table.side.value(), Some(OnAxes::Both(100.0)));
    assert_eq!(section.points[1].table.side.value(), Some(OnAxes::Both(2.0)));
    assert!(section.units.length.unwrap().by_key);
    let plain = valid("side = 2\nunit = \"px\"\n");
    assert!(plain.units.length.is_none());
}

#[test]
fn pairs_cases_and_inner_tables_may_have_units() {
    let section = valid("cases = [{ side = [\"1 mm\", \"0.5 mm\"] }, { side = \"100 um\" }]");
    assert_eq!(section.points[0].table.side.value(), Some(OnAxes::Each([1.0, 0.5])));
    assert_eq!(section.points[1].table.side.value(), Some(OnAxes::Both(0.1)));
    let text = "bodies = [{ youngs_modulus = \"210 GPa\" }]\nload_unit = \"MPa\"\nloads = [10]";
    let table = &valid(text).points[0].table;
    assert_eq!(table.bodies.written().unwrap().value[0].youngs_modulus, 210_000.0);
    assert_eq!(table.load_unit.value(), Some(Word::MPa));
}

#[test]
fn works_per_area_are_read_in_the_first_unit_and_are_products_of_pressure_and_length() {
    let section = valid("energy = [\"50 mJ/m^2\", \"0.1 N/m\", \"2 Pa·m\"]");
    let works = section.points.iter().map(|point| point.table.energy.value().unwrap());
    assert_eq!(works.collect::<Vec<_>>(), [50.0, 100.0, 2000.0]);
    assert_eq!(section.units.work.unwrap().unit.symbol, "mJ/m²");
    for ([pressure, length], work) in [
        (["MPa", "µm"], Some("J/m²")),
        (["MPa", "nm"], Some("mJ/m²")),
        (["GPa", "µm"], Some("kJ/m²")),
        (["MPa", "cm"], None),
    ] {
        let [pressure, length] = [pressure, length].map(|unit| Unit::find(unit).unwrap());
        assert_eq!(Unit::of_product(pressure, length).map(|unit| unit.symbol), work);
    }
}

#[test]
fn conductivities_and_resistivities_are_read_in_units_of_the_si() {
    let section = valid("heat = [\"4 W/(cm·K)\", 390]\ncurrent = [\"17 nohm m\", 2e-8]");
    let points = section.points.iter().map(|point| &point.table);
    let heat: Vec<f64> = points.clone().filter_map(|table| table.heat.value()).collect();
    let current: Vec<f64> = points.filter_map(|table| table.current.value()).collect();
    assert_eq!(heat, [400.0, 400.0, 390.0, 390.0]);
    assert_eq!(current, [17e-9, 2e-8, 17e-9, 2e-8]);
    for text in ["1.7 µΩ cm", "1.7 uOhm·cm", "1.7 μ\u{2126} cm", "1.7 uohm cm"] {
        let (number, unit) = split(text).unwrap();
        assert_eq!((number, Unit::find(unit).unwrap().symbol), ("1.7", "µΩ cm"), "{text}");
    }
}

#[test]
fn numbers_without_units_are_ratios_only_where_this_is_declared() {
    let section = valid("loads = [0.1]\nmodulus = \"70 GPa\"\nload_unit = \"Relative\"");
    assert_eq!(section.points[0].table.loads.written().unwrap().value[0].value, 0.1);
    assert_eq!(section.units.pressure.unwrap().unit.symbol, "GPa");
}

#[test]
fn a_pure_number_may_be_the_ratio_of_two_quantities_of_one_dimension() {
    for (text, number) in [
        ("2 GPa / 200 GPa", 0.01),
        ("50 MPa/210 GPa", 50.0 / 210_000.0),
        ("1 N/mm² / 4 N/mm²", 0.25),
        ("3 um / 1 mm", 0.003),
    ] {
        assert_eq!(ratio(text), Some(decimal::nearest(number)), "{text}");
        let section = valid(&format!("hurst = \"{text}\""));
        assert_eq!(section.points[0].table.hurst.value(), Some(decimal::nearest(number)));
    }
    for text in ["2 GPa / 1 mm", "2 GPa", "2 N/mm²", "2 GPa / 4", "1 / 2"] {
        assert_eq!(ratio(text), None, "{text}");
    }
    let (_, problems) = read("wavelength = \"2 um / 1 um\"");
    assert!(problems[0].contains("unknown unit `um / 1 um`"), "{problems:?}");
}

#[test]
fn mistakes_in_units_are_reported_once_with_a_suggestion() {
    for (text, part) in [
        ("modulus = \"2 Mpa\"", "unknown unit `Mpa` (did you mean `MPa`?)"),
        ("side = \"100 mu\"", "unknown unit `mu` (did you mean `µm`?)"),
        ("side = \"2 micrometer\"", "unknown unit `micrometer` (did you mean `µm`?)"),
        ("side = \"2 inch\"", "unknown unit `inch` (unknown unit)"),
        ("side = \"2 MPa\"", "`side` is a length, but `MPa` is a unit of pressure"),
        ("energy = \"2 MPa\"", "`energy` is a work per area, but `MPa` is a unit of pressure"),
        ("energy = \"2 mJ/m\"", "`energy` is a work per area, but `mJ/m` is a unit of force"),
        ("heat = \"2 W/(m k)\"", "unknown unit `W/(m k)` (did you mean `W/(m K)`?)"),
        (
            "current = \"2 W/(m K)\"",
            "`current` is a resistivity, but `W/(m K)` is a unit of conductivity",
        ),
        (
            "side = 2\nwavelength = \"1 um\"",
            "`side` has no unit, but `wavelength` has one (write \"2 µm\"",
        ),
        (
            "bodies = [{ youngs_modulus = 2 }]\nmodulus = \"1 Pa\"",
            "`bodies.youngs_modulus` has no unit",
        ),
        ("modulus = \"1 MPa\"\nbodies = [{ youngs_modulus = 70e9 }]", "(write \"7e10 Pa\""),
        ("modulus = \"1 MPa\"\nbodies = [{ youngs_modulus = 70 }]", "(write \"70 MPa\""),
        ("side = \"2 m\"\nunit = \"px\"", "`unit` does not name one unit of length"),
        ("cases = [{ side = \"-2 m\" }]", "`side` is -2 (must be above 0)"),
        ("hurst = \"0.8 um\"", "`hurst` must be a number"),
    ] {
        let (_, problems) = read(text);
        let [problem] = problems.as_slice() else { panic!("{text}: {problems:?}") };
        assert!(problem.contains(part), "{text}: {problem}");
    }
}

#[test]
fn products_of_units_convert_if_their_dimensions_agree() {
    for (from, to, factor) in [
        ("GPa", "MPa", Some(1000.0)),
        ("MPa/µm", "Pa/m", Some(1e12)),
        ("1/µm²", "1/m²", Some(1e12)),
        ("kJ/m²", "J/m²", Some(1000.0)),
        ("MPa", "µm", None),
        ("px", "m", None),
    ] {
        assert_eq!(Unit::factor(from, to), factor, "{from} to {to}");
    }
}
