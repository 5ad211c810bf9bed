//! Options of `gmlc variance`, on scans whose deviations are known.

use crate::support::{fails, gmlc, json};
use std::fmt::Write;
use std::path::Path;
use tempfile::tempdir;

const CAN: &str = "use std.surface (cylinder, disc)\nmodel can {\n\
    param r: length = 20mm\n param h: length = 50mm\n\
    part side = cylinder(r, h)\n\
    part lid = |u, v| disc(r)(u, v) + (0mm, 0mm, h)\n}\n";

fn write(folder: &Path, name: &str, text: &str) {
    std::fs::write(folder.join(name), text).expect("it can be written");
}

fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// The scanned can is a millimetre wider and higher than the model: the deviation is a millimetre everywhere, along
/// plain normals as along averaged ones, which turn towards the corner at the rim.
#[test]
fn averaged_normals_forms_and_maps_of_a_can() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    write(folder, "can.gml", CAN);
    gmlc(folder, &["mesh", "can.gml", "-p", "r=21mm", "-p", "h=51mm", "-o", "scan.ply"]);
    let measure = ["variance", "can.gml", "scan.ply", "--max-distance", "5mm", "--resolution", "256"];
    let run = |options: &[&str], out: &str| {
        let text = gmlc(folder, &[&measure[..], options, &["-o", out]].concat());
        (json(&folder.join(out).join("variance.json")), text)
    };
    let (plain, text) = run(&[], "plain");
    assert!(
        plain.get("averaging_width").is_none() && plain.get("sensitivities").is_none() && plain.get("holes").is_none()
    );
    assert!(number(&plain["seconds"]["texels"]) > 0.0);
    let plain_text = text.clone();
    // The chords of the side are up to 0.02 mm away from the cylinder; the lid is plane.
    assert!((number(&plain["mean"]) - 0.99).abs() < 0.01, "{text}");
    let [side, lid] = [&plain["parts"][0]["form"], &plain["parts"][1]["form"]];
    assert_eq!(
        (side["shape"].as_str(), side["zone"]["characteristic"].as_str()),
        (Some("cylinder"), Some("cylindricity"))
    );
    assert!(
        number(&side["zone"]["minimum_zone"]) < 0.025 && number(&side["roundness"]["minimum_zone"]) < 0.025,
        "{text}"
    );
    assert_eq!((lid["shape"].as_str(), lid["zone"]["characteristic"].as_str()), (Some("plane"), Some("flatness")));
    assert!(number(&lid["zone"]["least_squares"]) < 1e-4 && lid["roundness"].is_null(), "{text}");
    assert!(text.contains("cylindricity") && text.contains("flatness"), "{text}");

    let averaged = ["--distance", "averaged-normal", "--averaging-width", "2mm"];
    let (report, text) = run(&[&averaged[..], &["--sensitivities", "--exr"]].concat(), "averaged");
    let exr = std::fs::read(folder.join("averaged/distance.exr")).expect("distances as OpenEXR");
    assert_eq!(exr[..4], [0x76, 0x2f, 0x31, 0x01]);
    assert!(!folder.join("plain/distance.exr").exists());
    assert_eq!((report["distance"].as_str(), number(&report["averaging_width"])), (Some("averaged-normal"), 2.0));
    assert!(text.contains("along averaged normals"), "{text}");
    // The distances are in single precision.
    assert!((number(&report["max"]) - 1.0).abs() < 1e-5, "{}", report["max"]);
    assert!(number(&report["coverage"]) > 0.999);
    let maps = report["sensitivities"].as_array().expect("maps");
    assert_eq!(maps.len(), 2);
    for map in maps {
        assert_eq!(map["unit"], "mm/mm");
        assert!((number(&map["max"]) - 1.0).abs() < 1e-6 && number(&map["min"]).abs() < 1e-6, "{map}");
        let picture = std::fs::read(folder.join("averaged").join(map["picture"].as_str().expect("a name")));
        assert!(picture.is_ok_and(|bytes| bytes.starts_with(b"\x89PNG")), "{map}");
    }

    let on_cpu = run(&[&averaged[..], &["--device", "cpu"]].concat(), "cpu").0;
    let on_gpu = run(&[&averaged[..], &["--device", "gpu"]].concat(), "gpu").0;
    assert!((number(&on_cpu["mean"]) - number(&on_gpu["mean"])).abs() < 1e-6);
    assert_eq!(on_cpu["measured_texels"], on_gpu["measured_texels"]);

    // A texel of the texture of 256 x 256 stands for 0.34 mm of the can's 7,540 mm2.
    assert!(
        (number(&plain["texel"]) - 0.347).abs() < 0.01 && number(&plain["texture_used"]) > 0.9,
        "{}",
        plain["texel"]
    );
    // So do nine tenths of the side within 5 %, and of the lid all but its middle; none is wider by a tenth.
    for part in [&plain["parts"][0], &plain["parts"][1], &plain] {
        let [p5, median, p95, max] =
            ["p5", "median", "p95", "max"].map(|name| number(&part["texel_widths"][name]) / number(&plain["texel"]));
        let disc = part["name"] == "lid";
        assert!(p5 > if disc { 0.8 } else { 0.95 } && p95 < 1.05 && max < 1.1, "{}", part["texel_widths"]);
        assert!((median - 1.0).abs() < 0.05, "{}", part["texel_widths"]);
        assert!(number(&part["texel_widths"]["longest_side"]) < 3.0 * number(&plain["texel"]), "{part}");
    }
    let stated = format!("texels are {} mm wide on the average", table(number(&plain["texel"])));
    assert!(plain_text.contains(&stated), "{plain_text}");
    for (resolution, size) in [("0.2mm", 512), ("0.34mm", 512), ("0.36mm", 256)] {
        let options =
            ["variance", "can.gml", "scan.ply", "--max-distance", "5mm", "--resolution", resolution, "-o", "fine"];
        gmlc(folder, &options);
        let fine = json(&folder.join("fine/variance.json"));
        assert_eq!((number(&fine["resolution"][0]) as u32, number(&fine["texel"]) * 1e3 <= 1e3 * 0.36), (size, true));
    }
    let wrong = [
        (&["--resolution", "1e-4mm", "--memory", "100GB"][..], "at least"),
        (&["--resolution", "1000"], "power of two"),
        (&["--resolution", "0mm"], "is not above zero"),
        (&["--averaging-width", "1mm"], "requires --distance averaged-normal"),
        (&["--distance", "averaged-normal", "--averaging-width", "30mm"], "a tenth of the model's size"),
        (&["--fill-holes", "3"], "has no unit"),
        (&["--fill-holes", "0mm"], "is not above zero"),
    ];
    for (options, word) in wrong {
        let status = if word == "at least" { 1 } else { 2 };
        let measure: Vec<&str> = match options[0] {
            "--resolution" => measure[..5].to_vec(),
            _ => measure.to_vec(),
        };
        let error = fails(folder, &[&measure[..], options, &["-o", "wrong"]].concat(), status);
        assert!(error.contains(word), "{error}");
    }
    let error = fails(folder, &["variance", "scan.ply", "scan.ply", "--sensitivities", "-o", "wrong"], 2);
    assert!(error.contains("has no parameters"), "{error}");
}

