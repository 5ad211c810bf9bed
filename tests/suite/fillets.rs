//! Fillets by a rolling ball, hollow solids, and solids of smooth profiles: closed, and of the right volume.

use crate::support::solid::{checked, measure, must_be_closed};
use crate::support::{fails, gmlc};
use gml_compiler::program::{Options, Order, Program, Sites, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;
use std::fs;
use tempfile::tempdir;

/// A post that leans on a floor with a fillet, and without.
const LEANING: &str = "model post {
  param r: length in 5mm..12mm = 8mm
  param ball: length in 1mm..5mm = 3mm
  param lean: angle in -30deg..30deg = 20deg
  let post = capped_cylinder(radius: r, height: 30mm).rotate(lean, (1, 0, 0)).translate((0mm, 0mm, -8mm))
  let floor = box(width: 50mm, depth: 50mm, height: 20mm).translate((0mm, 0mm, -20mm))
  part with = floor + {post: post} + {fillet: rolling_fillet(post.wall, post, floor, ball)}
  part without = (floor + {post: post}).translate((80mm, 0mm, 0mm))
  measure fillet = volume(with) - volume(without)
}
";

/// The volume between a leaning cylinder, the plane z = 0 and a ball that touches both, by random places: those outside
/// of both that are farther from the middle line of the ball, an ellipse, than its radius, and between the places where
/// it touches both. The second is the standard deviation.
fn between_ball_and_walls(r: f64, ball: f64, lean: f64) -> (f64, f64) {
    // The axis of the cylinder runs through (0, 0, -8).
    let axis = [0.0, -lean.sin(), lean.cos()];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let from = |p: [f64; 3]| {
        let q = [p[0], p[1], p[2] + 8.0];
        let along = dot(q, axis);
        let off = [q[0] - along * axis[0], q[1] - along * axis[1], q[2] - along * axis[2]];
        let norm = dot(off, off).sqrt();
        (norm - r, off.map(|x| x / norm))
    };
    let middle: Vec<[f64; 3]> = (0..2000)
        .map(|k| {
            let a = f64::from(k) / 2000.0 * 2.0 * PI;
            let out = [a.cos(), a.sin() * lean.cos(), a.sin() * lean.sin()].map(|x| x * (r + ball));
            let along = (ball + 8.0 - out[2]) / axis[2];
            [out[0] + along * axis[0], out[1] + along * axis[1], ball]
        })
        .collect();
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let half = r + 3.0 * ball;
    let center = 8.0 * axis[1] / axis[2];
    let (tries, height) = (300_000, 2.0 * ball);
    let mut hits = 0;
    for _ in 0..tries {
        let [x, y, z] = [(); 3].map(|()| random.random::<f64>());
        let p = [(2.0 * x - 1.0) * half, center + (2.0 * y - 1.0) * 1.2 * half, z * height];
        let (beyond, _) = from(p);
        if beyond < 0.0 || beyond > 2.0 * ball {
            continue;
        }
        let distance = |c: &[f64; 3]| dot([0, 1, 2].map(|k| p[k] - c[k]), [0, 1, 2].map(|k| p[k] - c[k]));
        let nearest = middle.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("places");
        if distance(nearest) < ball * ball {
            continue;
        }
        // Its direction from the ball's center, as a sum of those towards both walls.
        let (d, a, b) = ([0, 1, 2].map(|k| nearest[k] - p[k]), from(*nearest).1, [0.0, 0.0, 1.0]);
        let (x, y, k) = (dot(d, a), dot(d, b), dot(a, b));
        hits += usize::from(x - k * y > 0.0 && y - k * x > 0.0);
    }
    let whole = 2.0 * half * 2.4 * half * height;
    let share = hits as f64 / f64::from(tries);
    (whole * share, whole * (share / f64::from(tries)).sqrt())
}

#[test]
fn a_fillet_of_a_leaning_post_is_what_a_rolling_ball_leaves() {
    let check = checked(LEANING, &[]);
    assert_eq!(check["closed"], true, "{}", check["open_borders"]);
    let (expected, sd) = between_ball_and_walls(8.0, 3.0, 20.0_f64.to_radians());
    let fillet = measure(&check, 0);
    assert!(sd < 0.02 * expected && (fillet - expected).abs() < 4.0 * sd, "{fillet} for {expected} +- {sd}");
}

