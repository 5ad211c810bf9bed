//! Verdicts on parts with tolerances, and the exit statuses that follow.

use crate::support::{fails, gmlc, json};
use std::fmt::Write;
use std::path::Path;
use tempfile::tempdir;

const PLATE: &str = "use std.surface (plane)\nmodel plate {\n  part top tolerance 0.5mm = plane(40mm, 40mm)\n}\n";

/// A scan of the plate as OBJ: vertices half a millimetre apart at the places that a function makes of (x, y) and of
/// noise with a standard deviation of a tenth of a millimetre; only cells of the given columns, of 80.
fn scan(path: &Path, columns: std::ops::Range<usize>, place: impl Fn(f64, f64, f64) -> [f64; 3]) {
    let mut state = 1u64;
    let mut even = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut text = String::new();
    for k in 0..81 * 81 {
        let [x, y] = [k % 81, k / 81].map(|i| f64::from(i) / 2.0 - 20.0);
        // The sum of twelve even numbers has a variance of 1.
        let noise = 0.1 * ((0..12).map(|_| even()).sum::<f64>() - 6.0);
        let [x, y, z] = place(x, y, noise);
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for (i, j) in (0..80).flat_map(|j| columns.clone().map(move |i| (i, j))) {
        let corner = 81 * j + i + 1;
        let [right, above] = [corner + 1, corner + 81];
        let _ = writeln!(text, "f {corner} {right} {above}\nf {right} {} {above}", above + 1);
    }
    std::fs::write(path, text).expect("it can be written");
}

/// Scans of plates at several heights, with what the command says of them.
#[test]
fn statuses_are_those_of_the_verdicts() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("plate.gml"), PLATE).expect("written");
    let measure = |file: &str, options: &[&str]| {
        let args = ["variance", "-q", "plate.gml", file, "--device", "cpu", "--resolution", "256", "-o", "out"];
        [&args[..], options].concat().into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    let passes = |file: &str, options: &[&str]| {
        let args = measure(file, options);
        gmlc(folder, &args.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let refuses = |status: i32, file: &str, options: &[&str]| {
        let args = measure(file, options);
        fails(folder, &args.iter().map(String::as_str).collect::<Vec<_>>(), status)
    };
    let at = |height: f64| move |x: f64, y: f64, noise: f64| [x, y, height + noise];
    for (name, height) in [("inside", 0.3), ("outside", 0.7), ("between", 0.5), ("far", 30.0)] {
        scan(&folder.join(format!("{name}.obj")), 0..80, at(height));
    }

    let said = passes("inside.obj", &[]);
    assert!(said.contains("decision rule guarded") && said.contains("conforms"), "{said}");
    let report = json(&folder.join("out/variance.json"));
    let verdict = &report["parts"][0]["verdict"];
    assert_eq!((&report["verdict"]["outcome"], &verdict["outcome"]), (&"conforms".into(), &"conforms".into()));
    let number = |name: &str| verdict[name].as_f64().expect("a number");
    assert!((number("again") - 0.3).abs() < 0.03 && number("value") < 0.4, "{verdict}");
    assert!(number("uncertainty") > 0.01 && number("uncertainty") < 0.03, "{verdict}");
    assert!(number("probability") > 0.99 && number("limit") == 0.5, "{verdict}");
    for file in ["conformance.png", "conformance.tif"] {
        assert!(folder.join("out").join(file).exists(), "{file}");
    }

    let said = refuses(3, "outside.obj", &[]);
    assert!(
        said.starts_with("does not conform: top: 0.7") && said.contains("allowed are -0.5000 to 0.5000 mm"),
        "{said}"
    );
    assert!(refuses(4, "between.obj", &[]).starts_with("undecided: top: 0.5"));
    // What the scanner may be off by everywhere, and other rules.
    assert!(refuses(4, "inside.obj", &["--device-uncertainty", "0.2mm"]).contains("undecided"));
    passes("inside.obj", &["--decision", "simple", "--device-uncertainty", "0.2mm"]);
    refuses(3, "between.obj", &["--decision", "simple"]);
    passes("inside.obj", &["--decision", "p=0.99", "--footprint", "4mm"]);
    // The edge of the square is that of the whole plate: one footprint.
    refuses(4, "between.obj", &["--footprint", "40mm"]);
    assert_eq!(json(&folder.join("out/variance.json"))["parts"][0]["verdict"]["footprints"], 1);

    let error = refuses(2, "inside.obj", &["--max-distance", "0.8mm"]);
    assert!(error.contains("--max-distance") && error.contains("too close to the tolerance of 0.5 mm"), "{error}");
    for option in [["--decision", "lenient"], ["--min-coverage", "80"], ["--device-uncertainty", "1"]] {
        assert!(refuses(2, "inside.obj", &option).contains(option[0]), "{option:?}");
    }
    // Far away: nothing is measured, whatever the tolerance.
    let error = refuses(1, "far.obj", &["--max-distance", "5mm"]);
    assert!(error.contains("far.obj: nothing was measured") && error.contains(" mm from that of the model"), "{error}");
}

/// A file in metres, one 30 mm to the side, half a scan, and a scan with one bad point.
#[test]
fn little_that_was_measured_is_said() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("plate.gml"), PLATE.replace("40mm", "20mm")).expect("written");
    std::fs::write(folder.join("wide.gml"), PLATE).expect("written");
    let measure = |script: &str, file: &str, options: &[&str]| -> Vec<String> {
        let args = ["variance", script, file, "--device", "cpu", "--resolution", "256", "-o", "out"];
        [&args[..], options].concat().into_iter().map(str::to_owned).collect()
    };
    let fails =
        |status: i32, args: Vec<String>| fails(folder, &args.iter().map(String::as_str).collect::<Vec<_>>(), status);
    let gmlc = |args: Vec<String>| gmlc(folder, &args.iter().map(String::as_str).collect::<Vec<_>>());
    scan(&folder.join("metres.obj"), 0..80, |x, y, noise| [x, y, noise].map(|c| c / 1000.0));
    let error = fails(1, measure("wide.gml", "metres.obj", &["--tolerance", "0.01mm"]));
    assert!(error.contains("nothing was measured") && error.contains("--unit m"), "{error}");
    gmlc(measure("wide.gml", "metres.obj", &["--unit", "m"]));

    // The plate of 20 mm, with a scan of as much of it beside it.
    scan(&folder.join("beside.obj"), 0..80, |x, y, noise| [x / 2.0 + 30.0, y / 2.0, noise]);
    for options in [&["--max-distance", "2mm"][..], &["--tolerance", "0.01mm"], &[]] {
        let error = fails(1, measure("plate.gml", "beside.obj", options));
        assert!(error.contains("30.0") && error.contains("--params"), "{options:?}: {error}");
    }

    scan(&folder.join("half.obj"), 0..40, |x, y, noise| [x, y, noise]);
    let said = fails(4, measure("wide.gml", "half.obj", &[]));
    assert!(said.contains("only 50.0 % of it was measured, 80 % are required (--min-coverage)"), "{said}");
    gmlc(measure("wide.gml", "half.obj", &["--min-coverage", "0.4"]));

    // One point of 6,561 is beyond the tolerance: some texels are, and the part is not.
    scan(&folder.join("point.obj"), 0..80, |x, y, noise| {
        [x, y, if x == 3.0 && y == -7.0 { -0.7 } else { 0.5 * noise }]
    });
    gmlc(measure("wide.gml", "point.obj", &["--matching", "all"]));
    let tolerance = &json(&folder.join("out/variance.json"))["parts"][0]["tolerance"];
    assert!(tolerance["within"] == false && tolerance["texels_below"].as_u64() > Some(0), "{tolerance}");
}

