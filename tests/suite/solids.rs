//! Solids by the built command: their meshes are closed, their virtual scans lie on them, and fits and measurements see
//! what is there of them.

use crate::support::solid::{checked, measure, must_be_closed, triangles};
use crate::support::{fails, gmlc, gmlc_in, json, root};
use serde_json::Value;
use std::collections::HashMap;
use std::f64::consts::PI;
use std::fs;
use tempfile::tempdir;

const PLATE: &str = "model plate {
  param d: length in 1mm..20mm = 8mm
  let bolt = capped_cylinder(radius: d / 2, height: 6mm)
  part plate = box(width: 60mm, depth: 40mm, height: 6mm) - {
    hole: for i in 0..2 { bolt.translate(((i - 0.5) * 30mm, 0mm, 0mm)) },
  }
}
";

/// A parameter of a fit with its standard deviation.
fn estimate(fit: &Value, name: &str) -> (f64, f64) {
    let all = fit["parameters"].as_array().expect("parameters");
    let of_name = all.iter().find(|p| p["name"] == name).expect("the parameter");
    (of_name["value"].as_f64().expect("a value"), of_name["sd"].as_f64().expect("a standard deviation"))
}

#[test]
fn the_mesh_of_a_drilled_plate_is_closed() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("plate.gml"), PLATE).expect("written");
    gmlc(folder.path(), &["mesh", "plate.gml", "-o", "plate.stl"]);
    must_be_closed(&folder.path().join("plate.stl"));
    let check = gmlc(folder.path(), &["check", "plate.gml"]);
    assert!(check.contains("plate.hole[1].wall") && check.contains("closed"), "{check}");
}

#[test]
fn a_virtual_scan_of_a_drilled_plate_lies_on_it() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("plate.gml"), PLATE).expect("written");
    let exact = ["--noise", "0mm", "--spacing", "1mm", "--outliers", "0", "--no-pose"];
    gmlc(folder.path(), &[&["scan", "plate.gml", "-o", "scan.ply"][..], &exact].concat());
    gmlc(folder.path(), &["mesh", "plate.gml", "-o", "plate.stl"]);
    gmlc(folder.path(), &["variance", "plate.stl", "scan.ply", "-o", "out"]);
    let points = &json(&folder.path().join("out/variance.json"))["points"];
    // The mesh keeps to 0.02 mm, and rounds to single precision.
    let largest = points["max"].as_f64().unwrap_or(f64::NAN);
    assert!(points["measured"].as_u64() > Some(5000) && largest < 0.021, "{points}");
}

#[test]
fn a_fit_recovers_the_holes_of_a_plate_and_a_measurement_sees_what_is_there() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("plate.gml"), PLATE).expect("written");
    let scan = ["-p", "d=9mm", "--noise", "0.05mm", "--spacing", "0.8mm", "--seed", "3"];
    gmlc(folder.path(), &[&["scan", "plate.gml", "-o", "scan.ply"][..], &scan].concat());
    gmlc(folder.path(), &["inspect", "plate.gml", "scan.ply", "-o", "out"]);
    let fit = json(&folder.path().join("out/fit.json"));
    let (value, sd) = estimate(&fit, "d");
    // Four standard deviations, and a tenth of the noise.
    assert!((value - 9.0).abs() < 4.0 * sd && (value - 9.0).abs() < 0.005 && sd > 0.0, "{value} {sd}");
    let parts = &json(&folder.path().join("out/variance.json"))["parts"];
    // The face less the two holes; texels at their edges count in full or not at all.
    let top = parts.as_array().and_then(|parts| parts.iter().find(|part| part["name"] == "plate.top"));
    let top = top.expect("the face")["area"].as_f64().expect("an area");
    let truth = 60.0 * 40.0 - 2.0 * std::f64::consts::PI * 4.5f64.powi(2);
    assert!((top / truth - 1.0).abs() < 2e-3, "{top}, not {truth}");
}

