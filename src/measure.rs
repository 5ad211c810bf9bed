//! What `variance` and `inspect` share: measuring a scan from a surface.

use crate::cli::{DeviceArg, DistanceArg, VarianceControls};
use crate::error::CommandError;
use crate::values;
use gml_compiler::program::Program;
use gml_runtime::bvh::{Bvh, BvhError};
use gml_runtime::export::picture;
use gml_runtime::fit::FitResult;
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::model::{
    Atlas, AtlasError, Fineness, LARGEST, Model, Motion, ReferenceSurface, SMALLEST, Sensitivities, SensitivityMaps,
    Tessellation, Texels,
};
use gml_runtime::progress::Progress;
use gml_runtime::scan::Scan;
use gml_runtime::variance::{
    self, Deviations, Device, DistanceTexture, Facing, FilledHoles, ParameterCovariance, SensitivityRange, Tolerance,
    Towards, Trace, Unmatched, VarianceReport,
};
use std::time::Instant;

/// Edges that fit into the model's size: documents displace the vertices, so that detail needs them close together.
const EDGES_ACROSS: f64 = 150.0;

/// The file of what of the scan the model does not explain.
pub(crate) const UNMATCHED: &str = "unmatched.ply";

/// A surface to measure from, in the scan's position.
#[derive(Debug)]
pub(crate) struct Surface {
    /// Triangles with texture coordinates.
    pub(crate) tessellation: Tessellation,
    /// Origins of the rays.
    pub(crate) texels: Texels,
    /// How long the texels took.
    seconds: f64,
    /// How it moves where parameters change; none for a mesh.
    pub(crate) sensitivities: Option<Sensitivities>,
    /// Likewise all over the texture, where that was asked for.
    pub(crate) maps: Option<SensitivityMaps>,
    /// Of each part, where the script gives one.
    pub(crate) tolerances: Vec<Option<Tolerance>>,
    /// Sentences for the user.
    pub(crate) notices: Vec<String>,
}

/// Deviations with everything that is drawn from them.
#[derive(Debug)]
pub(crate) struct Measured {
    /// The surface.
    pub(crate) tessellation: Tessellation,
    /// The deviations.
    pub(crate) deviations: Deviations,
    /// The coded texture.
    pub(crate) texture: DistanceTexture,
    /// Statistics.
    pub(crate) report: VarianceReport,
    /// Where colour scales end. Millimetres.
    pub(crate) colour_range: f64,
    /// What of the scan the model does not explain.
    pub(crate) unmatched: TriangleMesh,
    /// What closes holes of the scan, where that was asked for.
    pub(crate) filled: Option<TriangleMesh>,
    /// How far the surface moves where parameters change, where that was asked for.
    pub(crate) maps: Option<SensitivityMaps>,
    /// Whether the distances are written as OpenEXR, too.
    pub(crate) exr: bool,
}

impl Surface {
    /// The surface of a model at x, moved.
    pub(crate) fn of_program(
        program: &Program,
        x: &[f64],
        motion: &Motion,
        settings: &Settings,
    ) -> Result<Surface, CommandError> {
        let started = Instant::now();
        let instance = Model::instantiate(program, x).map_err(CommandError::failed)?;
        let atlas = match settings.resolution {
            Resolution::Side(size) => Atlas::new(program, &*instance, size),
            Resolution::Texel(edge) => Atlas::with_texels_of(program, &*instance, edge),
        };
        let atlas = atlas.map_err(CommandError::failed)?;
        let mut texels = Texels::of_model(program, &*instance, &atlas).map_err(CommandError::failed)?;
        let seconds = started.elapsed().as_secs_f64();
        let tessellate = |fineness| Tessellation::new(program, &*instance, fineness).map_err(CommandError::failed);
        let size = diagonal(&tessellate(Fineness::default())?.mesh);
        let edge = if size > 0.0 { size / EDGES_ACROSS } else { f64::INFINITY };
        let mut tessellation = tessellate(Fineness { edge, ..Fineness::default() })?.with_atlas(&atlas);
        motion.move_texels(&mut texels);
        motion.move_tessellation(&mut tessellation);
        let sensitivities =
            Sensitivities::new(program, &*instance, &atlas, &texels, motion).map_err(CommandError::failed)?;
        let maps = if settings.sensitivities {
            let maps = SensitivityMaps::new(program, &*instance, &atlas, &texels, motion);
            Some(maps.map_err(CommandError::failed)?)
        } else {
            None
        };
        let own = program.tolerances(x).map_err(CommandError::failed)?;
        let tolerances = own.iter().map(|t| t.map(|t| Tolerance { lower: -t, upper: t })).collect();
        let (sensitivities, notices) = (Some(sensitivities), Vec::new());
        Ok(Surface { tessellation, texels, seconds, sensitivities, maps, tolerances, notices })
    }

