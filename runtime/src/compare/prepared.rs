//! A surface that is ready to be compared: samples, and what distances are measured to.

use super::body::{self, Body};
use super::sampled;
use crate::bvh::Bvh;
use crate::feet::layout::Layout;
use crate::feet::signed::{Place, Target};
use crate::mesh::Bounds;
use crate::model::Standing;
use crate::progress::Progress;
use crate::variance::{Facings, MeasureError, Parametrised, Reference, Resolution, Surface, target, turn};
use glam::DVec3;

/// A surface with its samples.
pub(super) struct Prepared<'a> {
    pub(super) surface: Surface<'a>,
    /// The facets in which feet are searched; none for a mesh.
    layout: Option<Layout>,
    /// The hierarchy over its triangles.
    bvh: Bvh,
    /// Whether the triangles of a mesh were turned so that they face as the model does.
    turned: bool,
}

impl<'a> Prepared<'a> {
    pub(super) fn new(
        reference: Reference<'a>,
        resolution: Resolution,
        progress: &dyn Progress,
    ) -> Result<Self, MeasureError> {
        let mut surface = match reference {
            Reference::Mesh(mesh) => sampled::mesh(mesh, resolution)?,
            Reference::Model { .. } => Surface::new(reference, resolution, None, progress)?,
        };
        if surface.inverted.contains(&true) {
            turn(&mut surface.texels, &mut surface.tessellation.mesh, &surface.inverted);
        }
        let layout = surface.parametrised.as_ref().map(Parametrised::layout);
        let bvh = Bvh::build(&surface.tessellation.mesh).map_err(MeasureError::Surface)?;
        Ok(Self { surface, layout, bvh, turned: false })
    }

    pub(super) fn bounds(&self) -> Bounds {
        self.surface.tessellation.mesh.bounds()
    }

    /// The number of samples.
    pub(super) fn len(&self) -> usize {
        self.surface.texels.len()
    }

    /// The number of triangles that lie about a place of it on average.
    pub(super) fn overlap(&self) -> f64 {
        self.bvh.overlap()
    }

    /// Mean distance between neighbouring samples. Millimetres.
    pub(super) fn spacing(&self) -> f64 {
        self.surface.texels.width_on_the_surface()
    }

    /// The surface to which distances are measured.
    pub(super) fn target(&self) -> Target<'_> {
        let Surface { parametrised, inverted, tessellation, .. } = &self.surface;
        target(parametrised.as_ref().zip(self.layout.as_ref()), inverted, &tessellation.mesh, &self.bvh)
    }

    /// Sentences about this surface, which is called so.
    pub(super) fn notices(&self, name: &str) -> impl Iterator<Item = String> {
        let turned = self
            .turned
            .then(|| format!("{name} faces the other way than the model everywhere: it was turned as a whole"));
        let name = name.to_owned();
        self.surface.notices.iter().map(move |notice| format!("{name}: {notice}")).chain(turned)
    }

    /// Its area and volume.
    pub(super) fn body(&self) -> Result<Body, MeasureError> {
        body::of(self)
    }

    /// The places of the texels, and then of the corners of the triangles, that can be seen, each with its part.
    pub(super) fn places(&self) -> (Vec<Option<Place>>, Vec<(Place, u32)>) {
        let Surface { texels, buried, tessellation, .. } = &self.surface;
        let texel = |i: usize| {
            let normal = DVec3::from_array(texels.normal[i].map(f64::from)).try_normalize();
            let is_seen = !buried.get(i).copied().unwrap_or(false);
            is_seen.then(|| Place { point: texels.position[i].into(), normal })
        };
        let mesh = &tessellation.mesh;
        const UNUSED: u32 = u32::MAX;
        let mut part = vec![UNUSED; mesh.positions.len()];
        for (k, group) in mesh.groups.iter().enumerate() {
            mesh.triangles[group.start..group.end].iter().flatten().for_each(|v| part[*v as usize] = k as u32);
        }
        // Most models have nothing that is buried.
        let model = self.surface.parametrised.as_ref().filter(|_| buried.contains(&true));
        let corner = |(i, part): (usize, u32)| {
            let normal = mesh.normals.get(i).and_then(|n| DVec3::from(*n).try_normalize());
            let place = Place { point: mesh.positions[i].into(), normal };
            (!model.is_some_and(|model| self.is_buried(model, &place, part))).then_some((place, part))
        };
        let corners = part.into_iter().enumerate().filter(|(_, part)| *part != UNUSED).filter_map(corner).collect();
        ((0..texels.len()).map(texel).collect(), corners)
    }

    /// Whether a place of the model's surface lies in its own material.
    fn is_buried(&self, model: &Parametrised<'_>, place: &Place, part: u32) -> bool {
        let Some(normal) = place.normal else { return false };
        let sign = if self.surface.inverted[part as usize] { -1.0 } else { 1.0 };
        let back = model.motion().inverse();
        let (point, normal) = (back.point(place.point.into()), back.direction((sign * normal).into()));
        model.material().at(part as usize, point.into(), normal.into()) == Standing::Buried
    }
}

/// Turns a mesh that faces the other way than the model all over.
pub(super) fn turn_alike(sides: &mut [Prepared<'_>; 2], max_distance: f64) -> Result<(), MeasureError> {
    let [a, b] = sides;
    let (model, mesh) = match (&a.surface.parametrised, &b.surface.parametrised) {
        (Some(_), None) => (a, b),
        (None, Some(_)) => (b, a),
        _ => return Ok(()),
    };
    let triangles = &mesh.surface.tessellation.mesh;
    if Facings::of(&model.surface.texels, triangles, &mesh.bvh, max_distance).reversed {
        let all = vec![true; mesh.surface.inverted.len()];
        turn(&mut mesh.surface.texels, &mut mesh.surface.tessellation.mesh, &all);
        mesh.bvh = Bvh::build(&mesh.surface.tessellation.mesh).map_err(MeasureError::Surface)?;
        mesh.turned = true;
    }
    Ok(())
}
