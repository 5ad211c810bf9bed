//! The values of numbers, texts and doc comments.

use super::ast::{ExprKind, Unit};
use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::Span;

/// The value of a number with its unit.
pub(super) fn number(span: Span, text: &str) -> Result<ExprKind, Box<Diagnostic>> {
    let (number, suffix) = split_number(text);
    let unit = match suffix {
        "" => None,
        suffix => Some(unit(suffix).ok_or_else(|| unknown_unit(span, number, suffix))?),
    };
    let digits = number.replace('_', "");
    if unit.is_none() && digits.bytes().all(|c| c.is_ascii_digit()) {
        return digits.parse().map(ExprKind::Int).map_err(|_| {
            let hint = format!("write '{digits}.0' for a real number");
            let error = Diagnostic::new(Code::BadNumber, span, "this whole number is too large");
            Box::new(error.suggest(hint, [Edit::after(span, ".0")]))
        });
    }
    match digits.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(ExprKind::Real(x, unit)),
        _ => Err(Box::new(Diagnostic::new(Code::BadNumber, span, "this number is too large"))),
    }
}

/// `1.5e-3mm` to `1.5e-3` and `mm`.
fn split_number(text: &str) -> (&str, &str) {
    let bytes = text.as_bytes();
    let digits = |from: usize| from + bytes[from..].iter().take_while(|c| c.is_ascii_digit() || **c == b'_').count();
    let mut end = digits(0);
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    // `_` belongs to the digits, so `3_mm` is `3_` and `mm`.
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        if bytes.get(end + 1 + sign).is_some_and(u8::is_ascii_digit) {
            end = digits(end + 1 + sign);
        }
    }
    text.split_at(end)
}

fn unit(suffix: &str) -> Option<Unit> {
    use Unit::*;
    [Mm, Cm, M, In, Deg, Rad, Turn].into_iter().find(|unit| unit.name() == suffix)
}

fn unknown_unit(span: Span, number: &str, suffix: &str) -> Box<Diagnostic> {
    let error = Diagnostic::new(Code::UnknownUnit, span, format!("'{suffix}' is not a unit"));
    let meant = match suffix {
        "°" | "degree" | "degrees" | "grad" | "degs" => Some(("deg", "degrees are written 'deg'")),
        "inch" | "inches" | "ins" => Some(("in", "inches are written 'in'")),
        "radian" | "radians" | "rads" => Some(("rad", "radians are written 'rad'")),
        "turns" | "rev" | "revs" => Some(("turn", "turns are written 'turn'")),
        "MM" | "Mm" | "mM" | "mms" => Some(("mm", "millimetres are written 'mm'")),
        "CM" | "Cm" | "cms" => Some(("cm", "centimetres are written 'cm'")),
        "M" | "meter" | "meters" | "metre" | "metres" => Some(("m", "metres are written 'm'")),
        "um" | "µm" | "μm" => Some(("e-3mm", "micrometres are written as thousandths of a millimetre")),
        "nm" => Some(("e-6mm", "nanometres are written as millionths of a millimetre")),
        _ => None,
    };
    let unit = Span { start: span.start + number.len() as u32, ..span };
    Box::new(match meant {
        Some((ours, why)) if !(ours.starts_with('e') && number.contains(['e', 'E'])) => {
            error.suggest(why, [Edit::replace(unit, ours)])
        }
        _ => error
            .hint(format!("the units are mm, cm, m, in, deg, rad and turn; for a product write '{number} * {suffix}'")),
    })
}

impl Unit {
    /// As it is written.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Unit::Mm => "mm",
            Unit::Cm => "cm",
            Unit::M => "m",
            Unit::In => "in",
            Unit::Deg => "deg",
            Unit::Rad => "rad",
            Unit::Turn => "turn",
        }
    }
}

/// The value of a text in its quotes.
pub(super) fn text(span: Span, quoted: &str, diagnostics: &mut Vec<Diagnostic>) -> String {
    let inner = quoted.strip_prefix('"').and_then(|t| t.strip_suffix('"')).unwrap_or(quoted);
    let mut out = String::with_capacity(inner.len());
    let mut chars = inner.char_indices();
    let mut wrong: Vec<Span> = Vec::new();
    while let Some((at, c)) = chars.next() {
        if c != '\\' {
            out.push(c);
            continue;
        }
        match chars.next() {
            Some((_, 'n')) => out.push('\n'),
            Some((_, 't')) => out.push('\t'),
            Some((_, c @ ('"' | '\\'))) => out.push(c),
            other => {
                let start = span.start + 1 + at as u32;
                let length = other.map_or(0, |o| o.1.len_utf8());
                wrong.push(Span { start, end: start + 1 + length as u32, ..span });
            }
        }
    }
    if let Some(first) = wrong.first() {
        let at = (first.start - span.start) as usize;
        let shown = &quoted[at..at + (first.end - first.start) as usize];
        let edits = wrong.iter().map(|s| Edit::before(*s, "\\"));
        diagnostics.push(
            Diagnostic::new(Code::UnknownEscape, *first, format!("'{shown}' is not an escape sequence"))
                .suggest(r"write '\\' for a backslash; in a path, '/' works everywhere", edits),
        );
    }
    out
}

/// The text of `///` lines without the slashes and the space after them.
pub(crate) fn doc(text: &str) -> String {
    // A semicolon may stand before a comment.
    let begins = |c: char| c == ';' || c.is_whitespace();
    let lines = text.lines().filter_map(|line| line.trim_start_matches(begins).strip_prefix("///"));
    let lines = lines.map(|line| line.strip_prefix(' ').unwrap_or(line).trim_end());
    lines.collect::<Vec<_>>().join("\n")
}
