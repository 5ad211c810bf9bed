//! The header of a LAS file, and the records of variable length behind it (ASPRS LAS 1.0 to 1.4).

use super::FORMAT;
use crate::scan::cloud::{Points, Source};
use crate::scan::error::ScanFault;
use std::io::SeekFrom;

/// Bytes of the header of the oldest version.
const SHORTEST: usize = 227;
/// Bytes of that of version 1.4.
const LONGEST: usize = 375;
/// Bytes in front of the contents of a record, in front of the points and behind them.
const RECORD: [u64; 2] = [54, 60];
/// The most bytes of a record that are kept: coordinate systems and keys are far shorter.
const MOST_KEPT: u64 = 1 << 20;
/// Bytes of a point by format.
const POINT: [u16; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// What is needed of a header.
#[derive(Clone, Debug, Default)]
pub(super) struct Header {
    /// 0 to 4: the second part of the version.
    pub(super) version: u8,
    /// 0 to 10.
    pub(super) format: u8,
    pub(super) is_compressed: bool,
    /// Bytes of a point.
    pub(super) length: u16,
    /// Number of points.
    pub(super) count: u64,
    /// The byte at which they begin.
    pub(super) start: u64,
    /// The byte behind them, if they are not compressed.
    pub(super) end: u64,
    pub(super) scale: [f64; 3],
    pub(super) offset: [f64; 3],
    /// The corners of the box of the points.
    pub(super) bounds: [[f64; 3]; 2],
    /// Whether the coordinate system is said as well-known text.
    pub(super) says_text: bool,
    /// Records that are read: coordinate systems, and how the points are packed.
    pub(super) records: Vec<Record>,
}

/// A record of variable length.
#[derive(Clone, Debug)]
pub(super) struct Record {
    pub(super) user: String,
    pub(super) id: u16,
    pub(super) bytes: Vec<u8>,
}

/// Little-endian numbers of a header.
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    fn bytes<const N: usize>(&self, at: usize) -> [u8; N] {
        self.0.get(at..).and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; N])
    }

    fn u16(&self, at: usize) -> u16 {
        u16::from_le_bytes(self.bytes(at))
    }

    fn u32(&self, at: usize) -> u32 {
        u32::from_le_bytes(self.bytes(at))
    }

    fn u64(&self, at: usize) -> u64 {
        u64::from_le_bytes(self.bytes(at))
    }

    fn f64(&self, at: usize) -> f64 {
        f64::from_le_bytes(self.bytes(at))
    }
}

fn fault(message: impl Into<String>) -> ScanFault {
    ScanFault::malformed(FORMAT, "header", message)
}

impl Header {
    /// Reads the header of a file of a size.
    pub(super) fn read(source: &mut dyn Source, size: u64, points: &mut dyn Points) -> Result<Self, ScanFault> {
        let mut bytes = vec![0; LONGEST.min(usize::try_from(size).unwrap_or(LONGEST))];
        source.read_exact(&mut bytes).map_err(ScanFault::Unreadable)?;
        if bytes.len() < SHORTEST {
            let message = format!(
                "{SHORTEST} bytes were expected, the file ends after {size}; it is cut off: export or copy it again"
            );
            return Err(fault(message));
        }
        let stated = usize::from(Numbers(&bytes).u16(94)).max(SHORTEST);
        bytes.truncate(stated);
        let (numbers, version) = (Numbers(&bytes), bytes[25]);
        if !bytes.starts_with(b"LASF") {
            return Err(fault("`LASF` was expected at its beginning; export the file again"));
        }
        if bytes[24] != 1 || version > 4 {
            let message =
                format!("version 1.0 to 1.4 was expected, found {}.{version}; export the file as LAS 1.4", bytes[24]);
            return Err(fault(message));
        }
        let triple = |at: usize| [0, 8, 16].map(|k| numbers.f64(at + k));
        let mut header = Self {
            version,
            // LASzip sets the highest bit.
            format: bytes[104] & 0x3f,
            is_compressed: bytes[104] & 0x80 != 0,
            length: numbers.u16(105),
            start: numbers.u32(96).into(),
            end: size,
            scale: triple(131),
            offset: triple(155),
            bounds: [[187, 203, 219], [179, 195, 211]].map(|at| at.map(|at| numbers.f64(at))),
            says_text: numbers.u16(6) & 0x10 != 0,
            ..Self::default()
        };
        header.check_numbers()?;
        header.set_count(&numbers, points)?;
        header.read_records(source, stated as u64, numbers.u32(100), size, points)?;
        if version == 4 && bytes.len() == LONGEST {
            header.read_late_records(source, [numbers.u64(235), numbers.u32(243).into()], size, points)?;
        }
        // Wave packets may lie behind the points.
        let waves = numbers.u64(227);
        if version >= 3 && bytes.len() >= 235 && waves >= header.start && waves < header.end && waves > 0 {
            header.end = waves;
        }
        Ok(header)
    }

