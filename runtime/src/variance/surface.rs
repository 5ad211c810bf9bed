//! The surface that a scan is measured from: a model at certain parameters, or a reference mesh.

use super::measure::unless_cancelled;
use super::orientation::is_inside_out;
use super::reach::Reach;
use super::{MeasureError, Tolerance};
use crate::bvh::{Bvh, MAX_EXTENT};
use crate::feet::layout::Layout;
use crate::feet::signed::{ExactSurface, MeshSurface, Target, layout_for};
use crate::mesh::{Bounds, TriangleMesh};
use crate::model::{
    Atlas, AtlasError, Closedness, Fineness, Instance, LARGEST, Material, Model, Motion, Passages, ReferenceSurface,
    SMALLEST, Sensitivities, SensitivityMaps, Standing, Tessellation, Texels, divided,
};
use crate::progress::Progress;
use glam::DVec3;
use std::time::Instant;

/// Longest edge of the tessellation, as a fraction of the model's diagonal: documents displace the vertices, so that
/// detail needs them close together.
const LONGEST_EDGE: f64 = 1.0 / 150.0;

/// Longest edge of triangles that viewers divide, in texels. With 8 the scene of the cup takes 4.9 MB, with 12 3.5 MB.
const DIVIDED_EDGE: f64 = 12.0;

/// The most triangles that viewers divide. X3D writes one with its half of a vertex in some 95 bytes: the scene of a
/// model of the most triangles stays below 4 MB.
const MOST_DIVIDED: usize = 20_000;

/// The largest distance between such triangles and the surface, as a fraction of the model's diagonal: half a pixel
/// where the model fills a screen of 1,000 pixels.
const DIVIDED_CHORD: f64 = 5e-4;

/// Segments along u and v by which the size of a model is judged before the work.
const COARSE: u32 = 8;

/// Least distance between chord and surface, as a fraction of the model's diagonal: from 5 m on it exceeds the usual
/// one, by which a ball of 70 km would have the most triangles that there may be. It has 360,000 by this.
const LEAST_CHORD: f64 = 4e-6;

/// The surface that a scan is compared with, in the scan's position.
#[derive(Clone, Copy)]
pub enum Reference<'a> {
    /// A model.
    Model {
        /// The model.
        model: &'a dyn Model,
        /// Values of its parameters, in their order. Millimetres and radians.
        x: &'a [f64],
        /// The pose of the scan: a scanned point is this motion of a point of the model.
        motion: Motion,
    },
    /// A mesh from elsewhere (\[VA\] sect. 6). Millimetres.
    Mesh(&'a TriangleMesh),
}

/// How fine the texture is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// Texels per side of the square texture; a power of two.
    Side(u32),
    /// Greatest mean width of a texel on the surface: the smallest texture with such texels. Millimetres.
    Texel(f64),
}

impl Default for Resolution {
    fn default() -> Self {
        Self::Side(1024)
    }
}

impl Resolution {
    /// The texture of a model.
    ///
    /// # Errors
    /// The surface cannot be evaluated, or the texture would be too small or too large.
    pub fn layout(self, model: &dyn Model, instance: &dyn Instance) -> Result<Atlas, AtlasError> {
        match self {
            Self::Side(size) => Atlas::new(model, instance, size),
            Self::Texel(edge) => Atlas::with_texels_of(model, instance, edge),
        }
    }
}

/// The surface with the origins of the rays.
pub(crate) struct Surface<'a> {
    /// Triangles with texture coordinates.
    pub(crate) tessellation: Tessellation,
    /// Origins and directions of the rays.
    pub(crate) texels: Texels,
    /// Seconds that the texels took.
    pub(crate) seconds: f64,
    /// The parts' own tolerances.
    pub(crate) tolerances: Vec<Option<Tolerance>>,
    /// By part, whether its outer side is the other one than written, by the volume that it encloses with others.
    pub(crate) inverted: Vec<bool>,
    /// By texel, whether it is inside of the model's own material; empty for a mesh.
    pub(crate) buried: Vec<bool>,
    /// Sentences for the user.
    pub(crate) notices: Vec<String>,
    /// The model that derivatives are computed from; none for a mesh.
    pub(crate) parametrised: Option<Parametrised<'a>>,
}

