//! How much of a surface, and of a scan, agrees with the other: by one threshold in every sentence that says so.

use super::tolerance::{Conformance, Tolerance};
use serde::{Deserialize, Serialize};

/// Where a part has no tolerance, a deviation within so many standard deviations of the scan's noise agrees: of noise
/// alone 99.7 % does, so that what is left are deviations.
pub const NOISE_FACTOR: f64 = 3.0;

/// What limits follow from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LimitsBasis {
    /// The part's tolerance.
    Tolerance,
    /// The scan's noise.
    Noise,
}

/// The signed distances that agree, in millimetres, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// The least.
    pub lower: f64,
    /// The greatest.
    pub upper: f64,
    /// What they follow from.
    pub basis: LimitsBasis,
}

impl Limits {
    /// The tolerance of a part, or else [`NOISE_FACTOR`] times the `noise` of the scan, in millimetres.
    #[must_use]
    pub fn new(tolerance: Option<Tolerance>, noise: f64) -> Self {
        match tolerance {
            Some(Tolerance { lower, upper }) => Self { lower, upper, basis: LimitsBasis::Tolerance },
            None => {
                let upper = NOISE_FACTOR * noise;
                Self { lower: 0.0 - upper, upper, basis: LimitsBasis::Noise }
            }
        }
    }

    /// The ends alone.
    pub(super) fn ends(self) -> Tolerance {
        Tolerance { lower: self.lower, upper: self.upper }
    }
}

/// The measured surface by its agreement with the scan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// The limits; absent if parts with different ones are taken together.
    #[serde(flatten)]
    pub limits: Option<Limits>,
    /// Within the limits.
    pub within: Portion,
    /// Above them: the scan lies outside, the object has too much material.
    pub over: Portion,
    /// Below them: the scan lies inside, the object has too little material.
    pub under: Portion,
}

/// A piece of the measured surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Portion {
    /// Its area. Square millimetres.
    pub area: f64,
    /// `area` divided by the measured area; 0 if there is none.
    pub share: f64,
    /// Its texels.
    pub texels: usize,
}

impl Agreement {
    /// From the conformance to the limits.
    pub(super) fn new(limits: Limits, c: &Conformance) -> Self {
        let portion = |area, texels| Portion { area, share: 0.0, texels };
        let [within, over, under] = [
            portion(c.area_within, c.texels_within),
            portion(c.area_above, c.texels_above),
            portion(c.area_below, c.texels_below),
        ];
        Self { limits: Some(limits), within, over, under }.with_shares()
    }

    /// The sum over parts; none if there are none.
    pub(super) fn together<'a>(parts: impl Iterator<Item = &'a Agreement>) -> Option<Self> {
        let add = |a: Portion, b: Portion| Portion { area: a.area + b.area, share: 0.0, texels: a.texels + b.texels };
        let sum = parts.copied().reduce(|a, b| Self {
            limits: a.limits.filter(|_| a.limits == b.limits),
            within: add(a.within, b.within),
            over: add(a.over, b.over),
            under: add(a.under, b.under),
        });
        sum.map(Self::with_shares)
    }

    fn with_shares(self) -> Self {
        let area = self.within.area + self.over.area + self.under.area;
        let share = |p: Portion| Portion { share: if area > 0.0 { p.area / area } else { 0.0 }, ..p };
        Self { limits: self.limits, within: share(self.within), over: share(self.over), under: share(self.under) }
    }
}

/// Points of the scan by their agreement with the surface: those that have a distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointAgreement {
    /// The number within the limits of the part whose surface is the nearest.
    pub within: usize,
    /// The number above them: outside.
    pub over: usize,
    /// The number below them: inside.
    pub under: usize,
}

