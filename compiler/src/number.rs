//! Numbers in messages.

/// The shortest digits that read back as the same number: with an exponent where there would be many zeros.
#[must_use]
pub fn plain(x: f64) -> String {
    if x == 0.0 || !x.is_finite() || (1e-5..1e16).contains(&x.abs()) { format!("{x}") } else { format!("{x:e}") }
}

#[cfg(test)]
mod tests {
    use super::plain;

    #[test]
    fn numbers_are_short_and_read_back() {
        for (x, text) in
            [(42.0, "42"), (-0.5, "-0.5"), (1e300, "1e300"), (-2.5e-9, "-2.5e-9"), (1e15, "1000000000000000")]
        {
            assert_eq!((plain(x).as_str(), plain(x).parse()), (text, Ok(x)));
        }
        assert_eq!((plain(0.0).as_str(), plain(f64::INFINITY).as_str()), ("0", "inf"));
        assert!([f64::MAX, f64::MIN_POSITIVE, 5e-324].into_iter().all(|x| plain(x).len() < 25));
    }
}