/// The handle of the mug depends on the wall where it ends: also its points far from there say so, with a slope of
/// zero, or sums over points of several chunks would mix parameters.
#[test]
fn a_fit_of_a_mug_has_standard_deviations() {
    let folder = tempdir().expect("a folder");
    let mug = root().join("examples/mug/mug.gml").display().to_string();
    gmlc(folder.path(), &["scan", &mug, "--seed", "3", "-o", "mug.ply"]);
    gmlc(folder.path(), &["fit", &mug, "mug.ply", "-o", "fit.json"]);
    let fit: Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("fit.json")).expect("it is there")).expect("JSON");
    for (name, truth, most) in [("foot", 40.0, 0.01), ("height", 80.0, 0.04), ("reach_top", 70.0, 0.5)] {
        let (value, sd) = estimate(&fit, name);
        assert!(sd < most && (value - truth).abs() < 5.0 * sd, "{name}: {value} +- {sd}");
    }
}

#[test]
fn a_plate_does_not_differ_from_itself() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("plate.gml"), PLATE).expect("written");
    gmlc(folder.path(), &["compare", "plate.gml", "plate.gml", "-o", "difference.json"]);
    let difference = &json(&folder.path().join("difference.json"));
    let largest = difference["hausdorff"].as_f64().expect("a distance");
    assert!(largest < 1e-4, "{largest} mm from itself");
}

/// A lens of two balls, and a body of two that overlap.
const LENS: &str = "use std.solid (ball)\nmodel lens {
  part lens = {lower: ball(radius: 50mm).translate((0mm, 0mm, -38mm))} & {upper: ball(radius: 35mm).translate((0mm, 0mm, 35mm))}
}
";

#[test]
fn a_comparison_integrates_what_is_there() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("lens.gml"), LENS).expect("written");
    gmlc(folder.path(), &["compare", "lens.gml", "lens.gml", "-o", "difference.json"]);
    let body = &json(&folder.path().join("difference.json"))["a"];
    // Spherical caps: their circle lies where both spheres have one height.
    let (lower, upper, apart) = (50.0_f64, 35.0_f64, 73.0_f64);
    let height = (apart * apart + lower * lower - upper * upper) / (2.0 * apart);
    let (a, b) = (lower - height, upper - (apart - height));
    let cap = |r: f64, h: f64| (std::f64::consts::TAU * r * h, std::f64::consts::PI * h * h * (r - h / 3.0));
    let ((first, under), (second, above)) = (cap(lower, a), cap(upper, b));
    for (found, truth) in [(&body["area"], first + second), (&body["volume"], under + above)] {
        let found = found.as_f64().expect("a number");
        assert!((found / truth - 1.0).abs() < 1e-3, "{found}, not {truth}");
    }
}

/// A shaft with a keyway whose ends are round: the walls of the ends touch those between them along lines.
const KEYWAY: &str = "use std.solid (box, capped_cylinder)\nmodel shaft {
  param r: length in 5mm..40mm = 15mm
  param kw: length in 2mm..12mm = 6mm
  let slot = box(width: 8mm, depth: kw, height: 18mm).translate((r, 0mm, 0mm))
  let end = capped_cylinder(radius: kw / 2, height: 8mm).rotate(90deg, (0, 1, 0)).translate((r - 4mm, 0mm, 0mm))
  part body = capped_cylinder(radius: r, height: 40mm)
    - {key: {a: slot, b: end, c: end.translate((0mm, 0mm, 18mm))}.translate((0mm, 0mm, 11mm))}
}
";

#[test]
fn surfaces_that_touch_along_a_line_do_not_spoil_the_standard_deviations() {
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join("shaft.gml"), KEYWAY).expect("written");
    let scan = ["-p", "r=15.5mm", "-p", "kw=5.5mm", "--noise", "0.05mm", "--spacing", "1.2mm", "--seed", "1"];
    gmlc(folder.path(), &[&["scan", "shaft.gml", "-o", "scan.ply"][..], &scan].concat());
    gmlc(folder.path(), &["fit", "shaft.gml", "scan.ply", "-o", "fit.json"]);
    let fit = json(&folder.path().join("fit.json"));
    for (name, truth, most) in [("r", 15.5, 0.005), ("kw", 5.5, 0.05)] {
        let (value, sd) = estimate(&fit, name);
        assert!(sd < most && (value - truth).abs() < 4.0 * sd, "{name}: {value} +- {sd}");
    }
}