/// The points of a file of `--points`: place, distance and part.
fn measured_points(path: &Path) -> Vec<([f64; 3], f64, i32)> {
    let bytes = std::fs::read(path).expect("points");
    let end = b"end_header\n";
    let header = bytes.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    let text = String::from_utf8_lossy(&bytes[..header]);
    let scalars = "property double distance\nproperty int part\nproperty float scalar_distance\n";
    assert!(text.contains(scalars), "{text}");
    let double = |record: &[u8], k: usize| f64::from_le_bytes(record[8 * k..8 * k + 8].try_into().expect("8 bytes"));
    let point = |record: &[u8]| {
        let part = i32::from_le_bytes(record[32..36].try_into().expect("4 bytes"));
        ([0, 1, 2].map(|k| double(record, k)), double(record, 3), part)
    };
    bytes[header..].chunks_exact(49).map(point).collect()
}

/// Distances of a noisy scan's points from a can are those of its formula, in variance.json as in the file of points.
#[test]
fn points_of_a_scan_have_their_distances_from_the_exact_surface() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    write(folder, "can.gml", CLOSED);
    let scan =
        ["scan", "can.gml", "-p", "r=20.4mm", "--noise", "0.05mm", "--spacing", "1.5mm", "--no-pose", "-o", "scan.ply"];
    gmlc(folder, &scan);
    let run = ["variance", "can.gml", "scan.ply", "--max-distance", "3mm", "--resolution", "256"];
    let text = gmlc(folder, &[&run[..], &["--points", "-o", "out"]].concat());
    assert!(text.contains("the scan's points from the exact surface"), "{text}");
    let report = json(&folder.join("out/variance.json"));
    let points = measured_points(&folder.join("out/points.ply"));
    let exact = |[x, y, z]: [f64; 3]| {
        let (beside, along) = (x.hypot(y) - 20.0, (z - 25.0).abs() - 25.0);
        if beside > 0.0 && along > 0.0 { beside.hypot(along) } else { beside.max(along) }
    };
    // From the faces of the can: a point at an edge belongs to the one that it faces, not always to the nearest.
    let of_part = |part: i32, [x, y, z]: [f64; 3]| {
        let radius = x.hypot(y);
        match part {
            0 => (radius - 20.0).hypot((z - 25.0).abs().max(25.0) - 25.0),
            1 => (radius.max(20.0) - 20.0).hypot(z - 50.0),
            _ => (radius.max(20.0) - 20.0).hypot(z),
        }
    };
    let (mut sum, mut square, mut most, mut none, mut elsewhere) = (0.0, 0.0, 0.0_f64, 0, 0);
    for (place, distance, part) in &points {
        let truth = exact(*place);
        if distance.is_nan() {
            none += 1;
            assert!(*part == -1 && truth.abs() > 0.1, "{place:?} is {truth} away");
            continue;
        }
        let expected = of_part(*part, *place).copysign(truth);
        assert!((0..3).contains(part) && (distance - expected).abs() < 1e-8, "{place:?}: {distance}, not {expected}");
        elsewhere += usize::from((distance - truth).abs() > 1e-8);
        (sum, square, most) = (sum + expected, square + expected * expected, most.max(expected.abs()));
    }
    let json = &report["points"];
    let measured = points.len() - none;
    let count = |name: &str| number(&json[name]) as usize;
    assert_eq!((count("points"), count("measured")), (points.len(), measured));
    assert_eq!(count("beyond") + count("facing_away"), none);
    assert!(none > 0 && none < points.len() / 100, "outliers: {none}");
    assert!(elsewhere < points.len() / 50, "{elsewhere} of {} are not from the nearest face", points.len());
    let mean = sum / measured as f64;
    let sd = (square / measured as f64 - mean * mean).sqrt();
    assert!((number(&json["signed"]["mean"]) - mean).abs() < 1e-6 && (number(&json["signed"]["sd"]) - sd).abs() < 1e-6);
    assert!((number(&json["largest"]["distance"]).abs() - most).abs() < 1e-8, "{}", json["largest"]);
    let side = json["parts"].as_array().expect("parts").iter().find(|part| part["name"] == "side").expect("the side");
    assert!((number(&side["signed"]["median"]) - 0.4).abs() < 0.01, "{side}");
    gmlc(folder, &[&run[..], &["-o", "without"]].concat());
    assert!(!folder.join("without/points.ply").exists());
}

