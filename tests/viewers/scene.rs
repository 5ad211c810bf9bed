//! Documents of known appearance, to be looked at in viewers (tests/viewers/README.md): a cylinder of radius 40 and
//! height 90. Seen from the front, its scan has a red bump of 8 mm on the upper left, a blue dent of 6 mm on the lower
//! right, a hole in the middle, and a lid that is 2 mm too high.

use gml_runtime::export::measurement;
use gml_runtime::export::picture::Picture;
use gml_runtime::export::render::{self, Layer, Paint, TexelColours, View};
use gml_runtime::export::report::{self, Figure, Report, Scripts};
use gml_runtime::export::scale::Scale;
use gml_runtime::export::x3d::{self, MetadataGroup, X3dScene};
use gml_runtime::mesh::{Group, TriangleMesh};
use gml_runtime::model::{Motion, SurfacePoint, Tessellation, Texels};
use gml_runtime::scan::ScanSource;
use gml_runtime::variance::{Deviations, VarianceReport};
use std::f64::consts::TAU;
use std::path::PathBuf;

const RADIUS: f64 = 40.0;
const HEIGHT: f64 = 90.0;
const MAX_DISTANCE: f64 = 10.0;
const COLOUR_RANGE: f64 = 8.0;
const SIDE: usize = 512;

/// Size of the views in pixels.
const WIDTH: usize = 480;
const HEIGHT_IN_PIXELS: usize = 360;

const NAMES: [&str; 2] = ["wall", "lid \"<2>\" & 'more'"];

/// Charts: x, y (from the top), width, height in texels.
const WALL: [usize; 4] = [10, 10, 400, 240];
const LID: [usize; 4] = [20, 300, 150, 150];

/// Writes the documents into $GMLC_VIEWERS, or a temporary folder, and checks the front view: the bump is red, the dent
/// blue, the hole grey.
#[test]
fn a_scene_of_known_appearance() {
    let temporary = tempfile::tempdir().expect("a folder");
    let folder = std::env::var_os("GMLC_VIEWERS").map_or_else(|| temporary.path().to_owned(), PathBuf::from);
    std::fs::create_dir_all(&folder).expect("a folder");
    let tessellation = tessellation();
    let deviations = deviations();
    let scene = X3dScene {
        tessellation: &tessellation,
        deviations: &deviations,
        scan: &tessellation.mesh,
        scale: Scale::continuous(COLOUR_RANGE),
        robust_range: COLOUR_RANGE,
        turned: Motion::IDENTITY.rotation,
        title: "A cylinder with a bump & a dent",
        metadata: &[MetadataGroup { name: "wall".into(), entries: vec![("mean".into(), "0.25 mm".into())] }],
    };
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).expect("written");
    write("scene.x3d", x3d::write(&scene).expect("a scene").as_bytes());

    let mut views = Vec::new();
    let scale = Scale::continuous(COLOUR_RANGE);
    let colours = TexelColours::new(&deviations, &scale);
    let layer = Layer { mesh: &tessellation.mesh, paint: Paint::Texels(&colours), opacity: 1.0 };
    for (name, view) in [("front", View::FRONT), ("back", View::BACK), ("top", View::TOP), ("inside", View::INSIDE)] {
        let picture = render::render(&[layer], &view, WIDTH, HEIGHT_IN_PIXELS);
        if name == "front" {
            looks_as_expected(&picture);
        }
        let png = measurement::png(&picture).expect("a picture");
        write(&format!("{name}.png"), &png);
        views.push((name, png));
    }
    let scan = ScanSource { path: "bumpy.ply".into(), unit: "mm".into(), ..ScanSource::default() };
    let page = report::write(&Report {
        title: "Cylinder compared with bumpy.ply",
        record: None,
        scripts: &Scripts::default(),
        scan: &tessellation.mesh,
        fit: None,
        variance: &VarianceReport::new(&deviations, &scan, "cpu", &[]),
        deviations: &deviations,
        tessellation: &tessellation,
        turned: Motion::IDENTITY.rotation,
        colour_png: None,
        uncertainty_png: None,
        conformance_png: None,
        scale: &scale,
        picture: views.first().map(|(caption, png)| Figure { caption, png }),
        pictures: &[("Deviations", &views.iter().map(|(caption, png)| Figure { caption, png }).collect::<Vec<_>>())],
    });
    write("report.html", page.as_bytes());
}

/// The wall is in the middle of the picture; the bump above the middle on the left, the dent below it on the right.
fn looks_as_expected(front: &Picture) {
    let at = |x: usize, y: usize| front.pixels[y * front.width + x].map(i32::from);
    let middle = at(WIDTH / 2, HEIGHT_IN_PIXELS / 2);
    assert!(middle.iter().all(|c| (c - middle[0]).abs() < 20), "the hole is not grey: {middle:?}");
    let reddest = |pixels: &mut dyn Iterator<Item = (usize, usize)>, sign: i32| {
        let redness = |(x, y): &(usize, usize)| sign * (at(*x, *y)[0] - at(*x, *y)[2]);
        pixels.max_by_key(redness).map(|place| (place, redness(&place)))
    };
    let mut everywhere = (0..WIDTH).flat_map(|x| (0..HEIGHT_IN_PIXELS).map(move |y| (x, y)));
    let ((x, y), red) = reddest(&mut everywhere.clone(), 1).expect("pixels");
    assert!(x < WIDTH / 2 && y < HEIGHT_IN_PIXELS / 2 && red > 60, "the bump is at {x}, {y}");
    let ((x, y), blue) = reddest(&mut everywhere, -1).expect("pixels");
    assert!(x > WIDTH / 2 && y > HEIGHT_IN_PIXELS / 2 && blue > 60, "the dent is at {x}, {y}");
}

