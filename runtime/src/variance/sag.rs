//! Sag: how far the flat triangles of a scan lie off a curved surface between its points.

use super::hits::Hit;
use super::report::PartStatistics;
use super::{Deviations, DistanceKind};
use crate::feet::signed::SignedFoot;
use crate::mesh::TriangleMesh;
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A part's sag is told of where its mean is at least this share of the RMS deviation: below, it is less than a
/// hundredth of the mean square.
const TOLD: f64 = 0.1;

/// Cosines of the most by which the surface turns from a texel to the foot of a corner of its triangle: 60 degrees
/// within a part, as around a bore of 1 mm with points 1 mm apart, and 30 from one part to another, which goes on
/// smoothly; faces that meet at an edge are mostly at right angles.
const SAME_PART: f64 = 0.5;
const OTHER_PART: f64 = 0.866;

/// The sag of a scan's triangles over one part of the surface. The deviations of the part contain it; those of the
/// scan's points are free of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sag {
    /// The mean, weighted by area: positive where the triangles lie outside of the surface through their corners.
    /// Millimetres.
    pub mean: f64,
    /// The one of the greatest magnitude. Millimetres.
    pub largest: f64,
    /// Area of the texels for which it is known: those that see a triangle within one face. Square millimetres.
    pub area: f64,
}

/// The sag at every texel, positive where the scan's triangle lies outside; NaN where it is not known: without a
/// distance, where a triangle bridges an edge, or where a corner has its foot on another face, as all of a rim have
/// that is lower than the wall below it is thick. Millimetres. `hits` are the places that the texels have their
/// distances from, `feet` those of the scan's points on the surface.
///
/// A texel at p with the unit normal n sees a triangle at the weights w of its corners, whose feet on the surface are
/// f. If the thing has the model's curvature, its surface between the corners is parallel to the model's, and the
/// triangle lies off it as that of the feet lies off the model: by n . (w1 f1 + w2 f2 + w3 f3 - p). What remains of
/// the deviation is that of the corners along n, interpolated. Of distances along averaged normals nothing is known.
pub(in crate::variance) fn sag(
    deviations: &Deviations,
    kind: DistanceKind,
    mesh: &TriangleMesh,
    hits: &[Option<Hit>],
    feet: &[Option<SignedFoot>],
) -> Vec<f32> {
    if kind == DistanceKind::AveragedNormal {
        return Vec::new();
    }
    let texels = &deviations.texels;
    let at = |i: usize| {
        if deviations.is_bridged(i) {
            return None;
        }
        let hit = hits[i]?;
        let normal = DVec3::from(texels.normal[i].map(f64::from)).try_normalize()?;
        let position = DVec3::from(texels.position[i]);
        let mut sum = DVec3::ZERO;
        for (corner, weight) in mesh.triangles[hit.triangle as usize].into_iter().zip(hit.weights) {
            let foot = feet.get(corner as usize)?.as_ref()?;
            let least = if foot.part == texels.part[i] { SAME_PART } else { OTHER_PART };
            if foot.normal.dot(normal) < least {
                return None;
            }
            sum += f64::from(weight) * (foot.point - position);
        }
        Some(normal.dot(sum) as f32)
    };
    (0..texels.len()).into_par_iter().map(|i| at(i).unwrap_or(f32::NAN)).collect()
}

/// A deviation without the sag of the scan's triangle, where that is known: what the scanned points deviate by,
/// interpolated. Millimetres, and NaN where one is not known.
#[must_use]
pub fn without_sag(deviation: f32, sag: f32) -> f32 {
    deviation - if sag.is_finite() { sag } else { 0.0 }
}

/// Adds the sag of each part to its statistics.
pub(in crate::variance) fn add_sag(parts: &mut [PartStatistics], deviations: &Deviations) {
    let mut sums = vec![Sag { mean: 0.0, largest: 0.0, area: 0.0 }; parts.len()];
    for (i, sag) in deviations.sag.iter().enumerate().filter(|(_, sag)| sag.is_finite()) {
        let (sum, sag) = (&mut sums[deviations.texels.part[i] as usize], f64::from(*sag));
        let area = f64::from(deviations.texels.area[i]).max(0.0);
        sum.mean += area * sag;
        sum.area += area;
        if sag.abs() > sum.largest.abs() {
            sum.largest = sag;
        }
    }
    for (part, sum) in parts.iter_mut().zip(sums).filter(|(_, sum)| sum.area > 0.0) {
        part.sag = Some(Sag { mean: sum.mean / sum.area, ..sum });
    }
}

/// What the sag does to the distances of the parts, where it is not small beside them: a sentence without its full
/// stop. `number` writes a figure.
pub(in crate::variance) fn sentence(parts: &[PartStatistics], number: impl Fn(f64) -> String) -> Option<String> {
    let is_told = |part: &&PartStatistics| {
        part.sag.is_some_and(|sag| sag.mean.abs() >= TOLD * part.statistics.weighted.rms && sag.mean != 0.0)
    };
    let mut told: Vec<&PartStatistics> = parts.iter().filter(is_told).collect();
    let mean = |part: &PartStatistics| part.sag.map_or(0.0, |sag| sag.mean);
    told.sort_by(|a, b| mean(b).abs().total_cmp(&mean(a).abs()));
    let others = told.len().saturating_sub(LISTED);
    let listed: Vec<String> =
        told.iter().take(LISTED).map(|part| format!("{} mm on {}", number(mean(part)), part.name)).collect();
    let others = if others > 0 { format!(" and less on {others} others") } else { String::new() };
    (!listed.is_empty()).then(|| {
        format!(
            "between its points the scan's flat triangles lie off the curved surface, which these distances contain and \
             those of the points do not: by {} on the average{others}",
            listed.join(", "),
        )
    })
}

