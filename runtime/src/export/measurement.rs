//! The files of a measurement: textures, pictures, meshes and figures.

use super::atomic::{self, WriteError};
use super::exchange::{self, Format, ParameterRow};
use super::image::{self, ImageError};
use super::json;
use super::mesh::{self, MeshFormat};
use super::palette;
use super::picture::{self, Picture};
use super::scale::Scale;
use super::x3d::SceneFormat;
use crate::model::Texels;
use crate::variance::{DistanceTexture, Measurement, SIGN_CONVENTION, Stretch, signed_distances};
use std::path::Path;
use thiserror::Error;

/// The file of the triangles of the scan that the model does not explain.
pub const UNMATCHED: &str = "unmatched.ply";

/// The file of the scan's points with their distances.
pub const POINTS: &str = "points.ply";

/// The file of the distances at the texels without loss.
pub const DISTANCES: &str = "distance.tif";

/// The file of how far the scan's triangles lie off the surface between their corners, at the texels without loss.
pub const SAG: &str = "sag.tif";

/// Why documents were not written.
#[derive(Debug, Error)]
pub enum DocumentError {
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A picture cannot be encoded.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The X3D scene cannot be written.
    #[error(transparent)]
    Scene(#[from] super::x3d::X3dError),
    /// The user ended the work.
    #[error("interrupted")]
    Interrupted,
}

/// PNG files of a measurement that other documents contain.
#[derive(Clone, Debug)]
pub struct Textures {
    /// The probability of conformance in colours, in few pixels, if a part has a tolerance.
    pub conformance: Option<Vec<u8>>,
    /// The scan's colours, in few pixels, if it has any.
    pub colour: Option<Vec<u8>>,
    /// The uncertainty of the distances in colours, in few pixels, if the scan is a cloud.
    pub uncertainty: Option<Vec<u8>>,
    /// The colour scale.
    pub scale: Scale,
}

/// How much is documented.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Extent {
    /// Everything.
    #[default]
    All,
    /// The report with its overview, the figures and the distances; no scene and no pictures of their own.
    Report,
    /// The figures and the distances alone.
    Figures,
}

/// Files that are written if they are asked for, and how pictures are drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extras {
    /// Which of the usual files are written.
    pub extent: Extent,
    /// The distances at the texels as OpenEXR.
    pub exr: bool,
    /// The scan's points with their distances.
    pub points: bool,
    /// Formats of other tools.
    pub formats: Vec<Format>,
    /// The rows of the table of parameters, which is among these files; empty where there are no parameters.
    pub parameters: Vec<ParameterRow>,
    /// Where the colour scale ends, in millimetres; if there is none, [`Scale::new`] finds it.
    pub scale: Option<f64>,
    /// How the X3D scene is encoded.
    pub scene: SceneFormat,
}

/// The texture of the scan's colours.
pub const COLOUR: &str = "colour.png";

/// The standard uncertainty of each texel's distance to a cloud, as a picture and without loss.
pub const UNCERTAINTY: [&str; 2] = ["uncertainty.png", "uncertainty.tif"];

/// Writes variance.json, the distances (coded and lossless), pictures, the meshes of what is unmatched and filled, and
/// `extras` into a folder, which must exist. docs/output.md describes the files.
///
/// # Errors
/// If a file cannot be written.
pub fn write(folder: &Path, measurement: &Measurement, extras: &Extras) -> Result<Textures, DocumentError> {
    let Measurement { deviations, report, .. } = measurement;
    let scale = Scale::new(report, extras.scale);
    write_textures(folder, measurement, extras, &scale)?;
    if extras.extent == Extent::Figures {
        exchange::write(folder, measurement, &extras.formats, &scale, &extras.parameters)?;
        json::write(&folder.join("variance.json"), report)?;
        return Ok(Textures { conformance: None, colour: None, uncertainty: None, scale });
    }
    mesh::write(&folder.join(UNMATCHED), &measurement.unmatched, MeshFormat::Ply)?;
    if extras.points {
        exchange::write_points(&folder.join(POINTS), &measurement.points, &deviations.texels.part_names)?;
    }
    if let Some(filled) = &measurement.filled {
        mesh::write(&folder.join("filled.ply"), filled, MeshFormat::Ply)?;
    }
    if let Some(maps) = &measurement.sensitivity_maps {
        for (map, range) in maps.maps.iter().zip(&report.sensitivities) {
            let picture = png(&picture::sensitivity_picture(maps, map, range, &deviations.texels))?;
            atomic::write(&folder.join(&range.picture), &picture)?;
        }
    }
    exchange::write(folder, measurement, &extras.formats, &scale, &extras.parameters)?;
    let conformance = write_conformance(folder, measurement)?;
    let colour = write_colour(folder, measurement)?;
    let uncertainty = write_uncertainty(folder, measurement)?;
    json::write(&folder.join("variance.json"), report)?;
    Ok(Textures { conformance, colour, uncertainty, scale })
}

