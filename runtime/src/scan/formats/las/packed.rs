//! Compressed points (LAZ). What the decompressor takes from a file is checked before: it reserves memory for what the
//! file announces, and relies on the points being laid out as their format says.

use super::FORMAT;
use super::contained::contained;
use super::header::Header;
use crate::scan::cloud::Source;
use crate::scan::error::ScanFault;
use laz::laszip::ChunkTable;
use laz::{DecompressionSelection, LasZipDecompressor, LazItem, LazItemRecordBuilder, LazItemType, LazVlr};
use std::io::{BufReader, SeekFrom};

/// The most bytes of a part of the points in layers, which is unpacked as a whole; it has 50,000 points as a rule.
const MOST_BYTES: u64 = 256 << 20;
/// The most points for each byte of a file. Scans have less than one.
const MOST_DENSE: u64 = 64;
/// How points are packed: one by one, without parts and in parts; and field by field.
const WHOLE: u16 = 1;
const PARTS: u16 = 2;
const LAYERS: u16 = 3;

/// Unpacks points.
pub(super) struct Unpacker {
    unpacker: LasZipDecompressor<'static, Box<dyn Source>>,
}

impl Unpacker {
    /// Begins to unpack the points of a file of a size.
    pub(super) fn new(mut source: Box<dyn Source>, header: &Header, size: u64) -> Result<Self, ScanFault> {
        let packing = Packing::read(header)?;
        if header.count > MOST_DENSE.saturating_mul(size) {
            let message =
                format!("{} points are announced, but the file has only {size} bytes; export it again", header.count);
            return Err(ScanFault::malformed(FORMAT, "header", message));
        }
        if packing.kind != WHOLE {
            let table = Table::find(&mut *source, header, size)?;
            let parts = table.read(&mut *source, header, &packing.vlr)?;
            let check = if packing.kind == LAYERS { check_layers } else { check_parts };
            check(&mut *source, header, &packing, &table, &parts)?;
        }
        source.seek(SeekFrom::Start(header.start)).map_err(ScanFault::Unreadable)?;
        let fields = DecompressionSelection::xy_returns_channel()
            .decompress_z()
            .decompress_classification()
            .decompress_flags()
            .decompress_intensity()
            .decompress_rgb();
        let unpacker = contained(|| LasZipDecompressor::selective(source, packing.vlr, fields));
        let unpacker = unpacker.and_then(|unpacker| unpacker.map_err(|error| error.to_string()));
        let unpacker = unpacker.map_err(|why| fault(header.start, damaged(&why)))?;
        Ok(Self { unpacker })
    }

    /// Unpacks as many points as there is room for. The error says why that fails.
    pub(super) fn fill(&mut self, bytes: &mut [u8]) -> Result<(), String> {
        contained(|| self.unpacker.decompress_many(bytes)).and_then(|done| done.map_err(|error| error.to_string()))
    }
}

fn fault(at: u64, message: impl Into<String>) -> ScanFault {
    ScanFault::malformed(FORMAT, format!("byte {at}"), message)
}

/// The sentence on points that cannot be unpacked.
pub(super) fn damaged(why: &str) -> String {
    format!("the compressed points cannot be unpacked ({why}); the file is damaged or cut off: export or copy it again")
}

/// How the points are packed.
struct Packing {
    vlr: LazVlr,
    kind: u16,
    /// The number of layers of each part, if there are layers.
    layers: usize,
}

impl Packing {
    /// Reads the record on it. It must be as for points of the format.
    fn read(header: &Header) -> Result<Self, ScanFault> {
        let fault = |message: String| ScanFault::malformed(FORMAT, "record `laszip encoded`", message);
        let Some(bytes) = header.record("laszip encoded", 22204) else {
            return Err(fault(
                "the points are compressed, but there is no such record; compress them again".to_owned(),
            ));
        };
        let again = |why: String| fault(format!("it cannot be read ({why}); compress the points again"));
        let vlr = LazVlr::from_buffer(bytes).map_err(|error| again(error.to_string()))?;
        let expected = LazItemRecordBuilder::default_for_point_format_id(header.format, header.extra())
            .map_err(|error| again(error.to_string()))?;
        let kind = u16::from_le_bytes([bytes[0], bytes[1]]);
        let (kinds, versions) = if header.format >= 6 { ([LAYERS; 2], [3, 4]) } else { ([WHOLE, PARTS], [1, 2]) };
        let parts = |items: &[LazItem]| -> Vec<_> { items.iter().map(|i| (i.item_type(), i.size())).collect() };
        let is_known = vlr.items().iter().all(|item| versions.contains(&item.version())) && kinds.contains(&kind);
        if !is_known || parts(vlr.items()) != parts(&expected) {
            let (format, length) = (header.format, header.length);
            let message =
                format!("points of format {format} with {length} bytes are not packed so; compress them again");
            return Err(fault(message));
        }
        let layers = vlr.items().iter().map(|item| match item.item_type() {
            LazItemType::Point14 => 9,
            LazItemType::RGBNIR14 => 2,
            LazItemType::Byte14(count) => count.into(),
            _ => 1,
        });
        Ok(Self { kind, layers: layers.sum(), vlr })
    }

    /// The number of points of each part; none where they differ.
    fn points_of_parts(&self) -> Option<u64> {
        (!self.vlr.uses_variable_size_chunks()).then(|| self.vlr.chunk_size().into())
    }
}

/// Where the parts of the points begin and end.
struct Table {
    /// The byte at which the first part begins.
    first: u64,
    /// The byte behind the last one, at which the table is.
    end: u64,
}

