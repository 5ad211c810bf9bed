//! E57 1.0 (ASTM E2807): a data set for each station, with its pose and its points in the scanner's own frame. Metres.

use super::{Grid, Out, Recorded};
use crate::record::hexadecimal;
use crate::scan::e57_pages::{CONTENT, checksum, physical};
use crate::scan::{Station, Stations};
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::io::{self, SeekFrom};

/// Bytes of the header of a file, and of a section of points.
const HEADER: usize = 48;
const SECTION: u64 = 32;
/// Points of a packet, which has 65536 bytes at most.
const PACKET: usize = 1000;
/// Millimetres in metres.
const METRE: f64 = 1e-3;

/// Writes a scan in this format.
pub(super) fn write(out: &mut dyn Out, scan: &Recorded<'_>) -> io::Result<()> {
    let mut pages = Pages { out, page: Vec::new(), first: Vec::new(), position: 0, sum: Sha256::new() };
    // The header is known at the end.
    pages.write(&[0; HEADER])?;
    let sets = sets(scan);
    let mut offsets = Vec::new();
    for set in &sets {
        offsets.push(physical(pages.position));
        set.write_points(&mut pages, scan)?;
    }
    let start = pages.position;
    let guid = guid(&pages.sum.clone().finalize());
    pages.write(xml(&sets, &offsets, scan, &guid).as_bytes())?;
    let length = pages.position - start;
    pages.finish(physical(start), length)
}

/// Points that are written as one scan.
struct Set<'a> {
    index: usize,
    station: Option<&'a Station>,
    /// Their indices.
    points: Vec<usize>,
    /// The row and the column of each, and their numbers.
    cells: Option<(Vec<[u32; 2]>, &'a Grid)>,
}

/// The stations and their points, and then those without a station.
fn sets<'a>(scan: &Recorded<'a>) -> Vec<Set<'a>> {
    let Stations { places, of_points } = &scan.attributes.stations;
    let mut points = vec![Vec::new(); places.len() + 1];
    for point in 0..scan.mesh.positions.len() {
        let station = of_points.get(point).map_or(places.len(), |station| usize::from(*station));
        points[station.min(places.len())].push(point);
    }
    let sets = points.into_iter().enumerate().filter(|(index, points)| *index < places.len() || !points.is_empty());
    sets.map(|(index, points)| {
        // Without stations, a grid belongs to the only set.
        let grid = scan.grids.get(index);
        let cells = grid.and_then(|grid| Some((cells(grid, &points)?, grid)));
        Set { index, station: places.get(index), points, cells }
    })
    .collect()
}

/// The row and the column of each point, if all of them have one.
fn cells(grid: &Grid, points: &[usize]) -> Option<Vec<[u32; 2]>> {
    const NONE: [u32; 2] = [u32::MAX; 2];
    let first = points.first()?;
    let mut cells = vec![NONE; points.last()? + 1 - first];
    for (cell, point) in grid.cells.iter().enumerate().filter(|(_, point)| **point != Grid::EMPTY) {
        let place = (*point as usize).checked_sub(*first).and_then(|place| cells.get_mut(place))?;
        *place = [(cell % grid.rows) as u32, (cell / grid.rows) as u32];
    }
    let cells: Vec<[u32; 2]> = points.iter().map(|point| cells[point - first]).collect();
    (!cells.contains(&NONE)).then_some(cells)
}

/// The values of a field of one point, as bytes.
type Field<'a> = (usize, Box<dyn Fn(usize, &mut Vec<u8>) + 'a>);

