//! Derivatives by finite differences.

/// A derivative along a line with a bound of its error; none if a kink or a jump is near, or if rounding errors are too
/// large.
pub(crate) type Slope = Option<(f64, f64)>;

/// Steps, from those at which truncation dominates to those at which rounding does.
const STEPS: [f64; 4] = [4e-3, 1e-3, 2e-4, 4e-5];

/// The derivatives of all values of `f` at 0 by central differences of fourth order: for each value at that step whose
/// halving changes the derivative least.
pub(crate) fn slopes(count: usize, mut f: impl FnMut(f64) -> Option<Vec<f64>>) -> Vec<Slope> {
    let mut best: Vec<Slope> = vec![None; count];
    for step in STEPS {
        let mut stencil = |h: f64| -> Option<Vec<f64>> {
            let at = [f(-2.0 * h)?, f(-h)?, f(h)?, f(2.0 * h)?];
            let slope = |k: usize| (at[0][k] - 8.0 * at[1][k] + 8.0 * at[2][k] - at[3][k]) / (12.0 * h);
            Some((0..count).map(slope).collect())
        };
        let (Some(coarse), Some(fine)) = (stencil(step), stencil(step / 2.0)) else { continue };
        for (k, slope) in best.iter_mut().enumerate() {
            let change = (coarse[k] - fine[k]).abs();
            if slope.is_none_or(|(_, known)| change < known) {
                *slope = Some((fine[k], change));
            }
        }
    }
    best.into_iter().map(|s| s.filter(|(slope, change)| *change <= 1e-6 * (1.0 + slope.abs()))).collect()
}
