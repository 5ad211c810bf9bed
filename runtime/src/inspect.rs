//! The whole workflow of the paper: fit a model to a scan, measure the deviations, document both.

use crate::export::exchange::{self, Format, ParameterRow};
use crate::export::measurement::{self, DocumentError, Extent, Extras, Textures, png};
use crate::export::report::{self, Figure, Report, Scripts, file_name};
use crate::export::scale::Scale;
use crate::export::surfels;
use crate::export::svg::SectionDrawing;
use crate::export::views::{CAPTIONS, COLOURED, MOST_SURFELS, OVERVIEW, VIEWS, Views};
use crate::export::x3d::{self, X3dScene, metadata};
use crate::export::{atomic, json, number, palette};
use crate::fit::{self, AllowedDeviation, FitError, FitOptions, FitResult, FittedMeasure};
use crate::model::{EvaluationError, Model, Motion, Tessellation, divided};
use crate::progress::Progress;
use crate::scan::Scan;
use crate::variance::{
    ColourSource, Dimension, MeasureError, MeasureOptions, Measurement, ParameterCovariance, Reference, Tolerance,
    VarianceReport, VerdictOptions, measure, require_what_scan_has,
};
use std::borrow::Cow;
use std::path::Path;
use thiserror::Error;

/// Longest edge of a reference mesh in the report's view, in texels, and the most triangles that it is divided into:
/// some 0.3 MB of the page.
const VIEWED_EDGE: f64 = 4.0;
const MOST_VIEWED: usize = 60_000;

/// A fit and the deviations from the fitted model.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Inspection {
    /// The fit.
    pub fit: FitResult,
    /// The deviations.
    pub measurement: Measurement,
    /// The motion from the script's own position (its defaults, where z points up) to the scan, whether the pose is
    /// among the script's parameters or was added.
    pub upright: Motion,
}

/// What the documents of a measurement show.
#[derive(Clone, Copy, Debug)]
pub struct Documents<'a> {
    /// Name of the model, or of the file of a reference mesh.
    pub name: &'a str,
    /// The fit whose model was measured; none if its values are no fit's.
    pub fit: Option<&'a FitResult>,
    /// The deviations.
    pub measurement: &'a Measurement,
    /// See [`Inspection::upright`]; the identity where nothing is known.
    pub upright: Motion,
    /// The model's scripts.
    pub scripts: &'a Scripts,
}

/// Why a scan cannot be inspected.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum InspectError {
    /// The model cannot be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The deviations cannot be measured.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// The model cannot be evaluated.
    #[error(transparent)]
    Evaluation(#[from] EvaluationError),
}

/// Fits a model to a scan and measures the deviations from the fitted model.
///
/// # Errors
/// If the model cannot be fitted or the deviations cannot be measured.
pub fn inspect(
    model: &dyn Model,
    scan: &Scan,
    fit_options: &FitOptions,
    measure_options: &MeasureOptions,
    progress: &dyn Progress,
) -> Result<Inspection, InspectError> {
    // Before the fit, which takes longer.
    require_what_scan_has(scan, measure_options)?;
    let fit = fit::fit(model, scan, fit_options, progress)?;
    Inspection::of_fit(model, fit, scan, measure_options, progress)
}

impl Inspection {
    /// Measures the deviations from a model that has been fitted.
    ///
    /// # Errors
    /// If the deviations cannot be measured.
    pub fn of_fit(
        model: &dyn Model,
        fit: FitResult,
        scan: &Scan,
        options: &MeasureOptions,
        progress: &dyn Progress,
    ) -> Result<Self, InspectError> {
        let x: Vec<f64> = fit.parameters.iter().map(|p| p.value).collect();
        let motion = fit.pose.unwrap_or(Motion::IDENTITY);
        let covariance = covariance(&fit);
        let reference = Reference::Model { model, x: &x, motion };
        let mut measurement = measure(reference, scan, covariance, options, progress)?;
        judge_measures(&mut measurement.report, &fit, options.verdict);
        if let Some(reason) = unreliable(&fit) {
            measurement.report.doubt_verdicts(&reason);
        }
        let upright = upright(model, &x, &motion)?;
        Ok(Self { fit, measurement, upright })
    }

