//! Whether the parts of a model enclose something: how their borders meet.

use super::breaks::Breaks;
use super::joints::{Joints, bodies, joined, pairs};
use super::tessellation::borders::Borders;
use super::tessellation::intervals;
use super::winding::solid_angle;
use super::{EvaluationError, Fineness, Instance, Model, Tessellation};
use crate::mesh::{TriangleMesh, tetrahedron};
use glam::DVec3;
use std::collections::HashSet;
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
    /// Nothing is left of the model: it has no parts, or all of them are trimmed away.
    pub is_empty: bool,
    /// Parts (patches) of which nothing is left, of a model with trimmed ones.
    pub gone: Vec<usize>,
    /// The parts (patches) of bodies whose borders meet, but which enclose nothing, as a cylinder of no height.
    pub flat: Vec<usize>,
}

/// A piece of border that no other border coincides with.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenBorder {
    /// The patch.
    pub patch: usize,
    /// Where it is: `u = 0`, `u = 1`, `v = 0`, `v = 1`, where the surface jumps, or where no other part meets it.
    pub side: String,
    /// Its length. Millimetres.
    pub length: f64,
    /// The middle of the longest of its pieces, of a model with trimmed parts. Millimetres.
    pub at: Option<[f64; 3]>,
    /// The patch of an open border beside it: between the two is a gap.
    pub beside: Option<usize>,
    /// Whether both surfaces have the same tangent plane there: they touch, and which of them is seen is decided by
    /// rounding.
    pub touches: bool,
}

/// Where a mesh is not closed, or does not have one outer side.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    /// Pieces of border that no other border coincides with.
    pub open: Vec<OpenBorder>,
    /// The patches, and the places, at which triangles run against each other although their patches agree.
    pub against: Vec<(usize, [f64; 3])>,
}

impl Faults {
    /// Those of a mesh with normals whose groups are patches.
    #[must_use]
    pub fn of_mesh(mesh: &TriangleMesh) -> Self {
        joined(mesh).1
    }
}

/// Chord of the triangles whose volume's sign is asked for, as a fraction of the model's diagonal.
const CHORD: f64 = 0.01;

/// The same of models with trimmed parts, whose triangles also say where the edges of parts meet.
const CHORD_OF_TRIMMED: f64 = 0.001;

/// The same where that closes gaps that are there: what is open by some of these chords is said.
const CHORD_OF_GAPS: f64 = 1e-4;

/// The same where walls may be thinner than that.
pub(crate) const CHORD_OF_THIN: f64 = 1e-5;

/// The distance from a surface, in chords, of vertices that closed a gap there, from which on the gap may be one of the
/// model and not of its triangles alone. At plain edges it is a millionth of a millimetre, at corners where fillets end
/// up to half a chord, and where two holes overlap by a little as much as they overlap.
const STRETCHED: f64 = 0.1;

