//! The scale of colours of deviations, which all documents share.

use super::colormap::diverging;
use super::round_up;
use crate::variance::{Statistics, Tolerance, VarianceReport};

/// The number of steps of colour between a limit of the tolerance and the end of the scale.
pub const BANDS: u32 = 4;

/// A border of steps belongs to the inner one, whatever its binary fraction is. Steps.
const ROUNDING: f64 = 1e-9;

/// Deviations that are less are none. Millimetres.
const EXACT: f64 = 1e-9;

/// How many times the tolerance the scale ends at.
const TOLERANCES: f64 = 3.0;

/// The scale of colours: from `-end` to `end` millimetres, continuous; or, where there is a tolerance, neutral within
/// it and in steps beyond. docs/decisions/0058-colour-scale.md has the reasons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The deviation at which the scale ends, either way. Millimetres, positive.
    pub end: f64,
    /// The tolerance that the scale follows; its farther limit is nearer than the end.
    pub tolerance: Option<Tolerance>,
}

impl Scale {
    /// The scale for a measurement. It follows the tolerance that all parts which have one share, up to three times the
    /// farther limit; where there is none, the robust range of the deviations. `end`, in millimetres, is the user's: a
    /// tolerance that reaches as far is not followed, since all would be neutral.
    #[must_use]
    pub fn new(report: &VarianceReport, end: Option<f64>) -> Self {
        let tolerance = report.overall.tolerance.and_then(|conformance| conformance.tolerance);
        let tolerance = tolerance.filter(|t| farther(t) > 0.0);
        match (end, tolerance) {
            (Some(end), _) => Self { end, tolerance: tolerance.filter(|t| farther(t) < end) },
            (None, Some(t)) => Self { end: rounded(TOLERANCES * farther(&t)), tolerance },
            (None, None) => Self::robust(report),
        }
    }

    /// The scale over the robust range of the deviations.
    #[must_use]
    pub fn robust(report: &VarianceReport) -> Self {
        Self::continuous(robust_end(&report.overall, report.max_distance))
    }

    /// A scale without a tolerance, up to `end` millimetres.
    #[must_use]
    pub fn continuous(end: f64) -> Self {
        Self { end, tolerance: None }
    }

    /// The place of a deviation (millimetres) on the scale of colours, from -1 to 1; 0 is neutral. It is that of a
    /// step's darker end where the scale has steps. NaN for NaN.
    #[must_use]
    pub fn place(&self, deviation: f64) -> f64 {
        let Some(t) = self.tolerance else { return (deviation / self.end).clamp(-1.0, 1.0) };
        let (excess, sign) = if deviation > t.upper { (deviation - t.upper, 1.0) } else { (t.lower - deviation, -1.0) };
        if excess.is_nan() {
            return f64::NAN;
        }
        if excess <= 0.0 {
            return 0.0;
        }
        sign * (excess / self.step_beyond(&t) - ROUNDING).ceil().clamp(1.0, f64::from(BANDS)) / f64::from(BANDS)
    }

    /// The sRGB colour of a deviation in millimetres; for NaN the grey of no data.
    #[must_use]
    pub fn colour(&self, deviation: f64) -> [u8; 3] {
        diverging(self.place(deviation))
    }

    /// Deviations that a legend labels, in millimetres, ascending: the ends, zero, and the limits of the tolerance with
    /// the borders of steps halfway, or halves of the scale.
    #[must_use]
    pub fn ticks(&self) -> Vec<f64> {
        let Some(t) = self.tolerance else { return [-1.0, -0.5, 0.0, 0.5, 1.0].map(|tick| tick * self.end).to_vec() };
        let halfway = self.step_beyond(&t) * f64::from(BANDS / 2);
        let mut ticks = vec![-self.end, t.lower - halfway, t.lower, 0.0, t.upper, t.upper + halfway, self.end];
        ticks.sort_by(f64::total_cmp);
        ticks.dedup();
        ticks
    }

    /// Whether a tick goes before others where not all labels have room: the ends, and the limits or zero.
    #[must_use]
    pub fn is_main(&self, tick: f64) -> bool {
        tick.abs() == self.end || self.tolerance.map_or(tick == 0.0, |t| tick == t.lower || tick == t.upper)
    }

    /// Which deviations are neutral, for the head of a file; nothing on a continuous scale.
    pub(super) fn neutral(&self) -> String {
        self.tolerance.map_or_else(String::new, |t| {
            format!(", are neutral from {} to {} mm, and have {BANDS} steps beyond", t.lower, t.upper)
        })
    }

    /// The width of a step beyond the tolerance, equal on both sides, so that one colour says how far beyond the limit
    /// a deviation is. Millimetres.
    pub(super) fn step_beyond(&self, tolerance: &Tolerance) -> f64 {
        (self.end - farther(tolerance)) / f64::from(BANDS)
    }
}

/// The distance of the farther limit from zero. Millimetres.
fn farther(tolerance: &Tolerance) -> f64 {
    tolerance.lower.abs().max(tolerance.upper.abs())
}