/// However coarse the chord, surfaces leave the edges that they have in common by no more than can be closed.
#[test]
fn meshes_of_coarse_chords_are_closed() {
    let folder = tempdir().expect("a folder");
    let script = "model m {
  param s: length = 20mm
  part b = box(width: s, depth: s, height: s)
    - {h: capped_cylinder(radius: s / 4, height: s).translate((0.15 * s, 0mm, 0mm))}
}
";
    fs::write(folder.path().join("m.gml"), script).expect("written");
    // The default chord, 0.02 mm, is coarse for what is small.
    for [size, chord] in [["20mm", "1mm"], ["20mm", "2mm"], ["20mm", "4mm"], ["0.1mm", "0.02mm"], ["0.01mm", "0.02mm"]]
    {
        let size = format!("s={size}");
        gmlc(folder.path(), &["mesh", "m.gml", "-p", &size, "--chord", chord, "-o", "m.stl"]);
        must_be_closed(&folder.path().join("m.stl"));
    }
}

/// A gap is narrower than the chord, and the surfaces at either side of it have their vertices at other angles.
#[test]
fn triangles_that_pass_through_each_other_are_said() {
    let folder = tempdir().expect("a folder");
    let script = "model m {
  part plate = box(width: 100mm, depth: 100mm) - {hole: capped_cylinder(radius: 40.02mm)}
  part peg = capped_cylinder(radius: 40mm).rotate(2deg)
}
";
    fs::write(folder.path().join("m.gml"), script).expect("written");
    assert!(!gmlc(folder.path(), &["check", "m.gml"]).contains("each other"));
    let said = |chord: &str| gmlc(folder.path(), &["mesh", "m.gml", "-o", "m.stl", "--chord", chord, "--json"]);
    assert!(said("0.2mm").contains("triangles pass through each other"), "{}", said("0.2mm"));
    assert!(!said("0.005mm").contains("each other"), "{}", said("0.005mm"));
}

/// A requirement of the library that is not met is reported at the part of the script.
#[test]
fn what_the_library_requires_is_said_of_the_part() {
    let folder = tempdir().expect("a folder");
    let script =
        "model m {\n  param w: length in 1mm..20m = 5mm\n  part a = box(height: w)\n  part b = box(width: 10.5m)\n}\n";
    fs::write(folder.path().join("m.gml"), script).expect("written");
    let errors = fails(folder.path(), &["check", "m.gml"], 1);
    assert!(errors.contains("m.gml:4:3") && errors.contains("in part b.top"), "{errors}");
    let errors = fails(folder.path(), &["check", "m.gml", "-p", "w=11m"], 1);
    assert!(errors.contains("m.gml:3:3") && errors.contains("in part a.top"), "{errors}");
}

#[test]
fn impossible_dimensions_are_refused() {
    let folder = tempdir().expect("a folder");
    let cases = [
        ("pipe(outer: 5mm, inner: 5mm)", "the inner radius of a pipe is less"),
        ("elbow(outer: 5mm, inner: 5mm)", "the inner radius of an elbow is less"),
        ("hollow_sphere(outer: 5mm, inner: 5mm)", "the inner radius of a hollow sphere is less"),
        ("rounded_box(width: 10mm, radius: 5mm)", "less than half of its shortest side"),
        ("rounded_box(radius: 0mm)", "above zero"),
        ("solid_torus(bend: 4mm, radius: 5mm)", "its surface crosses itself"),
        ("ball(radius: -5mm)", "the radius of a ball is above zero"),
        ("bevel_ring(3mm, 4mm, inward: true)", "no more than the cylinder's radius"),
        ("cove_ring(3mm, 4mm, inward: true)", "no more than its radius"),
        ("threaded_rod(2mm, 2mm, 20mm)", "deeper than the rod's radius"),
        ("threaded_rod(4mm, 0.7mm, 20mm, run_out: 0mm)", "runs out over a length above zero"),
    ];
    for (body, said) in cases {
        fs::write(folder.path().join("m.gml"), format!("model m {{ part b = {body} }}\n")).expect("written");
        let errors = fails(folder.path(), &["check", "m.gml"], 1);
        assert!(errors.contains(said), "{body}: {errors}");
    }
}

