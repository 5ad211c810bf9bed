//! Tests of tessellations: what the triangles leave of the surface is searched for by other means than those by which
//! they were made.

use super::*;
use crate::bvh::Bvh;
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::HashMap;
use std::f64::consts::PI;

fn program(body: &str) -> Program {
    let text = format!("model m {{ {body} }}");
    let script = SourceFile { name: "m.gml".to_owned(), text: text.clone() };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}\n{text}")).program
}

fn instance(program: &Program) -> Box<dyn Instance + '_> {
    let defaults: Vec<f64> = program.parameters().iter().map(|p| p.default).collect();
    Model::instantiate(program, &defaults).expect("it exists")
}

fn tessellate(program: &Program, chord: f64) -> Tessellation {
    let fineness = Fineness { chord, ..Fineness::default() };
    Tessellation::new(program, &*instance(program), fineness).expect("it can be evaluated")
}

/// Directed edges between positions that no triangle has the other way around.
fn open_edges(mesh: &TriangleMesh) -> usize {
    let number = mesh.position_numbers();
    let mut count: HashMap<(u32, u32), i32> = HashMap::new();
    for t in &mesh.triangles {
        for k in 0..3 {
            let (a, b) = (number[t[k] as usize], number[t[(k + 1) % 3] as usize]);
            *count.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    count.values().filter(|n| **n != 0).count()
}

fn volume(mesh: &TriangleMesh) -> f64 {
    let tetrahedron = |t: &[u32; 3]| {
        let [a, b, c] = mesh.corners(*t);
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(tetrahedron).sum()
}

fn area(mesh: &TriangleMesh) -> f64 {
    mesh.triangles.iter().map(|t| mesh.triangle_area(*t)).sum()
}

/// The largest distance between triangles and surface that a search finds, both ways: from random places of triangles
/// uphill, to the nearest point of the other.
struct Adversary<'a> {
    instance: &'a dyn Instance,
    tessellation: &'a Tessellation,
    bvh: Bvh,
    /// Numbers of the vertices' positions, and the triangles around each of these.
    number: Vec<u32>,
    around: Vec<Vec<usize>>,
}

impl Adversary<'_> {
    fn farthest(&self, random: &mut ChaCha8Rng, triangles: usize) -> f64 {
        let count = self.tessellation.mesh.triangles.len();
        let chosen: Vec<usize> = if count <= triangles {
            (0..count).collect()
        } else {
            (0..triangles).map(|_| random.random_range(0..count)).collect()
        };
        let mut farthest = 0.0_f64;
        for triangle in chosen {
            for _ in 0..2 {
                let (s, t): (f64, f64) = (random.random(), random.random());
                let start = if s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] };
                farthest = farthest.max(climb(start, |w| self.surface_to_triangles(triangle, w)));
                farthest = farthest.max(climb(start, |w| self.triangle_to_surface(triangle, w)));
            }
        }
        farthest
    }

    fn uv(&self, triangle: usize, w: [f64; 3]) -> (usize, f64, f64) {
        let origins = self.tessellation.mesh.triangles[triangle].map(|i| self.tessellation.origins[i as usize]);
        let mix = |of: fn(&SurfacePoint) -> f64| origins.iter().zip(w).map(|(o, w)| w * of(o)).sum::<f64>();
        (origins[0].patch as usize, mix(|o| o.u), mix(|o| o.v))
    }

    /// From the surface's point that belongs to a place of a triangle to the nearest of all triangles.
    fn surface_to_triangles(&self, triangle: usize, w: [f64; 3]) -> f64 {
        let (patch, u, v) = self.uv(triangle, w);
        let mut point = [[0.0; 3]];
        self.instance.points(patch, &[u], &[v], &mut point).expect("it can be evaluated");
        let point = DVec3::from_array(point[0]);
        // The tree searches in single precision, which is poor beside slivers.
        let near = self.bvh.closest_point(point, f64::INFINITY).map_or(triangle, |c| c.triangle as usize);
        let mesh = &self.tessellation.mesh;
        let vertices = [near, triangle].into_iter().flat_map(|t| mesh.triangles[t]);
        let beside = vertices.flat_map(|i| &self.around[self.number[i as usize] as usize]);
        beside.map(|t| to_triangle(point, mesh.corners(mesh.triangles[*t]))).fold(f64::INFINITY, f64::min)
    }

    /// From a place of a triangle to the nearest point of the surface within the triangle's range of u and v.
    fn triangle_to_surface(&self, triangle: usize, w: [f64; 3]) -> f64 {
        let (patch, u, v) = self.uv(triangle, w);
        let corners = self.tessellation.mesh.corners(self.tessellation.mesh.triangles[triangle]);
        let origins = self.tessellation.mesh.triangles[triangle].map(|i| self.tessellation.origins[i as usize]);
        let clamp = |t: f64, of: fn(&SurfacePoint) -> f64| {
            let all = origins.each_ref().map(of);
            t.clamp(all.into_iter().fold(1.0, f64::min), all.into_iter().fold(0.0, f64::max))
        };
        let p: DVec3 = corners.iter().zip(w).map(|(c, w)| *c * w).sum();
        let evaluate = |u: f64, v: f64| {
            let mut partials = [Partials::default()];
            self.instance.partials(patch, &[u], &[v], &mut partials).ok()?;
            Some([partials[0].point, partials[0].du, partials[0].dv].map(DVec3::from_array))
        };
        // Gauss and Newton, with smaller steps where they do not come nearer.
        let approach = |u: f64, v: f64| {
            let Some(mut here) = evaluate(u, v) else { return 0.0 };
            let (mut at, mut damping) = ([u, v], 1.0);
            for _ in 0..20 {
                let [point, du, dv] = here;
                let gap = p - point;
                let (a, b, c) = (du.dot(du), du.dot(dv), dv.dot(dv));
                let determinant = a * c - b * b;
                let (x, y) = (gap.dot(du), gap.dot(dv));
                let (su, sv) = ((c * x - b * y) / determinant, (a * y - b * x) / determinant);
                if !(su.is_finite() && sv.is_finite()) {
                    break;
                }
                let next = [clamp(at[0] + damping * su, |o| o.u), clamp(at[1] + damping * sv, |o| o.v)];
                match evaluate(next[0], next[1]) {
                    Some(there) if p.distance(there[0]) < gap.length() => (at, here) = (next, there),
                    _ => damping /= 4.0,
                }
            }
            p.distance(here[0])
        };
        let found = approach(u, v);
        if found <= self.tessellation.chord {
            return found;
        }
        // It may have stopped at a crease or a pole: from everywhere else, too.
        let mix = |k: u32, of: fn(&SurfacePoint) -> f64| {
            let (low, high) = (clamp(0.0, of), clamp(1.0, of));
            low + (high - low) * f64::from(k) / 8.0
        };
        let starts = (0..9).flat_map(|i| (0..9).map(move |j| (i, j)));
        starts.map(|(i, j)| approach(mix(i, |o| o.u), mix(j, |o| o.v))).fold(found, f64::min)
    }
}

