//! What the points are that a fit does not explain: isolated ones, a plane, another copy of the object.

use super::{Scene, pieces};
use crate::fit::attempt::Attempt;
use crate::fit::problem::points::gyration;
use crate::fit::result::FitResult;
use crate::fit::tuning::{COPY_POINTS, MOSTLY, PIECE_POINTS, PLANE_DRAWS, PLANE_NOISE, PLANE_SAMPLES, UNEXPLAINED};
use crate::scan::Scan;
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeSet;

/// A sentence on what a fit does not explain.
pub(super) struct Remainder {
    pub(super) text: String,
    /// It says what the connected pieces are.
    pub(super) explains_pieces: bool,
}

/// A sentence on the points that are not near the model, where one kind is most of them.
pub(super) fn sentence(scene: &Scene, best: &Attempt) -> Option<Remainder> {
    let positions = &scene.scan.mesh.positions;
    let rest = best.near.iter().filter(|near| !**near).count();
    if rest < PIECE_POINTS {
        return None;
    }
    let percent = |count: usize| 100.0 * count as f64 / positions.len() as f64;
    let is_rest: Vec<bool> = best.near.iter().map(|near| !near).collect();
    if let Some(on) = plane(scene.scan, &is_rest) {
        let count = on.iter().filter(|on| **on).count();
        if count as f64 > MOSTLY * rest as f64 {
            let text = format!(
                "{:.0} % of the scan's points lie in a plane that the model does not have, likely a table or a floor: cut it off",
                percent(count)
            );
            return Some(Remainder { text, explains_pieces: true });
        }
    }
    // The vertices of a mesh's triangles are no dust, however far from each other.
    let mut on_triangles = vec![false; positions.len()];
    scene.scan.mesh.triangles.iter().flatten().for_each(|i| on_triangles[*i as usize] = true);
    let is_isolated = pieces::isolated(scene.scan);
    let isolated = (0..positions.len()).filter(|i| is_isolated[*i] && is_rest[*i] && !on_triangles[*i]).count();
    if isolated as f64 > MOSTLY * rest as f64 {
        let text = format!(
            "{:.0} % of the scan's points are isolated ones away from the model, likely dust, spray or clutter: they have hardly any influence",
            percent(isolated)
        );
        return Some(Remainder { text, explains_pieces: false });
    }
    copy(scene, best, &is_rest).map(|text| Remainder { text, explains_pieces: true })
}

/// A sentence on the pieces of the scan's surface that a fit does not explain, where they are more than a few.
pub(super) fn pieces(fit: &FitResult) -> Option<String> {
    let pieces = fit.unexplained.as_slice();
    let share: f64 = pieces.iter().map(|piece| piece.share).sum();
    let largest = pieces.first().filter(|_| share > UNEXPLAINED)?;
    let [x, y, z] = largest.place;
    let area: Option<f64> = pieces.iter().map(|piece| piece.area).sum();
    let area = area.map_or(String::new(), |area| format!(", {area:.0} mm2"));
    let at = match pieces {
        [_] => format!("about ({x:.1}, {y:.1}, {z:.1}) mm"),
        _ => format!("in {} pieces, the largest about ({x:.1}, {y:.1}, {z:.1}) mm", pieces.len()),
    };
    let names: BTreeSet<&String> = pieces.iter().flat_map(|piece| &piece.shaped_by).collect();
    let names: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    let shaped_by = match names.as_slice() {
        [] => String::new(),
        names => format!(
            ", or the fit is wrong in what shapes the parts beside it ({}), whatever their standard deviations",
            names.join(", ")
        ),
    };
    Some(format!(
        "{:.1} % of the scan's surface{area}, {at}, is not explained by the model, which is more than {:.3} mm away: the object has something there that the script does not have{shaped_by}",
        100.0 * share,
        fit.inlier_distance()
    ))
}

/// A sentence on another copy of the object, which has the same shape.
fn copy(scene: &Scene, best: &Attempt, is_rest: &[bool]) -> Option<String> {
    let count = |near: &[bool]| near.iter().filter(|near| **near).count();
    let here = count(&best.near);
    if (count(is_rest) as f64) < COPY_POINTS * here as f64 {
        return None;
    }
    let shape = scene.shape_of(&best.result);
    let mut options = scene.plain();
    options.start.clear();
    options.fixed = shape.values.keys().cloned().collect();
    options.earlier = Some(shape);
    let rest = scene.scan.part(is_rest);
    let found = scene.fit(&rest, options, "looking for another copy")?;
    if found.result.inliers < MOSTLY || (count(&found.near) as f64) < COPY_POINTS * here as f64 {
        return None;
    }
    let [x, y, z] = middle(&scene.scan.mesh.positions, &best.near).to_array();
    let [a, b, c] = middle(&rest.mesh.positions, &found.near).to_array();
    Some(format!(
        "the scan shows two copies of the object: the one about ({x:.0}, {y:.0}, {z:.0}) mm was fitted, another one is about ({a:.0}, {b:.0}, {c:.0}) mm"
    ))
}

/// The mean of the marked points.
pub(super) fn middle(positions: &[[f64; 3]], marks: &[bool]) -> DVec3 {
    let marked = || positions.iter().zip(marks).filter(|(_, mark)| **mark).map(|(p, _)| DVec3::from(*p));
    marked().sum::<DVec3>() / marked().count().max(1) as f64
}

/// The vertices of a scan that lie in the plane with the most of those that are marked (RANSAC; Fischler and Bolles
/// 1981). None where there is no plane.
pub(super) fn plane(scan: &Scan, marks: &[bool]) -> Option<Vec<bool>> {
    let positions = &scan.mesh.positions;
    let marked: Vec<DVec3> =
        positions.iter().zip(marks).filter(|(_, mark)| **mark).map(|(p, _)| DVec3::from(*p)).collect();
    let step = marked.len().div_ceil(PLANE_SAMPLES).max(1);
    let sample: Vec<DVec3> = marked.into_iter().step_by(step).collect();
    if sample.len() < PIECE_POINTS {
        return None;
    }
    let size = gyration(&sample);
    let thickness = (PLANE_NOISE * scan.noise).max(1e-4 * size);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let draw = |_| {
        let [a, b, c] = std::array::from_fn(|_| sample[random.random_range(0..sample.len())]);
        let normal = (b - a).cross(c - a).try_normalize()?;
        let on = sample.iter().filter(|p| (**p - a).dot(normal).abs() < thickness).count();
        Some((on, a, normal))
    };
    let (_, at, normal) = (0..PLANE_DRAWS).filter_map(draw).max_by_key(|plane| plane.0)?;
    let is_on = |(p, mark): (&[f64; 3], &bool)| *mark && (DVec3::from(*p) - at).dot(normal).abs() < thickness;
    Some(positions.iter().zip(marks).map(is_on).collect())
}
