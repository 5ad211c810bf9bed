//! Derivatives by differences.

/// A derivative along a line and how far it may be off; nothing where a kink or a jump is near, or where rounding is
/// too large.
pub(crate) type Slope = Option<(f64, f64)>;

/// From where truncation rules to where rounding does.
const STEPS: [f64; 4] = [4e-3, 1e-3, 2e-4, 4e-5];

/// The derivatives of all values of `f` at 0 by central differences of fourth order: for each value at the step of
/// those at which halving it changes least.
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
