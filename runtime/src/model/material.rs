//! What is inside of a model: the material behind its surface, and how the surface itself stands to it.

use super::ends::{End, Ends};
use super::winding::Winding;
use super::{Closedness, EvaluationError, Fineness, Instance, Model, Tessellation, Texels};
use crate::mesh::TriangleMesh;
use glam::DVec3;

/// How deep surface must lie in the material, or beyond a wall that it has passed through, to be told from surface
/// that touches it: as a fraction of the model's diagonal. A crevice that is narrower counts as closed.
const DEPTH: f64 = 2.5e-4;

/// The same of surface that has passed through a wall, in units of it: a fit that holds walls apart leaves them in
/// each other by a little more than the depth.
const PASSAGE: f64 = 4.0;

/// The chord of the triangles, as a part of that depth: together they leave two surfaces that touch by less.
const CHORD: f64 = 0.5;

/// The longest edge of the triangles, as a fraction of the diagonal: long ones are far from nothing, so that many of
/// them would be looked at one by one. A mug takes 2.5 times as long without it.
const EDGE: f64 = 0.04;

/// Winding numbers beside the outer side of a surface. That of a closed body is 0 where it is free, 1 where it is in
/// the material of another one, and -1 where it has passed through a wall of its own; that of a sheet is less by a
/// half.
const BURIED: f64 = 0.25;
const INWARD: f64 = -0.25;
const PASSED_THROUGH: f64 = -0.75;

/// The share of the area of joined parts that must stand as that of a body does for the rest to have passed through a
/// wall: what is a hollow as a whole, such as the inside of a bowl without its outside, has passed through nothing.
const BODY: f64 = 0.5;

/// Segments of the grids whose box is the model's.
const ROUGH: u32 = 32;

/// Texels of every row and column that are looked at, in turn.
const STRIDES: [u32; 3] = [8, 2, 1];

/// The material of a model: where the winding number of its parts is more than that of a free surface. Open ends that
/// lie in the material, as those of a tube that ends in a wall, count as closed; other parts need not be.
#[derive(Clone, Debug)]
pub struct Material {
    winding: Winding,
    /// What closes open ends.
    caps: Winding,
    /// By patch, whether its outer side is the other one than written.
    turned: Vec<bool>,
    /// By patch, the first of those that it is joined with.
    joined: Vec<usize>,
    /// How deep surface lies that is buried, or that has passed through a wall for the first time. Millimetres.
    depth: f64,
    /// How deep it lies where that is worth a sentence. Millimetres.
    passage: f64,
}

/// How a place of the surface stands to the material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// Its outer side is free.
    Free,
    /// Its outer side is inside of material, as that of a handle's end in a wall.
    Buried,
    /// Its outer side faces into a hollow, as that of a bowl's inside does that has no outside.
    Inward,
    /// It has passed through another wall of its body, or that through it.
    PassedThrough,
}

