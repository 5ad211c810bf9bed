//! One self-contained X3D file that shows the model (nominal), the scan as displacement of the model (actual, \[VA\]
//! sect. 7) and both, in desktop viewers and in browsers.
//!
//! The actual surface is not in the file as a mesh: shaders divide the model's triangles until a vertex has a texel,
//! and move the vertices along their normals by the distances that the texture holds. Which hit counts where a ray met
//! the scan on both sides is decided in one place, `deviation` in glsl/common.glsl: the nearer one, as in the
//! statistics, or both.

mod annotations;
mod encoding;
mod frame;
mod metadata;
mod modes;
mod numbers;
mod parts;
mod scan;
mod scene;
mod section;
pub(super) mod shaders;
mod surface;
#[cfg(test)]
mod tests;
mod textures;
mod viewpoints;

pub use encoding::SceneFormat;
pub use metadata::metadata;
pub(crate) use scan::TRIANGLES as MOST_SURFELS;

use super::scale::Scale;
use crate::mesh::TriangleMesh;
use crate::model::Tessellation;
use crate::variance::Deviations;
use thiserror::Error;

/// The content of the file.
#[derive(Clone, Copy, Debug)]
pub struct X3dScene<'a> {
    /// The model in triangles that shaders divide, with normals and texture coordinates; one group a part.
    pub tessellation: &'a Tessellation,
    /// The distances, whose texture has powers of two of texels a side, because viewers resample others and so destroy
    /// the codes.
    pub deviations: &'a Deviations,
    /// The scan.
    pub scan: &'a TriangleMesh,
    /// The scale of colours.
    pub scale: Scale,
    /// The deviation below which nearly all are, whatever the scale. Millimetres.
    pub robust_range: f64,
    /// The rotation of the model from its author's coordinates, with z upwards, into the scan's: a matrix, row by row.
    /// Viewers show the model upright.
    pub turned: [[f64; 3]; 3],
    /// Title of the document.
    pub title: &'a str,
    /// Groups of figures, kept in the file as metadata: overall and per part.
    pub metadata: &'a [MetadataGroup],
}

/// Named figures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MetadataGroup {
    /// Their subject, such as the name of a part.
    pub name: String,
    /// Names and values as text.
    pub entries: Vec<(String, String)>,
}

/// The reason why a scene cannot be written.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum X3dError {
    /// Viewers would resample the texture.
    #[error("the distance texture is {width} x {height} texels; X3D needs powers of two")]
    TextureSize {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A texture cannot be encoded.
    #[error("a texture cannot be written: {0}")]
    Texture(String),
    /// A distance that is no positive finite number.
    #[error("{what} must be positive, not {value}")]
    Distance {
        /// The field.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// The mesh has no triangles, lacks attributes, or refers to what is not there.
    #[error("the mesh cannot be shown: {0}")]
    Mesh(String),
}

/// The scene as X3D 4.0 in the XML encoding.
///
/// # Errors
/// Viewers cannot show the mesh or the texture.
pub fn write(scene: &X3dScene<'_>) -> Result<String, X3dError> {
    check(scene)?;
    scene::document(scene)
}

fn check(scene: &X3dScene<'_>) -> Result<(), X3dError> {
    let (width, height) = (scene.deviations.texels.width, scene.deviations.texels.height);
    if !width.is_power_of_two() || !height.is_power_of_two() {
        return Err(X3dError::TextureSize { width, height });
    }
    for (what, value) in
        [("the maximum distance", scene.deviations.max_distance), ("the colour range", scene.scale.end)]
    {
        if !(value > 0.0 && value.is_finite()) {
            return Err(X3dError::Distance { what, value });
        }
    }
    check_mesh(&scene.tessellation.mesh).map_or(Ok(()), |fault| Err(X3dError::Mesh(fault)))
}

/// The reason why a mesh cannot be shown, if there is one. Triangles, vertices and parts are counted from 0.
fn check_mesh(mesh: &TriangleMesh) -> Option<String> {
    let (positions, normals, texcoords) = (mesh.positions.len(), mesh.normals.len(), mesh.texcoords.len());
    if mesh.triangles.is_empty() {
        return Some("it has no triangles".to_owned());
    }
    if normals != positions || texcoords != positions {
        return Some(format!("it has {positions} positions, {normals} normals and {texcoords} texture coordinates"));
    }
    if let Some(triangle) = mesh.triangles.iter().position(|t| t.iter().any(|&i| i as usize >= positions)) {
        return Some(format!("triangle {triangle} refers to a vertex that does not exist"));
    }
    if let Some(group) = mesh.groups.iter().find(|g| g.start > g.end || g.end > mesh.triangles.len()) {
        return Some(format!("part {} refers to triangles that do not exist", group.name));
    }
    let finite =
        |i: usize| mesh.positions[i].iter().chain(&mesh.normals[i]).chain(&mesh.texcoords[i]).all(|c| c.is_finite());
    let vertex = (0..positions).find(|&i| !finite(i))?;
    Some(format!("vertex {vertex} has a coordinate that is not finite"))
}
