//! The colours of a surface.

use crate::export::colormap::{NO_DATA, texel_colour};
use crate::variance::Deviations;

/// The distance beyond a chart within which its texels count: the width of the gutters between charts.
const REACH: isize = 2;

/// The colours of a surface.
#[derive(Clone, Copy, Debug)]
pub enum Paint<'a> {
    /// One colour for all of the surface.
    Plain([u8; 3]),
    /// A colour for every vertex; grey where there are fewer.
    Vertices(&'a [[u8; 3]]),
    /// The colours of the deviations, by the surface's texture coordinates.
    Deviations(&'a DeviationColours),
}

/// Deviations as colours, texel by texel.
#[derive(Clone, Debug)]
pub struct DeviationColours {
    width: usize,
    height: usize,
    /// Row by row from the top; none where there is no chart.
    colours: Vec<Option<[u8; 3]>>,
}

impl DeviationColours {
    /// Colours on a scale that ends at `end` millimetres.
    #[must_use]
    pub fn new(deviations: &Deviations, end: f64) -> Self {
        let texels = &deviations.texels;
        let mut colours = vec![None; texels.width as usize * texels.height as usize];
        for (i, &index) in texels.index.iter().enumerate() {
            colours[index as usize] = Some(texel_colour(deviations, i, f64::from(deviations.signed(i)), end));
        }
        Self { width: deviations.texels.width as usize, height: deviations.texels.height as usize, colours }
    }

    /// The colour at texture coordinates (s to the right, t upwards). Beside a chart that of the nearest texel.
    #[must_use]
    pub fn at(&self, s: f32, t: f32) -> [u8; 3] {
        if self.colours.is_empty() {
            return NO_DATA;
        }
        let x = ((s * self.width as f32) as usize).min(self.width - 1);
        let y = (((1.0 - t) * self.height as f32) as usize).min(self.height - 1);
        self.colours[y * self.width + x].or_else(|| self.beside(x, y)).unwrap_or(NO_DATA)
    }

    fn beside(&self, x: usize, y: usize) -> Option<[u8; 3]> {
        let mut nearest: Option<(isize, [u8; 3])> = None;
        for dy in -REACH..=REACH {
            for dx in -REACH..=REACH {
                let (Some(x), Some(y)) = (x.checked_add_signed(dx), y.checked_add_signed(dy)) else { continue };
                if x >= self.width || y >= self.height {
                    continue;
                }
                let distance = dx * dx + dy * dy;
                if let Some(colour) = self.colours[y * self.width + x]
                    && nearest.is_none_or(|(d, _)| distance < d)
                {
                    nearest = Some((distance, colour));
                }
            }
        }
        nearest.map(|(_, colour)| colour)
    }
}
