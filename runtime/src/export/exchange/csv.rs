//! Tables as CSV (RFC 4180): UTF-8, commas, lines that end with CR LF, a head of names.

/// A table that is being written.
pub(in crate::export) struct Table {
    text: String,
}

/// A cell of a table.
pub(in crate::export) enum Cell<'a> {
    /// A text, which may come from a user.
    Text(&'a str),
    /// A number in full precision; empty where it is not finite.
    Number(f64),
    /// A whole number.
    Count(usize),
    /// `true` or `false`.
    Flag(bool),
    /// Nothing.
    Empty,
}

impl Cell<'_> {
    /// A number, or nothing.
    pub(in crate::export) fn number(x: Option<f64>) -> Self {
        x.map_or(Self::Empty, Self::Number)
    }

    fn text(&self) -> String {
        match self {
            Self::Text(text) => quoted(&harmless(text)),
            Self::Number(x) if x.is_finite() => number(*x),
            Self::Number(_) | Self::Empty => String::new(),
            Self::Count(n) => n.to_string(),
            Self::Flag(flag) => flag.to_string(),
        }
    }
}

impl Table {
    /// A table with its head.
    pub(in crate::export) fn new<'a>(head: impl Iterator<Item = &'a str>) -> Self {
        let head: Vec<String> = head.map(quoted).collect();
        Self { text: head.join(",") + "\r\n" }
    }

    /// Adds a row of as many cells as the head has.
    pub(in crate::export) fn row<'a>(&mut self, cells: impl Iterator<Item = Cell<'a>>) {
        let cells: Vec<String> = cells.map(|cell| cell.text()).collect();
        self.text.push_str(&cells.join(","));
        self.text.push_str("\r\n");
    }

    /// All of it.
    pub(in crate::export) fn into_text(self) -> String {
        self.text
    }
}

/// The shortest text that reads as the same double.
fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".to_owned()
    } else if (1e-6..1e16).contains(&size) {
        x.to_string()
    } else {
        format!("{x:e}")
    }
}

/// A text that spreadsheets do not take for a formula: an apostrophe precedes what begins one.
fn harmless(text: &str) -> String {
    match text.starts_with(['=', '+', '-', '@', '\t', '\r', '\n']) {
        true => format!("'{text}"),
        false => text.to_owned(),
    }
}

/// A text in quotation marks, if it has what would end the cell.
fn quoted(text: &str) -> String {
    match text.contains([',', '"', '\r', '\n']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_those_of_rfc_4180_and_no_formulas() {
        let mut table = Table::new(["name", "width_mm"].into_iter());
        for (name, width) in [
            ("plain", 0.1 + 0.2),
            ("a, \"b\"\nc", -1.5e-9),
            ("=1+1", f64::NAN),
            ("@x", 1e300),
            ("+x", -0.0),
            ("-x", 42.0),
            ("", -0.25),
        ] {
            table.row([Cell::Text(name), Cell::Number(width)].into_iter());
        }
        let expected = "name,width_mm\r\nplain,0.30000000000000004\r\n\"a, \"\"b\"\"\nc\",-1.5e-9\r\n'=1+1,\r\n'@x,1e300\r\n'+x,0\r\n'-x,42\r\n,-0.25\r\n";
        assert_eq!(table.into_text(), expected);
    }

    #[test]
    fn numbers_keep_all_digits() {
        for x in [std::f64::consts::PI, 1e-6, 9.9999999e-7, 1e16, f64::MAX, f64::MIN_POSITIVE, -123_456.789] {
            assert_eq!(number(x).parse::<f64>().expect("a number"), x);
        }
    }
}
