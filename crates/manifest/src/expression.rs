//! Arithmetic on the columns of a table, as manifests write it: `k_lower / k_upper`,
//! `area_corrected / load`, `-1 / slope(mean_gap)`.
//!
//! Numbers, names of columns, `+ - * / ^`, parentheses, and the functions of [`Function`]. Powers bind
//! before signs and to the right, as in Python: `-x^2` is −(x²), `2^3^2` is 2⁹.

use std::collections::BTreeSet;
use std::fmt;
use std::ops::Range;

use serde::{Serialize, Serializer};

mod parser;

/// The longest text that is read: nobody writes more by hand, and depth is bounded with it.
pub const LONGEST: usize = 400;

/// An expression in columns.
#[derive(Debug, Clone, PartialEq)]
pub enum Expression {
    /// A number.
    Number(f64),
    /// The values of a column.
    Column(String),
    /// −a.
    Negative(Box<Expression>),
    /// Two operands.
    Operation(Operator, Box<Expression>, Box<Expression>),
    /// A function of one operand.
    Call(Function, Box<Expression>),
}

/// What two operands come to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operator {
    /// a + b.
    Sum,
    /// a − b.
    Difference,
    /// a b.
    Product,
    /// a/b.
    Quotient,
    /// aᵇ.
    Power,
}

/// A function of one operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Function {
    /// The natural logarithm.
    Logarithm,
    /// The square root.
    SquareRoot,
    /// The derivative by the load, of one surface, from neighbouring loads: that of the parabola
    /// through three of them, at the ends of the loads through the last three.
    Slope,
}

/// Why a text is no expression.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{reason}")]
pub struct ExpressionError {
    /// What is wrong.
    pub reason: String,
    /// Bytes of the text that are meant.
    pub at: Range<usize>,
}

impl Function {
    /// Every function.
    pub const ALL: [Function; 3] = [Function::Logarithm, Function::SquareRoot, Function::Slope];

    /// What it is called.
    pub fn word(self) -> &'static str {
        match self {
            Function::Logarithm => "ln",
            Function::SquareRoot => "sqrt",
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

    /// What binds first is greater.
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
    /// Reads an expression.
    ///
    /// # Errors
    /// When the text is none, or longer than [`LONGEST`].
    pub fn parse(text: &str) -> Result<Expression, ExpressionError> {
        parser::parse(text)
    }

    /// The names of its columns.
    pub fn columns(&self) -> BTreeSet<&str> {
        let mut names = BTreeSet::new();
        self.visit(&mut |part| {
            if let Expression::Column(name) = part {
                names.insert(name.as_str());
            }
        });
        names
    }

    /// Whether it takes a derivative by the load.
    pub fn has_slope(&self) -> bool {
        let mut found = false;
        self.visit(&mut |part| found |= matches!(part, Expression::Call(Function::Slope, _)));
        found
    }

    fn visit<'a>(&'a self, look: &mut impl FnMut(&'a Expression)) {
        look(self);
        match self {
            Expression::Number(_) | Expression::Column(_) => {}
            Expression::Negative(one) | Expression::Call(_, one) => one.visit(look),
            Expression::Operation(_, one, other) => {
                one.visit(look);
                other.visit(look);
            }
        }
    }

    /// Its value where no load is at hand; a slope has none, it is no number there.
    pub fn value(&self, column: &impl Fn(&str) -> f64) -> f64 {
        let values = self.values(&|name: &str| vec![column(name)], &[f64::NAN]);
        values[0]
    }

    /// Its values along the loads of one surface; `column` gives those of a column. What is not
    /// defined is no number, as with any division by zero.
    pub fn values(&self, column: &impl Fn(&str) -> Vec<f64>, loads: &[f64]) -> Vec<f64> {
        match self {
            Expression::Number(number) => vec![*number; loads.len()],
            Expression::Column(name) => column(name),
            Expression::Negative(one) => {
                let values = one.values(column, loads).into_iter();
                values.map(|value| -value).collect()
            }
            Expression::Operation(operator, one, other) => {
                let pairs = one.values(column, loads).into_iter();
                let pairs = pairs.zip(other.values(column, loads));
                pairs.map(|(one, other)| operator.apply(one, other)).collect()
            }
            Expression::Call(function, one) => {
                let values = one.values(column, loads);
                match function {
                    Function::Logarithm => values.into_iter().map(libm::log).collect(),
                    Function::SquareRoot => values.into_iter().map(f64::sqrt).collect(),
                    Function::Slope => slopes(loads, &values),
                }
            }
        }
    }
}

/// Derivatives at each abscissa, of the parabola through the three nearest points in order.
fn slopes(abscissae: &[f64], ordinates: &[f64]) -> Vec<f64> {
    let count = abscissae.len();
    if count < 3 {
        return vec![f64::NAN; count];
    }
    let at = |place: usize| {
        let middle = place.clamp(1, count - 2);
        let [a, b, c] = [middle - 1, middle, middle + 1].map(|i| abscissae[i]);
        let [f, g, h] = [middle - 1, middle, middle + 1].map(|i| ordinates[i]);
        let x = abscissae[place];
        // The derivatives of Lagrange's three polynomials.
        f * (2.0 * x - b - c) / ((a - b) * (a - c))
            + g * (2.0 * x - a - c) / ((b - a) * (b - c))
            + h * (2.0 * x - a - b) / ((c - a) * (c - b))
    };
    (0..count).map(at).collect()
}

/// In one notation, however it was written: what is equal has equal keys.
impl fmt::Display for Expression {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Expression::Number(number) => write!(formatter, "{number}"),
            Expression::Column(name) => formatter.write_str(name),
            Expression::Negative(one) => {
                write!(formatter, "-")?;
                enclosed(formatter, one, one.rank() < 3)
            }
            Expression::Call(function, one) => write!(formatter, "{}({one})", function.word()),
            Expression::Operation(operator, one, other) => {
                let rank = operator.rank();
                let is_power = *operator == Operator::Power;
                // Equal ranks go on to the left, powers to the right.
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
            Expression::Negative(_) => 3,
            Expression::Operation(operator, ..) => operator.rank(),
        }
    }
}

fn enclosed(formatter: &mut fmt::Formatter<'_>, one: &Expression, is_so: bool) -> fmt::Result {
    match is_so {
        true => write!(formatter, "({one})"),
        false => write!(formatter, "{one}"),
    }
}

impl Serialize for Expression {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
mod tests;
