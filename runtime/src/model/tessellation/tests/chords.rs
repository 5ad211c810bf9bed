//! Chords are kept, with few triangles.

use super::adversary::{adversary, to_triangle};
use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Surfaces with corners, curvature of all kinds, and singular places.
const SURFACES: [&str; 14] = [
    "part p = cylinder(20mm, 50mm)",
    "part p = sphere(20mm)",
    "part p = torus(30mm, 8mm)",
    "part p = disc(20mm)",
    "part p = revolve(polyline([(0mm, 0mm), (20mm, 0mm), (20mm, 10mm), (12mm, 10mm), (12mm, 25mm), (0mm, 25mm)]))",
    "part p = |u: real, v: real| (u * 100mm, v * 50mm, abs(sin(u * 10turn)) * 5mm)",
    "part p = |u: real, v: real| (u * 100mm, v * 50mm, abs(u - v * v) * 20mm)",
    "part p = |u: real, v: real| (u * 40mm, v * 40mm, max(u * v, 0.3) * 20mm)",
    "part p = |u: real, v: real| (u * 40mm, v * 40mm, u * v * 30mm)",
    "part p = |u: real, v: real| (u * 40mm, v * 40mm, sqrt(u * (1 - u) + 1e-9) * 20mm)",
    "part p = sweep(|t| polar(20mm + 5mm * cos(3turn * t), 2turn * t, 8mm * sin(3turn * t)), rectangle(4mm, 2mm), closed: true)",
    "part p = coil(10mm, 5mm, 3, 1mm)",
    "part p = loft([|t| polar(20mm, t * 1turn, 0mm), |t| polar(35mm, t * 1turn, 30mm), |t| polar(15mm, t * 1turn, 60mm)])",
    "part p = |u: real, v: real| (u ^ 4 * 100mm, v * 50mm, sin(u ^ 4 * 1turn) * 10mm)",
];

/// The chords that are tried. Millimetres.
const CHORDS: [f64; 4] = [1.0, 0.1, 0.02, 0.001];

/// What an adversary finds may exceed what was measured by this much: it looks everywhere.
const MARGIN: f64 = 1.02;

