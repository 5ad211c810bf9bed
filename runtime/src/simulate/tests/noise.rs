//! The errors of ranges against their stated distributions.

use super::{exact, joined};
use crate::mesh::TriangleMesh;
use crate::progress::Silent;
use crate::simulate::{Kind, Scanner, VirtualScan, scan};
use glam::DVec3;

/// A square at x that faces the scanner, which is at negative x.
fn wall(x: f64, half: f64) -> TriangleMesh {
    let positions = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]].map(|[y, z]| [x, half * y, half * z]).to_vec();
    TriangleMesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..TriangleMesh::default() }
}

/// A scanner of one station in front of a wall.
fn at(distance: f64) -> Scanner {
    Scanner { kind: Kind::Panorama, places: vec![[-distance, 0.0, 0.0]], spacing: 5.0, ..exact() }
}

/// The error of a range to the plane x = 0.
struct Error {
    error: f64,
    range: f64,
    cosine: f64,
}

fn errors(scan: &VirtualScan, eye: [f64; 3]) -> Vec<Error> {
    let eye = DVec3::from_array(eye);
    let error = |p: &[f64; 3]| {
        let ray = DVec3::from_array(*p) - eye;
        let cosine = ray.x / ray.length();
        let range = -eye.x / cosine;
        Error { error: ray.length() - range, range, cosine }
    };
    scan.mesh.positions.iter().map(error).collect()
}

/// Means of the squares and of the fourth powers.
fn moments(values: impl Iterator<Item = f64>) -> (f64, f64, f64) {
    let (mut n, mut second, mut fourth) = (0.0, 0.0, 0.0);
    for x in values {
        n += 1.0;
        second += x * x;
        fourth += x.powi(4);
    }
    (n, second / n, fourth / n)
}

