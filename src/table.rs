//! Plain tables with aligned columns.

pub(crate) use gml_runtime::export::number;

/// Lays rows out in columns two spaces apart; columns of numbers are aligned to the right.
pub(crate) fn render(headings: &[&str], rows: &[Vec<String>]) -> String {
    let columns = headings.len();
    let width =
        |c: usize| rows.iter().map(|r| r[c].chars().count()).chain([headings[c].chars().count()]).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let numeric = |c: usize| {
        let mut cells = rows.iter().map(|r| r[c].as_str()).filter(|t| !t.is_empty()).peekable();
        cells.peek().is_some() && cells.all(|t| t.trim_end_matches([' ', '%']).parse::<f64>().is_ok())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_set_to_the_right_and_words_to_the_left() {
        let rows = vec![vec!["a".into(), "1.0".into()], vec!["long".into(), "-10.25".into()]];
        assert_eq!(render(&["name", "value"], &rows), "name   value\na        1.0\nlong  -10.25\n");
    }
}
