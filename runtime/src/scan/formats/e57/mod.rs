//! E57 (ASTM E2807): scans with their poses, in metres.
//!
//! Coordinates are cartesian or spherical, as floats or scaled integers; intensities, colours and normals (of the
//! extension `nor`) are read where there are any. Pictures and all else are not looked at.

mod description;
mod field;
mod limits;
pub(crate) mod pages;
mod vector;

use crate::scan::attributes::Station;
use crate::scan::cloud::{Entry, Input, NoPoint, Points, RawPoint};
use crate::scan::error::ScanFault;
use crate::scan::unit::METRE;
use description::Described;
use field::{Field, Kind, Name};
use pages::{Pages, at_byte, logical};
use vector::{Columns, Vector};

const FORMAT: &str = "E57";
/// Bytes of the header.
const HEADER: usize = 48;
/// The most bytes of the XML section. Those of files with hundreds of scans have one or two million.
const MOST_XML: u64 = 32 << 20;

/// Reads a file of this format.
pub(in crate::scan) fn read(input: Input, points: &mut dyn Points) -> Result<(), ScanFault> {
    let mut pages = Pages::new(input.bytes, input.size);
    let xml = read_xml(&mut pages, input.size, points)?;
    let scans = description::read(&xml)?;
    if input.only.is_some_and(|only| only >= scans.len()) {
        return Err(ScanFault::NoSuchScan { count: scans.len() });
    }
    points.unit(METRE);
    let wanted = || scans.iter().enumerate().filter(|(index, _)| input.only.is_none_or(|only| only == *index));
    let all = wanted().map(|(_, scan)| scan.records).fold(0, u64::saturating_add);
    let mut before = 0;
    for (index, scan) in wanted() {
        scan.ignored.iter().for_each(|field| points.ignore(field));
        scan.warnings.iter().for_each(|warning| points.warn(warning.clone()));
        points.begin(Entry { name: scan.name.clone(), station: station(scan) });
        read_scan(&mut pages, index, scan, points, |done| (before + done) as f64 / all.max(1) as f64)?;
        before = before.saturating_add(scan.records);
    }
    Ok(())
}

/// Reads the header and, from where it says, the XML section.
fn read_xml(pages: &mut Pages, size: u64, points: &mut dyn Points) -> Result<String, ScanFault> {
    let fault = |message: String| Err(ScanFault::malformed(FORMAT, "header", message));
    if pages.len() == 0 {
        return fault(format!(
            "a page of 1024 bytes was expected, the file ends after {size}; it is cut off: export or copy it again"
        ));
    }
    let mut header = [0; HEADER];
    pages.read(0, &mut header)?;
    let word = |at: usize| u64::from_le_bytes(*header[at..].first_chunk().unwrap_or(&[0; 8]));
    let [length, offset, xml, page] = [16, 24, 32, 40].map(word);
    if !header.starts_with(b"ASTM-E57") {
        return fault("`ASTM-E57` was expected at its beginning; export the file again".to_owned());
    }
    // Two numbers of 32 bits.
    if word(8) & 0xffff_ffff != 1 {
        return fault(format!("version 1 was expected, found {}; export the file as E57 1.0", word(8) & 0xffff_ffff));
    }
    if page != pages::PAGE as u64 {
        return fault(format!("pages of 1024 bytes were expected, found {page}; export the file again"));
    }
    if length > size {
        return fault(format!(
            "the file is said to have {length} bytes, it ends after {size}; it is cut off: export or copy it again"
        ));
    }
    if length < size {
        points.warn(format!("{} bytes behind its end are left out", size - length));
    }
    let start = logical(offset).filter(|start| start.checked_add(xml).is_some_and(|end| end <= pages.len()));
    let Some(start) = start else {
        return fault(format!(
            "{xml} bytes of XML are said to be at byte {offset}, where there are none; the file is damaged or cut off: export or copy it again"
        ));
    };
    if xml > MOST_XML {
        return fault(format!(
            "the XML section has {xml} bytes, more than the {MOST_XML} that are read; export fewer scans at a time"
        ));
    }
    let mut text = vec![0; xml as usize];
    pages.read(start, &mut text)?;
    String::from_utf8(text).map_err(|error| {
        let at = pages::physical(start + error.utf8_error().valid_up_to() as u64);
        ScanFault::malformed(
            FORMAT,
            format!("XML section, {}", at_byte(at)),
            "the text is not UTF-8; export the file again",
        )
    })
}

/// Where the scanner stood. A pose that moves nothing does not tell: programs give one to merged clouds, too. It counts
/// if the points are seen from it, as grids and spherical coordinates are.
fn station(scan: &Described) -> Option<Station> {
    let has = |name| scan.fields.iter().any(|field| field.name == Some(name));
    let is_spherical = has(Name::Range) && has(Name::Azimuth) && has(Name::Elevation);
    let own = Station::at([0.0; 3]);
    match scan.pose {
        Some(pose) if pose != own || (has(Name::Row) && has(Name::Column)) || is_spherical => Some(pose),
        None if is_spherical => Some(own),
        _ => None,
    }
}

