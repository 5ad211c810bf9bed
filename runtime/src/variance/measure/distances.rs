//! The distances from the texels to the scan, and from its points to the surface.

use super::{MeasureError, MeasureOptions, unless_cancelled};
use crate::bvh::Bvh;
use crate::mesh::TriangleMesh;
use crate::model::{Tessellation, Texels};
use crate::progress::Progress;
use crate::scan::Scan;
use crate::variance::cast::{self, Cast, hide_behind_filled};
use crate::variance::cloud::{self, Cloud, CloudFeet, CylinderSummary, Cylinders, Sample, cylinders};
use crate::variance::contradicted::contradicted;
use crate::variance::hits::{Hit, hits};
use crate::variance::holes::FilledHoles;
use crate::variance::matching::refuse_foreign;
use crate::variance::points::{PointFeet, PointSearch};
use crate::variance::scan_colours::{ScanColours, Tints};
use crate::variance::{CastError, Deviations, DistanceKind, Facing, Matching, noise};
use std::time::Instant;

/// What distances are found of.
pub(super) struct Grounded<'a> {
    pub(super) tessellation: &'a Tessellation,
    /// The hierarchy over the tessellation.
    pub(super) model: &'a Bvh,
    pub(super) search: PointSearch<'a>,
    pub(super) scan: &'a Scan,
    /// Millimetres.
    pub(super) max_distance: f64,
    pub(super) options: &'a MeasureOptions,
    pub(super) progress: &'a dyn Progress,
}

/// Distances both ways.
pub(super) struct Found {
    pub(super) deviations: Deviations,
    /// What measured them.
    pub(super) device: String,
    /// A sentence if another device than the requested one did.
    pub(super) notice: Option<String>,
    /// Closed holes of the scan, if any were to be closed.
    pub(super) holes: Option<FilledHoles>,
    /// The number of the scan's spikes.
    pub(super) spikes: usize,
    /// The places of the surface that are nearest to the scan's points.
    pub(super) feet: PointFeet,
    /// The places of the scan's triangles that the texels have their distances from; empty of clouds.
    pub(super) hits: Vec<Option<Hit>>,
    /// The feet of a cloud, in order of use.
    pub(super) cloud: Option<CloudFeet>,
    /// How distances to a cloud were measured.
    pub(super) cylinder: Option<CylinderSummary>,
    /// The scan's colours at the texels, if it has any.
    pub(super) colours: Option<ScanColours>,
    pub(super) seconds: Seconds,
}

/// Durations in seconds.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seconds {
    pub(super) cast: f64,
    pub(super) matching: f64,
    pub(super) points: f64,
}