const CLOSED: &str = "use std.surface (cylinder, disc, flip)\nmodel can {\n\
    param r: length = 20mm\n param h: length = 50mm\n\
    part side = cylinder(r, h)\n\
    part lid = |u, v| disc(r)(u, v) + (0mm, 0mm, h)\n\
    part base = flip(disc(r))\n}\n";

/// What agrees is said by the tolerance or else by the noise, with the sign's meaning; and so is where the model came
/// from.
#[test]
fn surface_is_over_or_under_by_stated_limits() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    write(folder, "can.gml", CLOSED);
    let scan = ["-p", "r=20.4mm", "--noise", "0.05mm", "--spacing", "1.5mm", "--no-pose", "-o", "scan.ply"];
    gmlc(folder, &[&["scan", "can.gml"], &scan[..]].concat());
    let run = |options: &[&str]| {
        let command = ["variance", "can.gml", "scan.ply", "--max-distance", "3mm", "--resolution", "256", "-o", "out"];
        let text = gmlc(folder, &[&command[..], options].concat());
        let report = json(&folder.join("out/variance.json"));
        for part in report["parts"].as_array().expect("parts") {
            let areas = ["within", "over", "under"].map(|side| number(&part["agreement"][side]["area"]));
            assert!((areas.iter().sum::<f64>() - number(&part["measured_area"])).abs() < 1e-6, "{part}");
            let limits = &part["agreement"];
            let shown = format!("{} to {}", table(number(&limits["lower"])), table(number(&limits["upper"])));
            assert!(text.contains(&shown), "{shown}: {text}");
        }
        let points = &report["points"];
        let counted = ["within", "over", "under"].map(|side| number(&points["agreement"][side]));
        assert_eq!(counted.iter().sum::<f64>(), number(&points["measured"]));
        assert!(!text.contains("all of the scan"), "{text}");
        (report, text)
    };
    let share = |report: &serde_json::Value, part: usize, side: &str| {
        number(&report["parts"][part]["agreement"][side]["share"])
    };
    // The side is 0.4 mm too wide, eight standard deviations of the noise; lid and base are where they should be.
    let (by_noise, text) = run(&[]);
    let limit = 3.0 * number(&by_noise["parts"][0]["detection"]["noise"]);
    assert_eq!(by_noise["parts"][0]["agreement"]["basis"], "noise");
    assert!((number(&by_noise["parts"][0]["agreement"]["upper"]) - limit).abs() < 1e-12, "{limit}");
    assert!(share(&by_noise, 0, "over") > 0.98 && share(&by_noise, 0, "under") < 0.01, "{text}");
    assert!(share(&by_noise, 1, "within") > 0.95 && share(&by_noise, 2, "within") > 0.95, "{text}");
    let threshold = format!("is within {} mm (3 times the scan's noise) of the scan", table(limit));
    assert_eq!(text.matches(&threshold).count(), 1, "{threshold}: {text}");

    // Most of the side's points are within half a millimetre, and none of them inside of -0.1 mm.
    let (tolerated, text) = run(&["--tolerance", "+0.6/-0.1mm"]);
    let side = &tolerated["parts"][0];
    assert_eq!(
        (&side["agreement"]["basis"], &side["agreement"]["within"]["area"]),
        (&"tolerance".into(), &side["tolerance"]["area_within"])
    );
    assert!(share(&tolerated, 0, "within") > 0.98, "{text}");
    assert_eq!(text.matches("is within -0.1000 to 0.6000 mm (the tolerance) of the scan").count(), 1, "{text}");

    let said = |(report, text): (serde_json::Value, String)| {
        let warnings: Vec<String> = serde_json::from_value(report["warnings"].clone()).expect("sentences");
        let of_model = |w: &&String| w.starts_with("the model ");
        let sentences: Vec<&String> = warnings.iter().filter(of_model).collect();
        assert!(sentences.iter().all(|w| text.contains(&format!("warning: {w}"))), "{text}");
        sentences.into_iter().cloned().collect::<Vec<_>>().join("; ")
    };
    let defaults = "neither fitted nor placed: its parameters are the script's defaults, and its pose is the script's";
    assert!(said(run(&[])).contains(defaults));
    let given =
        "neither fitted nor placed: `r` is as given, the other parameters are the script's defaults, and the pose";
    assert!(said(run(&["-p", "r=20.4mm"])).contains(given));
    let all = "neither fitted nor placed: `r`, `h` are as given, and the pose is the script's";
    assert!(said(run(&["-p", "r=20.4mm", "-p", "h=50mm"])).contains(all));
    gmlc(folder, &["fit", "can.gml", "scan.ply", "--no-pose", "-o", "fit.json"]);
    assert_eq!(said(run(&["--params", "fit.json"])), "");
    let changed = "not the fitted one: `h` is as given; the other parameters and the pose are the fit's";
    assert!(said(run(&["--params", "fit.json", "-p", "h=50mm"])).contains(changed));
}

