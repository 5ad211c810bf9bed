//! Large triangles in parts, for documents that displace vertices.

use crate::mesh::{Group, TriangleMesh};
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// The area of a surface over that of its triangles as halved edges leave them, in squares of the longest edge: 12 of a
/// plate that begins with a sliver. Less long ones have more area, and so there are fewer of them.
const TO_A_SQUARE: f64 = 12.0;

/// A mesh of the same surface whose edges are at most `edge` millimetres long, or so short as `most` triangles allow.
/// An edge is halved whatever triangle it belongs to, so that what was closed stays closed. Normals and texture
/// coordinates are interpolated.
#[must_use]
pub(crate) fn divided(mesh: &TriangleMesh, edge: f64, most: usize) -> TriangleMesh {
    let edge = edge.max((TO_A_SQUARE * mesh.area() / most.max(1) as f64).sqrt());
    let mut mesh = mesh.clone();
    if mesh.groups.is_empty() {
        mesh.groups = vec![Group { name: "model".to_owned(), start: 0, end: mesh.triangles.len() }];
    }
    // Each round halves the longest edges: a surface of a million lengths takes twenty.
    for _ in 0..64 {
        if !(edge > 0.0) || mesh.triangles.len() > 2 * most || !halve(&mut mesh, edge) {
            break;
        }
    }
    mesh
}

/// Halves all edges that are longer. Returns whether there were any.
fn halve(mesh: &mut TriangleMesh, edge: f64) -> bool {
    let old = std::mem::take(&mut mesh.triangles);
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
    let mut triangles = Vec::with_capacity(old.len());
    let mut groups = mesh.groups.clone();
    for group in &mut groups {
        let start = triangles.len();
        for triangle in &old[group.start..group.end] {
            let middle = [0, 1, 2].map(|k| {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                let [from, to] = [a, b].map(|v| DVec3::from_array(mesh.positions[v as usize]));
                (from.distance(to) > edge)
                    .then(|| *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| mesh.between(a, b)))
            });
            split(*triangle, middle, &mut triangles);
        }
        (group.start, group.end) = (start, triangles.len());
    }
    (mesh.triangles, mesh.groups) = (triangles, groups);
    !middles.is_empty()
}

/// The parts of a triangle some of whose edges have a vertex in their middle.
fn split([a, b, c]: [u32; 3], middle: [Option<u32>; 3], out: &mut Vec<[u32; 3]>) {
    match middle {
        [None, None, None] => out.push([a, b, c]),
        [Some(m), None, None] => out.extend([[a, m, c], [m, b, c]]),
        [None, Some(_), _] | [None, None, Some(_)] => split([b, c, a], [middle[1], middle[2], middle[0]], out),
        [Some(m), Some(n), None] => out.extend([[a, m, n], [m, b, n], [a, n, c]]),
        [Some(_), None, Some(_)] => split([c, a, b], [middle[2], middle[0], middle[1]], out),
        [Some(m), Some(n), Some(o)] => out.extend([[a, m, o], [m, b, n], [o, n, c], [m, n, o]]),
    }
}

impl TriangleMesh {
    /// Adds a vertex between two others and returns its number.
    fn between(&mut self, a: u32, b: u32) -> u32 {
        let [i, j] = [a, b].map(|v| v as usize);
        let middle = |values: &[[f64; 3]]| DVec3::from_array(values[i]).midpoint(DVec3::from_array(values[j]));
        self.positions.push(middle(&self.positions).to_array());
        if let (Some(first), true) = (self.normals.get(i).copied(), j < self.normals.len()) {
            self.normals.push(middle(&self.normals).try_normalize().map_or(first, |n| n.to_array()));
        }
        if i.max(j) < self.texcoords.len() {
            let [from, to] = [i, j].map(|v| DVec2::from_array(self.texcoords[v]));
            self.texcoords.push(from.midpoint(to).to_array());
        }
        self.positions.len() as u32 - 1
    }
}

#[cfg(test)]
mod tests {
    use super::divided;
    use crate::mesh::{Group, TriangleMesh};

    /// Two parts of a plate of 60 x 20 mm, of which one has a sliver.
    fn plate() -> TriangleMesh {
        TriangleMesh {
            positions: vec![[0.0; 3], [60.0, 0.0, 0.0], [60.0, 20.0, 0.0], [0.0, 20.0, 0.0], [59.0, 20.0, 0.0]],
            normals: vec![[0.0, 0.0, 1.0]; 5],
            texcoords: vec![[0.0, 0.0], [0.6, 0.0], [0.6, 0.2], [0.0, 0.2], [0.59, 0.2]],
            triangles: vec![[0, 1, 4], [1, 2, 4], [0, 4, 3]],
            groups: vec![
                Group { name: "a".to_owned(), start: 0, end: 2 },
                Group { name: "b".to_owned(), start: 2, end: 3 },
            ],
        }
    }

    #[test]
    fn edges_are_short_and_the_surface_is_the_same() {
        let mesh = divided(&plate(), 2.0, 20_000);
        let edges = mesh.triangles.iter().flat_map(|t| [0, 1, 2].map(|k| (t[k], t[(k + 1) % 3])));
        let mut lines = std::collections::HashMap::<(u32, u32), usize>::new();
        for (a, b) in edges {
            let [p, q] = [a, b].map(|v| glam::DVec3::from_array(mesh.positions[v as usize]));
            assert!(p.distance(q) <= 2.0);
            *lines.entry((a.min(b), a.max(b))).or_default() += 1;
        }
        assert!((mesh.area() - 1200.0).abs() < 1e-9);
        let area =
            |group: &Group| mesh.triangles[group.start..group.end].iter().map(|t| mesh.triangle_area(*t)).sum::<f64>();
        assert!((area(&mesh.groups[1]) - 590.0).abs() < 1e-9, "{}", area(&mesh.groups[1]));
        // Without gaps an edge that one triangle has lies on the rim.
        for ((a, b), _) in lines.into_iter().filter(|(_, count)| *count == 1) {
            let [p, q] = [a, b].map(|v| mesh.positions[v as usize]);
            let on = |k: usize, at: f64| p[k] == at && q[k] == at;
            assert!(on(0, 0.0) || on(0, 60.0) || on(1, 0.0) || on(1, 20.0), "{p:?} {q:?}");
        }
        for (p, st) in mesh.positions.iter().zip(&mesh.texcoords) {
            assert!((p[0] / 100.0 - st[0]).abs() < 1e-12 && (p[1] / 100.0 - st[1]).abs() < 1e-12);
        }
        assert!(mesh.normals.len() == mesh.positions.len());
    }

    #[test]
    fn there_are_so_many_triangles_and_no_more() {
        let mesh = divided(&plate(), 1e-6, 500);
        assert!((250..1000).contains(&mesh.triangles.len()), "{}", mesh.triangles.len());
        assert_eq!(divided(&plate(), f64::INFINITY, 1000).triangles.len(), 3);
    }
}
