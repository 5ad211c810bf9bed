//! Walls of a model that pass through each other, as the inside of a mug does that comes out through its foot.

use super::{Closedness, EvaluationError, Instance, Material, Model, Standing, Tessellation, Winding};
use crate::mesh::TriangleMesh;
use crate::sampling::{halton, in_triangle};
use glam::DVec3;
use rayon::prelude::*;

/// The share of a model's area that has passed through a wall from which on it is worth a sentence.
const WORTH_A_SENTENCE: f64 = 1e-3;

/// Places on a mesh that are looked at: four of them are the share above, and one of a first look at fewer, which is
/// the only one where it finds none.
const PLACES: usize = 4000;
const FIRST: usize = 4;

/// Triangles up to which a mesh is looked at as it is. Those of a finer one are needles where the object is long: all
/// of a few rings lie about each place. A tube of 440,000 took 20 s, and a second by those of its material.
const MOST_TRIANGLES: usize = 100_000;

/// Triangles of a rough tessellation (its chord a thousandth of the diagonal) up to which a finer one is made, which
/// shows walls that pass by a thousandth of the diagonal and not only by some eight. A plate with a hundred holes has
/// twice as many, and would wait for seconds.
const MOST_ROUGH: usize = 10_000;

/// Surface that has passed through another wall of its model, as much as is worth a sentence.
#[derive(Clone, Debug, PartialEq)]
pub struct Passages {
    /// By part that has some, its name and the area. Square millimetres.
    pub parts: Vec<(String, f64)>,
    /// One place of it.
    pub place: [f64; 3],
}

/// A place of the surface.
struct Place {
    patch: usize,
    point: DVec3,
    normal: DVec3,
}

impl Passages {
    /// Of places that are spread over the surface of parts with these `names`: the part of each, its area, where it
    /// is, and how it stands. None where it is not worth a sentence.
    pub(crate) fn of(names: &[String], places: impl Iterator<Item = (usize, f64, [f64; 3], Standing)>) -> Option<Self> {
        let (mut whole, mut areas, mut passed) = (0.0, vec![0.0; names.len()], Vec::new());
        for (part, area, place, standing) in places {
            whole += area;
            if standing == Standing::PassedThrough {
                areas[part] += area;
                passed.push(place);
            }
        }
        if !(areas.iter().sum::<f64>() > WORTH_A_SENTENCE * whole) {
            return None;
        }
        let parts = names.iter().cloned().zip(areas).filter(|(_, area)| *area > 0.0).collect();
        // The middle of a ring would be none of its places.
        Some(Self { parts, place: passed[passed.len() / 2] })
    }

    /// The passages of a model with a rough tessellation: of what has few triangles by finer ones.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn with_tessellation(
        model: &dyn Model,
        instance: &dyn Instance,
        rough: &Tessellation,
    ) -> Result<Option<Self>, EvaluationError> {
        if rough.mesh.triangles.len() > MOST_ROUGH {
            return Self::of_tessellation(rough, model, instance);
        }
        Self::shown_by(&of_material(rough, model, instance)?, model, instance)
    }

    /// The passages that a model's triangles show.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn of_tessellation(
        tessellation: &Tessellation,
        model: &dyn Model,
        instance: &dyn Instance,
    ) -> Result<Option<Self>, EvaluationError> {
        let coarser =
            (tessellation.mesh.triangles.len() > MOST_TRIANGLES).then(|| of_material(tessellation, model, instance));
        Self::shown_by(coarser.transpose()?.as_ref().unwrap_or(tessellation), model, instance)
    }

    /// The same of triangles as they are.
    fn shown_by(
        tessellation: &Tessellation,
        model: &dyn Model,
        instance: &dyn Instance,
    ) -> Result<Option<Self>, EvaluationError> {
        let mesh = &tessellation.mesh;
        let (places, each) = places(mesh);
        let scale = Material::scale(mesh.bounds().diagonal(), tessellation.chord);
        // This look is coarse, and quicker than to find what is joined with what.
        let winding = Winding::new(mesh.triangles.iter().map(|t| mesh.corners(*t)).collect());
        let seems = |p: &Place| Material::seems_passed(&winding, p.point, p.normal, scale);
        if !places.par_iter().step_by(FIRST).any(seems) {
            return Ok(None);
        }
        let inverted = Closedness::inverted(model, instance)?;
        let material = Material::of_mesh(mesh, &inverted, scale);
        let at = |p: &Place| material.at(p.patch, p.point, p.normal);
        let mut standing: Vec<Standing> = places.par_iter().map(at).collect();
        material.settle(places.iter().map(|p| (p.patch, each)), &mut standing);
        let names: Vec<String> = mesh.groups.iter().map(|group| group.name.clone()).collect();
        let found = places.iter().zip(standing).map(|(p, standing)| (p.patch, each, p.point.to_array(), standing));
        Ok(Self::of(&names, found))
    }

    /// A sentence for the user.
    #[must_use]
    pub fn sentence(&self) -> String {
        let parts: Vec<String> = self.parts.iter().map(|(name, area)| format!("{area:.0} mm2 of `{name}`")).collect();
        let [x, y, z] = self.place;
        format!(
            "walls of the model pass through each other: {}, one place of it ({x:.1}, {y:.1}, {z:.1}) mm",
            parts.join(", ")
        )
    }
}