    fn check_numbers(&self) -> Result<(), ScanFault> {
        let Some(least) = POINT.get(usize::from(self.format)) else {
            let message =
                format!("points of a format 0 to 10 were expected, found {}; export the file as LAS 1.4", self.format);
            return Err(fault(message));
        };
        if self.length < *least {
            let message = format!(
                "points of format {} have {least} bytes or more, not {}; export the file again",
                self.format, self.length
            );
            return Err(fault(message));
        }
        let numbers = self.scale.iter().chain(&self.offset);
        if !numbers.into_iter().all(|n| n.is_finite()) || self.scale.contains(&0.0) {
            let message =
                "a scale of the coordinates is 0, or a scale or an offset is not finite; export the file again";
            return Err(fault(message));
        }
        Ok(())
    }

    /// Version 1.4 has a number of points in 64 bits besides the old one in 32.
    fn set_count(&mut self, numbers: &Numbers, points: &mut dyn Points) -> Result<(), ScanFault> {
        let old = u64::from(numbers.u32(107));
        let new = if self.version == 4 { numbers.u64(247) } else { 0 };
        self.count = if new > 0 { new } else { old };
        if new > 0 && old > 0 && new != old {
            points.warn(format!(
                "its header announces {new} points, and {old} in the field of older versions; the former holds"
            ));
        }
        Ok(())
    }

    /// Keeps the records in front of the points.
    fn read_records(
        &mut self,
        source: &mut dyn Source,
        from: u64,
        count: u32,
        size: u64,
        points: &mut dyn Points,
    ) -> Result<(), ScanFault> {
        if self.start < from || self.start > size {
            let message = format!(
                "the points are said to begin at byte {}, but the header ends at {from} and the file at {size}; it is cut off or damaged: export or copy it again",
                self.start
            );
            return Err(fault(message));
        }
        let mut at = from;
        source.seek(SeekFrom::Start(at)).map_err(ScanFault::Unreadable)?;
        for index in 0..count {
            let Some(next) = self.keep_record(source, at, self.start, RECORD[0])? else {
                points.warn(format!(
                    "of the {count} records behind its header {index} are read: the next one at byte {at} does not end before the points"
                ));
                break;
            };
            at = next;
        }
        Ok(())
    }

    /// Keeps the records behind the points, of version 1.4.
    fn read_late_records(
        &mut self,
        source: &mut dyn Source,
        [from, count]: [u64; 2],
        size: u64,
        points: &mut dyn Points,
    ) -> Result<(), ScanFault> {
        if count == 0 {
            return Ok(());
        }
        if from < self.start || from > size {
            points.warn(format!("its {count} records at byte {from} are left out, as they are not behind its points"));
            return Ok(());
        }
        self.end = from;
        let mut at = from;
        source.seek(SeekFrom::Start(at)).map_err(ScanFault::Unreadable)?;
        for index in 0..count {
            let Some(next) = self.keep_record(source, at, size, RECORD[1])? else {
                points.warn(format!(
                    "of the {count} records behind its points {index} are read; the file may be cut off"
                ));
                break;
            };
            at = next;
        }
        Ok(())
    }

    /// Keeps the record at a byte, where the source is, if it is of use. The byte behind it, where the source is then,
    /// or none if that is behind an end.
    fn keep_record(&mut self, source: &mut dyn Source, at: u64, end: u64, head: u64) -> Result<Option<u64>, ScanFault> {
        let Some(start) = at.checked_add(head).filter(|start| *start <= end) else { return Ok(None) };
        let mut bytes = vec![0; head as usize];
        source.read_exact(&mut bytes).map_err(ScanFault::Unreadable)?;
        let numbers = Numbers(&bytes);
        let length = if head == RECORD[0] { numbers.u16(20).into() } else { numbers.u64(20) };
        let Some(next) = start.checked_add(length).filter(|next| *next <= end) else { return Ok(None) };
        let user: String = bytes[2..18].iter().take_while(|b| **b != 0).map(|b| char::from(*b)).collect();
        let id = numbers.u16(18);
        let is_wanted = match user.as_str() {
            "LASF_Projection" => matches!(id, 2111 | 2112 | 34735 | 34736),
            "laszip encoded" => id == 22204,
            _ => false,
        };
        if length > MOST_KEPT {
            source.seek(SeekFrom::Start(next)).map_err(ScanFault::Unreadable)?;
            return Ok(Some(next));
        }
        // Reading is faster than seeking, as that empties the buffer.
        bytes.resize(length as usize, 0);
        source.read_exact(&mut bytes).map_err(ScanFault::Unreadable)?;
        if is_wanted && self.record(&user, id).is_none() {
            self.records.push(Record { user, id, bytes });
        }
        Ok(Some(next))
    }

    /// The bytes of the first record of a user and a number.
    pub(super) fn record(&self, user: &str, id: u16) -> Option<&[u8]> {
        let record = self.records.iter().find(|record| record.user == user && record.id == id)?;
        Some(&record.bytes)
    }

    /// Number of bytes of a point that the format itself does not need.
    pub(super) fn extra(&self) -> u16 {
        self.length - POINT[usize::from(self.format)]
    }
}