/// Of an upright post the fillet is a torus, whose section has the area (1 - pi / 4) b^2 and its centroid
/// b (10 - 3 pi) / (12 - 3 pi) from the wall; a rim that is rounded so loses the mirrored section (Pappus).
#[test]
fn fillets_and_roundings_of_an_upright_post_are_parts_of_a_torus() {
    let (r, b) = (8.0, 3.0);
    let (area, middle) = ((1.0 - PI / 4.0) * b * b, b * (10.0 - 3.0 * PI) / (12.0 - 3.0 * PI));
    let check = checked(LEANING, &["lean=0deg".into()]);
    let fillet = measure(&check, 0);
    assert!((fillet / (2.0 * PI * (r + middle) * area) - 1.0).abs() < 2e-3, "{fillet}");

    let script = "model pin {
  param r: length in 5mm..12mm = 8mm
  param ball: length in 1mm..5mm = 3mm
  let rod = capped_cylinder(radius: r, height: 30mm)
  let below = half_space(at: (0mm, 0mm, 20mm))
  part pin = (rod & {end: below}) - {
    round: rolling_fillet(rod.wall, rod, below, ball, within_first: true, within_second: true),
  }
  measure volume_of_pin = volume(pin)
}
";
    let check = checked(script, &[]);
    assert_eq!(check["closed"], true, "{}", check["open_borders"]);
    let lost = PI * r * r * 20.0 - measure(&check, 0);
    assert!((lost / (2.0 * PI * (r - middle) * area) - 1.0).abs() < 2e-3, "{lost}");
}

/// Beside a fillet, and far from it, its function of what is inside says nothing that has to be looked at closely: the
/// mesh has the triangles that its curved surfaces need.
#[test]
fn a_fillet_divides_only_what_it_touches() {
    let folder = tempdir().expect("a folder");
    let script = "model post {
  let plate = box(width: 80mm, depth: 40mm, height: 6mm)
  let post = capped_cylinder(radius: 8mm, height: 30mm).translate((-20mm, 0mm, 0mm))
  part body = plate + {post: post} + {fillet: rolling_fillet(post.wall, post, plate, 3mm)}
}
";
    fs::write(folder.path().join("post.gml"), script).expect("written");
    gmlc(folder.path(), &["mesh", "post.gml", "-o", "post.stl"]);
    must_be_closed(&folder.path().join("post.stl"));
    let triangles = fs::metadata(folder.path().join("post.stl")).expect("it is there").len() / 50;
    // 25,000; the base alone, which is plane and nowhere near the fillet, once had 330,000.
    assert!(triangles < 40_000, "{triangles}");
}

/// Both edges of a hole are rounded: each loses the section at the side of the material.
#[test]
fn the_edges_of_a_hole_are_rounded() {
    let script = "model hole {
  param r: length in 5mm..12mm = 8mm
  param lean: angle = 0deg
  let drill = capped_cylinder(radius: r, height: 60mm).translate((0mm, 0mm, -30mm)).rotate(lean, (1, 0, 0))
  let block = box(width: 50mm, depth: 50mm, height: 20mm).translate((0mm, 0mm, -10mm))
  let edges = [(0.0, 0.5), (0.5, 1.0)]
  part block_with_hole = block - {drill: drill} - {
    edge: rolling_fillet(drill.wall, drill, block, 3mm, within_second: true, between: edges),
  }
  measure material = volume(block_with_hole)
}
";
    let (r, b) = (8.0, 3.0);
    let (area, middle) = ((1.0 - PI / 4.0) * b * b, b * (10.0 - 3.0 * PI) / (12.0 - 3.0 * PI));
    let upright = checked(script, &[]);
    let expected = 50_000.0 - PI * r * r * 20.0 - 2.0 * 2.0 * PI * (r + middle) * area;
    let material = measure(&upright, 0);
    assert!((material - expected).abs() < 0.5, "{material} for {expected}");
    // Without the volume, which takes long.
    let leaning =
        checked(&script.replace("  measure material = volume(block_with_hole)\n", ""), &["lean=15deg".into()]);
    assert_eq!([&upright["closed"], &leaning["closed"]], [true, true], "{}", leaning["open_borders"]);
}