#[test]
fn chords_are_kept() {
    let broken: Vec<String> =
        SURFACES.into_par_iter().flat_map_iter(|body| broken_chords(body, &program(body), 150, &CHORDS)).collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// Functions of the library that make surfaces, besides those in the other lists.
const LIBRARY: [&str; 51] = [
    "part p = revolve(line((20mm, 0mm), (12mm, 40mm)), from: 20deg, to: 250deg)",
    "part p = trim(flip(cylinder(20mm, 50mm)), u: (0.1, 0.7), v: (0.2, 0.9))",
    "part p = tube(natural_spline([(0mm, 0mm, 0mm), (30mm, 10mm, 0mm), (40mm, 30mm, 20mm)]), radius: |v| 3mm + 2mm * v)",
    "part p = annulus(10mm, 20mm)",
    "part p = cone(20mm, 10mm, 30mm)",
    "part p = cone(20mm, 0mm, 30mm)",
    "part p = sphere_zone(20mm, 10deg, 60deg, around: (20deg, 300deg))",
    "part p = ellipsoid(30mm, 20mm, 10mm)",
    "part p = paraboloid(20mm, 30mm)",
    "part p = helicoid(5mm, 20mm, 10mm, 3)",
    "part p = superellipsoid(20mm, 20mm, 20mm, 8, 1)",
    "part p = superellipsoid(20mm, 20mm, 20mm, 3, 2.5)",
    "part p = supertoroid(20mm, 5mm, 5mm, 1, 6)",
    "part p = bilinear((0mm, 0mm, 0mm), (40mm, 0mm, 0mm), (0mm, 40mm, 0mm), (40mm, 40mm, 40mm))",
    "part p = coons(|t| (40mm * t, 0mm, 32mm * t * (1 - t)), |t| (40mm * t, 40mm, 16mm * t * (1 - t)), line((0mm, 0mm, 0mm), (0mm, 40mm, 0mm)), line((40mm, 0mm, 0mm), (40mm, 40mm, 0mm)))",
    "part p = bezier_patch([[(0mm, 0mm, 0mm), (20mm, 0mm, 10mm), (40mm, 0mm, 0mm)], [(0mm, 20mm, 10mm), (20mm, 20mm, 20mm), (40mm, 20mm, -10mm)], [(0mm, 40mm, 0mm), (20mm, 40mm, 5mm), (40mm, 40mm, 0mm)]])",
    "part p = bspline_patch(for j in 0..6 { for i in 0..6 { (i * 8mm, j * 8mm, 6mm * sin(i * 90deg) * cos(j * 70deg)) } })",
    "part p = bspline_patch(for j in 0..6 { for i in 0..6 { (i * 8mm, j * 8mm, 6mm * sin(i * 90deg) * cos(j * 70deg)) } }, degree: 1)",
    "part p = through_grid(for j in 0..6 { for i in 0..6 { (i * 8mm, j * 8mm, 6mm * sin(i * 90deg) * cos(j * 70deg)) } })",
    "part p = extrude(rectangle(40mm, 20mm, radius: 3mm), 15mm, twist: 40deg, taper: 0.7)",
    "part p = fill(superellipse(20mm, 10mm, 3))",
    "part p = prism(superellipse(20mm, 10mm, 5), 10mm)",
    "part p = ruled(spatial(circle(20mm)), |t| polar(30mm, t * 1turn + 20deg, 40mm))",
    "part p = loft([spatial(circle(20mm)), |t| polar(10mm, t * 1turn, 20mm), |t| polar(25mm, t * 1turn, 50mm)])",
    "part p = sweep(helix(20mm, 10mm, 3, top: 10mm), circle(3mm))",
    "part p = bar(helix(20mm, 10mm, 2), rectangle(6mm, 3mm))",
    "part p = sweep(spiral(10mm, 40mm, 3), circle(2mm))",
    "part p = extrude(bspline([(0mm, 0mm), (20mm, 0mm), (20mm, 20mm), (5mm, 25mm), (0mm, 10mm)], closed: true), 20mm)",
    "part p = extrude(bspline_knots([(0mm, 0mm), (20mm, 0mm), (20mm, 20mm), (0mm, 20mm), (0mm, 40mm)], [0, 0, 0, 0.5, 0.5, 1, 1, 1]), 20mm)",
    "part p = revolve(rational_bezier([(0mm, -20mm), (20mm, -20mm), (20mm, 0mm)], [1, sqrt(0.5), 1]))",
    "part p = extrude(catmull_rom([(0mm, 0mm), (20mm, 0mm), (20mm, 20mm), (5mm, 25mm)], closed: true), 20mm)",
    "part p = extrude(centripetal([(0mm, 0mm), (20mm, 0mm), (20mm, 2mm), (5mm, 25mm)], closed: true), 20mm)",
    "part p = extrude(hermite((0mm, 0mm), (80mm, 0mm), (20mm, 20mm), (0mm, 90mm)), 20mm)",
    "part p = thicken(sphere_zone(20mm, 10deg, 60deg), 2mm)",
    "part p = offset(revolve(bezier([(10mm, 0mm), (25mm, 10mm), (5mm, 30mm), (15mm, 40mm)])), 2mm)",
    "part p = offset(torus(30mm, 8mm), -3mm)",
    "part p = polar_pattern(box().translate((40mm, 0mm, 0mm)), 5)",
    "part p = mirror_pattern(capsule().translate((20mm, 0mm, 0mm)))",
    "part p = revolve(join([line((0mm, 0mm), (10mm, 0mm)), arc((10mm, 5mm), 5mm, -90deg, 90deg), line((10mm, 10mm), (0mm, 10mm))]))",
    "part p = revolve(arc_through((10mm, 0mm), (20mm, 10mm), (10mm, 25mm)))",
    "part p = extrude(segment(ellipse(30mm, 10mm), 0.1, 0.8), 10mm)",
    "part p = coil(10mm, 5mm, 3, 1mm)",
    "part p = prism(polyline([(-5mm, -5mm), (35mm, -5mm), (35mm, 5mm), (5mm, 5mm), (5mm, 25mm), (-5mm, 25mm), (-5mm, -5mm)]), 10mm)",
    "part p = box()",
    "part p = rounded_box()",
    "part p = capped_cylinder()",
    "part p = frustum()",
    "part p = pipe()",
    "part p = elbow()",
    "part p = capsule()",
    "part p = hollow_sphere()",
];

#[test]
fn chords_of_the_library_are_kept() {
    let broken: Vec<String> =
        LIBRARY.into_par_iter().flat_map_iter(|body| broken_chords(body, &program(body), 20, &CHORDS[..3])).collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// The examples with the default values of their parameters.
#[test]
fn chords_of_the_examples_are_kept() {
    let examples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let folders = std::fs::read_dir(&examples).expect("the folder exists").flatten().map(|entry| entry.path());
    let scripts = folders.map(|folder| folder.join(folder.file_name().unwrap_or_default()).with_extension("gml"));
    let scripts: Vec<_> = scripts.filter(|path| path.exists()).collect();
    assert!(scripts.len() >= 10, "{scripts:?}");
    let one = |path: std::path::PathBuf| {
        let text = std::fs::read_to_string(&path).expect("it is readable");
        let name = path.display().to_string();
        let compiled = compile(SourceFile { name: name.clone(), text }, &NoFiles, &Options::default());
        broken_chords(&name, &compiled.unwrap_or_else(|e| panic!("{e}")).program, 60, &CHORDS[..3])
    };
    let broken: Vec<String> = scripts.into_par_iter().flat_map_iter(one).collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// The chords that a model does not keep, by its own measure or the adversary's.
fn broken_chords(name: &str, program: &Program, triangles: usize, chords: &[f64]) -> Vec<String> {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let instance = instance(program);
    let mut one = |chord: f64| {
        let tessellation = tessellate(program, chord);
        let found = adversary(&*instance, &tessellation).farthest(&mut random, triangles);
        let kept = tessellation.chord <= chord && found <= MARGIN * chord;
        (!kept).then(|| format!("{name} at {chord}: {} {found}", tessellation.chord))
    };
    chords.iter().filter_map(|chord| one(*chord)).collect()
}

/// What regular places of measuring miss: periods that fall in with them, narrow things, grids of nothing but poles and
/// seams, jumps across both parameters.
const HIDDEN: [&str; 14] = [
    "part p = |u: real, v: real| (200mm * u, 200mm * v, 5mm * sin(48turn * u))",
    "part p = |u: real, v: real| (200mm * u, 200mm * v, 5mm * sin(16turn * u))",
    "part p = revolve(|t| (20mm + 2mm * sin(48turn * t), 100mm * t))",
    "part p = |u: real, v: real| (200mm * u, 200mm * v,
       5mm * max(0, 1 - sqrt((u - 0.43217) ^ 2 + (v - 0.6123) ^ 2) / 0.02))",
    "part p = |u: real, v: real| (200mm * u, 200mm * v, 5mm * exp(-(((u - 0.43) / 0.005) ^ 2)))",
    "part p = |u: real, v: real| {
       let d = polar(sin(v * 180deg), u * 1turn, -cos(v * 180deg))
       d * (6mm / max(abs(d.x), abs(d.y), abs(d.z)))
     }",
    "part p = |u: real, v: real| {
       let q = 10mm + 0.5mm * abs(((4 * v - u) % 1) * 2 - 1)
       (q * cos(u * 1turn), q * sin(u * 1turn), 8mm * v)
     }",
    // Beads on a rod of 1 m.
    "part p = revolve(|t| (10mm + 2mm * exp(-(((1000 * t - 123.4) / 0.5) ^ 2)), 1m * t))",
    "part p = revolve(|t| (10mm + 2mm * exp(-(((1000 * t - 123.4) / 5) ^ 2)), 1m * t))",
    "part p = |u: real, v: real| (1m * u, 30mm * v, 2mm * exp(-((1000 * u - 123.4) ^ 2 + (30 * v - 11) ^ 2)))",
    // Creases that end on lines of u and v, and beside vertices.
    "part p = |u: real, v: real| (40mm * u, 10mm * v, 1.5mm * max(abs(sin(1turn * (v - 0.6))), abs(sin(1turn * (u - 0.2)))))",
    "part p = |u: real, v: real| (40mm * u, 10mm * v, 7.5mm * max(abs((v - 0.6) ^ 2 - 0.04), abs(u - 0.2)))",
    // A thread of 24 turns: many creases between any two lines of v.
    "part p = |u: real, v: real| {
       let q = 10mm + 0.5mm * abs(((24 * v - u) % 1) * 2 - 1)
       (q * cos(u * 1turn), q * sin(u * 1turn), 48mm * v)
     }",
    "part p = |u: real, v: real| (20mm * u, 20mm * v, 3mm * floor(2 * (u + v)))",
];

