//! The whole measurement of a scan against a surface.

mod distances;
mod error;
mod options;

pub use error::MeasureError;
pub use options::MeasureOptions;

use super::agreement::Limits;
use super::averaging::{DEFAULT_WIDTH, MAX_WIDTH, average_normals};
use super::cloud::{self, Cloud};
use super::detection::detect;
use super::explained::explain;
use super::form::{
    Members, ScanNoise, ScannedSurface, across_moved_edges, form_deviations, point_measures, recognise, relations,
    unfit,
};
use super::nothing::{self, Misfit};
use super::orientation::{Facings, turn, turn_mesh};
use super::peaks::peaks;
use super::points::{PointParts, PointSearch};
use super::reach::Reach;
use super::sag::{add_sag, sag};
use super::scanned::Scanned;
use super::surface::{Parametrised, Surface};
use super::unmatched::Unmatched;
use super::verdict::Grounds;
use super::{
    Deviations, Device, DistanceKind, Matching, MeasuredPoints, ParameterCovariance, PartStatistics, Reference,
    ScanColours, SensitivityRange, Tolerance, VarianceReport,
};
use crate::bvh::Bvh;
use crate::mesh::TriangleMesh;
use crate::model::{Sensitivities, SensitivityMaps, Tessellation, Texels};
use crate::progress::Progress;
use crate::scan::{Scan, TURNED};
use distances::{Found, Grounded};
use std::time::Instant;

/// The maximum distance as a fraction of the model's diagonal, unless the options name one.
const MAX_DISTANCE: f64 = 0.1;

/// The maximum distance in units of the farthest limit of a tolerance, at least. What is farther away than the maximum
/// distance is not measured at all, and so no reason to reject a part: at this factor what is beyond a tolerance by
/// less than its width is measured.
const BEYOND_TOLERANCE: f64 = 2.0;

/// Standard deviations of the scan's noise by which the maximum distance exceeds that.
const BEYOND_NOISE: f64 = 5.0;

/// Deviations with everything that documents show of them.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Measurement {
    /// The surface, in the scan's position.
    pub tessellation: Tessellation,
    /// The same surface in few triangles of like size, for documents whose viewers divide them until a vertex has a
    /// texel. A reference mesh of many triangles has all of them.
    pub displayed: Tessellation,
    /// The distances.
    pub deviations: Deviations,
    /// Statistics: the content of variance.json.
    pub report: VarianceReport,
    /// The scan's points with their distances from the surface.
    pub points: MeasuredPoints,
    /// The triangles of the scan that the model does not explain, or of a cloud the points.
    pub unmatched: TriangleMesh,
    /// The triangles that close holes of the scan, if that was requested.
    pub filled: Option<TriangleMesh>,
    /// For every texel the probability that the surface there is within its part's tolerance, NaN where there is none
    /// or nothing was measured; none if no part has a tolerance.
    pub conformance: Option<Vec<f32>>,
    /// Maps of the surface's movement per unit of each parameter, if they were requested.
    pub sensitivity_maps: Option<SensitivityMaps>,
    /// The scan's colours at the texels, or its intensities as greys, if it has any.
    pub scan_colours: Option<ScanColours>,
}

