//! `gmlc inspect`: fit, measure and document.

use crate::cli::InspectArgs;
use crate::error::CommandError;
use crate::measure::{self, Measured, Settings, Surface};
use crate::progress::TerminalProgress;
use crate::search::{self, Winner};
use crate::textures::{self, Pictures};
use crate::{deviations, fit, mesh, script, table};
use gml_compiler::program::Program;
use gml_runtime::export::picture::Picture;
use gml_runtime::export::render::{self, DeviationColours, Layer, Paint, View};
use gml_runtime::export::report::{self, Report};
use gml_runtime::export::x3d::{self, MetadataGroup, X3dScene};
use gml_runtime::export::{atomic, json};
use gml_runtime::fit::FitResult;
use gml_runtime::model::{Model, Motion, Tessellation};
use gml_runtime::progress::Progress;
use gml_runtime::scan::Scan;
use gml_runtime::variance::Statistics;

/// Of the scan in pictures: clay.
const SCAN_COLOUR: [u8; 3] = [198, 190, 178];

/// Of what of it the model does not explain.
const UNMATCHED_COLOUR: [u8; 3] = [196, 60, 160];

/// Side of one view in pixels.
const VIEW_SIZE: usize = 480;

pub(crate) fn run(args: &InspectArgs) -> Result<(), CommandError> {
    // What is wrong with the command line is said before any work is done.
    let settings = Settings::of(&args.variance)?;
    let program = script::compile(&args.script)?;
    inspect(&program, args, &settings, &TerminalProgress::until(fit::on_interrupt()?))
}

/// Inspects a scan with a program.
pub(crate) fn inspect(
    program: &Program,
    args: &InspectArgs,
    settings: &Settings,
    progress: &TerminalProgress,
) -> Result<(), CommandError> {
    let options = fit::options(&args.fit, program)?;
    let scan = fit::read_scan(&args.scan)?;
    if scan.mesh.triangles.is_empty() {
        return Err(CommandError::Failed(format!(
            "{}: is a cloud of points without triangles, at which no rays can be cast; mesh it first (gmlc fit takes it as it is)",
            args.scan.scan.display()
        )));
    }
    mesh::make_folder(&args.output)?;
    let (searched, fitted) = if args.search.is_empty() {
        (None, fit::run_fit(program, &args.script.model, &scan, &options, progress)?)
    } else {
        let Winner { program, fit } = search::run(program, &args.script, &args.search, &args.fit, &scan, progress)?;
        (Some(program), fit)
    };
    let program = searched.as_ref().unwrap_or(program);
    json::write(&args.output.join("fit.json"), &fitted).map_err(CommandError::failed)?;
    fit::write_trace(args.fit.trace.as_deref(), &fitted)?;
    fit::unless_interrupted(&fitted)?;

    let x: Vec<f64> = fitted.parameters.iter().map(|p| p.value).collect();
    let pose = fitted.pose.unwrap_or(Motion::IDENTITY);
    let surface = Surface::of_program(program, &x, &pose, settings)?;
    let measured = measure::measure(surface, &scan, Some(&fitted), settings, progress)?;
    let pictures = textures::write(&args.output, &measured)?;
    let upright = upright(program, &x, &pose)?;
    let documented = document(args, &fitted, &scan, (&measured, &pictures), &upright, progress);
    progress.finish();
    documented?;

    print!("{}\n{}", fit::summary(&fitted), deviations::summary(&measured.report));
    println!("written to {}: report.html, model.x3d, fit.json, variance.json and pictures", args.output.display());
    deviations::judge(&measured.report)
}

/// The motion from the script's own position (its defaults, where up is up) to where the scan lies, whether the pose is
/// among the script's parameters or was added.
fn upright(program: &Program, x: &[f64], pose: &Motion) -> Result<Motion, CommandError> {
    let defaults: Vec<f64> = program.parameters().iter().map(|p| p.default).collect();
    let points = |x: &[f64]| {
        let instance = Model::instantiate(program, x).map_err(CommandError::failed)?;
        let tessellation = Tessellation::uniform(program, &*instance, 12, 12).map_err(CommandError::failed)?;
        Ok::<_, CommandError>(tessellation.mesh.positions)
    };
    let fitted: Vec<[f64; 3]> = points(x)?.into_iter().map(|p| pose.point(p)).collect();
    Ok(Motion::between(&points(&defaults)?, &fitted))
}