    /// The surface of a mesh from elsewhere.
    pub(crate) fn of_mesh(mesh: &TriangleMesh, resolution: Resolution) -> Result<Surface, CommandError> {
        let area: f64 = mesh.triangles.iter().map(|t| mesh.triangle_area(*t)).sum();
        let (mut size, edge) = match resolution {
            Resolution::Side(size) => (size, f64::INFINITY),
            // No texture is used more than wholly.
            Resolution::Texel(edge) => ((area.sqrt() / edge).min(f64::from(LARGEST)) as u32, edge),
        };
        let started = Instant::now();
        loop {
            size = size.next_power_of_two().clamp(SMALLEST, LARGEST);
            let found = ReferenceSurface::new(mesh, size).map_err(CommandError::failed)?;
            let own = (area / found.texels.len().max(1) as f64).sqrt();
            if own <= edge {
                let ReferenceSurface { tessellation, texels, notices } = found;
                let tolerances = vec![None; texels.part_names.len()];
                let seconds = started.elapsed().as_secs_f64();
                return Ok(Surface {
                    tessellation,
                    texels,
                    seconds,
                    sensitivities: None,
                    maps: None,
                    tolerances,
                    notices,
                });
            }
            if size == LARGEST {
                return Err(CommandError::failed(AtlasError::TooFine { edge, least: own }));
            }
            size *= 2;
        }
    }
}

/// How fine a texture is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Resolution {
    /// So many texels a side.
    Side(u32),
    /// Texels so many millimetres wide.
    Texel(f64),
}

impl Resolution {
    /// A whole number, which must be a power of two because viewers of X3D resample other textures, or a length.
    fn of(text: &str) -> Result<Resolution, CommandError> {
        let Ok(size) = text.trim().parse::<u32>() else {
            return values::positive_length("--resolution", text).map(Resolution::Texel);
        };
        if size.is_power_of_two() && (SMALLEST..=LARGEST).contains(&size) {
            return Ok(Resolution::Side(size));
        }
        Err(CommandError::usage(format!(
            "--resolution {size}: must be a power of two from {SMALLEST} to {LARGEST}, such as 1024, or a length such as 0.2mm"
        )))
    }
}

/// What the options say, read once, before any work is done.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    /// Of the texture.
    pub(crate) resolution: Resolution,
    max_distance: Option<f64>,
    /// The largest angle between the normals, in radians.
    max_angle: f64,
    /// Of parts to which the script gives none.
    tolerance: Option<Tolerance>,
    averaging_width: Option<f64>,
    /// How large holes of the scan are that are closed.
    fill_holes: Option<f64>,
    distance: DistanceArg,
    device: DeviceArg,
    /// Whether maps of sensitivities are drawn.
    pub(crate) sensitivities: bool,
    exr: bool,
}

impl Settings {
    /// Of the command line.
    pub(crate) fn of(controls: &VarianceControls) -> Result<Settings, CommandError> {
        let length =
            |option: &str, text: &Option<String>| text.as_ref().map(|t| values::positive_length(option, t)).transpose();
        let averaging_width = length("--averaging-width", &controls.averaging_width)?;
        if averaging_width.is_some() && controls.distance != DistanceArg::AveragedNormal {
            return Err(CommandError::usage("--averaging-width says something only with --distance averaged-normal"));
        }
        let tolerance = controls.tolerance.as_ref().map(|t| values::tolerance("--tolerance", t));
        Ok(Settings {
            resolution: Resolution::of(&controls.resolution)?,
            max_distance: length("--max-distance", &controls.max_distance)?,
            tolerance: tolerance.transpose()?.map(|(lower, upper)| Tolerance { lower, upper }),
            averaging_width,
            fill_holes: length("--fill-holes", &controls.fill_holes)?,
            max_angle: values::acute_angle("--max-angle", &controls.max_angle)?,
            distance: controls.distance,
            device: controls.device,
            sensitivities: controls.sensitivities,
            exr: controls.exr,
        })
    }
}

