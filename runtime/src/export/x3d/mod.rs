//! One self-contained X3D file that shows the model (nominal), the scan as displacement of the model (actual, [VA]
//! sect. 7) and both, in desktop viewers and in browsers.
//!
//! The scan is not in the file as a mesh: shaders move the model's triangles along their normals by the distances
//! that the texture holds. Which hit counts where a ray met the scan on both sides is decided in one place,
//! `deviation` in glsl/common.glsl, as in the statistics: the nearer one.

mod scene;
pub(super) mod shaders;
#[cfg(test)]
mod tests;

use crate::model::Tessellation;
use thiserror::Error;

/// What goes into the file.
#[derive(Clone, Copy, Debug)]
pub struct X3dScene<'a> {
    /// The model, with normals and texture coordinates; one group a part.
    pub tessellation: &'a Tessellation,
    /// The distance texture as a PNG file, RGB, coded as in [VA] sect. 6.
    pub texture_png: &'a [u8],
    /// Its width and height: powers of two, because viewers resample others and so destroy the codes.
    pub texture_size: [u32; 2],
    /// Distance that the byte 255 stands for. Millimetres.
    pub max_distance: f64,
    /// Deviation at which the colour scale ends. Millimetres.
    pub colour_range: f64,
    /// How the model was turned from the way its author drew it, with z upwards, into the scan's coordinates: a
    /// rotation matrix, row by row. Viewers show it upright.
    pub turned: [[f64; 3]; 3],
    /// Title of the document.
    pub title: &'a str,
    /// Groups of figures, kept in the file as metadata: overall and per part.
    pub metadata: &'a [MetadataGroup],
}

/// Named figures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MetadataGroup {
    /// What they are about, such as the name of a part.
    pub name: String,
    /// Names and values as text.
    pub entries: Vec<(String, String)>,
}

/// Why a scene cannot be written.
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
    /// A distance that is no positive finite number.
    #[error("{what} must be positive, not {value}")]
    Distance {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// There is nothing to show.
    #[error("the model has no triangles")]
    Empty,
    /// Normals or texture coordinates are missing.
    #[error("the mesh has {positions} positions, {normals} normals and {texcoords} texture coordinates")]
    Attributes {
        /// Vertices.
        positions: usize,
        /// Normals.
        normals: usize,
        /// Texture coordinates.
        texcoords: usize,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} of the mesh refers to a vertex that does not exist")]
    Index {
        /// Which triangle.
        triangle: usize,
    },
    /// A group refers to triangles that do not exist.
    #[error("part {name} of the mesh refers to triangles that do not exist")]
    Group {
        /// Name of the part.
        name: String,
    },
    /// A coordinate is not finite.
    #[error("vertex {vertex} of the mesh has a coordinate that is not finite")]
    NotFinite {
        /// Which vertex.
        vertex: usize,
    },
}

/// The scene as X3D 4.0 in the XML encoding.
///
/// # Errors
/// Where the mesh or the texture cannot be shown by a viewer.
pub fn write(scene: &X3dScene<'_>) -> Result<String, X3dError> {
    check(scene)?;
    Ok(scene::document(scene))
}

fn check(scene: &X3dScene<'_>) -> Result<(), X3dError> {
    let [width, height] = scene.texture_size;
    if !width.is_power_of_two() || !height.is_power_of_two() {
        return Err(X3dError::TextureSize { width, height });
    }
    for (what, value) in [("the maximum distance", scene.max_distance), ("the colour range", scene.colour_range)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(X3dError::Distance { what, value });
        }
    }
    let mesh = &scene.tessellation.mesh;
    if mesh.triangles.is_empty() {
        return Err(X3dError::Empty);
    }
    let (positions, normals, texcoords) = (mesh.positions.len(), mesh.normals.len(), mesh.texcoords.len());
    if normals != positions || texcoords != positions {
        return Err(X3dError::Attributes { positions, normals, texcoords });
    }
    if let Some(triangle) = mesh.triangles.iter().position(|t| t.iter().any(|&i| i as usize >= positions)) {
        return Err(X3dError::Index { triangle });
    }
    if let Some(group) = mesh.groups.iter().find(|g| g.start > g.end || g.end > mesh.triangles.len()) {
        return Err(X3dError::Group { name: group.name.clone() });
    }
    let finite =
        |i: usize| mesh.positions[i].iter().chain(&mesh.normals[i]).chain(&mesh.texcoords[i]).all(|c| c.is_finite());
    match (0..positions).find(|&i| !finite(i)) {
        Some(vertex) => Err(X3dError::NotFinite { vertex }),
        None => Ok(()),
    }
}