impl Material {
    /// The material of a model.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn new(model: &dyn Model, instance: &dyn Instance) -> Result<Self, EvaluationError> {
        let inverted = Closedness::inverted(model, instance)?;
        let diagonal = Tessellation::rough_diagonal(model, instance, ROUGH)?;
        Self::of(model, instance, &inverted, diagonal)
    }

    /// The material of a model. `inverted` are the patches of closed bodies whose outer side is the other one than
    /// written (see [`Closedness`]), `diagonal` is that of the model's bounding box. Millimetres.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub(crate) fn of(
        model: &dyn Model,
        instance: &dyn Instance,
        inverted: &[usize],
        diagonal: f64,
    ) -> Result<Self, EvaluationError> {
        let mesh = Tessellation::new(model, instance, Self::fineness(diagonal))?.mesh;
        Ok(Self::of_mesh(&mesh, inverted, diagonal))
    }

    /// The fineness of the triangles of a model with a diagonal: as coarse as can be of one of which nothing is left.
    /// Millimetres.
    pub(crate) fn fineness(diagonal: f64) -> Fineness {
        if diagonal == 0.0 {
            return Fineness { chord: f64::INFINITY, ..Fineness::default() };
        }
        Fineness { chord: CHORD * DEPTH * diagonal, edge: EDGE * diagonal, ..Fineness::default() }
    }

    /// The diagonal to name for triangles that leave the surface by up to a chord: it is larger than theirs where only
    /// what lies deeper can be told. Millimetres.
    pub(crate) fn scale(diagonal: f64, chord: f64) -> f64 {
        diagonal.max(chord / (CHORD * DEPTH))
    }

    /// Whether a place with an outward unit normal seems to have passed through a wall of the triangles, of which
    /// nothing else is known, far enough to be worth a sentence; `diagonal` is that of their bounding box.
    /// Millimetres.
    pub(crate) fn seems_passed(winding: &Winding, place: DVec3, outward: DVec3, diagonal: f64) -> bool {
        winding.at(place + PASSAGE * DEPTH * diagonal * outward) < PASSED_THROUGH
    }

    /// The material of a mesh with a group for every patch.
    pub(crate) fn of_mesh(mesh: &TriangleMesh, inverted: &[usize], diagonal: f64) -> Self {
        let turned: Vec<bool> = (0..mesh.groups.len()).map(|patch| inverted.contains(&patch)).collect();
        let (winding, Ends { joined, ends }) = rayon::join(|| winding(mesh, &turned), || Ends::of(mesh, &turned));
        let is_closed: Vec<bool> = ends.iter().map(|end| end.is_in_material(&winding)).collect();
        let in_body = |body: usize| ends.iter().zip(&is_closed).filter(move |(end, _)| end.body == body);
        let attached = ends.iter().filter(|end| in_body(end.body).all(|(_, is_closed)| *is_closed));
        let caps = Winding::new(attached.flat_map(End::cap).collect());
        let depth = DEPTH * diagonal;
        Self { winding, caps, turned, joined, depth, passage: PASSAGE * depth }
    }

    /// The material of a mesh of the same triangles whose vertices have moved.
    pub(crate) fn moved(&self, mesh: &TriangleMesh) -> Self {
        let (turned, joined) = (self.turned.clone(), self.joined.clone());
        Self { winding: winding(mesh, &turned), caps: self.caps.clone(), turned, joined, passage: self.depth, ..*self }
    }

    /// How deep surface must lie. Millimetres.
    pub(crate) fn depth(&self) -> f64 {
        self.depth
    }

    /// How deep surface that has passed through a wall must lie to be worth a sentence. Millimetres.
    pub(crate) fn passage(&self) -> f64 {
        self.passage
    }

    /// The outer side's normal where that of a patch is written.
    pub(crate) fn outward(&self, patch: usize, normal: DVec3) -> DVec3 {
        if self.turned[patch] { -normal } else { normal }
    }

    /// How a place of a patch stands by itself; its unit `normal` is the one that is written.
    #[must_use]
    pub fn at(&self, patch: usize, place: DVec3, normal: DVec3) -> Standing {
        let outward = self.outward(patch, normal);
        let number_at = |depth: f64| {
            let beside = place + depth * outward;
            self.winding.at(beside) + self.caps.at(beside)
        };
        let number = number_at(self.depth);
        if number > BURIED {
            Standing::Buried
        } else if number < PASSED_THROUGH {
            let is_deep = self.passage <= self.depth || number_at(self.passage) < PASSED_THROUGH;
            if is_deep { Standing::PassedThrough } else { Standing::Free }
        } else if number < INWARD {
            Standing::Inward
        } else {
            Standing::Free
        }
    }

    /// How places stand, each with its patch and area, among all that were spread over the surface: hollows have
    /// passed through nothing.
    pub(crate) fn settle(&self, places: impl Iterator<Item = (usize, f64)>, standing: &mut [Standing]) {
        let mut bodies = vec![(0.0, 0.0); self.joined.len()];
        let by_body: Vec<usize> = places
            .zip(&*standing)
            .map(|((patch, area), standing)| {
                let (as_body, whole) = &mut bodies[self.joined[patch]];
                let is_body = matches!(standing, Standing::Free | Standing::Buried);
                (*as_body, *whole) = (*as_body + if is_body { area } else { 0.0 }, *whole + area);
                self.joined[patch]
            })
            .collect();
        for (standing, body) in standing.iter_mut().zip(by_body) {
            let (as_body, whole) = bodies[body];
            if *standing == Standing::PassedThrough && as_body < BODY * whole {
                *standing = Standing::Inward;
            }
        }
    }

    /// How every texel stands.
    #[must_use]
    pub fn of_texels(&self, texels: &Texels) -> Vec<Standing> {
        let look = |i: usize| {
            let normal = DVec3::from_array(texels.normal[i].map(f64::from));
            self.at(texels.part[i] as usize, DVec3::from_array(texels.position[i]), normal)
        };
        let mut standing = texels.classify(&STRIDES, look);
        let areas = texels.area.iter().map(|area| f64::from(*area).max(0.0));
        self.settle(texels.part.iter().map(|part| *part as usize).zip(areas), &mut standing);
        standing
    }
}