impl Table {
    /// Finds it: where the points begin, or in the last bytes of a file that could not be written there.
    fn find(source: &mut dyn Source, header: &Header, size: u64) -> Result<Self, ScanFault> {
        let first = header.start + 8;
        let mut place = |at: u64| {
            let mut bytes = [0; 8];
            source.seek(SeekFrom::Start(at)).map_err(ScanFault::Unreadable)?;
            source.read_exact(&mut bytes).map_err(ScanFault::Unreadable)?;
            Ok::<_, ScanFault>(u64::from_le_bytes(bytes))
        };
        if first + 8 > size {
            return Err(fault(size, "the file ends before its points; it is cut off: export or copy it again"));
        }
        let mut end = place(header.start)?;
        // Places are signed; -1 stands for none.
        if end.cast_signed() <= header.start.cast_signed() {
            end = place(size - 8)?;
        }
        if end < first || end + 8 > size || end.cast_signed() < 0 {
            let message = format!(
                "the table of the compressed points is said to be at byte {end}, and the file ends at {size}; it is cut off: export or copy it again"
            );
            return Err(fault(header.start, message));
        }
        Ok(Self { first, end })
    }

    /// The numbers of points and bytes of the parts.
    fn read(&self, source: &mut dyn Source, header: &Header, vlr: &LazVlr) -> Result<Vec<[u64; 2]>, ScanFault> {
        let mut head = [0; 8];
        source.seek(SeekFrom::Start(self.end)).map_err(ScanFault::Unreadable)?;
        source.read_exact(&mut head).map_err(ScanFault::Unreadable)?;
        let parts = u64::from(u32::from_le_bytes([head[4], head[5], head[6], head[7]]));
        // Each part begins with a point that is not compressed.
        if parts * u64::from(header.length) > self.end - self.first {
            let message = format!(
                "{parts} parts of compressed points are said to be in front of it, more than there is room for; the file is damaged: export it again"
            );
            return Err(fault(self.end, message));
        }
        source.seek(SeekFrom::Start(self.end)).map_err(ScanFault::Unreadable)?;
        let mut source = BufReader::new(source);
        let table = contained(|| ChunkTable::read(&mut source, vlr.uses_variable_size_chunks()));
        let table = table.and_then(|table| table.map_err(|error| error.to_string()));
        let table = table.map_err(|why| fault(self.end, damaged(&why)))?;
        Ok(table.as_ref().iter().map(|part| [part.point_count, part.byte_count]).collect())
    }
}

/// Holds what the header announces against the points that there are.
fn check_count(header: &Header, found: u64, at: u64) -> Result<(), ScanFault> {
    let announced = header.count;
    if announced == found {
        return Ok(());
    }
    let message = if announced > found {
        format!(
            "the header announces {announced} points, the compressed ones end here after {found}; the file is cut off: export or copy it again"
        )
    } else {
        format!("the header announces {announced} points, and {} more follow; export the file again", found - announced)
    };
    Err(fault(at, message))
}

/// Checks parts whose points are packed one by one.
fn check_parts(
    _: &mut dyn Source,
    header: &Header,
    packing: &Packing,
    table: &Table,
    parts: &[[u64; 2]],
) -> Result<(), ScanFault> {
    let sum = |k: usize| parts.iter().map(|part| part[k]).fold(0, u64::saturating_add);
    if sum(1) > table.end - table.first {
        let message = "the compressed points in front of it are said to have more bytes than there are; the file is damaged: export it again";
        return Err(fault(table.end, message));
    }
    let Some(each) = packing.points_of_parts() else {
        if parts.iter().any(|part| part[0] == 0) {
            return Err(fault(table.end, "a part of the compressed points has none; export the file again"));
        }
        return check_count(header, sum(0), table.end);
    };
    // How full the last part is does not stand in the table.
    let most = each.saturating_mul(parts.len() as u64);
    let found = if most - each.min(most) < header.count { header.count.min(most) } else { most };
    check_count(header, found, table.end)
}

/// Checks parts in layers: each tells its number of points, and the bytes of its layers.
fn check_layers(
    source: &mut dyn Source,
    header: &Header,
    packing: &Packing,
    table: &Table,
    parts: &[[u64; 2]],
) -> Result<(), ScanFault> {
    let mut head = vec![0; usize::from(header.length) + 4 + 4 * packing.layers];
    let (mut at, mut found, mut index) = (table.first, 0_u64, 0);
    while at < table.end {
        let start = at + head.len() as u64;
        if start > table.end {
            return Err(fault(at, damaged("a part ends early")));
        }
        source.seek(SeekFrom::Start(at)).map_err(ScanFault::Unreadable)?;
        source.read_exact(&mut head).map_err(ScanFault::Unreadable)?;
        let words = head[usize::from(header.length)..].as_chunks().0;
        let mut numbers = words.iter().map(|word| u64::from(u32::from_le_bytes(*word)));
        let count = numbers.next().unwrap_or_default();
        let bytes: u64 = numbers.sum();
        if bytes > MOST_BYTES {
            let message = format!(
                "a part of the compressed points has {bytes} bytes, more than the {MOST_BYTES} that are read; compress them in parts of 50,000 points"
            );
            return Err(fault(at, message));
        }
        if start + bytes > table.end {
            return Err(fault(at, damaged("a part ends behind the last one")));
        }
        at = start + bytes;
        let expected = packing.points_of_parts().or(parts.get(index).map(|part| part[0]));
        let is_last = at == table.end && packing.points_of_parts().is_some_and(|each| count <= each);
        if count == 0 || (expected != Some(count) && !is_last) {
            return Err(fault(start, damaged("a part has another number of points than announced")));
        }
        found += count;
        index += 1;
    }
    check_count(header, found, table.end)
}
