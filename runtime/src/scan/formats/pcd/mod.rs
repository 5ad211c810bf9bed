//! PCD, the Point Cloud Library's own format, of the versions .5 to .7: text, binary, and compressed.
//!
//! Points are taken as they stand. The viewpoint says from where they were seen and does not move them: PCL orients
//! normals to it, and Open3D, PDAL and CloudCompare leave the points where they are too.

mod fields;
mod header;
mod lzf;

use super::batch::{Batch, require_first};
use super::text::{self, Lines, words};
use crate::scan::cloud::{Entry, Input, Points, Source};
use crate::scan::error::ScanFault;
use fields::{Layout, Roles};
use header::{Data, Header};
use std::io::{ErrorKind, Read, SeekFrom};

const FORMAT: &str = "PCD";
/// Bytes of binary points that are read at a time.
const BLOCK: usize = 1 << 18;

/// Whether a file that begins so is of this format: behind comments there is the version, or the fields' names.
pub(in crate::scan) fn recognise(head: &[u8]) -> bool {
    let head = text::decoded(&head[..head.len().min(1 << 16)]);
    if head.get(..6).is_some_and(|start| start.eq_ignore_ascii_case(b"# .pcd")) {
        return true;
    }
    let lines = head.split(|b| *b == b'\n' || *b == b'\r').map(<[u8]>::trim_ascii);
    let mut lines = lines.filter(|line| !line.is_empty() && !line.starts_with(b"#"));
    let Some(first) = lines.next() else { return false };
    let mut words = words(first);
    match words.next() {
        Some(b"VERSION") => words.next().is_some_and(|v| v.starts_with(b".") || v.starts_with(b"0.")),
        Some(b"FIELDS" | b"COLUMNS") => lines.next().is_some_and(|line| line.starts_with(b"SIZE")),
        _ => false,
    }
}

/// Reads a file of this format.
pub(in crate::scan) fn read(input: Input, points: &mut dyn Points) -> Result<(), ScanFault> {
    require_first(input.only)?;
    let size = input.size;
    let mut batch = Batch::new(points, size);
    let mut lines = Lines::new(input, FORMAT)?;
    let header = Header::read(&mut lines, &mut batch)?;
    let roles = Roles::of(&header, &mut batch)?;
    if let Some(station) = header.viewpoint {
        batch.begin(Entry { name: String::new(), station: Some(station) }, 0)?;
    }
    match header.data {
        Data::Ascii => read_ascii(&mut lines, &header, &roles, &mut batch),
        Data::Binary | Data::Compressed => {
            let (mut source, start) = lines.into_source();
            source.seek(SeekFrom::Start(start)).map_err(ScanFault::Unreadable)?;
            let rest = size.saturating_sub(start);
            if header.data == Data::Binary {
                read_binary(&mut *source, start, rest, &header, &roles, &mut batch)
            } else {
                read_compressed(&mut *source, start, rest, &header, &roles, &mut batch)
            }
        }
    }
}

fn read_ascii(lines: &mut Lines, header: &Header, roles: &Roles, batch: &mut Batch<'_>) -> Result<(), ScanFault> {
    let count = header.fields.iter().map(|field| field.count).sum();
    let mut numbers = vec![0.0; count];
    let (mut rows, mut spaced) = (0, Vec::new());
    while lines.advance_to_text()? {
        let mut line = lines.line();
        if line.trim_ascii_start().starts_with(b"#") {
            continue;
        }
        // Not as the format has it; the number of values tells it from decimal marks.
        if line.contains(&b',') {
            spaced.clear();
            spaced.extend(line.iter().map(|b| if *b == b',' { b' ' } else { *b }));
            line = &spaced;
        }
        if text::row(line, &mut numbers) != Some(count) {
            let names = header.names();
            return Err(lines.unexpected(&format!("{count} number{} ({names})", if count == 1 { "" } else { "s" })));
        }
        if rows == header.points {
            let message = format!(
                "more points follow than the {rows} that the header announces (POINTS); correct that or export the file again"
            );
            return Err(lines.fault(message));
        }
        rows += 1;
        batch.push(roles.point_of_numbers(&numbers), lines.read())?;
    }
    if rows < header.points {
        return Err(cut_off(header.points, rows));
    }
    batch.flush(lines.read())
}