#[test]
fn a_plate_with_a_hundred_holes_is_closed() {
    let script = "model plate {
  param d: length in 2mm..12mm = 6mm
  measure volume = volume(plate)
  let bolt = capped_cylinder(radius: d / 2, height: 5mm)
  let holes = for i in 0..10 { for j in 0..10 { bolt.translate(((i - 4.5) * 18mm, (j - 4.5) * 18mm, 0mm)) } }
  part plate = box(width: 200mm, depth: 200mm, height: 5mm) - {hole: separate(concat(for row in holes { row }))}
}
";
    let script = script.replace("concat(for row in holes { row })", "for k in 0..100 { holes[floor(k / 10)][k % 10] }");
    let check = checked(&script, &[]);
    assert_eq!(check["closed"], true);
    let (volume, slope) = (measure(&check, 0), &check["measures"][0]["derivatives"]["d"]);
    let (truth, by_d) = (200_000.0 - 4500.0 * PI, -1500.0 * PI);
    assert!((volume / truth - 1.0).abs() < 1e-6, "{volume} for {truth}");
    assert!((slope.as_f64().expect("a slope") / by_d - 1.0).abs() < 1e-5, "{slope} for {by_d}");
}

/// Rims between an outline and a hole of the same depth, which no place of the two triangles of a face shows.
#[test]
fn tubes_of_outlines_are_closed() {
    let script = "model tubes {
  param wall: length in 0.3mm..5mm = 1mm
  measure of_straight = volume(straight)
  measure of_spout = volume(spout)
  fn rectangle(x: length, y: length) = [(x, -y), (x, y), (-x, y), (-x, -y)]
  part straight = extruded(rectangle(20mm, 30mm), 8mm)
    - {bore: extruded(rectangle(20mm - wall, 30mm - wall), 8mm)}
  let cone = lofted(rectangle(9mm, 9mm), rectangle(3mm, 5mm), 8mm)
    - {bore: lofted(rectangle(9mm - wall, 9mm - wall), rectangle(3mm - wall, 5mm - wall), 8mm)}
  part spout = cone.translate((90mm, 0mm, 0mm))
}
";
    for wall in [0.4, 1.0, 2.5] {
        let check = checked(script, &[format!("wall={wall}mm")]);
        assert_eq!(check["closed"], true, "{check}");
        // The prismatoid formula: a sixth of both ends and four times the middle.
        let frustum = |w: f64| {
            let area = |x: f64, y: f64| 4.0 * (x - w) * (y - w);
            8.0 / 6.0 * (area(9.0, 9.0) + 4.0 * area(6.0, 7.0) + area(3.0, 5.0))
        };
        let truths = [8.0 * (2400.0 - 4.0 * (20.0 - wall) * (30.0 - wall)), frustum(0.0) - frustum(wall)];
        for (k, truth) in truths.into_iter().enumerate() {
            let volume = measure(&check, k);
            assert!((volume / truth - 1.0).abs() < 1e-5, "{wall}: {volume} for {truth}");
        }
    }
}

/// Holes in a floor and bosses on it, whose function of what is there is nowhere larger than the plate is thick.
#[test]
fn holes_and_bosses_of_a_pocket_are_found() {
    let script = "model housing {
  param x: length = 5mm
  param y: length = 7mm
  param r: length = 3mm
  measure material = volume(drilled)
  measure floor = area(mounted.cavity.base)
  let shell = box(width: 60mm, depth: 40mm, height: 8mm)
    - {cavity: box(width: 56mm, depth: 36mm, height: 6mm).translate((0mm, 0mm, 2mm))}
  part drilled = shell - {hole: capped_cylinder(radius: r, height: 8mm).translate((x, y, 0mm))}
  let with_boss = shell + {boss: capped_cylinder(radius: r, height: 5mm).translate((x, y, 2mm))}
  part mounted = with_boss.translate((0mm, 90mm, 0mm))
}
";
    for (x, y, r) in [(5.0, 7.0, 3.0), (-15.0, 0.0, 3.0), (10.123, -4.5, 0.7), (19.297, 12.0, 1.5), (20.0, 10.0, 4.0)] {
        let given = [format!("x={x}mm"), format!("y={y}mm"), format!("r={r}mm")];
        let check = checked(script, &given);
        assert_eq!(check["closed"], true, "{given:?}: {check}");
        let circle = PI * r * r;
        let truths = [60.0 * 40.0 * 8.0 - 56.0 * 36.0 * 6.0 - 2.0 * circle, 56.0 * 36.0 - circle];
        for (k, truth) in truths.into_iter().enumerate() {
            let value = measure(&check, k);
            assert!((value / truth - 1.0).abs() < 1e-5, "{given:?}: {value} for {truth}");
        }
    }
}