impl Set<'_> {
    /// A direction or a place of the scan in the frame of the station.
    fn direction(&self, d: [f64; 3]) -> [f64; 3] {
        self.station.map_or(d, |station| Station { place: [0.0; 3], ..*station }.to_own(d))
    }

    /// Numbers of bytes, and what writes those of the k-th point. In the order of [`Self::prototype`].
    fn fields<'a>(&'a self, scan: &'a Recorded<'_>) -> Vec<Field<'a>> {
        let (mesh, attributes) = (scan.mesh, scan.attributes);
        let mut fields: Vec<Field<'a>> = Vec::new();
        for c in 0..3 {
            let coordinate = move |k: usize, out: &mut Vec<u8>| {
                let position = mesh.positions[self.points[k]];
                let own = self.station.map_or(position, |station| station.to_own(position));
                out.extend_from_slice(&(own[c] * METRE).to_le_bytes());
            };
            fields.push((8, Box::new(coordinate)));
        }
        // All points are valid, which takes no bits; some programs want to be told.
        fields.push((0, Box::new(|_, _| {})));
        if !mesh.normals.is_empty() {
            for c in 0..3 {
                let normal = move |k: usize, out: &mut Vec<u8>| {
                    let normal = self.direction(mesh.normals[self.points[k]]);
                    out.extend_from_slice(&(normal[c] as f32).to_le_bytes());
                };
                fields.push((4, Box::new(normal)));
            }
        }
        if !attributes.intensities.is_empty() {
            let intensity = |k: usize, out: &mut Vec<u8>| {
                out.extend_from_slice(&attributes.intensities[self.points[k]].to_le_bytes());
            };
            fields.push((4, Box::new(intensity)));
        }
        if !attributes.colours.is_empty() {
            for c in 0..3 {
                fields.push((1, Box::new(move |k, out| out.push(attributes.colours[self.points[k]][c]))));
            }
        }
        if let Some((cells, _)) = &self.cells {
            for c in 0..2 {
                fields.push((4, Box::new(move |k, out| out.extend_from_slice(&cells[k][c].to_le_bytes()))));
            }
        }
        fields
    }

    /// A section of points: a header, and packets in which the values of each field follow each other.
    fn write_points(&self, pages: &mut Pages<'_>, scan: &Recorded<'_>) -> io::Result<()> {
        let fields = self.fields(scan);
        let point: usize = fields.iter().map(|(bytes, _)| bytes).sum();
        let head = 6 + 2 * fields.len();
        let starts = (0..self.points.len()).step_by(PACKET);
        let counts = starts.clone().map(|start| PACKET.min(self.points.len() - start));
        let length: usize = counts.map(|count| (head + count * point).next_multiple_of(4)).sum();
        let start = pages.position;
        let data = physical(start + SECTION);
        let mut header = [0; SECTION as usize];
        header[0] = 1;
        header[8..16].copy_from_slice(&(SECTION + length as u64).to_le_bytes());
        header[16..24].copy_from_slice(&data.to_le_bytes());
        pages.write(&header)?;
        for start in starts {
            let range = start..self.points.len().min(start + PACKET);
            let size = (head + range.len() * point).next_multiple_of(4);
            let mut packet = vec![1, 0];
            packet.extend_from_slice(&((size - 1) as u16).to_le_bytes());
            packet.extend_from_slice(&(fields.len() as u16).to_le_bytes());
            for (bytes, _) in &fields {
                packet.extend_from_slice(&((range.len() * bytes) as u16).to_le_bytes());
            }
            for (_, field) in &fields {
                range.clone().for_each(|k| field(k, &mut packet));
            }
            packet.resize(size, 0);
            pages.write(&packet)?;
        }
        Ok(())
    }

    /// The elements that describe the fields.
    fn prototype(&self, scan: &Recorded<'_>) -> String {
        let mut text = String::new();
        let mut add = |names: &[&str], kind: &str| {
            for name in names {
                let _ = writeln!(text, "<{name} type={kind}/>");
            }
        };
        add(&["cartesianX", "cartesianY", "cartesianZ"], "\"Float\"");
        add(&["cartesianInvalidState"], "\"Integer\" minimum=\"0\" maximum=\"0\"");
        if !scan.mesh.normals.is_empty() {
            let kind = "\"Float\" precision=\"single\" minimum=\"-1\" maximum=\"1\"";
            add(&["nor:normalX", "nor:normalY", "nor:normalZ"], kind);
        }
        if !scan.attributes.intensities.is_empty() {
            add(&["intensity"], "\"Float\" precision=\"single\"");
        }
        if !scan.attributes.colours.is_empty() {
            add(&["colorRed", "colorGreen", "colorBlue"], "\"Integer\" minimum=\"0\" maximum=\"255\"");
        }
        if self.cells.is_some() {
            add(&["rowIndex", "columnIndex"], "\"Integer\" minimum=\"0\" maximum=\"4294967295\"");
        }
        text
    }

    fn xml(&self, offset: u64, scan: &Recorded<'_>, guid: &str) -> String {
        let mut text = String::from("<vectorChild type=\"Structure\">\n");
        let _ = writeln!(text, "<guid type=\"String\"><![CDATA[{guid}-{}]]></guid>", self.index);
        let _ = writeln!(text, "<name type=\"String\"><![CDATA[station {}]]></name>", self.index);
        if let Some(station) = self.station {
            let turn = structure("rotation", &["w", "x", "y", "z"], &station.quaternion());
            let place = structure("translation", &["x", "y", "z"], &station.place.map(|c| c * METRE));
            let _ = writeln!(text, "<pose type=\"Structure\">\n{turn}{place}</pose>");
        }
        if let Some((_, grid)) = &self.cells {
            let last = |count: usize| count.saturating_sub(1) as f64;
            let names = ["rowMinimum", "rowMaximum", "columnMinimum", "columnMaximum"];
            let ends = [0.0, last(grid.rows), 0.0, last(grid.columns)];
            text += &structure("indexBounds", &names, &ends).replace("Float", "Integer");
        }
        let intensities = self.points.iter().filter_map(|point| scan.attributes.intensities.get(*point));
        if let Some((low, high)) = ends(intensities.copied()) {
            text += &structure("intensityLimits", &["intensityMinimum", "intensityMaximum"], &[low, high]);
        }
        if !scan.attributes.colours.is_empty() {
            let names = ["Red", "Green", "Blue"].map(|c| [format!("color{c}Minimum"), format!("color{c}Maximum")]);
            let names: Vec<&str> = names.as_flattened().iter().map(String::as_str).collect();
            let limits = structure("colorLimits", &names, &[0.0, 255.0, 0.0, 255.0, 0.0, 255.0]);
            text += &limits.replace("Float", "Integer");
        }
        let (count, prototype) = (self.points.len(), self.prototype(scan));
        let _ = write!(
            text,
            "<points type=\"CompressedVector\" fileOffset=\"{offset}\" recordCount=\"{count}\">\n\
             <prototype type=\"Structure\">\n{prototype}</prototype>\n\
             <codecs type=\"Vector\" allowHeterogeneousChildren=\"1\">\n</codecs>\n</points>\n</vectorChild>\n"
        );
        text
    }
}

