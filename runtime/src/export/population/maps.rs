//! The maps of the deviations of many objects: textures, and the surface in their colours.

use crate::export::image::{ImageError, tiff_f32};
use crate::export::measurement::{DocumentError, png};
use crate::export::picture::{self, Picture};
use crate::export::render::{self, Layer, Paint, TexelColours, View};
use crate::export::scale::Scale;
use crate::export::{atomic, palette, round_up};
use crate::population::{BY_CHANCE, CommonTexture, DeviationMap};
use crate::variance::Deviations;
use std::path::Path;

/// The mean deviation as a picture and without loss.
pub(super) const MEAN: [&str; 2] = ["deviation-mean.png", "deviation-mean.tif"];

/// The standard deviation between objects likewise.
pub(super) const SD: [&str; 2] = ["deviation-sd.png", "deviation-sd.tif"];

/// The surface in the colours of the mean deviation, from all sides.
pub(super) const VIEWS: &str = "deviation-views.png";

/// Side of one view in pixels.
const SIDE: usize = 440;

/// The maps of a population.
pub struct MapDocuments<'a> {
    texture: &'a CommonTexture,
    /// Objects in the map.
    pub objects: usize,
    mean: Vec<f32>,
    sd: Vec<f32>,
    deviations: Deviations,
    scale: Scale,
    /// Share of the measured area where the mean is not zero by more than chance.
    pub clear: f64,
    /// Parts with the area-weighted mean of the map, its root mean square, and that of the standard deviation between
    /// objects. Millimetres.
    pub parts: Vec<(String, [f64; 3])>,
}

impl<'a> MapDocuments<'a> {
    /// The maps; none where no place has been measured often enough.
    #[must_use]
    pub fn of(map: &DeviationMap, texture: &'a CommonTexture) -> Option<Self> {
        let (mean, sd, chance) = (map.mean(), map.sd(), map.chance());
        let texels = &texture.texels;
        if mean.len() != texels.width as usize * texels.height as usize {
            return None;
        }
        let at = |values: &[f32], i: usize| values[texels.index[i] as usize];
        let of_texels: Vec<f32> = (0..texels.len()).map(|i| at(&mean, i)).collect();
        let mut sizes: Vec<f32> = of_texels.iter().map(|d| d.abs()).filter(|d| d.is_finite()).collect();
        if sizes.is_empty() {
            return None;
        }
        let place = sizes.len() * 99 / 100;
        let end = f64::from(*sizes.select_nth_unstable_by(place, f32::total_cmp).1).max(1e-9);
        let scale = Scale::continuous(round_up(end));
        let areas = (0..texels.len()).filter(|i| of_texels[*i].is_finite());
        let (clear, all) = areas.fold((0.0, 0.0), |(clear, all), i| {
            let area = f64::from(texels.area[i]).max(0.0);
            let is_clear = f64::from(at(&chance, i)) < BY_CHANCE;
            (clear + if is_clear { area } else { 0.0 }, all + area)
        });
        let outward = of_texels.iter().map(|d| if *d >= 0.0 { *d } else { f32::NAN }).collect();
        let inward = of_texels.iter().map(|d| if *d < 0.0 { -d } else { f32::NAN }).collect();
        let parts = parts(texture, &of_texels, &sd);
        let deviations = Deviations::new(texels.clone(), end.max(scale.end), outward, inward);
        let clear = if all > 0.0 { clear / all } else { 0.0 };
        Some(Self { texture, objects: map.textures(), mean, sd, deviations, scale, clear, parts })
    }

    /// Writes the maps into a folder, which must exist.
    pub(super) fn write(&self, folder: &Path) -> Result<(), DocumentError> {
        let objects = self.objects;
        let mean = format!("mean signed distance of {objects} objects in mm; positive: outside of the model");
        let sd = format!("standard deviation of the signed distances of {objects} objects in mm");
        atomic::write(&folder.join(MEAN[0]), &png(&picture::deviation_picture(&self.deviations, &self.scale))?)?;
        atomic::write(&folder.join(MEAN[1]), &self.tiff(&self.mean, &mean)?)?;
        let spread = picture::spread_picture(&self.texture.texels, &self.sd);
        atomic::write(&folder.join(SD[0]), &png(&spread)?)?;
        atomic::write(&folder.join(SD[1]), &self.tiff(&self.sd, &sd)?)?;
        atomic::write(&folder.join(VIEWS), &palette::png(&self.views())?)?;
        Ok(())
    }

    fn tiff(&self, values: &[f32], description: &str) -> Result<Vec<u8>, ImageError> {
        tiff_f32(self.texture.texels.width, self.texture.texels.height, values, description)
    }

    /// The surface from six sides in the colours of the mean.
    fn views(&self) -> Picture {
        let colours = TexelColours::new(&self.deviations, &self.scale);
        let layer = Layer { mesh: &self.texture.tessellation.mesh, paint: Paint::Texels(&colours), opacity: 1.0 };
        let sides = [
            ("From the front", View::FRONT),
            ("From the right", View::RIGHT),
            ("From above", View::TOP),
            ("From the back", View::BACK),
            ("From the left", View::LEFT),
            ("From below", View::BELOW),
        ];
        let (mut pictures, pixels) = render::pictures(&[&[layer]], &sides.map(|(_, view)| view), SIDE);
        for (picture, (name, _)) in pictures.iter_mut().zip(sides) {
            render::name(picture, name);
            render::bar(picture, pixels);
        }
        Picture::sheet(&pictures, 3)
    }

    /// Where the colours of the mean end. Millimetres.
    #[must_use]
    pub fn end(&self) -> f64 {
        self.scale.end
    }
}

/// Mean and root mean square of the map, and root mean square of the standard deviation, by part.
fn parts(texture: &CommonTexture, mean: &[f32], sd: &[f32]) -> Vec<(String, [f64; 3])> {
    let texels = &texture.texels;
    let mut sums = vec![[0.0; 4]; texels.part_names.len()];
    for (i, mean) in mean.iter().enumerate().filter(|(_, d)| d.is_finite()) {
        let (area, mean) = (f64::from(texels.area[i]).max(0.0), f64::from(*mean));
        let spread = f64::from(sd[texels.index[i] as usize]);
        let sum = &mut sums[texels.part[i] as usize];
        for (sum, term) in sum.iter_mut().zip([1.0, mean, mean * mean, spread * spread]) {
            *sum += area * term;
        }
    }
    let figures =
        |[area, mean, square, spread]: [f64; 4]| [mean / area, (square / area).sqrt(), (spread / area).sqrt()];
    texels.part_names.iter().cloned().zip(sums.into_iter().map(figures)).collect()
}