#[test]
fn nothing_is_hidden() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for body in HIDDEN {
        let program = program(body);
        let instance = instance(&program);
        let tessellation = tessellate(&program, 0.1);
        assert!(tessellation.mesh.triangles.len() > 8, "{body}");
        let jumps = body.contains("floor");
        assert_eq!(tessellation.chord > 0.1, jumps, "{body}: {}", tessellation.chord);
        if body.contains("polar(") {
            assert_eq!(open_edges(&tessellation.mesh), 0, "{body}");
            let found = from_cube(&tessellation.mesh, 6.0);
            assert!(found <= MARGIN * 0.1, "{body}: {found}");
        } else if !jumps {
            let found = adversary(&*instance, &tessellation).farthest(&mut random, 150);
            assert!(found <= 1.1 * 0.1, "{body}: {found}, {} triangles", tessellation.mesh.triangles.len());
        }
    }
}

/// The largest distance between a mesh and a cube around the origin: of places of the triangles from the cube, and of
/// places of the cube, its edges and corners too, from the triangles.
fn from_cube(mesh: &TriangleMesh, half: f64) -> f64 {
    const STEPS: i32 = 16;
    let to_cube = |p: DVec3| {
        let beyond = p.abs() - half;
        let outside = beyond.max(DVec3::ZERO).length();
        if outside > 0.0 { outside } else { -beyond.max_element() }
    };
    let lattice = || (0..=8).flat_map(|i| (0..=8 - i).map(move |j| [i, j, 8 - i - j].map(|k| f64::from(k) / 8.0)));
    let of_triangle = |t: &[u32; 3]| {
        let corners = mesh.corners(*t);
        lattice().map(|w| to_cube((0..3).map(|k| w[k] * corners[k]).sum())).fold(0.0, f64::max)
    };
    let to_mesh = |p: DVec3| {
        let distances = mesh.triangles.iter().map(|t| to_triangle(p, mesh.corners(*t)));
        distances.fold(f64::INFINITY, f64::min)
    };
    let steps = |k: i32| half * f64::from(2 * k - STEPS) / f64::from(STEPS);
    let face = (0..=STEPS).flat_map(|i| (0..=STEPS).map(move |j| (steps(i), steps(j))));
    let faces = face.flat_map(|(s, t)| {
        let sides = [half, -half].map(|h| [DVec3::new(h, s, t), DVec3::new(s, h, t), DVec3::new(s, t, h)]);
        sides.into_iter().flatten()
    });
    faces.map(to_mesh).fold(mesh.triangles.iter().map(of_triangle).fold(0.0, f64::max), f64::max)
}

