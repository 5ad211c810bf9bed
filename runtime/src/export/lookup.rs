//! The texel that is the nearest to a place of the surface.

use crate::variance::Deviations;
use glam::DVec3;

/// The distance in texels within which the texel of a vertex is searched: vertices lie on the rims of charts, texels
/// inside of them, and beyond are gutters of two texels.
const REACH: isize = 2;

/// The texels by their places on the texture.
pub(super) struct TexelsByPlace<'a> {
    deviations: &'a Deviations,
    /// The texel at every place, row by row from the top.
    at: Vec<Option<u32>>,
}

impl<'a> TexelsByPlace<'a> {
    pub(super) fn new(deviations: &'a Deviations) -> Self {
        let texels = &deviations.texels;
        let mut at = vec![None; texels.width as usize * texels.height as usize];
        for (i, place) in texels.index.iter().enumerate() {
            if let Some(slot) = at.get_mut(*place as usize) {
                *slot = Some(i as u32);
            }
        }
        Self { deviations, at }
    }

    /// Of the texels of a part about a place of the texture (s to the right, t upwards) the one that is the nearest in
    /// space, so that one of another chart beside it does not count.
    pub(super) fn nearest(&self, [s, t]: [f64; 2], part: u32, position: [f64; 3]) -> Option<usize> {
        let texels = &self.deviations.texels;
        let (width, height) = (texels.width as isize, texels.height as isize);
        let (column, row) = ((s * width as f64) as isize, ((1.0 - t) * height as f64) as isize);
        let position = DVec3::from_array(position);
        let mut nearest: Option<(f64, usize)> = None;
        for y in (row - REACH).max(0)..(row + REACH + 1).min(height) {
            for x in (column - REACH).max(0)..(column + REACH + 1).min(width) {
                let Some(i) = self.at[(y * width + x) as usize].map(|i| i as usize) else { continue };
                let apart = DVec3::from_array(texels.position[i]).distance_squared(position);
                if texels.part[i] == part && nearest.is_none_or(|(least, _)| apart < least) {
                    nearest = Some((apart, i));
                }
            }
        }
        nearest.map(|(_, i)| i)
    }
}
