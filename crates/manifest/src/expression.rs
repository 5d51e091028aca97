//! Arithmetic expressions in the columns of a table, such as `area_corrected / load` or
//! `-1 / slope(mean_gap)`, or in keys of the manifest, such as `8 * k_upper`.
//!
//! An expression consists of numbers, names of columns, `+ - * / ^`, parentheses, the number `pi`,
//! and the functions of [`Function`]. As in Python, powers bind more tightly than signs and
//! associate to the right: `-x^2` is −(x²), and `2^3^2` is 2⁹.

use std::collections::BTreeSet;
use std::fmt;
use std::ops::Range;

use serde::{Serialize, Serializer};

use crate::diagnostics::{Span, did_you_mean, listed};

/// Maximum length of an expression in bytes. It also bounds the depth of the recursion of the
/// parser.
pub const MAX_LENGTH: usize = 400;

/// An arithmetic expression in the columns of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Expression {
    Number(f64),
    Column(String),
    Negative(Box<Expression>),
    Operation(Operator, Box<Expression>, Box<Expression>),
    Call(Function, Box<Expression>),
}

/// An arithmetic operator with two operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operator {
    Sum,
    Difference,
    Product,
    Quotient,
    Power,
}

/// A function of one operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Function {
    Logarithm,
    SquareRoot,
    Exponential,
    Absolute,
    /// Error function erf.
    ErrorFunction,
    /// Complementary error function erfc = 1 − erf, precise where erf is nearly 1.
    Complement,
    /// Derivative with respect to the load, for each surface: the slope of the parabola through
    /// three neighbouring loads.
    Slope,
}

/// A syntax error in an expression.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{reason}")]
pub struct ExpressionError {
    pub reason: String,
    /// Bytes of the text where the error is.
    pub at: Range<usize>,
}

impl ExpressionError {
    /// Returns the position of the error in a manifest, given the expression and the span of the
    /// text, with its quotes. If the text has escaped characters, returns the span of the text.
    pub fn span_in(&self, expression: &str, written: &Span) -> Span {
        let inside = written.start + 1..written.end.saturating_sub(1);
        if inside.len() != expression.len() {
            return written.clone();
        }
        inside.start + self.at.start..inside.start + self.at.end.max(self.at.start)
    }
}

impl Function {
    /// All functions, in the order of messages.
    pub const ALL: [Function; 7] = [
        Function::Logarithm,
        Function::SquareRoot,
        Function::Exponential,
        Function::Absolute,
        Function::ErrorFunction,
        Function::Complement,
        Function::Slope,
    ];

    /// Returns the name of the function in expressions.
    pub fn word(self) -> &'static str {
        match self {
            Function::Logarithm => "ln",
            Function::SquareRoot => "sqrt",
            Function::Exponential => "exp",
            Function::Absolute => "abs",
            Function::ErrorFunction => "erf",
            Function::Complement => "erfc",
            Function::Slope => "slope",
        }
    }
}

impl Operator {
    fn symbol(self) -> &'static str {
        match self {
            Operator::Sum => " + ",
            Operator::Difference => " - ",
            Operator::Product => " * ",
            Operator::Quotient => " / ",
            Operator::Power => "^",
        }
    }

    /// Returns the precedence of the operator. Operators of higher precedence bind more tightly.
    fn rank(self) -> u8 {
        match self {
            Operator::Sum | Operator::Difference => 1,
            Operator::Product | Operator::Quotient => 2,
            Operator::Power => 4,
        }
    }

    fn apply(self, one: f64, other: f64) -> f64 {
        match self {
            Operator::Sum => one + other,
            Operator::Difference => one - other,
            Operator::Product => one * other,
            Operator::Quotient => one / other,
            Operator::Power => libm::pow(one, other),
        }
    }
}

impl Expression {
    /// Parses the text of an expression.
    ///
    /// # Errors
    /// If the text is not an expression, or is longer than [`MAX_LENGTH`].
    pub fn parse(text: &str) -> Result<Expression, ExpressionError> {
        Expression::read(text, true)
    }

    /// Parses the text of an expression in which `pi` is a name like all others.
    ///
    /// Keys of stages have such expressions, because `"pi/8"` is the name of a correction.
    ///
    /// # Errors
    /// See [`Expression::parse`].
    pub fn parse_without_pi(text: &str) -> Result<Expression, ExpressionError> {
        Expression::read(text, false)
    }