/// A surface over a rectangle whose height has waves, creases along u, along v and across both, and curvature.
fn random_surface(random: &mut ChaCha8Rng) -> String {
    let mut term = || {
        let mut number = |low: f64, high: f64| random.random_range(low..high);
        let (a, b, c) = (number(-1.0, 1.0), number(-3.0, 3.0), number(0.1, 0.9));
        match number(0.0, 9.0) as u32 {
            0 => format!("{a} * sin(({b}) * u * 1turn)"),
            1 => format!("{a} * cos(({b}) * (u + v) * 1turn)"),
            2 => format!("{a} * abs(u - {c})"),
            3 => format!("{a} * max(v, {c})"),
            4 => format!("{a} * min(u + ({b}) * v, {c})"),
            5 => format!("{a} * u * v"),
            6 => format!("(if v < {c} {{ {a} * (v - {c}) }} else {{ ({b}) * (v - {c}) ^ 2 }})"),
            7 => format!("{a} * abs(u * u + ({b}) * v - {c})"),
            _ => format!("{a} * abs(sin(({b}) * u * 1turn))"),
        }
    };
    let height = format!("({} + {} + {})", term(), term(), term());
    format!("part p = |u: real, v: real| (u * 60mm + v * 5mm, v * 40mm, {height} * 8mm)")
}

