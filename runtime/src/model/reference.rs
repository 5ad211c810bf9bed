//! A mesh from elsewhere in the place of a model (\[VA\] sect. 6): texture coordinates of its own, or charts made here,
//! and the texels on its triangles.

use super::atlas::Chart;
use super::packing::largest_packing;
use super::raster::Raster;
use super::{Tessellation, Texels};
use crate::mesh::{Group, TriangleMesh};
use glam::DVec2;
use std::collections::HashMap;
use thiserror::Error;

/// A chart with more area than so many of its rectangles is not peeled: a ramp of as many turns would be.
const LAYERS: f64 = 16.0;

/// A reference mesh with a texture.
#[derive(Clone, Debug)]
pub struct ReferenceSurface {
    /// The mesh with texture coordinates and unit normals; without origins, since there is no parametrised surface.
    pub tessellation: Tessellation,
    /// Its texels.
    pub texels: Texels,
    /// Sentences for the user: for example that its own texture coordinates overlap and were not used.
    pub notices: Vec<String>,
}

/// The reason why a mesh has no texture.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum ReferenceError {
    /// There is nothing to measure from.
    #[error("the reference mesh has no triangles with an area; check the export's precision and unit")]
    NoTriangles,
    /// The charts do not fit.
    #[error(
        "the reference mesh falls into {charts} charts, too many for {size} x {size} texels; choose a higher resolution"
    )]
    TooSmall {
        /// The number of charts.
        charts: usize,
        /// Side of the texture.
        size: u32,
    },
}

impl ReferenceSurface {
    /// Gives the mesh a texture of `size` x `size` texels: with its own texture coordinates where it has usable ones
    /// (within [0, 1] and without overlaps), else with charts of triangles that look the same way along an axis.
    ///
    /// # Errors
    /// A mesh without area, or more charts than fit.
    pub fn new(mesh: &TriangleMesh, size: u32) -> Result<ReferenceSurface, ReferenceError> {
        if !mesh.triangles.iter().any(|t| mesh.triangle_normal(*t).is_some()) {
            return Err(ReferenceError::NoTriangles);
        }
        let mut notices = Vec::new();
        if !mesh.texcoords.is_empty() {
            match Raster::of_own_texture(mesh, size) {
                Ok(raster) => return Ok(assemble(mesh.clone(), raster, notices)),
                Err(why) => notices.push(format!("the mesh's own texture coordinates are not used: {why}")),
            }
        }
        let (charted, raster) = chart(mesh, size)?;
        Ok(assemble(charted, raster, notices))
    }
}

fn assemble(mut mesh: TriangleMesh, raster: Raster, notices: Vec<String>) -> ReferenceSurface {
    if mesh.groups.is_empty() {
        mesh.groups.push(Group { name: "surface".into(), start: 0, end: mesh.triangles.len() });
    }
    let texels = raster.texels(&mesh);
    if mesh.normals.is_empty() {
        mesh.normals = mesh.vertex_normals();
    }
    ReferenceSurface { tessellation: Tessellation { mesh, ..Tessellation::default() }, texels, notices }
}

/// Charts of connected triangles whose normals have the same greatest component, projected along that axis (so that no
/// triangle is seen from behind, and none shrinks by more than sqrt(3)). Where a chart still covers itself (a helical
/// ramp), the triangles on top move to a chart of their own, and again, until nothing overlaps.
fn chart(mesh: &TriangleMesh, size: u32) -> Result<(TriangleMesh, Raster), ReferenceError> {
    let mut chart_of = connected_charts(mesh);
    scatter_thick(mesh, &mut chart_of);
    for round in 0.. {
        let (charted, texcoords) = lay_out(mesh, &chart_of, size)?;
        let raster = Raster::new(&charted, &texcoords, size);
        if raster.overlapping.is_empty() {
            return Ok((TriangleMesh { texcoords, ..charted }, raster));
        }
        // A round peels off one layer of every chart. A mesh of very many layers gets a chart a triangle in the end,
        // so that the work is bounded.
        let count = chart_of.iter().max().map_or(0, |c| c + 1);
        let mut fresh = HashMap::new();
        for &t in &raster.overlapping {
            let next = count + fresh.len() as u32;
            let key = if round < 16 { chart_of[t as usize] } else { u32::MAX - t };
            chart_of[t as usize] = *fresh.entry(key).or_insert(next);
        }
    }
    unreachable!("the rounds have no end but by returning")
}