/// The triangles of a long bore reach from its middle to its end, where they are cut; a hole in the rest of them is
/// narrower than the wall is thick.
#[test]
fn a_hole_in_the_wall_of_a_long_pipe_is_found() {
    let script = "model pipe {
  param lean: angle = 28deg
  fn along(r) = capped_cylinder(radius: r, height: 240mm).translate((0mm, 0mm, -120mm)).rotate(90deg, (0, 1, 0))
  let drill = capped_cylinder(radius: 5mm, height: 130mm).rotate(lean, (0, 1, 0))
  part pipe = along(23mm) - {bore: along(20mm)} - {hole: drill}
}
";
    for lean in ["lean=0deg", "lean=28deg", "lean=-40deg"] {
        let check = checked(script, &[lean.into()]);
        assert_eq!(check["closed"], true, "{lean}: {}", check["open_borders"]);
    }
}

/// The ends of a lens of two cylinders are discs in polar coordinates about their middles, in which what is straight in
/// (u, v) is not so in space.
#[test]
fn arcs_across_discs_keep_to_the_chord() {
    let folder = tempdir().expect("a folder");
    let script = "model lens {
  let round = capped_cylinder(radius: 400mm, height: 40mm)
  part lens = round.translate((-200mm, 0mm, 0mm)) & {other: round.translate((200mm, 0mm, 0mm))}
}
";
    fs::write(folder.path().join("lens.gml"), script).expect("written");
    let lens = 400.0_f64.powi(2) * (2.0 * PI / 3.0 - 3.0_f64.sqrt() / 2.0) * 40.0;
    for chord in [0.01, 0.05, 0.5] {
        gmlc(folder.path(), &["mesh", "lens.gml", "--chord", &format!("{chord}mm"), "-o", "lens.stl"]);
        must_be_closed(&folder.path().join("lens.stl"));
        let volume: f64 = triangles(&fs::read(folder.path().join("lens.stl")).expect("it is there"))
            .iter()
            .map(|corners| corners.map(|c| c.map(|bits| f64::from(f32::from_bits(bits)))))
            .map(|[a, b, c]| {
                let cross = [1, 2, 0].map(|i| b[i] * c[(i + 1) % 3] - b[(i + 1) % 3] * c[i]);
                (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6.0
            })
            .sum();
        // Its wall is 40 mm x 2 x 838 mm, from which chords may be off as far as that.
        assert!((volume - lens).abs() < chord * 40.0 * 1676.0, "{chord}: {volume}, not {lens}");
    }
}

/// Edges that run along u or v are lines of the mesh: the triangles of a long pole are hardly divided beside its slots,
/// and those of a face not beside an edge along which another solid is tangent.
#[test]
fn straight_edges_need_few_triangles() {
    let folder = tempdir().expect("a folder");
    let pole = "model pole {
  let slot = box(width: 60mm, depth: 200mm, height: 45mm)
  fn at(i) = slot.translate((70mm, 0mm, 0mm)).rotate(i * 24deg).translate((0mm, 0mm, 100mm + 330mm * i))
  part pole = capped_cylinder(radius: 80mm, height: 3000mm) - {slot: for i in 0..8 { at(i) }}
}
";
    let arch = "model arch {
  let round = capped_cylinder(radius: 1600mm, height: 500mm).rotate(-90deg, (1, 0, 0))
  let lens = round.translate((-800mm, 0mm, 0mm)) & {other: round.translate((800mm, 0mm, 0mm))}
  part arch = box(width: 1600mm, depth: 500mm, height: 900mm).translate((0mm, 250mm, -900mm)) + {arch: lens}
}
";
    // 33,000 and 10,000; without the lines they took 154,000 and 44,000.
    for (name, script, most) in [("pole", pole, 50_000), ("arch", arch, 16_000)] {
        fs::write(folder.path().join("model.gml"), script).expect("written");
        let stl = format!("{name}.stl");
        gmlc(folder.path(), &["mesh", "model.gml", "-o", &stl]);
        must_be_closed(&folder.path().join(&stl));
        let triangles = fs::metadata(folder.path().join(&stl)).expect("it is there").len() / 50;
        assert!(triangles < most, "{name}: {triangles}");
    }
}