#[test]
fn chords_of_random_surfaces_are_kept() {
    let one = |seed: u64| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let body = random_surface(&mut random);
        let chord = if seed.is_multiple_of(25) { 0.001 } else { [1.0, 0.1, 0.02][seed as usize % 3] };
        let program = program(&body);
        let instance = instance(&program);
        let tessellation = tessellate(&program, chord);
        let found = adversary(&*instance, &tessellation).farthest(&mut random, 60);
        let kept = tessellation.chord <= chord && found <= MARGIN * chord;
        (!kept).then(|| format!("{seed}: {body} at {chord}: {} {found}", tessellation.chord))
    };
    let broken: Vec<String> = (0..500u64).into_par_iter().filter_map(one).collect();
    assert!(broken.is_empty(), "{} of 500:\n{}", broken.len(), broken.join("\n"));
}

/// A height with creases on creases, most of which cross each other.
fn random_creases(random: &mut ChaCha8Rng, depth: u32) -> String {
    let mut number = |low: f64, high: f64| (random.random_range(low..high) * 1000.0).round() / 1000.0;
    let line = format!("(({}) * u + ({}) * v + ({}))", number(-1.5, 1.5), number(-1.5, 1.5), number(-1.5, 1.5));
    let (many, few) = (number(1.0, 9.0).floor(), number(2.0, 4.0).floor());
    if depth == 0 {
        return match number(0.0, 4.0) as u32 {
            0 => format!("sin({many}turn * {line}) / 2"),
            1 => format!("abs({line})"),
            2 => format!("abs(sin({few}turn * {line}))"),
            _ => line,
        };
    }
    let kind = number(0.0, 6.0) as u32;
    let inner = random_creases(random, depth - 1);
    match kind {
        0 => format!("min({inner}, {})", random_creases(random, depth - 1)),
        1 => format!("max({inner}, {})", random_creases(random, depth - 1)),
        2 => format!("abs({inner})"),
        3 => format!("abs(({few} * ({inner})) % 1 - 0.5)"),
        4 => format!("tanh({inner})"),
        _ => format!("({inner} + {}) / 2", random_creases(random, depth - 1)),
    }
}