    fn read(text: &str, has_pi: bool) -> Result<Expression, ExpressionError> {
        if text.len() > MAX_LENGTH {
            let reason =
                format!("the expression is {} bytes long; the maximum is {MAX_LENGTH}", text.len());
            return Err(error(reason, 0..text.len()));
        }
        let mut parser = Parser { text, has_pi, position: 0 };
        let read = parser.operations(0)?;
        match parser.peek() {
            None => Ok(read),
            Some(letter) => Err(parser.here(format!("unexpected `{letter}`"))),
        }
    }

    /// Returns the names of the columns in the expression.
    pub fn columns(&self) -> BTreeSet<&str> {
        let mut names = BTreeSet::new();
        self.visit(&mut |part| {
            if let Expression::Column(name) = part {
                names.insert(name.as_str());
            }
        });
        names
    }

    /// Returns whether the expression contains a derivative with respect to the load.
    pub fn has_slope(&self) -> bool {
        let mut found = false;
        self.visit(&mut |part| found |= matches!(part, Expression::Call(Function::Slope, _)));
        found
    }

    fn visit<'a>(&'a self, visitor: &mut impl FnMut(&'a Expression)) {
        visitor(self);
        match self {
            Expression::Number(_) | Expression::Column(_) => {}
            Expression::Negative(one) | Expression::Call(_, one) => one.visit(visitor),
            Expression::Operation(_, one, other) => {
                one.visit(visitor);
                other.visit(visitor);
            }
        }
    }

    /// Returns the value of the expression in one row, where `column` returns the value of a
    /// column. Derivatives with respect to the load are NaN, because they need several rows.
    pub fn value(&self, column: &impl Fn(&str) -> f64) -> f64 {
        let values = self.values(&|name: &str| vec![column(name)], &[f64::NAN]);
        values[0]
    }

    /// Returns the values of the expression at the loads of one surface. `column` returns the
    /// values of a column at these loads. Undefined operations give NaN or infinity, as in IEEE
    /// 754.
    pub fn values(&self, column: &impl Fn(&str) -> Vec<f64>, loads: &[f64]) -> Vec<f64> {
        match self {
            Expression::Number(number) => vec![*number; loads.len()],
            Expression::Column(name) => column(name),
            Expression::Negative(one) => {
                let values = one.values(column, loads).into_iter();
                values.map(|value| -value).collect()
            }
            Expression::Operation(operator, one, other) => {
                let pairs = one.values(column, loads).into_iter().zip(other.values(column, loads));
                pairs.map(|(one, other)| operator.apply(one, other)).collect()
            }
            Expression::Call(function, one) => {
                let values = one.values(column, loads);
                let each =
                    |function: fn(f64) -> f64| values.iter().copied().map(function).collect();
                match function {
                    Function::Logarithm => each(libm::log),
                    Function::SquareRoot => each(f64::sqrt),
                    Function::Exponential => each(libm::exp),
                    Function::Absolute => each(f64::abs),
                    Function::ErrorFunction => each(libm::erf),
                    Function::Complement => each(libm::erfc),
                    Function::Slope => slopes(loads, &values),
                }
            }
        }
    }
}

/// Returns the derivative of the ordinates at each abscissa: the slope of the parabola through this
/// point and its two neighbours. The first and the last derivative are slopes of the parabola
/// through the three points nearest to that end.
fn slopes(abscissae: &[f64], ordinates: &[f64]) -> Vec<f64> {
    let count = abscissae.len();
    if count < 3 {
        return vec![f64::NAN; count];
    }
    let at = |index: usize| {
        let middle = index.clamp(1, count - 2);
        let [a, b, c] = [middle - 1, middle, middle + 1].map(|i| abscissae[i]);
        let [f, g, h] = [middle - 1, middle, middle + 1].map(|i| ordinates[i]);
        let x = abscissae[index];
        // Derivatives of the three Lagrange polynomials.
        f * (2.0 * x - b - c) / ((a - b) * (a - c))
            + g * (2.0 * x - a - c) / ((b - a) * (b - c))
            + h * (2.0 * x - a - b) / ((c - a) * (c - b))
    };
    (0..count).map(at).collect()
}

