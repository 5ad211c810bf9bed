//! The points of a LAS file, from the bytes that each has.

use super::header::Header;
use crate::scan::cloud::RawPoint;

/// Points of these classes are noise: low, and high.
const NOISE: [u8; 2] = [7, 18];
/// Colours have 16 bits, but many programs write 8 of them.
const EIGHT_BITS: u16 = 255;

/// How a point is made of its bytes.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    scale: [f64; 3],
    offset: [f64; 3],
    /// Where the bits of its class and of its state are: formats of version 1.4 have a byte for each.
    is_new: bool,
    /// Whether the byte of the class has the state, too.
    has_state: bool,
    /// The byte at which its colour begins.
    colour: Option<usize>,
}

impl Layout {
    /// `height` is the unit of z as a part of that of x and y.
    pub(super) fn new(header: &Header, height: f64) -> Self {
        let colour = match header.format {
            2 => Some(20),
            3 | 5 => Some(28),
            7 | 8 | 10 => Some(30),
            _ => None,
        };
        let (mut scale, mut offset) = (header.scale, header.offset);
        scale[2] *= height;
        offset[2] *= height;
        Self { scale, offset, is_new: header.format >= 6, has_state: header.version > 0, colour }
    }

    pub(super) fn has_colours(&self) -> bool {
        self.colour.is_some()
    }

    /// Whether a point is withheld, or noise.
    pub(super) fn is_left_out(&self, bytes: &[u8]) -> bool {
        let (class, is_withheld) = match (self.is_new, self.has_state) {
            (true, _) => (bytes[16], bytes[15] & 4 != 0),
            (false, true) => (bytes[15] & 31, bytes[15] & 128 != 0),
            (false, false) => (bytes[15], false),
        };
        is_withheld || NOISE.contains(&class)
    }

    /// A colour as the file has it.
    pub(super) fn colour(&self, bytes: &[u8]) -> Option<[u16; 3]> {
        let start = &bytes[self.colour?..];
        Some([0, 2, 4].map(|k| u16::from_le_bytes([start[k], start[k + 1]])))
    }

    /// A point; `shift` is the number of bits that its colour has beyond eight.
    pub(super) fn point(&self, bytes: &[u8], shift: Shift) -> RawPoint {
        let integers = bytes.as_chunks::<4>().0;
        let coordinate = |k: usize| f64::from(i32::from_le_bytes(integers[k])) * self.scale[k] + self.offset[k];
        RawPoint {
            position: [0, 1, 2].map(coordinate),
            normal: None,
            colour: self.colour(bytes).map(|colour| colour.map(|c| shift.eight_bits(c))),
            intensity: Some(f32::from(u16::from_le_bytes([bytes[12], bytes[13]]))),
        }
    }
}

/// How colours are brought to eight bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shift {
    /// They have so many.
    None,
    /// They have sixteen.
    Eight,
}

impl Shift {
    /// That of a file whose largest value is this.
    pub(super) fn of(largest: u16) -> Self {
        if largest > EIGHT_BITS { Self::Eight } else { Self::None }
    }

    /// Whether a value is larger than was thought.
    pub(super) fn is_exceeded(self, value: u16) -> bool {
        self == Self::None && value > EIGHT_BITS
    }

    fn eight_bits(self, value: u16) -> u8 {
        match self {
            Self::None => value.min(EIGHT_BITS) as u8,
            Self::Eight => (value >> 8) as u8,
        }
    }
}