/// Writes the distances, coded and without loss, and as pictures.
fn write_textures(
    folder: &Path,
    measurement: &Measurement,
    extras: &Extras,
    scale: &Scale,
) -> Result<(), DocumentError> {
    let Measurement { deviations, report, .. } = measurement;
    let (width, height) = (deviations.texels.width, deviations.texels.height);
    let description = format!("signed distance in mm; {SIGN_CONVENTION}");
    let distances = signed_distances(deviations);
    let lossless = image::tiff_f32(width, height, &distances, &description)?;
    atomic::write(&folder.join(DISTANCES), &lossless)?;
    if !deviations.sag.is_empty() {
        let description = "sag of the scan's triangles in mm: what of the signed distance is theirs";
        let sag = tiff_of(&deviations.texels, deviations.sag.iter().copied(), description)?;
        atomic::write(&folder.join(SAG), &sag)?;
    }
    if extras.exr {
        let lossless = image::exr_f32(width, height, &distances, &description)?;
        atomic::write(&folder.join("distance.exr"), &lossless)?;
    }
    if extras.extent != Extent::All {
        return Ok(());
    }
    let notes = [(
        "Comment",
        "R, G: distance along +normal and -normal, 255 = maximum; B: 128 hit along +, 64 along -; without either 32 a filled hole, 16 buried, 8 empty space, 4 ambiguous",
    )];
    let coded = image::png_rgb(width, height, &DistanceTexture::new(deviations).rgb, &notes)?;
    let colours = png(&picture::deviation_picture(deviations, scale))?;
    let levels: Vec<f64> = report.parts.iter().map(|p| p.detection.map_or(0.0, |d| d.level)).collect();
    let significant = png(&picture::significance_picture(deviations, scale, &levels))?;
    for (name, bytes) in [("distance.png", &coded), ("colours.png", &colours), ("significant.png", &significant)] {
        atomic::write(&folder.join(name), bytes)?;
    }
    Ok(())
}

/// Writes the probability of conformance as a picture and without loss, if a part has a tolerance. Returns the picture
/// for a page.
fn write_conformance(folder: &Path, measurement: &Measurement) -> Result<Option<Vec<u8>>, DocumentError> {
    let Measurement { deviations, conformance: Some(map), .. } = measurement else { return Ok(None) };
    let description = "probability that the surface at a texel is within the tolerance";
    let tiff = tiff_of(&deviations.texels, map.iter().copied(), description)?;
    let picture = palette::png(&picture::conformance_picture(deviations, map))?;
    atomic::write(&folder.join("conformance.tif"), &tiff)?;
    atomic::write(&folder.join("conformance.png"), &picture)?;
    Ok(Some(palette::png(&picture::conformance_figure(deviations, map))?))
}

/// Writes the scan's colours as a texture, if it has any. Returns them in few pixels.
fn write_colour(folder: &Path, measurement: &Measurement) -> Result<Option<Vec<u8>>, DocumentError> {
    let Measurement { deviations, scan_colours: Some(colours), .. } = measurement else { return Ok(None) };
    let comment = match &colours.summary.stretch {
        None => "the scan's colours at the texels of distance.tif; no data where that has none".to_owned(),
        Some(Stretch { black, white, .. }) => {
            format!("the scan's intensities at the texels of distance.tif: {black} and less is black, {white} white")
        }
    };
    let texture = picture::colour_texture(deviations, colours);
    let (width, height) = (texture.width as u32, texture.height as u32);
    let file = image::png_rgb(width, height, texture.pixels.as_flattened(), &[("Comment", &comment)])?;
    atomic::write(&folder.join(COLOUR), &file)?;
    Ok(Some(palette::png(&picture::colour_figure(deviations, colours))?))
}

/// Writes the uncertainty of the distances to a cloud as a picture and without loss. Returns the picture for a page.
fn write_uncertainty(folder: &Path, measurement: &Measurement) -> Result<Option<Vec<u8>>, DocumentError> {
    let Measurement { deviations, report, .. } = measurement;
    let Some(cylinder) = &report.cylinder else { return Ok(None) };
    let measured = |(i, u): (usize, &f32)| if deviations.along(i).is_nan() { f32::NAN } else { *u };
    let values = deviations.uncertainty.iter().enumerate().map(measured);
    let tiff = tiff_of(&deviations.texels, values, "standard uncertainty of the distance at a texel in mm")?;
    let picture = palette::png(&picture::uncertainty_picture(deviations, cylinder))?;
    for (name, file) in UNCERTAINTY.iter().zip([&picture, &tiff]) {
        atomic::write(&folder.join(name), file)?;
    }
    Ok(Some(palette::png(&picture::uncertainty_figure(deviations, cylinder))?))
}

/// Values of the texels as a TIFF file, NaN beside them.
fn tiff_of(texels: &Texels, of_texels: impl Iterator<Item = f32>, description: &str) -> Result<Vec<u8>, ImageError> {
    let mut values = vec![f32::NAN; texels.width as usize * texels.height as usize];
    texels.index.iter().zip(of_texels).for_each(|(place, value)| values[*place as usize] = value);
    image::tiff_f32(texels.width, texels.height, &values, description)
}

/// A picture as a PNG file.
///
/// # Errors
/// If the picture cannot be encoded.
pub fn png(picture: &Picture) -> Result<Vec<u8>, ImageError> {
    image::png_rgb(picture.width as u32, picture.height as u32, picture.pixels.as_flattened(), &[])
}
