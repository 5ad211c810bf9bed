//! LAS (ASPRS, 1.0 to 1.4) and LAZ: points of airborne and mobile scanners, with intensities and colours.
//!
//! Points that are withheld, or of a class of noise, are left out. Coordinates are in the unit of the coordinate
//! system.

mod contained;
mod crs;
mod header;
mod packed;
mod record;

use crate::scan::cloud::{BATCH, Input, NoPoint, Points, RawPoint, Source};
use crate::scan::error::ScanFault;
use crate::scan::unit::METRE;
use crs::System;
use header::Header;
use packed::{Unpacker, damaged};
use record::{Layout, Shift};
use std::io::SeekFrom;

const FORMAT: &str = "LAS";
/// Bytes of points that are read at a time, at most.
const BATCH_BYTES: usize = 1 << 20;
/// Points in whose colours the largest value is looked for, and their bytes at most.
const AHEAD: usize = 32 * BATCH;
const AHEAD_BYTES: usize = 16 << 20;

/// Reads a file of this format.
pub(in crate::scan) fn read(input: Input, points: &mut dyn Points) -> Result<(), ScanFault> {
    let Input { bytes: mut source, size, only } = input;
    let header = Header::read(&mut *source, size, points)?;
    if only.is_some_and(|only| only > 0) {
        return Err(ScanFault::NoSuchScan { count: 1 });
    }
    let height = units(&header, points)?;
    ignore_others(&header, points);
    let layout = Layout::new(&header, height);
    let records = if header.is_compressed {
        Records::Packed(Box::new(Unpacker::new(source, &header, size)?))
    } else {
        check_count(&mut *source, &header, &layout, points)?;
        source.seek(SeekFrom::Start(header.start)).map_err(ScanFault::Unreadable)?;
        Records::Plain(source)
    };
    Reading { header: &header, layout, records, done: 0, shift: None, has_warned: false }.read_all(points)
}

/// Says what of the points is not read.
fn ignore_others(header: &Header, points: &mut dyn Points) {
    for field in ["returns", "classification", "scan angle", "user data"] {
        points.ignore(field);
    }
    // Times and colours are in some formats of points only (ASPRS LAS 1.4, 2.6).
    if !matches!(header.format, 0 | 2) {
        points.ignore("GPS time");
    }
    if matches!(header.format, 4 | 5 | 9 | 10) {
        points.ignore("waveforms");
    }
    if matches!(header.format, 8 | 10) {
        points.ignore("near infrared");
    }
    if header.extra() > 0 {
        points.ignore("extra bytes");
    }
}

/// Says the unit of x and y; returns that of z as a part of it.
fn units(header: &Header, points: &mut dyn Points) -> Result<f64, ScanFault> {
    match crs::system(header) {
        Some(System::Lengths { plane, height }) => {
            let part = height.map_or(1.0, |height| height / plane);
            if part != 1.0 {
                points.warn(format!("its heights are in another unit than x and y: they are multiplied by {part}"));
            }
            points.unit(plane);
            Ok(part)
        }
        Some(System::Angles) if are_angles(header.bounds) => {
            let message = "its coordinates are degrees of longitude and latitude; project them first, for example to UTM (`pdal translate --filter reprojection`)";
            Err(ScanFault::malformed(FORMAT, "coordinate system", message))
        }
        Some(System::Angles) => {
            points.warn("its coordinate system has degrees, but its coordinates are larger; they are taken as metres (--unit says otherwise)".to_owned());
            points.usual_unit(METRE);
            Ok(1.0)
        }
        Some(System::Unknown(what)) => {
            points.warn(format!("it {what}; metres are assumed (--unit says otherwise)"));
            points.usual_unit(METRE);
            Ok(1.0)
        }
        None => {
            points.warn("it has no coordinate system; metres are assumed (--unit says otherwise)".to_owned());
            points.usual_unit(METRE);
            Ok(1.0)
        }
    }
}

/// Whether a box may be one of longitudes and latitudes.
fn are_angles([low, high]: [[f64; 3]; 2]) -> bool {
    let within = |k: usize, most: f64| low[k].abs() <= most && high[k].abs() <= most;
    within(0, 360.0) && within(1, 90.0)
}