/// Measures the deviations of a scan from a surface (\[VA\] sect. 5 and 6): casts rays from the texels of the surface,
/// or takes the points of a cloud in cylinders about their normals, computes statistics, tolerances, levels of
/// detection and deviations of form, and finds what the model does not explain. `covariance` is that of the fitted
/// parameters, if the model was fitted.
///
/// # Errors
/// If holes of a point cloud are to be closed, the surface cannot be evaluated or has no texture, no hierarchy can be
/// built, or an option is out of range.
pub fn measure(
    reference: Reference<'_>,
    scan: &Scan,
    covariance: Option<ParameterCovariance<'_>>,
    options: &MeasureOptions,
    progress: &dyn Progress,
) -> Result<Measurement, MeasureError> {
    require_what_scan_has(scan, options)?;
    progress.report("sampling the surface", f64::NAN, "");
    let mut surface = Surface::new(reference, options.resolution, options.atlas.as_deref(), progress)?;
    let tolerances: Vec<Option<Tolerance>> = surface.tolerances.iter().map(|t| t.or(options.tolerance)).collect();
    let size = surface.tessellation.mesh.bounds().diagonal();
    let max_distance = max_distance(options.max_distance, size, &tolerances, scan.noise)?;
    let is_cloud = scan.mesh.triangles.is_empty();
    let size = if is_cloud { scan.source.points } else { scan.mesh.triangles.len() };
    progress.report(
        "building hierarchy",
        f64::NAN,
        &format!("{size} {}", if is_cloud { "points" } else { "triangles" }),
    );
    let started = Instant::now();
    let unusable = |error| MeasureError::Scan { path: scan.source.path.clone(), error };
    let hierarchy = |scan: &Scan| if is_cloud { Ok(None) } else { Bvh::build(&scan.mesh).map(Some) };
    unless_cancelled(progress)?;
    let bvh = hierarchy(scan).map_err(unusable)?;
    unless_cancelled(progress)?;
    let build = started.elapsed().as_secs_f64();

    let mut displayed = surface.displayed()?;
    if surface.inverted.contains(&true) {
        turn(&mut surface.texels, &mut surface.tessellation.mesh, &surface.inverted);
        displayed.iter_mut().for_each(|displayed| turn_mesh(&mut displayed.mesh, &surface.inverted));
    }
    let Facings { reversed, contested } = facings(&surface, scan, bvh.as_ref(), max_distance)?;
    let turned = reversed.then(|| scan.turned());
    let scan = turned.as_ref().unwrap_or(scan);
    let bvh = if reversed { hierarchy(scan).map_err(unusable)? } else { bvh };
    let sensitivities = surface.sensitivities()?;
    let maps = if options.sensitivity_maps { surface.sensitivity_maps()? } else { None };
    let work = if is_cloud { "measuring in cylinders" } else { "casting rays" };
    progress.report(work, f64::NAN, &format!("{} texels", surface.texels.len()));
    unless_cancelled(progress)?;
    let Surface { mut tessellation, mut texels, notices, seconds, buried, parametrised, inverted, .. } = surface;
    // Forms are those of the surface itself, before normals are averaged.
    let shapes = recognise(&texels);
    require_datum(options.datum.as_deref(), &texels.part_names, |part| shapes[part].is_some())?;
    let (averaging_width, cosine) = averaged(&mut texels, &mut tessellation, displayed.as_mut(), options)?;
    let displayed = displayed.unwrap_or_else(|| tessellation.displayed(&texels));
    unless_cancelled(progress)?;
    let model = Bvh::build(&tessellation.mesh).map_err(MeasureError::Surface)?;
    let search = PointSearch { parametrised: parametrised.as_ref(), inverted: &inverted, mesh: &tessellation.mesh };
    let grounded =
        Grounded { tessellation: &tessellation, model: &model, search, scan, max_distance, options, progress };
    let Found { mut deviations, device, notice, holes, spikes, feet, hits, cloud, cylinder, colours, seconds: spent } =
        grounded.find(texels, cosine, buried, bvh.as_ref())?;
    unless_cancelled(progress)?;

    let started = Instant::now();
    let mut report = VarianceReport::new(&deviations, &scan.source, &device, &tolerances);
    let misfit = nothing::likely(&report.overall, &deviations, scan, parametrised.is_none());
    if let Some(Misfit::Nothing(likely)) = misfit {
        return Err(MeasureError::Nothing { path: scan.source.path.clone(), likely });
    }
    unless_cancelled(progress)?;
    assess_parts(&mut report, &deviations, sensitivities.as_ref(), covariance);
    if let Some(Parametrised { reach, .. }) = &parametrised {
        keep_within(&mut report, reach);
    }
    let fit = sensitivities.as_ref().zip(covariance);
    let surface = ScannedSurface { feet: &feet.feet, bvh: &model };
    let cloud = cloud.as_ref().map(Cloud::new);
    let scanned = match (&cloud, &bvh) {
        (None, Some(bvh)) => Scanned::Triangles { mesh: &scan.mesh, bvh },
        (cloud, _) => Scanned::Points { mesh: &scan.mesh, cloud: cloud.as_ref() },
    };
    if !is_cloud {
        let bridges = surface.on_bridges(&scan.mesh, deviations.noise, &deviations.texels, &hits);
        let moved = across_moved_edges(&deviations, &shapes, &scan.mesh, &hits);
        deviations.mark_bridged(bridges, &moved);
        deviations.sag = sag(&deviations, options.distance, &scan.mesh, &hits, &feet.feet);
        add_sag(&mut report.parts, &deviations);
    }
    let noise = ScanNoise { sd: deviations.noise, density: scanned.density() };
    let forms = form_deviations(&deviations, &shapes, noise, options.form_cutoff);
    report.parts.iter_mut().zip(forms).for_each(|(part, form)| part.form = form);
    unless_cancelled(progress)?;
    let grounds = Grounds { deviations: &deviations, scanned, fit, options: options.verdict };
    let conformance = grounds.assess(&mut report);
    unless_cancelled(progress)?;
    let limits: Vec<Limits> = tolerances.iter().map(|t| Limits::new(*t, deviations.noise)).collect();
    let parts = PointParts { names: &deviations.texels.part_names, limits: &limits, precision: deviations.precision };
    let (point_distances, points) = feet.distances(scan, parts);
    report.points = Some(point_distances);
    report.peaks = peaks(&deviations, &tessellation, &report);
    let members = || Members::new(&deviations, &shapes, &tessellation, scanned);
    add_members(&mut report, reference, members, options.datum.as_deref());
    if let Some(maps) = &maps {
        let range = |map| SensitivityRange::new(map, &maps.texels, &deviations.texels);
        report.sensitivities = maps.maps.iter().map(range).collect();
    }
    report.distance = options.distance.name().to_owned();
    report.matching = if is_cloud { Matching::Mutual } else { options.matching }.name().to_owned();
    report.cylinder = cylinder;
    report.colour = colours.as_ref().map(|colours| colours.summary.clone());
    report.spikes = spikes;
    report.averaging_width = averaging_width;
    report.holes = holes.as_ref().map(|h| h.summary.clone());
    report.seconds.texels = seconds;
    report.seconds.build = build;
    report.seconds.cast = spent.cast;
    report.seconds.matching = spent.matching;
    report.seconds.points = spent.points;
    report.seconds.statistics = started.elapsed().as_secs_f64();
    report.warnings.extend(scan.warnings.iter().cloned().chain(notices));
    report.warnings.extend(notice);
    if let Some(Misfit::Little(likely)) = misfit {
        report.warnings.push(likely);
    }
    if is_cloud {
        report.warnings.extend(cloud_warnings(options));
    } else if (options.distance, options.device) == (DistanceKind::Closest, Device::Gpu) {
        report.warnings.push("the GPU only casts rays: native code found the closest points".to_owned());
    }
    if reversed {
        report.warnings.push(TURNED.to_owned());
    }
    report.warnings.extend(turned_parts(&contested, &report));

    unless_cancelled(progress)?;
    progress.report("finding what the model does not explain", f64::NAN, "");
    let started = Instant::now();
    let unmatched = match is_cloud {
        true => cloud::unmatched(scan, &feet, &scanned),
        false => Unmatched::new(&scan.mesh, &model, max_distance, scan.oriented),
    };
    report.unmatched = Some(unmatched.summary);
    report.seconds.unmatched = started.elapsed().as_secs_f64();
    Ok(Measurement {
        tessellation,
        displayed,
        deviations,
        report,
        points,
        unmatched: unmatched.mesh,
        filled: holes.map(|h| h.mesh),
        conformance,
        sensitivity_maps: maps,
        scan_colours: colours,
    })
}