/// Gives each triangle of a chart that covers itself many times a chart of its own: to peel it layer by layer would
/// draw most of it again and again.
fn scatter_thick(mesh: &TriangleMesh, chart_of: &mut [u32]) {
    let count = chart_of.iter().max().map_or(0, |c| c + 1);
    let mut area = vec![0.0; count as usize];
    let mut bounds = vec![([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]); count as usize];
    for (corners, chart) in mesh.triangles.iter().zip(chart_of.iter()) {
        let direction = axis(mesh, *corners);
        let [a, b, c] = corners.map(|i| DVec2::from(project(mesh.positions[i as usize], direction)));
        area[*chart as usize] += 0.5 * (b - a).perp_dot(c - a).abs();
        let (low, high) = &mut bounds[*chart as usize];
        for (k, q) in [a, b, c].into_iter().flat_map(|p| [(0, p.x), (1, p.y)]) {
            (low[k], high[k]) = (low[k].min(q), high[k].max(q));
        }
    }
    let is_thick = |chart: u32| {
        let (low, high) = bounds[chart as usize];
        area[chart as usize] > LAYERS * (high[0] - low[0]) * (high[1] - low[1])
    };
    // The first triangle stays, as no chart may be empty.
    let (mut is_begun, mut next) = (vec![false; count as usize], count);
    for chart in chart_of.iter_mut() {
        if is_thick(*chart) && std::mem::replace(&mut is_begun[*chart as usize], true) {
            *chart = next;
            next += 1;
        }
    }
}

/// The direction of the normal's greatest component, of equals the last: 0..6, positive axes first.
fn axis(mesh: &TriangleMesh, triangle: [u32; 3]) -> u8 {
    let n = mesh.triangle_normal(triangle).unwrap_or_default();
    let k = (0..3).max_by(|&a, &b| n[a].abs().total_cmp(&n[b].abs())).unwrap_or(2);
    k as u8 + if n[k] < 0.0 { 3 } else { 0 }
}

fn connected_charts(mesh: &TriangleMesh) -> Vec<u32> {
    let mut part_of = vec![0; mesh.triangles.len()];
    for (k, g) in mesh.groups.iter().enumerate() {
        part_of[g.start..g.end].fill(k);
    }
    let kinds: Vec<(u8, usize)> = mesh.triangles.iter().map(|t| axis(mesh, *t)).zip(part_of).collect();
    let sides = |t: usize| {
        let [a, b, c] = mesh.triangles[t];
        [(a, b), (b, c), (c, a)].map(|(a, b)| (a.min(b), a.max(b), kinds[t]))
    };
    // The triangles at an edge that may belong to one chart.
    let mut edges: HashMap<(u32, u32, (u8, usize)), Vec<u32>> = HashMap::new();
    for t in 0..mesh.triangles.len() {
        sides(t).into_iter().for_each(|side| edges.entry(side).or_default().push(t as u32));
    }
    const NONE: u32 = u32::MAX;
    let mut chart_of = vec![NONE; mesh.triangles.len()];
    let mut count = 0;
    for first in 0..mesh.triangles.len() {
        if chart_of[first] != NONE {
            continue;
        }
        chart_of[first] = count;
        let mut open = vec![first];
        while let Some(t) = open.pop() {
            for side in sides(t) {
                // Once is enough: all of them are in the chart then, however many share the edge.
                for n in edges.remove(&side).unwrap_or_default() {
                    let n = n as usize;
                    if chart_of[n] == NONE {
                        chart_of[n] = count;
                        open.push(n);
                    }
                }
            }
        }
        count += 1;
    }
    chart_of
}

/// Packs the charts: a vertex is repeated for every chart that uses it.
fn lay_out(mesh: &TriangleMesh, chart_of: &[u32], size: u32) -> Result<(TriangleMesh, Vec<[f64; 2]>), ReferenceError> {
    let charts = chart_of.iter().max().map_or(0, |c| c + 1) as usize;
    let mut vertex_of: HashMap<(u32, u32), u32> = HashMap::new();
    let mut laid = TriangleMesh { groups: mesh.groups.clone(), ..TriangleMesh::default() };
    let mut flat: Vec<[f64; 2]> = Vec::new();
    let mut vertex_chart: Vec<u32> = Vec::new();
    let mut low = vec![[f64::INFINITY; 2]; charts];
    let mut high = vec![[f64::NEG_INFINITY; 2]; charts];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let c = chart_of[t];
        let direction = axis(mesh, *corners);
        laid.triangles.push(corners.map(|i| {
            *vertex_of.entry((c, i)).or_insert_with(|| {
                let p = mesh.positions[i as usize];
                let q = project(p, direction);
                for k in 0..2 {
                    low[c as usize][k] = low[c as usize][k].min(q[k]);
                    high[c as usize][k] = high[c as usize][k].max(q[k]);
                }
                laid.positions.push(p);
                laid.normals.extend(mesh.normals.get(i as usize));
                flat.push(q);
                vertex_chart.push(c);
                (flat.len() - 1) as u32
            })
        }));
    }
    let extents: Vec<[f64; 2]> = low.iter().zip(&high).map(|(l, h)| [h[0] - l[0], h[1] - l[1]]).collect();
    let packed = largest_packing(&extents, size).ok_or(ReferenceError::TooSmall { charts, size })?;
    let texcoords = flat
        .iter()
        .zip(&vertex_chart)
        .map(|(q, &c)| place(*q, low[c as usize], extents[c as usize], &packed[c as usize], size))
        .collect();
    Ok((laid, texcoords))
}