/// The triangles of a mesh with groups, of which some are `turned`.
fn winding(mesh: &TriangleMesh, turned: &[bool]) -> Winding {
    let triangles = mesh.groups.iter().zip(turned).flat_map(|(group, turned)| {
        mesh.triangles[group.start..group.end].iter().map(move |t| {
            let [a, b, c] = mesh.corners(*t);
            if *turned { [a, c, b] } else { [a, b, c] }
        })
    });
    Winding::new(triangles.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Atlas;
    use gml_compiler::program::{Options, compile};
    use gml_compiler::source::{NoFiles, SourceFile};
    use std::collections::BTreeMap;
    use std::f64::consts::PI;

    /// The areas of parts that stand in a way, of those that do.
    fn areas(text: &str) -> BTreeMap<(String, &'static str), f64> {
        let script = SourceFile { name: "m.gml".to_owned(), text: text.to_owned() };
        let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
        let x: Vec<f64> = program.parameters().iter().map(|p| p.default).collect();
        let instance = Model::instantiate(&program, &x).unwrap();
        let atlas = Atlas::new(&program, &*instance, 1024).unwrap();
        let texels = Texels::of_model(&program, &*instance, &atlas).unwrap();
        let material = Material::new(&program, &*instance).unwrap();
        let mut areas = BTreeMap::new();
        for (i, standing) in material.of_texels(&texels).iter().enumerate() {
            let how = match standing {
                Standing::Free => continue,
                Standing::Buried => "buried",
                Standing::Inward => "inward",
                Standing::PassedThrough => "passed",
            };
            let part = texels.part_names[texels.part[i] as usize].clone();
            *areas.entry((part, how)).or_default() += f64::from(texels.area[i]);
        }
        areas
    }

    fn check(text: &str, expected: &[(&str, &'static str, f64)]) {
        let found = areas(text);
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for (part, how, area) in expected {
            let found =
                found.get(&((*part).to_owned(), *how)).unwrap_or_else(|| panic!("{part} is not {how}: {found:?}"));
            // A texel is 0.15 mm wide or less.
            assert!((found / area - 1.0).abs() < 0.04, "{part}: {found} mm2 are {how}, not {area}");
        }
    }

    const PLATE: &str = "use std.solid (box, capped_cylinder)
        use std.surface (cylinder, disc, flip, revolve, tube)
        use std.curve (line, bezier)
        use std.frame (translate)
        model m {
          part plate = box(width: 60mm, depth: 60mm, height: 10mm)\n";

    #[test]
    fn the_end_of_a_tube_in_a_wall_is_buried_and_what_it_covers_of_the_wall() {
        // A stud of radius 5 whose open end is in the middle of the plate, with a lid on its other end or open there.
        let end = 2.0 * PI * 5.0 * 5.0;
        for lid in ["part lid = disc(5mm).translate((0mm, 0mm, 25mm))", ""] {
            let text = format!("{PLATE} part stud = cylinder(5mm, 20mm).translate((0mm, 0mm, 5mm))\n{lid} }}");
            check(&text, &[("stud", "buried", end), ("plate.top", "buried", 25.0 * PI)]);
        }
        // A handle between two places of the plate; its ends reach 4 mm into the plate.
        let handle = "part handle = tube(bezier([(-15mm, 0mm, 6mm), (-15mm, 0mm, 40mm), (15mm, 0mm, 40mm), (15mm, 0mm, 6mm)]), radius: 3mm)";
        let (ends, discs) = (2.0 * 2.0 * PI * 3.0 * 4.0, 2.0 * 9.0 * PI);
        check(&format!("{PLATE} {handle} }}"), &[("handle", "buried", ends), ("plate.top", "buried", discs)]);
    }

    #[test]
    fn bodies_that_touch_are_buried_where_they_do() {
        // Two boxes on each other, and a pin in a hole of its size, whose triangles are not the same.
        let text =
            format!("{PLATE} part block = box(width: 20mm, depth: 20mm, height: 8mm).translate((0mm, 0mm, 10mm)) }}");
        check(&text, &[("plate.top", "buried", 400.0), ("block.base", "buried", 400.0)]);
        let text = "use std.solid (pipe, capped_cylinder)
            use std.frame (translate)
            model m {
              part ring = pipe(outer: 20mm, inner: 10mm, height: 12mm)
              part pin = capped_cylinder(radius: 10mm, height: 20mm)
            }";
        let wall = 2.0 * PI * 10.0 * 12.0;
        check(text, &[("ring.inside", "buried", wall), ("pin.wall", "buried", wall)]);
    }

    #[test]
    fn walls_that_pass_through_each_other_are_found() {
        // The inside is a cone that leaves the outside of radius 30 at z = 31 and ends at radius 32 at z = 2.
        let text = "use std.surface (flip, revolve, disc)
            use std.curve (line)
            use std.frame (translate)
            model vessel {
              part outside = revolve(line((30mm, 0mm), (30mm, 60mm)))
              part rim = revolve(line((30mm, 60mm), (28mm, 60mm)))
              part inside = revolve(line((28mm, 60mm), (32mm, 2mm)))
              part floor = disc(32mm).translate((0mm, 0mm, 2mm))
              part foot = flip(disc(30mm))
            }";
        // What is less deep than a thousandth of the diagonal is not named.
        let least = PASSAGE * DEPTH * DVec3::new(64.0, 64.0, 60.0).length();
        let (height, top) = (29.0 * (1.0 - least / 2.0), 30.0 + least);
        let cone = PI * (top + 32.0) * height.hypot(2.0 - least);
        let outside = 2.0 * PI * 30.0 * height;
        let ring = PI * (32.0 * 32.0 - 30.0 * 30.0);
        check(text, &[("inside", "passed", cone), ("outside", "passed", outside), ("floor", "passed", ring)]);
    }

    #[test]
    fn sheets_have_neither() {
        let sheet = |part: &str| {
            let text = format!(
                "use std.surface (flip, revolve, plane, sphere)\nuse std.curve (arc)\nmodel m {{ part sheet = {part} }}"
            );
            let found = areas(&text);
            assert!(found.keys().all(|(_, how)| *how == "inward"), "{part}: {found:?}");
        };
        for angle in ["-60deg", "-20deg", "20deg", "60deg"] {
            // From the bottom of a bowl to its rim.
            let bowl = format!("revolve(arc((0mm, 0mm), 30mm, -90deg, {angle}))");
            sheet(&bowl);
            sheet(&format!("flip({bowl})"));
        }
        sheet("plane(20mm, 30mm)");
        sheet("flip(sphere(20mm))");
    }
}