    /// Writes all documents into a folder, which must exist: fit.json, those of
    /// [`measurement::write`](crate::export::measurement::write()), views.png,
    /// overview.png, model.x3d and report.html.
    ///
    /// # Errors
    /// If a file cannot be written.
    ///
    /// `scripts` are those of the model.
    pub fn write(
        &self,
        folder: &Path,
        scan: &Scan,
        scripts: &Scripts,
        extras: Extras,
        progress: &dyn Progress,
    ) -> Result<(), DocumentError> {
        json::write(&folder.join("fit.json"), &self.fit)?;
        self.documents(scripts).write(folder, scan, extras, progress)
    }

    /// The documents besides fit.json. `scripts` are those of the model.
    #[must_use]
    pub fn documents<'a>(&'a self, scripts: &'a Scripts) -> Documents<'a> {
        let Self { fit, measurement, upright } = self;
        Documents { name: &fit.model, fit: Some(fit), measurement, upright: *upright, scripts }
    }
}

impl Documents<'_> {
    /// Writes the documents of [`measurement::write`](crate::export::measurement::write()), views.png,
    /// overview.png, model.x3d, report.html and drawings into a folder, which must exist. The parameters of `extras`,
    /// if it has none, are those of the fit.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(
        &self,
        folder: &Path,
        scan: &Scan,
        extras: Extras,
        progress: &dyn Progress,
    ) -> Result<(), DocumentError> {
        let parameters = match self.fit {
            Some(fit) if extras.parameters.is_empty() => ParameterRow::of_fit(fit),
            _ => extras.parameters,
        };
        let extras = Extras { parameters, ..extras };
        let textures = measurement::write(folder, self.measurement, &extras)?;
        if extras.extent == Extent::Figures {
            return Ok(());
        }
        progress.report("drawing", f64::NAN, "views");
        if progress.cancelled() {
            return Err(DocumentError::Interrupted);
        }
        let drawn = surfels::shown(&scan.mesh, MOST_SURFELS);
        let views = Views::new(self.measurement, &drawn, &self.upright.rotation, &textures.scale);
        progress.report("writing", f64::NAN, "model.x3d, report.html");
        let title = format!("{} compared with {}", self.name, file_name(&scan.source.path));
        if extras.formats.contains(&Format::Svg) {
            let (measurement, turned) = (self.measurement, self.upright.rotation);
            let drawing = SectionDrawing { title: &title, measurement, scan: &drawn, turned, scale: &textures.scale };
            exchange::write_drawings(folder, &drawing)?;
        }
        let report = self.report(&title, scan, &textures, &views)?;
        atomic::write(&folder.join(OVERVIEW), &palette::png(&views.overview)?)?;
        if extras.extent == Extent::All {
            atomic::write(&folder.join(VIEWS), &png(&views.sheet)?)?;
            extras.scene.write(folder, &self.scene(&title, scan, &textures)?)?;
        }
        atomic::write(&folder.join("report.html"), report.as_bytes())?;
        Ok(())
    }

    fn scene(&self, title: &str, scan: &Scan, textures: &Textures) -> Result<String, DocumentError> {
        let Measurement { displayed, deviations, report, .. } = self.measurement;
        Ok(x3d::write(&X3dScene {
            tessellation: displayed,
            deviations,
            scan: &surfels::shown(&scan.mesh, x3d::MOST_SURFELS),
            scale: textures.scale,
            robust_range: Scale::robust(report).end,
            turned: self.upright.rotation,
            title,
            metadata: &metadata(self.fit, report),
        })?)
    }

    fn report(&self, title: &str, scan: &Scan, textures: &Textures, views: &Views) -> Result<String, DocumentError> {
        let scanned = views.scan.iter().map(palette::png).collect::<Result<Vec<_>, _>>()?;
        let model = views.model.iter().map(palette::png).collect::<Result<Vec<_>, _>>()?;
        fn figures(files: &[Vec<u8>]) -> Vec<Figure<'_>> {
            files.iter().zip(CAPTIONS).map(|(png, caption)| Figure { caption, png }).collect()
        }
        let heading = format!(
            "Scan (in magenta what is farther than {} mm from the model, or faces another way)",
            number(self.measurement.report.max_distance)
        );
        let (model, scanned) = (figures(&model), figures(&scanned));
        let coloured = views.colours.iter().map(palette::png).collect::<Result<Vec<_>, _>>()?;
        let coloured = coloured.iter().zip(COLOURED).map(|(png, k)| Figure { caption: CAPTIONS[k], png });
        let coloured: Vec<Figure<'_>> = coloured.collect();
        let mut rows = vec![("Model in the colours of its deviations", &model[1..]), (&heading, &scanned)];
        if let Some(colour) = self.measurement.report.colour.as_ref() {
            let heading = match colour.source {
                ColourSource::Colours => "Model in the scan's colours",
                ColourSource::Intensities => "Model in the scan's intensities, as greys",
            };
            rows.push((heading, &coloured));
        }
        Ok(report::write(&Report {
            title,
            record: self.measurement.report.provenance.as_ref(),
            scripts: self.scripts,
            scan: &scan.mesh,
            fit: self.fit,
            variance: &self.measurement.report,
            deviations: &self.measurement.deviations,
            tessellation: &viewed(self.measurement),
            turned: self.upright.rotation,
            conformance_png: textures.conformance.as_deref(),
            colour_png: textures.colour.as_deref(),
            uncertainty_png: textures.uncertainty.as_deref(),
            scale: &textures.scale,
            picture: model.first().copied(),
            pictures: &rows,
        }))
    }
}

