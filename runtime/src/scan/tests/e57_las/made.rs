//! Files made for tests.

use crate::export::scan::{Grid, Recorded, ScanFormat, write};
use crate::mesh::TriangleMesh;
use crate::scan::formats::e57::pages::{CONTENT, PAGE, checksum, physical};
use crate::scan::{Attributes, Station, Stations, Unit};

/// A scan of two stations far from the origin, with all that a file may have.
pub(super) struct Made {
    pub(super) mesh: TriangleMesh,
    pub(super) attributes: Attributes,
    pub(super) grids: Vec<Grid>,
}

/// The place of the scan (UTM), in millimetres.
pub(super) const FAR: [f64; 3] = [515_368_000.0, 4_918_340_000.0, 2_323_000.0];
/// Rows of the grids.
const ROWS: usize = 7;

impl Made {
    pub(super) fn new(count: usize) -> Self {
        let noise = |k: usize| f64::from((k as u32).wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
        let point = |k: usize| [0, 1, 2].map(|c| FAR[c] + 5000.0 * noise(3 * k + c));
        let mut mesh = TriangleMesh { positions: (0..count).map(point).collect(), ..TriangleMesh::default() };
        mesh.normals = (0..count).map(|k| if k % 2 == 0 { [0.6, 0.0, 0.8] } else { [0.0, -1.0, 0.0] }).collect();
        let (sine, cosine) = 2.5_f64.sin_cos();
        let turned = [[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]];
        let place = |c: f64| FAR.map(|far| far + c);
        let places = vec![Station { place: place(-700.0), rotation: turned }, Station::at(place(900.5))];
        let first = count / 3;
        let of_points = (0..count).map(|k| u16::from(k >= first)).collect();
        let attributes = Attributes {
            colours: (0..count).map(|k| [k as u8, (k / 256) as u8, 200]).collect(),
            intensities: (0..count).map(|k| (k % 1000) as f32).collect(),
            stations: Stations { places, of_points },
            ..Attributes::default()
        };
        let grid = |points: std::ops::Range<usize>| {
            // A cell of each column is empty.
            let columns = points.len().div_ceil(ROWS - 1);
            let mut cells = vec![Grid::EMPTY; columns * ROWS];
            for (k, point) in points.enumerate() {
                cells[k / (ROWS - 1) * ROWS + k % (ROWS - 1)] = point as u32;
            }
            Grid { columns, rows: ROWS, cells }
        };
        Self { mesh, attributes, grids: vec![grid(0..first), grid(first..count)] }
    }

    pub(super) fn to_bytes(&self, format: ScanFormat) -> Vec<u8> {
        let (mesh, attributes, grids) = (&self.mesh, &self.attributes, self.grids.as_slice());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scan");
        write(&path, &Recorded { mesh, attributes, grids, unit: Unit::Mm }, format).unwrap();
        std::fs::read(path).unwrap()
    }
}

/// Cuts contents into pages, with their checksums.
pub(super) fn pages(contents: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for content in contents.chunks(CONTENT) {
        let mut page = content.to_vec();
        page.resize(CONTENT, 0);
        bytes.extend_from_slice(&page);
        bytes.extend_from_slice(&checksum(&page).to_be_bytes());
    }
    bytes
}

/// Corrects the checksums of a file that was changed.
pub(super) fn seal(bytes: &mut [u8]) {
    for page in bytes.chunks_exact_mut(PAGE) {
        let sum = checksum(&page[..CONTENT]).to_be_bytes();
        page[CONTENT..].copy_from_slice(&sum);
    }
}

/// An E57 file of one scan: elements of the scan, those of its prototype, the number of points, and packets with the
/// bytes of each field.
pub(super) fn e57(about: &str, prototype: &str, records: u64, packets: &[Vec<Vec<u8>>]) -> Vec<u8> {
    let mut contents = vec![0; 48];
    let mut data = Vec::new();
    for fields in packets {
        let size = (6 + 2 * fields.len() + fields.concat().len()).next_multiple_of(4);
        let start = data.len();
        data.extend_from_slice(&[1, 0]);
        data.extend_from_slice(&((size - 1) as u16).to_le_bytes());
        data.extend_from_slice(&(fields.len() as u16).to_le_bytes());
        fields.iter().for_each(|field| data.extend_from_slice(&(field.len() as u16).to_le_bytes()));
        data.extend(fields.concat());
        data.resize(start + size, 0);
    }
    contents.extend_from_slice(&1_u64.to_le_bytes());
    contents.extend_from_slice(&(32 + data.len() as u64).to_le_bytes());
    contents.extend_from_slice(&80_u64.to_le_bytes());
    contents.extend_from_slice(&0_u64.to_le_bytes());
    contents.extend(data);
    let xml = format!(
        "<e57Root xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\" xmlns:nor=\"n\"><data3D><vectorChild>{about}\
         <points fileOffset=\"48\" recordCount=\"{records}\"><prototype>{prototype}</prototype></points></vectorChild>\
         </data3D></e57Root>"
    );
    let start = physical(contents.len() as u64);
    contents.extend_from_slice(xml.as_bytes());
    let size = contents.len().div_ceil(CONTENT) * PAGE;
    let numbers = [u64::from_le_bytes(*b"ASTM-E57"), 1, size as u64, start, xml.len() as u64, PAGE as u64];
    contents[..48].copy_from_slice(&numbers.map(u64::to_le_bytes).concat());
    pages(&contents)
}

/// The bytes of numbers.
pub(super) fn doubles(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A LAS file of an older version: points with three coordinates (scale 0.01) and whatever bytes follow these.
pub(super) fn las(
    version: u8,
    format: u8,
    records: &[(&str, u16, Vec<u8>)],
    points: &[([i32; 3], Vec<u8>)],
) -> Vec<u8> {
    const HEADER: usize = 227;
    let mut head = vec![0; HEADER];
    let mut put = |at: usize, bytes: &[u8]| head[at..at + bytes.len()].copy_from_slice(bytes);
    let length: usize = records.iter().map(|(.., bytes)| 54 + bytes.len()).sum();
    put(0, b"LASF");
    put(24, &[1, version]);
    put(94, &(HEADER as u16).to_le_bytes());
    put(96, &((HEADER + length) as u32).to_le_bytes());
    put(100, &(records.len() as u32).to_le_bytes());
    put(104, &[format]);
    put(105, &points.first().map_or(20, |(_, rest)| 12 + rest.len() as u16).to_le_bytes());
    put(107, &(points.len() as u32).to_le_bytes());
    for k in 0..3 {
        put(131 + 8 * k, &0.01_f64.to_le_bytes());
        put(179 + 16 * k, &1e4_f64.to_le_bytes());
        put(187 + 16 * k, &(-1e4_f64).to_le_bytes());
    }
    for (user, id, bytes) in records {
        let start = head.len();
        head.resize(start + 54, 0);
        head[start + 2..start + 2 + user.len()].copy_from_slice(user.as_bytes());
        head[start + 18..start + 20].copy_from_slice(&id.to_le_bytes());
        head[start + 20..start + 22].copy_from_slice(&(bytes.len() as u16).to_le_bytes());
        head.extend_from_slice(bytes);
    }
    for (position, rest) in points {
        position.iter().for_each(|c| head.extend_from_slice(&c.to_le_bytes()));
        head.extend_from_slice(rest);
    }
    head
}
