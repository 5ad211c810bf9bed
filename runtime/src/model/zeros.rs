//! Zeros of functions between places of different sign, of many at once: every step evaluates all of them together.

/// A stretch at whose ends a function has values of different sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bracket {
    pub(crate) from: f64,
    /// Above `from`.
    pub(crate) to: f64,
    /// The values at both ends: one of them is positive, and the other is not.
    pub(crate) values: [f64; 2],
}

impl Bracket {
    pub(crate) fn middle(&self) -> f64 {
        0.5 * (self.from + self.to)
    }

    fn width(&self) -> f64 {
        self.to - self.from
    }

    /// Where the function is asked next: where a straight line between both values is zero, drawn towards the middle so
    /// that neither end stays, by `least` or more, and no farther from it than `most`. `whole` is the width at first.
    fn next(&self, least: f64, most: f64, whole: f64) -> f64 {
        /// The way by which the place is drawn in the first step, as a part of the width; later of its square.
        const DRAWN: f64 = 0.2;
        let [a, b] = self.values;
        let (middle, width) = (self.middle(), self.width());
        let straight = (b * self.from - a * self.to) / (b - a);
        let away = middle - straight;
        let drawn = (DRAWN * width * (width / whole)).max(least);
        let next = if drawn <= away.abs() { straight + drawn.copysign(away) } else { middle };
        let next = if (next - middle).abs() <= most { next } else { middle - most.copysign(away) };
        if next > self.from && next < self.to { next } else { middle }
    }
}

/// Narrows brackets until none is wider than `width`, by the method of Oliveira and Takahashi (An Enhancement of the
/// Bisection Method Average Performance Preserving Minmax Optimality, ACM Transactions on Mathematical Software 47(1),
/// 2020): it takes at most one step more than bisection, and where a function is smooth a quarter of them. `values`
/// evaluates some of the brackets, by their indices, at a place each.
///
/// # Errors
/// Those of `values`.
pub(crate) fn narrow<E>(
    brackets: &mut [Bracket],
    width: f64,
    mut values: impl FnMut(&[usize], &[f64]) -> Result<Vec<f64>, E>,
) -> Result<(), E> {
    let whole: Vec<f64> = brackets.iter().map(Bracket::width).collect();
    let halvings = |k: usize| (whole[k] / width).log2().ceil().max(0.0);
    let mut wide: Vec<usize> = (0..brackets.len()).filter(|k| whole[*k] > width).collect();
    for step in 0.. {
        if wide.is_empty() {
            break;
        }
        let next = |k: &usize| {
            let left = halvings(*k) + 1.0 - f64::from(step);
            let most = 0.5 * (width * left.exp2() - brackets[*k].width());
            brackets[*k].next(0.5 * width, most.max(0.0), whole[*k])
        };
        let places: Vec<f64> = wide.iter().map(next).collect();
        for ((k, place), value) in wide.iter().zip(&places).zip(values(&wide, &places)?) {
            let bracket = &mut brackets[*k];
            if (value > 0.0) == (bracket.values[0] > 0.0) {
                (bracket.from, bracket.values[0]) = (*place, value);
            } else {
                (bracket.to, bracket.values[1]) = (*place, value);
            }
        }
        // Between adjacent numbers there is no other one.
        wide.retain(|k| {
            let bracket = &brackets[*k];
            bracket.width() > width && bracket.middle() > bracket.from && bracket.middle() < bracket.to
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// The zeros of functions between 0 and 1, and how often they were evaluated.
    fn zeros(functions: &[&dyn Fn(f64) -> f64], width: f64) -> (Vec<Bracket>, Vec<usize>) {
        let mut counts = vec![0; functions.len()];
        let mut brackets: Vec<Bracket> =
            functions.iter().map(|f| Bracket { from: 0.0, to: 1.0, values: [f(0.0), f(1.0)] }).collect();
        let values = |which: &[usize], at: &[f64]| -> Result<Vec<f64>, Infallible> {
            which.iter().for_each(|k| counts[*k] += 1);
            Ok(which.iter().zip(at).map(|(k, at)| functions[*k](*at)).collect())
        };
        narrow(&mut brackets, width, values).expect("it does not fail");
        (brackets, counts)
    }

    #[test]
    fn zeros_are_found_in_few_steps() {
        let functions: [(&dyn Fn(f64) -> f64, f64); 4] = [
            (&|t| t - 0.3, 0.3),
            (&|t| 0.09 - t * t, 0.3),
            (&|t: f64| t.powi(3) - 0.2, 0.2_f64.cbrt()),
            (&|t: f64| (3.0 * t).exp() - 2.0, 2.0_f64.ln() / 3.0),
        ];
        let (found, counts) = zeros(&functions.map(|(f, _)| f), 1e-15);
        for ((bracket, (f, zero)), count) in found.iter().zip(functions).zip(counts) {
            assert!(
                bracket.to - bracket.from <= 1e-15 && (bracket.middle() - zero).abs() < 2e-15,
                "{bracket:?}, {zero}"
            );
            assert!((f(bracket.from) > 0.0) != (f(bracket.to) > 0.0) && count <= 14, "{bracket:?} by {count}");
        }
    }

    /// Beside what coincides a function is level; where its sign is all that it says, bisection is the limit.
    #[test]
    fn no_function_takes_more_than_a_step_beyond_bisection() {
        let functions: [&dyn Fn(f64) -> f64; 5] = [
            &|t| if t < 0.7 { 5.0 } else { -1e-6 },
            &|t| if t < 1e-7 { -1e-6 } else { t },
            &|t| (t - 0.2).powi(9),
            &|t| if t < 0.4 { f64::NAN } else { 1.0 },
            &|t| if t < 0.9 { -1e300 } else { 1e300 },
        ];
        let (found, counts) = zeros(&functions, 1e-12);
        for ((bracket, f), count) in found.iter().zip(functions).zip(counts) {
            assert!((f(bracket.from) > 0.0) != (f(bracket.to) > 0.0), "{bracket:?}");
            // Forty halvings, one more, and one for rounding.
            assert!(bracket.to - bracket.from <= 1e-12 && count <= 42, "{bracket:?} by {count}");
        }
    }

    #[test]
    fn what_is_narrow_is_left_and_adjacent_numbers_end_it() {
        let (found, counts) = zeros(&[&|t| t - 0.5], 2.0);
        assert_eq!((found[0].from, found[0].to, counts[0]), (0.0, 1.0, 0));
        let (found, _) = zeros(&[&|t| t - 1.0 / 3.0], 0.0);
        assert!(found[0].to - found[0].from <= f64::EPSILON, "{found:?}");
    }
}
