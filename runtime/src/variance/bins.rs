//! Bins of values on a scale that is logarithmic on both sides of zero, and the weights in them.

/// Bins by a value's sign, exponent and first digits.
pub(super) struct Bins {
    /// Magnitudes whose bits are below this share a bin.
    least: u32,
    /// How many of a magnitude's bits do not count.
    shift: u32,
    /// Bins of one sign.
    half: usize,
}

/// Powers of two below the reach that are told apart, and above it.
const BELOW: i32 = 16;
const ABOVE: u32 = 1;

impl Bins {
    /// For values of magnitudes up to `reach`; finer for many of them.
    pub(super) fn up_to(reach: f64, many: bool) -> Bins {
        // Single precision has 23 digits behind the first: seven of them, or for few values three.
        let shift = if many { 16 } else { 20 };
        let least = ((reach as f32) * 2f32.powi(-BELOW)).max(f32::MIN_POSITIVE).to_bits() >> shift << shift;
        let half = ((BELOW as usize + ABOVE as usize) << (23 - shift)) + 1;
        Bins { least, shift, half }
    }

    pub(super) fn count(&self) -> usize {
        2 * self.half
    }

    /// Larger values are in the same or in later bins.
    #[inline(always)]
    pub(super) fn of(&self, value: f32) -> usize {
        let place = (value.abs().to_bits().saturating_sub(self.least) >> self.shift) as usize;
        let place = place.min(self.half - 1);
        if value < 0.0 { self.half - 1 - place } else { self.half + place }
    }

    /// The bin of the same magnitudes with the other sign.
    pub(super) fn mirrored(&self, bin: usize) -> usize {
        2 * self.half - 1 - bin
    }
}

/// How much is in each bin.
pub(super) struct Weights {
    each: Vec<f64>,
    /// The weight before each bin, and that of all.
    before: Vec<f64>,
    /// Bins that are not empty.
    occupied: Vec<usize>,
}

/// A median's neighbourhood holds at least this share of the weight up to it, on both sides.
const AROUND: f64 = 0.004;

impl Weights {
    pub(super) fn new(each: Vec<f64>) -> Weights {
        let mut before = vec![0.0];
        let mut total = 0.0;
        for weight in &each {
            total += weight;
            before.push(total);
        }
        let occupied = (0..each.len()).filter(|b| each[*b] > 0.0).collect();
        Weights { each, before, occupied }
    }

    /// Of the values' magnitudes.
    pub(super) fn folded(&self) -> Weights {
        let half = self.each.len() / 2;
        let fold = |b: usize| if b < half { 0.0 } else { self.each[b] + self.each[2 * half - 1 - b] };
        Weights::new((0..self.each.len()).map(fold).collect())
    }

    pub(super) fn total(&self) -> f64 {
        self.before[self.each.len()]
    }

    pub(super) fn before(&self, bin: usize) -> f64 {
        self.before[bin]
    }

    /// In some bins that follow each other.
    pub(super) fn between(&self, bins: std::ops::Range<usize>) -> f64 {
        if bins.is_empty() { 0.0 } else { self.before[bins.end] - self.before[bins.start] }
    }

    /// The first of the bins that hold the quantile below which `goal` lies and the values on both sides of it.
    pub(super) fn first_around(&self, goal: f64) -> usize {
        self.place(goal).checked_sub(1).or(Some(0)).and_then(|k| self.occupied.get(k)).copied().unwrap_or(0)
    }

    /// Names these bins, for some shares of the weight.
    pub(super) fn bins_around(&self, shares: &[f64], mut needed: impl FnMut(usize)) {
        for share in shares {
            let here = self.place(share * self.total());
            let end = (here + 2).min(self.occupied.len());
            self.occupied[here.saturating_sub(1).min(end)..end].iter().for_each(|b| needed(*b));
        }
    }

    /// Among the bins that are not empty the first up to whose end `goal` lies.
    fn place(&self, goal: f64) -> usize {
        let here = self.occupied.partition_point(|b| self.before[b + 1] < goal);
        here.min(self.occupied.len().saturating_sub(1))
    }

    /// Between which distances from `center` half of the weight is reached.
    pub(super) fn around(&self, bins: &Bins, center: f64) -> (f64, f64) {
        let goal = 0.5 * self.total();
        let ends = |t: f64| [bins.of((center - t) as f32), bins.of((center + t) as f32)];
        let at_most = |t: f64| {
            let [low, high] = ends(t);
            self.before[high + 1] - self.before[low]
        };
        let at_least = |t: f64| {
            let [low, high] = ends(t);
            self.before[high] - self.before[low + 1]
        };
        // Where the one becomes enough for certain, and where the other has not yet become enough.
        let bisect = |enough: &dyn Fn(f64) -> bool| {
            let (mut low, mut high) = (0.0, 4.0 * f64::from(f32::from_bits(bins.least)) * 2f64.powi(BELOW));
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if enough(middle) { high = middle } else { low = middle }
            }
            (low, high, enough(high))
        };
        let (low, ..) = bisect(&|t| at_most(t) >= (1.0 - AROUND) * goal);
        let (_, high, reached) = bisect(&|t| at_least(t) > (1.0 + AROUND) * goal);
        // A centre that is not a number is of no values.
        let low = if at_most(low) < goal { low } else { 0.0 };
        (low, if reached { high } else { f64::INFINITY })
    }
}

#[cfg(test)]
mod tests {
    use super::Bins;

    #[test]
    fn bins_ascend_with_the_values() {
        for many in [false, true] {
            let bins = Bins::up_to(3.0, many);
            let values: Vec<f32> = (-4000..4000).map(|i| (i as f32).powi(3) * 5e-11).collect();
            assert!(values.is_sorted_by_key(|x| bins.of(*x)));
            assert!([-1e30, -0.0, 0.0, 1e-30, 12.0, 1e30].iter().all(|x| bins.of(*x) < bins.count()));
            assert!(values.iter().filter(|x| **x != 0.0).all(|x| bins.mirrored(bins.of(*x)) == bins.of(-*x)));
            assert!(bins.of(2.9) > bins.of(1.5) && bins.of(-2.9) < bins.of(-1.5) && bins.of(1e-7) == bins.of(0.0));
        }
    }
}
