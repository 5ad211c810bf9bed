//! Plain tables with aligned columns, and numbers with as many digits as mean something.

/// The most decimals of a number whose uncertainty is not known: a tenth of a micrometre.
const DECIMALS: usize = 4;

/// The most significant digits of such a number, but for whole ones.
const DIGITS: usize = 5;

/// The most decimals of any number.
const MOST_DECIMALS: i32 = 9;

/// A number whose uncertainty is not known: at most five significant digits and four decimals, an exponent for what is
/// very small or large, a dash if it is not finite.
pub(crate) fn number(x: f64) -> String {
    let size = x.abs();
    if !x.is_finite() {
        return "-".into();
    }
    if x != 0.0 && !(1e-4..1e7).contains(&size) {
        return format!("{x:.4e}");
    }
    let whole = if size < 1.0 { 1 } else { size.log10().floor() as usize + 1 };
    let decimals = DIGITS.saturating_sub(whole).min(DECIMALS);
    format!("{x:.decimals$}")
}

/// A coordinate of a place: far from the origin, as those of surveys are, it has hundredths of a millimetre all the
/// same.
pub(crate) fn coordinate(x: f64) -> String {
    if x.is_finite() && (1e4..1e12).contains(&x.abs()) { format!("{x:.2}") } else { number(x) }
}

/// A place whose coordinates are in millimetres, without what is only rounding.
pub(crate) fn place(at: [f64; 3]) -> String {
    let [x, y, z] = at.map(|c| coordinate((c * 1e4).round() / 1e4 + 0.0));
    format!("({x}, {y}, {z}) mm")
}

/// A number whose standard uncertainty is known: with as many decimals as leave two significant digits of that. Without
/// one it is any other number.
pub(crate) fn rounded(x: f64, uncertainty: Option<f64>) -> String {
    match uncertainty.filter(|sd| *sd > 0.0 && sd.is_finite() && x.is_finite()) {
        Some(sd) => {
            // 0.0996 has two digits as 0.10.
            let place = (sd * 1.005).log10().floor() as i32;
            let decimals = (1 - place).clamp(0, MOST_DECIMALS) as usize;
            format!("{x:.decimals$}")
        }
        None => number(x),
    }
}

/// Lays rows out in columns two spaces apart; columns of numbers are aligned at their decimal points.
pub(crate) fn render(headings: &[&str], rows: &[Vec<String>]) -> String {
    let columns = headings.len();
    let numeric = |c: usize| {
        let mut cells = rows.iter().map(|r| r[c].as_str()).filter(|t| !t.is_empty()).peekable();
        cells.peek().is_some() && cells.all(|t| t.trim_end_matches([' ', '%']).parse::<f64>().is_ok())
    };
    let right: Vec<bool> = (0..columns).map(numeric).collect();
    let aligned: Vec<Vec<String>> = (0..columns).map(|c| column(rows, c, right[c])).collect();
    let width =
        |c: usize| aligned[c].iter().map(|t| t.chars().count()).chain([headings[c].chars().count()]).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let text: Vec<String> = cells
            .enumerate()
            .map(|(c, t)| if right[c] { format!("{t:>0$}", widths[c]) } else { format!("{t:<0$}", widths[c]) })
            .collect();
        format!("{}\n", text.join("  ").trim_end())
    };
    let mut out = line(&mut headings.iter().copied());
    for row in 0..rows.len() {
        out.push_str(&line(&mut aligned.iter().map(|column| column[row].as_str())));
    }
    out
}

/// The cells of a column; numbers have as many spaces behind them as others have decimals more.
fn column(rows: &[Vec<String>], column: usize, is_numeric: bool) -> Vec<String> {
    let cells = rows.iter().map(|row| row[column].as_str());
    let behind = |t: &str| t.find('.').map_or(0, |point| t.len() - point);
    let most = if is_numeric { cells.clone().map(behind).max().unwrap_or(0) } else { 0 };
    cells.map(|t| if is_numeric { format!("{t}{}", " ".repeat(most - behind(t))) } else { t.to_owned() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_that_mean_something() {
        for (x, expected) in [
            (43_215.572_3, "43216"),
            (1_234.567_8, "1234.6"),
            (12.345_678, "12.346"),
            (-1.234_567, "-1.2346"),
            (0.012_345_6, "0.0123"),
            (0.0, "0.0000"),
            (1.5e-7, "1.5000e-7"),
            (2.5e7, "2.5000e7"),
            (f64::NAN, "-"),
        ] {
            assert_eq!(number(x), expected);
        }
        assert_eq!([4_918_339_990.977_2, -28.656, 0.0].map(coordinate), ["4918339990.98", "-28.656", "0.0000"]);
        for (x, sd, expected) in [
            (1_234.567_89, Some(0.0123), "1234.568"),
            (1_234.567_89, Some(0.0998), "1234.57"),
            (0.0123, Some(0.0123), "0.012"),
            (1_234.567_89, Some(45.0), "1235"),
            (20.25, Some(0.0), "20.250"),
            (20.25, None, "20.250"),
            (20.25, Some(1e-14), "20.250000000"),
        ] {
            assert_eq!(rounded(x, sd), expected, "{x} {sd:?}");
        }
    }

    #[test]
    fn numbers_are_aligned_at_their_points_and_words_to_the_left() {
        let rows = vec![vec!["a".into(), "1.0".into()], vec!["long".into(), "-10.25".into()]];
        assert_eq!(render(&["name", "value"], &rows), "name   value\na       1.0\nlong  -10.25\n");
    }
}
