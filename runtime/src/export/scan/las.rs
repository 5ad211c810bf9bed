//! LAS 1.4 (ASPRS) and LAZ: points with intensities and colours. Metres.
//!
//! The format has no poses: points have the number of their station, counted from 1, as their source.

use super::{Out, Recorded};
use crate::mesh::Bounds;
use glam::DVec3;
use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlr};
use std::io::{self, SeekFrom};

/// Bytes of the header, and in front of a record.
const HEADER: usize = 375;
const RECORD: usize = 54;
/// Bytes of a point without a colour and with one, and the numbers of these formats.
const POINTS: [(u8, u16); 2] = [(6, 30), (7, 36)];
/// The finest scale of coordinates: a thousandth of a millimetre.
const FINEST: f64 = 1e-6;
/// The coordinate system: none but that of the scan, in metres.
const SYSTEM: &str = "LOCAL_CS[\"frame of the scan\",LOCAL_DATUM[\"frame of the scan\",0],UNIT[\"metre\",1],\
                      AXIS[\"x\",EAST],AXIS[\"y\",NORTH],AXIS[\"z\",UP]]";
/// Millimetres in metres.
const METRE: f64 = 1e-3;

/// Writes a scan in this format.
pub(super) fn write(out: &mut dyn Out, scan: &Recorded<'_>, compressed: bool) -> io::Result<()> {
    let writer = Writer::new(scan);
    let packing = compressed.then(|| writer.packing()).transpose().map_err(io::Error::other)?;
    out.write_all(&writer.head(packing.as_ref())?)?;
    let count = scan.mesh.positions.len();
    let mut bytes = Vec::new();
    let Some(packing) = packing else {
        for point in 0..count {
            bytes.clear();
            writer.point(point, &mut bytes);
            out.write_all(&bytes)?;
        }
        return Ok(());
    };
    let mut packer = LasZipCompressor::new(&mut *out, packing).map_err(io::Error::other)?;
    for point in 0..count {
        bytes.clear();
        writer.point(point, &mut bytes);
        packer.compress_one(&bytes)?;
    }
    packer.done()?;
    drop(packer);
    out.seek(SeekFrom::End(0))?;
    Ok(())
}

/// How points are written.
struct Writer<'a> {
    scan: &'a Recorded<'a>,
    /// Metres of a unit of the coordinates.
    scale: f64,
    /// Metres.
    offset: DVec3,
    /// Metres.
    bounds: Bounds,
    /// What intensities are multiplied by, after the second is taken away.
    intensity: [f64; 2],
}

/// The step of coordinates. Millimetres.
pub(super) fn step(scan: &Recorded<'_>) -> f64 {
    Writer::new(scan).scale / METRE
}

impl<'a> Writer<'a> {
    fn new(scan: &'a Recorded<'a>) -> Self {
        let mut bounds: Bounds = scan.mesh.positions.iter().map(|p| DVec3::from(*p) * METRE).collect();
        if scan.mesh.positions.is_empty() {
            bounds = Bounds { low: DVec3::ZERO, high: DVec3::ZERO };
        }
        let offset = ((bounds.low + bounds.high) / 2.0).round();
        let reach = (bounds.high - offset).max(offset - bounds.low).max_element();
        let mut scale = FINEST;
        while reach / scale > f64::from(i32::MAX) {
            scale *= 10.0;
        }
        Self { scan, scale, offset, bounds, intensity: intensities(&scan.attributes.intensities) }
    }

    /// The number of the format of points, and their bytes.
    fn format(&self) -> (u8, u16) {
        POINTS[usize::from(!self.scan.attributes.colours.is_empty())]
    }

    fn packing(&self) -> laz::Result<LazVlr> {
        Ok(LazVlr::from_laz_items(LazItemRecordBuilder::default_for_point_format_id(self.format().0, 0)?))
    }