/// A figure as the terminal shows it.
fn table(figure: f64) -> String {
    gml_runtime::export::number(figure)
}

const TURNED: &str = "warning: the scan faces the other way than the model everywhere: it was turned as a whole";

/// Parameters and signed mean deviations of an inspection (NaN where no place of a part was met), and the printed text.
fn inspected(folder: &Path, script: &str, scan: &str) -> (Vec<f64>, Vec<f64>, String) {
    let text = gmlc(folder, &["inspect", script, scan, "--resolution", "256", "--device", "cpu", "-o", "out"]);
    let list = |file: &str, field: &str| json(&folder.join("out").join(file))[field].as_array().cloned();
    let parameters = list("fit.json", "parameters").expect("parameters");
    let parts = list("variance.json", "parts").expect("parts");
    let means = parts.iter().map(|p| p["signed"]["mean"].as_f64().unwrap_or(f64::NAN)).collect();
    (parameters.iter().map(|p| number(&p["value"])).collect(), means, text)
}

/// Which side is out is the script's, or follows from the volume that it encloses; a scan is turned as a whole.
#[test]
fn a_scan_with_the_other_side_out_is_turned() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    write(folder, "can.gml", CLOSED);
    gmlc(folder, &["scan", "can.gml", "-p", "r=21mm", "--spacing", "2mm", "--noise", "0.1mm", "-o", "scan.obj"]);
    let scan = std::fs::read_to_string(folder.join("scan.obj")).expect("text");
    let turn = |line: &str| match line.split_whitespace().collect::<Vec<_>>()[..] {
        ["f", a, b, c] => format!("f {a} {c} {b}\n"),
        _ => format!("{line}\n"),
    };
    write(folder, "turned.obj", &scan.lines().map(turn).collect::<String>());
    let (parameters, means, text) = inspected(folder, "can.gml", "scan.obj");
    assert!(!text.contains("turned") && (parameters[0] - 21.0).abs() < 0.02, "{text}");
    let (of_turned, means_of_turned, text) = inspected(folder, "can.gml", "turned.obj");
    assert_eq!(text.matches(TURNED).count(), 1, "{text}");
    for (a, b) in parameters.iter().chain(&means).zip(of_turned.iter().chain(&means_of_turned)) {
        assert!((a - b).abs() < 1e-3, "{a} and {b}: {text}");
    }
    let fit = gmlc(folder, &["fit", "can.gml", "turned.obj", "-o", "fit.json"]);
    let variance = ["variance", "can.gml", "turned.obj", "--params", "fit.json", "--resolution", "256", "-o", "out"];
    assert!(fit.matches(TURNED).count() == 1 && gmlc(folder, &variance).matches(TURNED).count() == 1, "{fit}");

    // A base that is written inside out encloses the same volume.
    write(folder, "base.gml", &CLOSED.replace("flip(disc(r))", "disc(r)"));
    let (_, means_of_base, text) = inspected(folder, "base.gml", "scan.obj");
    assert!(text.contains("the outer side of base is the other one than written"), "{text}");
    assert!((means[2] - means_of_base[2]).abs() < 0.01, "{means:?} and {means_of_base:?}");
    // A part of an open model is left as it is written, and named.
    let open = CLOSED.replace("part base = flip(disc(r))\n", "").replace("disc(r)(u, v)", "flip(disc(r))(u, v)");
    write(folder, "open.gml", &open);
    let (parameters, means, text) = inspected(folder, "open.gml", "scan.obj");
    // The few places that its rays meet are those of the side.
    assert!(means[1].is_nan(), "{text}");
    assert!(text.contains("the outer side of `lid` faces the inner one of the scan"), "{text}");
    assert!((parameters[0] - 21.0).abs() < 0.02, "{text}");
}

