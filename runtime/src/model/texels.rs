//! The places from which distances are measured.

/// The covered texels of a texture: one ray origin and direction each. Structure of arrays, all of one length,
/// ascending by `index`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Texels {
    /// Width of the texture.
    pub width: u32,
    /// Height of the texture.
    pub height: u32,
    /// `y * width + x`, row 0 at the top of the picture (v = 1 - (y + 0.5) / height).
    pub index: Vec<u32>,
    /// Which part (index into `part_names`).
    pub part: Vec<u32>,
    /// Point of the exact surface. Millimetres.
    pub position: Vec<[f64; 3]>,
    /// Unit outward normal of the exact surface.
    pub normal: Vec<[f32; 3]>,
    /// Area of the surface that this texel stands for. Square millimetres.
    pub area: Vec<f32>,
    /// Names of the parts.
    pub part_names: Vec<String>,
}