/// The robust range of deviations: the 95th percentile of the unsigned distances, rounded up to 1, 2 or 5 times a power
/// of ten; the largest of them where less than a twentieth of the surface deviates at all, and the maximum distance
/// where nothing was measured or everything is exact.
fn robust_end(statistics: &Statistics, max_distance: f64) -> f64 {
    let [p95, largest] = [statistics.weighted.percentiles.p95, statistics.weighted.max];
    match [p95, largest].into_iter().find(|end| *end >= EXACT) {
        Some(end) => round_up(end).min(max_distance),
        None => max_distance,
    }
}

/// A length without the digits that binary fractions add, such as those of 3 times 0.6.
fn rounded(length: f64) -> f64 {
    format!("{length:.12e}").parse().unwrap_or(length)
}

#[cfg(test)]
mod tests {
    use super::{BANDS, Scale};
    use crate::export::colormap::{NO_DATA, diverging};
    use crate::model::Texels;
    use crate::scan::ScanSource;
    use crate::variance::{Deviations, Tolerance, VarianceReport};

    fn report(tolerances: &[Option<Tolerance>]) -> VarianceReport {
        let texels = Texels {
            width: 2,
            height: 1,
            index: vec![0, 1],
            part: vec![0, 1],
            position: vec![[0.0; 3]; 2],
            normal: vec![[0.0, 0.0, 1.0]; 2],
            area: vec![1.0; 2],
            side: vec![1.0; 2],
            part_names: vec!["a".to_owned(), "b".to_owned()],
        };
        let deviations = Deviations::new(texels, 10.0, vec![0.3, 0.4], vec![f32::NAN; 2]);
        VarianceReport::new(&deviations, &ScanSource::default(), "cpu", tolerances)
    }

    fn tolerance(lower: f64, upper: f64) -> Option<Tolerance> {
        Some(Tolerance { lower, upper })
    }

    #[test]
    fn without_a_tolerance_the_range_is_robust() {
        let scale = Scale::new(&report(&[None, None]), None);
        assert_eq!(scale, Scale::continuous(0.5), "the next of 1, 2 and 5 above 0.4");
        assert_eq!(scale.colour(0.25), diverging(0.5));
        assert_eq!(scale.ticks(), [-0.5, -0.25, 0.0, 0.25, 0.5]);
        assert_eq!(scale.colour(f64::NAN), NO_DATA);
        let differing = report(&[tolerance(-0.1, 0.1), tolerance(-0.2, 0.2)]);
        assert_eq!(Scale::new(&differing, None), scale, "no tolerance is that of all");
        assert_eq!(Scale::new(&report(&[tolerance(0.0, 0.0), None]), None), scale, "nothing is three times nothing");
    }

    #[test]
    fn a_tolerance_is_neutral_and_steps_lie_beyond() {
        let scale = Scale::new(&report(&[tolerance(-0.5, 0.5), None]), None);
        assert_eq!(scale.end, 1.5);
        // Steps of a quarter of 1.5 - 0.5.
        let places = [0.0, 0.5, 0.51, 0.75, 0.76, 1.5, 9.0, -0.5, -0.6].map(|d| scale.place(d));
        assert_eq!(places, [0.0, 0.0, 0.25, 0.25, 0.5, 1.0, 1.0, 0.0, -0.25]);
        assert_eq!(scale.ticks(), [-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5]);
        assert!(scale.place(f64::NAN).is_nan());
        let colours: std::collections::HashSet<[u8; 3]> =
            (-2000..2000).map(|i| scale.colour(f64::from(i) / 1000.0)).collect();
        assert_eq!(colours.len(), 2 * BANDS as usize + 1);
    }

    /// One colour says how far beyond its limit a deviation is, on whichever side.
    #[test]
    fn the_narrower_side_has_the_same_steps() {
        let scale = Scale::new(&report(&[tolerance(-0.1, 0.3), None]), None);
        assert!((scale.end - 0.9).abs() < 1e-12);
        for excess in [-0.05, 0.01, 0.2, 0.4, 0.59] {
            assert_eq!(scale.place(0.3 + excess), -scale.place(-0.1 - excess), "{excess}");
        }
        let above = Scale::new(&report(&[tolerance(0.1, 0.3), None]), None);
        assert_eq!([0.2, 0.0].map(|d| above.place(d)), [0.0, -0.25], "zero is below a tolerance that lies above it");
    }

    #[test]
    fn the_users_end_goes_before() {
        assert_eq!(Scale::new(&report(&[None, None]), Some(2.0)), Scale::continuous(2.0));
        let followed = Scale::new(&report(&[tolerance(-0.5, 0.5), None]), Some(2.5));
        assert_eq!([1.0, 1.1].map(|d| followed.place(d)), [0.25, 0.5]);
        assert_eq!(Scale::new(&report(&[tolerance(-0.5, 0.5), None]), Some(0.5)), Scale::continuous(0.5));
    }
}