/// A bore that leans by a degree is 0.105 mm off at its rims, and its axis 12 tan 1 degree over its length. Of a coarse
/// texture footprints are as long as half of the bore.
#[test]
fn a_coarse_texture_passes_nothing_that_a_fine_one_rejects() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    let text = "model m {\n  param lean: angle in -5deg..5deg = 0deg\n  part b tolerance 0.07mm = \
        box(width: 40mm, depth: 30mm, height: 12mm) - {h: capped_cylinder(radius: 5mm, height: 20mm)\
        .translate((0mm, 0mm, -10mm)).rotate(lean, (0, 1, 0)).translate((0mm, 0mm, 6mm))}\n}\n";
    std::fs::write(folder.join("m.gml"), text).expect("written");
    let scan = "scan m.gml -p lean=1deg --scanner ct --no-pose --spacing 0.5mm --noise 0.004mm --seed 3 -o s.ply";
    gmlc(folder, &scan.split(' ').collect::<Vec<_>>());
    let truth = 12.0 * f64::to_radians(1.0).tan();
    for (resolution, outcome, status) in [("64", "undecided", 4), ("512", "does not conform", 3)] {
        let args = ["variance", "-q", "m.gml", "s.ply", "--device", "cpu", "--datum", "b.top", "--resolution"];
        fails(folder, &[&args[..], &[resolution, "-o", "out"]].concat(), status);
        let report = json(&folder.join("out/variance.json"));
        let of = |list: &serde_json::Value, key: &str, name: &str| {
            let all = list.as_array().expect("a list");
            all.iter().find(|one| one[key] == name).unwrap_or_else(|| panic!("{list}")).clone()
        };
        let verdict = of(&report["parts"], "name", "b.h.wall")["verdict"].clone();
        assert_eq!(verdict["outcome"], outcome, "{verdict}");
        let square = of(&report["datum"]["relations"], "part", "b.h.wall");
        let value = square["value"].as_f64().expect("a number");
        // Four of its standard deviations by 64 texels a side, whose middles alone make it 0.028 mm too small.
        assert!((value - truth).abs() < 0.006, "{square} for {truth}");
    }
}

