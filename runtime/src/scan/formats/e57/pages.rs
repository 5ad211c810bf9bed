//! The pages of an E57 file: 1020 bytes of contents and a checksum of 4 bytes each (ASTM E2807, 6.2).
//!
//! Physical positions count all bytes of the file, logical ones only those of the contents.

use super::FORMAT;
use crate::scan::cloud::Source;
use crate::scan::error::ScanFault;
use std::io::SeekFrom;

/// Bytes of a page.
pub(crate) const PAGE: usize = 1024;
/// Bytes of its contents.
pub(crate) const CONTENT: usize = PAGE - 4;
/// Pages that are read at a time.
const PAGES: usize = 64;

/// The contents of a file. A page is checked when its contents are read, so that faults of pages that nobody needs
/// (pictures) do not matter.
pub(super) struct Pages {
    source: Box<dyn Source>,
    /// Number of pages.
    count: u64,
    /// The contents of pages that follow each other, checked.
    block: Vec<u8>,
    /// The first of them.
    first: u64,
    raw: Vec<u8>,
    /// The page at which the source is.
    next: u64,
}

impl Pages {
    /// Pages that a file of a size has; a last one that is cut off does not count.
    pub(super) fn new(source: Box<dyn Source>, size: u64) -> Self {
        Self { source, count: size / PAGE as u64, block: Vec::new(), first: 0, raw: vec![0; PAGES * PAGE], next: 0 }
    }

    /// Number of bytes of the contents.
    pub(super) fn len(&self) -> u64 {
        self.count * CONTENT as u64
    }

    /// Fills a buffer from a logical position on.
    pub(super) fn read(&mut self, position: u64, out: &mut [u8]) -> Result<(), ScanFault> {
        let (mut position, mut out) = (position, out);
        while !out.is_empty() {
            let page = position / CONTENT as u64;
            if page < self.first || page >= self.first + (self.block.len() / CONTENT) as u64 {
                self.load(page)?;
            }
            let start = (position - self.first * CONTENT as u64) as usize;
            let count = out.len().min(self.block.len() - start);
            let (now, later) = out.split_at_mut(count);
            now.copy_from_slice(&self.block[start..start + count]);
            (position, out) = (position + count as u64, later);
        }
        Ok(())
    }

    /// Reads and checks a page, and those that follow as far as they are good.
    fn load(&mut self, page: u64) -> Result<(), ScanFault> {
        self.block.clear();
        self.first = page;
        let pages = PAGES.min(usize::try_from(self.count.saturating_sub(page)).unwrap_or(PAGES));
        if pages == 0 {
            let message = "the file ends here, but more is announced; it is cut off: export or copy it again";
            return Err(ScanFault::malformed(FORMAT, at_byte(self.count * PAGE as u64), message));
        }
        let raw = &mut self.raw[..pages * PAGE];
        // Seeking empties the source's buffer.
        if page != self.next {
            self.source.seek(SeekFrom::Start(page * PAGE as u64)).map_err(ScanFault::Unreadable)?;
        }
        self.source.read_exact(raw).map_err(ScanFault::Unreadable)?;
        self.next = page + pages as u64;
        for page in raw.as_chunks::<PAGE>().0 {
            let (content, sum) = page.split_at(CONTENT);
            if checksum(content).to_be_bytes() != *sum {
                break;
            }
            self.block.extend_from_slice(content);
        }
        if self.block.is_empty() {
            let message =
                "the checksum of the 1024 bytes from here on is wrong; the file is damaged: copy or export it again";
            return Err(ScanFault::malformed(FORMAT, at_byte(page * PAGE as u64), message));
        }
        Ok(())
    }
}

/// The place of a physical position in messages.
pub(super) fn at_byte(physical: u64) -> String {
    format!("byte {physical}")
}

/// The logical position of a physical one; none where that is within a checksum.
pub(super) fn logical(physical: u64) -> Option<u64> {
    let (page, rest) = (physical / PAGE as u64, physical % PAGE as u64);
    (rest < CONTENT as u64).then_some(page * CONTENT as u64 + rest)
}

/// The physical position of a logical one.
pub(crate) fn physical(logical: u64) -> u64 {
    logical / CONTENT as u64 * PAGE as u64 + logical % CONTENT as u64
}

/// CRC-32C of Castagnoli, eight bytes at a time with as many tables (Kounavis and Berry, 'A systematic approach to
/// building high performance software-based CRC generators', 2005).
pub(crate) fn checksum(bytes: &[u8]) -> u32 {
    let (eights, rest) = bytes.as_chunks::<8>();
    let mut sum = u32::MAX;
    for eight in eights {
        let word = u64::from_le_bytes(*eight) ^ u64::from(sum);
        sum = (0..8).fold(0, |sum, k| sum ^ TABLES[7 - k][(word >> (8 * k)) as usize & 0xff]);
    }
    !rest.iter().fold(sum, |sum, byte| TABLES[0][(sum ^ u32::from(*byte)) as usize & 0xff] ^ sum >> 8)
}

/// The remainders of a byte, and of a byte with 1 to 7 zeros behind it.
static TABLES: [[u32; 256]; 8] = {
    /// The polynomial, bits reversed.
    const POLYNOMIAL: u32 = 0x82f6_3b78;
    let mut tables = [[0; 256]; 8];
    let mut byte = 0;
    while byte < 256 {
        let (mut sum, mut bit) = (byte as u32, 0);
        while bit < 8 {
            sum = if sum & 1 == 1 { sum >> 1 ^ POLYNOMIAL } else { sum >> 1 };
            bit += 1;
        }
        tables[0][byte] = sum;
        byte += 1;
    }
    let mut zeros = 1;
    while zeros < 8 {
        let mut byte = 0;
        while byte < 256 {
            let before = tables[zeros - 1][byte];
            tables[zeros][byte] = tables[0][before as usize & 0xff] ^ before >> 8;
            byte += 1;
        }
        zeros += 1;
    }
    tables
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_those_of_castagnoli() {
        // The check value of the CRC catalogue, and RFC 3720, B.4.
        assert_eq!(checksum(b"123456789"), 0xe306_9283);
        assert_eq!(checksum(&[0; 32]), 0x8a91_36aa);
        assert_eq!(checksum(&[0xff; 32]), 0x62a8_ab43);
    }

    #[test]
    fn positions_count_with_and_without_checksums() {
        for (with, without) in [(0, 0), (1019, 1019), (1024, 1020), (2050, 2042)] {
            assert_eq!((logical(with), physical(without)), (Some(without), with));
        }
        assert_eq!(logical(1020), None);
    }
}