/// Parts that a sentence names.
const LISTED: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Fineness, Model, Motion, Tessellation};
    use crate::progress::Silent;
    use crate::scan::from_mesh;
    use crate::variance::{Device, MeasureOptions, Measurement, Outcome, Reference, Resolution, measure};
    use gml_compiler::program::{Options, Program, compile};
    use gml_compiler::source::{NoFiles, SourceFile};

    const RADIUS: f64 = 20.0;

    fn compiled(part: &str) -> Program {
        let text = format!("model thing {{ param r: length = 20mm\n{part}\n}}");
        let script = SourceFile { name: "thing.gml".to_owned(), text };
        compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
    }

    /// A scan of triangles with a chord of 0.3 mm whose corners are exact points of the part at another radius,
    /// measured from the part.
    fn measured(part: &str, radius: f64) -> (Weighed, Measurement) {
        let program = compiled(part);
        let instance = Model::instantiate(&program, &[radius]).unwrap();
        let mesh =
            Tessellation::new(&program, &*instance, Fineness { chord: 0.3, ..Fineness::default() }).unwrap().mesh;
        // Of a quadratic height h over a triangle, the mean of the interpolated less the true height is the sum over
        // the edges e of h(e, e) / 24, and of a sphere that is -e^2 / 24 R.
        let mut expected = Weighed::default();
        for corners in &mesh.triangles {
            let [a, b, c] = corners.map(|corner| DVec3::from(mesh.positions[corner as usize]));
            let area = 0.5 * (b - a).cross(c - a).length();
            let edges: f64 = [b - a, c - b, a - c].iter().map(|edge| edge.length_squared()).sum();
            expected.area += area;
            expected.moment -= area * edges / (24.0 * radius);
        }
        let scan = from_mesh(mesh, "scan").unwrap();
        let options =
            MeasureOptions { resolution: Resolution::Side(256), device: Device::Cpu, ..MeasureOptions::default() };
        let reference = Reference::Model { model: &program, x: &[RADIUS], motion: Motion::IDENTITY };
        (expected, measure(reference, &scan, None, &options, &Silent).unwrap())
    }

    /// An area, and the sum of some lengths times the areas that they belong to.
    #[derive(Default)]
    struct Weighed {
        area: f64,
        moment: f64,
    }

    #[test]
    fn the_sag_of_a_ball_is_that_of_its_edges_and_what_remains_is_the_deviation() {
        for radius in [20.0, 20.4] {
            let (expected, found) = measured("part ball = sphere(r)", radius);
            let (deviations, part) = (&found.deviations, &found.report.parts[0]);
            let (sag, mean) = (part.sag.unwrap(), part.statistics.weighted.signed.mean);
            // Terms of the fourth order, and area that is not measured as the mesh's own.
            let mean_sag = expected.moment / expected.area;
            assert!((sag.mean / mean_sag - 1.0).abs() < 0.03, "{} {mean_sag}", sag.mean);
            assert!((-0.32..-0.2).contains(&sag.largest), "{}", sag.largest);
            // Normals of corners turn by some 10 degrees from the texel's: a cosine of 0.985 of 0.4 mm.
            let exact = 0.02 * (radius - RADIUS) + 2e-3;
            assert!((mean - sag.mean - (radius - RADIUS)).abs() < exact, "{mean} {}", sag.mean);
            let wrong = |i: usize| (f64::from(deviations.without_sag(i)) - (radius - RADIUS)).abs();
            let known: Vec<usize> = (0..deviations.texels.len()).filter(|i| deviations.sag[*i].is_finite()).collect();
            assert!(known.len() > deviations.texels.len() * 9 / 10);
            let worst = known.into_iter().map(wrong).fold(0.0, f64::max);
            assert!(worst < exact, "{radius}: {worst}");
        }
    }

    #[test]
    fn nothing_flat_has_a_sag_and_a_hollow_one_is_outside() {
        let (_, flat) = measured("part plate = disc(r)", RADIUS);
        let sag = flat.report.parts[0].sag.unwrap();
        assert!(sag.mean.abs() < 1e-9 && sag.largest.abs() < 1e-9, "{sag:?}");
        assert_eq!(flat.report.sag_sentence(|x| x.to_string()), None);
        let (_, hollow) = measured("part hollow = flip(sphere_zone(r, -60deg, 60deg))", RADIUS);
        let sag = hollow.report.parts[0].sag.unwrap();
        assert!(sag.mean > 0.1, "{sag:?}");
        let said = hollow.report.sag_sentence(|x| format!("{x:.1}")).unwrap();
        assert!(said.contains(&format!("by {:.1} mm on hollow", sag.mean)), "{said}");
    }

    /// A ball that is 0.25 mm too large, by a scan whose triangles lie up to 0.3 mm, and 0.15 mm on the average, inside
    /// of it: its rays alone would say that it is nearly as it should be.
    #[test]
    fn a_verdict_is_free_of_sag() {
        for (radius, outcome) in [(20.25, Outcome::DoesNotConform), (20.15, Outcome::Conforms)] {
            let (_, found) = measured("part ball tolerance 0.2mm = sphere(r)", radius);
            let verdict = found.report.parts[0].verdict.as_ref().unwrap();
            assert_eq!(verdict.outcome, outcome, "{verdict:?}");
            assert!((verdict.value - (radius - RADIUS)).abs() < 5e-3, "{verdict:?}");
            let mean = found.report.parts[0].statistics.weighted.signed.mean;
            assert!(mean < radius - RADIUS - 0.1, "{mean}");
        }
    }
}
