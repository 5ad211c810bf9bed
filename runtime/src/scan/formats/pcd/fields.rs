//! What the fields of a PCD file are, and their values.

use super::super::batch::Batch;
use super::super::text::{self, shown_line};
use super::FORMAT;
use super::header::{Field, Header};
use crate::scan::cloud::RawPoint;
use crate::scan::error::ScanFault;

/// The first value of a field.
#[derive(Clone, Copy, Debug)]
struct Slot {
    kind: u8,
    size: usize,
    /// Bytes of the whole field.
    width: usize,
    /// Bytes of a point before it.
    offset: usize,
    /// Values of a point before it.
    column: usize,
}

/// Bytes of the values of points.
pub(super) struct Layout<'a> {
    bytes: &'a [u8],
    /// Bytes of a point, where points follow each other; none where fields do.
    stride: Option<usize>,
    points: usize,
}

impl<'a> Layout<'a> {
    /// Points that follow each other.
    pub(super) fn rows(bytes: &'a [u8], stride: usize) -> Self {
        Self { bytes, stride: Some(stride), points: 0 }
    }

    /// Fields that follow each other, each with its values of all points.
    pub(super) fn columns(bytes: &'a [u8], points: usize) -> Self {
        Self { bytes, stride: None, points }
    }

    #[inline]
    fn of(&self, slot: &Slot, point: usize) -> &'a [u8] {
        let start = match self.stride {
            Some(stride) => point * stride + slot.offset,
            None => self.points * slot.offset + point * slot.width,
        };
        &self.bytes[start..start + slot.size]
    }
}

/// Names of the fields that are read.
const POSITION: [&[&str]; 3] = [&["x"], &["y"], &["z"]];
const NORMAL: [&[&str]; 3] = [&["normal_x", "nx"], &["normal_y", "ny"], &["normal_z", "nz"]];
const PACKED_COLOUR: &[&str] = &["rgb", "rgba"];
const COLOUR: [&[&str]; 3] = [&["r", "red"], &["g", "green"], &["b", "blue"]];
const INTENSITY: &[&str] = &["intensity", "intensities", "reflectance", "reflectivity", "i"];
/// The name of bytes without a meaning.
const PADDING: &str = "_";

/// A colour in the fields.
#[derive(Clone, Copy, Debug)]
enum Colour {
    None,
    /// 0x00RRGGBB in the bits of an integer or of a floating-point number.
    Packed(Slot),
    /// Bytes of their own.
    Apart([Slot; 3]),
}

/// The fields that are read.
pub(super) struct Roles {
    position: [Slot; 3],
    normal: Option<[Slot; 3]>,
    colour: Colour,
    intensity: Option<Slot>,
}

impl Slot {
    fn of(field: &Field) -> Self {
        let Field { kind, size, count, offset, column, .. } = *field;
        Self { kind, size, width: size * count, offset, column }
    }

    /// Its value from its bytes.
    #[inline]
    fn value(&self, bytes: &[u8]) -> f64 {
        fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
            bytes.try_into().unwrap_or([0; N])
        }
        match (self.kind, self.size) {
            (b'F', 4) => f32::from_le_bytes(array(bytes)).into(),
            (b'F', _) => f64::from_le_bytes(array(bytes)),
            (b'I', 1) => i8::from_le_bytes(array(bytes)).into(),
            (b'I', 2) => i16::from_le_bytes(array(bytes)).into(),
            (b'I', 4) => i32::from_le_bytes(array(bytes)).into(),
            (b'I', _) => i64::from_le_bytes(array(bytes)) as f64,
            (_, 1) => bytes[0].into(),
            (_, 2) => u16::from_le_bytes(array(bytes)).into(),
            (_, 4) => u32::from_le_bytes(array(bytes)).into(),
            _ => u64::from_le_bytes(array(bytes)) as f64,
        }
    }
}

