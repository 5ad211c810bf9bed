//! The points of a scan: packets of a compressed vector (ASTM E2807, 9.3), unpacked field by field.

use super::FORMAT;
use super::description::Described;
use super::field::{Kind, Name, Stream};
use super::pages::{Pages, at_byte, logical, physical};
use crate::scan::cloud::BATCH;
use crate::scan::error::ScanFault;

/// Bytes of the header of a section.
const SECTION: u64 = 32;
/// Bytes of fields that wait for those of other fields. Programs write them in step, packet by packet.
const MOST_WAITING: usize = 64 << 20;
/// Points without any bits are all the same: so many are taken.
const MOST_EQUAL: u64 = BATCH as u64;

/// Values of some points, by field: of those that a scan has.
pub(super) struct Columns {
    values: Vec<Vec<f64>>,
    /// Number of points.
    pub(super) count: usize,
}

impl Columns {
    /// The values of a field; empty where the scan has none.
    pub(super) fn of(&self, name: Name) -> &[f64] {
        let values = &self.values[name as usize];
        &values[..values.len().min(self.count)]
    }
}

/// Reads the points of a scan.
pub(super) struct Vector<'a> {
    pages: &'a mut Pages,
    index: usize,
    scan: &'a Described,
    streams: Vec<Stream>,
    packet: Vec<u8>,
    /// The logical position of the next packet.
    position: u64,
    /// That of the end of the section.
    end: u64,
    pub(super) done: u64,
    pub(super) columns: Columns,
}

impl<'a> Vector<'a> {
    /// Begins the scan of an index.
    pub(super) fn new(pages: &'a mut Pages, index: usize, scan: &'a Described) -> Result<Self, ScanFault> {
        let mut values = vec![Vec::new(); Name::COUNT];
        for name in scan.fields.iter().filter_map(|field| field.name) {
            values[name as usize] = vec![0.0; BATCH];
        }
        let streams = vec![Stream::default(); scan.fields.len()];
        let columns = Columns { values, count: 0 };
        let mut vector =
            Self { pages, index, scan, streams, packet: Vec::new(), position: 0, end: 0, done: 0, columns };
        if scan.records > 0 {
            vector.open()?;
        }
        Ok(vector)
    }

    fn fault(&self, position: u64, message: impl Into<String>) -> ScanFault {
        let place = format!("scan {}, {}", self.index, at_byte(physical(position)));
        ScanFault::malformed(FORMAT, place, message)
    }

    /// The logical position of a physical one that the file states.
    fn stated(&self, position: u64, what: &str) -> Result<u64, ScanFault> {
        logical(position).filter(|position| *position < self.pages.len()).ok_or_else(|| {
            let message = format!("{what} are said to be at byte {position}, where there are none; the file is damaged or cut off: export or copy it again");
            ScanFault::malformed(FORMAT, format!("scan {}", self.index), message)
        })
    }

    fn open(&mut self) -> Result<(), ScanFault> {
        let start = self.stated(self.scan.offset, "its points")?;
        let mut header = [0; SECTION as usize];
        self.pages.read(start, &mut header)?;
        let word = |at: usize| u64::from_le_bytes(*header[at..].first_chunk().unwrap_or(&[0; 8]));
        if header[0] != 1 {
            let message = format!("a section of points was expected (1), found {}; export the file again", header[0]);
            return Err(self.fault(start, message));
        }
        self.position = self.stated(word(16), "the packets of its points")?;
        self.end = start.saturating_add(word(8)).min(self.pages.len());
        let bits: u64 = self.scan.fields.iter().map(|f| u64::from(f.kind.bits())).sum();
        if bits == 0 && self.scan.records > MOST_EQUAL {
            let message = format!("its {} points have no bits: all of them are the same", self.scan.records);
            return Err(self.fault(start, message));
        }
        let room = self.end.saturating_sub(self.position);
        if u128::from(self.scan.records) * u128::from(bits) > 8 * u128::from(room) {
            let message = format!(
                "{} points of {bits} bits are announced, but only {room} bytes follow; the file is cut off: export or copy it again",
                self.scan.records
            );
            return Err(self.fault(self.position, message));
        }
        Ok(())
    }

