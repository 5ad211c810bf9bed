//! The fields of points in an E57 file: their names, and how their values are packed.

/// What is read of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Name {
    X,
    Y,
    Z,
    CartesianState,
    Range,
    Azimuth,
    Elevation,
    SphericalState,
    Red,
    Green,
    Blue,
    ColourState,
    Intensity,
    IntensityState,
    NormalX,
    NormalY,
    NormalZ,
    Row,
    Column,
}

impl Name {
    /// Number of names.
    pub(super) const COUNT: usize = ELEMENTS.len();

    /// The field that an element describes, of the format itself or of one of its extensions; none where it is not
    /// read.
    pub(super) fn of(element: &str, own: bool) -> Option<Self> {
        let (.., name) = ELEMENTS.into_iter().find(|(known, is_own, _)| *known == element && *is_own == own)?;
        Some(name)
    }
}

/// Elements, whether they belong to the format itself, and their fields in the order of their numbers. Normals are an
/// extension (libe57.org, E57_NOR_surface_normals).
const ELEMENTS: [(&str, bool, Name); 19] = [
    ("cartesianX", true, Name::X),
    ("cartesianY", true, Name::Y),
    ("cartesianZ", true, Name::Z),
    ("cartesianInvalidState", true, Name::CartesianState),
    ("sphericalRange", true, Name::Range),
    ("sphericalAzimuth", true, Name::Azimuth),
    ("sphericalElevation", true, Name::Elevation),
    ("sphericalInvalidState", true, Name::SphericalState),
    ("colorRed", true, Name::Red),
    ("colorGreen", true, Name::Green),
    ("colorBlue", true, Name::Blue),
    ("isColorInvalid", true, Name::ColourState),
    ("intensity", true, Name::Intensity),
    ("isIntensityInvalid", true, Name::IntensityState),
    ("normalX", false, Name::NormalX),
    ("normalY", false, Name::NormalY),
    ("normalZ", false, Name::NormalZ),
    ("rowIndex", true, Name::Row),
    ("columnIndex", true, Name::Column),
];

/// How the values of a field are packed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// 32 bits each.
    Single,
    /// 64 bits each.
    Double,
    /// Integers from `low` to `high`, in as many bits as their differences to `low` need; they mean `scale` times the
    /// integer plus `offset`.
    Integer { low: i64, high: i64, scale: f64, offset: f64 },
    /// Something that is left out, with an unknown number of bits.
    Other,
}

impl Kind {
    /// Bits of a value.
    pub(super) fn bits(self) -> u32 {
        match self {
            Self::Single => 32,
            Self::Double => 64,
            Self::Integer { low, high, .. } => u64::BITS - high.wrapping_sub(low).cast_unsigned().leading_zeros(),
            Self::Other => 0,
        }
    }
}

/// A field of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Field {
    /// None where it is not read.
    pub(super) name: Option<Name>,
    pub(super) kind: Kind,
    /// The smallest and the largest value that it may have, where that is stated.
    pub(super) range: Option<[f64; 2]>,
}

/// Values of a field that are still packed.
#[derive(Clone, Debug, Default)]
pub(super) struct Stream {
    bytes: Vec<u8>,
    /// The first bit that has not been read.
    bit: usize,
}

impl Stream {
    pub(super) fn append(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.bit / 8);
        self.bit %= 8;
        self.bytes.extend_from_slice(bytes);
    }

    /// Number of bytes that wait.
    pub(super) fn len(&self) -> usize {
        self.bytes.len()
    }

    /// Number of whole values that wait, of so many bits (not 0).
    pub(super) fn values(&self, bits: u32) -> usize {
        (8 * self.bytes.len() - self.bit) / bits as usize
    }

    /// Passes over values.
    pub(super) fn skip(&mut self, kind: Kind, count: usize) {
        self.bit += count * kind.bits() as usize;
    }

    /// Takes values, as many as `out` has room for; so many must be there.
    pub(super) fn take(&mut self, kind: Kind, out: &mut [f64]) {
        let start = &self.bytes[self.bit / 8..];
        match kind {
            Kind::Single => {
                for (out, bytes) in out.iter_mut().zip(start.as_chunks().0) {
                    *out = f32::from_le_bytes(*bytes).into();
                }
            }
            Kind::Double => {
                for (out, bytes) in out.iter_mut().zip(start.as_chunks().0) {
                    *out = f64::from_le_bytes(*bytes);
                }
            }
            Kind::Integer { low, scale, offset, .. } => {
                let bits = kind.bits();
                for (k, out) in out.iter_mut().enumerate() {
                    let value = low.wrapping_add(self.unpack(self.bit + k * bits as usize, bits).cast_signed());
                    *out = value as f64 * scale + offset;
                }
            }
            Kind::Other => out.fill(0.0),
        }
        self.skip(kind, out.len());
    }

    /// An integer of so many bits, the least significant first.
    fn unpack(&self, bit: usize, bits: u32) -> u64 {
        let (first, shift) = (bit / 8, bit % 8);
        // 64 bits that begin within a byte touch nine of them.
        let word = match self.bytes.get(first..first + 16) {
            Some(word) if shift + bits as usize <= 64 => {
                u64::from_le_bytes(*word.first_chunk().unwrap_or(&[0; 8])) >> shift
            }
            Some(word) => (u128::from_le_bytes(*word.first_chunk().unwrap_or(&[0; 16])) >> shift) as u64,
            None => {
                let rest = &self.bytes[first.min(self.bytes.len())..];
                let mut word = [0; 16];
                word[..rest.len()].copy_from_slice(rest);
                (u128::from_le_bytes(word) >> shift) as u64
            }
        };
        if bits == u64::BITS { word } else { word & ((1 << bits) - 1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_in_the_order_of_their_numbers() {
        for (index, (_, _, name)) in ELEMENTS.into_iter().enumerate() {
            assert_eq!(name as usize, index);
        }
    }

    #[test]
    fn integers_of_any_width_are_unpacked() {
        for bits in 1..=64_u32 {
            let mask = u64::MAX >> (64 - bits);
            let values: Vec<u64> =
                (1..100_u64).map(|k| k.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(k as u32) & mask).collect();
            let mut bytes = vec![0_u8; (values.len() * bits as usize).div_ceil(8)];
            for (k, value) in values.iter().enumerate() {
                for b in (0..bits as usize).filter(|b| value >> b & 1 == 1) {
                    let at = k * bits as usize + b;
                    bytes[at / 8] |= 1 << (at % 8);
                }
            }
            let mut stream = Stream::default();
            // In two parts, so that a value lies across both.
            let (first, second) = bytes.split_at(bytes.len() / 2);
            stream.append(first);
            let kind = Kind::Integer { low: 0, high: mask.cast_signed(), scale: 1.0, offset: 0.0 };
            assert_eq!(kind.bits(), bits);
            let mut read = vec![0.0; values.len()];
            let early = stream.values(bits);
            stream.take(kind, &mut read[..early]);
            stream.append(second);
            stream.take(kind, &mut read[early..]);
            let expected: Vec<f64> = values.iter().map(|v| v.cast_signed() as f64).collect();
            assert_eq!(read, expected, "{bits} bits");
        }
        assert_eq!(Kind::Integer { low: 7, high: 7, scale: 1.0, offset: 0.0 }.bits(), 0);
        assert_eq!(Kind::Integer { low: i64::MIN, high: i64::MAX, scale: 1.0, offset: 0.0 }.bits(), 64);
        assert_eq!(Kind::Integer { low: -262_144, high: 262_143, scale: 1.0, offset: 0.0 }.bits(), 19);
    }
}