/// The verdict of a part in out/variance.json.
fn verdict_of(folder: &Path, name: &str) -> serde_json::Value {
    let report = json(&folder.join("out/variance.json"));
    let parts = report["parts"].as_array().expect("a list");
    parts.iter().find(|part| part["name"] == name).unwrap_or_else(|| panic!("{report}"))["verdict"].clone()
}

/// The bottom of a slot of 1.2 mm that is 0.8 mm too high: the corners of the scan's triangles are nearer to its walls
/// than to where it should be.
#[test]
fn a_narrow_face_that_is_off_by_more_than_half_its_width_does_not_conform() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    let text = "model m {\n  param depth: length in 0.5mm..3mm = 2mm\n  part p = \
        box(width: 12mm, depth: 10mm, height: 5mm) - {slot: box(width: 1.2mm, depth: 20mm, height: 10mm)\
        .translate((0mm, 0mm, 5mm - depth))}\n}\n";
    std::fs::write(folder.join("m.gml"), text).expect("written");
    let scan = "scan m.gml -p depth=1.2mm --scanner ct --no-pose --spacing 0.2mm --noise 0.03mm --seed 5 -o s.ply";
    gmlc(folder, &scan.split(' ').collect::<Vec<_>>());
    fails(
        folder,
        &"variance -q m.gml s.ply --tolerance 0.3mm --resolution 256 -o out".split(' ').collect::<Vec<_>>(),
        3,
    );
    let verdict = verdict_of(folder, "p.slot.base");
    assert!((verdict["value"].as_f64().expect("a number") - 0.8).abs() < 0.03, "{verdict}");
    assert_eq!(verdict["outcome"], "does not conform", "{verdict}");
}

/// The floor of a pocket that is 0.6 mm too high: all corners of the triangles between it and the walls are nearer to
/// the walls than to where the floor should be. The walls had flatness of 0.09 to 0.16 mm, ten times the uncertainty.
#[test]
fn perfect_walls_beside_a_floor_that_has_moved_are_flat() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    let text = "model m {\n  param deep: length in 2mm..10mm = 6mm\n  part p tolerance 0.12mm = \
        box(width: 40mm, depth: 30mm, height: 12mm) - {pocket: box(width: 20mm, depth: 12mm, height: 20mm)\
        .translate((0mm, 0mm, 12mm - deep))}\n}\n";
    std::fs::write(folder.join("m.gml"), text).expect("written");
    let scan = "scan m.gml -p deep=5.4mm --no-pose --spacing 0.5mm --noise 0.02mm --seed 1 -o s.ply";
    gmlc(folder, &scan.split(' ').collect::<Vec<_>>());
    fails(folder, &"variance -q m.gml s.ply --device cpu --min-coverage 0.7 -o out".split(' ').collect::<Vec<_>>(), 3);
    assert_eq!(verdict_of(folder, "p.pocket.base")["outcome"], "does not conform");
    let report = json(&folder.join("out/variance.json"));
    for wall in ["right", "left", "front", "back"] {
        let name = format!("p.pocket.{wall}");
        assert_eq!(verdict_of(folder, &name)["outcome"], "conforms", "{name}");
        let part = report["parts"].as_array().expect("a list").iter().find(|part| part["name"] == name.as_str());
        let zone = &part.expect("it is measured")["form"]["zone"];
        let [flatness, sd] = ["corrected", "uncertainty"].map(|key| zone[key].as_f64().expect("a number"));
        // Noise of 0.02 mm at points 0.5 mm apart leaves up to 0.031 mm on walls of 5.4 mm.
        assert!(flatness < 3.0 * sd && sd < 0.04, "{name}: {zone}");
    }
}
