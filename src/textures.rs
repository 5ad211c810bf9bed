//! The files that `variance` and `inspect` share: textures, pictures, meshes and figures.

use crate::error::CommandError;
use crate::measure::{Measured, UNMATCHED};
use crate::mesh::make_folder;
use gml_runtime::export::picture::{self, Picture};
use gml_runtime::export::{atomic, json, ply, raster};
use gml_runtime::variance;
use std::path::Path;

/// PNG files that other documents contain.
pub(crate) struct Pictures {
    /// The coded texture.
    pub(crate) coded: Vec<u8>,
    /// The texture in the colours of the deviations.
    pub(crate) colours: Vec<u8>,
}

/// Writes the coded texture, the lossless distances, the colours, what of the scan is left over, and the statistics.
pub(crate) fn write(folder: &Path, measured: &Measured) -> Result<Pictures, CommandError> {
    make_folder(folder)?;
    let texture = &measured.texture;
    let (width, height) = (texture.width, texture.height);
    let sign = format!("signed distance in mm; {}", variance::SIGN_CONVENTION);
    let lossless = variance::signed_distances(&measured.deviations);
    let tiff = raster::tiff_f32(width, height, &lossless, &sign).map_err(CommandError::failed)?;
    let coded = coded_png(measured)?;
    let colours = png(&picture::deviation_picture(&measured.deviations, measured.colour_range))?;
    let levels: Vec<f64> = measured.report.parts.iter().map(|p| p.detection.map_or(0.0, |d| d.level)).collect();
    let significant = png(&picture::significance_picture(&measured.deviations, measured.colour_range, &levels))?;
    let files = [
        ("distance.png", &coded),
        ("distance.tif", &tiff),
        ("colours.png", &colours),
        ("significant.png", &significant),
    ];
    for (name, bytes) in files {
        atomic::write(&folder.join(name), bytes).map_err(CommandError::failed)?;
    }
    ply::write(&folder.join(UNMATCHED), &measured.unmatched, &[]).map_err(CommandError::failed)?;
    if let Some(filled) = &measured.filled {
        ply::write(&folder.join("filled.ply"), filled, &[]).map_err(CommandError::failed)?;
    }
    if let Some(maps) = &measured.maps {
        for (map, range) in maps.maps.iter().zip(&measured.report.sensitivities) {
            let picture = png(&picture::sensitivity_picture(maps, map, range, &measured.deviations.texels))?;
            atomic::write(&folder.join(&range.picture), &picture).map_err(CommandError::failed)?;
        }
    }
    json::write(&folder.join("variance.json"), &measured.report).map_err(CommandError::failed)?;
    Ok(Pictures { coded, colours })
}

/// A picture as a PNG file.
pub(crate) fn png(picture: &Picture) -> Result<Vec<u8>, CommandError> {
    let rgb = picture.pixels.as_flattened();
    raster::png_rgb(picture.width as u32, picture.height as u32, rgb, &[]).map_err(CommandError::failed)
}

/// The coded texture as a PNG file.
fn coded_png(measured: &Measured) -> Result<Vec<u8>, CommandError> {
    let notes = [(
        "Comment",
        "R, G: distance along +normal and -normal, 255 = maximum; B: 128 hit along +, 64 along -, 32 a filled hole",
    )];
    raster::png_rgb(measured.texture.width, measured.texture.height, &measured.texture.rgb, &notes)
        .map_err(CommandError::failed)
}