/// Casts the rays and draws the statistics from them. Without a distance, the scan is looked for within a tenth of the
/// model's size.
pub(crate) fn measure(
    surface: Surface,
    scan: &Scan,
    fitted: Option<&FitResult>,
    settings: &Settings,
    progress: &dyn Progress,
) -> Result<Measured, CommandError> {
    let Surface { mut tessellation, mut texels, seconds, mut sensitivities, mut maps, tolerances, notices } = surface;
    let max_distance = settings.max_distance.unwrap_or_else(|| 0.1 * diagonal(&tessellation.mesh));
    progress.report("building hierarchy", f64::NAN, &format!("{} triangles", scan.mesh.triangles.len()));
    let started = Instant::now();
    let bvh = Bvh::build(&scan.mesh).map_err(|e| CommandError::Failed(format!("{}: {e}", scan.source.path)))?;
    let build = started.elapsed().as_secs_f64();
    let flipped = variance::agree_with_scan(&mut texels, &mut tessellation.mesh, &scan.mesh, &bvh, max_distance);
    progress.report("casting rays", f64::NAN, &format!("{} texels", texels.len()));
    let started = Instant::now();
    if progress.cancelled() {
        return Err(crate::fit::interrupted());
    }
    if let Some(maps) = &mut maps {
        maps.turn(&texels, &flipped);
    }
    if let Some(sensitivities) = &mut sensitivities {
        sensitivities.turn(&texels, &flipped);
    }
    // Forms are those of the surface as it is, before normals are averaged.
    let shapes = variance::recognise(&texels);
    let (averaging_width, cosine) = average_normals(&mut texels, &mut tessellation, settings)?;
    let Trace { mut deviations, device, notice } = cast(texels, scan, &bvh, max_distance, settings)?;
    deviations.cosine = cosine;
    let holes = fill_holes(&mut deviations, scan, &bvh, settings)?;
    if progress.cancelled() {
        return Err(crate::fit::interrupted());
    }
    let cast = started.elapsed().as_secs_f64();
    let started = Instant::now();
    let tolerances: Vec<Option<Tolerance>> = tolerances.into_iter().map(|own| own.or(settings.tolerance)).collect();
    let mut report = VarianceReport::with_tolerances(&deviations, &scan.source, &device, &tolerances);
    assess_parts(&mut report, &deviations, scan.noise, sensitivities.as_ref(), fitted);
    let forms = variance::form_deviations(&deviations, &shapes);
    report.parts.iter_mut().zip(forms).for_each(|(part, form)| part.form = form);
    if let Some(maps) = &maps {
        let range = |map| SensitivityRange::of(map, &maps.texels, &deviations.texels);
        report.sensitivities = maps.maps.iter().map(range).collect();
    }
    report.distance = settings.distance.name().to_owned();
    report.averaging_width = averaging_width;
    report.holes = holes.as_ref().map(|h| h.summary.clone());
    report.seconds.texels = seconds;
    report.seconds.build = build;
    report.seconds.trace = cast;
    report.seconds.statistics = started.elapsed().as_secs_f64();
    report.warnings.extend(notices);
    report.warnings.extend(notice);
    if (settings.distance, settings.device) == (DistanceArg::Closest, DeviceArg::Gpu) {
        report.warnings.push("closest points are found by native code; the GPU casts rays only".to_owned());
    }
    if !flipped.is_empty() {
        report.warnings.push(format!(
            "the script's normals of {} point into the material: they were turned to agree with the scan",
            flipped.join(", ")
        ));
    }
    progress.report("looking for what the model does not explain", f64::NAN, "");
    let started = Instant::now();
    let unmatched = Unmatched::new(&scan.mesh, &tessellation.mesh, max_distance, scan.oriented);
    let unmatched = unmatched.map_err(|e| surface_failed(&e))?;
    report.unmatched = Some(unmatched.summary);
    report.seconds.unmatched = started.elapsed().as_secs_f64();
    progress.report("coding texture", f64::NAN, "");
    let texture = DistanceTexture::new(&deviations);
    let colour_range = picture::scale_end(&report.overall, max_distance);
    Ok(Measured {
        tessellation,
        deviations,
        texture,
        report,
        colour_range,
        unmatched: unmatched.mesh,
        filled: holes.map(|h| h.mesh),
        exr: settings.exr,
        maps,
    })
}

