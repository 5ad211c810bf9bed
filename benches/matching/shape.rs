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

/// Standard deviation of the scans' range noise. Millimetres.
pub(crate) const NOISE: f64 = 0.3;

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
}

impl Shape {
    /// An example, or a box, with dents and bumps of a height in millimetres.
    pub(crate) fn of(name: &str, dent: f64) -> Self {
        let path = format!("{}/examples/{name}/{name}.gml", env!("CARGO_MANIFEST_DIR"));
        let text = match name {
            "box" => BOX.to_owned(),
            _ => std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}")),
        };
        let script = SourceFile { text, name: path };
        let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
        let x: Vec<f64> = program.parameters().iter().map(|p| p.default).collect();
        let fineness = Fineness { chord: 0.01, edge: 1.0, ..Fineness::default() };
        let instance = Model::instantiate(&program, &x).unwrap_or_else(|e| panic!("{e}"));
        let mut mesh = Tessellation::new(&program, &*instance, fineness).unwrap_or_else(|e| panic!("{e}")).mesh;
        drop(instance);
        if dent > 0.0 {
            deform(&mut mesh, dent);
        }
        Self { program, x, mesh, is_dented: dent > 0.0 }
    }

    /// A virtual scan, in the model's position.
    pub(crate) fn scanned(&self, seed: u64, outliers: f64) -> Scan {
        let scanner =
            Scanner { seed, noise: NOISE, outliers, dropouts: 0.01, random_pose: false, ..Scanner::default() };
        let made = simulate::scan(&self.mesh, &scanner, &Silent).unwrap_or_else(|e| panic!("{e}"));
        scan::from_mesh(made.mesh, "virtual").unwrap_or_else(|e| panic!("{e}"))
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
