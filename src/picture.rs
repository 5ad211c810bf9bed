//! A model as a picture: `gmlc mesh MODEL.gml -o picture.png`.

use crate::error::CommandError;
use gml_compiler::program::Program;
use gml_runtime::export::measurement;
use gml_runtime::export::render::{self, Layer, Paint, View};
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::model::{EvaluationError, Instance, SurfacePoint, Tessellation};

/// Tints of the parts, in their order: matching glazes. Parts of a loop, and parts with one name in records and
/// submodels, share a tint.
const TINTS: [[u8; 3]; 8] = [
    [196, 122, 88],
    [226, 205, 172],
    [104, 142, 150],
    [214, 168, 92],
    [142, 160, 118],
    [158, 116, 132],
    [120, 132, 164],
    [184, 180, 172],
];

/// Allowed sides of a picture, in pixels.
const SIDES: std::ops::RangeInclusive<usize> = 16..=8192;

/// The viewpoint and size of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Framing {
    pub(crate) view: View,
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl Framing {
    /// An invisible distance between a chord and the surface, in millimetres: a fifth of a pixel.
    pub(crate) fn chord(&self, program: &Program, instance: &dyn Instance) -> Result<f64, EvaluationError> {
        let diagonal = Tessellation::rough_diagonal(program, instance, 12)?;
        let pixels = self.width.max(self.height) as f64;
        Ok(if diagonal > 0.0 && diagonal.is_finite() { 0.2 * diagonal / pixels } else { 0.02 })
    }

    /// Draws a model as a PNG file.
    pub(crate) fn png(&self, tessellation: &Tessellation) -> Result<Vec<u8>, CommandError> {
        let colours = tints(&tessellation.mesh, &tessellation.origins);
        let layer = Layer { mesh: &tessellation.mesh, paint: Paint::Vertices(&colours), opacity: 1.0 };
        let picture = render::render(&[layer], &self.view, self.width, self.height);
        measurement::png(&picture).map_err(CommandError::failed)
    }
}

/// A tint for every vertex: one per part.
fn tints(mesh: &TriangleMesh, origins: &[SurfacePoint]) -> Vec<[u8; 3]> {
    let mut names: Vec<&str> = Vec::new();
    let by_patch: Vec<[u8; 3]> = mesh
        .groups
        .iter()
        .map(|group| {
            let name = kind(&group.name);
            let index = names.iter().position(|n| *n == name).unwrap_or_else(|| {
                names.push(name);
                names.len() - 1
            });
            TINTS[index % TINTS.len()]
        })
        .collect();
    origins.iter().map(|o| by_patch[o.patch as usize]).collect()
}

/// The kind of a part, from its name: `tree.left.leaf[2]` is a `leaf`.
fn kind(name: &str) -> &str {
    let last = name.rsplit('.').next().unwrap_or_default();
    last.split('[').next().unwrap_or_default()
}

/// The default view.
pub(crate) fn corner() -> View {
    View::from_angles(35.0, 28.0)
}

/// Parses the name of a view, or `AZIMUTH,ELEVATION` in degrees.
pub(crate) fn parse_view(text: &str) -> Result<View, String> {
    match text {
        "corner" => return Ok(corner()),
        "front" => return Ok(View::FRONT),
        "back" => return Ok(View::BACK),
        "top" => return Ok(View::TOP),
        "below" => return Ok(View::from_angles(35.0, -35.0)),
        "inside" => return Ok(View::INSIDE),
        _ => {}
    }
    let degrees = |t: &str| t.trim().parse::<f64>().ok().filter(|a| a.abs() <= 360.0);
    let angles = text.split_once(',').and_then(|(azimuth, elevation)| Some((degrees(azimuth)?, degrees(elevation)?)));
    match angles {
        Some((azimuth, elevation)) if elevation.abs() <= 90.0 => Ok(View::from_angles(azimuth, elevation)),
        _ => Err("is not a view: expected corner, front, back, top, below, inside, or AZIMUTH,ELEVATION in degrees such as 35,25".into()),
    }
}

/// Parses `640`, or `640x480`.
pub(crate) fn parse_size(text: &str) -> Result<(usize, usize), String> {
    let (width, height) = text.split_once('x').unwrap_or((text, text));
    let side = |t: &str| t.trim().parse::<usize>().ok().filter(|s| SIDES.contains(s));
    side(width).zip(side(height)).ok_or_else(|| {
        let (least, most) = (SIDES.start(), SIDES.end());
        format!("is not a picture size: expected {least} to {most} pixels, such as 640 or 640x480")
    })
}

#[cfg(test)]
mod tests {
    use super::{TINTS, parse_size, parse_view, tints};
    use gml_runtime::mesh::{Group, TriangleMesh};
    use gml_runtime::model::SurfacePoint;

    #[test]
    fn sizes_and_views_are_read() {
        assert_eq!(parse_size("640").unwrap(), (640, 640));
        assert_eq!(parse_size("320x200").unwrap(), (320, 200));
        for wrong in ["", "0", "9000", "320x", "320*200", "-5"] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
        let from_the_right = parse_view("90,0").unwrap();
        assert!((from_the_right.toward[0] - 1.0).abs() < 1e-12);
        for wrong in ["side", "1", "1,2,3", "0,91", "nan,0"] {
            assert!(parse_view(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn parts_of_a_loop_share_a_tint() {
        let group = |name: &str| Group { name: name.to_owned(), start: 0, end: 0 };
        let mesh = TriangleMesh {
            groups: vec![group("rim"), group("hole[0]"), group("left.hole[1]"), group("bore")],
            ..TriangleMesh::default()
        };
        let origins: Vec<SurfacePoint> = (0..4).map(|patch| SurfacePoint { patch, u: 0.0, v: 0.0 }).collect();
        assert_eq!(tints(&mesh, &origins), [TINTS[0], TINTS[1], TINTS[1], TINTS[2]]);
    }
}
