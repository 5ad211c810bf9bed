//! Text of one expression, with as few parentheses as the language needs.

use super::super::{Binary, Compare, Unary};

/// How tightly an expression's outermost operator binds, loosest first.
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
}

impl Text {
    pub(super) fn atom(text: impl Into<String>) -> Text {
        Text { text: text.into(), level: Level::Atom }
    }

    fn new(text: String, level: Level) -> Text {
        Text { text, level }
    }

    /// In parentheses, if it binds less tightly than `level`.
    fn at(&self, level: Level) -> String {
        if self.level >= level { self.text.clone() } else { format!("({})", self.text) }
    }
}

/// A number; whole ones without a point.
pub(super) fn number(x: f64) -> Text {
    let text = if x.fract() == 0.0 && x.abs() < 1e15 { format!("{x:.0}") } else { format!("{x:?}") };
    Text::new(text, if x < 0.0 { Level::Negative } else { Level::Atom })
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
    let sign = match op {
        Compare::Eq => "==",
        Compare::Ne => "!=",
        Compare::Lt => "<",
        Compare::Le => "<=",
        Compare::Gt => ">",
        Compare::Ge => ">=",
    };
    Text::new(format!("{} {sign} {}", a.at(Level::Sum), b.at(Level::Sum)), Level::Compare)
}

pub(super) fn unary(op: Unary, a: &Text) -> Text {
    match op {
        // -a * b is (-a) * b, which is the same.
        Unary::Neg if a.level == Level::Product => Text::new(format!("-{}", a.text), Level::Product),
        Unary::Neg => Text::new(format!("-{}", a.at(Level::Power)), Level::Negative),
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
        // A sum within a sum, or a product within a product, is written without parentheses on the right as well.
        Binary::Add => match b.text.strip_prefix('-') {
            Some(positive) if b.level == Level::Negative => {
                Text::new(format!("{} - {positive}", a.at(Level::Sum)), Level::Sum)
            }
            _ => infix("+", Level::Sum, Level::Sum),
        },
        Binary::Sub => infix("-", Level::Sum, Level::Product),
        Binary::Mul | Binary::MulOrZero => {
            // 2 * (x / y) is 2 * x / y, but for rounding.
            let remainder = b.level == Level::Product && b.text.contains('%');
            infix("*", Level::Product, if remainder { Level::Negative } else { Level::Product })
        }
        Binary::Div | Binary::DivOrZero => infix("/", Level::Product, Level::Negative),
        Binary::Rem => infix("%", Level::Product, Level::Negative),
        Binary::Pow => power(a, b),
        Binary::And => infix("and", Level::And, Level::And),
        Binary::Or => infix("or", Level::Or, Level::Or),
        Binary::Atan2 | Binary::Min | Binary::Max => call(&super::lower(op), &[a, b]),
    }
}
