//! Numbers as the page's script reads them: differences from what their neighbours let expect, in planes of bytes,
//! deflated, in base64. data.js has the other direction.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use std::io::Write;

/// Planes of bytes, one after the other.
#[derive(Default)]
pub(super) struct Planes {
    bytes: Vec<u8>,
}

impl Planes {
    /// Appends bytes as they are.
    pub(super) fn bytes(&mut self, bytes: impl IntoIterator<Item = u8>) {
        self.bytes.extend(bytes);
    }

    /// Appends whole numbers, small ones of either sign in few bits: a plane of the lowest bytes, then one of the next,
    /// up to `width` of them.
    pub(super) fn numbers(&mut self, numbers: &[i32], width: usize) {
        for byte in 0..width {
            self.bytes.extend(numbers.iter().map(|n| (zigzag(*n) >> (8 * byte)) as u8));
        }
    }

    /// Appends a sequence that runs on smoothly, such as the coordinates along a curve, by its second differences.
    pub(super) fn smooth(&mut self, values: &[u16]) {
        let before = |i: usize, back: usize| if i < back { 0 } else { i32::from(values[i - back]) };
        // Modulo 65536, so that two bytes are enough.
        let difference = |i: usize| (i32::from(values[i]) - 2 * before(i, 1) + before(i, 2)) as i16;
        let differences: Vec<i32> = (0..values.len()).map(|i| i32::from(difference(i))).collect();
        self.numbers(&differences, 2);
    }

    /// All of it as text.
    pub(super) fn text(self) -> String {
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
        // Writing to memory does not fail.
        let _ = encoder.write_all(&self.bytes);
        STANDARD.encode(encoder.finish().unwrap_or_default())
    }
}

/// 0, -1, 1, -2, ... as 0, 1, 2, 3, ...
fn zigzag(n: i32) -> u32 {
    ((n << 1) ^ (n >> 31)) as u32
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::io::Read;

    /// What [`Planes::text`] holds.
    pub(in crate::export::report) fn unpacked(text: &str) -> Vec<u8> {
        let mut bytes = Vec::new();
        let packed = STANDARD.decode(text).expect("base64");
        flate2::read::DeflateDecoder::new(&*packed).read_to_end(&mut bytes).expect("deflate");
        bytes
    }

    #[test]
    fn numbers_are_in_planes() {
        let mut planes = Planes::default();
        planes.bytes([7]);
        planes.numbers(&[0, -1, 1, -2, 300], 2);
        assert_eq!(unpacked(&planes.text()), [7, 0, 1, 2, 3, 88, 0, 0, 0, 0, 2]);
    }

    #[test]
    fn smooth_sequences_wrap_around() {
        let values = [65535, 0, 1, 40000, 2];
        let mut planes = Planes::default();
        planes.smooth(&values);
        let bytes = unpacked(&planes.text());
        let (mut before, mut last) = (0_u16, 0_u16);
        for (i, value) in values.iter().enumerate() {
            let code = u32::from(bytes[i]) | u32::from(bytes[values.len() + i]) << 8;
            let difference = (code >> 1) as i32 ^ -((code & 1) as i32);
            let read = (i32::from(last) * 2 - i32::from(before) + difference) as u16;
            assert_eq!(read, *value);
            (before, last) = (last, read);
        }
    }
}