impl Grounded<'_> {
    /// From texels whose normals turned by angles of these cosines, if any did; `buried` are those inside of the
    /// material. `bvh` is the hierarchy over the scan's triangles; none where it has points only.
    pub(super) fn find(
        &self,
        texels: Texels,
        cosine: Vec<f32>,
        buried: Vec<bool>,
        bvh: Option<&Bvh>,
    ) -> Result<Found, MeasureError> {
        match bvh {
            Some(bvh) => self.by_rays(texels, cosine, buried, bvh),
            None => self.by_cylinders(texels, cosine, buried),
        }
    }

    fn by_rays(&self, texels: Texels, cosine: Vec<f32>, buried: Vec<bool>, bvh: &Bvh) -> Result<Found, MeasureError> {
        let Self { scan, options, .. } = self;
        let started = Instant::now();
        let facing = if scan.oriented { Facing::Within(options.max_angle) } else { Facing::Any };
        let Cast { mut deviations, device, notice } = self.cast_rays(texels, bvh, facing)?;
        deviations.cosine = cosine;
        deviations.noise = scan.noise;
        let holes = options.fill_holes.map(|size| FilledHoles::new(&scan.mesh, size));
        if let Some(holes) = &holes {
            hide_behind_filled(&mut deviations, holes, bvh, facing, options.distance)?;
        }
        deviations.bury(buried);
        let cast = started.elapsed().as_secs_f64();
        unless_cancelled(self.progress)?;

        let started = Instant::now();
        let spikes = match options.matching {
            Matching::Mutual => {
                refuse_foreign(&mut deviations, options.distance, scan, bvh, self.tessellation, self.model)
            }
            Matching::All => 0,
        };
        let matching = started.elapsed().as_secs_f64();
        unless_cancelled(self.progress)?;
        let started = Instant::now();
        deviations.contradict(contradicted(&deviations, scan, bvh));
        let hits = hits(&deviations, options.distance, scan, bvh);
        let tints = Tints::of(&scan.attributes);
        let colours = tints.map(|tints| tints.of_hits(&hits, &scan.mesh, &deviations));
        unless_cancelled(self.progress)?;
        let cast = cast + started.elapsed().as_secs_f64();

        let started = Instant::now();
        let feet = self.feet();
        // Both pass shape for noise, where there is any that they do not know.
        deviations.noise =
            noise::along_normals(&scan.mesh, &feet.feet).map_or(scan.noise, |noise| noise.min(scan.noise));
        deviations.round(scan.rounding());
        let seconds = Seconds { cast, matching, points: started.elapsed().as_secs_f64() };
        let (cloud, cylinder) = (None, None);
        Ok(Found { deviations, device, notice, holes, spikes, feet, hits, cloud, cylinder, colours, seconds })
    }

    fn cast_rays(&self, texels: Texels, bvh: &Bvh, facing: Facing) -> Result<Cast, CastError> {
        let Self { max_distance, options, .. } = self;
        let mesh: &TriangleMesh = &self.scan.mesh;
        match options.distance {
            DistanceKind::Normal | DistanceKind::AveragedNormal => {
                cast::cast(texels, bvh, *max_distance, facing, options.device)
            }
            DistanceKind::Closest => cast::closest(texels, bvh, mesh, *max_distance, facing),
        }
    }

    fn by_cylinders(&self, texels: Texels, cosine: Vec<f32>, buried: Vec<bool>) -> Result<Found, MeasureError> {
        let Self { scan, options, max_distance, .. } = self;
        let started = Instant::now();
        let feet = self.feet();
        unless_cancelled(self.progress)?;
        let of_cloud = CloudFeet::new(scan, &feet);
        let cloud = Cloud::new(&of_cloud);
        let noise = noise::of_cloud(&cloud, &feet.feet).map_or(scan.noise, |noise| noise.min(scan.noise));
        let points = started.elapsed().as_secs_f64();
        unless_cancelled(self.progress)?;

        let started = Instant::now();
        let (kind, limits) = (options.distance, [*max_distance, noise]);
        let tints = Tints::of(&scan.attributes);
        let (Cylinders { mut deviations, radii, points: of_cylinder, .. }, means) = match &tints {
            None => (cylinders(texels, &cloud, kind, cosine, limits, &|_| ()), Vec::new()),
            Some(tints) => {
                let mean = |points: &[Sample]| tints.mean(points.iter().map(|sample| (sample.point, sample.weight())));
                cylinders(texels, &cloud, kind, cosine, limits, &mean).without_tints()
            }
        };
        deviations.noise = noise;
        deviations.round(scan.rounding());
        deviations.bury(buried);
        let summary = CylinderSummary::new(radii, of_cylinder, &deviations);
        let colours = tints.map(|tints| tints.colours(&means, &deviations));
        unless_cancelled(self.progress)?;
        deviations.contradict(cloud::contradicted(&deviations, scan, cloud.spacings()));
        let seconds = Seconds { cast: started.elapsed().as_secs_f64(), matching: 0.0, points };
        Ok(Found {
            deviations,
            device: "cpu".to_owned(),
            notice: None,
            holes: None,
            spikes: 0,
            feet,
            hits: Vec::new(),
            cloud: Some(of_cloud),
            cylinder: Some(summary),
            colours,
            seconds,
        })
    }

    fn feet(&self) -> PointFeet {
        self.search.feet(self.model, self.scan, self.max_distance, self.options.max_angle)
    }
}