    /// The header, and the records between it and the points.
    fn head(&self, packing: Option<&LazVlr>) -> io::Result<Vec<u8>> {
        let mut records = record("LASF_Projection", 2112, &[SYSTEM.as_bytes(), &[0]].concat());
        if let Some(packing) = packing {
            let mut bytes = Vec::new();
            packing.write_to(&mut bytes)?;
            records.extend(record(LazVlr::USER_ID, LazVlr::RECORD_ID, &bytes));
        }
        let (format, length) = self.format();
        let mut head = vec![0; HEADER];
        let mut put = |at: usize, bytes: &[u8]| head[at..at + bytes.len()].copy_from_slice(bytes);
        put(0, b"LASF");
        // The coordinate system is a text.
        put(6, &[0x10, 0]);
        put(24, &[1, 4]);
        put(26, b"gmlc");
        put(58, concat!("gmlc ", env!("CARGO_PKG_VERSION")).as_bytes());
        put(94, &(HEADER as u16).to_le_bytes());
        put(96, &((HEADER + records.len()) as u32).to_le_bytes());
        put(100, &(1 + u32::from(packing.is_some())).to_le_bytes());
        put(104, &[format | if packing.is_some() { 0x80 } else { 0 }]);
        put(105, &length.to_le_bytes());
        for k in 0..3 {
            put(131 + 8 * k, &self.scale.to_le_bytes());
            put(155 + 8 * k, &self.offset[k].to_le_bytes());
            put(179 + 16 * k, &self.bounds.high[k].to_le_bytes());
            put(187 + 16 * k, &self.bounds.low[k].to_le_bytes());
        }
        let count = (self.scan.mesh.positions.len() as u64).to_le_bytes();
        // Of all points, and of first returns.
        put(247, &count);
        put(255, &count);
        head.extend(records);
        Ok(head)
    }

    fn point(&self, point: usize, out: &mut Vec<u8>) {
        let attributes = self.scan.attributes;
        let units = (DVec3::from(self.scan.mesh.positions[point]) * METRE - self.offset) / self.scale;
        for unit in units.to_array() {
            out.extend_from_slice(&(unit.round() as i32).to_le_bytes());
        }
        let [factor, low] = self.intensity;
        let intensity = attributes.intensities.get(point).map_or(0.0, |i| (f64::from(*i) - low) * factor);
        out.extend_from_slice(&(intensity.round() as u16).to_le_bytes());
        // The first return of one; no flags; never classified; no data of the user, no angle.
        out.extend_from_slice(&[0x11, 0, 0, 0, 0, 0]);
        let station = attributes.stations.of_points.get(point).map_or(0, |station| station.wrapping_add(1));
        out.extend_from_slice(&station.to_le_bytes());
        out.extend_from_slice(&0_f64.to_le_bytes());
        for colour in attributes.colours.get(point).copied().into_iter().flatten() {
            // 255 becomes 65535.
            out.extend_from_slice(&(257 * u16::from(colour)).to_le_bytes());
        }
    }
}

/// How intensities are brought to the integers of 16 bits: what is taken away from them, second, and what they are then
/// multiplied by, first. Whole numbers of so many bits stay, fractions of 1 are spread, others are spread from their
/// least to their largest.
fn intensities(values: &[f32]) -> [f64; 2] {
    const MOST: f64 = 65535.0;
    let finite = || values.iter().filter(|v| v.is_finite()).map(|v| f64::from(*v));
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low >= 0.0 && high <= 1.0 {
        [MOST, 0.0]
    } else if low >= 0.0 && high <= MOST && finite().all(|v| v.fract() == 0.0) {
        [1.0, 0.0]
    } else if low < high {
        [MOST / (high - low), low]
    } else {
        [1.0, low]
    }
}

/// Whether intensities are other numbers in the file.
pub(super) fn spreads(values: &[f32]) -> bool {
    intensities(values) != [1.0, 0.0] && values.iter().any(|v| *v != 0.0)
}

/// A record of variable length.
fn record(user: &str, id: u16, contents: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; RECORD];
    bytes[2..2 + user.len()].copy_from_slice(user.as_bytes());
    bytes[18..20].copy_from_slice(&id.to_le_bytes());
    bytes[20..22].copy_from_slice(&(contents.len() as u16).to_le_bytes());
    bytes.extend_from_slice(contents);
    bytes
}
