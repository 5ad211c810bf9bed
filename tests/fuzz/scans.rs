//! Damaged scans and reference meshes of all formats through all commands that take one.

use crate::case::Case;
use crate::damage::Random;
use crate::mutate::{choose, damaged};
use crate::seal::seal;
use flate2::write::GzEncoder;
use gml_runtime::export::scan::{Recorded, ScanFormat, to_bytes};
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::scan::{Attributes, Station, Stations, Unit};
use std::f32::consts::PI;
use std::fmt::Write as _;
use std::io::Write as _;

/// Points of a ball, and its triangles by their indices.
pub(crate) struct Ball {
    points: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Ball {
    pub(crate) fn new(rows: u32, columns: u32) -> Ball {
        let point = |i: u32, j: u32| {
            let (a, b) = (PI * (i as f32 + 0.5) / rows as f32, 2.0 * PI * j as f32 / columns as f32);
            // Not quite round, as scans are.
            let r = 20.0 + 0.2 * ((7 * i + 3 * j) as f32).sin();
            [r * a.sin() * b.cos(), r * a.sin() * b.sin(), r * a.cos()]
        };
        let points = (0..rows).flat_map(|i| (0..columns).map(move |j| point(i, j))).collect();
        let at = |i: u32, j: u32| i * columns + j % columns;
        let cell = |i, j| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
        let triangles = (0..rows - 1).flat_map(|i| (0..columns).flat_map(move |j| cell(i, j))).collect();
        Ball { points, triangles }
    }

    /// Makes the whole ball huge, tiny, flat, thin, or one point; or moves it or a point of it far away.
    fn distort(&mut self, random: &mut Random) {
        let by = [1e-38, 1e-20, 1e-6, 1e-3, 100.0, 1e5, 5e8, 1e12, 1e18][random.below(9)];
        let (kind, some) = (random.below(6), random.below(self.points.len()));
        for (i, p) in self.points.iter_mut().enumerate() {
            match kind {
                0 => *p = p.map(|c| c * by),
                1 => p[2] = 0.0,
                2 => *p = [p[0], 0.0, 0.0],
                3 => *p = [by, by, by],
                4 => p[0] += by,
                _ if i == some => *p = p.map(|c| c * by),
                _ => {}
            }
        }
    }

    fn corners(&self, triangle: [u32; 3]) -> [[f32; 3]; 3] {
        triangle.map(|i| self.points[i as usize])
    }

    /// A file as gmlc writes it: with colours, intensities and two stations as far as the format has them.
    pub(crate) fn file(&self, format: ScanFormat) -> Vec<u8> {
        let positions: Vec<[f64; 3]> = self.points.iter().map(|p| p.map(f64::from)).collect();
        let of = |i: usize| i * 2 / positions.len();
        let attributes = Attributes {
            colours: (0..positions.len()).map(|i| [i as u8, 7, 200]).collect(),
            intensities: (0..positions.len()).map(|i| i as f32).collect(),
            stations: Stations {
                places: vec![Station::at([500.0, 0.0, 3.0]), Station::at([-500.0, 0.0, 3.0])],
                of_points: (0..positions.len()).map(|i| of(i) as u16).collect(),
            },
            ..Attributes::default()
        };
        let mesh = TriangleMesh { positions, triangles: self.triangles.clone(), ..TriangleMesh::default() };
        let scan = Recorded { mesh: &mesh, attributes: &attributes, grids: &[], unit: Unit::Mm };
        to_bytes(&scan, format).expect("a ball can be written")
    }

    fn obj(&self) -> Vec<u8> {
        let mut text = "# a ball\nmtllib ball.mtl\no ball\ng all\nusemtl clay\ns off\n".to_owned();
        let mut line = |l: String| text.write_fmt(format_args!("{l}\n")).expect("a string");
        self.points.iter().for_each(|[x, y, z]| line(format!("v {x} {y} {z}")));
        self.points.iter().for_each(|[x, y, z]| line(format!("vn {} {} {}", x / 20.0, y / 20.0, z / 20.0)));
        line("vt 0.5 0.5".to_owned());
        for [a, b, c] in self.triangles.iter().map(|t| t.map(|i| i + 1)) {
            line(format!("f {a}/1/{a} {b}/1/{b} {c}//{c}"));
        }
        text.into_bytes()
    }

    /// Big-endian, little-endian or text.
    fn ply(&self, format: &str) -> Vec<u8> {
        let (points, triangles) = (self.points.len(), self.triangles.len());
        let mut out = format!(
            "ply\nformat {format} 1.0\ncomment a ball\nelement vertex {points}\nproperty float x\nproperty float y\n\
             property float z\nproperty uchar quality\nelement face {triangles}\n\
             property list uchar int vertex_indices\nend_header\n"
        )
        .into_bytes();
        let big = format == "binary_big_endian";
        let bytes = |bits: u32| if big { bits.to_be_bytes() } else { bits.to_le_bytes() };
        for p in &self.points {
            match format {
                "ascii" => out.extend(format!("{} {} {} 7\n", p[0], p[1], p[2]).bytes()),
                _ => out.extend(p.iter().flat_map(|c| bytes(c.to_bits())).chain([7])),
            }
        }
        for t in &self.triangles {
            match format {
                "ascii" => out.extend(format!("3 {} {} {}\n", t[0], t[1], t[2]).bytes()),
                _ => out.extend([3].into_iter().chain(t.iter().flat_map(|i| bytes(*i)))),
            }
        }
        out
    }

    fn stl(&self, text: bool) -> Vec<u8> {
        let mut out = if text { b"solid ball\n".to_vec() } else { vec![b' '; 80] };
        if !text {
            out.extend((self.triangles.len() as u32).to_le_bytes());
        }
        for corners in self.triangles.iter().map(|t| self.corners(*t)) {
            if text {
                let vertex = |[x, y, z]: [f32; 3]| format!("vertex {x} {y} {z}\n");
                let loop_ = corners.map(vertex).concat();
                out.extend(format!("facet normal 0 0 1\nouter loop\n{loop_}endloop\nendfacet\n").bytes());
            } else {
                out.extend([[0.0; 3]].iter().chain(&corners).flatten().flat_map(|c: &f32| c.to_le_bytes()));
                out.extend([0, 0]);
            }
        }
        if text {
            out.extend(b"endsolid ball\n");
        }
        out
    }
}

/// Commands with SCAN for the file's name.
const COMMANDS: [&[&str]; 11] = [
    &["info", "SCAN"],
    &["info", "SCAN", "--json", "--keep-largest", "--crop=-1mm..,..,.."],
    &["convert", "SCAN", "-o", "new.ply", "--voxel", "3mm"],
    &["fit", "ball.gml", "SCAN", "-o", "new.json", "--surface", "--drop-outliers"],
    &["fit", "ball.gml", "SCAN", "-o", "new.json"],
    &["variance", "ball.gml", "SCAN", "--device", "cpu", "--resolution", "32", "-o", "out"],
    &["variance", "SCAN", "scan.ply", "--device", "cpu", "--resolution", "32", "-o", "out"],
    &["variance", "ball.gml", "SCAN", "--device", "cpu", "--resolution", "32", "--points", "--unit", "m", "-o", "out"],
    &["inspect", "ball.gml", "SCAN", "--device", "cpu", "--resolution", "32", "-o", "out"],
    &["compare", "SCAN", "ball.gml", "--resolution", "32", "-o", "new.json"],
    &["compare", "scan.ply", "SCAN", "--resolution", "32"],
];

/// Compressed by gzip.
fn packed(content: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(content).expect("memory");
    encoder.finish().expect("memory")
}

/// A random case.
pub(crate) fn case(random: &mut Random) -> Case {
    let mut ball = if random.below(8) == 0 { Ball::new(2, 3) } else { Ball::new(10, 16) };
    let distorted = random.below(3) == 0;
    if distorted {
        ball.distort(random);
    }
    let (ending, content) = match random.below(12) {
        0 => ("obj", ball.obj()),
        1 => ("ply", ball.ply("ascii")),
        2 => ("ply", ball.ply("binary_little_endian")),
        3 => ("ply", ball.ply("binary_big_endian")),
        4 => ("stl", ball.stl(true)),
        5 => ("stl", ball.stl(false)),
        _ => {
            let (ending, format) = ScanFormat::ALL[random.below(ScanFormat::ALL.len())];
            (ending, ball.file(format))
        }
    };
    let name = format!("bad.{ending}");
    let args = choose(random, &COMMANDS).iter().map(|a| if *a == "SCAN" { name.as_str() } else { a });
    let args: Vec<&str> = args.collect();
    let mut content = if distorted { content } else { damaged(&content, random) };
    if ending == "e57" {
        seal(&mut content);
    }
    if random.below(10) == 0 {
        content = packed(&content);
        if random.below(2) == 0 {
            content = damaged(&content, random);
        }
    }
    Case::of(&args).with(&name, content)
}