impl Closedness {
    /// The parts (patches) of closed bodies whose outer side is the inner one as written: all that is asked of models
    /// that are not shown to anybody. Narrow gaps are not looked for.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn inverted(model: &dyn Model, instance: &dyn Instance) -> Result<Vec<usize>, EvaluationError> {
        if !model.is_trimmed() {
            return Ok(Self::of(model, instance)?.inverted);
        }
        let inverted = Self::of_parts(&Self::tessellation(model, instance)?.mesh)?.inverted;
        if inverted.is_empty() {
            return Ok(inverted);
        }
        Ok(Self::of_finer(model, instance, CHORD_OF_THIN)?.inverted)
    }

    /// Looks at the borders of all parts.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn of(model: &dyn Model, instance: &dyn Instance) -> Result<Self, EvaluationError> {
        if model.is_trimmed() {
            return Self::of_trimmed(model, instance, &Self::tessellation(model, instance)?);
        }
        let of_patch = |patch| intervals::of_patch(instance, patch, &Breaks::of_patch(instance, patch)?);
        let axes = (0..model.parts().len()).map(of_patch).collect::<Result<Vec<_>, _>>()?;
        let borders = Borders::find(instance, &axes)?;
        let open = open_borders(instance, &borders)?;
        let mut joints = Joints::new(axes.len());
        let bodies = bodies(model.parts().iter().map(|part| part.name.as_str()));
        for curve in borders.curves() {
            for pair in pairs(&curve, |piece| bodies[borders.pieces[*piece].patch]) {
                let [a, b] = pair.map(|piece| &borders.pieces[piece]);
                let agree = a.is_counterclockwise() != b.is_counterclockwise();
                joints.add(a.patch, b.patch, agree, 1.0);
            }
        }
        let mesh = || {
            let fineness = Fineness { chord: CHORD * borders.diagonal(), ..Fineness::default() };
            Ok(Tessellation::new(model, instance, fineness)?.mesh)
        };
        Ok(Self { is_empty: axes.is_empty(), ..Self::of_joints(&joints, open, mesh)? })
    }

    /// The same where the triangles of [`Self::tessellation`] are at hand.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn with_tessellation(
        model: &dyn Model,
        instance: &dyn Instance,
        tessellation: &Tessellation,
    ) -> Result<Self, EvaluationError> {
        match model.is_trimmed() {
            true => Self::of_trimmed(model, instance, tessellation),
            false => Self::of(model, instance),
        }
    }

    /// The triangles by which the edges of trimmed parts are looked at.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn tessellation(model: &dyn Model, instance: &dyn Instance) -> Result<Tessellation, EvaluationError> {
        Tessellation::relative(model, instance, CHORD_OF_TRIMMED)
    }

    /// The same of a model with trimmed parts: by the edges of its triangles. Those of thin walls may pass through each
    /// other, so that a body seems to be turned inside out, and gaps as wide as their chord are closed: then finer ones
    /// are asked.
    fn of_trimmed(model: &dyn Model, instance: &dyn Instance, of: &Tessellation) -> Result<Self, EvaluationError> {
        let closedness = Self::of_parts(&of.mesh)?;
        if !closedness.inverted.is_empty() {
            return Self::of_finer(model, instance, CHORD_OF_THIN);
        }
        let is_stretched = of.stretch > STRETCHED * CHORD_OF_TRIMMED * of.mesh.bounds().diagonal();
        if closedness.is_closed() && is_stretched {
            return Self::of_finer(model, instance, CHORD_OF_GAPS);
        }
        Ok(closedness)
    }

    /// The same by triangles of another chord, as a part of the diagonal.
    fn of_finer(model: &dyn Model, instance: &dyn Instance, chord: f64) -> Result<Self, EvaluationError> {
        Self::of_parts(&Tessellation::relative(model, instance, chord)?.mesh)
    }

    /// The same of some parts alone, by the edges of their triangles.
    pub(crate) fn of_parts(mesh: &TriangleMesh) -> Result<Self, EvaluationError> {
        let (joints, Faults { open, .. }) = joined(mesh);
        let is_empty = mesh.triangles.is_empty();
        let gone = (0..).zip(&mesh.groups).filter(|(_, group)| group.start == group.end).map(|(patch, _)| patch);
        let mut closedness =
            Self { is_empty, gone: gone.collect(), ..Self::of_joints(&joints, open, || Ok(mesh.clone()))? };
        closedness.flat.retain(|patch| closedness.gone.binary_search(patch).is_err());
        Ok(closedness)
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
            let (flat, closed): (Vec<_>, Vec<_>) = closed.into_iter().partition(|body| is_flat(&mesh, body));
            for body in flat.iter().filter(|body| !is_between_others(&mesh, body)) {
                closedness.flat.extend(body.iter().map(|(patch, _)| *patch));
            }
            closedness.flat.sort_unstable();
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
        self.open.is_empty() && self.flat.is_empty() && !self.is_empty
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
            let side = piece.side.name();
            open.push(OpenBorder { patch: piece.patch, side, length, at: None, beside: None, touches: false });
        }
        last = Some(curve[0]);
    }
    Ok(open)
}

/// The triangles of a patch of a body, and -1 where they are turned against the body's first patch.
fn triangles_of(mesh: &TriangleMesh, (patch, turned): (usize, bool)) -> impl Iterator<Item = (&[u32; 3], f64)> {
    let sign = if turned { -1.0 } else { 1.0 };
    mesh.triangles[mesh.groups[patch].start..mesh.groups[patch].end].iter().map(move |t| (t, sign))
}

