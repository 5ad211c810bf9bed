//! Numbers in decimal digits.

/// Powers of ten that doubles hold exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// The number that a text begins with, and the number of its bytes, as far as it has few enough digits for the short
/// way: an integer of up to 53 bits, times or divided by a power of ten that is exact, is rounded once and therefore
/// right (Clinger, 'How to read floating point numbers accurately', 1990). `mark` is the decimal mark.
#[inline]
pub(crate) fn leading(text: &[u8], mark: u8) -> Option<(f64, usize)> {
    let mut at = 0;
    let negative = match text.first()? {
        b'-' => true,
        b'+' => false,
        _ => {
            at = usize::MAX;
            false
        }
    };
    at = at.wrapping_add(1);
    let (mut integer, start) = (0_u64, at);
    while let Some(digit) = digit(text, at) {
        integer = integer.wrapping_mul(10).wrapping_add(digit);
        at += 1;
    }
    let (mut digits, mut decimals) = (at - start, 0);
    if text.get(at) == Some(&mark) {
        at += 1;
        let start = at;
        while let Some(digit) = digit(text, at) {
            integer = integer.wrapping_mul(10).wrapping_add(digit);
            at += 1;
        }
        decimals = at - start;
        digits += decimals;
    }
    // 19 digits do not overflow.
    if digits == 0 || digits > 19 || integer >= 1 << 53 {
        return None;
    }
    let (exponent, length) = exponent(&text[at..])?;
    let power = exponent - decimals as i32;
    let factor = *POWERS.get(power.unsigned_abs() as usize)?;
    let size = if power < 0 { integer as f64 / factor } else { integer as f64 * factor };
    Some((if negative { -size } else { size }, at + length))
}

#[inline]
fn digit(text: &[u8], at: usize) -> Option<u64> {
    let digit = text.get(at)?.wrapping_sub(b'0');
    (digit < 10).then_some(digit.into())
}

/// The exponent that a text begins with, and the number of its bytes; 0 and 0 where there is none.
#[inline]
fn exponent(text: &[u8]) -> Option<(i32, usize)> {
    if !matches!(text.first(), Some(b'e' | b'E')) {
        return Some((0, 0));
    }
    let negative = text.get(1) == Some(&b'-');
    let start = if negative || text.get(1) == Some(&b'+') { 2 } else { 1 };
    let (mut at, mut size) = (start, 0);
    while let Some(digit) = digit(text, at) {
        size = size * 10 + digit as i32;
        at += 1;
        // Too large for the short way.
        if at - start > 3 {
            return None;
        }
    }
    (at > start).then_some((if negative { -size } else { size }, at))
}

/// A text that is a number from end to end, `nan` and `inf` included. `mark` is the decimal mark.
pub(crate) fn number(text: &[u8], mark: u8) -> Option<f64> {
    if let Some((number, length)) = leading(text, mark)
        && length == text.len()
    {
        return Some(number);
    }
    let text = str::from_utf8(text).ok()?;
    if mark == b'.' {
        return text.parse().ok();
    }
    if text.contains('.') {
        return None;
    }
    text.replace(char::from(mark), ".").parse().ok()
}

/// Spellings of a number that is not there.
const MISSING: [&str; 12] =
    ["", "na", "n/a", "none", "null", "nan(ind)", "nan(snan)", "1.#qnan", "1.#ind", "1.#inf", "1.#snan", "#n/a"];

/// Whether a text says that there is no number.
pub(crate) fn missing(text: &[u8]) -> bool {
    let bare = text.strip_prefix(b"-").or_else(|| text.strip_prefix(b"+")).unwrap_or(text);
    // Microsoft's library pads: `1.#QNAN0`.
    let bare = if bare.starts_with(b"1.#") { bare.trim_ascii_end().strip_suffix(b"0").unwrap_or(bare) } else { bare };
    MISSING.iter().any(|known| bare.eq_ignore_ascii_case(known.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_standard_library() {
        let mut state = 1_u64;
        for round in 0..200_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let x = (state >> 11) as f64 / (1_u64 << 40) as f64 - 4000.0;
            let text = match round % 5 {
                0 => format!("{x}"),
                1 => format!("{x:.3}"),
                2 => format!("{x:+e}"),
                3 => format!("{:.0}", x * 1e9),
                _ => format!("{}", f64::from_bits(state)),
            };
            let (expected, found) = (text.parse::<f64>().unwrap(), number(text.as_bytes(), b'.').unwrap());
            assert!(expected.to_bits() == found.to_bits() || expected.is_nan() && found.is_nan(), "{text}");
            assert_eq!(number(text.replace('.', ",").as_bytes(), b',').map(f64::to_bits), Some(found.to_bits()));
        }
    }

    #[test]
    fn spellings() {
        let numbers = [
            ("1", 1.0),
            ("-1.", -1.0),
            (".5", 0.5),
            ("+3e2", 300.0),
            ("1E-05", 1e-5),
            ("12345678901234567890", 12_345_678_901_234_567_890.0),
            ("1e400", f64::INFINITY),
            ("00000000000000000000001.5", 1.5),
        ];
        for (text, expected) in numbers {
            assert_eq!(number(text.as_bytes(), b'.'), Some(expected), "{text}");
        }
        for text in ["", "-", ".", "1e", "1e+", "1.2.3", "1,5", "0x10", "1_000", "1 2", "e5", "--1"] {
            assert_eq!(number(text.as_bytes(), b'.'), None, "{text}");
        }
        assert_eq!(number(b"1.000,5", b','), None);
        assert!(number(b"-NaN", b'.').is_some_and(f64::is_nan));
        for text in ["-nan(ind)", "1.#QNAN", "-1.#IND0", "", "NULL"] {
            assert!(missing(text.as_bytes()), "{text}");
        }
        assert!(!missing(b"1.#") && !missing(b"x"));
        assert_eq!(leading(b"1.5e3,7", b'.'), Some((1500.0, 5)));
    }
}