/// Formats the expression in canonical notation, so that equal expressions have equal keys.
impl fmt::Display for Expression {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Expression::Number(number) => write!(formatter, "{number}"),
            Expression::Column(name) => formatter.write_str(name),
            Expression::Negative(one) => {
                write!(formatter, "-")?;
                enclosed(formatter, one, one.rank() < SIGN)
            }
            Expression::Call(function, one) => write!(formatter, "{}({one})", function.word()),
            Expression::Operation(operator, one, other) => {
                let rank = operator.rank();
                let is_power = *operator == Operator::Power;
                // Operators associate to the left, powers to the right.
                let left = one.rank() < rank || (is_power && one.rank() == rank);
                let right = other.rank() < rank || (!is_power && other.rank() == rank);
                enclosed(formatter, one, left)?;
                formatter.write_str(operator.symbol())?;
                enclosed(formatter, other, right && !matches!(**other, Expression::Negative(_)))
            }
        }
    }
}

impl Expression {
    fn rank(&self) -> u8 {
        match self {
            Expression::Number(_) | Expression::Column(_) | Expression::Call(..) => 5,
            Expression::Negative(_) => SIGN,
            Expression::Operation(operator, ..) => operator.rank(),
        }
    }
}

fn enclosed(formatter: &mut fmt::Formatter<'_>, one: &Expression, is_so: bool) -> fmt::Result {
    if is_so { write!(formatter, "({one})") } else { write!(formatter, "{one}") }
}

impl Serialize for Expression {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

fn error(reason: String, at: Range<usize>) -> ExpressionError {
    ExpressionError { reason, at }
}

const OPERATORS: [(char, Operator); 5] = [
    ('+', Operator::Sum),
    ('-', Operator::Difference),
    ('*', Operator::Product),
    ('/', Operator::Quotient),
    ('^', Operator::Power),
];

/// Precedence of a sign, between those of products and powers.
const SIGN: u8 = 3;

/// A parser of expressions by precedence climbing.
struct Parser<'a> {
    text: &'a str,
    /// Whether `pi` is a number.
    has_pi: bool,
    position: usize,
}