/// A sentence on parts that face the other side of the scan, if there are any. What rests unseen on another part faces
/// that part's side, which says nothing.
fn turned_parts(contested: &[String], report: &VarianceReport) -> Option<String> {
    let is_hidden = |part: &PartStatistics| 2.0 * part.statistics.ambiguous_area > part.statistics.area;
    let hidden = |name: &str| report.parts.iter().any(|part| part.name == name && is_hidden(part));
    let parts: Vec<&str> = contested.iter().map(String::as_str).filter(|name| !hidden(name)).collect();
    (!parts.is_empty()).then(|| {
        let parts = parts.join(", ");
        format!(
            "the outer side of {parts} faces the inner one of the scan: signs are the model's, and `flip` would turn them"
        )
    })
}

/// Whether a scan has what the options ask for: a point cloud has no triangles, and so no edges of holes.
///
/// # Errors
/// [`MeasureError::HolesOfCloud`].
pub fn require_what_scan_has(scan: &Scan, options: &MeasureOptions) -> Result<(), MeasureError> {
    if scan.mesh.triangles.is_empty() && options.fill_holes.is_some() {
        return Err(MeasureError::HolesOfCloud { path: scan.source.path.clone() });
    }
    Ok(())
}

/// Which way the scan faces, compared with the surface; nothing of a cloud whose sides are not known. `bvh` is the
/// hierarchy over its triangles, none of a cloud.
fn facings(surface: &Surface<'_>, scan: &Scan, bvh: Option<&Bvh>, max_distance: f64) -> Result<Facings, MeasureError> {
    let Some(bvh) = bvh else {
        if !scan.oriented {
            return Ok(Facings::default());
        }
        let mesh = &surface.tessellation.mesh;
        let model = Bvh::build(mesh).map_err(MeasureError::Surface)?;
        let search = PointSearch { parametrised: surface.parametrised.as_ref(), inverted: &surface.inverted, mesh };
        return Ok(cloud::facings(&search, &model, scan, &surface.texels.part_names, max_distance));
    };
    Ok(Facings::of(&surface.texels, &scan.mesh, bvh, max_distance))
}

/// Sentences on options that say something of rays only.
fn cloud_warnings(options: &MeasureOptions) -> Vec<String> {
    let mut warnings = Vec::new();
    if options.device == Device::Gpu {
        warnings.push("the GPU only casts rays: native code measured the distances to the cloud".to_owned());
    }
    if options.matching == Matching::All {
        warnings.push(
            "`--matching all` says something of rays: a point of a cloud belongs to the nearest place of the model alone"
                .to_owned(),
        );
    }
    warnings
}

