//! Pictures as PNG, TIFF and OpenEXR files.

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, SmallVec, Text, WritableImage,
};
use rayon::prelude::*;
use std::io::Cursor;
use thiserror::Error;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::encoder::colortype::Gray32Float;
use tiff::encoder::{Compression, DeflateLevel, TiffEncoder};
use tiff::tags::Tag;

/// The reason why a picture could not be encoded.
#[derive(Debug, Error)]
pub enum ImageError {
    /// The PNG encoder failed.
    #[error("the picture cannot be written as PNG: {0}")]
    Png(#[from] png::EncodingError),
    /// The TIFF encoder failed.
    #[error("the picture cannot be written as TIFF: {0}")]
    Tiff(#[from] tiff::TiffError),
    /// The OpenEXR encoder failed.
    #[error("the picture cannot be written as OpenEXR: {0}")]
    Exr(#[from] exr::error::Error),
    /// A TIFF file of other values.
    #[error("the picture has no 32-bit floats")]
    NotFloats,
    /// Too few or too many values for its sides.
    #[error("a picture of {width} x {height} pixels needs as many values, not {values}")]
    Size {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// The number of values.
        values: usize,
    },
}

/// A PNG file of `3 * width * height` bytes of sRGB, row 0 at the top. `notes` are keywords (such as `Comment`) and
/// texts in Latin-1 that go with it.
///
/// # Errors
/// A side of zero, or pixels of the wrong number.
pub fn png_rgb(width: u32, height: u32, rgb: &[u8], notes: &[(&str, &str)]) -> Result<Vec<u8>, ImageError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    for (keyword, text) in notes {
        encoder.add_text_chunk((*keyword).to_owned(), (*text).to_owned())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()?;
    Ok(file)
}

/// A PNG file of `3 * width * height` bytes that are data and no colours: the smallest of those that the filters of PNG
/// make, because what is guessed from rows does not hold for numbers of several bytes.
///
/// # Errors
/// A side of zero, or bytes of the wrong number.
pub fn png_data(width: u32, height: u32, bytes: &[u8]) -> Result<Vec<u8>, ImageError> {
    use png::Filter;
    let filtered = |filter| {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        encoder.set_filter(filter);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(bytes)?;
        writer.finish()?;
        Ok(file)
    };
    let filters = [Filter::NoFilter, Filter::Sub, Filter::Up, Filter::Paeth, Filter::Adaptive];
    let files: Vec<Vec<u8>> = filters.into_par_iter().map(filtered).collect::<Result<_, ImageError>>()?;
    Ok(files.into_iter().min_by_key(Vec::len).unwrap_or_default())
}

/// A PNG file of `width * height` numbers of colours of a palette, three bytes each, row 0 at the top.
///
/// # Errors
/// A side of zero, or pixels of the wrong number.
pub fn png_indexed(width: u32, height: u32, palette: Vec<u8>, pixels: &[u8]) -> Result<Vec<u8>, ImageError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette);
    encoder.set_filter(png::Filter::NoFilter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(file)
}

/// A TIFF file of one channel of 32-bit floats, row 0 at the top, NaN for no data (tag GDAL_NODATA), deflated, with
/// `description` in ImageDescription. Such files are opened by ImageJ/Fiji, QGIS and all that uses GDAL, MATLAB
/// (`imread`), Python (`tifffile`, Pillow, OpenCV with `IMREAD_UNCHANGED`), GIMP 2.10 and Photoshop.
///
/// # Errors
/// A side of zero, or values of the wrong number; a description that is not ASCII.
pub fn tiff_f32(width: u32, height: u32, values: &[f32], description: &str) -> Result<Vec<u8>, ImageError> {
    let mut file = Cursor::new(Vec::new());
    let deflate = Compression::Deflate(DeflateLevel::Fast);
    let mut encoder = TiffEncoder::new(&mut file)?.with_compression(deflate);
    let mut image = encoder.new_image::<Gray32Float>(width, height)?;
    image.encoder().write_tag(Tag::ImageDescription, description)?;
    image.encoder().write_tag(Tag::GdalNodata, "nan")?;
    image.write_data(values)?;
    Ok(file.into_inner())
}

/// The width, the height and the values of a file of [`tiff_f32`].
///
/// # Errors
/// The file is no TIFF of 32-bit floats.
pub fn read_tiff_f32(file: &[u8]) -> Result<(u32, u32, Vec<f32>), ImageError> {
    let mut decoder = Decoder::new(Cursor::new(file))?;
    let (width, height) = decoder.dimensions()?;
    match decoder.read_image()? {
        DecodingResult::F32(values) => Ok((width, height, values)),
        _ => Err(ImageError::NotFloats),
    }
}

/// An OpenEXR file of one channel of 32-bit floats, row 0 at the top, NaN for no data, without loss, with `description`
/// in the attribute `comments`. The channel is Y, luminance, which renderers and viewers (Blender, Krita, tev,
/// mrViewer) show as grey.
///
/// # Errors
/// A side of zero, or values of the wrong number; a description that is not in Latin-1.
pub fn exr_f32(width: u32, height: u32, values: &[f32], description: &str) -> Result<Vec<u8>, ImageError> {
    let (columns, rows) = (width as usize, height as usize);
    if values.is_empty() || columns.checked_mul(rows) != Some(values.len()) {
        return Err(ImageError::Size { width, height, values: values.len() });
    }
    let invalid = || exr::error::Error::Invalid("a description beyond Latin-1".into());
    let comments = Text::new_or_none(description).ok_or_else(invalid)?;
    let attributes = LayerAttributes { comments: Some(comments), ..LayerAttributes::named("distance") };
    let channel = AnyChannel::new("Y", FlatSamples::F32(values.to_vec()));
    let channels = AnyChannels::sort(SmallVec::from_iter([channel]));
    let layer = Layer::new((columns, rows), attributes, Encoding::FAST_LOSSLESS, channels);
    let mut file = Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut file)?;
    Ok(file.into_inner())
}

#[cfg(test)]
mod tests {
    use super::{exr_f32, png_rgb, read_tiff_f32, tiff_f32};
    use std::io::Cursor;

