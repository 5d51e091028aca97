//! What expressions come to, and how they are told.

use proptest::prelude::*;

use super::*;

fn value(text: &str) -> f64 {
    let column = |name: &str| match name {
        "k_lower" => 4.0,
        "k_upper" => 32.0,
        _ => f64::NAN,
    };
    Expression::parse(text).unwrap().value(&column)
}

fn told(text: &str) -> String {
    Expression::parse(text).unwrap().to_string()
}

#[test]
fn operators_bind_as_in_arithmetic() {
    for (text, expected) in [
        ("k_lower / k_upper", 0.125),
        ("1 + 2 * 3 ^ 2", 19.0),
        ("2 - 3 - 4", -5.0),
        ("16 / 4 / 2", 2.0),
        ("-2^2", -4.0),
        ("2^-1", 0.5),
        ("2^3^2", 512.0),
        ("(1 + k_lower) * 2", 10.0),
        ("1.5e-1 * 2", 0.3),
        ("ln(1)", 0.0),
        ("sqrt(k_lower)", 2.0),
        ("--3", 3.0),
    ] {
        assert!((value(text) - expected).abs() < 1e-15, "{text}");
    }
    assert!(value("1 / (k_lower - 4)").is_infinite());
}

#[test]
fn slope_is_the_derivative_of_a_parabola_at_every_load() {
    let loads = [0.1, 0.2, 0.5, 1.0];
    let column = |_: &str| loads.iter().map(|y| 2.0 - 3.0 * y + 5.0 * y * y).collect();
    let slopes = Expression::parse("slope(mean_gap)").unwrap();
    for (found, load) in slopes.values(&column, &loads).iter().zip(loads) {
        assert!((found - (10.0 * load - 3.0)).abs() < 1e-12);
    }
    assert!(slopes.values(&|_| vec![1.0, 2.0], &[0.1, 0.2])[0].is_nan());
}

#[test]
fn formatting_changes_nothing() {
    assert_eq!(told(" k_lower/k_upper "), "k_lower / k_upper");
    assert_eq!(told("((a)+(b*c))"), "a + b * c");
    assert_eq!(told("(a-b)-(c-d)"), "a - b - (c - d)");
    assert_eq!(told("(a^b)^c^d"), "(a^b)^c^d");
    assert_eq!(told("-(a+b)/c"), "-(a + b) / c");
    assert_eq!(told("-1/slope( mean_gap )"), "-1 / slope(mean_gap)");
}

#[test]
fn columns_are_named_each_once() {
    let read = Expression::parse("a / b + ln(a) - slope(c)").unwrap();
    assert_eq!(Vec::from_iter(read.columns()), ["a", "b", "c"]);
    assert!(read.has_slope());
}

#[test]
fn what_is_no_expression_is_told_with_its_place() {
    for (text, reason, at) in [
        ("k_lower /", "ends where", 9..9),
        ("a b", "unexpected `b`", 2..3),
        ("(a + b", "`)` is missing", 6..6),
        ("a * é", "`é` stands where", 4..6),
        ("sloppe(a)", "did you mean `slope`", 0..6),
        ("1.2.3", "`1.2.3` is no number", 0..5),
        ("", "ends where", 0..0),
    ] {
        let error = Expression::parse(text).unwrap_err();
        assert!(error.reason.contains(reason), "{text}: {error}");
        assert_eq!(error.at, at, "{text}");
    }
    assert!(Expression::parse(&"(".repeat(LONGEST)).is_err());
    assert!(Expression::parse(&"a+".repeat(LONGEST)).is_err());
}

fn expression() -> impl Strategy<Value = Expression> {
    let leaf = prop_oneof![
        (0.0..1e3f64).prop_map(Expression::Number),
        "[a-z][a-z_0-9]{0,5}".prop_map(Expression::Column),
    ];
    leaf.prop_recursive(4, 24, 2, |inner| {
        let operator = prop_oneof![
            Just(Operator::Sum),
            Just(Operator::Difference),
            Just(Operator::Product),
            Just(Operator::Quotient),
            Just(Operator::Power),
        ];
        let boxed = inner.prop_map(Box::new).boxed();
        prop_oneof![
            (operator, boxed.clone(), boxed.clone())
                .prop_map(|(operator, one, other)| Expression::Operation(operator, one, other)),
            boxed.clone().prop_map(Expression::Negative),
            boxed.prop_map(|one| Expression::Call(Function::Slope, one)),
        ]
    })
}

proptest! {
    #[test]
    fn what_is_told_is_read_as_the_same(expression in expression()) {
        let told = expression.to_string();
        prop_assume!(told.len() <= LONGEST);
        prop_assert_eq!(Expression::parse(&told).unwrap(), expression);
    }
}