/// The deviation of the wall at (u, v), u once around from the back, v upwards; None in the hole.
fn wall_deviation(u: f64, v: f64) -> Option<f64> {
    let at = |cu: f64, cv: f64| (((u - cu) * TAU * RADIUS).powi(2) + ((v - cv) * HEIGHT).powi(2)).sqrt();
    if at(0.5, 0.5) < 8.0 {
        return None;
    }
    let hill = |distance: f64| (-(distance / 10.0).powi(2)).exp();
    Some(8.0 * hill(at(0.42, 0.72)) - 6.0 * hill(at(0.58, 0.28)))
}

/// S(u, v) and the normal of the wall. u = 1/2 is in front, at -y; u grows to the right as seen from there.
fn wall(u: f64, v: f64) -> ([f64; 3], [f64; 3]) {
    let (sin, cos) = (TAU * (u - 0.5)).sin_cos();
    let normal = [sin, -cos, 0.0];
    ([RADIUS * normal[0], RADIUS * normal[1], HEIGHT * v], normal)
}

fn lid(u: f64, v: f64) -> ([f64; 3], [f64; 3]) {
    let (sin, cos) = (TAU * u).sin_cos();
    ([-RADIUS * v * sin, -RADIUS * v * cos, HEIGHT], [0.0, 0.0, 1.0])
}

fn texcoord(chart: [usize; 4], u: f64, v: f64) -> [f64; 2] {
    let [x, y, width, height] = chart.map(|c| c as f64);
    [(x + u * width) / SIDE as f64, 1.0 - (y + (1.0 - v) * height) / SIDE as f64]
}

type Surface = fn(f64, f64) -> ([f64; 3], [f64; 3]);

fn tessellation() -> Tessellation {
    let mut mesh = TriangleMesh::default();
    let mut origins = Vec::new();
    let patches: [(&str, Surface, [usize; 4]); 2] = [(NAMES[0], wall, WALL), (NAMES[1], lid, LID)];
    for (patch, (name, surface, chart)) in patches.into_iter().enumerate() {
        let start = mesh.triangles.len();
        let first = mesh.positions.len() as u32;
        let (columns, rows) = (80u32, 40u32);
        for j in 0..=rows {
            for i in 0..=columns {
                let (u, v) = (f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows));
                let (position, normal) = surface(u, v);
                mesh.positions.push(position);
                mesh.normals.push(normal);
                mesh.texcoords.push(texcoord(chart, u, v));
                origins.push(SurfacePoint { patch: patch as u32, u, v });
            }
        }
        for j in 0..rows {
            for i in 0..columns {
                let a = first + j * (columns + 1) + i;
                let above = a + columns + 1;
                mesh.triangles.push([a, a + 1, above + 1]);
                mesh.triangles.push([a, above + 1, above]);
            }
        }
        mesh.groups.push(Group { name: name.to_owned(), start, end: mesh.triangles.len() });
    }
    Tessellation { mesh, origins, ..Tessellation::default() }
}

/// The deviations that ray casting would find.
fn deviations() -> Deviations {
    let mut texels = Texels { width: SIDE as u32, height: SIDE as u32, ..Texels::default() };
    let (mut outward, mut inward) = (Vec::new(), Vec::new());
    for (part, chart) in [WALL, LID].into_iter().enumerate() {
        let [x, y, width, height] = chart;
        for j in 0..height {
            for i in 0..width {
                let u = (i as f64 + 0.5) / width as f64;
                let v = 1.0 - (j as f64 + 0.5) / height as f64;
                let ((position, normal), d) =
                    if part == 0 { (wall(u, v), wall_deviation(u, v)) } else { (lid(u, v), Some(2.0)) };
                texels.index.push(((y + j) * SIDE + x + i) as u32);
                texels.part.push(part as u32);
                texels.position.push(position);
                texels.normal.push(normal.map(|c| c as f32));
                texels.area.push(if part == 0 { 1.0 } else { 2.0 * v as f32 });
                texels.side.push(1.0);
                let d = d.map_or(f32::NAN, |d| d as f32);
                // Where the scan lies outside, its far side is within reach, too: the nearer hit has to win.
                outward.push(if d >= 0.0 { d } else { f32::NAN });
                inward.push(if d >= 0.0 { 9.5 } else { -d });
            }
        }
    }
    texels.part_names = NAMES.map(str::to_owned).to_vec();
    Deviations::new(texels, MAX_DISTANCE, outward, inward)
}
