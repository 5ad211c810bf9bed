//! Means and squares of values, part by part.

use super::values::Both;

/// Weight, mean and sum of squared differences from the mean, by area and alike.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spread {
    weight: Both,
    pub(super) mean: Both,
    pub(super) squares: Both,
}

impl Spread {
    /// Of some values, or of their magnitudes. Sums are of differences from the first value: where all lie close to each other no digits
    /// are lost.
    pub(super) fn of(values: &[f32], areas: &[f32], magnitudes: bool) -> Spread {
        let Some(pivot) = values.first().map(|x| magnitude(*x, magnitudes)) else { return Spread::default() };
        let (whole, rest) = values.as_chunks::<SIDE>();
        let (whole_areas, rest_areas) = areas.as_chunks::<SIDE>();
        let mut sums = [[0.0; SIDE]; 5];
        for (values, areas) in whole.iter().zip(whole_areas) {
            add_moments(&mut sums, values, areas, pivot, magnitudes);
        }
        // What is missing weighs nothing and is at the pivot.
        let mut last = ([pivot as f32; SIDE], [0.0; SIDE]);
        last.0[..rest.len()].copy_from_slice(rest);
        last.1[..rest.len()].copy_from_slice(rest_areas);
        add_moments(&mut sums, &last.0, &last.1, pivot, magnitudes);
        let [area, alike, by_area, squares_alike, squares_by_area] = sums.map(|s| s.iter().sum::<f64>());
        let weight = [area, values.len() as f64];
        let (sum, squares) = ([by_area, alike], [squares_by_area, squares_alike]);
        Spread {
            weight,
            mean: std::array::from_fn(|w| pivot + if weight[w] > 0.0 { sum[w] / weight[w] } else { 0.0 }),
            squares: std::array::from_fn(|w| {
                if weight[w] > 0.0 { (squares[w] - sum[w] * sum[w] / weight[w]).max(0.0) } else { 0.0 }
            }),
        }
    }

    /// Of these and of others together (Chan, Golub and LeVeque, 'Algorithms for computing the sample variance', 1983).
    pub(super) fn with(self, other: Spread) -> Spread {
        let mut both = self;
        for w in 0..2 {
            let weight = self.weight[w] + other.weight[w];
            if weight > 0.0 {
                let (share, apart) = (other.weight[w] / weight, other.mean[w] - self.mean[w]);
                both.mean[w] += share * apart;
                both.squares[w] += other.squares[w] + self.weight[w] * share * apart * apart;
            }
            both.weight[w] = weight;
        }
        both
    }
}

/// Sums side by side, which vectors take at once.
const SIDE: usize = 4;

/// Adds area, and by area and alike the difference from the pivot and its square.
#[inline(always)]
fn add_moments(sums: &mut [[f64; SIDE]; 5], values: &[f32; SIDE], areas: &[f32; SIDE], pivot: f64, magnitudes: bool) {
    for i in 0..SIDE {
        let (d, area) = (magnitude(values[i], magnitudes) - pivot, f64::from(areas[i]));
        sums[0][i] += area;
        sums[1][i] += d;
        sums[2][i] += area * d;
        sums[3][i] += d * d;
        sums[4][i] += area * d * d;
    }
}

#[inline(always)]
fn magnitude(value: f32, wanted: bool) -> f64 {
    f64::from(if wanted { value.abs() } else { value })
}
