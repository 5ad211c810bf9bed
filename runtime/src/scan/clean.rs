//! Cleaning: it establishes the properties of a [`Scan`](super::Scan) that later stages rely on.

use super::attributes::Attributes;
use super::equal::{first_equal, merge_equal, position_key};
use super::error::ScanFault;
use super::normals;
use super::raw::RawMesh;
use crate::mesh::{TriangleMesh, renumber_used, retain_marked};
use glam::DVec3;
use rayon::prelude::*;

/// Clean geometry.
pub(super) struct Cleaned {
    /// With unit vertex normals.
    pub(super) mesh: TriangleMesh,
    pub(super) attributes: Attributes,
    /// The signs of the normals are more than a guess.
    pub(super) oriented: bool,
    /// The triangles were turned to agree with the file's normals.
    pub(super) turned: bool,
    /// Numbers of triangles that were dropped.
    pub(super) dropped: Dropped,
}

/// The triangles that a scan, or a reference mesh, has no use for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Dropped {
    /// The triangles of the file.
    pub(super) all: usize,
    pub(super) without_area: usize,
    pub(super) repeated: usize,
    /// Points of a cloud at the place of another one; vertices of a mesh that are one with another.
    pub(super) equal_points: usize,
    /// Vertices that no triangle uses.
    pub(super) unused: usize,
}

impl Dropped {
    /// The share of a cloud's points that are at the place of another one, or of a mesh's triangles without area.
    pub(super) fn coincident(self, points: usize) -> f64 {
        let (part, all) = if self.all > 0 { (self.without_area, self.all) } else { (self.equal_points, points) };
        part as f64 / all.max(1) as f64
    }

    /// A sentence about them, if there are any.
    pub(super) fn warning(self) -> Option<String> {
        let Self { all, without_area, repeated, .. } = self;
        let counts = [(without_area, "without area"), (repeated, "that are there twice")];
        let counts: Vec<String> =
            counts.iter().filter(|(count, _)| *count > 0).map(|(count, kind)| format!("{count} {kind}")).collect();
        (!counts.is_empty()).then(|| format!("of its {all} triangles, {} are left out", counts.join(" and ")))
    }
}

/// The share of the triangles that must face away from the file's vertex normals for all to be turned: of a file in
/// which they agree, hardly any do so, at sharp edges.
const CONTRADICTORY: f64 = 0.9;

/// Cleans geometry in millimetres: merges vertices, and drops triangles without area, repeated triangles and vertices
/// that no triangle uses (but in a cloud). Texture coordinates and groups do not survive it: a scan needs neither.
/// Triangles that contradict the file's normals are turned: the order of a triangle's vertices is an accident more
/// often than a normal.
pub(super) fn clean(raw: &RawMesh) -> Result<Cleaned, ScanFault> {
    let (positions, index) = if raw.distinct {
        (raw.positions.clone(), (0..raw.positions.len() as u32).collect())
    } else {
        merge_equal(raw.positions.len(), |i| position_key(raw.positions[i]), |i| raw.positions[i])
    };
    let mut normals = merged_normals(raw, &index, positions.len());
    let mut mesh = TriangleMesh { positions, ..TriangleMesh::default() };
    let mut attributes = raw.attributes.merged(&index, mesh.positions.len());
    let equal_points = raw.positions.len() - mesh.positions.len();
    let mut dropped = Dropped { all: raw.triangles.len(), equal_points, ..Dropped::default() };
    let merged = raw.triangles.par_iter().map(|t| t.map(|i| index[i as usize]));
    let with_area: Vec<[u32; 3]> = merged.filter(|t| !is_sliver(&mesh, *t)).collect();
    dropped.without_area = raw.triangles.len() - with_area.len();
    let sorted = |i: usize| {
        let mut corners = with_area[i];
        corners.sort_unstable();
        corners
    };
    let firsts = first_equal(with_area.len(), sorted).into_iter().zip(0..);
    mesh.triangles = firsts.zip(&with_area).filter(|((first, i), _)| first == i).map(|(_, t)| *t).collect();
    dropped.repeated = with_area.len() - mesh.triangles.len();
    if mesh.triangles.is_empty() && !raw.triangles.is_empty() {
        return Err(ScanFault::OnlyDegenerate { triangles: raw.triangles.len() });
    }
    if !mesh.triangles.is_empty() {
        let used = renumber_used(&mut mesh.triangles, mesh.positions.len());
        retain_marked(&mut mesh.positions, &used);
        retain_marked(&mut normals, &used);
        attributes.retain_marked(&used);
        dropped.unused = used.iter().filter(|used| !**used).count();
    }
    let turned = is_contradictory(&mesh, &normals);
    if turned {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    let oriented = !mesh.triangles.is_empty() || normals.iter().any(Option::is_some);
    let complete = !normals.is_empty() && normals.iter().all(Option::is_some);
    mesh.normals = if complete { vec![[0.0; 3]; mesh.positions.len()] } else { normals::compute(&mesh) };
    for (normal, given) in mesh.normals.iter_mut().zip(normals) {
        *normal = given.map_or(*normal, Into::into);
    }
    Ok(Cleaned { mesh, attributes, oriented, turned, dropped })
}

/// Whether nearly all triangles face away from the normals that the file gives their vertices.
fn is_contradictory(mesh: &TriangleMesh, normals: &[Option<DVec3>]) -> bool {
    if normals.is_empty() {
        return false;
    }
    let agreement = |t: &[u32; 3]| {
        let given: DVec3 = t.iter().filter_map(|v| *normals.get(*v as usize)?).sum();
        mesh.triangle_normal(*t).map_or(0.0, |normal| normal.dot(given))
    };
    let (mut with, mut against) = (0.0, 0.0);
    for agreement in mesh.triangles.iter().map(agreement) {
        with += f64::from(u8::from(agreement > 0.0));
        against += f64::from(u8::from(agreement < 0.0));
    }
    against > CONTRADICTORY * (with + against)
}

/// Without area, up to rounding: a vertex is there twice, or the height is below 1e-12 of the longest side.
fn is_sliver(mesh: &TriangleMesh, triangle: [u32; 3]) -> bool {
    let [a, b, c] = mesh.corners(triangle);
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    let doubled_area = (b - a).cross(c - a).length();
    // Written so that NaN counts as a sliver.
    !(doubled_area > 1e-12 * longest && doubled_area > f64::MIN_POSITIVE)
}

/// The file's unit normals, summed over corners and merged vertices; no list where the file has none, and none at a
/// vertex where they cancel out or are unusable. `index` is the place of every vertex among the `count` merged ones.
fn merged_normals(raw: &RawMesh, index: &[u32], count: usize) -> Vec<Option<DVec3>> {
    let unit = |normal: &[f64; 3]| {
        let length = DVec3::from_array(*normal).length();
        if length.is_finite() && length > 1e-12 { DVec3::from_array(*normal) / length } else { DVec3::ZERO }
    };
    let mut normals: Vec<DVec3> = raw.normals.iter().map(unit).collect();
    if !raw.corner_normals.is_empty() {
        normals = vec![DVec3::ZERO; raw.positions.len()];
        for (vertex, normal) in raw.triangles.iter().flatten().zip(raw.corner_normals.iter().flatten()) {
            normals[*vertex as usize] += unit(normal);
        }
    }
    let mut sums = vec![DVec3::ZERO; if normals.is_empty() { 0 } else { count }];
    for (place, normal) in index.iter().zip(normals) {
        sums[*place as usize] += normal;
    }
    sums.into_iter().map(|sum| (sum.length() > 1e-9).then(|| sum.normalize())).collect()
}
