//! `gmlc info`.

use crate::cli::InfoArgs;
use crate::error::CommandError;
use crate::progress::TerminalProgress;
use crate::{fit, table};
use gml_runtime::scan::{self, Cleaning, Survey};
use serde_json::json;

pub(crate) fn run(args: &InfoArgs) -> Result<(), CommandError> {
    let progress = TerminalProgress::new();
    let survey = scan::survey(&args.scan, &args.reading.options(), &progress);
    progress.finish();
    let survey = survey.map_err(fit::unreadable)?;
    args.json.print_text(&text(&survey), || json!(survey));
    Ok(())
}

/// The tables and sentences for people.
fn text(survey: &Survey) -> String {
    let mut out = table::render(&["", ""], &figures(survey)).trim_start().to_owned();
    if survey.scans.len() > 1 {
        let rows = survey.scans.iter().enumerate().map(|(i, scan)| {
            let place = scan.station.map_or_else(String::new, |p| p.map(table::coordinate).join(", "));
            vec![i.to_string(), scan.name.clone(), scan.points.to_string(), place]
        });
        let rows: Vec<Vec<String>> = rows.collect();
        out.push_str(&format!("\n{}", table::render(&["scan", "name", "points", "scanner at (mm)"], &rows)));
    }
    for (kind, sentences) in [("warning", &survey.warnings), ("suspicion", &survey.suspicions)] {
        sentences.iter().for_each(|sentence| out.push_str(&format!("{kind}: {sentence}\n")));
    }
    out
}

fn figures(survey: &Survey) -> Vec<Vec<String>> {
    let size: [f64; 3] = std::array::from_fn(|k| survey.high[k] - survey.low[k]);
    let place = |p: &[f64; 3]| format!("{} mm", p.map(table::coordinate).join(", "));
    let mm =
        |lengths: &[f64]| format!("{} mm", lengths.iter().map(|x| table::number(*x)).collect::<Vec<_>>().join(", "));
    let unit_from = match survey.unit_from {
        "file" => "as the file states",
        "option" => "by --unit",
        "format" => "assumed, as the format usually has it: the file states none; --unit sets it",
        _ => "assumed: the file states none; --unit sets it",
    };
    let mut rows = vec![
        ("file", survey.path.clone()),
        ("format", survey.format.clone()),
        ("unit", format!("{}, {unit_from}", survey.unit)),
        ("points", survey.points.to_string()),
        ("triangles", survey.triangles.to_string()),
        ("from", place(&survey.low)),
        ("to", place(&survey.high)),
        ("size", mm(&size)),
        (
            "spacing",
            format!(
                "{} (median; 5 % {}, 95 % {})",
                mm(&survey.spacing[1..2]),
                mm(&survey.spacing[..1]),
                mm(&survey.spacing[2..])
            ),
        ),
        ("noise", if survey.noise > 0.0 { mm(&[survey.noise]) } else { "not known".to_owned() }),
        ("normals", format!("from the {}{}", survey.normals, if survey.oriented { "" } else { ", of unknown sides" })),
        ("colours", if survey.colours { "yes" } else { "no" }.to_owned()),
        ("intensities", survey.intensity.map_or("no".to_owned(), |[low, high]| format!("{low} to {high}"))),
        ("pieces", pieces(survey)),
    ];
    if !survey.ignored.is_empty() {
        rows.push(("not read", survey.ignored.join(", ")));
    }
    if let Some(step) = survey.precision {
        rows.push(("precision", format!("coordinates in steps of {}", mm(&[step]))));
    }
    if let Some(surface) = &survey.surface {
        rows.push(("area", format!("{} mm^2", table::number(surface.area))));
        let rims = format!("{} (the largest {} across)", surface.rims, mm(&[surface.largest_rim]));
        rows.push(("holes and borders", if surface.rims == 0 { "none".to_owned() } else { rims }));
        if let Some(volume) = surface.volume {
            rows.push(("volume", format!("{} mm^3, closed", table::number(volume))));
        }
    }
    if let Some(share) = survey.outliers {
        rows.push(("off any surface", format!("{:.1} % of the points", 100.0 * share)));
    }
    let left_out = left_out(&survey.cleaning);
    if !left_out.is_empty() {
        rows.push(("left out", left_out));
    }
    rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]).collect()
}

fn pieces(survey: &Survey) -> String {
    match survey.pieces {
        1 => "1".to_owned(),
        count => format!("{count} (the largest has {:.1} %)", 100.0 * survey.largest_piece),
    }
}

/// What of a file is not in the scan, with its numbers.
pub(crate) fn left_out(cleaning: &Cleaning) -> String {
    let cubes = cleaning.voxel.map_or_else(String::new, |edge| {
        format!("points of which another one in the same cube of {} mm is kept", table::number(edge))
    });
    let counts = [
        (cleaning.marked, "points that the file marks as invalid"),
        (cleaning.empty, "points without coordinates"),
        (cleaning.cropped, "points outside of the box of --crop"),
        (cleaning.far, "points far from all others"),
        (cleaning.thinned, cubes.as_str()),
        (cleaning.outliers, "points on no surface"),
        (cleaning.pieces, "points of smaller pieces"),
        (cleaning.equal_points, "points at the place of another one"),
        (cleaning.without_area, "triangles without area"),
        (cleaning.repeated, "triangles that are there twice"),
        (cleaning.unused, "points that no triangle uses"),
        (cleaning.decimated, if cleaning.triangles > 0 { "triangles by --decimate" } else { "points by --decimate" }),
    ];
    let counts: Vec<String> =
        counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
    counts.join(", ")
}
