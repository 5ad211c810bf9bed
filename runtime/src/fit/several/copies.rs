//! Whether two files hold the same points: a scan that was converted, moved, scaled, rounded or reordered is no second
//! measurement, and would make standard deviations too small by the square root of two.
//!
//! Numbers of points and principal moments tell nearly all scans apart. Where they agree, a rigid motion that takes one
//! cloud to the other is looked for, and every point of a sample must then have a counterpart within the rounding of
//! the files. Two measurements by the same rays differ by their noise, and are not taken for one unless the rounding
//! hides it.

use crate::eigen::symmetric;
use crate::model::Motion;
use crate::robust::median;
use crate::scan::{Frame, Neighbours, Scan, Unit, coordinate_steps};
use glam::DVec3;
use nalgebra::{Matrix3, Vector3};

/// Fewer points may agree by accident.
const FEWEST: usize = 100;
/// The largest share of points that one of the files lacks, because rounding put them at the place of others.
const LACKING: f64 = 0.01;
/// The number of points whose counterparts are looked for, and the share of them that must have one.
const SAMPLES: usize = 4096;
const SHARE: f64 = 0.98;
/// Rounding that is not seen in coordinates, as a share of the size: the steps of files are found down to half of it.
const UNSEEN: f64 = 2e-6;
/// How much the distances of counterparts may exceed those by rounding: noise of 0.3 steps doubles the excess.
const EXCESS: f64 = 1.15;
/// The largest rounding, in spacings, at which other points do not lie within it by accident: one in three does.
const OF_SPACING: f64 = 0.35;
/// The most motions that are tried: symmetric objects without noise have many.
const CANDIDATES: usize = 64;

/// If two scans consist of the same points, how many times as large the second one is: 1, or a ratio of two units of
/// length. Only proper motions count: a mirror image has other points. Rounding that is coarser than a third of the
/// distances of neighbouring points hides what is the same.
#[must_use]
pub fn copied(scan: &Scan, other: &Scan) -> Option<f64> {
    let [n, m] = [scan, other].map(|scan| scan.mesh.positions.len());
    if n.min(m) < FEWEST || n.abs_diff(m) as f64 > LACKING * n.max(m) as f64 {
        return None;
    }
    if n > m {
        // Every point of the smaller one should be among the others.
        return copied(other, scan).map(f64::recip);
    }
    let (a, b) = (Cloud::of(scan), Cloud::of(other));
    let scale = ratio_of_units(b.size() / a.size())?;
    let b = b.scaled(1.0 / scale);
    let lacking = n.abs_diff(m) as f64 / n.max(m) as f64;
    let unseen = UNSEEN * a.reach;
    let seen = Tolerance { rms: EXCESS * a.rounding.hypot(b.rounding), most: 3f64.sqrt() * (a.rounding + b.rounding) };
    // Points on a regular grid seem to be rounded, and are not.
    let tolerances = [Tolerance::default(), seen].map(|t| Tolerance { rms: t.rms + unseen, most: t.most + unseen });
    if !a.has_moments_of(&b, tolerances[1].most, lacking) {
        return None;
    }
    let pair = Pair { tree: Neighbours::new(&a.points), a, b, lacking };
    let spacing = pair.spacing();
    let found = |t: &Tolerance| t.most <= OF_SPACING * spacing && pair.motions(t.most).any(|m| pair.agrees(m, t));
    tolerances.iter().any(found).then_some(scale)
}

/// The ratio of two units, if a number is near to one.
fn ratio_of_units(ratio: f64) -> Option<f64> {
    let lengths = || Unit::ALL.into_iter().map(Unit::millimetres);
    let ratios = lengths().flat_map(|a| lengths().map(move |b| a / b));
    ratios.into_iter().find(|known| (ratio / known - 1.0).abs() < LACKING)
}

/// How far counterparts are apart. Millimetres.
#[derive(Clone, Copy, Default)]
struct Tolerance {
    /// As the root of their mean square.
    rms: f64,
    /// At most.
    most: f64,
}

/// Points about their centre. Millimetres.
struct Cloud {
    centre: DVec3,
    points: Vec<[f64; 3]>,
    /// The distance of the farthest point.
    reach: f64,
    /// The principal second moments, ascending.
    moments: [f64; 3],
    /// The root of the mean squared error of a position by the rounding of the file.
    rounding: f64,
}

impl Cloud {
    fn of(scan: &Scan) -> Self {
        let positions = &scan.mesh.positions;
        let mut centre = scan.mesh.bounds().centre();
        centre += positions.iter().map(|p| DVec3::from(*p) - centre).sum::<DVec3>() / positions.len() as f64;
        let points: Vec<[f64; 3]> = positions.iter().map(|p| (DVec3::from(*p) - centre).to_array()).collect();
        let product = |p: &[f64; 3]| Vector3::from(*p) * Vector3::from(*p).transpose();
        let covariance: Matrix3<f64> = points.iter().map(product).sum::<Matrix3<f64>>() / points.len() as f64;
        let mut moments: [f64; 3] = symmetric(covariance).eigenvalues.into();
        moments.sort_by(f64::total_cmp);
        let reach = points.iter().map(|p| DVec3::from(*p).length()).fold(0.0, f64::max);
        // Steps beyond the noise are rounding only where the reader took them for that.
        let steps = coordinate_steps(positions, &Frame::own([0.0; 3])).map(|step| step.length);
        let coarse = scan.attributes.rounded.largest();
        let variance = |k: usize| if steps[k] <= scan.noise.max(coarse) { steps[k].powi(2) / 12.0 } else { 0.0 };
        let rounding = (0..3).map(variance).sum::<f64>().sqrt();
        Self { centre, points, reach, moments, rounding }
    }

