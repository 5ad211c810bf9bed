//! Corners of the edge of a trimmed patch: where two solids cut one surface at a time.

use super::refine::{Points, Refinement};
use super::{SurfacePoint, unit_normals};
use crate::model::{EvaluationError, Partials};
use glam::{DVec2, DVec3};

/// How much nearer to a corner its two sides are looked at in every step, and how many steps there are.
const NEARER: f64 = 0.1;
const STEPS: usize = 6;
/// Newton's steps onto a side.
const ONTO: usize = 4;
/// The value of the function at the places on its sides, in millimetres: of a part of what `trim` takes for zero.
const POSITIVE: f64 = 0.5 * super::stand::ZERO;
/// The sine of the angle between the sides below which there is no corner: a smooth edge looks straight from near.
const LEAST_SINE: f64 = 0.05;
/// A corner so near to a side of its triangle, in barycentric coordinates, is left to the division of that.
const MARGIN: f64 = 1e-3;

/// A trimmed patch's function on a triangle, by two of its barycentric coordinates.
struct Chart {
    keep: usize,
    origin: DVec2,
    /// What one unit of the second and of the third coordinate is in (u, v).
    axes: [DVec2; 2],
}

impl Chart {
    fn uv(&self, at: DVec2) -> DVec2 {
        (self.origin + self.axes[0] * at.x + self.axes[1] * at.y).clamp(DVec2::ZERO, DVec2::ONE)
    }
}

impl Refinement<'_> {
    /// The corner of the edge within a triangle that crosses two of its sides at given places, if it has one: in
    /// barycentric coordinates.
    pub(super) fn corner(
        &self,
        triangle: usize,
        keep: usize,
        crossings: [[f64; 3]; 2],
    ) -> Result<Option<[f64; 3]>, EvaluationError> {
        let corners = self.mesh.triangles[triangle].map(|i| self.origins[i as usize]);
        if corners.iter().any(|c| self.pole(c).is_some()) {
            return Ok(None);
        }
        let [a, b, c] = corners.map(|c| DVec2::new(c.u, c.v));
        let chart = Chart { keep, origin: a, axes: [b - a, c - a] };
        let mut sides = crossings.map(|w| DVec2::new(w[1], w[2]));
        let mut corner = None;
        for _ in 0..STEPS {
            let mut gradients = [DVec2::ZERO; 2];
            for (side, gradient) in sides.iter_mut().zip(&mut gradients) {
                (*side, *gradient) = self.onto(&chart, *side)?;
            }
            let Some(meet) = intersection(sides, gradients) else { return Ok(None) };
            corner = Some(meet);
            sides = sides.map(|side| meet + NEARER * (side - meet));
        }
        let inside = |p: &DVec2| p.x > MARGIN && p.y > MARGIN && 1.0 - p.x - p.y > MARGIN;
        Ok(corner.filter(inside).map(|p| [1.0 - p.x - p.y, p.x, p.y]))
    }

    /// The place next to one where the function is just positive, and its gradient there.
    fn onto(&self, chart: &Chart, mut at: DVec2) -> Result<(DVec2, DVec2), EvaluationError> {
        let mut gradient = DVec2::ZERO;
        for _ in 0..ONTO {
            let uv = chart.uv(at);
            let mut partials = [Partials::default()];
            self.instance.partials(chart.keep, &[uv.x], &[uv.y], &mut partials)?;
            let [value, du, dv] = [partials[0].point[0], partials[0].du[0], partials[0].dv[0]];
            let here = DVec2::from_array(chart.axes.map(|axis| du * axis.x + dv * axis.y));
            // Where two solids coincide the function is flat on the other side of its zero.
            if here.length_squared() > 0.0 {
                gradient = here;
            }
            let step = gradient * ((value - POSITIVE) / gradient.length_squared());
            if (value - POSITIVE).abs() < 0.5 * POSITIVE || !step.is_finite() || step.length() > 1.0 {
                break;
            }
            at -= step;
        }
        Ok((at, gradient))
    }

    /// Puts a vertex into a triangle.
    pub(super) fn insert(
        &mut self,
        points: &mut Points,
        triangle: usize,
        weights: [f64; 3],
    ) -> Result<[usize; 3], EvaluationError> {
        let corners = self.mesh.triangles[triangle];
        let patch = self.patches[triangle];
        let (u, v) = self.uv(triangle)(weights);
        let partials = self.partials(SurfacePoint { patch, u, v })?;
        let normal = unit_normals(self.instance, patch as usize, &[u], &[v], &[partials])?;
        let new = self.mesh.positions.len() as u32;
        self.mesh.positions.push(partials.point);
        self.mesh.normals.push(normal[0].unwrap_or(DVec3::Z).to_array());
        self.origins.push(SurfacePoint { patch, u, v });
        let number = points.add();
        points.of_vertex.push(number);
        let [a, b, c] = corners;
        self.mesh.triangles[triangle] = [a, b, new];
        let first = self.mesh.triangles.len();
        self.mesh.triangles.extend([[b, c, new], [c, a, new]]);
        self.patches.extend([patch; 2]);
        Ok([triangle, first, first + 1])
    }
}

/// Where two lines meet that go through points at right angles to gradients.
fn intersection([p, q]: [DVec2; 2], [g, h]: [DVec2; 2]) -> Option<DVec2> {
    let (g, h) = (g.normalize_or_zero(), h.normalize_or_zero());
    let sine = g.perp_dot(h);
    if !(sine.abs() > LEAST_SINE) {
        return None;
    }
    let (a, b) = (g.dot(p), h.dot(q));
    Some(DVec2::new(a * h.y - b * g.y, b * g.x - a * h.x) / sine)
}
