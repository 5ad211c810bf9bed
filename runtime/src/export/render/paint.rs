//! The colours of a surface.

use crate::export::colormap::class_colour;
use crate::export::scale::Scale;
use crate::variance::{Class, Deviations, ScanColours};

/// The distance beyond a chart within which its texels count: the width of the gutters between charts.
const REACH: isize = 2;

/// The colours of a surface.
#[derive(Clone, Copy, Debug)]
pub enum Paint<'a> {
    /// One colour for all of the surface.
    Plain([u8; 3]),
    /// A colour for every vertex; grey where there are fewer.
    Vertices(&'a [[u8; 3]]),
    /// The colours of the texels, by the surface's texture coordinates; stripes where there is no data.
    Texels(&'a TexelColours),
}

/// Deviations, or what else texels have, as colours.
#[derive(Clone, Debug)]
pub struct TexelColours {
    width: usize,
    height: usize,
    /// Row by row from the top.
    texels: Vec<Texel>,
}

/// What a place of the texture has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Texel {
    /// No chart is there.
    Beside,
    NoData,
    Colour([u8; 3]),
}

impl TexelColours {
    /// Deviations on a scale.
    #[must_use]
    pub fn new(deviations: &Deviations, scale: &Scale) -> Self {
        Self::of(deviations, |i| Some(scale.colour(f64::from(deviations.signed(i)))))
    }

    /// The scan's colours.
    #[must_use]
    pub fn of_scan(deviations: &Deviations, colours: &ScanColours) -> Self {
        Self::of(deviations, |i| colours.texels.get(i).copied().flatten())
    }

    /// `measured` has the colour of a texel with a distance, or says that there is no data.
    fn of(deviations: &Deviations, measured: impl Fn(usize) -> Option<[u8; 3]>) -> Self {
        let texels = &deviations.texels;
        let (width, height) = (texels.width as usize, texels.height as usize);
        let mut found = vec![Texel::Beside; width * height];
        for (i, &index) in texels.index.iter().enumerate() {
            let colour = class_colour(deviations.class(i)).or_else(|| measured(i));
            let is_striped = deviations.class(i) == Class::NoData;
            found[index as usize] = colour.filter(|_| !is_striped).map_or(Texel::NoData, Texel::Colour);
        }
        Self { width, height, texels: found }
    }

    /// The colour at texture coordinates (s to the right, t upwards); none where there is no data. Beside a chart that
    /// of the nearest texel.
    #[must_use]
    pub fn at(&self, s: f32, t: f32) -> Option<[u8; 3]> {
        if self.texels.is_empty() {
            return None;
        }
        let x = ((s * self.width as f32) as usize).min(self.width - 1);
        let y = (((1.0 - t) * self.height as f32) as usize).min(self.height - 1);
        match self.texels[y * self.width + x] {
            Texel::Beside => self.beside(x, y),
            Texel::NoData => None,
            Texel::Colour(colour) => Some(colour),
        }
    }

    fn beside(&self, x: usize, y: usize) -> Option<[u8; 3]> {
        let mut nearest: Option<(isize, Texel)> = None;
        for dy in -REACH..=REACH {
            for dx in -REACH..=REACH {
                let (Some(x), Some(y)) = (x.checked_add_signed(dx), y.checked_add_signed(dy)) else { continue };
                if x >= self.width || y >= self.height {
                    continue;
                }
                let distance = dx * dx + dy * dy;
                let texel = self.texels[y * self.width + x];
                if texel != Texel::Beside && nearest.is_none_or(|(d, _)| distance < d) {
                    nearest = Some((distance, texel));
                }
            }
        }
        match nearest {
            Some((_, Texel::Colour(colour))) => Some(colour),
            _ => None,
        }
    }
}