/// The distance from a point to a triangle: to its plane over its inside, to its edges elsewhere.
fn to_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let edge = |p: DVec3, q: DVec3, r: DVec3| {
        let s = (p - q).dot(r - q) / (r - q).length_squared();
        p.distance(q + s.clamp(0.0, 1.0) * (r - q))
    };
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(q, r)| (*r - *q).cross(p - *q).dot(normal) >= 0.0);
    let to_edges = edge(p, a, b).min(edge(p, b, c)).min(edge(p, c, a));
    if inside { (p - a).dot(normal.normalize_or_zero()).abs().min(to_edges) } else { to_edges }
}

/// The largest value near a place of a triangle: a search along the axes, with steps that are halved.
fn climb([mut s, mut t]: [f64; 2], f: impl Fn([f64; 3]) -> f64) -> f64 {
    let at = |s: f64, t: f64| f([1.0 - s - t, s, t]);
    let (mut best, mut step) = (at(s, t), 0.2);
    while step > 0.01 {
        let moves = [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step), (step, -step), (-step, step)];
        let inside = |(x, y): &(f64, f64)| s + x >= 0.0 && t + y >= 0.0 && s + x + t + y <= 1.0;
        let found = moves.into_iter().filter(inside).map(|(x, y)| (at(s + x, t + y), s + x, t + y));
        match found.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((value, x, y)) if value > best => (best, s, t) = (value, x, y),
            _ => step /= 2.0,
        }
    }
    best
}