/// The volume of a closed body, positive where its first patch faces outwards, about a point of it: far from the origin
/// digits would be lost.
fn volume_about(mesh: &TriangleMesh, body: &[(usize, bool)], at: DVec3) -> f64 {
    let triangles = body.iter().flat_map(|patch| triangles_of(mesh, *patch));
    triangles.map(|(t, sign)| sign * tetrahedron(mesh.corners(*t).map(|p| p - at))).sum()
}

/// The volume of a closed body for each square millimetre of its area, as a part of its extent, below which it is flat:
/// far above rounding, and far below the thinnest sheet that is meant (a micrometre of ten metres is 1e-7).
const FLAT: f64 = 1e-10;

/// Whether a closed body encloses nothing.
fn is_flat(mesh: &TriangleMesh, body: &[(usize, bool)]) -> bool {
    let triangles = || body.iter().flat_map(|patch| triangles_of(mesh, *patch));
    let Some((first, _)) = triangles().next() else { return true };
    let at = mesh.corners(*first)[0];
    let area: f64 = triangles().map(|(t, _)| mesh.triangle_area(*t)).sum();
    let extent = triangles().flat_map(|(t, _)| mesh.corners(*t)).map(|p| p.distance(at)).fold(0.0, f64::max);
    volume_about(mesh, body, at).abs() <= FLAT * area * extent
}

/// How near to each other vertices of parts are that meet, as a part of the model's diagonal: far above rounding.
const MEETING: f64 = 1e-8;

/// Whether other parts meet along the edges of a flat body: then it is the faces in which two others touch.
fn is_between_others(mesh: &TriangleMesh, body: &[(usize, bool)]) -> bool {
    let cell = (MEETING * mesh.bounds().diagonal()).max(f64::MIN_POSITIVE);
    // Not at round numbers, on both sides of which what is at one place would be in two cells.
    let place = |i: &u32| mesh.positions[*i as usize].map(|x| (x / cell + 0.371_7).floor().to_bits());
    let own: HashSet<[u64; 3]> =
        body.iter().flat_map(|patch| triangles_of(mesh, *patch)).flat_map(|(t, _)| t).map(place).collect();
    let has = |patch: usize| body.iter().any(|(of_body, _)| *of_body == patch);
    let mut others =
        (0..mesh.groups.len()).filter(|patch| !has(*patch)).flat_map(|patch| triangles_of(mesh, (patch, false)));
    others.any(|(t, _)| t.iter().filter(|i| own.contains(&place(i))).count() > 1)
}

/// Of closed bodies, by their patches and whether these are turned against the first one, whether the first one's outer
/// side is the body's: whether they enclose a positive volume, or are a cavity in the others, or in what is open of
/// their own part.
fn outwards(mesh: &TriangleMesh, closed: &[Vec<(usize, bool)>]) -> Vec<bool> {
    let triangles = |patch: (usize, bool)| triangles_of(mesh, patch);
    let part = bodies(mesh.groups.iter().map(|group| group.name.as_str()));
    let is_closed: HashSet<usize> = closed.iter().flatten().map(|(patch, _)| *patch).collect();
    let is_outwards = |(k, body): (usize, &Vec<(usize, bool)>)| {
        let Some((first, _)) = body.iter().copied().flat_map(triangles).next() else { return true };
        let at = mesh.corners(*first)[0];
        if volume_about(mesh, body, at) >= 0.0 {
            return true;
        }
        let others = closed.iter().enumerate().filter(|(other, _)| *other != k).flat_map(|(_, other)| other).copied();
        let own = part[body[0].0];
        let is_open = |patch: &usize| part[*patch] == own && !is_closed.contains(patch);
        let open = (0..part.len()).filter(is_open).map(|patch| (patch, false));
        let angle = |(t, _): (&[u32; 3], f64)| solid_angle(mesh.corners(*t).map(|p| p - at));
        let winding = others.chain(open).flat_map(triangles).map(angle).sum::<f64>() / (4.0 * PI);
        winding >= 0.5
    };
    closed.iter().enumerate().map(is_outwards).collect()
}