/// A model at the parameters at which it is measured.
pub(crate) struct Parametrised<'a> {
    pub(crate) reach: Reach<'a>,
    atlas: Atlas,
    motion: Motion,
    /// What is inside of the model.
    material: Material,
    /// Diagonal of the bounding box. Millimetres.
    size: f64,
}

impl<'a> Surface<'a> {
    /// The surface; `shared` is the layout of a texture that a model takes if it has as many patches.
    pub(crate) fn new(
        reference: Reference<'a>,
        resolution: Resolution,
        shared: Option<&Atlas>,
        progress: &dyn Progress,
    ) -> Result<Self, MeasureError> {
        match reference {
            Reference::Model { model, x, motion } => Self::of_model(model, x, motion, (resolution, shared), progress),
            Reference::Mesh(mesh) => Self::of_mesh(mesh, resolution),
        }
    }

    fn of_model(
        model: &'a dyn Model,
        x: &[f64],
        motion: Motion,
        (resolution, shared): (Resolution, Option<&Atlas>),
        progress: &dyn Progress,
    ) -> Result<Self, MeasureError> {
        let started = Instant::now();
        unless_cancelled(progress)?;
        let instance = model.instantiate(x)?;
        // Before the work: what is found later took the most triangles that there may be. A coarse mesh may have places
        // without a value that the texels do not have.
        let coarse = Tessellation::uniform(model, &*instance, COARSE, COARSE);
        let size = coarse.map_or(0.0, |coarse| coarse.mesh.bounds().size().max_element());
        if size > 2.0 * MAX_EXTENT {
            return Err(MeasureError::Huge { size });
        }
        let shared = shared.filter(|atlas| atlas.charts.len() == model.parts().len());
        let atlas = match (shared, resolution) {
            (Some(atlas), _) => atlas.clone(),
            (None, resolution) => resolution.layout(model, &*instance)?,
        };
        unless_cancelled(progress)?;
        let mut texels = Texels::of_model(model, &*instance, &atlas)?;
        unless_cancelled(progress)?;
        let seconds = started.elapsed().as_secs_f64();
        let size = texels.position.iter().copied().map(DVec3::from_array).collect::<Bounds>().diagonal();
        let edge = if size > 0.0 { LONGEST_EDGE * size } else { f64::INFINITY };
        let fineness = Fineness { edge, ..Fineness::default() };
        let fineness = Fineness { chord: fineness.chord.max(LEAST_CHORD * size), ..fineness };
        let mut tessellation = Tessellation::new(model, &*instance, fineness)?.with_atlas(&atlas);
        unless_cancelled(progress)?;
        let mut inverted = vec![false; model.parts().len()];
        let turned = Closedness::inverted(model, &*instance)?;
        turned.iter().for_each(|patch| inverted[*patch] = true);
        unless_cancelled(progress)?;
        let material = Material::of(model, &*instance, &turned, size)?;
        unless_cancelled(progress)?;
        let standing = material.of_texels(&texels);
        unless_cancelled(progress)?;
        motion.move_texels(&mut texels);
        motion.move_tessellation(&mut tessellation);
        let tolerances = model.tolerances(x)?.into_iter();
        let tolerances = tolerances.map(|t| t.map(|t| Tolerance { lower: 0.0 - t, upper: t })).collect();
        let notices = inverted_notice(&texels.part_names, &inverted);
        let places = (0..texels.len())
            .map(|i| (texels.part[i] as usize, f64::from(texels.area[i]).max(0.0), texels.position[i], standing[i]));
        let passages = Passages::of(&texels.part_names, places);
        let notices = notices.into_iter().chain(passages.map(|passages| passages.sentence())).collect();
        let buried = standing.iter().map(|s| *s == Standing::Buried).collect();
        let reach = Reach { model, instance, x: x.to_vec() };
        let parametrised = Some(Parametrised { reach, atlas, motion, material, size });
        Ok(Self { tessellation, texels, seconds, tolerances, inverted, buried, notices, parametrised })
    }

