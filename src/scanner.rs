//! The options of the virtual scanner, and what they may not be together.

use crate::cli::VirtualScanArgs;
use crate::error::CommandError;
use crate::values::{self, Choice};
use gml_compiler::program::Quantity;
use gml_runtime::export::scan::ScanFormat;
use gml_runtime::simulate::{Kind, Scanner};

/// Points along a large model where no spacing was asked for.
const SPACINGS: f64 = 500.0;
/// Length of the correlation of the noise of computed tomography where none was asked for, in spacings.
const CT_CORRELATION: f64 = 2.0;

/// The kinds of scanners.
pub(crate) const KINDS: &[Choice<Kind>] = &[
    Choice {
        name: "structured-light",
        help: "Views from all around, merged into one mesh",
        value: Kind::StructuredLight,
    },
    Choice { name: "panorama", help: "Terrestrial stations, whose points stay apart", value: Kind::Panorama },
    Choice { name: "hand-held", help: "Line profiles along a path around the object", value: Kind::HandHeld },
    Choice { name: "ct", help: "The whole surface, inside and out, as a mesh", value: Kind::Ct },
];

/// Parses noise that grows with the range, as a fraction of it.
pub(crate) fn of_range(text: &str) -> Result<f64, String> {
    const EXPECTED: &str = "is not a noise such as 50ppm or 0.05mm/m, at most 1e6ppm";
    let fraction = match (text.trim().strip_suffix("ppm"), text.split_once('/')) {
        (Some(number), _) => number.trim_end().parse::<f64>().map_err(|_| EXPECTED.to_owned())? * 1e-6,
        (None, Some((length, unit))) => {
            let per = values::parse(unit, Quantity::Length)
                .or_else(|_| values::parse(&format!("1{}", unit.trim()), Quantity::Length))
                .map_err(|_| EXPECTED.to_owned())?;
            values::length(length).map_err(|_| EXPECTED.to_owned())? / per
        }
        (None, None) => return Err(EXPECTED.into()),
    };
    if (0.0..=1.0).contains(&fraction) { Ok(fraction) } else { Err(EXPECTED.into()) }
}

/// Parses a place: three lengths.
pub(crate) fn place(text: &str) -> Result<[f64; 3], String> {
    const EXPECTED: &str = "expected three lengths such as 2m,-1m,1.6m";
    let lengths: Vec<&str> = text.split(',').collect();
    let Ok(lengths) = <[&str; 3]>::try_from(lengths) else { return Err(format!("is not a place: {EXPECTED}")) };
    let mut place = [0.0; 3];
    for (coordinate, text) in place.iter_mut().zip(lengths) {
        *coordinate = values::parse(text, Quantity::Length).map_err(|e| format!("has `{}`, which {e}", text.trim()))?;
        if coordinate.abs() > 1e9 {
            return Err("is beyond 1e9 mm".into());
        }
    }
    Ok(place)
}

/// Refuses options that a kind of scanner has no use for.
pub(crate) fn require_used(args: &VirtualScanArgs, format: ScanFormat) -> Result<(), CommandError> {
    let kind = args.scanner;
    let refused = |option: &str, reason: &str| {
        Err(CommandError::usage(format!("{option}: a scanner of the kind {} {reason}", kind.name())))
    };
    if kind != Kind::StructuredLight && args.views.is_some() {
        return refused("--views", "has none; leave it out, or take --scanner structured-light");
    }
    let stations = if args.station.is_empty() { args.stations.map(|_| "--stations") } else { Some("--station") };
    if let (Some(option), false) = (stations, kind == Kind::Panorama) {
        return refused(option, "has none; add --scanner panorama");
    }
    if args.noise_share.is_some() && args.noise_correlation.is_none() && kind != Kind::Ct {
        return Err(CommandError::usage("--noise-share: requires a length, --noise-correlation"));
    }
    let of_rays = [
        ("--noise-range", args.noise_range.is_some()),
        ("--noise-angle", args.noise_angle),
        ("--mixed-pixels", args.mixed_pixels.is_some()),
        ("--outliers", args.outliers.is_some_and(|share| share > 0.0)),
        ("--dropouts", args.dropouts.is_some_and(|share| share > 0.0)),
    ];
    if let (Kind::Ct, Some((option, _))) = (kind, of_rays.into_iter().find(|(_, is_given)| *is_given)) {
        return refused(option, "measures no single rays; leave it out");
    }
    if format.is_of_triangles() && (args.cloud || kind.is_of_points()) {
        let what = if args.cloud { "with --cloud" } else { "of this kind" };
        return Err(CommandError::usage(format!(
            "-o {}: a scan {what} has points only, and a file of this format has triangles; write .ply, .e57, .laz or \
             .xyz, or take --scanner structured-light or ct",
            args.output.display()
        )));
    }
    Ok(())
}

/// The scanner of the options, for a model of a size in millimetres. Without --spacing, the spacing is one with which a
/// scan takes seconds, also of something as large as a house.
pub(crate) fn of(args: &VirtualScanArgs, size: f64) -> Scanner {
    let default = Scanner::default();
    let is_ct = args.scanner == Kind::Ct;
    let of_rays = |given: Option<f64>, usual: f64| given.unwrap_or(if is_ct { 0.0 } else { usual });
    let spacing = args.spacing.unwrap_or(default.spacing.max(size / SPACINGS));
    let correlation = if is_ct { CT_CORRELATION * spacing } else { 0.0 };
    Scanner {
        kind: args.scanner,
        cloud: args.cloud,
        views: args.views.map_or(default.views, |views| views as usize),
        stations: args.stations.map_or(default.stations, |stations| stations as usize),
        places: args.station.clone(),
        spacing,
        noise: args.noise,
        noise_range: args.noise_range.unwrap_or_default(),
        noise_angle: args.noise_angle,
        correlation: args.noise_correlation.unwrap_or(correlation),
        correlated: args.noise_share.unwrap_or(default.correlated),
        beam: args.mixed_pixels.unwrap_or_default(),
        outliers: of_rays(args.outliers, 0.001),
        dropouts: of_rays(args.dropouts, 0.01),
        table: args.table,
        clutter: args.clutter as usize,
        holes: args.holes.map_or(if is_ct { 0 } else { 6 }, |holes| holes as usize),
        random_pose: !args.no_pose,
        seed: args.seed,
        ..default
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_of_the_range_has_two_notations() {
        for (text, fraction) in [
            ("50ppm", 5e-5),
            ("0.05mm/m", 5e-5),
            ("1mm/1m", 1e-3),
            ("1 mm / 10 m", 1e-4),
            ("2 ppm", 2e-6),
            ("0ppm", 0.0),
        ] {
            let found = of_range(text).expect(text);
            assert!((found - fraction).abs() < 1e-18, "{text}: {found}");
        }
        for text in ["50", "ppm", "5mm", "-1ppm", "2e6ppm", "nanppm", "1mm/kg", "1mm/5", "1mm/0m", "1mm/-1m"] {
            assert!(of_range(text).is_err(), "{text}");
        }
        assert_eq!(place("2m,-1cm,0"), Ok([2000.0, -10.0, 0.0]));
        assert!(place("1mm,2mm").is_err() && place("1,2,3").is_err() && place("1e99m,0,0").is_err());
    }
}