    fn size(&self) -> f64 {
        self.moments.iter().sum::<f64>().sqrt()
    }

    fn scaled(mut self, factor: f64) -> Self {
        self.points.iter_mut().flatten().for_each(|c| *c *= factor);
        self.moments = self.moments.map(|moment| moment * factor * factor);
        Self { centre: self.centre * factor, reach: self.reach * factor, rounding: self.rounding * factor, ..self }
    }

    /// Whether the moments may be those of the same points.
    fn has_moments_of(&self, other: &Self, rounding: f64, lacking: f64) -> bool {
        let most = 2.0 * self.reach * (rounding + lacking * self.reach);
        self.moments.iter().zip(other.moments).all(|(a, b)| (a - b).abs() <= most)
    }

    /// The point that is largest by a measure.
    fn largest(&self, by: impl Fn(DVec3) -> f64) -> DVec3 {
        let points = self.points.iter().map(|p| DVec3::from(*p));
        points.max_by(|p, q| by(*p).total_cmp(&by(*q))).unwrap_or_default()
    }

    /// The points for which a measure has a value to within a tolerance.
    fn at(&self, by: impl Fn(DVec3) -> f64, value: f64, tolerance: f64) -> impl Iterator<Item = DVec3> {
        self.points.iter().map(|p| DVec3::from(*p)).filter(move |p| (by(*p) - value).abs() <= tolerance)
    }
}

/// Two clouds, of which the second one may be a copy of the first.
struct Pair {
    a: Cloud,
    tree: Neighbours,
    b: Cloud,
    lacking: f64,
}

impl Pair {
    /// The median distance of neighbours in the first cloud.
    fn spacing(&self) -> f64 {
        let nearest = |p: &[f64; 3]| {
            let other = *self.tree.nearest(*p, 2).get(1)? as usize;
            Some(DVec3::from(*p).distance(self.a.points[other].into()))
        };
        median(&mut sample(&self.a.points).iter().filter_map(nearest).collect::<Vec<f64>>()).unwrap_or(0.0)
    }

    /// Motions that may take the second cloud to the first: none, that by the order of the points, and those by three
    /// points that lie far from each other.
    fn motions(&self, tolerance: f64) -> impl Iterator<Item = Motion> {
        let shift = (self.b.centre - self.a.centre).to_array();
        let unmoved = Motion { translation: shift, ..Motion::IDENTITY };
        let equal = self.a.points.len() == self.b.points.len();
        let ordered = equal.then(|| Motion::between(&sample(&self.b.points), &sample(&self.a.points)));
        let others = std::iter::once_with(move || self.by_anchors(tolerance)).flatten();
        std::iter::once(unmoved).chain(ordered).chain(others)
    }

    fn by_anchors(&self, tolerance: f64) -> Vec<Motion> {
        let (a, b) = (&self.a, &self.b);
        let first = a.largest(|p| p.length());
        let second = a.largest(|p| p.distance(first));
        let axis = (second - first).normalize_or_zero();
        let third = a.largest(|p| (p - first).cross(axis).length());
        let sides = [first.distance(second), second.distance(third), third.distance(first)];
        let off = |p: DVec3| (p.length() - first.length()).abs();
        // The centre is another one where points are lacking.
        let shifted = tolerance + 2.0 * self.lacking * a.reach;
        let mut firsts: Vec<DVec3> = b.at(|p| p.length(), first.length(), shifted).collect();
        firsts.sort_by(|p, q| off(*p).total_cmp(&off(*q)));
        let firsts = firsts.into_iter().take(CANDIDATES);
        let seconds = firsts.flat_map(|f| b.at(move |p| p.distance(f), sides[0], 2.0 * tolerance).map(move |s| [f, s]));
        let thirds = seconds.take(CANDIDATES).flat_map(|[f, s]| {
            let near = b.at(move |p| p.distance(s), sides[1], 2.0 * tolerance);
            near.filter(move |t| (t.distance(f) - sides[2]).abs() <= 2.0 * tolerance).map(move |t| [f, s, t])
        });
        let anchors = [first, second, third].map(|p| p.to_array());
        thirds.take(CANDIDATES).map(|found| Motion::between(&found.map(|p| p.to_array()), &anchors)).collect()
    }