    fn of_mesh(mesh: &TriangleMesh, resolution: Resolution) -> Result<Self, MeasureError> {
        let area = mesh.area();
        let (size, edge) = match resolution {
            Resolution::Side(size) => (size, f64::INFINITY),
            // At most the whole texture is used.
            Resolution::Texel(edge) => ((area.sqrt() / edge).min(f64::from(LARGEST)) as u32, edge),
        };
        let mut size = size.next_power_of_two().clamp(SMALLEST, LARGEST);
        let started = Instant::now();
        loop {
            let ReferenceSurface { tessellation, texels, notices } = ReferenceSurface::new(mesh, size)?;
            let mean_width = (area / texels.len().max(1) as f64).sqrt();
            if mean_width <= edge {
                let tolerances = vec![None; texels.part_names.len()];
                let seconds = started.elapsed().as_secs_f64();
                let inverted = vec![is_inside_out(&tessellation.mesh); tolerances.len()];
                let mut notices = notices;
                notices.extend(inverted_notice(&texels.part_names, &inverted));
                let buried = Vec::new();
                let parametrised = None;
                return Ok(Self { tessellation, texels, seconds, tolerances, inverted, buried, notices, parametrised });
            }
            if size == LARGEST {
                return Err(AtlasError::TooFine { edge, least: mean_width }.into());
            }
            size *= 2;
        }
    }

    /// The model in few triangles, for documents whose viewers divide them; none for a mesh, of which
    /// [`Tessellation::displayed`] is that.
    pub(crate) fn displayed(&self) -> Result<Option<Tessellation>, MeasureError> {
        let Some(Parametrised { reach, atlas, motion, size, .. }) = &self.parametrised else { return Ok(None) };
        let chord = DIVIDED_CHORD * size.max(f64::MIN_POSITIVE);
        let edge = DIVIDED_EDGE * self.texels.width_on_the_surface();
        let edge = if edge > 0.0 { edge } else { f64::INFINITY };
        let fineness = Fineness { chord, edge, max_triangles: MOST_DIVIDED, ..Fineness::default() };
        let mut tessellation = Tessellation::new(reach.model, &*reach.instance, fineness)?.with_atlas(atlas);
        motion.move_tessellation(&mut tessellation);
        Ok(Some(tessellation))
    }

    /// How the surface moves where the parameters change; none for a mesh.
    pub(crate) fn sensitivities(&self) -> Result<Option<Sensitivities>, MeasureError> {
        let Some(Parametrised { reach, atlas, motion, .. }) = &self.parametrised else { return Ok(None) };
        Ok(Some(Sensitivities::new(reach.model, &*reach.instance, atlas, &self.texels, motion)?))
    }

    /// The same all over the texture.
    pub(crate) fn sensitivity_maps(&self) -> Result<Option<SensitivityMaps>, MeasureError> {
        let Some(Parametrised { reach, atlas, motion, .. }) = &self.parametrised else { return Ok(None) };
        Ok(Some(SensitivityMaps::new(reach.model, &*reach.instance, atlas, &self.texels, motion)?))
    }
}

impl Tessellation {
    /// A reference mesh for documents whose viewers divide its triangles: large ones are divided before.
    pub(crate) fn displayed(&self, texels: &Texels) -> Tessellation {
        let mesh = divided(&self.mesh, DIVIDED_EDGE * texels.width_on_the_surface(), MOST_DIVIDED);
        Tessellation { mesh, ..Tessellation::default() }
    }
}

impl Parametrised<'_> {
    /// The pose.
    pub(crate) fn motion(&self) -> Motion {
        self.motion
    }

    /// What is inside of the model.
    pub(crate) fn material(&self) -> &Material {
        &self.material
    }

    /// The facets in which feet on the exact surface are searched.
    pub(crate) fn layout(&self) -> Layout {
        layout_for(self.reach.model, &*self.reach.instance, self.size)
    }

    /// The exact surface. `inverted` are the parts whose outer side is the other one than written.
    fn exact<'s>(&'s self, layout: &'s Layout, inverted: &[bool]) -> ExactSurface<'s> {
        ExactSurface::new(&*self.reach.instance, layout, inverted, self.motion, self.size)
    }
}

/// What distances from a surface are measured to: the exact surface of a model, in whose facets (`layout`) feet are
/// searched, or else the triangles of a mesh. `inverted` are the parts whose outer side is the other one than written.
pub(crate) fn target<'s>(
    model: Option<(&'s Parametrised<'_>, &'s Layout)>,
    inverted: &[bool],
    mesh: &'s TriangleMesh,
    bvh: &'s Bvh,
) -> Target<'s> {
    match model {
        Some((model, layout)) => Target::Model(model.exact(layout, inverted)),
        None => Target::Mesh(MeshSurface::new(mesh, bvh)),
    }
}