/// Where a branch leans far, balls at the sharp side are farther from the corner than their path is bent; and beside
/// the branch, where both walls are parallel, there is no ball.
#[test]
fn the_fillets_of_slanting_branches_are_closed() {
    let script = "model tee {
  param run: length = 25mm
  param branch: length = 15mm
  param lean: angle = 25deg
  param ball: length = 5mm
  let pipe = capped_cylinder(radius: run, height: 240mm).translate((0mm, 0mm, -120mm)).rotate(90deg, (0, 1, 0))
  let stub = capped_cylinder(radius: branch, height: 140mm).rotate(lean, (0, 1, 0))
  part tee = pipe + {branch: stub} + {fillet: rolling_fillet(stub.wall, stub, pipe, ball)}
}
";
    let shapes = [[25.0, 15.0, 25.0, 5.0], [22.1, 18.7, -39.0, 5.4], [26.3, 6.7, 33.5, 8.0], [36.4, 8.5, -27.5, 8.4]];
    for [run, branch, lean, ball] in shapes {
        let values =
            [format!("run={run}mm"), format!("branch={branch}mm"), format!("lean={lean}deg"), format!("ball={ball}mm")];
        let check = checked(script, &values);
        assert_eq!(check["closed"], true, "{values:?}: {}", check["open_borders"]);
    }
}

#[test]
fn a_fillet_that_is_not_possible_says_why() {
    let folder = tempdir().expect("a folder");
    let floor = "let floor = box(width: 50mm, depth: 50mm, height: 20mm)";
    let cases = [
        ("let post = capped_cylinder(radius: 8mm, height: 9mm).translate((0mm, 0mm, 40mm))", "no ball of this radius"),
        ("let post = capped_cylinder(radius: 8mm, height: 30mm)\n  let other = ball(radius: 1mm)", "no surface of the"),
    ];
    for (post, said) in cases {
        let first = if post.contains("other") { "other" } else { "post" };
        let script =
            format!("model m {{\n  {floor}\n  {post}\n  part f = rolling_fillet(post.wall, {first}, floor, 2mm)\n}}\n");
        fs::write(folder.path().join("m.gml"), script).expect("written");
        let errors = fails(folder.path(), &["check", "m.gml"], 1);
        assert!(errors.contains(said) && errors.contains("in part f.round"), "{errors}");
    }
}

/// A fillet knows a surface as it goes on beyond its borders, and found the edge of another one in the same plane: two
/// posts of one height, and the prongs of a fork.
#[test]
fn surfaces_that_do_not_meet_have_no_fillet() {
    let folder = tempdir().expect("a folder");
    let posts = "box(width: 60mm, depth: 30mm, height: 10mm)
    + {a: box(width: 10mm, depth: 10mm, height: 20mm).translate((-15mm, 0mm, 0mm))}
    + {b: box(width: 10mm, depth: 10mm, height: 20mm).translate((15mm, 0mm, 0mm))}";
    let fork = "extruded([(0mm, 0mm), (30mm, 0mm), (30mm, 20mm), (20mm, 20mm), (20mm, 10mm), (10mm, 10mm),
    (10mm, 20mm), (0mm, 20mm)], 8mm)";
    for (body, call) in [
        (posts, "fillet(a.top, b.right, 2mm)"),
        (fork, "fillet(side[2], side[5], 2mm)"),
        (fork, "chamfer(side[6], side[3], 1mm)"),
    ] {
        let script =
            format!("use std.solid (box, extruded)\nmodel m {{\n  let body = {body}\n  part p = body.{call}\n}}\n");
        fs::write(folder.path().join("m.gml"), script).expect("written");
        let errors = fails(folder.path(), &["check", "m.gml"], 1);
        assert!(errors.contains("do not meet"), "{call}: {errors}");
    }
    let script = format!(
        "use std.solid (box)\nmodel m {{\n  let body = {posts}\n  part p = body.fillet(b.top, b.right, 2mm)\n}}\n"
    );
    assert_eq!(checked(&script, &[])["closed"], true);
}

/// The points of a part and their normals at some places.
fn points(program: &Program, part: &str, places: &[(f64, f64)]) -> Vec<([f64; 3], [f64; 3])> {
    let x: Vec<f64> = program.parameters().iter().map(|p| p.default).collect();
    let instance = program.instantiate(&x).expect("an instance");
    let index = program.parts().iter().position(|p| p.name == part).expect("the part");
    let (u, v): (Vec<f64>, Vec<f64>) = places.iter().copied().unzip();
    let mut partials = vec![0.0; 9 * u.len()];
    instance.evaluate(index, Sites::Scattered(&u, &v), Order::Partials, &mut partials).expect("points");
    let of_place = |p: &[f64]| {
        let (a, b) = (&p[3..6], &p[6..9]);
        let n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let norm = n.iter().map(|x| x * x).sum::<f64>().sqrt();
        ([p[0], p[1], p[2]], n.map(|x| x / norm))
    };
    partials.chunks_exact(9).map(of_place).collect()
}

