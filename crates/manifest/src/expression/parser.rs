//! Reads expressions by recursive descent.

use std::ops::Range;

use super::{Expression, ExpressionError, Function, LONGEST, Operator};
use crate::diagnostics::{did_you_mean, listed};

/// Reads a whole text.
///
/// # Errors
/// When it is no expression.
pub fn parse(text: &str) -> Result<Expression, ExpressionError> {
    if text.len() > LONGEST {
        let reason = format!("the expression is {} bytes long, {LONGEST} is the most", text.len());
        return Err(error(reason, 0..text.len()));
    }
    let mut parser = Parser { text, place: 0 };
    let read = parser.sum()?;
    match parser.peek() {
        None => Ok(read),
        Some(letter) => Err(parser.here(format!("unexpected `{letter}`"))),
    }
}

fn error(reason: String, at: Range<usize>) -> ExpressionError {
    ExpressionError { reason, at }
}

struct Parser<'a> {
    text: &'a str,
    place: usize,
}

impl Parser<'_> {
    /// The next letter that is no space.
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.place..];
        self.place += rest.len() - rest.trim_start().len();
        self.text[self.place..].chars().next()
    }

    /// Takes one of some letters.
    fn take<T: Copy>(&mut self, letters: &[(char, T)]) -> Option<T> {
        let next = self.peek()?;
        let (letter, meaning) = letters.iter().find(|(letter, _)| *letter == next)?;
        self.place += letter.len_utf8();
        Some(*meaning)
    }

    fn here(&self, reason: String) -> ExpressionError {
        let letter = self.text[self.place..].chars().next();
        error(reason, self.place..self.place + letter.map_or(0, char::len_utf8))
    }

    fn sum(&mut self) -> Result<Expression, ExpressionError> {
        let mut sum = self.product()?;
        while let Some(operator) = self.take(&[('+', Operator::Sum), ('-', Operator::Difference)]) {
            sum = operation(operator, sum, self.product()?);
        }
        Ok(sum)
    }

    fn product(&mut self) -> Result<Expression, ExpressionError> {
        let mut product = self.signed()?;
        while let Some(operator) = self.take(&[('*', Operator::Product), ('/', Operator::Quotient)])
        {
            product = operation(operator, product, self.signed()?);
        }
        Ok(product)
    }

    fn signed(&mut self) -> Result<Expression, ExpressionError> {
        match self.take(&[('-', true), ('+', false)]) {
            Some(true) => Ok(Expression::Negative(Box::new(self.signed()?))),
            Some(false) => self.signed(),
            None => self.power(),
        }
    }

    fn power(&mut self) -> Result<Expression, ExpressionError> {
        let base = self.operand()?;
        match self.take(&[('^', ())]) {
            Some(()) => Ok(operation(Operator::Power, base, self.signed()?)),
            None => Ok(base),
        }
    }

    fn operand(&mut self) -> Result<Expression, ExpressionError> {
        match self.peek() {
            None => Err(self.here("the expression ends where an operand is needed".to_owned())),
            Some('(') => {
                self.place += 1;
                self.enclosed()
            }
            Some(letter) if letter.is_ascii_digit() || letter == '.' => self.number(),
            Some(letter) if letter.is_ascii_alphabetic() || letter == '_' => self.name(),
            Some(letter) => {
                Err(self
                    .here(format!("`{letter}` stands where a number, a column or `(` is needed")))
            }
        }
    }

    /// What follows an opened parenthesis.
    fn enclosed(&mut self) -> Result<Expression, ExpressionError> {
        let inner = self.sum()?;
        match self.take(&[(')', ())]) {
            Some(()) => Ok(inner),
            None => Err(self.here("`)` is missing".to_owned())),
        }
    }

    fn number(&mut self) -> Result<Expression, ExpressionError> {
        let rest = &self.text[self.place..];
        let mut end = 0;
        for (at, letter) in rest.char_indices() {
            let is_sign = matches!(letter, '+' | '-') && rest[..at].ends_with(['e', 'E']);
            if !(letter.is_ascii_digit() || matches!(letter, '.' | 'e' | 'E') || is_sign) {
                break;
            }
            end = at + letter.len_utf8();
        }
        let at = self.place..self.place + end;
        let number: Option<f64> = rest[..end].parse().ok();
        let Some(number) = number.filter(|number| number.is_finite()) else {
            return Err(error(format!("`{}` is no number", &rest[..end]), at));
        };
        self.place = at.end;
        Ok(Expression::Number(number))
    }

    /// A column, or a function where a parenthesis follows.
    fn name(&mut self) -> Result<Expression, ExpressionError> {
        let rest = &self.text[self.place..];
        let is_part = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
        let end = rest.find(|letter| !is_part(letter)).unwrap_or(rest.len());
        let name = &rest[..end];
        let at = self.place..self.place + end;
        self.place = at.end;
        if self.take(&[('(', ())]).is_none() {
            return Ok(Expression::Column(name.to_owned()));
        }
        let function = Function::ALL.into_iter().find(|one| one.word() == name);
        let Some(function) = function else {
            let words = || Function::ALL.iter().map(|one| one.word());
            let advice = match did_you_mean(name, words()) {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => format!("there are {}", listed(words(), "and")),
            };
            return Err(error(format!("there is no function `{name}`; {advice}"), at));
        };
        Ok(Expression::Call(function, Box::new(self.enclosed()?)))
    }
}

fn operation(operator: Operator, one: Expression, other: Expression) -> Expression {
    Expression::Operation(operator, Box::new(one), Box::new(other))
}