/// Whether a part of a name, if there is a name, can be a datum. `has_form` says whether a part has a form.
///
/// # Errors
/// [`MeasureError::Datum`].
pub fn require_datum(
    name: Option<&str>,
    parts: &[String],
    has_form: impl Fn(usize) -> bool,
) -> Result<(), MeasureError> {
    let reason = name.and_then(|name| unfit(name, parts, has_form));
    reason.map_or(Ok(()), |reason| Err(MeasureError::Datum { reason }))
}

/// Adds what the points of the parts show of the script's measures, and of how the parts lie to the datum.
fn add_members<'m>(
    report: &mut VarianceReport,
    reference: Reference<'_>,
    members: impl FnOnce() -> Members<'m>,
    datum: Option<&str>,
) {
    let measured = match reference {
        Reference::Model { model, x, .. } => model.measures().iter().any(|m| !m.parts.is_empty()).then_some((model, x)),
        Reference::Mesh(_) => None,
    };
    if measured.is_none() && datum.is_none() {
        return;
    }
    let members = members();
    if let Some((model, x)) = measured {
        report.point_measures = point_measures(model, x, &members);
    }
    if let Some(name) = datum {
        report.datum = relations(&members, name);
        if report.datum.is_none() {
            report.warnings.push(format!("nothing can be said of the datum: too little of `{name}` was measured"));
        }
    }
}

/// The maximum distance in millimetres: as `requested`, or a tenth of the model's `size` and what the tolerances need.
fn max_distance(
    requested: Option<f64>,
    size: f64,
    tolerances: &[Option<Tolerance>],
    noise: f64,
) -> Result<f64, MeasureError> {
    let limits = tolerances.iter().flatten().map(|t| t.lower.abs().max(t.upper.abs()));
    let Some(limit) = limits.max_by(f64::total_cmp) else {
        return match requested {
            None if !(size > 0.0) => Err(MeasureError::NoExtent),
            None => Ok(MAX_DISTANCE * size),
            Some(max_distance) => Ok(max_distance),
        };
    };
    let least = BEYOND_TOLERANCE * limit + BEYOND_NOISE * noise;
    match requested {
        Some(max_distance) if max_distance < least => Err(MeasureError::MaxDistance { max_distance, limit, least }),
        Some(max_distance) => Ok(max_distance),
        None => Ok(least.max(MAX_DISTANCE * size)),
    }
}

/// Whether the work goes on.
///
/// # Errors
/// [`MeasureError::Interrupted`], once the user wants the work to end.
pub(in crate::variance) fn unless_cancelled(progress: &dyn Progress) -> Result<(), MeasureError> {
    if progress.cancelled() { Err(MeasureError::Interrupted) } else { Ok(()) }
}

/// Averages normals if the options say so. Returns the width of the bands in which they turn (none for a reference
/// mesh), and the cosines of the angles by which the texels' normals turned.
fn averaged(
    texels: &mut Texels,
    tessellation: &mut Tessellation,
    displayed: Option<&mut Tessellation>,
    options: &MeasureOptions,
) -> Result<(Option<f64>, Vec<f32>), MeasureError> {
    if options.distance != DistanceKind::AveragedNormal {
        return Ok((None, Vec::new()));
    }
    let size = tessellation.mesh.bounds().diagonal();
    let width = options.averaging_width.unwrap_or(DEFAULT_WIDTH * size);
    let most = MAX_WIDTH * size;
    if width > most {
        return Err(MeasureError::AveragingWidth { width, most });
    }
    let cosine = average_normals(texels, tessellation, displayed, width).map_err(MeasureError::Surface)?;
    Ok(((!tessellation.origins.is_empty()).then_some(width), cosine))
}

/// Takes out the changes of parameters that the model cannot make.
fn keep_within(report: &mut VarianceReport, reach: &Reach) {
    for (patch, part) in report.parts.iter_mut().enumerate() {
        if let Some(explained) = &mut part.explained {
            explained.parameters.retain(|effect| reach.contains(patch, effect));
        }
    }
}

/// Adds levels of detection, and what changes of the parameters would explain, to each part.
fn assess_parts(
    report: &mut VarianceReport,
    deviations: &Deviations,
    sensitivities: Option<&Sensitivities>,
    covariance: Option<ParameterCovariance<'_>>,
) {
    let detected = detect(deviations, deviations.noise, sensitivities.zip(covariance));
    report.parts.iter_mut().zip(detected).for_each(|(part, detection)| part.detection = Some(detection));
    if let Some(sensitivities) = sensitivities {
        let explained = explain(deviations, sensitivities);
        report.parts.iter_mut().zip(explained).for_each(|(part, explained)| part.explained = explained);
    }
}

#[cfg(test)]
mod tests;