/// The base of a post half a millimetre above a plate is hidden, and faces the plate's outer side.
#[test]
fn what_rests_unseen_on_another_part_is_not_inside_out() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    let stand = "use std.frame (translate)
use std.solid (box, frustum)
model stand {
  param r: length in 5mm..15mm = 7mm
  part plate = box(width: 60mm, depth: 40mm, height: 5mm)
  part post = frustum(bottom: r, top: r - 3mm, height: 14mm).translate((0mm, 0mm, 5.5mm))
}
";
    write(folder, "stand.gml", stand);
    let scan =
        ["scan", "stand.gml", "--no-pose", "--spacing", "1mm", "--noise", "0.03mm", "--seed", "5", "-o", "s.ply"];
    gmlc(folder, &scan);
    let text = gmlc(folder, &["variance", "stand.gml", "s.ply", "--resolution", "512", "-o", "out"]);
    assert!(text.contains("post.base") && !text.contains("faces the inner one of the scan"), "{text}");
}

/// The scanned wall is 3 mm thick, the model's 1 mm: the scan's outer side is nearer to the model's inner one than the
/// inner side is.
#[test]
fn sides_of_a_wall_are_the_scripts_even_if_the_other_is_nearer() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    let bowl = crate::support::example("bowl/bowl.gml");
    gmlc(folder, &["mesh", &bowl, "-o", "scan.ply"]);
    let options = ["-p", "wall=1mm", "--resolution", "256", "--device", "cpu", "-o", "out"];
    let text = gmlc(folder, &[&["variance", &bowl, "scan.ply"], &options[..]].concat());
    let report = json(&folder.join("out/variance.json"));
    let floor =
        report["parts"].as_array().and_then(|parts| parts.iter().find(|p| p["name"] == "floor")).expect("a floor");
    // The floors lie at 3 mm and 1 mm times the cosine of the slope of 25 degrees.
    assert!((number(&floor["signed"]["mean"]) - 2.0 * 25f64.to_radians().cos()).abs() < 0.02, "{text}");
    assert!(!text.contains("turned") && !text.contains("outer side of floor"), "{text}");
}