/// Where many creases meet, triangles become narrow, but none has corners that coincide, and none is there twice:
/// beside a border of other patches neither.
#[test]
fn dense_creases_leave_no_empty_triangles() {
    let one = |seed: u64| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let height = random_creases(&mut random, 3);
        let at = |u: &str, v: &str| format!("h({u}, {v})");
        let body = format!(
            "fn h(u: real, v: real) = 8mm + 5mm * tanh({height})
             part top = |u: real, v: real| (u * 40mm, v * 30mm, {})
             part back = ruled(|t: real| (40mm * (0.63 - 0.54 * t), 30mm, 0mm),
               |t: real| (40mm * (0.63 - 0.54 * t), 30mm, {}))
             part left = ruled(|t: real| (0mm, 30mm * (1 - 0.4 * t), 0mm),
               |t: real| (0mm, 30mm * (1 - 0.4 * t), {}))",
            at("u", "v"),
            at("0.63 - 0.54 * t", "1.0"),
            at("0.0", "1 - 0.4 * t"),
        );
        let mesh = tessellate(&program(&body), [0.3, 0.1, 0.03][seed as usize % 3]).mesh;
        let number = mesh.position_numbers();
        let mut triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|i| number[i as usize])).collect();
        triangles.iter_mut().for_each(|t| t.sort_unstable());
        triangles.sort_unstable();
        let empty = triangles.iter().filter(|t| t[0] == t[1] || t[1] == t[2]).count();
        let twice = triangles.windows(2).filter(|w| w[0] == w[1]).count();
        (empty + twice > 0).then(|| format!("{seed}: {empty} empty, {twice} twice: {body}"))
    };
    let broken: Vec<String> = (0..60u64).into_par_iter().filter_map(one).collect();
    assert!(broken.is_empty(), "{} of 60:\n{}", broken.len(), broken.join("\n"));
}

/// The fewest triangles of a grid of even steps that keeps to the chord at the places of a lattice in every triangle.
fn fewest_even(program: &Program, chord: f64) -> usize {
    let instance = instance(program);
    let error = |nu: u32, nv: u32| {
        let grid = Tessellation::uniform(program, &*instance, nu, nv).expect("it can be evaluated");
        // Too few steps around, and nothing is left.
        let mut largest = if grid.mesh.triangles.is_empty() { f64::INFINITY } else { 0.0 };
        for t in &grid.mesh.triangles {
            let origins = t.map(|i| grid.origins[i as usize]);
            let lattice = (0..=4).flat_map(|i| (0..=4 - i).map(move |j| [i, j, 4 - i - j].map(|k| f64::from(k) / 4.0)));
            let mix =
                |w: [f64; 3], of: fn(&SurfacePoint) -> f64| origins.iter().zip(w).map(|(o, w)| w * of(o)).sum::<f64>();
            let (u, v): (Vec<f64>, Vec<f64>) = lattice.map(|w| (mix(w, |o| o.u), mix(w, |o| o.v))).unzip();
            let mut points = vec![[0.0; 3]; u.len()];
            instance.points(0, &u, &v, &mut points).expect("it can be evaluated");
            let distance = |p: &[f64; 3]| to_triangle(DVec3::from_array(*p), grid.mesh.corners(*t));
            largest = largest.max(points.iter().map(distance).fold(0.0, f64::max));
        }
        (largest, grid.mesh.triangles.len())
    };
    let mut fewest = usize::MAX;
    let mut nu = 1;
    while nu < 400 {
        // The least number of rows that keeps to the chord, if any does.
        let (mut low, mut high) = (0, 400);
        while high - low > 1 {
            let middle = (low + high) / 2;
            let (low_end, high_end) = (&mut low, &mut high);
            *if error(nu, middle).0 <= chord { high_end } else { low_end } = middle;
        }
        if high < 400 {
            fewest = fewest.min(error(nu, high).1);
        }
        nu = (nu * 5 / 4).max(nu + 1);
    }
    fewest
}

#[test]
fn triangles_are_few() {
    let smooth = [0, 1, 2, 3, 8, 11, 12];
    let counts: Vec<(usize, usize, usize)> = smooth
        .into_par_iter()
        .map(|i| {
            let program = program(SURFACES[i]);
            let chord = if i == 11 { 0.5 } else { 0.3 };
            (i, tessellate(&program, chord).mesh.triangles.len(), fewest_even(&program, chord))
        })
        .collect();
    for (i, found, even) in counts {
        assert!(found as f64 <= 1.5 * even as f64, "{}: {found}, an even grid {even}", SURFACES[i]);
    }
}

