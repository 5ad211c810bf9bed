//! Whether the parts of a model enclose something: how their borders meet.

use super::breaks::Breaks;
use super::tessellation::borders::Borders;
use super::tessellation::intervals;
use super::{EvaluationError, Fineness, Instance, Model, Tessellation};
use glam::DVec3;

/// How the borders of a model's parts meet.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Closedness {
    /// Pieces of border that no other border coincides with.
    pub open: Vec<OpenBorder>,
    /// Parts (patches) whose outer side is the inner one of their neighbours: the fewer ones of those that are joined;
    /// all of them where a model in one piece encloses a negative volume.
    pub inside_out: Vec<usize>,
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

impl Closedness {
    /// Looks at the borders of all parts.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn of(model: &dyn Model, instance: &dyn Instance) -> Result<Self, EvaluationError> {
        let of_patch = |patch| intervals::of_patch(instance, patch, &Breaks::of_patch(instance, patch)?);
        let mut axes = (0..model.parts().len()).map(of_patch).collect::<Result<Vec<_>, _>>()?;
        let borders = Borders::find(instance, &mut axes)?;
        let open = borders.curves().filter(|curve| curve.len() % 2 == 1).map(|curve| {
            let piece = &borders.pieces[curve[0]];
            let length = piece.length(instance, &axes)?;
            Ok(OpenBorder { patch: piece.patch, side: piece.side.name(), length })
        });
        let mut closedness = Self { open: open.collect::<Result<_, _>>()?, inside_out: Vec::new() };
        let mut joints = Joints { neighbours: vec![Vec::new(); axes.len()] };
        for curve in borders.curves().filter(|curve| curve.len() == 2) {
            let [a, b] = [0, 1].map(|k| &borders.pieces[curve[k]]);
            let agree = a.is_counterclockwise() != b.is_counterclockwise();
            joints.neighbours[a.patch].push((b.patch, agree));
            joints.neighbours[b.patch].push((a.patch, agree));
        }
        let components = joints.components();
        for component in &components {
            let turned = component.iter().filter(|(_, turned)| *turned).count();
            let fewer = 2 * turned <= component.len();
            closedness.inside_out.extend(component.iter().filter(|(_, t)| *t == fewer).map(|(patch, _)| *patch));
        }
        if closedness.open.is_empty() && closedness.inside_out.is_empty() && components.len() == 1 {
            let fineness = Fineness { chord: CHORD * borders.diagonal(), ..Fineness::default() };
            if volume(&Tessellation::on_grids(model, instance, fineness)?) < 0.0 {
                closedness.inside_out = (0..axes.len()).collect();
            }
        }
        closedness.inside_out.sort_unstable();
        Ok(closedness)
    }

    /// Whether the parts enclose something.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.open.is_empty()
    }
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

/// The volume that closed triangles enclose, negative where they face inwards. Cubic millimetres.
fn volume(tessellation: &Tessellation) -> f64 {
    let mesh = &tessellation.mesh;
    // About a point of the mesh: far from the origin digits would be lost.
    let origin = mesh.positions.first().map_or(DVec3::ZERO, |p| DVec3::from_array(*p));
    let tetrahedron = |t: &[u32; 3]| {
        let [a, b, c] = mesh.corners(*t).map(|p| p - origin);
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(tetrahedron).sum()
}