/// The triangles by which the material of a model with a tessellation is told.
fn of_material(
    tessellation: &Tessellation,
    model: &dyn Model,
    instance: &dyn Instance,
) -> Result<Tessellation, EvaluationError> {
    Tessellation::new(model, instance, Material::fineness(tessellation.mesh.bounds().diagonal()))
}

/// Places spread over a mesh by its area, and the area that each stands for.
fn places(mesh: &TriangleMesh) -> (Vec<Place>, f64) {
    let mut reached = 0.0;
    let of_group = |(patch, start, end): (usize, usize, usize)| (start..end).map(move |triangle| (patch, triangle));
    let groups = mesh.groups.iter().enumerate().map(|(patch, group)| (patch, group.start, group.end));
    let triangles: Vec<(usize, usize, f64)> = groups
        .flat_map(of_group)
        .map(|(patch, triangle)| {
            reached += mesh.triangle_area(mesh.triangles[triangle]);
            (patch, triangle, reached)
        })
        .collect();
    let each = reached / PLACES as f64;
    let place = |k: usize| {
        let area = (k as f64 + 0.5) * each;
        let (patch, triangle, _) = *triangles.get(triangles.partition_point(|(_, _, reached)| *reached < area))?;
        let [a, b, c] = mesh.corners(mesh.triangles[triangle]);
        let (s, t) = in_triangle(halton(k + 1, 0), halton(k + 1, 1));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Some(Place { patch, point: a + s * (b - a) + t * (c - a), normal })
    };
    ((0..PLACES).filter_map(place).collect(), each)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Fineness, Motion};
    use gml_compiler::program::{Options, compile};
    use gml_compiler::source::{NoFiles, SourceFile};

    fn passages(text: &str, chord: f64, motion: &Motion) -> Option<Passages> {
        let script = SourceFile { name: "m.gml".to_owned(), text: text.to_owned() };
        let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
        let instance = Model::instantiate(&program, &[]).unwrap();
        let fineness = Fineness { chord, ..Fineness::default() };
        let mut tessellation = Tessellation::new(&program, &*instance, fineness).unwrap();
        motion.move_tessellation(&mut tessellation);
        Passages::of_tessellation(&tessellation, &program, &*instance).unwrap()
    }

    /// A closed vessel whose inner side reaches from `floor` to 50 mm.
    fn vessel(floor: f64) -> String {
        format!(
            "use std.surface (cylinder, disc, flip, revolve)
            use std.frame (translate)
            model m {{
              part outside = cylinder(30mm, 60mm)
              part foot = flip(disc(30mm))
              part rim = revolve(|t| (mix(30mm, 27mm, t), 60mm))
              part inside = flip(cylinder(27mm, {}mm)).translate((0mm, 0mm, {floor}mm))
              part floor = disc(27mm).translate((0mm, 0mm, {floor}mm))
            }}",
            60.0 - floor
        )
    }

    #[test]
    fn a_floor_below_the_foot_has_passed_through_it() {
        let away = Motion { translation: [100.0, 0.0, 0.0], ..Motion::IDENTITY };
        for chord in [0.02, 0.5] {
            assert_eq!(passages(&vessel(3.0), chord, &Motion::IDENTITY), None);
            let found = passages(&vessel(-4.0), chord, &away).expect("a floor beyond the foot");
            let area = |name: &str| found.parts.iter().find(|(part, _)| part == name).map_or(0.0, |(_, area)| *area);
            // The disc, and 4 mm of the cylinder above it; what the foot has within them.
            let disc = std::f64::consts::PI * 27.0 * 27.0;
            for (name, expected) in [("floor", disc), ("foot", disc), ("inside", disc * 8.0 / 27.0)] {
                // Hardly a hundred places are on the smallest.
                let most = if name == "inside" { 0.2 } else { 0.05 };
                assert!((area(name) / expected - 1.0).abs() < most, "{name}: {}, not {expected}", area(name));
            }
            assert_eq!((area("outside"), area("rim")), (0.0, 0.0));
            let [x, y, z] = found.place;
            assert!((x - 100.0).hypot(y) < 27.5 && (-4.5..0.5).contains(&z), "{:?}", found.place);
        }
    }

    #[test]
    fn a_hollow_and_a_handle_have_passed_through_nothing() {
        let hollow = "use std.surface (sphere, flip)\n model m { part inside = flip(sphere(20mm)) }";
        assert_eq!(passages(hollow, 0.02, &Motion::IDENTITY), None);
        let handle = "use std.solid (box)
            use std.surface (tube)
            use std.curve (bezier)
            model m {
              part plate = box(width: 60mm, depth: 60mm, height: 10mm)
              part handle = tube(bezier([(-15mm, 0mm, 6mm), (-15mm, 0mm, 40mm), (15mm, 0mm, 40mm), (15mm, 0mm, 6mm)]), radius: 3mm)
            }";
        assert_eq!(passages(handle, 0.02, &Motion::IDENTITY), None);
    }
}
