//! Whether the parts of a model enclose something: how their borders meet.

use super::breaks::Breaks;
use super::tessellation::borders::Borders;
use super::tessellation::intervals;
use super::winding::solid_angle;
use super::{EvaluationError, Fineness, Instance, Model, Tessellation};
use crate::mesh::{TriangleMesh, tetrahedron};
use std::collections::HashMap;
use std::f64::consts::PI;

/// How the borders of a model's parts meet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Closedness {
    /// Pieces of border that no other border coincides with.
    pub open: Vec<OpenBorder>,
    /// Parts (patches) whose outer side is the inner one of their neighbours: the fewer ones of those that are joined;
    /// all of them where they are closed and enclose a negative volume, unless they are a cavity in others.
    pub inside_out: Vec<usize>,
    /// Those of them that belong to closed bodies: there the volume says which side is out, whatever is written.
    pub inverted: Vec<usize>,
    /// Nothing is left of the model: all of its parts are trimmed away.
    pub is_empty: bool,
}

/// A piece of border that no other border coincides with.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenBorder {
    /// The patch.
    pub patch: usize,
    /// Where it is: `u = 0`, `u = 1`, `v = 0`, `v = 1`, or where the surface jumps.
    pub side: String,
    /// Its length. Millimetres.
    pub length: f64,
}

/// Chord of the triangles whose volume's sign is asked for, as a fraction of the model's diagonal.
const CHORD: f64 = 0.01;

/// The same of models with trimmed parts, whose triangles also say where the edges of parts meet.
const CHORD_OF_TRIMMED: f64 = 0.001;

impl Closedness {
    /// Looks at the borders of all parts.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn of(model: &dyn Model, instance: &dyn Instance) -> Result<Self, EvaluationError> {
        if model.is_trimmed() {
            return Self::of_trimmed(model, instance);
        }
        let of_patch = |patch| intervals::of_patch(instance, patch, &Breaks::of_patch(instance, patch)?);
        let axes = (0..model.parts().len()).map(of_patch).collect::<Result<Vec<_>, _>>()?;
        let borders = Borders::find(instance, &axes)?;
        let open = open_borders(instance, &borders)?;
        let mut joints = Joints { neighbours: vec![Vec::new(); axes.len()] };
        for curve in borders.curves().filter(|curve| curve.len() == 2) {
            let [a, b] = [0, 1].map(|k| &borders.pieces[curve[k]]);
            let agree = a.is_counterclockwise() != b.is_counterclockwise();
            joints.neighbours[a.patch].push((b.patch, agree));
            joints.neighbours[b.patch].push((a.patch, agree));
        }
        let mesh = || {
            let fineness = Fineness { chord: CHORD * borders.diagonal(), ..Fineness::default() };
            Ok(Tessellation::new(model, instance, fineness)?.mesh)
        };
        Self::of_joints(&joints, open, mesh)
    }

    /// The same of a model with trimmed parts: by the edges of its triangles.
    fn of_trimmed(model: &dyn Model, instance: &dyn Instance) -> Result<Self, EvaluationError> {
        let diagonal = Tessellation::rough_diagonal(model, instance, 8)?;
        let fineness = Fineness { chord: CHORD_OF_TRIMMED * diagonal, ..Fineness::default() };
        let mesh = Tessellation::new(model, instance, fineness)?.mesh;
        let (joints, open) = joined(&mesh);
        let is_empty = mesh.triangles.is_empty();
        Ok(Self { is_empty, ..Self::of_joints(&joints, open, || Ok(mesh))? })
    }

    /// Which parts are inside out, by how they are joined; `mesh` makes triangles whose volume is asked for.
    fn of_joints(
        joints: &Joints,
        open: Vec<OpenBorder>,
        mesh: impl FnOnce() -> Result<TriangleMesh, EvaluationError>,
    ) -> Result<Self, EvaluationError> {
        let mut closedness = Self { open, ..Self::default() };
        let mut closed = Vec::new();
        for component in joints.components() {
            let turned = component.iter().filter(|(_, turned)| *turned).count();
            let fewer = 2 * turned <= component.len();
            let contrary = || component.iter().filter(|(_, t)| *t == fewer).map(|(patch, _)| *patch);
            closedness.inside_out.extend(contrary());
            let has = |patch: usize| component.iter().any(|(of_component, _)| *of_component == patch);
            if closedness.open.iter().any(|open| has(open.patch)) {
                continue;
            }
            closed.push(component);
        }
        if !closed.is_empty() {
            let mesh = mesh()?;
            for (body, outwards) in closed.iter().zip(outwards(&mesh, &closed)) {
                let contrary: Vec<usize> = body.iter().filter(|(_, t)| *t == outwards).map(|(p, _)| *p).collect();
                if contrary.len() == body.len() {
                    closedness.inside_out.extend(&contrary);
                }
                closedness.inverted.extend(contrary);
            }
            closedness.inverted.sort_unstable();
        }
        closedness.inside_out.sort_unstable();
        Ok(closedness)
    }

    /// Whether the parts enclose something.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.open.is_empty() && !self.is_empty
    }
}