/// Holds the number of points in the header against the bytes that follow it.
fn check_count(
    source: &mut dyn Source,
    header: &Header,
    layout: &Layout,
    points: &mut dyn Points,
) -> Result<(), ScanFault> {
    let (count, length) = (header.count, u64::from(header.length));
    let room = header.end.saturating_sub(header.start);
    if count > room / length {
        let message = format!(
            "the header announces {count} points, the file ends after {}; it is cut off: export or copy it again",
            room / length
        );
        return Err(ScanFault::malformed(FORMAT, format!("byte {}", header.end), message));
    }
    let (rest, start) = (room - count * length, header.start + count * length);
    if rest == 0 {
        return Ok(());
    }
    let mut bytes = vec![0; rest.min(BATCH_BYTES as u64) as usize];
    source.seek(SeekFrom::Start(start)).map_err(ScanFault::Unreadable)?;
    source.read_exact(&mut bytes).map_err(ScanFault::Unreadable)?;
    // Some programs pad files; what lies in the box of the header are points.
    let is_point = |bytes: &&[u8]| {
        let position = layout.point(bytes, Shift::None).position;
        let [low, high] = header.bounds;
        bytes.iter().any(|byte| *byte != 0) && (0..3).all(|k| low[k] <= position[k] && position[k] <= high[k])
    };
    if bytes.chunks_exact(header.length.into()).take_while(is_point).count() > 0 {
        let message =
            format!("the header announces {count} points, and {} more follow; export the file again", rest / length);
        return Err(ScanFault::malformed(FORMAT, format!("byte {start}"), message));
    }
    points.warn(format!("{rest} bytes behind the last point of the header are left out"));
    Ok(())
}

/// Where the bytes of points come from.
enum Records {
    Plain(Box<dyn Source>),
    Packed(Box<Unpacker>),
}

/// Reads the points.
struct Reading<'a> {
    header: &'a Header,
    layout: Layout,
    records: Records,
    /// Number of points that are read.
    done: u64,
    /// None as long as all colours were black, as in files that have a field for them, but no colours.
    shift: Option<Shift>,
    has_warned: bool,
}

impl Reading<'_> {
    fn read_all(mut self, points: &mut dyn Points) -> Result<(), ScanFault> {
        let length = usize::from(self.header.length);
        let batch = (BATCH_BYTES / length).clamp(1, BATCH);
        let mut next = if self.layout.has_colours() { (AHEAD_BYTES / length).clamp(batch, AHEAD) } else { batch };
        let mut bytes = Vec::new();
        while self.done < self.header.count {
            let left = usize::try_from(self.header.count - self.done).unwrap_or(next);
            bytes.resize(next.min(left) * length, 0);
            self.fill(&mut bytes)?;
            self.look_at_colours(&bytes, points);
            for batch in bytes.chunks(batch * length) {
                self.hand_on(batch, points)?;
            }
            next = batch;
        }
        Ok(())
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), ScanFault> {
        let length = usize::from(self.header.length);
        match &mut self.records {
            Records::Plain(source) => source.read_exact(bytes).map_err(ScanFault::Unreadable),
            Records::Packed(unpacker) => {
                bytes.chunks_exact_mut(length).zip(self.done..).try_for_each(|(point, done)| {
                    let place = || format!("behind point {done}");
                    unpacker.fill(point).map_err(|why| ScanFault::malformed(FORMAT, place(), damaged(&why)))
                })
            }
        }
    }

    /// Decides on the scale of colours by the largest value.
    fn look_at_colours(&mut self, bytes: &[u8], points: &mut dyn Points) {
        if !self.layout.has_colours() {
            return;
        }
        let colours = bytes.chunks_exact(self.header.length.into()).filter_map(|point| self.layout.colour(point));
        let largest = colours.flatten().max().unwrap_or_default();
        if self.shift.is_none() && largest > 0 {
            self.shift = Some(Shift::of(largest));
        }
        if self.shift.is_some_and(|shift| shift.is_exceeded(largest)) && !self.has_warned {
            self.has_warned = true;
            points.warn(format!(
                "its first {} points have colours of 8 bits, and later ones up to {largest}; those are taken as 255",
                self.done
            ));
        }
    }

    fn hand_on(&mut self, bytes: &[u8], points: &mut dyn Points) -> Result<(), ScanFault> {
        let records = bytes.chunks_exact(self.header.length.into());
        let count = records.len();
        let good = records.filter(|record| !self.layout.is_left_out(record));
        let batch: Vec<RawPoint> = match self.shift {
            Some(shift) => good.map(|record| self.layout.point(record, shift)).collect(),
            None => good.map(|record| RawPoint { colour: None, ..self.layout.point(record, Shift::None) }).collect(),
        };
        self.done += count as u64;
        points.leave_out(NoPoint::Marked, (count - batch.len()) as u64);
        points.take(&batch)?;
        points.progress(self.done as f64 / self.header.count as f64);
        Ok(())
    }
}
