//! A mesh with samples all over its triangles. The charts of a texture would be as many as a noisy scan has bends.

use crate::mesh::{Group, TriangleMesh};
use crate::model::{AtlasError, LARGEST, ReferenceError, Tessellation, Texels};
use crate::variance::{MeasureError, Resolution, Surface, enclosed_volume};
use glam::DVec3;

/// A mesh as a surface: each triangle is divided into equal ones, the more the larger it is, with a sample in the
/// middle of each.
pub(super) fn mesh(mesh: &TriangleMesh, resolution: Resolution) -> Result<Surface<'static>, MeasureError> {
    let area = mesh.area();
    // Written so that NaN ends here.
    if !(area > 0.0 && area.is_finite()) {
        return Err(ReferenceError::NoTriangles.into());
    }
    let cell = match resolution {
        Resolution::Side(side) => area / f64::from(side).powi(2),
        Resolution::Texel(edge) => edge * edge,
    };
    let most = f64::from(LARGEST).powi(2);
    if area > most * cell {
        return Err(AtlasError::TooFine { edge: cell.sqrt(), least: (area / most).sqrt() }.into());
    }
    let mut mesh = mesh.clone();
    if mesh.groups.is_empty() {
        mesh.groups.push(Group { name: "surface".to_owned(), start: 0, end: mesh.triangles.len() });
    }
    let part_names: Vec<String> = mesh.groups.iter().map(|group| group.name.clone()).collect();
    let parts = part_names.len();
    let mut texels = Texels { part_names, ..Texels::default() };
    for (part, group) in mesh.groups.iter().enumerate() {
        for triangle in &mesh.triangles[group.start..group.end] {
            add(&mut texels, part as u32, mesh.corners(*triangle), cell);
        }
    }
    let inside_out = enclosed_volume(&mesh).is_some_and(|volume| volume < 0.0);
    let notice = "its triangles face inwards: its outer side follows from the enclosed volume";
    Ok(Surface {
        tessellation: Tessellation { mesh, ..Tessellation::default() },
        texels,
        seconds: 0.0,
        tolerances: vec![None; parts],
        inverted: vec![inside_out; parts],
        buried: Vec::new(),
        notices: inside_out.then(|| notice.to_owned()).into_iter().collect(),
        parametrised: None,
    })
}

/// Adds the samples of a triangle; `cell` is the area that one stands for at most. Square millimetres.
fn add(texels: &mut Texels, part: u32, [a, b, c]: [DVec3; 3], cell: f64) {
    let across = (b - a).cross(c - a);
    let (area, Some(normal)) = (across.length() / 2.0, across.try_normalize()) else { return };
    let pieces = (area / cell).sqrt().ceil().max(1.0);
    let divisions = pieces as u32;
    let mut sample = |right: f64, up: f64| {
        let place = a + (b - a) * (right / pieces) + (c - a) * (up / pieces);
        texels.index.push(texels.part.len() as u32);
        texels.part.push(part);
        texels.position.push(place.to_array());
        texels.normal.push(normal.as_vec3().to_array());
        texels.area.push((area / (pieces * pieces)) as f32);
        texels.side.push(((b - a).length().max((c - a).length()) / pieces) as f32);
    };
    // Pieces stand upright, and upside down between these.
    for i in 0..divisions {
        for j in 0..divisions - i {
            let (right, up) = (f64::from(i), f64::from(j));
            sample(right + 1.0 / 3.0, up + 1.0 / 3.0);
            if i + j + 1 < divisions {
                sample(right + 2.0 / 3.0, up + 2.0 / 3.0);
            }
        }
    }
}