/// The surface for the report's view, whose triangles end where a corner was not measured: large triangles of a
/// reference mesh are divided.
fn viewed(measurement: &Measurement) -> Cow<'_, Tessellation> {
    let Measurement { tessellation, deviations, .. } = measurement;
    if !tessellation.origins.is_empty() {
        return Cow::Borrowed(tessellation);
    }
    let edge = VIEWED_EDGE * deviations.texels.width_on_the_surface();
    let mesh = divided(&tessellation.mesh, edge, MOST_VIEWED);
    Cow::Owned(Tessellation { mesh, ..Tessellation::default() })
}

/// The covariance of a fit's parameters, joint with that of its pose if there is one.
#[must_use]
pub fn covariance(fit: &FitResult) -> Option<ParameterCovariance<'_>> {
    let of_parameters = fit.covariance.as_ref().map(|c| ParameterCovariance {
        parameters: &c.parameters,
        matrix: &c.matrix,
        centre: None,
    });
    let with_pose = fit.pose_covariance.as_ref().map(|c| ParameterCovariance {
        parameters: &c.parameters,
        matrix: &c.matrix,
        centre: Some(c.centre),
    });
    with_pose.or(of_parameters)
}

/// Why verdicts that rest on a fit are undecided, if they are.
fn unreliable(fit: &FitResult) -> Option<String> {
    fit.shortcoming().map(|shortcoming| format!("the fit cannot be relied on: {shortcoming}"))
}

/// Adds verdicts on the measures of a fit that have a tolerance.
pub fn judge_measures(report: &mut VarianceReport, fit: &FitResult, options: VerdictOptions) {
    let doubt = unreliable(fit);
    let dimension = |measure: &FittedMeasure| {
        let AllowedDeviation { lower, upper } = measure.tolerance?;
        let unknown = || measure.without_sd.clone().unwrap_or_else(|| "it was not computed".to_owned());
        let sd = match &doubt {
            Some(reason) => Err(reason.clone()),
            None => measure.sd.ok_or_else(unknown).map_err(|reason| format!("it has no standard deviation: {reason}")),
        };
        Some(Dimension {
            name: measure.name.clone(),
            unit: measure.unit.clone(),
            value: measure.value.unwrap_or(f64::NAN),
            sd,
            nominal: measure.nominal.unwrap_or(f64::NAN),
            tolerance: Tolerance { lower, upper },
        })
    };
    let dimensions: Vec<Dimension> = fit.measures.iter().filter_map(dimension).collect();
    report.judge(&dimensions, options);
}

/// The motion from the surface at the model's defaults to the moved surface at x, for [`Documents`].
///
/// # Errors
/// If the model cannot be evaluated.
pub fn upright(model: &dyn Model, x: &[f64], motion: &Motion) -> Result<Motion, EvaluationError> {
    let defaults: Vec<f64> = model.parameters().iter().map(|p| p.default).collect();
    let points = |x: &[f64]| {
        let instance = model.instantiate(x)?;
        Ok::<_, EvaluationError>(Tessellation::uniform(model, &*instance, 12, 12)?.mesh.positions)
    };
    let fitted: Vec<[f64; 3]> = points(x)?.into_iter().map(|p| motion.point(p)).collect();
    Ok(Motion::between(&points(&defaults)?, &fitted))
}