/// Drops the axis, keeping counter-clockwise triangles counter-clockwise.
fn project(p: [f64; 3], direction: u8) -> [f64; 2] {
    match direction {
        0 => [p[1], p[2]],
        1 => [p[2], p[0]],
        2 => [p[0], p[1]],
        3 => [p[2], p[1]],
        4 => [p[0], p[2]],
        _ => [p[1], p[0]],
    }
}

/// Texture coordinates of a projected point within its chart's rectangle.
fn place(q: [f64; 2], low: [f64; 2], extent: [f64; 2], chart: &Chart, size: u32) -> [f64; 2] {
    let fraction = |k: usize| if extent[k] > 0.0 { (q[k] - low[k]) / extent[k] } else { 0.5 };
    chart.texcoord(fraction(0), fraction(1), size)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A closed box of 10 x 20 x 30 mm.
    fn box_mesh() -> TriangleMesh {
        let positions = (0..8)
            .map(|i| [f64::from(i & 1) * 10.0, f64::from(i >> 1 & 1) * 20.0, f64::from(i >> 2 & 1) * 30.0])
            .collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        TriangleMesh { positions, triangles, ..TriangleMesh::default() }
    }

    #[test]
    fn a_box_gets_six_charts_whose_texels_make_up_its_area() {
        let surface = ReferenceSurface::new(&box_mesh(), 256).expect("a box");
        let area: f64 = surface.texels.area.iter().map(|a| f64::from(*a)).sum();
        let truth = 2.0 * (10.0 * 20.0 + 20.0 * 30.0 + 10.0 * 30.0);
        // Charts are whole texels wide: an error of half a texel in some 60 on each side.
        assert!((area / truth - 1.0).abs() < 0.02, "{area} against {truth}");
        assert_eq!(surface.tessellation.mesh.positions.len(), 24, "four corners a face");
        for (p, n) in surface.texels.position.iter().zip(&surface.texels.normal) {
            let centre = [5.0, 10.0, 15.0];
            let outward: f64 = (0..3).map(|k| (p[k] - centre[k]) * f64::from(n[k])).sum();
            assert!(outward > 0.0, "the normal at {p:?} points inwards");
        }
    }

    #[test]
    fn overlapping_texture_coordinates_are_not_used() {
        let mut mesh = box_mesh();
        mesh.texcoords = mesh.positions.iter().map(|p| [p[0] / 10.0, p[1] / 20.0]).collect();
        let surface = ReferenceSurface::new(&mesh, 128).expect("a box");
        assert_eq!(surface.notices.len(), 1);
    }

    #[test]
    fn a_helical_ramp_is_cut_where_it_covers_itself() {
        let steps = 120;
        let mut mesh = TriangleMesh::default();
        for i in 0..=steps {
            // Three turns around the z axis, 5 mm a turn: every chart that looks up lies above itself.
            let a = f64::from(i) / f64::from(steps) * 3.0 * std::f64::consts::TAU;
            for r in [10.0, 20.0] {
                mesh.positions.push([r * a.cos(), r * a.sin(), 5.0 * a / std::f64::consts::TAU]);
            }
        }
        for i in 0..steps {
            let a = 2 * i as u32;
            mesh.triangles.extend([[a, a + 1, a + 3], [a, a + 3, a + 2]]);
        }
        let area = mesh.area();
        let surface = ReferenceSurface::new(&mesh, 512).expect("a ramp");
        let covered: f64 = surface.texels.area.iter().map(|a| f64::from(*a)).sum();
        assert!((covered / area - 1.0).abs() < 0.02, "{covered} against {area}");
    }

    /// Very many triangles at the same edges, and on each other: each is looked at and drawn a few times at most.
    #[test]
    fn triangles_on_each_other_take_their_number_of_steps() {
        let mut mesh = box_mesh();
        let box_only = mesh.triangles.len();
        mesh.triangles.extend(vec![[0, 2, 3]; 100_000]);
        let begun = std::time::Instant::now();
        let error = ReferenceSurface::new(&mesh, 256).err();
        assert!(matches!(error, Some(ReferenceError::TooSmall { charts: 100_000.., size: 256 })), "{error:?}");
        // With texture coordinates of its own.
        mesh.texcoords =
            vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        assert!(ReferenceSurface::new(&mesh, 256).is_err());
        mesh.triangles.truncate(box_only + 40);
        let surface = ReferenceSurface::new(&mesh, 1024).expect("a box with forty triangles on each other");
        assert!(surface.notices[0].contains("triangles overlap"), "{:?}", surface.notices);
        assert!(begun.elapsed().as_secs() < 20, "{:?}", begun.elapsed());
    }

    #[test]
    fn nothing_to_measure_from_is_an_error() {
        assert_eq!(ReferenceSurface::new(&TriangleMesh::default(), 64).err(), Some(ReferenceError::NoTriangles));
    }
}