impl Parser<'_> {
    /// Skips spaces and returns the next character.
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.position..];
        self.position += rest.len() - rest.trim_start().len();
        self.text[self.position..].chars().next()
    }

    /// Consumes the next character if it is one of `letters`, and returns the value paired with it.
    fn take<T: Copy>(&mut self, letters: &[(char, T)]) -> Option<T> {
        let next = self.peek()?;
        let (letter, meaning) = letters.iter().find(|(letter, _)| *letter == next)?;
        self.position += letter.len_utf8();
        Some(*meaning)
    }

    fn here(&self, reason: String) -> ExpressionError {
        let letter = self.text[self.position..].chars().next();
        error(reason, self.position..self.position + letter.map_or(0, char::len_utf8))
    }

    /// Parses operations of at least this precedence. Powers associate to the right, and their
    /// exponents can have signs.
    fn operations(&mut self, least: u8) -> Result<Expression, ExpressionError> {
        let mut left = match self.take(&[('-', true), ('+', false)]) {
            Some(true) => Expression::Negative(Box::new(self.operations(SIGN)?)),
            Some(false) => self.operations(SIGN)?,
            None => self.operand()?,
        };
        while let Some(operator) = self.operator(least) {
            let is_power = operator == Operator::Power;
            let right = self.operations(if is_power { SIGN } else { operator.rank() + 1 })?;
            left = Expression::Operation(operator, Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    /// Consumes the next character if it is an operator of at least this precedence.
    fn operator(&mut self, least: u8) -> Option<Operator> {
        let next = self.peek()?;
        let (_, operator) = OPERATORS.iter().find(|(letter, _)| *letter == next)?;
        if operator.rank() < least {
            return None;
        }
        self.position += 1;
        Some(*operator)
    }

    fn operand(&mut self) -> Result<Expression, ExpressionError> {
        match self.peek() {
            None => Err(self.here("the expression ends where an operand is needed".to_owned())),
            Some('(') => {
                self.position += 1;
                self.enclosed()
            }
            Some(letter) if letter.is_ascii_digit() || letter == '.' => self.number(),
            Some(letter) if letter.is_ascii_alphabetic() || letter == '_' => self.name(),
            Some(letter) => {
                Err(self
                    .here(format!("unexpected `{letter}`; a number, a name or `(` is needed here")))
            }
        }
    }

    /// Parses the rest of an expression in parentheses, up to and including the closing
    /// parenthesis.
    fn enclosed(&mut self) -> Result<Expression, ExpressionError> {
        let inner = self.operations(0)?;
        match self.take(&[(')', ())]) {
            Some(()) => Ok(inner),
            None => Err(self.here("`)` is missing".to_owned())),
        }
    }

    fn number(&mut self) -> Result<Expression, ExpressionError> {
        let rest = &self.text[self.position..];
        let mut end = 0;
        for (at, letter) in rest.char_indices() {
            let is_sign = matches!(letter, '+' | '-') && rest[..at].ends_with(['e', 'E']);
            if !(letter.is_ascii_digit() || matches!(letter, '.' | 'e' | 'E') || is_sign) {
                break;
            }
            end = at + letter.len_utf8();
        }
        let at = self.position..self.position + end;
        let number: Option<f64> = rest[..end].parse().ok();
        let Some(number) = number.filter(|number| number.is_finite()) else {
            return Err(error(format!("`{}` is not a number", &rest[..end]), at));
        };
        self.position = at.end;
        Ok(Expression::Number(number))
    }

    /// Parses the name of a column, or a function if a parenthesis follows.
    fn name(&mut self) -> Result<Expression, ExpressionError> {
        let rest = &self.text[self.position..];
        let is_part = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
        let end = rest.find(|letter| !is_part(letter)).unwrap_or(rest.len());
        let name = &rest[..end];
        let at = self.position..self.position + end;
        self.position = at.end;
        if self.take(&[('(', ())]).is_none() {
            return Ok(match name {
                "pi" if self.has_pi => Expression::Number(std::f64::consts::PI),
                _ => Expression::Column(name.to_owned()),
            });
        }
        let function = Function::ALL.into_iter().find(|one| one.word() == name);
        let Some(function) = function else {
            let words = || Function::ALL.iter().map(|one| one.word());
            let advice = match did_you_mean(name, words()) {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => format!("the functions are {}", listed(words(), "and")),
            };
            return Err(error(format!("there is no function `{name}`; {advice}"), at));
        };
        Ok(Expression::Call(function, Box::new(self.enclosed()?)))
    }
}

#[cfg(test)]
mod tests {
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

    fn shown(text: &str) -> String {
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
            ("exp(ln(2)) + abs(1 - 3)", 4.0),
            ("erf(k_lower) + erfc(k_lower)", 1.0),
            ("sqrt(pi) ^ 2 / pi", 1.0),
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
        assert_eq!(shown(" k_lower/k_upper "), "k_lower / k_upper");
        assert_eq!(shown("((a)+(b*c))"), "a + b * c");
        assert_eq!(shown("(a-b)-(c-d)"), "a - b - (c - d)");
        assert_eq!(shown("(a^b)^c^d"), "(a^b)^c^d");
        assert_eq!(shown("-(a+b)/c"), "-(a + b) / c");
        assert_eq!(shown("-1/slope( mean_gap )"), "-1 / slope(mean_gap)");
    }

    #[test]
    fn columns_are_named_each_once() {
        let read = Expression::parse("a / b + ln(a) - slope(c)").unwrap();
        assert_eq!(Vec::from_iter(read.columns()), ["a", "b", "c"]);
        assert!(read.has_slope());
    }

    #[test]
    fn syntax_errors_have_a_position() {
        for (text, reason, at) in [
            ("k_lower /", "ends where", 9..9),
            ("a b", "unexpected `b`", 2..3),
            ("(a + b", "`)` is missing", 6..6),
            ("a * é", "unexpected `é`", 4..6),
            ("sloppe(a)", "did you mean `slope`", 0..6),
            ("1.2.3", "`1.2.3` is not a number", 0..5),
            ("", "ends where", 0..0),
        ] {
            let error = Expression::parse(text).unwrap_err();
            assert!(error.reason.contains(reason), "{text}: {error}");
            assert_eq!(error.at, at, "{text}");
        }
        assert!(Expression::parse(&"(".repeat(MAX_LENGTH)).is_err());
        assert!(Expression::parse(&"a+".repeat(MAX_LENGTH)).is_err());
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
        fn displayed_expressions_are_read_as_the_same(expression in expression()) {
            let shown = expression.to_string();
            prop_assume!(shown.len() <= MAX_LENGTH);
            prop_assert_eq!(Expression::parse(&shown).unwrap(), expression);
        }
    }
}
