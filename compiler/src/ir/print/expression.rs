//! Text of one expression, with as few parentheses as the language needs.

use super::product::Product;
use crate::ir::{Binary, Compare, Unary};
use std::f64::consts::PI;

/// The precedence of an expression's outermost operator, loosest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Level {
    If,
    Or,
    And,
    Not,
    Compare,
    Sum,
    Product,
    Negative,
    Power,
    Atom,
}

/// An expression as text.
#[derive(Clone, Debug)]
pub(super) struct Text {
    pub(super) text: String,
    pub(super) level: Level,
    /// Its factors, if it is a product, a quotient or a negative number or name.
    pub(super) product: Option<Box<Product>>,
}

impl Text {
    pub(super) fn atom(text: impl Into<String>) -> Text {
        Text::new(text.into(), Level::Atom)
    }

    pub(super) fn new(text: String, level: Level) -> Text {
        Text { text, level, product: None }
    }

    /// The expression of which it is the negative.
    fn positive(&self) -> Option<Text> {
        let product = self.product.as_ref().filter(|p| p.negative)?;
        Some((**product).clone().negated().text())
    }

    /// In parentheses, if it binds less tightly than `level`.
    pub(super) fn at(&self, level: Level) -> String {
        if self.level >= level { self.text.clone() } else { format!("({})", self.text) }
    }
}

/// A number; whole ones without a point, simple fractions of pi as such.
pub(super) fn number(x: f64) -> Text {
    if x < 0.0 {
        return Product::of(&number(-x)).negated().text();
    }
    if let Some((above, below)) = of_pi(x) {
        let pi = Product::of(&Text::atom("pi"));
        return Product::of(&number(above)).times(pi).over(Product::of(&number(below))).text();
    }
    Text::atom(if x.fract() == 0.0 && x < 1e15 { format!("{x:.0}") } else { format!("{x:?}") })
}

/// A number as a fraction of pi, if it is one to the bit, as the angles of scripts are.
fn of_pi(x: f64) -> Option<(f64, f64)> {
    [1.0, 2.0, 3.0, 4.0, 6.0, 12.0, 180.0].into_iter().find_map(|below| {
        let above = (x / PI * below).round();
        let simple = (1.0..=12.0).contains(&above) || (below == 180.0 && above == 1.0);
        (simple && above * PI / below == x).then_some((above, below))
    })
}

pub(super) fn call(name: &str, args: &[&Text]) -> Text {
    let args: Vec<&str> = args.iter().map(|a| a.text.as_str()).collect();
    Text::atom(format!("{name}({})", args.join(", ")))
}

pub(super) fn power(base: &Text, exponent: &Text) -> Text {
    Text::new(format!("{}^{}", base.at(Level::Atom), exponent.at(Level::Power)), Level::Power)
}

pub(super) fn select(condition: &Text, a: &Text, b: &Text) -> Text {
    Text::new(format!("if {} {{ {} }} else {{ {} }}", condition.text, a.text, b.text), Level::If)
}

pub(super) fn compare(op: Compare, a: &Text, b: &Text) -> Text {
    Text::new(format!("{} {} {}", a.at(Level::Sum), op.sign(), b.at(Level::Sum)), Level::Compare)
}

pub(super) fn unary(op: Unary, a: &Text) -> Text {
    match op {
        Unary::Neg => Product::of(a).negated().text(),
        Unary::Not => Text::new(format!("not {}", a.at(Level::Not)), Level::Not),
        // An int widens by itself.
        Unary::ToReal => a.clone(),
        Unary::ToInt => call("int", &[a]),
        op => call(&super::lower(op), &[a]),
    }
}

pub(super) fn binary(op: Binary, a: &Text, b: &Text) -> Text {
    let infix =
        |sign: &str, level: Level, right: Level| Text::new(format!("{} {sign} {}", a.at(level), b.at(right)), level);
    match op {
        // A sum on the right of a sum needs no parentheses either.
        Binary::Add => match (a.positive(), b.positive()) {
            (_, Some(b)) => difference(a, &b),
            (Some(a), None) => difference(b, &a),
            (None, None) => infix("+", Level::Sum, Level::Sum),
        },
        Binary::Sub => match b.positive() {
            Some(b) => Text::new(format!("{} + {}", a.at(Level::Sum), b.at(Level::Sum)), Level::Sum),
            None => difference(a, b),
        },
        Binary::Mul | Binary::MulOrZero => Product::of(a).times(Product::of(b)).text(),
        Binary::Div | Binary::DivOrZero => Product::of(a).over(Product::of(b)).text(),
        Binary::Rem => infix("%", Level::Product, Level::Negative),
        Binary::Pow => power(a, b),
        Binary::And => infix("and", Level::And, Level::And),
        Binary::Or => infix("or", Level::Or, Level::Or),
        Binary::Atan2 | Binary::Min | Binary::Max | Binary::Keep => call(&super::lower(op), &[a, b]),
    }
}

fn difference(a: &Text, b: &Text) -> Text {
    Text::new(format!("{} - {}", a.at(Level::Sum), b.at(Level::Product)), Level::Sum)
}