/// The fillets at the roots of a handle touch the wall and the handle: there they have their points and normals.
#[test]
fn the_roots_of_a_handle_touch_it_and_the_wall() {
    let script = "model handle {
  param bend: length in 10mm..30mm = 20mm
  let arch = tube(arc((0mm, 2mm), bend, -30deg, 200deg), radii: (3mm, 5mm))
  part handle = rooted(arch, half_space(size: 90mm), 2mm)
}
";
    let source = SourceFile { name: "handle.gml".into(), text: script.into() };
    let program = compile(source, &NoFiles, &Options::default()).expect("it compiles").program;
    let around: Vec<f64> = (0..40).map(|k| f64::from(k) / 40.0).collect();
    for root in ["handle.root[0]", "handle.root[1]"] {
        for side in [0.0, 1.0] {
            let places: Vec<(f64, f64)> = around.iter().map(|u| (*u, side)).collect();
            let found = points(&program, root, &places);
            let on_floor = found.iter().filter(|(p, n)| p[2].abs() < 1e-9 && (n[2] - 1.0).abs() < 1e-6).count();
            assert!(on_floor == 0 || on_floor == found.len(), "{root}: {on_floor} places touch the floor");
            if on_floor > 0 {
                continue;
            }
            // On the handle: some 3 mm to 5 mm from its middle line, at right angles to it.
            for (p, n) in &found {
                let (x, z) = (p[0], p[2] - 2.0);
                let radius = x.hypot(z);
                let (out, beside) = (radius - 20.0, p[1]);
                assert!(((out / 3.0).powi(2) + (beside / 5.0).powi(2) - 1.0).abs() < 1e-9, "{root}: {p:?}");
                let across = [x / radius, 0.0, z / radius];
                let normal = [out / 9.0 * across[0], beside / 25.0, out / 9.0 * across[2]];
                let norm = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
                let along: f64 = normal.iter().zip(n).map(|(a, b)| a * b / norm).sum();
                assert!(along > 1.0 - 1e-6, "{root}: {n:?} for {normal:?}");
            }
        }
    }
}

#[test]
fn hollow_solids_and_those_of_smooth_profiles_have_their_volumes() {
    let script = "model shells {
  param t: length in 0.5mm..3mm = 2mm
  part can = shell(capped_cylinder(radius: 20mm, height: 30mm), t) & {
    rim: half_space(at: (0mm, 0mm, 25mm), size: 100mm),
  }
  part bucket = shell(frustum(bottom: 10mm, top: 20mm, height: 30mm), t).translate((50mm, 0mm, 0mm))
  part vase = revolved_curve(|s| (20mm + 5mm * sin(s * 1turn), 60mm * s)).translate((100mm, 0mm, 0mm))
  part cam = extruded_curve(|s| (20mm * cos(s * 1turn), 12mm * sin(s * 1turn) + t * cos(s * 2turn)), 9mm)
    .translate((150mm, 0mm, 0mm))
  measure of_can = volume(can)
  measure of_bucket = volume(bucket)
  measure of_vase = volume(vase)
  measure of_cam = volume(cam)
}
";
    let check = checked(script, &[]);
    assert_eq!(check["closed"], true, "{}", check["open_borders"]);
    // The hollow of the bucket: its slant is moved inwards by t / cos, so much less is its radius at any height.
    let (slope, t) = (1.0 / 3.0, 2.0);
    let radius = |z: f64| 10.0 + slope * z - t * f64::hypot(1.0, slope);
    let frustum = |a: f64, b: f64, h: f64| PI * h / 3.0 * (a * a + a * b + b * b);
    // Of sin and cos over whole turns: pi h (r^2 + a^2 / 2), and pi a b h.
    let expected = [
        ("of_can", PI * (400.0 * 25.0 - 324.0 * 23.0)),
        ("of_bucket", frustum(10.0, 20.0, 30.0) - frustum(radius(2.0), radius(28.0), 26.0)),
        ("of_vase", PI * 60.0 * (400.0 + 12.5)),
        ("of_cam", PI * 20.0 * 12.0 * 9.0),
    ];
    for (k, (name, expected)) in expected.into_iter().enumerate() {
        let value = measure(&check, k);
        assert!((value / expected - 1.0).abs() < 1e-5, "{name}: {value} for {expected}");
    }
}