/// A plate of 40 mm, half a millimetre above the model, with a hole of 3 x 3 mm and one of 12 x 12 mm.
#[test]
fn small_holes_are_filled_and_not_measured() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    write(folder, "plate.gml", "use std.surface (plane)\nmodel plate { part top = plane(40mm, 40mm) }\n");
    let hole = |i: usize, j: usize| {
        (5..8).contains(&i) && (5..8).contains(&j) || (20..32).contains(&i) && (20..32).contains(&j)
    };
    let cells: Vec<(usize, usize)> = (0..1600).map(|k| (k % 40, k / 40)).filter(|(i, j)| !hole(*i, *j)).collect();
    let mut ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        41 * 41,
        cells.len()
    );
    for k in 0..41 * 41 {
        let _ = writeln!(ply, "{} {} 0.5", (k % 41) as f64 - 20.0, (k / 41) as f64 - 20.0);
    }
    for (i, j) in cells {
        let corner = 41 * j + i;
        let _ = writeln!(ply, "4 {} {} {} {}", corner, corner + 1, corner + 42, corner + 41);
    }
    write(folder, "scan.ply", &ply);
    for distance in ["normal", "closest"] {
        let options = ["--distance", distance, "--fill-holes", "5mm", "--resolution", "256", "-o", distance];
        let text = gmlc(folder, &[&["variance", "plate.gml", "scan.ply"], &options[..]].concat());
        let report = json(&folder.join(distance).join("variance.json"));
        let holes = &report["holes"];
        assert_eq!(
            (number(&holes["size"]), number(&holes["filled"]), number(&holes["open"])),
            (5.0, 1.0, 2.0),
            "{text}"
        );
        assert!((number(&holes["area"]) - 9.0).abs() < 1e-9);
        // Texels are 0.16 mm wide: the count is exact to a row on each side.
        assert!((number(&report["filled_area"]) - 9.0).abs() < 2.0, "{}", report["filled_area"]);
        let expected = 1600.0 - 9.0 - 144.0;
        assert!((number(&report["measured_area"]) - expected).abs() < 10.0, "{}", report["measured_area"]);
        assert!((number(&report["max"]) - 0.5).abs() < 1e-5);
        assert!(text.contains("closed 1 hole of"), "{text}");
        assert!(folder.join(distance).join("filled.ply").exists());
    }
}

