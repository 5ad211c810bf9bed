//! Writes documents whose appearance is known into a folder, for looking at in viewers (tests/viewers/README.md): a
//! cylinder (radius 40, height 90) whose scan has, seen from the front, a red bump of 8 mm on the upper left, a blue
//! dent of 6 mm on the lower right, a hole in the middle, and a lid that is 2 mm too high.

use gml_runtime::export::picture::{self, Picture};
use gml_runtime::export::raster;
use gml_runtime::export::render::{self, DeviationColours, Layer, Paint, View};
use gml_runtime::export::report::{self, Report};
use gml_runtime::export::x3d::{self, MetadataGroup, X3dScene};
use gml_runtime::mesh::{Group, TriangleMesh};
use gml_runtime::model::{SurfacePoint, Tessellation, Texels};
use gml_runtime::scan::ScanSource;
use gml_runtime::variance::{Deviations, DistanceTexture, VarianceReport};
use std::f64::consts::TAU;
use std::path::Path;

const RADIUS: f64 = 40.0;
const HEIGHT: f64 = 90.0;
const MAX_DISTANCE: f64 = 10.0;
const COLOUR_RANGE: f64 = 8.0;
const SIDE: usize = 512;

const NAMES: [&str; 2] = ["wall", "lid \"<2>\" & 'more'"];

/// Charts: x, y (from the top), width, height in texels.
const WALL: [usize; 4] = [10, 10, 400, 240];
const LID: [usize; 4] = [20, 300, 150, 150];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: viewer_scene FOLDER")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let tessellation = tessellation();
    let deviations = deviations();
    let texture = DistanceTexture::new(&deviations);
    let distance_png = raster::png_rgb(texture.width, texture.height, &texture.rgb, &[])?;
    let scene = X3dScene {
        tessellation: &tessellation,
        texture_png: &distance_png,
        texture_size: [SIDE as u32; 2],
        max_distance: MAX_DISTANCE,
        colour_range: COLOUR_RANGE,
        turned: render::IDENTITY,
        title: "A cylinder with a bump & a dent",
        metadata: &[MetadataGroup { name: "wall".into(), entries: vec![("mean".into(), "0.25 mm".into())] }],
    };
    std::fs::write(folder.join("scene.x3d"), x3d::write(&scene)?)?;

    let mut views = Vec::new();
    let colours = DeviationColours::new(&deviations, COLOUR_RANGE);
    let layer = Layer { mesh: &tessellation.mesh, paint: Paint::Deviations(&colours), opacity: 1.0 };
    for (name, view) in [("front", View::FRONT), ("back", View::BACK), ("top", View::TOP), ("inside", View::INSIDE)] {
        let png = encode(&render::render(&[layer], &view, 480, 360))?;
        std::fs::write(folder.join(format!("{name}.png")), &png)?;
        views.push((name, png));
    }
    let scan = ScanSource { path: "bumpy.ply".into(), unit: "mm".into(), ..ScanSource::default() };
    let page = report::write(&Report {
        title: "Cylinder compared with bumpy.ply",
        model: "cylinder.gml",
        date: "2024-05-06",
        tool: "gmlc",
        fit: None,
        variance: &VarianceReport::new(&deviations, &scan, "cpu"),
        deviations: &deviations,
        tessellation: &tessellation,
        turned: render::IDENTITY,
        distance_png: &distance_png,
        colour_png: &encode(&picture::deviation_picture(&deviations, COLOUR_RANGE))?,
        colour_range: COLOUR_RANGE,
        pictures: &views.iter().map(|(name, png)| (*name, png.as_slice())).collect::<Vec<_>>(),
    });
    std::fs::write(folder.join("report.html"), page)?;
    Ok(())
}

fn encode(picture: &Picture) -> Result<Vec<u8>, raster::RasterError> {
    raster::png_rgb(picture.width as u32, picture.height as u32, picture.pixels.as_flattened(), &[])
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
        let (columns, rows) = (160u32, 80u32);
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
    Tessellation { mesh, origins }
}

/// What ray casting would find.
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
                let d = d.map_or(f32::NAN, |d| d as f32);
                // The far side of the scan is in reach where the near one is outside, so that the nearer has to win.
                outward.push(if d >= 0.0 { d } else { f32::NAN });
                inward.push(if d >= 0.0 { 9.5 } else { -d });
            }
        }
    }
    texels.part_names = NAMES.map(str::to_owned).to_vec();
    Deviations { texels, max_distance: MAX_DISTANCE, outward, inward, filled: Vec::new(), cosine: Vec::new() }
}