/// A structure of numbers.
fn structure(name: &str, names: &[&str], numbers: &[f64]) -> String {
    let parts = names.iter().zip(numbers).map(|(part, number)| format!("<{part} type=\"Float\">{number}</{part}>\n"));
    format!("<{name} type=\"Structure\">\n{}</{name}>\n", parts.collect::<String>())
}

fn xml(sets: &[Set], offsets: &[u64], scan: &Recorded<'_>, guid: &str) -> String {
    let scans: String = sets.iter().zip(offsets).map(|(set, offset)| set.xml(*offset, scan, guid)).collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <e57Root type=\"Structure\" xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\" \
         xmlns:nor=\"http://www.libe57.org/E57_NOR_surface_normals.txt\">\n\
         <formatName type=\"String\"><![CDATA[ASTM E57 3D Imaging Data File]]></formatName>\n\
         <guid type=\"String\"><![CDATA[{guid}]]></guid>\n\
         <versionMajor type=\"Integer\">1</versionMajor>\n<versionMinor type=\"Integer\">0</versionMinor>\n\
         <e57LibraryVersion type=\"String\"><![CDATA[gmlc {}]]></e57LibraryVersion>\n\
         <coordinateMetadata type=\"String\"/>\n\
         <data3D type=\"Vector\" allowHeterogeneousChildren=\"1\">\n{scans}</data3D>\n\
         <images2D type=\"Vector\" allowHeterogeneousChildren=\"1\">\n</images2D>\n</e57Root>\n",
        env!("CARGO_PKG_VERSION")
    )
}

/// A name that only files with the same points share.
fn guid(sum: &[u8]) -> String {
    let digits = hexadecimal(sum);
    let parts = [&digits[..8], &digits[8..12], &digits[12..16], &digits[16..20], &digits[20..32]];
    format!("{{{}}}", parts.join("-"))
}

/// The smallest and the largest of numbers.
fn ends(values: impl Iterator<Item = f32>) -> Option<(f64, f64)> {
    let finite = values.filter(|v| v.is_finite()).map(f64::from);
    finite.fold(None, |ends, v| Some(ends.map_or((v, v), |(low, high): (f64, f64)| (low.min(v), high.max(v)))))
}

/// Contents, cut into pages with their checksums.
struct Pages<'a> {
    out: &'a mut dyn Out,
    /// The contents of the current page so far.
    page: Vec<u8>,
    /// Those of the first page, once it is whole.
    first: Vec<u8>,
    /// The logical position of what comes next.
    position: u64,
    /// Of all contents.
    sum: Sha256,
}

impl Pages<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sum.update(bytes);
        self.position += bytes.len() as u64;
        let mut bytes = bytes;
        while !bytes.is_empty() {
            let (now, later) = bytes.split_at(bytes.len().min(CONTENT - self.page.len()));
            self.page.extend_from_slice(now);
            bytes = later;
            if self.page.len() == CONTENT {
                self.flush()?;
            }
        }
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.page.resize(CONTENT, 0);
        self.out.write_all(&self.page)?;
        self.out.write_all(&checksum(&self.page).to_be_bytes())?;
        if self.first.is_empty() {
            self.first = std::mem::take(&mut self.page);
        }
        self.page.clear();
        Ok(())
    }

    /// Writes the last page, and the header into the first.
    fn finish(mut self, xml: u64, length: u64) -> io::Result<()> {
        if !self.page.is_empty() {
            self.flush()?;
        }
        let size = self.out.stream_position()?;
        // The version is 1.0: two numbers of 32 bits.
        let numbers = [u64::from_le_bytes(*b"ASTM-E57"), 1, size, xml, length, (CONTENT + 4) as u64];
        for (place, number) in self.first.as_chunks_mut().0.iter_mut().zip(numbers) {
            *place = number.to_le_bytes();
        }
        self.out.seek(SeekFrom::Start(0))?;
        self.out.write_all(&self.first)?;
        self.out.write_all(&checksum(&self.first).to_be_bytes())?;
        self.out.seek(SeekFrom::Start(size))?;
        Ok(())
    }
}
