//! Shapes whose deviations from a model are known, and virtual scans of them.

use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use gml_runtime::bvh::Bvh;
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::model::{Fineness, Model, Tessellation, Texels};
use gml_runtime::progress::Silent;
use gml_runtime::scan::{self, Scan};
use gml_runtime::simulate::{self, Scanner};
use gml_runtime::variance::{self, Device, Facing};

/// Standard deviation of the range noise of a scan with points [`SPACING`] apart. Millimetres.
const NOISE: f64 = 0.3;

/// The distance between the points of a scan. Millimetres.
const SPACING: f64 = 0.8;

/// The height of dents and bumps of shapes that deviate, in a scan with points [`SPACING`] apart. Millimetres.
const DENT: f64 = 2.0;

/// Scans of larger models have points, noise and dents that are as many times as large, so that they have no more
/// points than this: a column of three metres would have ten millions.
const MOST_POINTS: f64 = 120_000.0;

const BOX: &str = "model block { part body = box(width: 60mm, depth: 40mm, height: 30mm) }";

/// The number of dents and bumps.
const DENTS: usize = 8;

/// A model at its defaults, and a surface that deviates from it.
pub(crate) struct Shape {
    pub(crate) program: Program,
    pub(crate) x: Vec<f64>,
    /// The surface, with a group for every part.
    mesh: TriangleMesh,
    is_dented: bool,
    /// By how much spacing, noise and dents are larger.
    scale: f64,
}

impl Shape {
    /// A script of the examples, such as `mug` or `cup/octagonal_cup`, or a box; with dents and bumps or without.
    pub(crate) fn of(name: &str, is_dented: bool) -> Self {
        let file = if name.contains('/') { name.to_owned() } else { format!("{name}/{name}") };
        let path = format!("{}/examples/{file}.gml", env!("CARGO_MANIFEST_DIR"));
        let text = match name {
            "box" => BOX.to_owned(),
            _ => std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}")),
        };
        let script = SourceFile { text, name: path };
        let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
        let x: Vec<f64> = program.parameters().iter().map(|p| p.default).collect();
        let instance = Model::instantiate(&program, &x).unwrap_or_else(|e| panic!("{e}"));
        let tessellated =
            |fineness| Tessellation::new(&program, &*instance, fineness).unwrap_or_else(|e| panic!("{e}"));
        let area = tessellated(Fineness::default()).mesh.area();
        let scale = (area / MOST_POINTS).sqrt().max(SPACING) / SPACING;
        let fineness = Fineness { chord: 0.01 * scale, edge: scale, ..Fineness::default() };
        let mut mesh = tessellated(fineness).mesh;
        drop(instance);
        if is_dented {
            deform(&mut mesh, scale * DENT);
        }
        Self { program, x, mesh, is_dented, scale }
    }

    /// Standard deviation of the scans' range noise. Millimetres.
    pub(crate) fn noise(&self) -> f64 {
        self.scale * NOISE
    }

    /// A virtual scan, in the model's position, and the same with every point at its true place.
    pub(crate) fn scanned(&self, seed: u64, outliers: f64) -> (Scan, TriangleMesh) {
        let default = Scanner::default();
        let scanner = Scanner {
            seed,
            outliers,
            spacing: self.scale * SPACING,
            noise: self.noise(),
            outlier_range: self.scale * default.outlier_range,
            dropouts: 0.01,
            random_pose: false,
            ..default
        };
        let made = |scanner| simulate::scan(&self.mesh, &scanner, &Silent).unwrap_or_else(|e| panic!("{e}")).mesh;
        // The scanner decides by true points which triangles there are, and draws as many numbers without noise.
        let exact = made(Scanner { noise: 0.0, outlier_range: 0.0, ..scanner.clone() });
        let scan = scan::from_mesh(made(scanner), "virtual").unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(scan.mesh.triangles, exact.triangles, "cleaning has dropped triangles");
        (scan, exact)
    }

    /// The distance of every texel from its own part of the surface, along its normal. NaN where it does not meet it.
    pub(crate) fn truth(&self, texels: &Texels, max_distance: f64) -> Vec<f64> {
        if !self.is_dented {
            return vec![0.0; texels.len()];
        }
        let mut truth = vec![f64::NAN; texels.len()];
        for (part, group) in self.mesh.groups.iter().enumerate() {
            let triangles = self.mesh.triangles[group.start..group.end].to_vec();
            let positions = self.mesh.positions.clone();
            let own = TriangleMesh { positions, triangles, ..TriangleMesh::default() };
            let bvh = Bvh::build(&own).unwrap_or_else(|e| panic!("{e}"));
            let members: Vec<usize> = (0..texels.len()).filter(|i| texels.part[*i] as usize == part).collect();
            let of_part = Texels {
                width: texels.width,
                height: texels.height,
                index: members.iter().map(|i| texels.index[*i]).collect(),
                part: vec![0; members.len()],
                position: members.iter().map(|i| texels.position[*i]).collect(),
                normal: members.iter().map(|i| texels.normal[*i]).collect(),
                area: members.iter().map(|i| texels.area[*i]).collect(),
                side: members.iter().map(|i| texels.side[*i]).collect(),
                part_names: vec![group.name.clone()],
            };
            let cast = variance::cast(of_part, &bvh, max_distance, Facing::SAME, Device::Cpu);
            let deviations = cast.unwrap_or_else(|e| panic!("{e}")).deviations;
            members.iter().enumerate().for_each(|(k, i)| truth[*i] = f64::from(deviations.signed(k)));
        }
        truth
    }
}

/// Moves a mesh by a smooth field, so that both sides of a thin wall move together: around some vertices along their
/// normals, outwards and inwards by turns, and less the farther from them, over 5 to 12 % of the mesh's size.
fn deform(mesh: &mut TriangleMesh, height: f64) {
    let size = mesh.bounds().diagonal();
    let dents: Vec<([f64; 3], [f64; 3], f64)> = (0..DENTS)
        .map(|k| {
            // Places of the golden ratio's multiples are spread over the list of vertices.
            let i = ((k + 1) as f64 * 0.618_034).fract() * mesh.positions.len() as f64;
            let sign = if k % 2 == 0 { height } else { -height };
            let moved = mesh.normals[i as usize].map(|n| sign * n);
            (mesh.positions[i as usize], moved, size * (0.05 + 0.01 * k as f64))
        })
        .collect();
    for p in &mut mesh.positions {
        let place = *p;
        for (centre, moved, width) in &dents {
            let squared: f64 = (0..3).map(|k| (place[k] - centre[k]).powi(2)).sum();
            let share = (-squared / (2.0 * width * width)).exp();
            (0..3).for_each(|k| p[k] += share * moved[k]);
        }
    }
    mesh.normals.clear();
}