fn cut_off(announced: u64, found: u64) -> ScanFault {
    let message = format!(
        "the header announces {announced} points, the file ends after {found}; it is cut off: export or copy it again"
    );
    ScanFault::malformed(FORMAT, "header", message)
}

/// Points that follow each other, whatever their number. Of the file `rest` bytes are left from byte `start` on.
fn read_binary(
    source: &mut dyn Source,
    start: u64,
    rest: u64,
    header: &Header,
    roles: &Roles,
    batch: &mut Batch<'_>,
) -> Result<(), ScanFault> {
    let stride = header.stride as u64;
    let room = rest / stride;
    if header.points > room {
        return Err(cut_off(header.points, room));
    }
    let behind = rest - header.points * stride;
    if behind >= stride {
        let message = format!(
            "behind the {} points that the header announces {behind} more bytes follow, which is room for {}; correct POINTS or export the file again",
            header.points,
            behind / stride
        );
        return Err(ScanFault::malformed(FORMAT, "header", message));
    }
    if behind > 0 {
        batch.warn(format!("{behind} bytes behind the last point are left out"));
    }
    let rows = (BLOCK / header.stride).max(1) as u64;
    let mut block = vec![0; rows.min(header.points) as usize * header.stride];
    let mut from = 0;
    while from < header.points {
        let count = rows.min(header.points - from) as usize;
        let bytes = &mut block[..count * header.stride];
        let at = start + from * stride;
        source.read_exact(bytes).map_err(|error| ended(error, header.points, from))?;
        let layout = Layout::rows(bytes, header.stride);
        for row in 0..count {
            batch.push(roles.point_of_bytes(&layout, row), at + (row * header.stride) as u64)?;
        }
        from += count as u64;
    }
    batch.flush(start + rest)
}

/// A file that becomes shorter while it is read.
fn ended(error: std::io::Error, announced: u64, found: u64) -> ScanFault {
    match error.kind() {
        ErrorKind::UnexpectedEof => cut_off(announced, found),
        _ => ScanFault::Unreadable(error),
    }
}

/// Fields that follow each other, each with its values of all points, packed as a whole: at most
/// [`lzf::MOST_GROWTH`] times as many bytes as the file has are in the memory.
fn read_compressed(
    source: &mut dyn Source,
    start: u64,
    rest: u64,
    header: &Header,
    roles: &Roles,
    batch: &mut Batch<'_>,
) -> Result<(), ScanFault> {
    let fault = |message: String| ScanFault::malformed(FORMAT, "compressed data", message);
    let mut sizes = [0; 8];
    if rest < 8 {
        return Err(fault(format!("two sizes of 4 bytes were expected, {rest} bytes are left; the file is cut off")));
    }
    source.read_exact(&mut sizes).map_err(|error| ended(error, header.points, 0))?;
    let [packed, unpacked] = [0, 4].map(|k| u32::from_le_bytes([0, 1, 2, 3].map(|i| sizes[k + i])));
    let left = rest - 8;
    if u64::from(packed) > left {
        return Err(fault(format!(
            "{packed} bytes are announced, {left} are left; the file is cut off: copy it again"
        )));
    }
    let expected = header.points.checked_mul(header.stride as u64);
    if expected != Some(unpacked.into()) {
        return Err(fault(format!(
            "{} points of {} bytes were expected, {unpacked} bytes are announced; export the file again",
            header.points, header.stride
        )));
    }
    if u64::from(packed) < left {
        batch.warn(format!("{} bytes behind the compressed points are left out", left - u64::from(packed)));
    }
    let mut bytes = Vec::with_capacity(packed as usize);
    source.take(packed.into()).read_to_end(&mut bytes).map_err(ScanFault::Unreadable)?;
    let fields = lzf::unpack(&bytes, unpacked as usize).map_err(|found| {
        fault(format!("{unpacked} bytes were expected, it unpacks to {found}; the file is damaged: export it again"))
    })?;
    drop(bytes);
    let points = header.points as usize;
    let layout = Layout::columns(&fields, points);
    for point in 0..points {
        batch.push(roles.point_of_bytes(&layout, point), start + rest)?;
    }
    batch.flush(start + rest)
}

#[cfg(test)]
mod tests;