    /// Whether a motion, made exact step by step, brings the points of the second cloud to points of the first.
    fn agrees(&self, mut motion: Motion, tolerance: &Tolerance) -> bool {
        let points = sample(&self.b.points);
        for reach in [8.0, 3.0, 1.0].map(|reach| reach * tolerance.most) {
            let (mut from, mut to, mut squares) = (Vec::new(), Vec::new(), 0.0);
            for p in &points {
                let moved = motion.point(*p);
                let Some(nearest) = self.tree.nearest(moved, 1).first().map(|i| self.a.points[*i as usize]) else {
                    return false;
                };
                let squared = DVec3::from(moved).distance_squared(nearest.into());
                if squared <= reach * reach {
                    from.push(*p);
                    to.push(nearest);
                    squares += squared;
                }
            }
            if (from.len() as f64) < SHARE * points.len() as f64 {
                return false;
            }
            if reach == tolerance.most {
                return (squares / from.len() as f64).sqrt() <= tolerance.rms;
            }
            motion = Motion::between(&from, &to);
        }
        false
    }
}

/// Points at even distances in the list.
fn sample(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    points.iter().step_by(points.len().div_ceil(SAMPLES).max(1)).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::tests::cup::{SYNTHETIC, scan_of};
    use crate::fit::tests::shapes::cup;
    use crate::mesh::TriangleMesh;
    use crate::scan::from_mesh;
    use glam::DQuat;
    use rand::seq::SliceRandom;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn scan(positions: Vec<[f64; 3]>) -> Scan {
        from_mesh(TriangleMesh { positions, ..TriangleMesh::default() }, "cloud").unwrap()
    }

    fn moved(points: &[[f64; 3]], far: f64) -> Vec<[f64; 3]> {
        let rotation = DQuat::from_scaled_axis(DVec3::new(0.3, -1.0, 2.0));
        points.iter().map(|p| (rotation * DVec3::from(*p) + DVec3::new(far, -80.0, 12.0)).to_array()).collect()
    }

    fn shuffled(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut points = points.to_vec();
        points.shuffle(&mut ChaCha8Rng::seed_from_u64(7));
        points
    }

    fn rounded(points: &[[f64; 3]], step: f64) -> Vec<[f64; 3]> {
        points.iter().map(|p| p.map(|c| (c / step).round() * step)).collect()
    }

    /// What rays through the points of a grid see of a can: the noise, of standard deviation 0.05 mm, is along them.
    fn along_rays(seed: u64) -> Vec<[f64; 3]> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let noise = rand_distr::Normal::new(0.0, 0.05).unwrap();
        let point = |k: u32| {
            let (angle, z) = (f64::from(k % 150) / 60.0, 0.7 * f64::from(k / 150));
            let r = 30.0 + random.sample(noise);
            [r * angle.cos(), r * angle.sin(), z]
        };
        (0..9000).map(point).collect()
    }

    #[test]
    fn copies_are_found_however_they_are_written() {
        for points in [scan_of(&cup(), &SYNTHETIC, 0.05, 6000, 1).mesh.positions, along_rays(1)] {
            let first = scan(points.clone());
            let copies = [
                points.clone(),
                shuffled(&points),
                moved(&points, 30.0),
                shuffled(&moved(&points, 30.0)),
                rounded(&points, 0.001),
                rounded(&shuffled(&moved(&points, 30.0)), 0.01),
                rounded(&moved(&points, 450_000.0), 0.03),
                moved(&points, 30.0).iter().map(|p| p.map(|c| f64::from(c as f32))).collect(),
                // A few of them are lacking.
                shuffled(&moved(&points[20..], 30.0)),
            ];
            for (i, copy) in copies.into_iter().enumerate() {
                let copy = scan(copy);
                assert_eq!([copied(&first, &copy), copied(&copy, &first)], [Some(1.0); 2], "{i}");
            }
            let metres = scan(shuffled(&moved(&points, 30.0)).iter().map(|p| p.map(|c| c / 1000.0)).collect());
            assert!(copied(&first, &metres).is_some_and(|scale| (scale * 1000.0 - 1.0).abs() < 1e-12));
        }
    }

    #[test]
    fn other_measurements_are_not_copies() {
        let [first, second] = [1, 2].map(along_rays);
        for step in [1e-6, 0.001, 0.01, 0.1] {
            let [first, second] = [&first, &second].map(|points| rounded(points, step));
            assert_eq!(copied(&scan(first.clone()), &scan(second.clone())), None, "{step}");
            assert_eq!(copied(&scan(first.clone()), &scan(shuffled(&moved(&second, 30.0)))), None, "{step}");
        }
        // Points at random on one object, as many of both scans.
        let [first, second] = [1, 2].map(|seed| scan_of(&cup(), &SYNTHETIC, 0.05, 6000, seed).mesh.positions);
        let count = first.len().min(second.len());
        assert_eq!(copied(&scan(first[..count].to_vec()), &scan(second[..count].to_vec())), None);
        // A mirror image has other points.
        let mirrored = first.iter().map(|[x, y, z]| [-x, *y, *z]).collect();
        assert_eq!(copied(&scan(first), &scan(mirrored)), None);
    }
}