impl Roles {
    /// What the names say. Fields of other names are left out.
    pub(super) fn of(header: &Header, batch: &mut Batch<'_>) -> Result<Self, ScanFault> {
        let fault = |message: String| ScanFault::malformed(FORMAT, "header", message);
        let named = |names: &[&str]| header.fields.iter().find(|field| names.contains(&field.name.as_str()));
        if let Some(field) =
            header.fields.iter().find(|field| field.kind == b'F' && field.size < 4 && field.name != PADDING)
        {
            return Err(fault(format!(
                "the field `{}` has type F and size {}, floating-point numbers have 4 or 8 bytes; correct TYPE",
                shown_line(field.name.as_bytes()),
                field.size
            )));
        }
        let three = |names: [&[&str]; 3]| -> Option<[Slot; 3]> {
            let [a, b, c] = names.map(|names| named(names).map(Slot::of));
            Some([a?, b?, c?])
        };
        let position = three(POSITION).ok_or_else(|| {
            fault(format!(
                "fields x, y and z were expected, there are `{}`; export it with coordinates",
                header.names()
            ))
        })?;
        let normal = three(NORMAL);
        let colour = match named(PACKED_COLOUR) {
            Some(field) if field.size == 4 => Colour::Packed(Slot::of(field)),
            Some(field) => {
                batch.warn(format!(
                    "colours are left out: the field `{}` has {} bytes, 4 were expected",
                    field.name, field.size
                ));
                Colour::None
            }
            None => match three(COLOUR) {
                Some(slots) if slots.iter().all(|slot| slot.size == 1) => Colour::Apart(slots),
                Some(_) => {
                    batch.warn("colours are left out: fields r, g and b of one byte each were expected".to_owned());
                    Colour::None
                }
                None => Colour::None,
            },
        };
        let intensity = named(INTENSITY).map(Slot::of);
        let read = |name: &str| {
            let lists = [POSITION, NORMAL, COLOUR].into_iter().flatten().chain([PACKED_COLOUR, INTENSITY]);
            name == PADDING || lists.into_iter().any(|names| names.contains(&name))
        };
        header.fields.iter().filter(|field| !read(&field.name)).for_each(|field| batch.ignore(&field.name));
        Ok(Self { position, normal, colour, intensity })
    }

    /// A point from its bytes.
    pub(super) fn point_of_bytes(&self, layout: &Layout<'_>, point: usize) -> RawPoint {
        let value = |slot: Slot| slot.value(layout.of(&slot, point));
        let colour = match &self.colour {
            Colour::None => None,
            Colour::Packed(slot) => {
                let [blue, green, red] = [0, 1, 2].map(|k| layout.of(slot, point)[k]);
                Some([red, green, blue])
            }
            Colour::Apart(slots) => Some(slots.map(|slot| layout.of(&slot, point)[0])),
        };
        self.point(value, colour)
    }

    /// A point from the numbers of its line.
    pub(super) fn point_of_numbers(&self, numbers: &[f64]) -> RawPoint {
        let value = |slot: Slot| numbers[slot.column];
        let colour = match &self.colour {
            Colour::None => None,
            Colour::Packed(slot) => packed(value(*slot)),
            Colour::Apart(slots) => text::colour(slots.map(value), 255.0),
        };
        self.point(value, colour)
    }

    #[inline]
    fn point(&self, value: impl Fn(Slot) -> f64, colour: Option<[u8; 3]>) -> RawPoint {
        RawPoint {
            position: self.position.map(&value),
            normal: self.normal.map(|slots| slots.map(|slot| value(slot) as f32)),
            colour,
            intensity: self.intensity.map(|slot| value(slot) as f32),
        }
    }
}

/// A packed colour in text. Some programs write the integer, others a floating-point number that has its bits: these
/// are tiny, or huge and negative, and no whole numbers from 1 on as integers are.
fn packed(value: f64) -> Option<[u8; 3]> {
    let bits = if value.is_nan() {
        return None;
    } else if value >= 1.0 && value <= f64::from(u32::MAX) {
        value as u32
    } else if value < 0.0 && value >= f64::from(i32::MIN) && value.fract() == 0.0 {
        // Opaque, as a signed integer.
        value as i32 as u32
    } else {
        (value as f32).to_bits()
    };
    let [blue, green, red, _] = bits.to_le_bytes();
    Some([red, green, blue])
}