fn adversary<'a>(instance: &'a dyn Instance, tessellation: &'a Tessellation) -> Adversary<'a> {
    let mesh = &tessellation.mesh;
    let number = mesh.position_numbers();
    let mut around = vec![Vec::new(); mesh.positions.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        corners.iter().for_each(|i| around[number[*i as usize] as usize].push(t));
    }
    Adversary { instance, tessellation, bvh: Bvh::build(mesh).expect("it has triangles"), number, around }
}

/// Solids of the library with their volumes, in cubic millimetres; `None` where there is no short formula.
const SOLIDS: [(&str, Option<f64>); 22] = [
    ("part p = box()", Some(8000.0)),
    ("part p = rounded_box()", None),
    ("part p = capped_cylinder()", Some(2000.0 * PI)),
    ("part p = frustum()", Some(PI * 20.0 / 3.0 * (100.0 + 50.0 + 25.0))),
    ("part p = pipe()", Some(50.0 * 36.0 * PI)),
    ("part p = elbow()", Some(36.0 * PI * 25.0 * PI)),
    ("part p = capsule()", Some(PI * 25.0 * 10.0 + 4.0 / 3.0 * PI * 125.0)),
    ("part p = hollow_sphere()", Some(4.0 / 3.0 * PI * (1000.0 - 512.0))),
    ("part p = sphere(10mm)", Some(4.0 / 3.0 * PI * 1000.0)),
    ("part p = torus(20mm, 5mm)", Some(2.0 * PI * PI * 20.0 * 25.0)),
    ("part p = prism(circle(10mm), 5mm)", Some(500.0 * PI)),
    ("part p = prism(rectangle(40mm, 20mm), 5mm)", Some(4000.0)),
    ("part p = prism(rectangle(40mm, 20mm, radius: 3mm), 5mm)", Some(5.0 * (800.0 - 36.0 + 9.0 * PI))),
    ("part p = prism(regular_polygon(3, 20mm), 5mm)", Some(2_598.076_211_353_316)),
    ("part p = prism(regular_polygon(5, 20mm), 5mm)", Some(4_755.282_581_475_768)),
    ("part p = prism(regular_polygon(7, 20mm), 5mm, twist: 30deg)", None),
    ("part p = bar(line((0mm, 0mm, 0mm), (0mm, 0mm, 9mm)), rectangle(4mm, 2mm))", Some(72.0)),
    ("part p = bar(|t| polar(30mm, t * 180deg, 10mm * t), regular_polygon(6, 4mm))", None),
    ("part p = thicken(cylinder(20mm, 10mm), 2mm)", None),
    ("part p = thicken(plane(20mm, 10mm), 2mm)", Some(400.0)),
    // A T-joint: the borders of the halves end in the middle of the whole.
    (
        "part a = plane(20mm, 20mm).translate((0mm, 0mm, 10mm))
         part b = plane(10mm, 20mm).translate((-5mm, 0mm, 0mm)).flip()
         part c = plane(10mm, 20mm).translate((5mm, 0mm, 0mm)).flip()
         part wall = extrude(rectangle(20mm, 20mm), 10mm)",
        Some(4000.0),
    ),
    // Seams that do not meet, and a border that runs with another speed.
    (
        "part wall = cylinder(10mm, 20mm).rotate(37deg)
         part top = disc(10mm).translate((0mm, 0mm, 20mm))
         part base = |u: real, v: real| {
           let a = 1turn * u * u
           (10mm * v * cos(a), 10mm * v * sin(a), 0mm)
         }",
        None,
    ),
];