/// The pieces that no other one coincides with; those that follow each other along a side are one.
fn open_borders(instance: &dyn Instance, borders: &Borders) -> Result<Vec<OpenBorder>, EvaluationError> {
    let mut open: Vec<OpenBorder> = Vec::new();
    let mut last = None;
    for curve in borders.curves().filter(|curve| curve.len() % 2 == 1) {
        let piece = &borders.pieces[curve[0]];
        let length = piece.length(instance)?;
        let follows = |last: usize| last + 1 == curve[0] && borders.pieces[last].is_on_side_of(piece);
        if let Some(whole) = open.last_mut().filter(|_| last.is_some_and(follows)) {
            whole.length += length;
        } else {
            open.push(OpenBorder { patch: piece.patch, side: piece.side.name(), length });
        }
        last = Some(curve[0]);
    }
    Ok(open)
}

/// How the patches of a mesh meet at the edges of its triangles, and the edges without a neighbour, by patch.
fn joined(mesh: &TriangleMesh) -> (Joints, Vec<OpenBorder>) {
    let number = mesh.position_numbers();
    let mut sides: HashMap<[u32; 2], Vec<(usize, bool)>> = HashMap::new();
    let mut lengths = HashMap::new();
    for (patch, group) in mesh.groups.iter().enumerate() {
        for triangle in &mesh.triangles[group.start..group.end] {
            let corners = mesh.corners(*triangle);
            for k in 0..3 {
                let next = (k + 1) % 3;
                let [a, b] = [triangle[k], triangle[next]].map(|i| number[i as usize]);
                if a != b {
                    let edge = [a.min(b), a.max(b)];
                    sides.entry(edge).or_default().push((patch, a < b));
                    lengths.insert(edge, corners[k].distance(corners[next]));
                }
            }
        }
    }
    let mut joints = Joints { neighbours: vec![Vec::new(); mesh.groups.len()] };
    let mut open = vec![0.0; mesh.groups.len()];
    let mut edges: Vec<_> = sides.into_iter().collect();
    edges.sort_unstable();
    for (edge, of_edge) in edges {
        match of_edge[..] {
            [(a, forth), (b, back)] if a != b => {
                joints.neighbours[a].push((b, forth != back));
                joints.neighbours[b].push((a, forth != back));
            }
            [(patch, _)] => open[patch] += lengths[&edge],
            _ => {}
        }
    }
    joints.neighbours.iter_mut().for_each(|neighbours| {
        neighbours.sort_unstable();
        neighbours.dedup();
    });
    let open = open.into_iter().enumerate().filter(|(_, length)| *length > 0.0);
    let side = || "no other part meets it".to_owned();
    (joints, open.map(|(patch, length)| OpenBorder { patch, side: side(), length }).collect())
}

/// Patches that have a border in common, and whether their outer sides agree along it.
struct Joints {
    neighbours: Vec<Vec<(usize, bool)>>,
}

impl Joints {
    /// Patches that are joined, each with whether it is turned against the first one.
    fn components(&self) -> Vec<Vec<(usize, bool)>> {
        let mut seen = vec![false; self.neighbours.len()];
        let mut components = Vec::new();
        for first in 0..self.neighbours.len() {
            if std::mem::replace(&mut seen[first], true) {
                continue;
            }
            let mut component = vec![(first, false)];
            let mut next = 0;
            while let Some((patch, turned)) = component.get(next).copied() {
                next += 1;
                for (neighbour, agree) in &self.neighbours[patch] {
                    if !std::mem::replace(&mut seen[*neighbour], true) {
                        // Turned as this one is where they agree.
                        component.push((*neighbour, turned == *agree));
                    }
                }
            }
            components.push(component);
        }
        components
    }
}

/// Of closed bodies, by their patches and whether these are turned against the first one, whether the first one's outer
/// side is the body's: whether they enclose a positive volume, or are a cavity in the others.
fn outwards(mesh: &TriangleMesh, bodies: &[Vec<(usize, bool)>]) -> Vec<bool> {
    let triangles = |(patch, turned): &(usize, bool)| {
        let sign = if *turned { -1.0 } else { 1.0 };
        mesh.triangles[mesh.groups[*patch].start..mesh.groups[*patch].end].iter().map(move |t| (t, sign))
    };
    let is_outwards = |(k, body): (usize, &Vec<(usize, bool)>)| {
        let Some((first, _)) = body.iter().flat_map(triangles).next() else { return true };
        // About a point of the body: far from the origin digits would be lost.
        let at = mesh.corners(*first)[0];
        let volume = |(t, sign): (&[u32; 3], f64)| sign * tetrahedron(mesh.corners(*t).map(|p| p - at));
        if body.iter().flat_map(triangles).map(volume).sum::<f64>() >= 0.0 {
            return true;
        }
        let others = bodies.iter().enumerate().filter(|(other, _)| *other != k).flat_map(|(_, other)| other);
        let angle = |(t, _): (&[u32; 3], f64)| solid_angle(mesh.corners(*t).map(|p| p - at));
        let winding = others.flat_map(triangles).map(angle).sum::<f64>() / (4.0 * PI);
        winding >= 0.5
    };
    bodies.iter().enumerate().map(is_outwards).collect()
}