/// A sentence on parts whose outer side follows from a volume.
fn inverted_notice(names: &[String], inverted: &[bool]) -> Option<String> {
    let named: Vec<&str> = names.iter().zip(inverted).filter(|(_, i)| **i).map(|(name, _)| name.as_str()).collect();
    (!named.is_empty()).then(|| {
        format!(
            "the outer side of {} is the other one than written: it follows from the enclosed volume",
            named.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use crate::model::{Fineness, Model, Motion, Tessellation};
    use crate::progress::Silent;
    use crate::scan::from_mesh;
    use crate::variance::{DistanceTexture, MeasureOptions, Reference, Resolution, measure};
    use gml_compiler::program::{Options, compile};
    use gml_compiler::source::{NoFiles, SourceFile};
    use std::f64::consts::PI;

    #[test]
    fn what_is_buried_is_no_part_of_statistics() {
        // The handle as it is before the wall ends it.
        let text = include_str!("../../../examples/mug/mug.gml").replace(".outside_of(body)", "");
        let script = SourceFile { name: "mug.gml".to_owned(), text };
        let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
        let x: Vec<f64> = program.parameters().iter().map(|p| p.default).collect();
        let instance = Model::instantiate(&program, &x).unwrap();
        let mesh = Tessellation::new(&program, &*instance, Fineness::default()).unwrap().mesh;
        let scan = from_mesh(mesh, "mug").unwrap();
        let reference = Reference::Model { model: &program, x: &x, motion: Motion::IDENTITY };
        let options = MeasureOptions { resolution: Resolution::Side(1024), ..MeasureOptions::default() };
        let measured = measure(reference, &scan, None, &options, &Silent).unwrap();
        let deviations = &measured.deviations;
        let whole: f64 = deviations.texels.area.iter().map(|area| f64::from(*area)).sum();
        let overall = &measured.report.overall;
        assert!((overall.area + overall.buried_area - whole).abs() < 1e-6 * whole);
        assert_eq!(overall.texels + overall.buried_texels, deviations.texels.len());
        let buried = |name: &str| {
            let part = measured.report.parts.iter().find(|part| part.name == name).expect("a part");
            (part.statistics.buried_area, part.statistics.coverage)
        };
        // Two ends of a tube of 4 x 6 mm in a cylinder of 40 mm, on whose axis they are 0.75 mm deep, and by half its
        // circumference at an angle with a cosine of 0.99.
        let ring: f64 = (0..360)
            .map(|k| f64::from(k).to_radians())
            .map(|a| {
                let (y, step) = (6.0 * a.sin(), (4.0 * a.sin()).hypot(6.0 * a.cos()) * 1.0_f64.to_radians());
                ((1600.0 - y * y).sqrt() - 39.25) * step / 0.99
            })
            .sum();
        let ((handle, seen), (outside, _)) = (buried("handle"), buried("outside"));
        // Rings of 0.3 to 0.75 mm, on which texels are 0.2 mm wide and 0.3 mm long, count by the texels' centres.
        assert!((handle / (2.0 * ring) - 1.0).abs() < 0.15, "{handle}, not {}", 2.0 * ring);
        // What they cover of the wall, and what is behind the bead.
        let covered = 2.0 * PI * 4.0 * 6.0;
        assert!(outside > 0.95 * covered + 2.0 * PI * 40.0 * 1.5, "{outside}");
        // The scan has all of the rest, and of the buried surface, which is not looked at.
        assert!(seen > 0.999 && overall.coverage > 0.999, "{seen} {}", overall.coverage);
        for part in ["floor", "base", "corner"] {
            assert_eq!(buried(part).0, 0.0, "{part}");
        }
        let texture = DistanceTexture::new(deviations);
        for i in (0..deviations.texels.len()).filter(|i| deviations.is_buried(*i)) {
            let at = 3 * deviations.texels.index[i] as usize;
            assert_eq!(texture.rgb[at..at + 3], [0, 0, 16]);
        }
    }
}