/// In corners where three solids meet narrow triangles may come to lie on each other back to back: programs that read a
/// mesh call that not watertight, as an edge has four triangles.
#[test]
fn no_triangles_lie_back_to_back() {
    let bite = "model m {
  let base = capped_cylinder(radius: 8mm, height: 17mm).rotate(90deg).translate((-0.2mm, 1.17mm, -6mm))
  let stud = capped_cylinder(radius: 6.67mm, height: 11.26mm).rotate(-90deg, (1, 0, 0)).translate((2.57mm, 3.06mm, 8mm))
  let ring = solid_torus(bend: 9mm, radius: 5.78mm).translate((-3.43mm, 5mm, 3.23mm))
  let bore = capped_cylinder(radius: 6.2mm, height: 37mm).rotate(45deg, (1, 0, 0)).translate((-7.46mm, -3.23mm, -3mm))
  part p = base + {stud: stud} - {ring: ring} - {bore: bore}
}
";
    let wedge = "model m {
  let rod = capped_cylinder(radius: 12mm, height: 11.49mm).rotate(90deg, (0, 1, 0)).translate((-7.55mm, 5mm, 6mm))
  let first = box(width: 18mm, depth: 19.91mm, height: 8.55mm).translate((-4.45mm, 0.85mm, 2.83mm))
  let second = box(width: 21mm, depth: 21.85mm, height: 19.61mm).rotate(30deg).translate((5.54mm, -0.32mm, 2.64mm))
  let third = box(width: 22mm, depth: 19.46mm, height: 15mm).rotate(126.61deg, (0, 1, 0)).translate((4mm, 8mm, -2mm))
  part p = (rod - {first: first} - {second: second}) & {third: third}
}
";
    for script in [bite, wedge] {
        let folder = tempdir().expect("a folder");
        fs::write(folder.path().join("m.gml"), script).expect("written");
        gmlc(folder.path(), &["mesh", "m.gml", "-o", "m.stl"]);
        let mut of_edge: HashMap<[[u32; 3]; 2], usize> = HashMap::new();
        for corners in triangles(&fs::read(folder.path().join("m.stl")).expect("it is there")) {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                *of_edge.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        assert!(of_edge.values().all(|n| *n == 2), "{script}");
    }
}

/// Triangles of walls that are thinner than the chord pass through each other.
#[test]
fn thin_tubes_are_not_inside_out() {
    let script = "model tube {
  param t: length in 0.01mm..5mm = 1mm
  measure volume = volume(p)
  part p = capped_cylinder(radius: 500mm, height: 900mm) - {bore: capped_cylinder(radius: 500mm - t, height: 900mm)}
}
";
    for t in [0.1, 0.5, 1.0] {
        let check = checked(script, &[format!("t={t}mm")]);
        assert_eq!(check["diagnostics"], Value::Array(Vec::new()), "{t}");
        let (volume, truth) = (measure(&check, 0), PI * (1000.0 - t) * t * 900.0);
        assert!((volume / truth - 1.0).abs() < 1e-4, "{t}: {volume} for {truth}");
    }
}