    /// Unpacks the next points into the columns; false where there are no more.
    pub(super) fn advance(&mut self) -> Result<bool, ScanFault> {
        let left = self.scan.records - self.done;
        if left == 0 {
            return Ok(false);
        }
        let mut ready = self.ready();
        while ready == 0 {
            self.read_packet()?;
            ready = self.ready();
        }
        let count = ready.min(BATCH).min(usize::try_from(left).unwrap_or(BATCH));
        for (field, stream) in self.scan.fields.iter().zip(&mut self.streams) {
            match field.name {
                Some(name) => stream.take(field.kind, &mut self.columns.values[name as usize][..count]),
                None => stream.skip(field.kind, count),
            }
        }
        self.columns.count = count;
        self.done += count as u64;
        Ok(true)
    }

    /// Number of points of which all fields are there.
    fn ready(&self) -> usize {
        let packed = self.scan.fields.iter().zip(&self.streams).filter(|(field, _)| field.kind.bits() > 0);
        packed.map(|(field, stream)| stream.values(field.kind.bits())).min().unwrap_or(BATCH)
    }

    fn read_packet(&mut self) -> Result<(), ScanFault> {
        let start = self.position;
        if start + 4 > self.end {
            let message = format!(
                "the points end after {} of {}; the file is cut off: export or copy it again",
                self.done, self.scan.records
            );
            return Err(self.fault(start, message));
        }
        let mut head = [0; 4];
        self.pages.read(start, &mut head)?;
        let length = usize::from(u16::from_le_bytes([head[2], head[3]])) + 1;
        self.position += length.next_multiple_of(4) as u64;
        match head[0] {
            // Packets of an index, and empty ones.
            0 | 2 => Ok(()),
            1 => {
                self.packet.resize(length, 0);
                self.pages.read(start, &mut self.packet)?;
                self.take_packet(start)
            }
            other => {
                let message =
                    format!("a packet of the kind 0, 1 or 2 was expected, found {other}; export the file again");
                Err(self.fault(start, message))
            }
        }
    }

    /// Appends the bytes of the packet to those of the fields.
    fn take_packet(&mut self, start: u64) -> Result<(), ScanFault> {
        let fields = self.streams.len();
        let word = |at: usize| self.packet.get(at..at + 2).map_or(0, |w| usize::from(u16::from_le_bytes([w[0], w[1]])));
        let lengths: Vec<usize> = (0..fields).map(|k| word(6 + 2 * k)).collect();
        let mut from = 6 + 2 * fields;
        if word(4) != fields || from + lengths.iter().sum::<usize>() > self.packet.len() {
            let message = format!(
                "a packet of {} bytes with {fields} fields was expected, found {} fields and {} bytes of them; export the file again",
                self.packet.len(),
                word(4),
                lengths.iter().sum::<usize>()
            );
            return Err(self.fault(start, message));
        }
        for ((field, stream), length) in self.scan.fields.iter().zip(&mut self.streams).zip(lengths) {
            if field.kind != Kind::Other {
                stream.append(&self.packet[from..from + length]);
            }
            from += length;
        }
        if self.streams.iter().map(Stream::len).sum::<usize>() > MOST_WAITING {
            let message = "the fields of its points are out of step: one of them ends; export the file again";
            return Err(self.fault(start, message));
        }
        Ok(())
    }

    /// Whether points follow the last one that is announced.
    pub(super) fn has_more(&mut self) -> Result<bool, ScanFault> {
        let mut head = [0];
        if self.scan.records == 0 || self.position + 4 > self.end {
            return Ok(false);
        }
        self.pages.read(self.position, &mut head)?;
        Ok(head[0] == 1)
    }
}
