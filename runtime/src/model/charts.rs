//! From a place of the texture back to the parameters of the surface.

use super::Tessellation;
use glam::{DMat3, DVec3};

/// For one patch, u and v as functions of the texture coordinates (s, t): `c[0] + c[1] s + c[2] t` each.
pub type ChartMap = [[f64; 3]; 2];

impl Tessellation {
    /// For each patch, how u and v follow from texture coordinates; none for a patch that no vertices tell it of. A
    /// patch fills a rectangle of the texture, so that the relation is linear: it is the least-squares fit to the
    /// vertices, which rounds away that texture coordinates may be of single precision.
    #[must_use]
    pub fn chart_maps(&self) -> Vec<Option<ChartMap>> {
        let mut sums = vec![(DMat3::ZERO, [DVec3::ZERO; 2]); self.mesh.groups.len()];
        for (origin, [s, t]) in self.origins.iter().zip(&self.mesh.texcoords) {
            let Some((square, right)) = sums.get_mut(origin.patch as usize) else { continue };
            let row = DVec3::new(1.0, *s, *t);
            *square += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
            right[0] += row * origin.u;
            right[1] += row * origin.v;
        }
        sums.into_iter().map(|(square, right)| solved(square, right)).collect()
    }
}

/// The solution of the normal equations; none where the vertices lie on a line of the texture.
fn solved(square: DMat3, right: [DVec3; 2]) -> Option<ChartMap> {
    let inverse = square.inverse();
    let map = right.map(|right| (inverse * right).to_array());
    map.as_flattened().iter().all(|c| c.is_finite()).then_some(map)
}

/// (u, v) of texture coordinates, within [0, 1].
#[must_use]
pub fn surface_coordinates(map: &ChartMap, [s, t]: [f64; 2]) -> [f64; 2] {
    map.map(|[c, along_s, along_t]| (c + along_s * s + along_t * t).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::surface_coordinates;
    use crate::mesh::{Group, TriangleMesh};
    use crate::model::{SurfacePoint, Tessellation};

    /// A patch that lies turned by a quarter in the texture, and one of which there are too few vertices.
    #[test]
    fn places_of_the_texture_lead_back_to_the_surface() {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.25, 0.5)];
        let place = |(u, v): (f64, f64)| [0.1 + 0.3 * v, 0.9 - 0.2 * u];
        let mut origins: Vec<SurfacePoint> =
            corners.iter().map(|(u, v)| SurfacePoint { patch: 0, u: *u, v: *v }).collect();
        origins.push(SurfacePoint { patch: 1, u: 0.5, v: 0.5 });
        let mut texcoords: Vec<[f64; 2]> = corners.iter().map(|c| place(*c)).collect();
        texcoords.push([0.5, 0.5]);
        let groups = ["a", "b"].map(|name| Group { name: name.to_owned(), start: 0, end: 0 }).to_vec();
        let mesh = TriangleMesh { texcoords, groups, ..TriangleMesh::default() };
        let maps = Tessellation { mesh, origins, ..Tessellation::default() }.chart_maps();
        let map = maps[0].expect("four vertices tell it");
        let [u, v] = surface_coordinates(&map, place((0.7, 0.3)));
        assert!((u - 0.7).abs() < 1e-12 && (v - 0.3).abs() < 1e-12, "{u} {v}");
        assert_eq!(maps[1], None);
    }
}
