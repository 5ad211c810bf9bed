//! The points of the scan that belong to each part.

use super::Recognised;
use super::UNTURNED;
use super::datum::Datum;
use super::filter::Place;
use crate::bvh::Bvh;
use crate::mesh::TriangleMesh;
use crate::model::Tessellation;
use crate::variance::Deviations;
use crate::variance::cloud::Cloud;
use crate::variance::scanned::Scanned;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// Texels that are looked at for the scan's points: of a texture of 1024 x 1024 every fourth, where a point of the scan
/// has some sixteen.
const LOOKED_AT: usize = 250_000;

/// Texels of each part from which its surface in the model is found.
const EXACT_SAMPLES: usize = 500;

/// A point of the scan, and the place of the part that is nearest to it among those that looked for the scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Member {
    pub(super) point: DVec3,
    pub(super) place: Place,
}

/// The parts with the points of the scan that belong to them.
pub(in crate::variance) struct Members<'d> {
    deviations: &'d Deviations,
    shapes: &'d [Option<Recognised>],
    of_parts: Vec<Vec<Member>>,
    /// By part, its texels.
    texels: Vec<Vec<usize>>,
    surface: &'d Tessellation,
}

impl<'d> Members<'d> {
    /// `shapes` are the forms of the parts, and `surface` is the model's.
    pub(in crate::variance) fn new(
        deviations: &'d Deviations,
        shapes: &'d [Option<Recognised>],
        surface: &'d Tessellation,
        scanned: Scanned<'_>,
    ) -> Self {
        let of_parts = match scanned {
            Scanned::Triangles { mesh, bvh } => of_parts(deviations, shapes.len(), mesh, bvh),
            Scanned::Points { mesh, cloud } => of_cloud(cloud, shapes.len(), mesh),
        };
        let texels = deviations.texels.samples_of_parts(usize::MAX);
        Self { deviations, shapes, of_parts, texels, surface }
    }

    /// The names of the parts.
    pub(super) fn names(&self) -> &'d [String] {
        &self.deviations.texels.part_names
    }

    /// The form of a part.
    pub(super) fn shape(&self, part: usize) -> Option<&'d Recognised> {
        self.shapes.get(part)?.as_ref()
    }

    /// The start of the fit of a part's surface to its points; none for general surfaces of revolution.
    pub(super) fn datum(&self, part: usize) -> Option<Datum> {
        self.shape(part)?.datum()
    }

    /// A part's points with their places.
    pub(super) fn of(&self, part: usize) -> &[Member] {
        &self.of_parts[part]
    }

    /// A part's points.
    pub(super) fn points(&self, part: usize) -> Vec<DVec3> {
        self.of(part).iter().map(|member| member.point).collect()
    }

    /// Points of a part's surface in the model: the middles of all of its texels.
    pub(super) fn surface(&self, part: usize) -> impl Iterator<Item = DVec3> {
        self.texels[part].iter().map(|i| DVec3::from(self.deviations.texels.position[*i]))
    }

    /// Points between which all of a part's surface in the model lies: the middles of its texels, which end half a
    /// texel before it does, and the corners of its triangles.
    pub(super) fn reach(&self, part: usize) -> impl Iterator<Item = DVec3> {
        let corners = self.surface.mesh.positions.iter().zip(&self.surface.origins);
        let of_part = corners.filter(move |(_, origin)| origin.patch as usize == part);
        self.surface(part).chain(of_part.map(|(position, _)| DVec3::from(*position)))
    }

    /// Some of the middles, from which the surface is found.
    pub(super) fn exact(&self, part: usize) -> Vec<DVec3> {
        let step = self.texels[part].len().div_ceil(EXACT_SAMPLES).max(1);
        self.surface(part).step_by(step).collect()
    }
}

/// The points of a cloud by part, whose feet are on it.
fn of_cloud(cloud: Option<&Cloud<'_>>, parts: usize, mesh: &TriangleMesh) -> Vec<Vec<Member>> {
    let member = |(point, position, normal): &(u32, DVec3, DVec3)| Member {
        point: DVec3::from(mesh.positions[*point as usize]),
        place: Place { position: *position, normal: *normal },
    };
    let members = cloud.map_or_else(|| vec![Vec::new(); parts], |cloud| cloud.members(parts));
    members.iter().map(|of_part| of_part.iter().map(member).collect()).collect()
}

/// The scan's points by part: those that are the nearest corner of a triangle that texels of one part see, and none of
/// another. Between points distances are interpolated, along chords of what is curved; the points themselves are not.
fn of_parts(deviations: &Deviations, parts: usize, mesh: &TriangleMesh, bvh: &Bvh) -> Vec<Vec<Member>> {
    let texels = &deviations.texels;
    let step = texels.len().div_ceil(LOOKED_AT).max(1);
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let seen = |i: usize| {
        let along = f64::from(deviations.along(i));
        let place = Place { position: DVec3::from(texels.position[i]), normal: vector(texels.normal[i]) };
        let met = place.displaced(along);
        let triangle = mesh.triangles.get(bvh.closest_point(met, deviations.max_distance)?.triangle as usize)?;
        let at = |vertex: &u32| DVec3::from(mesh.positions[*vertex as usize]);
        let far = |vertex: &u32| at(vertex).distance_squared(met);
        let nearest = triangle.iter().min_by(|a, b| far(a).total_cmp(&far(b)))?;
        // Averaged normals are not the surface's.
        let turned = deviations.cosine.get(i).is_some_and(|c| *c < UNTURNED);
        let aside = (at(nearest) - place.position).reject_from_normalized(place.normal).length();
        Some((*nearest, Candidate { part: texels.part[i], aside: if turned { f64::INFINITY } else { aside }, place }))
    };
    let sees = |i: &usize| !deviations.signed(*i).is_nan() && !deviations.is_bridged(*i);
    let indices: Vec<usize> = (0..texels.len()).step_by(step).filter(sees).collect();
    let seen: Vec<(u32, Candidate)> = indices.into_par_iter().filter_map(seen).collect();
    let mut owners: HashMap<u32, Candidate> = HashMap::new();
    for (vertex, candidate) in seen {
        let owner = owners.entry(vertex).or_insert(candidate);
        if owner.part != candidate.part {
            owner.part = SEVERAL;
        } else if candidate.aside < owner.aside {
            *owner = candidate;
        }
    }
    let mut owned: Vec<(u32, Candidate)> = owners.into_iter().filter(|(_, owner)| owner.part != SEVERAL).collect();
    // The order of sums must not be that of a hash.
    owned.sort_unstable_by_key(|(vertex, _)| *vertex);
    let mut members = vec![Vec::new(); parts];
    for (vertex, owner) in owned {
        if let Some(members) = members.get_mut(owner.part as usize) {
            members.push(Member { point: DVec3::from(mesh.positions[vertex as usize]), place: owner.place });
        }
    }
    members
}

/// The part of vertices that texels of several parts see.
const SEVERAL: u32 = u32::MAX;

/// A texel that sees a vertex.
#[derive(Clone, Copy)]
struct Candidate {
    part: u32,
    /// How far its normal passes the vertex; infinite where that is not the surface's own. Millimetres.
    aside: f64,
    place: Place,
}
