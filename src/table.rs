//! Plain tables with aligned columns.

/// Lays rows out in columns two spaces apart; columns whose cells (but for the heading) are numbers are set to the right.
pub(crate) fn render(headings: &[&str], rows: &[Vec<String>]) -> String {
    let columns = headings.len();
    let width =
        |c: usize| rows.iter().map(|r| r[c].chars().count()).chain([headings[c].chars().count()]).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let numeric = |c: usize| {
        let mut filled = rows.iter().map(|r| r[c].as_str()).filter(|t| !t.is_empty()).peekable();
        filled.peek().is_some() && filled.all(|t| t.trim_end_matches([' ', '%']).parse::<f64>().is_ok())
    };
    let right: Vec<bool> = (0..columns).map(numeric).collect();
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let text: Vec<String> = cells
            .enumerate()
            .map(|(c, t)| if right[c] { format!("{t:>0$}", widths[c]) } else { format!("{t:<0$}", widths[c]) })
            .collect();
        format!("{}\n", text.join("  ").trim_end())
    };
    let mut out = line(&mut headings.iter().copied());
    for row in rows {
        out.push_str(&line(&mut row.iter().map(String::as_str)));
    }
    out
}

/// A number with as many digits as a reader wants: four after the point for everyday sizes, exponents for others.
pub(crate) fn number(x: f64) -> String {
    if !x.is_finite() {
        return "-".into();
    }
    if x == 0.0 || (1e-4..1e7).contains(&x.abs()) { format!("{x:.4}") } else { format!("{x:.4e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_set_to_the_right_and_words_to_the_left() {
        let rows = vec![vec!["a".into(), "1.0".into()], vec!["long".into(), "-10.25".into()]];
        assert_eq!(render(&["name", "value"], &rows), "name   value\na        1.0\nlong  -10.25\n");
    }
}