    #[test]
    fn png_survives_a_round_trip() {
        let rgb: Vec<u8> = (0..7 * 5 * 3).map(|i| (i * 7) as u8).collect();
        let file = png_rgb(7, 5, &rgb, &[("Comment", "positive: outside")]).unwrap();
        let mut reader = png::Decoder::new(Cursor::new(file)).read_info().unwrap();
        let mut read = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut read).unwrap();
        assert_eq!((frame.width, frame.height, frame.color_type), (7, 5, png::ColorType::Rgb));
        assert_eq!(read, rgb);
        assert_eq!(reader.info().uncompressed_latin1_text[0].text, "positive: outside");
        assert!(png_rgb(7, 5, &rgb[1..], &[]).is_err());
        assert!(png_rgb(0, 0, &[], &[]).is_err());
    }

    #[test]
    fn tiff_keeps_every_bit() {
        let mut values: Vec<f32> = (0..300 * 200).map(|i| (i as f32).sin() * 1e-3).collect();
        values[5] = f32::NAN;
        values[6] = -0.0;
        let file = tiff_f32(300, 200, &values, "mm").unwrap();
        let (width, height, read) = read_tiff_f32(&file).unwrap();
        assert_eq!((width, height), (300, 200));
        assert!(read.iter().zip(&values).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert!(tiff_f32(300, 201, &values, "mm").is_err());
    }

    #[test]
    fn exr_keeps_every_bit() {
        use exr::prelude::{ReadChannels, ReadLayers, read};
        let mut values: Vec<f32> = (0..300 * 200).map(|i| (i as f32).sin() * 1e-3).collect();
        values[5] = f32::NAN;
        values[6] = -0.0;
        let file = exr_f32(300, 200, &values, "signed distance in mm").unwrap();
        let reader = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
        let image = reader.from_buffered(Cursor::new(file)).unwrap();
        let layer = &image.layer_data[0];
        assert_eq!((layer.size.x(), layer.size.y()), (300, 200));
        assert_eq!(layer.attributes.comments.as_ref().unwrap().to_string(), "signed distance in mm");
        let channel = &layer.channel_data.list[0];
        assert_eq!(channel.name.to_string(), "Y");
        assert!(channel.sample_data.values_as_f32().zip(&values).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert!(exr_f32(300, 201, &values, "mm").is_err());
        assert!(exr_f32(0, 0, &[], "mm").is_err());
    }
}