/// Replaces the normals by averaged ones where that was asked for, and gives the width of the bands in which they turn (a mesh from elsewhere
/// has none), and the cosines of the angles by which texels' normals turned.
fn average_normals(
    texels: &mut Texels,
    tessellation: &mut Tessellation,
    settings: &Settings,
) -> Result<(Option<f64>, Vec<f32>), CommandError> {
    if settings.distance != DistanceArg::AveragedNormal {
        return Ok((None, Vec::new()));
    }
    let size = diagonal(&tessellation.mesh);
    let (width, most) =
        (settings.averaging_width.unwrap_or(variance::DEFAULT_WIDTH * size), variance::MAX_WIDTH * size);
    if width > most {
        return Err(CommandError::usage(format!(
            "--averaging-width: {width} mm is more than a tenth of the model's size; at most {most:.3}mm here"
        )));
    }
    let cosine = variance::average_normals(texels, tessellation, width).map_err(|e| surface_failed(&e))?;
    Ok(((!tessellation.origins.is_empty()).then_some(width), cosine))
}

/// Closes holes of the scan where that was asked for, and takes away the distances behind them.
fn fill_holes(
    deviations: &mut Deviations,
    scan: &Scan,
    bvh: &Bvh,
    settings: &Settings,
) -> Result<Option<FilledHoles>, CommandError> {
    let Some(size) = settings.fill_holes else { return Ok(None) };
    let holes = FilledHoles::new(&scan.mesh, size);
    let towards = match settings.distance {
        DistanceArg::Closest => Towards::Closest,
        DistanceArg::Normal | DistanceArg::AveragedNormal => Towards::Normal,
    };
    let hidden = variance::hide_behind_filled(deviations, &holes, bvh, facing(scan, settings), towards);
    hidden.map_err(CommandError::failed)?;
    Ok(Some(holes))
}

fn surface_failed(error: &BvhError) -> CommandError {
    CommandError::Failed(format!("the model's surface: {error}"))
}

fn facing(scan: &Scan, settings: &Settings) -> Facing {
    if scan.oriented { Facing::Within(settings.max_angle) } else { Facing::Any }
}

fn cast(texels: Texels, scan: &Scan, bvh: &Bvh, max_distance: f64, settings: &Settings) -> Result<Trace, CommandError> {
    let facing = facing(scan, settings);
    let device = match settings.device {
        DeviceArg::Auto => Device::Auto,
        DeviceArg::Cpu => Device::Cpu,
        DeviceArg::Gpu => Device::Gpu,
    };
    let trace = match settings.distance {
        DistanceArg::Normal | DistanceArg::AveragedNormal => variance::trace(texels, bvh, max_distance, facing, device),
        DistanceArg::Closest => variance::trace_closest(texels, bvh, &scan.mesh, max_distance, facing),
    };
    trace.map_err(CommandError::failed)
}

/// What is said of each part beside its statistics: levels of detection, and what its parameters explain.
fn assess_parts(
    report: &mut VarianceReport,
    deviations: &Deviations,
    noise: f64,
    sensitivities: Option<&Sensitivities>,
    fitted: Option<&FitResult>,
) {
    let covariance = fitted.and_then(|f| f.covariance.as_ref());
    let covariance = covariance.map(|c| ParameterCovariance { parameters: &c.parameters, matrix: &c.matrix });
    let detected = variance::detect(deviations, noise, sensitivities.zip(covariance));
    report.parts.iter_mut().zip(detected).for_each(|(part, detection)| part.detection = Some(detection));
    if let Some(sensitivities) = sensitivities {
        let explained = variance::explain(deviations, sensitivities);
        report.parts.iter_mut().zip(explained).for_each(|(part, explained)| part.explained = explained);
    }
}

/// Diagonal of the box around a mesh.
fn diagonal(mesh: &TriangleMesh) -> f64 {
    let extent = |k: usize| {
        let (low, high) =
            mesh.positions.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        if high > low { high - low } else { 0.0 }
    };
    (0..3).map(|k| extent(k).powi(2)).sum::<f64>().sqrt()
}
