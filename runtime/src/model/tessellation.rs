//! A model's surface as triangles whose vertices know their patch and parameters.

use super::atlas::Atlas;
use super::{EvaluationError, Instance, Model, Partials, SecondPartials, Sites};
use crate::mesh::{Group, TriangleMesh};
use glam::DVec3;
use rayon::prelude::*;

/// A point of a model: a patch and its parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfacePoint {
    /// Index of the patch.
    pub patch: u32,
    /// First surface parameter, in [0, 1].
    pub u: f64,
    /// Second surface parameter, in [0, 1].
    pub v: f64,
}

/// The fineness of a tessellation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fineness {
    /// The largest distance between a chord and the surface. Millimetres.
    pub chord: f64,
    /// The longest edge along u or v. Millimetres. Surfaces that are displaced need short edges where they are flat,
    /// too.
    pub edge: f64,
    /// The most segments along either direction of a patch.
    pub max_segments: u32,
}

impl Default for Fineness {
    fn default() -> Self {
        Self { chord: 0.02, edge: f64::INFINITY, max_segments: 512 }
    }
}

/// A tessellated model.
#[derive(Clone, Debug, Default)]
pub struct Tessellation {
    /// Positions, unit normals of the exact surface (outward), texture coordinates in the atlas (where there is one);
    /// one group a patch, named like the part.
    pub mesh: TriangleMesh,
    /// The point of the model that every vertex is, so that any point of any triangle maps back to the exact surface.
    pub origins: Vec<SurfacePoint>,
}

/// A patch at every u of some columns for every v of some rows, u running fastest.
struct Grid {
    u: Vec<f64>,
    v: Vec<f64>,
    partials: Vec<Partials>,
    /// Unit normals; none where the patch has no area.
    normals: Vec<Option<DVec3>>,
}

impl Grid {
    fn new(instance: &dyn Instance, patch: usize, u: &[f64], v: &[f64]) -> Result<Self, EvaluationError> {
        let mut partials = vec![Partials::default(); u.len() * v.len()];
        instance.partials_grid(patch, u, v, &mut partials)?;
        let (u, v) = Sites::Grid(u, v).expanded();
        let normals = unit_normals(instance, patch, &u, &v, &partials)?;
        Ok(Self { u, v, partials, normals })
    }
}

impl Tessellation {
    /// Tessellates every patch on a grid that keeps to the chord tolerance and to the length of edges.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn new(model: &dyn Model, instance: &dyn Instance, fineness: Fineness) -> Result<Self, EvaluationError> {
        Self::of_segments(model, instance, |patch| segments(instance, patch, fineness))
    }

    /// Tessellates every patch on a grid of the same number of segments, whatever its shape.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn uniform(model: &dyn Model, instance: &dyn Instance, nu: u32, nv: u32) -> Result<Self, EvaluationError> {
        Self::of_segments(model, instance, |_| Ok([nu.max(1), nv.max(1)]))
    }

    /// Evaluates all patches, several at once, on grids of the given numbers of segments along u and v, and joins them
    /// in their order.
    fn of_segments(
        model: &dyn Model,
        instance: &dyn Instance,
        segments: impl Fn(usize) -> Result<[u32; 2], EvaluationError> + Sync,
    ) -> Result<Self, EvaluationError> {
        let even = |n: u32| -> Vec<f64> { (0..=n).map(|i| f64::from(i) / f64::from(n)).collect() };
        let grid = |patch| {
            let [nu, nv] = segments(patch)?;
            Grid::new(instance, patch, &even(nu), &even(nv)).map(|grid| ([nu, nv], grid))
        };
        let grids: Vec<_> = (0..model.parts().len()).into_par_iter().map(grid).collect();
        let mut tessellation = Self::default();
        for ((patch, part), grid) in model.parts().iter().enumerate().zip(grids) {
            let (segments, grid) = grid?;
            tessellation.add_grid(patch, &part.name, segments, grid);
        }
        Ok(tessellation)
    }

    /// Sets the texture coordinates of every vertex to its place in the atlas.
    #[must_use]
    pub fn with_atlas(mut self, atlas: &Atlas) -> Self {
        self.mesh.texcoords = self.origins.iter().map(|o| atlas.texcoord(o.patch as usize, o.u, o.v)).collect();
        self
    }

    fn add_grid(&mut self, patch: usize, name: &str, [nu, nv]: [u32; 2], grid: Grid) {
        let Grid { u, v, partials, normals } = grid;
        let first_vertex = self.mesh.positions.len() as u32;
        let first_triangle = self.mesh.triangles.len();
        self.mesh.positions.extend(partials.iter().map(|p| p.point));
        // A vertex of a patch without area has no normal at all; up is as good as any.
        self.mesh.normals.extend(normals.iter().map(|n| n.unwrap_or(DVec3::Z).to_array()));
        self.origins.extend(u.iter().zip(&v).map(|(&u, &v)| SurfacePoint { patch: patch as u32, u, v }));
        for j in 0..nv {
            for i in 0..nu {
                let a = first_vertex + j * (nu + 1) + i;
                self.add_quad([a, a + 1, a + nu + 2, a + nu + 1]);
            }
        }
        self.mesh.groups.push(Group { name: name.to_owned(), start: first_triangle, end: self.mesh.triangles.len() });
    }

    /// Two triangles over the shorter diagonal; those that collapse (at a pole) are left out.
    fn add_quad(&mut self, [a, b, c, d]: [u32; 4]) {
        let p = |i: u32| DVec3::from_array(self.mesh.positions[i as usize]);
        let triangles =
            if p(a).distance(p(c)) <= p(b).distance(p(d)) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
        for t in triangles {
            let corners = t.map(p);
            if corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0] {
                self.mesh.triangles.push(t);
            }
        }
    }
}