/// What is narrow along one parameter takes no more lines of the other one, or elsewhere.
#[test]
fn beads_take_few_triangles() {
    for (body, most) in [
        ("part p = revolve(|v| (5mm + max(0.0, 1 - ((v - 0.7123) * 2000) ^ 2) * 1mm, 2m * v))", 3_000),
        ("part p = revolve(|v| (15mm + max(0.0, 1 - ((v - 0.6123) * 50) ^ 2) * 3mm, 100mm * v))", 10_000),
        (
            "part p = revolve(|v|
               (15mm + (if abs(v - 0.6) < 0.03 { sqrt(9 - ((v - 0.6) * 100) ^ 2) * 1mm } else { 0mm }), 100mm * v))",
            40_000,
        ),
        ("part p = revolve(|t| (10mm + 2mm * exp(-(((1000 * t - 123.4) / 0.5) ^ 2)), 1m * t))", 10_000),
    ] {
        let tessellation = tessellate(&program(body), 0.02);
        assert!(tessellation.chord <= 0.02, "{body}: {}", tessellation.chord);
        assert!(tessellation.mesh.triangles.len() <= most, "{body}: {}", tessellation.mesh.triangles.len());
    }
}

/// A coarse chord takes no more triangles than a fine one, and no crumpled ones, where many creases cross the grid: 60
/// slanted teeth, 2 mm high, whose lids force the points of the wall's borders. Its area is 3905.0 square millimetres
/// (integrated numerically); a wall that cuts the teeth has less.
#[test]
fn dense_creases_are_not_crumpled() {
    let gear = program(
        "fn tooth(q: real, s: real) =
           polar(20mm + 2mm * clamp(4 * abs((q * 60 + s) % 1 - 0.5) - 0.8, 0, 1), q * 360deg, 0mm)
         part wall = |u: real, v: real| tooth(u, 4 * v) + (0mm, 0mm, 10mm * v)
         part top = fill(|q: real| tooth(q, 4)).translate((0mm, 0mm, 10mm))
         part foot = flip(fill(|q: real| tooth(q, 0)))",
    );
    let fine = tessellate(&gear, 0.02).mesh.triangles.len();
    for chord in [2.0, 1.0, 0.5, 0.1] {
        let Tessellation { mesh, .. } = tessellate(&gear, chord);
        let wall = &mesh.triangles[mesh.groups[0].start..mesh.groups[0].end];
        let area: f64 = wall.iter().map(|t| mesh.triangle_area(*t)).sum();
        assert!(mesh.triangles.len() <= fine && area <= 1.01 * 3905.0, "{chord}: {} {area}", mesh.triangles.len());
        let inwards = |t: &&[u32; 3]| {
            let [a, b, c] = mesh.corners(**t);
            (b - a).cross(c - a).dot((a + b + c) * DVec3::new(1.0, 1.0, 0.0)) < -1e-9
        };
        assert_eq!(wall.iter().filter(inwards).count(), 0, "{chord}");
        assert_eq!(open_edges(&mesh), 0, "{chord}");
    }
}

/// The area of a hyperbolic paraboloid, whose lines are straight both ways: cells over its whole width keep any chord,
/// and their area stays too large (Schwarz's lantern; 4 % of a square loft that turns by 30 degrees).
#[test]
fn areas_of_twisted_surfaces_become_theirs() {
    let program = program("part p = |u: real, v: real| (u * 20mm, v * 20mm, u * v * 30mm)");
    // The mean of |n| over the square, by the midpoint rule: its error is below 1e-5.
    let steps = 400;
    let at = |i: i32| (f64::from(i) + 0.5) / f64::from(steps);
    let density = |(u, v): (f64, f64)| DVec3::new(-600.0 * v, -600.0 * u, 400.0).length();
    let sum: f64 = (0..steps).flat_map(|i| (0..steps).map(move |j| density((at(i), at(j))))).sum();
    let exact = sum / f64::from(steps * steps);
    for (chord, most) in [(0.1, 4e-3), (0.02, 1e-3), (0.004, 3e-4)] {
        let area = tessellate(&program, chord).mesh.area();
        assert!((area / exact - 1.0).abs() < most, "{area} for {exact} with a chord of {chord}");
    }
}