impl PointAgreement {
    /// Of signed distances, in millimetres, each with its limits; `precision` is their rounding.
    pub(super) fn of(distances: impl Iterator<Item = (f64, Limits)>, precision: f64) -> Self {
        let mut counts = Self::default();
        for (distance, Limits { lower, upper, .. }) in distances {
            *match distance {
                d if d > upper + precision => &mut counts.over,
                d if d < lower - precision => &mut counts.under,
                _ => &mut counts.within,
            } += 1;
        }
        counts
    }
}

/// The limits of parts, in words: `0.15 mm (3 times the scan's noise)`, `-0.1 to 0.2 mm (the tolerance)`. `number`
/// writes a figure.
pub(super) fn described(limits: impl Iterator<Item = Limits>, number: impl Fn(f64) -> String) -> String {
    let mut distinct: Vec<Limits> = Vec::new();
    limits.for_each(|l| {
        if !distinct.contains(&l) {
            distinct.push(l);
        }
    });
    let ends = |l: &Limits| match l.lower == 0.0 - l.upper {
        true => format!("{} mm", number(l.upper)),
        false => format!("{} to {} mm", number(l.lower), number(l.upper)),
    };
    let of_noise = format!("{NOISE_FACTOR} times the scan's noise");
    let (tolerances, noise): (Vec<Limits>, Vec<Limits>) =
        distinct.into_iter().partition(|l| l.basis == LimitsBasis::Tolerance);
    match (tolerances.as_slice(), noise.as_slice()) {
        ([], []) => String::new(),
        ([], [noise, ..]) => format!("{} ({of_noise})", ends(noise)),
        ([one], []) => format!("{} (the tolerance)", ends(one)),
        (_, []) => "the tolerance of its part".to_owned(),
        (_, [noise, ..]) => {
            format!("the tolerance of its part, or else {} ({of_noise})", ends(noise))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_the_tolerance_or_else_the_noises() {
        let tolerance = Tolerance { lower: -0.1, upper: 0.2 };
        assert_eq!(Limits::new(Some(tolerance), 5.0).ends(), tolerance);
        let by_noise = Limits::new(None, 0.05);
        assert!((by_noise.upper - 0.15).abs() < 1e-15 && by_noise.lower == -by_noise.upper);
        assert_eq!(by_noise.basis, LimitsBasis::Noise);
    }

    #[test]
    fn limits_are_named_once() {
        let noise = Limits::new(None, 0.05);
        let wide = Limits::new(Some(Tolerance { lower: -0.1, upper: 0.2 }), 0.05);
        let even = Limits::new(Some(Tolerance { lower: -0.3, upper: 0.3 }), 0.05);
        let said = |limits: &[Limits]| described(limits.iter().copied(), |x| format!("{x:.2}"));
        assert_eq!(said(&[noise, noise]), "0.15 mm (3 times the scan's noise)");
        assert_eq!(said(&[wide]), "-0.10 to 0.20 mm (the tolerance)");
        assert_eq!(said(&[even, even]), "0.30 mm (the tolerance)");
        assert_eq!(said(&[even, wide]), "the tolerance of its part");
        let mixed = "the tolerance of its part, or else 0.15 mm (3 times the scan's noise)";
        assert_eq!(said(&[even, noise]), mixed);
        assert_eq!(said(&[]), "");
    }

    #[test]
    fn points_are_counted_by_the_limits_of_their_parts() {
        let narrow = Limits::new(Some(Tolerance { lower: -0.1, upper: 0.1 }), 0.0);
        let wide = Limits::new(Some(Tolerance { lower: -1.0, upper: 1.0 }), 0.0);
        let points = [(0.5, narrow), (0.5, wide), (-0.1, narrow), (-0.2, narrow), (-0.2, wide)];
        let counted = PointAgreement::of(points.into_iter(), 0.0);
        assert_eq!(counted, PointAgreement { within: 3, over: 1, under: 1 });
        let rounded = PointAgreement::of(std::iter::once((0.1 + 1e-9, narrow)), 1e-8);
        assert_eq!(rounded.within, 1);
    }
}
