//! Walls of the model that have passed through each other: the inside of a vessel that comes out through its foot.

use super::coverage::{Places, across, all_places};
use super::isometry::Isometry;
use crate::bvh::Bvh;
use crate::fit::correspond::facets::Facets;
use crate::fit::result::PassedPart;
use crate::fit::tuning::{PASSED_THROUGH, PLACES_EACH_WAY, WALL_PLACES};
use crate::mesh::{Bounds, TriangleMesh};
use crate::model::{Closedness, EvaluationError, Instance, Material, Model, Partials, Standing, Tessellation, Winding};
use crate::sampling::cell_centres;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// The surface of a model, its division fixed, and places spread evenly over it.
pub(crate) struct Walls {
    tessellation: Tessellation,
    material: Material,
    places: Vec<Places>,
    /// The area of all places. Square millimetres.
    pub(crate) area: f64,
}

/// A place that has passed through another wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passage {
    pub(crate) site: Site,
    pub(crate) point: DVec3,
    /// Square millimetres.
    pub(crate) area: f64,
    /// How far it stands beyond the other wall, at right angles to that, less the depth from which on that counts.
    pub(crate) depth: f64,
    /// Its unit outward normal.
    pub(crate) normal: DVec3,
    /// Where the normal meets the other wall, and the unit outward normal there; None where it meets none.
    pub(crate) through: Option<(Site, DVec3)>,
}

/// A point of a patch.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Site {
    pub(crate) patch: usize,
    pub(crate) uv: [f64; 2],
}

/// Whether walls seem to pass through each other, by a look that is coarse but sees no less than is worth a sentence.
pub(crate) fn seem_to_pass(facets: &Facets) -> bool {
    let Some(diagonal) = facets.bounds().map(|bounds| bounds.diagonal()) else { return false };
    let quads: Vec<[DVec3; 4]> = facets.quads().collect();
    let winding = Winding::new(quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect());
    let across = |[a, b, c, d]: &[DVec3; 4]| 0.5 * (*c - *a).cross(*d - *b);
    let whole: f64 = quads.iter().map(|quad| across(quad).length()).sum();
    let spacing = (whole / WALL_PLACES).sqrt();
    let passed = |quad: &[DVec3; 4]| {
        let [a, b, c, d] = *quad;
        let normal = across(quad);
        let cells = [a.distance(b).max(d.distance(c)), a.distance(d).max(b.distance(c))];
        let [u, v] = cell_centres(cells.map(|side| ((side / spacing).ceil() as usize).clamp(1, PLACES_EACH_WAY)));
        let place = |(u, v): (&f64, &f64)| a.lerp(b, *u).lerp(d.lerp(c, *u), *v);
        let places = u.iter().zip(&v).map(place);
        let passed = places.filter(|p| Material::seems_passed(&winding, *p, normal.normalize_or_zero(), diagonal));
        normal.length() * passed.count() as f64 / u.len() as f64
    };
    let passed: f64 = quads.par_iter().map(passed).collect::<Vec<f64>>().iter().sum();
    // A model that is a hollow as a whole has passed through nothing.
    passed > PASSED_THROUGH * whole && passed < 0.5 * whole
}