/// A cloud of a can is measured by its points, and by the triangles that are made of it.
#[test]
fn a_cloud_is_measured_and_has_no_edges_of_holes() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    write(folder, "can.gml", CAN);
    let around = |k: usize| (k as f64 / 160.0 * std::f64::consts::TAU).sin_cos();
    let points: String = (0..160 * 60)
        .map(|k| (around(k % 160), 0.4 + 0.83 * (k / 160) as f64))
        .map(|((s, c), z)| format!("v {} {} {z}\n", 20.3 * c, 20.3 * s))
        .collect();
    write(folder, "cloud.obj", &points);
    let error = fails(folder, &["variance", "can.gml", "cloud.obj", "--fill-holes", "2mm", "-o", "out"], 1);
    assert!(error.contains("cloud.obj: is a point cloud without triangles") && error.contains("--surface"), "{error}");
    assert!(!folder.join("out").exists());
    for (out, options) in [("points", vec![]), ("surface", vec!["--surface"])] {
        let arguments = ["variance", "can.gml", "cloud.obj", "--max-distance", "1mm", "--resolution", "256", "-o", out];
        let text = gmlc(folder, &[&arguments[..], &options[..]].concat());
        assert_eq!(text.contains("in cylinders about the normals"), options.is_empty(), "{text}");
        let report = json(&folder.join(out).join("variance.json"));
        assert_eq!(report["cylinder"].is_object(), options.is_empty());
        let side = &report["parts"][0];
        // Chords between points 0.8 mm apart are 0.004 mm inside of the circle.
        assert!((number(&side["signed"]["mean"]) - 0.3).abs() < 0.006, "{side}");
        // Of four points in a square neighbours may take different diagonals: no triangle is kept there.
        let least = if options.is_empty() { 0.95 } else { 0.75 };
        assert!(number(&side["coverage"]) > least, "{side}");
        for file in ["report.html", "model.x3d", "views.png", "overview.png", "distance.tif", "unmatched.ply"] {
            assert!(folder.join(out).join(file).exists(), "{file}");
        }
    }
}

/// No length follows from a surface that is a point.
#[test]
fn a_surface_without_extent_has_no_maximum_distance() {
    let folder = tempdir().expect("a folder");
    let folder = folder.path();
    write(folder, "dot.gml", "model dot {\n  part p = |u, v| (0mm, 0mm, 0mm)\n}\n");
    write(folder, "scan.obj", "v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n");
    let error = fails(folder, &["variance", "dot.gml", "scan.obj", "-o", "out"], 1);
    assert!(error.contains("the surface has no extent") && error.contains("--max-distance"), "{error}");
}
