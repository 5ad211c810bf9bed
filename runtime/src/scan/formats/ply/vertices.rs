//! The rows of vertices.

use super::Reader;
use super::header::{Element, Encoding, Scalar};
use crate::scan::colour;
use crate::scan::error::ScanFault;
use rayon::prelude::*;

/// The names of the numbers that are taken of a vertex.
const NAMES: [&[&str]; 12] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx"],
    &["ny"],
    &["nz"],
    &["s", "u", "texture_u"],
    &["t", "v", "texture_v"],
    &["red", "diffuse_red", "r"],
    &["green", "diffuse_green", "g"],
    &["blue", "diffuse_blue", "b"],
    &["intensity", "scalar_intensity", "reflectance", "scalar_reflectance"],
];
const NORMAL: usize = 3;
const TEXCOORD: usize = 6;
const RED: usize = 8;
const INTENSITY: usize = 11;
/// The numbers of a vertex whose row has none of them.
const NONE: [f64; NAMES.len()] = {
    let mut none = [f64::NAN; NAMES.len()];
    (none[TEXCOORD], none[TEXCOORD + 1]) = (0.0, 0.0);
    none
};

/// The names of the components of a colour.
pub(super) const COLOUR: [&[&str]; 3] = [NAMES[RED], NAMES[RED + 1], NAMES[RED + 2]];

/// The place of a vertex's property in `NAMES`. Properties of which there are two (`red` and `diffuse_red`) count once.
/// Names in capitals (`X`) are taken where the usual ones are not there; those of texture coordinates are not, which
/// `T` and `U` of other things resemble.
fn slots(element: &Element) -> Vec<Option<usize>> {
    let mut slots = vec![None; element.properties.len()];
    let exact = |names: &[&str], name: &str| names.contains(&name);
    let alike = |names: &[&str], name: &str| names.iter().any(|known| known.eq_ignore_ascii_case(name));
    for (at, property) in element.properties.iter().enumerate().filter(|(_, p)| p.count.is_none()) {
        let slot = NAMES
            .iter()
            .enumerate()
            .position(|(k, names)| if k < RED { exact(names, property.name) } else { alike(names, property.name) });
        slots[at] = slot.filter(|slot| !slots.contains(&Some(*slot)));
    }
    for (at, property) in element.properties.iter().enumerate().filter(|(_, p)| p.count.is_none()) {
        let slot = NAMES[..TEXCOORD].iter().position(|names| alike(names, property.name));
        if slots[at].is_none() && !slots.contains(&slot) {
            slots[at] = slot;
        }
    }
    slots
}

/// Colours from numbers of a type.
pub(super) fn of_type(scalar: Scalar, colours: &[[f32; 3]]) -> Vec<[u8; 3]> {
    match scalar {
        Scalar::F32 | Scalar::F64 => colour::of_numbers(colours),
        Scalar::U16 => colours.iter().map(|colour| colour.map(|c| colour::byte(c / 257.0))).collect(),
        _ => colours.iter().map(|colour| colour.map(colour::byte)).collect(),
    }
}

/// What vertices have.
#[derive(Clone, Copy)]
struct Kinds {
    normals: bool,
    texcoords: bool,
    /// The type of all three components.
    colours: Option<Scalar>,
    intensities: bool,
}

impl Kinds {
    fn of(element: &Element, slots: &[Option<usize>]) -> Self {
        let has = |k: usize| slots.contains(&Some(k));
        let scalar = |k: usize| slots.iter().position(|s| *s == Some(k)).map(|at| element.properties[at].scalar);
        let [red, green, blue] = [0, 1, 2].map(|k| scalar(RED + k));
        Self {
            normals: (NORMAL..TEXCOORD).any(has),
            texcoords: has(TEXCOORD) || has(TEXCOORD + 1),
            colours: red.filter(|_| red == green && red == blue),
            intensities: has(INTENSITY),
        }
    }
}

impl Reader<'_> {
    pub(super) fn read_vertices(&mut self, element: &Element) -> Result<(), ScanFault> {
        let slots = slots(element);
        let kinds = Kinds::of(element, &slots);
        let no_colour = |slot: usize| kinds.colours.is_none() && (RED..RED + 3).contains(&slot);
        let unread = element.properties.iter().zip(&slots).filter(|(_, slot)| slot.is_none_or(no_colour));
        self.raw.ignored.extend(unread.map(|(property, _)| property.name.to_owned()));
        let mut colours = Vec::new();
        if !self.read_plain_vertices(element, &slots, kinds, &mut colours) {
            self.read_rows(element, 1, |reader, _, _, row| {
                let mut values = NONE;
                for (slot, numbers) in slots.iter().zip(row) {
                    if let (Some(slot), [number]) = (slot, &numbers[..]) {
                        values[*slot] = *number;
                    }
                }
                let of = |k: usize| [values[k], values[k + 1], values[k + 2]];
                reader.raw.positions.push(of(0));
                reader.raw.normals.extend(kinds.normals.then(|| of(NORMAL)));
                reader.raw.texcoords.extend(kinds.texcoords.then(|| [values[TEXCOORD], values[TEXCOORD + 1]]));
                colours.extend(kinds.colours.map(|_| of(RED).map(|c| c as f32)));
                reader.raw.attributes.intensities.extend(kinds.intensities.then(|| values[INTENSITY] as f32));
                Ok(())
            })?;
        }
        self.raw.attributes.colours = kinds.colours.map_or_else(Vec::new, |scalar| of_type(scalar, &colours));
        Ok(())
    }

    /// Reads vertices of a binary file whose rows have one size, all at the same time; false where they have not, or
    /// the file is cut off.
    fn read_plain_vertices(
        &mut self,
        element: &Element,
        slots: &[Option<usize>],
        kinds: Kinds,
        colours: &mut Vec<[f32; 3]>,
    ) -> bool {
        let mut places = [None; NAMES.len()];
        let mut size = 0;
        for (property, slot) in element.properties.iter().zip(slots) {
            if let Some(slot) = slot {
                places[*slot] = Some((size, property.scalar));
            }
            size += property.scalar.bytes();
        }
        let plain = self.encoding != Encoding::Ascii && element.properties.iter().all(|p| p.count.is_none());
        let length = element.count.checked_mul(size).filter(|length| plain && *length <= self.rest.len());
        let Some((rows, rest)) = length.map(|length| self.rest.split_at(length)).filter(|(rows, _)| !rows.is_empty())
        else {
            return false;
        };
        self.rest = rest;
        let big_endian = self.encoding == Encoding::BigEndian;
        let rows = || rows.par_chunks_exact(size).with_min_len(1 << 12);
        let number = |row: &[u8], k: usize| {
            places[k].map_or(NONE[k], |(at, scalar): (usize, Scalar)| scalar.number(&row[at..], big_endian))
        };
        let three = |row: &[u8], k: usize| [number(row, k), number(row, k + 1), number(row, k + 2)];
        let raw = &mut self.raw;
        raw.positions = rows().map(|row| three(row, 0)).collect();
        if kinds.normals {
            raw.normals = rows().map(|row| three(row, NORMAL)).collect();
        }
        if kinds.texcoords {
            raw.texcoords = rows().map(|row| [number(row, TEXCOORD), number(row, TEXCOORD + 1)]).collect();
        }
        if kinds.colours.is_some() {
            *colours = rows().map(|row| three(row, RED).map(|c| c as f32)).collect();
        }
        if kinds.intensities {
            raw.attributes.intensities = rows().map(|row| number(row, INTENSITY) as f32).collect();
        }
        true
    }
}
