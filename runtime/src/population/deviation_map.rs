//! Deviations of many objects at the same places of the surface.

use statrs::distribution::{ContinuousCDF, StudentsT};
use thiserror::Error;

/// What is less probable is no chance: that of three standard deviations.
pub const BY_CHANCE: f64 = 0.0027;

/// Textures of different sizes cannot be added.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("the texture has {found} texels, those before it {expected}")]
pub struct MapError {
    /// Texels of the texture.
    pub found: usize,
    /// Texels of those before it.
    pub expected: usize,
}

/// The number, mean and sum of squared differences of the deviations at every texel, one texture at a time (Welford,
/// *Note on a method for calculating corrected sums of squares and products*, Technometrics 4, 1962).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeviationMap {
    count: Vec<u32>,
    mean: Vec<f64>,
    squares: Vec<f64>,
    textures: usize,
}

impl DeviationMap {
    /// Adds the signed distances of one object, row by row, NaN where it has none. Millimetres.
    ///
    /// # Errors
    /// If the texture has another size than those before it.
    pub fn add(&mut self, distances: &[f32]) -> Result<(), MapError> {
        if self.textures == 0 {
            *self = Self {
                count: vec![0; distances.len()],
                mean: vec![0.0; distances.len()],
                squares: vec![0.0; distances.len()],
                textures: 0,
            };
        }
        if distances.len() != self.count.len() {
            return Err(MapError { found: distances.len(), expected: self.count.len() });
        }
        self.textures += 1;
        for (i, distance) in distances.iter().enumerate().filter(|(_, d)| d.is_finite()) {
            let distance = f64::from(*distance);
            self.count[i] += 1;
            let before = distance - self.mean[i];
            self.mean[i] += before / f64::from(self.count[i]);
            self.squares[i] += before * (distance - self.mean[i]);
        }
        Ok(())
    }

    /// The number of textures that were added.
    #[must_use]
    pub fn textures(&self) -> usize {
        self.textures
    }

    /// The mean deviation at every texel, NaN where fewer than half of the objects, or fewer than two, have one.
    #[must_use]
    pub fn mean(&self) -> Vec<f32> {
        self.map(|i| self.mean[i])
    }

    /// The standard deviation between objects at every texel, likewise.
    #[must_use]
    pub fn sd(&self) -> Vec<f32> {
        self.map(|i| self.variance(i).sqrt())
    }

    /// The probability of such a mean, or one farther from zero, where the true one is zero, at every texel, likewise:
    /// by Student's t.
    #[must_use]
    pub fn chance(&self) -> Vec<f32> {
        let most = self.count.iter().copied().max().unwrap_or(0);
        let by_degrees: Vec<Option<StudentsT>> =
            (0..most.max(1)).map(|degrees| StudentsT::new(0.0, 1.0, f64::from(degrees)).ok()).collect();
        self.map(|i| {
            let t = self.mean[i].abs() / (self.variance(i) / f64::from(self.count[i])).sqrt();
            let distribution = by_degrees[self.count[i] as usize - 1].as_ref();
            distribution.filter(|_| !t.is_nan()).map_or(f64::NAN, |d| 2.0 * d.sf(t))
        })
    }

    fn variance(&self, i: usize) -> f64 {
        self.squares[i] / (f64::from(self.count[i]) - 1.0)
    }

    fn map(&self, of: impl Fn(usize) -> f64) -> Vec<f32> {
        let is_enough = |i: usize| self.count[i] >= 2 && 2 * self.count[i] as usize >= self.textures;
        (0..self.count.len()).map(|i| if is_enough(i) { of(i) as f32 } else { f32::NAN }).collect()
    }
}
