//! Products as people write them: one sign, numbers first, all divisors at the end.

use super::expression::{self, Level, Text};

/// Factors and divisors.
#[derive(Clone, Debug)]
pub(super) struct Product {
    pub(super) negative: bool,
    /// None of them is a product.
    above: Vec<Text>,
    below: Vec<Text>,
}

impl Product {
    /// An expression as a product of its factors.
    pub(super) fn of(text: &Text) -> Product {
        match &text.product {
            Some(product) => (**product).clone(),
            None => Product { negative: false, above: vec![text.clone()], below: Vec::new() },
        }
    }

    pub(super) fn times(mut self, other: Product) -> Product {
        self.negative ^= other.negative;
        self.above.extend(other.above);
        self.below.extend(other.below);
        self
    }

    pub(super) fn over(self, other: Product) -> Product {
        let Product { negative, above, below } = other;
        self.times(Product { negative, above: below, below: above })
    }

    pub(super) fn negated(mut self) -> Product {
        self.negative = !self.negative;
        self
    }

    pub(super) fn text(mut self) -> Text {
        let is_one = |t: &Text| t.text == "1";
        self.above.retain(|t| !is_one(t));
        self.below.retain(|t| !is_one(t));
        self.below = gathered(self.below);
        // The sort is stable: other factors than numbers keep their order.
        self.above.sort_by_key(|t| !t.text.starts_with(|c: char| c.is_ascii_digit()));
        let joined =
            |factors: &[Text]| -> String { factors.iter().map(|f| f.at(Level::Power)).collect::<Vec<_>>().join(" * ") };
        let sign = if self.negative { "-" } else { "" };
        let above = if self.above.is_empty() { "1".to_owned() } else { joined(&self.above) };
        let (text, level) = match (&self.above[..], &self.below[..]) {
            ([one], []) if !self.negative => return one.clone(),
            (_, []) if self.above.len() < 2 => (format!("{sign}{above}"), Level::Negative),
            (_, []) => (format!("{sign}{above}"), Level::Product),
            (_, [one]) => (format!("{sign}{above} / {}", one.at(Level::Power)), Level::Product),
            (_, several) => (format!("{sign}{above} / ({})", joined(several)), Level::Product),
        };
        Text { product: Some(Box::new(self)), ..Text::new(text, level) }
    }
}

/// Divisors that stand there several times as powers.
fn gathered(divisors: Vec<Text>) -> Vec<Text> {
    let mut counted: Vec<(Text, u32)> = Vec::new();
    for divisor in divisors {
        match counted.iter_mut().find(|(known, _)| known.text == divisor.text) {
            Some((_, count)) => *count += 1,
            None => counted.push((divisor, 1)),
        }
    }
    let power = |(base, count): (Text, u32)| match count {
        1 => base,
        _ => expression::power(&base, &Text::atom(count.to_string())),
    };
    counted.into_iter().map(power).collect()
}
