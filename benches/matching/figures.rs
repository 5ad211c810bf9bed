//! What is wrong, refused and lost of the area of some scans.

use crate::shape::Shape;
use gml_runtime::bvh::Bvh;
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::model::{Motion, Texels};
use gml_runtime::progress::Silent;
use gml_runtime::scan::Scan;
use gml_runtime::variance::{self, Device, Facing, MeasureOptions, Reference, Resolution, measure};

/// A distance is wrong that differs from the truth by so many standard deviations of the noise.
const WRONG: f64 = 5.0;

/// Side of the texture in texels.
const SIDE: u32 = 512;

/// The place that a ray meets is another than the texel's own if, without noise, its triangle makes an angle with the
/// texel's normal whose cosine is below this.
const OWN: f64 = 0.5;

/// Distance from the place that a ray meets within which its triangle is sought. Millimetres.
const ROUNDING: f64 = 0.01;

/// The heading of a table whose rows are figures.
pub(crate) const HEADING: &str = "\
| | wrong | refused of it | lost of the rest | own | sd | right | sd / right | rms | max | true rms | trace | matching | spikes |
|---|---|---|---|---|---|---|---|---|---|---|---|---|---|";

/// Signed distances weighted by area.
#[derive(Default)]
struct Sum {
    area: f64,
    first: f64,
    second: f64,
    /// Either way.
    largest: f64,
}

impl Sum {
    fn add(&mut self, area: f64, distance: f64) {
        self.area += area;
        self.first += area * distance;
        self.second += area * distance * distance;
        self.largest = self.largest.max(distance.abs());
    }

    fn rms(&self) -> f64 {
        (self.second / self.area).sqrt()
    }

    fn sd(&self) -> f64 {
        (self.second / self.area - (self.first / self.area).powi(2)).sqrt()
    }
}

/// Areas, sums over them, and times. Square millimetres, millimetres, seconds.
#[derive(Default)]
pub(crate) struct Figures {
    wrong: f64,
    refused: f64,
    good: f64,
    lost: f64,
    /// What is lost although the ray meets the texel's own surface.
    own: f64,
    /// All distances, those that are left, those that are not wrong, and the truth.
    before: Sum,
    after: Sum,
    right: Sum,
    truth: Sum,
    spikes: usize,
    trace: f64,
    matching: f64,
}

impl Figures {
    /// Adds what is measured of a scan of the shape, with the mutual test and, by rays alone, without.
    pub(crate) fn add(&mut self, shape: &Shape, (scan, exact): &(Scan, TriangleMesh)) {
        let mut options = MeasureOptions::default();
        options.resolution = Resolution::Side(SIDE);
        options.device = Device::Cpu;
        // Deviations of form, which nothing here uses, take little time behind so long a filter.
        options.form_cutoff = Some(1e6);
        let reference = Reference::Model { model: &shape.program, x: &shape.x, motion: Motion::IDENTITY };
        let mutual = measure(reference, scan, None, &options, &Silent).unwrap_or_else(|e| panic!("{e}"));
        let (report, mutual) = (mutual.report, mutual.deviations);
        let bvh = Bvh::build(&scan.mesh).unwrap_or_else(|e| panic!("{e}"));
        let facing = if scan.oriented { Facing::SAME } else { Facing::Any };
        let all = variance::cast(mutual.texels.clone(), &bvh, mutual.max_distance, facing, Device::Cpu);
        let all = all.unwrap_or_else(|e| panic!("{e}")).deviations;
        self.trace += report.seconds.cast;
        self.matching += report.seconds.matching;
        self.spikes += report.spikes;
        let texels = &all.texels;
        let truth = shape.truth(texels, all.max_distance);
        for i in 0..texels.len() {
            let [before, after] = [&all, &mutual].map(|deviations| f64::from(deviations.signed(i)));
            let (area, truth) = (f64::from(texels.area[i]), truth[i]);
            // Where the part itself is not met, the truth is not known; in the material nothing is measured.
            if before.is_nan() || truth.is_nan() || mutual.is_buried(i) {
                continue;
            }
            let is_off = |distance: f64| (distance - truth).abs() > WRONG * shape.noise();
            let (of, gone) = match is_off(before) {
                true => (&mut self.wrong, (!is_off(after)).then_some(&mut self.refused)),
                false => (&mut self.good, after.is_nan().then_some(&mut self.lost)),
            };
            *of += area;
            let is_gone = gone.is_some();
            if let Some(gone) = gone {
                *gone += area;
            }
            if is_gone && !is_off(before) && is_own(texels, i, before, &bvh, exact) {
                self.own += area;
            }
            self.before.add(area, before);
            self.truth.add(area, truth);
            if !after.is_nan() {
                self.after.add(area, after);
            }
            if !is_off(before) {
                self.right.add(area, before);
            }
        }
    }
}

/// Whether what the ray of texel i meets at a distance is the texel's own surface, by the triangle without noise.
fn is_own(texels: &Texels, i: usize, distance: f64, bvh: &Bvh, exact: &TriangleMesh) -> bool {
    let normal = texels.normal[i].map(f64::from);
    let met = [0, 1, 2].map(|k| texels.position[i][k] + distance * normal[k]);
    let met = bvh.closest_point_facing(met.into(), ROUNDING, normal.into(), 0.0);
    let across = met.and_then(|met| exact.triangle_normal(exact.triangles[met.triangle as usize]));
    across.is_some_and(|across| across.dot(normal.into()) > OWN)
}

impl std::fmt::Display for Figures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { before, after, right, truth, .. } = self;
        write!(
            f,
            "{:.2} % | {:.2} % | {:.2} % | {:.3} % | {:.3} -> {:.3} | {:.3} | {:.3} | {:.3} -> {:.3} | {:.2} -> {:.2} | {:.3} | {:.2} s | {:.3} s | {} |",
            100.0 * self.wrong / (self.wrong + self.good),
            100.0 * self.refused / self.wrong,
            100.0 * self.lost / self.good,
            100.0 * self.own / self.good,
            before.sd(),
            after.sd(),
            right.sd(),
            after.sd() / right.sd(),
            before.rms(),
            after.rms(),
            before.largest,
            after.largest,
            truth.rms(),
            self.trace,
            self.matching,
            self.spikes,
        )
    }
}