/// Of n squared normal deviates the mean is 1 with the deviation sqrt(2 / n); five of these are allowed.
fn require_unit(values: impl Iterator<Item = f64>, what: &str) {
    let (n, second, _) = moments(values);
    assert!(n > 2000.0, "{what}: {n}");
    assert!((second - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{what}: variance {second} of {n}");
}

#[test]
fn white_noise_is_normal_with_its_deviation_and_without_correlation() {
    let scanner = Scanner { noise: 0.3, ..at(2000.0) };
    let scan = scan(&wall(0.0, 400.0), &scanner, &Silent).unwrap();
    let errors = errors(&scan, scanner.places[0]);
    require_unit(errors.iter().map(|e| e.error / 0.3), "white");
    let (n, _, fourth) = moments(errors.iter().map(|e| e.error / 0.3));
    // The fourth power of a normal deviate has the mean 3 and the variance 96.
    assert!((fourth - 3.0).abs() < 5.0 * (96.0 / n).sqrt(), "kurtosis {fourth} of {n}");
    let neighbours = errors.windows(2).map(|e| e[0].error * e[1].error / 0.09).sum::<f64>() / n;
    assert!(neighbours.abs() < 5.0 / n.sqrt(), "{neighbours}");
}

#[test]
fn noise_grows_with_the_range() {
    for distance in [500.0, 8000.0] {
        let spacing = if distance > 1000.0 { 10.0 } else { 5.0 };
        let scanner = Scanner { noise: 0.2, noise_range: 1e-4, spacing, ..at(distance) };
        let scan = scan(&wall(0.0, 400.0), &scanner, &Silent).unwrap();
        let errors = errors(&scan, scanner.places[0]);
        let deviation = |range: f64| (0.04 + (1e-4 * range).powi(2)).sqrt();
        require_unit(errors.iter().map(|e| e.error / deviation(e.range)), "by range");
    }
}

#[test]
fn noise_grows_with_the_angle() {
    let scanner = Scanner { noise: 0.1, noise_angle: true, ..at(250.0) };
    let scan = scan(&wall(0.0, 800.0), &scanner, &Silent).unwrap();
    let errors = errors(&scan, scanner.places[0]);
    for (low, high) in [(0.0, 0.4), (0.4, 0.7), (0.7, 1.1)] {
        let within = errors.iter().filter(|e| (low..high).contains(&e.cosine));
        require_unit(within.map(|e| e.error * e.cosine / 0.1), &format!("cosines from {low}"));
    }
    // Nothing is seen at less than the largest angle of incidence.
    assert!(errors.iter().all(|e| e.cosine >= scanner.least_cosine() - 1e-12));
}

#[test]
fn a_share_of_the_noise_is_correlated_over_its_length() {
    let (noise, share, length) = (0.5, 0.6, 20.0);
    let scanner = Scanner { noise, correlated: share, correlation: length, spacing: 4.0, ..at(4000.0) };
    let scan = scan(&wall(0.0, 500.0), &scanner, &Silent).unwrap();
    let errors = errors(&scan, scanner.places[0]);
    let grid = &scan.grids[0];
    // 2500 squared lengths on the wall, of which each has some independent places: means to about a fiftieth.
    let (_, variance, _) = moments(errors.iter().map(|e| e.error / noise));
    assert!((variance - 1.0).abs() < 0.08, "{variance}");
    for lag in [2, 5, 10, 20] {
        let (mut sum, mut count) = (0.0, 0.0);
        for (a, b) in grid.cells.iter().zip(&grid.cells[lag * grid.rows..]) {
            if let (Some(a), Some(b)) = (errors.get(*a as usize), errors.get(*b as usize)) {
                sum += a.error * b.error;
                count += 1.0;
            }
        }
        let found = sum / count / (noise * noise);
        // Neighbouring columns are a step of azimuth apart: 4 mm at the wall's middle, by 1.5 % more at its ends.
        let expected = share * (-0.5 * (4.0 * lag as f64 / length).powi(2)).exp();
        assert!((found - expected).abs() < 0.06, "{found} for {expected} at {lag} columns");
    }
}

/// Where a beam of diameter d meets a straight edge at a distance s of its middle, evenly from -d/2 to d/2, the share
/// of the area that is beyond the edge is 1/2 + (t sqrt(1 - t^2) + asin t) / pi, t = 2 s / d.
#[test]
fn beams_that_meet_two_surfaces_return_what_is_between() {
    let (near, far, beam) = (100.0, 300.0, 6.0);
    let plates = joined(wall(0.0, near), &wall(200.0, far));
    let scanner = Scanner { beam, spacing: 2.0, ..at(5000.0) };
    let scan = scan(&plates, &scanner, &Silent).unwrap();
    let between: Vec<f64> = scan.mesh.positions.iter().map(|p| p[0]).filter(|x| (1.0..199.0).contains(x)).collect();
    // A strip as wide as the beam along the edge of the near plate, whose corners take a little, at 2 mm a point
    // where the scanned box's middle is: at x = 100, so that the near plate gets a little more.
    let expected = 8.0 * near * beam / 4.0 * (5100.0_f64 / 5000.0).powi(2);
    let count = between.len() as f64;
    // Where less than a 32nd of the beam is on one side, the range is that of the other: 4 % of the strip.
    assert!((count / expected - 0.97).abs() < 0.05, "{count} of {expected}");
    assert!((scan.truth.mixed as f64 / count - 1.0).abs() < 0.08, "{} of {count}", scan.truth.mixed);
    let mean = between.iter().sum::<f64>() / count / 200.0;
    let square = between.iter().map(|x| (x / 200.0 - mean).powi(2)).sum::<f64>() / count;
    // Shares of less than half of a ray of the 32 are none.
    let share = |t: f64| 0.5 + (t * (1.0 - t * t).sqrt() + t.asin()) / std::f64::consts::PI;
    let all = (0..1000).map(|i| share((f64::from(i) + 0.5) / 500.0 - 1.0));
    let shares: Vec<f64> = all.filter(|share| (1.0 / 64.0..63.0 / 64.0).contains(share)).collect();
    let variance = shares.iter().map(|share| (share - 0.5).powi(2)).sum::<f64>() / shares.len() as f64;
    assert!((mean - 0.5).abs() < 0.03, "{mean}");
    assert!((square.sqrt() / variance.sqrt() - 1.0).abs() < 0.05, "{} for {}", square.sqrt(), variance.sqrt());
}

#[test]
fn intensities_are_cosines() {
    let scanner = at(300.0);
    let scan = scan(&wall(0.0, 400.0), &scanner, &Silent).unwrap();
    let errors = errors(&scan, scanner.places[0]);
    assert_eq!(errors.len(), scan.attributes.intensities.len());
    for (e, intensity) in errors.iter().zip(&scan.attributes.intensities) {
        assert!((e.cosine - f64::from(*intensity)).abs() < 1e-6);
    }
}

/// Counts of n independent rays with the share p have the standard deviation sqrt(n p (1 - p)); five of these, and the
/// rounding of a count, are allowed.
fn require_share(count: usize, of: usize, share: f64, what: &str) {
    let (n, expected) = (of as f64, of as f64 * share);
    let bound = 5.0 * (n * share * (1.0 - share)).sqrt() + 0.5;
    assert!((count as f64 - expected).abs() <= bound, "{what}: {count} of {of}, not {expected}");
}

#[test]
fn outliers_are_their_share_of_the_points_whatever_is_lost() {
    for (outliers, dropouts) in [(0.2, 0.0), (0.2, 0.3), (0.6, 0.6), (0.05, 0.9), (1.0, 0.5)] {
        for kind in [Kind::Panorama, Kind::HandHeld, Kind::StructuredLight] {
            let scanner = Scanner { kind, cloud: true, outliers, dropouts, views: 6, spacing: 8.0, ..at(2000.0) };
            let truth = scan(&wall(0.0, 400.0), &scanner, &Silent).unwrap().truth;
            let what = format!("{kind:?} with {outliers} and {dropouts}");
            assert!(truth.points + truth.dropouts > 3000, "{what}: {} points", truth.points);
            require_share(truth.outliers, truth.points, outliers, &what);
            require_share(truth.dropouts, truth.points + truth.dropouts, dropouts, &what);
        }
    }
}
