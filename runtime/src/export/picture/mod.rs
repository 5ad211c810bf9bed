//! Pictures for people: pixels, the textures in the colours of a scale, legends, and names.

pub(super) mod legend;
pub(super) mod names;
mod scanned;
mod spread;
mod texture;
mod uncertainty;

pub use scanned::{colour_figure, colour_texture};
pub use spread::spread_picture;
pub use texture::{
    conformance_figure, conformance_picture, deviation_picture, sensitivity_picture, significance_picture,
};
pub use uncertainty::{uncertainty_figure, uncertainty_picture};

/// A picture in sRGB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row by row from the top.
    pub pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// A picture of one colour.
    #[must_use]
    pub fn new(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Self { width, height, pixels: vec![colour; width * height] }
    }

    /// Fills a rectangle; what lies beyond the picture is cut off.
    pub fn fill(&mut self, x: usize, y: usize, width: usize, height: usize, colour: [u8; 3]) {
        for row in y.min(self.height)..(y + height).min(self.height) {
            let start = row * self.width;
            self.pixels[start + x.min(self.width)..start + (x + width).min(self.width)].fill(colour);
        }
    }

    /// Puts another picture with its top left corner at (x, y); what lies beyond this picture is cut off.
    pub fn put(&mut self, other: &Picture, x: usize, y: usize) {
        let width = other.width.min(self.width.saturating_sub(x));
        for row in 0..other.height.min(self.height.saturating_sub(y)) {
            let start = (y + row) * self.width + x;
            self.pixels[start..start + width].copy_from_slice(&other.pixels[row * other.width..][..width]);
        }
    }

    /// A smaller picture: the mean of every `factor` x `factor` pixels. Rows and columns that are left over are cut.
    #[must_use]
    pub fn reduced(&self, factor: usize) -> Picture {
        let factor = factor.max(1);
        let mut small = Picture::new(self.width / factor, self.height / factor, [0; 3]);
        for (i, pixel) in small.pixels.iter_mut().enumerate() {
            let (left, top) = (i % small.width * factor, i / small.width * factor);
            let mut sum = [0_usize; 3];
            for y in top..top + factor {
                for colour in &self.pixels[y * self.width + left..][..factor] {
                    (0..3).for_each(|k| sum[k] += usize::from(colour[k]));
                }
            }
            *pixel = sum.map(|s| ((s + factor * factor / 2) / (factor * factor)) as u8);
        }
        small
    }

    /// Pictures of one size side by side, `columns` a row.
    #[must_use]
    pub fn sheet(pictures: &[Picture], columns: usize) -> Picture {
        let (width, height) = pictures.first().map_or((1, 1), |p| (p.width, p.height));
        let columns = columns.max(1);
        let mut sheet = Picture::new(width * columns, height * pictures.len().div_ceil(columns).max(1), [255; 3]);
        for (i, picture) in pictures.iter().enumerate() {
            sheet.put(picture, i % columns * width, i / columns * height);
        }
        sheet
    }
}

/// A figure as pictures show it: signed, with at most four significant digits.
pub(super) fn number(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let magnitude = x.abs().log10().floor();
    if !(-4.0..4.0).contains(&magnitude) {
        return format!("{x:+.1e}");
    }
    let text = format!("{x:+.*}", (3.0 - magnitude) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::{Picture, number};

    #[test]
    fn labels_are_short() {
        let labels: Vec<String> = [-0.5, 0.25, 0.0, 10.0, 2e-7, -12345.0, 16.956777, -2000.0].map(number).to_vec();
        assert_eq!(labels, ["-0.5", "+0.25", "0", "+10", "+2.0e-7", "-1.2e4", "+16.96", "-2000"]);
    }

    #[test]
    fn pictures_are_put_together_and_reduced() {
        let mut picture = Picture::new(5, 3, [0; 3]);
        picture.put(&Picture::new(3, 4, [200; 3]), 3, 1);
        assert_eq!(picture.pixels.iter().filter(|pixel| **pixel == [200; 3]).count(), 4, "the rest is cut off");
        let small = picture.reduced(2);
        assert_eq!((small.width, small.height, small.pixels[0], small.pixels[1]), (2, 1, [0; 3], [50; 3]));
    }
}