#[test]
fn solids_are_closed_and_have_their_volume() {
    for (body, truth) in SOLIDS {
        let program = program(body);
        for chord in [0.1, 0.02] {
            let tessellation = tessellate(&program, chord);
            let mesh = &tessellation.mesh;
            assert_eq!(open_edges(mesh), 0, "{body} at {chord}");
            assert!(tessellation.chord <= chord, "{body} at {chord}: {}", tessellation.chord);
            let found = volume(mesh);
            assert!(found > 0.0, "{body}");
            if let Some(truth) = truth {
                // All of the surface off by the chord.
                let bound = area(mesh) * chord + 1e-9 * truth;
                assert!((found - truth).abs() <= bound, "{body} at {chord}: {found} for {truth}");
                let flat = ["box()", "rectangle(40mm, 20mm),", "(3, 20mm)", "(5, 20mm),", "plane"];
                let flat = flat.iter().any(|f| body.contains(f)) && !body.contains("rounded");
                assert!(!flat || (found - truth).abs() < 1e-9 * truth, "{body}: {found} for {truth}");
            }
        }
    }
}

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

/// What an adversary finds may exceed what was measured by this much: it looks everywhere.
const MARGIN: f64 = 1.02;

#[test]
fn chords_are_kept() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for body in SURFACES {
        let program = program(body);
        let instance = instance(&program);
        for chord in [1.0, 0.1, 0.02, 0.001] {
            let tessellation = tessellate(&program, chord);
            assert!(tessellation.chord <= chord, "{body} at {chord}: {}", tessellation.chord);
            let found = adversary(&*instance, &tessellation).farthest(&mut random, 150);
            assert!(found <= MARGIN * chord, "{body} at {chord}: {found}");
        }
    }
}

/// What regular places of measuring miss: periods that fall in with them, narrow things, grids of nothing but poles and
/// seams, jumps across both parameters.
const HIDDEN: [&str; 9] = [
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
            let found = adversary(&*instance, &tessellation).farthest(&mut random, 400);
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

/// The fewest triangles of a grid of even steps that keeps to the chord at the places of a lattice in every triangle.
fn fewest_even(program: &Program, chord: f64) -> usize {
    let instance = instance(program);
    let error = |nu: u32, nv: u32| {
        let grid = Tessellation::uniform(program, &*instance, nu, nv).expect("it can be evaluated");
        let mut largest = 0.0_f64;
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

#[test]
fn a_crease_across_u_and_v_has_two_normals() {
    let program = program("part p = |u: real, v: real| (u * 100mm, v * 50mm, abs(u - v * v) * 20mm)");
    let tessellation = tessellate(&program, 0.02);
    let mesh = &tessellation.mesh;
    for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
        // Nothing between the two sides.
        let slope = n[0] / n[2];
        assert!((slope.abs() - 0.2).abs() < 1e-3, "{p:?} {n:?}");
    }
    let on_crease = |p: &[f64; 3]| p[2] < 1e-6 && p[0] > 1.0 && p[0] < 99.0;
    let number = mesh.position_numbers();
    let crease: Vec<u32> = mesh.positions.iter().zip(&number).filter(|(p, _)| on_crease(p)).map(|(_, n)| *n).collect();
    let mut places = crease.clone();
    places.sort_unstable();
    places.dedup();
    assert!(places.len() > 5 && crease.len() == 2 * places.len(), "{} {}", places.len(), crease.len());
}
