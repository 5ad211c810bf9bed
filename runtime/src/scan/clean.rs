//! Cleaning: what every later stage may then rely on, and counts of what was wrong.

use super::error::ScanFault;
use super::normals;
use super::raw::{RawMesh, VertexNormal};
use super::{Cleaning, Normals};
use crate::mesh::TriangleMesh;
use std::collections::{HashMap, HashSet};

/// A cleaned mesh, its counts, and whether its normals' signs mean anything.
pub(super) struct Cleaned {
    pub(super) mesh: TriangleMesh,
    pub(super) cleaning: Cleaning,
    pub(super) oriented: bool,
}

/// Cleans geometry in millimetres. Texture coordinates and groups do not survive it: a scan needs neither.
pub(super) fn clean(raw: &RawMesh, source: Normals) -> Result<Cleaned, ScanFault> {
    let mut cleaning =
        Cleaning { vertices_read: raw.vertices_read, triangles_read: raw.triangles.len(), ..Cleaning::default() };
    let merged = merge_duplicates(&raw.positions);
    cleaning.duplicate_vertices = raw.positions.len() - merged.positions.len();
    let mut mesh = TriangleMesh { positions: merged.positions, ..TriangleMesh::default() };
    keep_good_triangles(raw, &merged.index, &mut mesh, &mut cleaning);
    if mesh.triangles.is_empty() && !raw.triangles.is_empty() {
        return Err(ScanFault::OnlyDegenerate { triangles: raw.triangles.len() });
    }
    let mut given = match source {
        Normals::FromFile => merged_normals(raw, &merged.index, mesh.positions.len()),
        Normals::Computed => Vec::new(),
    };
    if !mesh.triangles.is_empty() {
        drop_unused(&mut mesh, &mut given);
    }
    // The reader may have left out unused vertices already; whatever is neither merged nor kept was unused.
    cleaning.unused_vertices = raw.vertices_read - cleaning.duplicate_vertices - mesh.positions.len();
    let oriented = !mesh.triangles.is_empty() || given.iter().any(|n| n.unit().is_some());
    settle_normals(&mut mesh, &given, &mut cleaning);
    Ok(Cleaned { mesh, cleaning, oriented })
}

struct Merged {
    positions: Vec<[f64; 3]>,
    /// For every original vertex, its place in `positions`.
    index: Vec<u32>,
}

/// Exactly equal positions become one. (Nearly equal ones stay: which of them are one is not ours to guess.)
fn merge_duplicates(positions: &[[f64; 3]]) -> Merged {
    let mut seen: HashMap<[u64; 3], u32> = HashMap::with_capacity(positions.len());
    let mut merged =
        Merged { positions: Vec::with_capacity(positions.len()), index: Vec::with_capacity(positions.len()) };
    for position in positions {
        // Adding 0 turns -0 into 0, so that both are one position.
        let key = position.map(|c| (c + 0.0).to_bits());
        let next = merged.positions.len() as u32;
        let index = *seen.entry(key).or_insert(next);
        if index == next {
            merged.positions.push(*position);
        }
        merged.index.push(index);
    }
    merged
}

fn keep_good_triangles(raw: &RawMesh, index: &[u32], mesh: &mut TriangleMesh, cleaning: &mut Cleaning) {
    let mut seen: HashSet<[u32; 3]> = HashSet::with_capacity(raw.triangles.len());
    for triangle in &raw.triangles {
        let triangle = triangle.map(|i| index[i as usize]);
        let mut key = triangle;
        key.sort_unstable();
        if key[0] == key[1] || key[1] == key[2] || is_sliver(mesh, triangle) {
            cleaning.degenerate_triangles += 1;
        } else if !seen.insert(key) {
            cleaning.duplicate_triangles += 1;
        } else {
            mesh.triangles.push(triangle);
        }
    }
}

/// Without area, up to rounding: the height is below 1e-12 of the longest side.
fn is_sliver(mesh: &TriangleMesh, triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|i| glam::DVec3::from(mesh.positions[i as usize]));
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    let doubled_area = (b - a).cross(c - a).length();
    // Written so that NaN counts as a sliver.
    !(doubled_area > 1e-12 * longest && doubled_area > f64::MIN_POSITIVE)
}

/// The file's normals, summed where vertices were merged; none where the file has none.
fn merged_normals(raw: &RawMesh, index: &[u32], count: usize) -> Vec<VertexNormal> {
    let normals = raw.vertex_normals();
    if normals.is_empty() || raw.positions.len() == count {
        return normals;
    }
    let mut sums = vec![VertexNormal::default(); count];
    for (&place, &normal) in index.iter().zip(&normals) {
        sums[place as usize] = sums[place as usize].merged(normal);
    }
    sums
}

fn drop_unused(mesh: &mut TriangleMesh, normals: &mut Vec<VertexNormal>) {
    let mut used = vec![false; mesh.positions.len()];
    for &vertex in mesh.triangles.iter().flatten() {
        used[vertex as usize] = true;
    }
    let mut next = 0;
    let place: Vec<u32> = used
        .iter()
        .map(|&used| {
            let place = next;
            next += u32::from(used);
            place
        })
        .collect();
    let mut keep = used.iter();
    mesh.positions.retain(|_| keep.next() == Some(&true));
    let mut keep = used.iter();
    normals.retain(|_| keep.next() == Some(&true));
    for vertex in mesh.triangles.iter_mut().flatten() {
        *vertex = place[*vertex as usize];
    }
}

/// Every vertex gets a unit normal: the file's, or a computed one.
fn settle_normals(mesh: &mut TriangleMesh, given: &[VertexNormal], cleaning: &mut Cleaning) {
    cleaning.mended_normals = given.iter().filter(|normal| normal.mended || normal.unit().is_none()).count();
    let settled: Option<Vec<[f64; 3]>> = given.iter().map(|normal| normal.unit().map(Into::into)).collect();
    mesh.normals = match settled {
        Some(normals) if normals.len() == mesh.positions.len() => normals,
        _ => {
            let mut normals = normals::compute(mesh);
            for (normal, given) in normals.iter_mut().zip(given) {
                *normal = given.unit().map_or(*normal, Into::into);
            }
            normals
        }
    };
}