impl Walls {
    /// The walls of a model as it is divided at an instance.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub(crate) fn of(model: &dyn Model, instance: &dyn Instance) -> Result<Self, EvaluationError> {
        let places = all_places(model, instance);
        let diagonal = Points::of(instance, &places).map_or(0.0, |points| points.diagonal());
        let tessellation = Tessellation::new(model, instance, Material::fineness(diagonal))?;
        let material = Material::of_mesh(&tessellation.mesh, &Closedness::inverted(model, instance)?, diagonal);
        let area = places.iter().flat_map(|p| &p.area).sum();
        Ok(Self { tessellation, material, places, area })
    }

    /// The places that have passed through a wall. None where the surface cannot be evaluated.
    pub(crate) fn passages(&self, instance: &dyn Instance) -> Option<Vec<Passage>> {
        let mesh = self.mesh(instance)?;
        let material = self.material.moved(&mesh);
        let points = Points::of(instance, &self.places)?;
        let standing = points.standing(&self.places, &material);
        let sites = self.places.iter().flat_map(|places| {
            let site = |(u, v): (&f64, &f64)| Site { patch: places.patch, uv: [*u, *v] };
            places.u.iter().zip(&places.v).map(site).zip(&places.area)
        });
        let passed: Vec<Passage> = sites
            .zip(&points.partials)
            .zip(standing)
            .filter(|(_, standing)| *standing == Standing::PassedThrough)
            .map(|(((site, area), p), _)| Passage {
                site,
                area: *area,
                point: DVec3::from_array(p.point),
                normal: material.outward(site.patch, across(p).normalize_or_zero()),
                depth: 0.0,
                through: None,
            })
            .collect();
        if passed.is_empty() {
            return Some(passed);
        }
        let bvh = Bvh::build(&mesh).ok()?;
        Some(passed.into_par_iter().map(|passage| self.through(passage, &mesh, &bvh, &material)).collect())
    }

    /// The parts that have passed through walls far enough to be worth a sentence, with places moved by `motion`.
    /// Nothing where the surface cannot be evaluated.
    pub(crate) fn passed(&self, model: &dyn Model, instance: &dyn Instance, motion: &Isometry) -> Vec<PassedPart> {
        let mut passages = self.passages(instance).unwrap_or_default();
        passages.retain(|passage| passage.depth + self.material.depth() > self.material.passage());
        let name = |patch: usize| model.parts()[patch].name.clone();
        let part = |of_part: &[Passage]| {
            let deepest = of_part.iter().max_by(|a, b| a.depth.total_cmp(&b.depth)).copied();
            let patches: BTreeSet<usize> = of_part.iter().flat_map(|p| p.through).map(|(site, _)| site.patch).collect();
            PassedPart {
                part: name(of_part[0].site.patch),
                through: patches.into_iter().map(name).collect(),
                area: of_part.iter().map(|passage| passage.area).sum(),
                depth: deepest.map_or(0.0, |passage| passage.depth + self.material.depth()),
                place: motion.apply(deepest.map_or(DVec3::ZERO, |passage| passage.point)).to_array(),
            }
        };
        passages.chunk_by(|a, b| a.site.patch == b.site.patch).map(part).collect()
    }

    /// A passage with the wall through which it leads.
    fn through(&self, passage: Passage, mesh: &TriangleMesh, bvh: &Bvh, material: &Material) -> Passage {
        let from = passage.point + material.depth() * passage.normal;
        let Some(hit) = bvh.nearest_hit(from, passage.normal, f64::INFINITY) else { return passage };
        let triangle = mesh.triangles[hit.triangle as usize];
        let [a, b, c] = mesh.corners(triangle);
        let across = (b - a).cross(c - a);
        let at = from + hit.t * passage.normal;
        let twice = across.length_squared().max(f64::MIN_POSITIVE);
        let parts =
            [(c - b).cross(at - b), (a - c).cross(at - c), (b - a).cross(at - a)].map(|p| p.dot(across) / twice);
        let origins = triangle.map(|vertex| self.tessellation.origins[vertex as usize]);
        let mean = |of: [f64; 3]| (0..3).map(|k| parts[k] * of[k]).sum::<f64>().clamp(0.0, 1.0);
        let patch = origins[0].patch as usize;
        let site = Site { patch, uv: [mean(origins.map(|o| o.u)), mean(origins.map(|o| o.v))] };
        let normal = material.outward(patch, across.normalize_or_zero());
        Passage { depth: hit.t * normal.dot(passage.normal).abs(), through: Some((site, normal)), ..passage }
    }

    /// The triangles as an instance has them.
    fn mesh(&self, instance: &dyn Instance) -> Option<TriangleMesh> {
        let Tessellation { mesh, origins, .. } = &self.tessellation;
        let mut positions = vec![[0.0; 3]; origins.len()];
        let mut first = 0;
        for of_patch in origins.chunk_by(|a, b| a.patch == b.patch) {
            let (u, v): (Vec<f64>, Vec<f64>) = of_patch.iter().map(|o| (o.u, o.v)).unzip();
            let next = first + of_patch.len();
            instance.points(of_patch[0].patch as usize, &u, &v, &mut positions[first..next]).ok()?;
            first = next;
        }
        let (triangles, groups) = (mesh.triangles.clone(), mesh.groups.clone());
        Some(TriangleMesh { positions, triangles, groups, ..TriangleMesh::default() })
    }
}

/// The points of places.
struct Points {
    partials: Vec<Partials>,
}

impl Points {
    /// None where the surface cannot be evaluated.
    fn of(instance: &dyn Instance, places: &[Places]) -> Option<Self> {
        let mut partials = vec![Partials::default(); places.iter().map(|p| p.u.len()).sum()];
        let mut rest = partials.as_mut_slice();
        for of_patch in places {
            let (here, next) = rest.split_at_mut(of_patch.u.len());
            instance.partials(of_patch.patch, &of_patch.u, &of_patch.v, here).ok()?;
            rest = next;
        }
        Some(Self { partials })
    }

    fn diagonal(&self) -> f64 {
        self.partials.iter().map(|p| DVec3::from_array(p.point)).collect::<Bounds>().diagonal()
    }

    /// How they stand.
    fn standing(&self, places: &[Places], material: &Material) -> Vec<Standing> {
        let patches: Vec<usize> = places.iter().flat_map(|p| p.u.iter().map(|_| p.patch)).collect();
        let at = |(patch, p): (&usize, &Partials)| {
            material.at(*patch, DVec3::from_array(p.point), across(p).normalize_or_zero())
        };
        let mut standing: Vec<Standing> = patches.par_iter().zip(&self.partials).map(at).collect();
        let areas = places.iter().flat_map(|p| &p.area).copied();
        material.settle(patches.iter().copied().zip(areas), &mut standing);
        standing
    }
}

/// Words for what has passed through walls: the areas of the parts, the largest depth, and the place of that.
pub(crate) fn described(passed: &[PassedPart]) -> String {
    let parts: Vec<String> = passed.iter().map(|p| format!("{:.0} mm2 of `{}`", p.area, p.part)).collect();
    let deepest = passed.iter().max_by(|a, b| a.depth.total_cmp(&b.depth));
    let place = deepest.map_or(String::new(), |PassedPart { depth, place: [x, y, z], .. }| {
        format!(", by up to {depth:.2} mm at ({x:.1}, {y:.1}, {z:.1}) mm")
    });
    parts.join(", ") + &place
}