/// Unit normals `du x dv / |du x dv|`; where that vanishes (a pole) the limit from a little inside the patch, and
/// `None` where the patch has no area there either.
///
/// # Errors
/// The surface cannot be evaluated.
pub(super) fn unit_normals(
    instance: &dyn Instance,
    patch: usize,
    u: &[f64],
    v: &[f64],
    partials: &[Partials],
) -> Result<Vec<Option<DVec3>>, EvaluationError> {
    let mut normals: Vec<_> = partials.iter().map(|p| normal(p).map(|n| n.0)).collect();
    for step in [1e-6, 1e-4, 1e-3, 1e-2] {
        let missing: Vec<usize> = (0..normals.len()).filter(|&i| normals[i].is_none()).collect();
        if missing.is_empty() {
            break;
        }
        let inward = |t: f64| t + (0.5 - t) * step;
        let (nu, nv): (Vec<f64>, Vec<f64>) = missing.iter().map(|&i| (inward(u[i]), inward(v[i]))).unzip();
        let mut near = vec![Partials::default(); missing.len()];
        instance.partials(patch, &nu, &nv, &mut near)?;
        for (&i, p) in missing.iter().zip(&near) {
            normals[i] = normal(p).map(|n| n.0);
        }
    }
    Ok(normals)
}

/// The unit normal and the length of `du x dv`, unless the partial derivatives are parallel to rounding.
#[inline]
pub(super) fn normal(p: &Partials) -> Option<(DVec3, f64)> {
    let (du, dv) = (DVec3::from_array(p.du), DVec3::from_array(p.dv));
    let n = du.cross(dv);
    let size = n.length();
    // Rounding of the cross product is some 1e-16 of the product of the lengths; a factor of 1e4 above it the
    // direction is still good to 1e-4. The second bound catches partials that vanish altogether.
    let scale = (du.length_squared() * dv.length_squared()).sqrt();
    (size > 1e-12 * scale && size > 1e-12 && size.is_finite()).then(|| (n * (1.0 / size), size))
}

/// Segments along u and v so that no chord of the grid leaves the surface by more than the tolerance: a chord over a
/// parameter step h deviates by |S_uu| h^2 / 8, where only the part of S_uu across S_u counts (the rest is a matter of
/// parametrisation); and so that no edge is longer than wanted. Sampled on a lattice of interior points.
fn segments(instance: &dyn Instance, patch: usize, fineness: Fineness) -> Result<[u32; 2], EvaluationError> {
    const LATTICE: u32 = 16;
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(LATTICE);
    let (u, v): (Vec<f64>, Vec<f64>) = (0..LATTICE).flat_map(|j| (0..LATTICE).map(move |i| (at(i), at(j)))).unzip();
    let mut samples = vec![SecondPartials::default(); u.len()];
    instance.second_partials(patch, &u, &v, &mut samples)?;
    let length = |d: [f64; 3]| DVec3::from_array(d).length();
    let across = |second: [f64; 3], first: [f64; 3]| {
        let speed = length(first);
        if speed > 0.0 { DVec3::from_array(second).cross(DVec3::from_array(first)).length() / speed } else { 0.0 }
    };
    let count = |curvature: f64, speed: f64| {
        let n = (curvature / (8.0 * fineness.chord)).sqrt().max(speed / fineness.edge).ceil();
        // At least 4: the lattice may miss what happens at an edge. NaN becomes 4.
        (n.max(4.0) as u32).min(fineness.max_segments.max(4))
    };
    let cu = samples.iter().map(|s| across(s.duu, s.first.du)).fold(0.0, f64::max);
    let cv = samples.iter().map(|s| across(s.dvv, s.first.dv)).fold(0.0, f64::max);
    let fastest = |f: fn(&SecondPartials) -> [f64; 3]| samples.iter().map(|s| length(f(s))).fold(0.0, f64::max);
    Ok([count(cu, fastest(|s| s.first.du)), count(cv, fastest(|s| s.first.dv))])
}