/// Where cylinders touch planes the mesh is open; check says where, and does not call parts inside out for it.
#[test]
fn a_mesh_with_gaps_says_so() {
    let folder = tempdir().expect("a folder");
    let script = "model cross {
  param height: length in 10mm..90mm = 30mm
  let post = capped_cylinder(radius: 5mm, height: height)
  let bar = capped_cylinder(radius: 4mm, height: 10mm).rotate(90deg, (1, 0, 0))
  part body = post + {bar: bar.translate((0mm, 5mm, height / 2))}
}
";
    fs::write(folder.path().join("cross.gml"), script).expect("written");
    let check = checked(script, &[]);
    let open = check["open_borders"].as_array().expect("borders");
    for border in open {
        // The lines x = 0, y = 5 and y = -5.
        let at: Vec<f64> = border["at"].as_array().expect("a place").iter().map(|c| c.as_f64().expect("mm")).collect();
        assert!(at[0].abs() < 0.01 && (at[1].abs() - 5.0).abs() < 0.01 && (at[2] - 15.0).abs() < 4.5, "{border}");
    }
    let codes: Vec<&str> =
        check["diagnostics"].as_array().expect("warnings").iter().filter_map(|d| d["code"].as_str()).collect();
    assert!(!open.is_empty() && codes == ["touching", "touching"], "{codes:?}");
    let output = gmlc_in(folder.path(), &["mesh", "cross.gml", "-o", "cross.stl"]);
    let said = String::from_utf8(output.stderr).expect("text");
    assert!(said.contains("the mesh is not closed: between 'body.wall' and 'body.bar."), "{said}");
}

/// Sides of an outline that cross leave long gaps, which no finer triangles close.
#[test]
fn gaps_that_are_long_are_not_said_to_close() {
    let folder = tempdir().expect("a folder");
    let outline = "(0mm, 0mm), (20mm, 0mm), (20mm, 10mm), (8mm, -5mm), (0mm, 10mm)";
    let script = format!("model m {{ part b = extruded([{outline}], 5mm) }}\n");
    fs::write(folder.path().join("m.gml"), script).expect("written");
    let output = gmlc_in(folder.path(), &["mesh", "m.gml", "-o", "m.stl"]);
    let said = String::from_utf8(output.stderr).expect("text");
    let gap = said.lines().find(|line| line.contains("the mesh is not closed")).expect("a gap");
    assert!(!gap.contains("--chord"), "{said}");
}

#[test]
fn areas_and_volumes_of_a_fit_have_standard_deviations() {
    let folder = tempdir().expect("a folder");
    let script = PLATE.replace(
        "  let bolt",
        "  param t: length in 2mm..20mm = 6mm
  measure material = volume(plate)
  measure face = area(plate.top)
  measure ratio = material / face
  let bolt",
    );
    fs::write(folder.path().join("plate.gml"), script.replace("height: 6mm", "height: t")).expect("written");
    let scan = ["-p", "d=10mm", "-p", "t=8mm", "--spacing", "1mm", "--noise", "0.05mm", "-o", "scan.ply"];
    gmlc(folder.path(), &[&["scan", "plate.gml"][..], &scan].concat());
    gmlc(folder.path(), &["fit", "plate.gml", "scan.ply", "-o", "fit.json"]);
    let fit = json(&folder.path().join("fit.json"));
    let face = 2400.0 - 50.0 * PI;
    for (name, truth) in [("material", 8.0 * face), ("face", face), ("ratio", 8.0)] {
        let measures = fit["measures"].as_array().expect("measures");
        let measure = measures.iter().find(|m| m["name"] == name).expect("the measure");
        let (value, sd) = (measure["value"].as_f64().expect("a value"), measure["sd"].as_f64().expect("an sd"));
        assert!(
            sd > 0.0 && sd < 0.01 * truth && (value - truth).abs() < 4.0 * sd,
            "{name}: {value} +- {sd} for {truth}"
        );
    }
}

#[test]
fn a_measure_of_parts_that_enclose_nothing_is_an_error_with_its_reason() {
    let folder = tempdir().expect("a folder");
    let script = PLATE.replace("  let bolt", "  measure v = volume(plate.hole)\n  let bolt");
    fs::write(folder.path().join("plate.gml"), script).expect("written");
    let errors = fails(folder.path(), &["check", "plate.gml"], 1);
    assert!(errors.contains("its parts enclose no volume: plate.hole[0].wall is open"), "{errors}");
}