fn read_scan(
    pages: &mut Pages,
    index: usize,
    scan: &Described,
    points: &mut dyn Points,
    share: impl Fn(u64) -> f64,
) -> Result<(), ScanFault> {
    let layout = Layout::new(scan);
    if scan.records > 0 && !layout.has_coordinates() {
        let message = "its points have neither `cartesianX`, `cartesianY` and `cartesianZ` nor `sphericalRange`, `sphericalAzimuth` and `sphericalElevation`; export them with coordinates";
        return Err(ScanFault::malformed(FORMAT, format!("scan {index}"), message));
    }
    let mut vector = Vector::new(pages, index, scan)?;
    let mut batch = Vec::new();
    while vector.advance()? {
        batch.clear();
        let columns = &vector.columns;
        let (mut marked, mut empty) = (0, 0);
        for k in 0..columns.count {
            match layout.point(columns, k) {
                Ok(point) => batch.push(point),
                Err(NoPoint::Marked) => marked += 1,
                Err(NoPoint::Empty) => empty += 1,
            }
        }
        points.leave_out(NoPoint::Marked, marked);
        points.leave_out(NoPoint::Empty, empty);
        points.take(&batch)?;
        points.progress(share(vector.done));
    }
    if vector.has_more()? {
        let records = scan.records;
        points.warn(format!("scan {index} has points behind the {records} that it announces; they are left out"));
    }
    Ok(())
}

/// How points are made of the values of fields.
struct Layout {
    pose: Option<Station>,
    is_cartesian: bool,
    is_spherical: bool,
    /// Whether the points were seen from the origin, so that none of them is there: rays without an echo have zeros.
    is_seen: bool,
    has_normals: bool,
    /// The values of black and of full red, green and blue.
    colours: Option<[[f64; 2]; 3]>,
}

impl Layout {
    fn new(scan: &Described) -> Self {
        let field = |name| scan.fields.iter().find(|field| field.name == Some(name));
        let has = |names: [Name; 3]| names.into_iter().all(|name| field(name).is_some());
        let colours = [Name::Red, Name::Green, Name::Blue];
        let range = |k: usize| field(colours[k]).map_or([0.0, 1.0], |field| full_range(scan.colours[k], field));
        Self {
            pose: scan.pose,
            is_cartesian: has([Name::X, Name::Y, Name::Z]),
            is_spherical: has([Name::Range, Name::Azimuth, Name::Elevation]),
            is_seen: station(scan).is_some() || (field(Name::Row).is_some() && field(Name::Column).is_some()),
            has_normals: has([Name::NormalX, Name::NormalY, Name::NormalZ]),
            colours: has(colours).then(|| [0, 1, 2].map(range)),
        }
    }

    fn has_coordinates(&self) -> bool {
        self.is_cartesian || self.is_spherical
    }

    /// A point; none where it is marked as invalid, or as a direction without a distance, or is at the scanner itself.
    fn point(&self, columns: &Columns, k: usize) -> Result<RawPoint, NoPoint> {
        let is_good = |state| columns.of(state).get(k).is_none_or(|state| *state == 0.0);
        let values = |names: [Name; 3]| names.map(|name| columns.of(name)[k]);
        let own = if self.is_cartesian && is_good(Name::CartesianState) {
            values([Name::X, Name::Y, Name::Z])
        } else if self.is_spherical && is_good(Name::SphericalState) {
            cartesian(values([Name::Range, Name::Azimuth, Name::Elevation]))
        } else {
            return Err(NoPoint::Marked);
        };
        if self.is_seen && own == [0.0; 3] {
            return Err(NoPoint::Empty);
        }
        let normal = self.has_normals.then(|| values([Name::NormalX, Name::NormalY, Name::NormalZ]));
        let turned = normal.map(|n| self.pose.map_or(n, |pose| pose.direction(n)));
        let colour = self.colours.filter(|_| is_good(Name::ColourState)).map(|ranges| {
            let colour = values([Name::Red, Name::Green, Name::Blue]);
            [0, 1, 2].map(|c| eight_bits(colour[c], ranges[c]))
        });
        let intensity = columns.of(Name::Intensity).get(k).filter(|_| is_good(Name::IntensityState));
        Ok(RawPoint {
            position: self.pose.map_or(own, |pose| pose.point(own)),
            normal: turned.map(|n| n.map(|c| c as f32)),
            colour,
            intensity: intensity.map(|value| *value as f32),
        })
    }
}

/// A range, an azimuth from the x axis and an elevation above the xy plane (radians) as a position.
fn cartesian([range, azimuth, elevation]: [f64; 3]) -> [f64; 3] {
    let (sine, cosine) = elevation.sin_cos();
    let (y, x) = azimuth.sin_cos();
    [range * cosine * x, range * cosine * y, range * sine]
}

/// The values of none and of all of a colour: the limits that are stated, or those of the field. Else fractions are of
/// 1, integers of 255.
fn full_range(stated: Option<[f64; 2]>, field: &Field) -> [f64; 2] {
    let usual = if let Kind::Integer { .. } = field.kind { [0.0, 255.0] } else { [0.0, 1.0] };
    let mut widths = [stated, field.range].into_iter().flatten();
    widths.find(|[low, high]| low < high && (high - low).is_finite()).unwrap_or(usual)
}

fn eight_bits(value: f64, [low, high]: [f64; 2]) -> u8 {
    // Casts saturate, and make 0 of what is not a number.
    ((value - low) / (high - low) * 255.0).round() as u8
}
