//! The filtered deviations of a part.

use super::dents::Around;
use super::filter::{Cells, Filter, Place, Point};
use super::noise::ScanNoise;
use crate::mesh::Bounds;
use crate::robust::{MAD_TO_SD, median, median_and_deviation};
use glam::DVec3;
use rayon::prelude::*;

/// A point is an outlier that is so many robust standard deviations away from the filtered surface about it, if it is
/// so alone (see `dents`).
const OUTLYING: f64 = 4.0;
/// Nor is one that is off by less than this part of the robust standard deviation of all deviations: where there is no
/// noise, the filter's own error at a rim is more than those.
const OF_FORM: f64 = 0.1;
/// The filtered surface is found anew without outliers, at most so often.
const PASSES: usize = 4;

/// The default cut-off is at least so many distances between points, which takes noise to a sixth (see
/// `ALPHA`: sqrt(2) alpha 9 = 6), rounded up to 1, 2 or 5 times a power of ten ...
const SPACINGS: f64 = 9.0;
/// ... and at most this share of the part's largest extent, so that the form of small parts remains.
const OF_EXTENT: f64 = 0.2;

/// At a straight rim a quadric passes twice as much noise as within a surface, a quarter of the cut-off from it hardly
/// more.
const AT_RIM: f64 = 1.5;

/// The filtered deviations of a part without outliers.
pub(super) struct Smooth {
    pub(super) cells: Cells,
    /// Of the cells' places.
    pub(super) filter: Filter,
    /// By point, whether it is no outlier.
    pub(super) counts: Vec<bool>,
}

impl Smooth {
    /// Filters points. `precision` is the rounding of their deviations, `spacing` how far apart the scan's points are
    /// (millimetres).
    pub(super) fn new(points: &[Point], cutoff: f64, (precision, spacing): (f64, f64)) -> Self {
        let around = Around::new(points, spacing);
        let mut counts = vec![true; points.len()];
        let mut passes = 1;
        loop {
            let cells = Cells::gather(points, &counts, cutoff);
            let filter = Filter::new(&cells, &cells.places, cutoff);
            if passes == PASSES {
                return Self { cells, filter, counts };
            }
            let filtered = filter.apply(&cells.values);
            let inliers = near((points, &counts), &around, (&cells, &filtered), precision);
            if inliers == counts {
                return Self { cells, filter, counts };
            }
            counts = inliers;
            passes += 1;
        }
    }

    /// Points of the surface with filtered values.
    pub(super) fn surface(&self, filtered: &[Option<f64>]) -> Vec<DVec3> {
        let point = |(place, value): (&Place, &Option<f64>)| Some(place.displaced((*value)?));
        self.cells.places.iter().zip(filtered).filter_map(point).collect()
    }

    /// Whether a point of the filtered surface lies at a rim of what was measured: on one side of it there is nothing.
    pub(super) fn is_at_rim(&self, point: DVec3) -> bool {
        let far = |place: &Place| place.position.distance_squared(point);
        let nearest = self.cells.places.iter().zip(&self.filter.noisier).min_by(|a, b| far(a.0).total_cmp(&far(b.0)));
        nearest.is_some_and(|(_, noisier)| *noisier > AT_RIM)
    }

    pub(super) fn outlying(&self) -> usize {
        self.counts.iter().filter(|counts| !**counts).count()
    }
}

/// By point, whether it is near the filtered surface, or far from it with others about it; `counts` is so by the
/// surface before.
fn near(
    (points, counts): (&[Point], &[bool]),
    around: &Around,
    (cells, filtered): (&Cells, &[Option<f64>]),
    precision: f64,
) -> Vec<bool> {
    let error = |(point, cell): (&Point, &u32)| filtered[*cell as usize].map(|f| point.deviation - f);
    let errors: Vec<Option<f64>> = points.iter().zip(&cells.of_point).map(error).collect();
    let Some(spread) = median(&mut errors.iter().flatten().map(|error| error.abs()).collect::<Vec<f64>>()) else {
        return counts.to_vec();
    };
    let form = median_and_deviation(&mut points.iter().map(|point| point.deviation).collect::<Vec<f64>>());
    let form = form.map_or(0.0, |(_, deviation)| deviation);
    let limit = (OUTLYING * MAD_TO_SD * spread).max(OF_FORM * MAD_TO_SD * form).max(precision);
    // Of points at edges, where there is no filtered surface, nothing new is known.
    let is_near = |i: usize| errors[i].map_or(counts[i], |error| error.abs() <= limit || around.is_of_dent(i, &errors));
    (0..points.len()).into_par_iter().map(is_near).collect()
}

/// The least cut-off that texels resolve: four of them. Millimetres.
pub(super) fn least_cutoff(points: &[Point]) -> f64 {
    let area: f64 = points.iter().map(|point| point.area).sum();
    4.0 * (area / points.len() as f64).sqrt()
}

/// The cut-off where none was asked for. Millimetres.
pub(super) fn default_cutoff(noise: ScanNoise, points: &[Point]) -> f64 {
    let extent = points.iter().map(|point| point.place.position).collect::<Bounds>().size();
    let least = SPACINGS / noise.density.sqrt();
    let power = 10.0_f64.powf(least.log10().floor());
    let rounded = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|c| *c >= least * (1.0 - 1e-9));
    rounded.unwrap_or(least).min(OF_EXTENT * extent.max_element())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(count: usize, length: f64) -> Vec<Point> {
        let point = |i: usize| Point {
            place: Place { position: DVec3::X * (length * i as f64 / (count - 1) as f64), normal: DVec3::Z },
            area: 1.0,
            deviation: 0.0,
        };
        (0..count).map(point).collect()
    }

    #[test]
    fn the_cutoff_follows_the_density_and_the_size() {
        let cutoff = |density: f64, length: f64| default_cutoff(ScanNoise { sd: 0.1, density }, &line(50, length));
        // A point every millimetre, every half, every 0.2.
        assert_eq!([1.0, 4.0, 25.0].map(|density| cutoff(density, 1000.0)), [10.0, 5.0, 2.0]);
        assert!((cutoff(1.0, 20.0) - 4.0).abs() < 1e-12);
    }
}