/// Pictures, X3D and the report.
fn document(
    args: &InspectArgs,
    fitted: &FitResult,
    scan: &Scan,
    (measured, pictures): (&Measured, &Pictures),
    upright: &Motion,
    progress: &TerminalProgress,
) -> Result<(), CommandError> {
    let folder = &args.output;
    let title = format!("{} compared with {}", fitted.model, scan.source.path);
    progress.report("drawing", f64::NAN, "views");
    if progress.cancelled() {
        return Err(fit::interrupted());
    }
    let views = textures::png(&views(scan, measured, upright))?;

    progress.report("writing", f64::NAN, "model.x3d, report.html");
    let scene = x3d::write(&X3dScene {
        tessellation: &measured.tessellation,
        texture_png: &pictures.coded,
        texture_size: [measured.texture.width, measured.texture.height],
        max_distance: measured.deviations.max_distance,
        colour_range: measured.colour_range,
        turned: upright.rotation,
        title: &title,
        metadata: &metadata(fitted, measured),
    })
    .map_err(CommandError::failed)?;
    let report = report::write(&Report {
        title: &title,
        model: &args.script.model.display().to_string(),
        date: &chrono::Utc::now().format("%Y-%m-%d %H:%M UTC").to_string(),
        tool: concat!("gmlc ", env!("CARGO_PKG_VERSION")),
        fit: Some(fitted),
        variance: &measured.report,
        deviations: &measured.deviations,
        tessellation: &measured.tessellation,
        turned: upright.rotation,
        distance_png: &pictures.coded,
        colour_png: &pictures.colours,
        colour_range: measured.colour_range,
        pictures: &[(
            "The scan (in magenta what the model does not explain), the model in the colours of its deviations, and both; from the front, from the back, from above and cut open",
            &views,
        )],
    });
    let files = [("views.png", &views[..]), ("model.x3d", scene.as_bytes()), ("report.html", report.as_bytes())];
    for (name, bytes) in files {
        atomic::write(&folder.join(name), bytes).map_err(CommandError::failed)?;
    }
    Ok(())
}

/// The scan in the first row, what of it is left over in a colour of its own, the model in the colours of its deviations in the second, both in the third.
fn views(scan: &Scan, measured: &Measured, upright: &Motion) -> Picture {
    let colours = DeviationColours::new(&measured.deviations, measured.colour_range);
    let model = Layer { mesh: &measured.tessellation.mesh, paint: Paint::Deviations(&colours), opacity: 1.0 };
    let clay = Layer { mesh: &scan.mesh, paint: Paint::Plain(SCAN_COLOUR), opacity: 1.0 };
    let unmatched = Layer { mesh: &measured.unmatched, paint: Paint::Plain(UNMATCHED_COLOUR), opacity: 1.0 };
    let rows: [&[Layer<'_>]; 3] = [&[clay, unmatched], &[model], &[model, Layer { opacity: 0.5, ..clay }]];
    let views = [View::FRONT, View::BACK, View::TOP, View::INSIDE].map(|view| view.of_turned(&upright.rotation));
    render::sheet(&rows, &views, VIEW_SIZE)
}

fn metadata(fitted: &FitResult, measured: &Measured) -> Vec<MetadataGroup> {
    let entry = |name: &str, value: String| (name.to_owned(), value);
    let figures = |name: &str, s: &Statistics| MetadataGroup {
        name: name.to_owned(),
        entries: vec![
            entry("coverage", table::number(s.coverage)),
            entry("mean", table::number(s.weighted.mean)),
            entry("sd", table::number(s.weighted.sd)),
            entry("max", table::number(s.weighted.max)),
            entry("signed mean", table::number(s.weighted.signed.mean)),
            entry("rms", table::number(s.weighted.rms)),
        ],
    };
    let parameters = MetadataGroup {
        name: "parameters".to_owned(),
        entries: fitted.parameters.iter().map(|p| entry(&p.name, format!("{} {}", p.value, p.unit))).collect(),
    };
    let mut groups = vec![parameters, figures("all", &measured.report.overall)];
    groups.extend(measured.report.parts.iter().map(|p| figures(&p.name, &p.statistics)));
    groups
}
