//! What a scan has beside its geometry: colours, intensities, where the scanner stood, and of which scan its points
//! are.

use super::rounded::Rounded;
use crate::mesh::retain_marked;

/// What a scan has beside its geometry. Lists are empty, or as long as that of the positions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attributes {
    /// Red, green and blue.
    pub colours: Vec<[u8; 3]>,
    /// Strength of the echo, on the scanner's own scale.
    pub intensities: Vec<f32>,
    /// Where the scanner stood.
    pub stations: Stations,
    /// The number of the scan that a station belongs to, where several were put together.
    pub parts: ScanParts,
    /// To what the coordinates are rounded in the file, where that is coarse beside the noise. (While a file is read:
    /// in which frames they stand there.)
    pub rounded: Rounded,
}

/// The scans of which one was put together. Empty of a scan that is one file's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanParts {
    /// Their files, in the order in which they were given.
    pub paths: Vec<String>,
    /// By point, the index of its scan in `paths`.
    pub of_points: Vec<u32>,
}

/// Where the scanner stood, and what it saw from there: the way from a station to a point of it is empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stations {
    /// The stations, in the order of the file.
    pub places: Vec<Station>,
    /// By point, the index of its station in `places`, or [`UNKNOWN`](Self::UNKNOWN); empty where there are none.
    pub of_points: Vec<u16>,
}

/// A position of the scanner: a point p of its own frame lies at `rotation` p + `place` in the scan's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Where it stood. Millimetres (of a file: its unit), in the scan's frame.
    pub place: [f64; 3],
    /// A rotation matrix, row by row.
    pub rotation: [[f64; 3]; 3],
}

impl Station {
    /// A scanner at a place, whose axes are those of the scan.
    #[must_use]
    pub fn at(place: [f64; 3]) -> Self {
        Self { place, rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] }
    }

    /// A scanner at a place, turned by a quaternion (w, x, y, z) of any length but 0.
    #[must_use]
    pub(crate) fn turned(place: [f64; 3], [w, x, y, z]: [f64; 4]) -> Self {
        let s = 2.0 / (w * w + x * x + y * y + z * z);
        let rotation = [
            [1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
            [s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)],
            [s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)],
        ];
        Self { place, rotation }
    }

    /// The unit quaternion (w, x, y, z) of its rotation, with w not below 0, from its largest component (Shepperd,
    /// 'Quaternion from rotation matrix', 1978).
    #[must_use]
    pub(crate) fn quaternion(&self) -> [f64; 4] {
        let r = &self.rotation;
        let trace = r[0][0] + r[1][1] + r[2][2];
        // Four times the squares of the components.
        let squares = [trace, r[0][0], r[1][1], r[2][2]].map(|s| 1.0 + 2.0 * s - trace);
        let largest = (0..4).fold(0, |best, k| if squares[k] > squares[best] { k } else { best });
        let (skew, sym) = (|i: usize, j: usize| r[i][j] - r[j][i], |i: usize, j: usize| r[i][j] + r[j][i]);
        let row = match largest {
            0 => [squares[0], skew(2, 1), skew(0, 2), skew(1, 0)],
            1 => [skew(2, 1), squares[1], sym(0, 1), sym(0, 2)],
            2 => [skew(0, 2), sym(0, 1), squares[2], sym(1, 2)],
            _ => [skew(1, 0), sym(0, 2), sym(1, 2), squares[3]],
        };
        let length = row.iter().map(|q| q * q).sum::<f64>().sqrt();
        row.map(|q| if row[0] < 0.0 { -q / length } else { q / length })
    }

    /// A point of the scanner's frame in that of the scan.
    #[must_use]
    pub fn point(&self, p: [f64; 3]) -> [f64; 3] {
        let turned = self.direction(p);
        std::array::from_fn(|k| turned[k] + self.place[k])
    }

    /// A direction of the scanner's frame in that of the scan.
    #[must_use]
    pub fn direction(&self, d: [f64; 3]) -> [f64; 3] {
        self.rotation.map(|row| row[0] * d[0] + row[1] * d[1] + row[2] * d[2])
    }

    /// A point of the scan's frame in that of the scanner.
    #[must_use]
    pub fn to_own(&self, p: [f64; 3]) -> [f64; 3] {
        let d: [f64; 3] = std::array::from_fn(|k| p[k] - self.place[k]);
        let r = &self.rotation;
        std::array::from_fn(|k| r[0][k] * d[0] + r[1][k] * d[1] + r[2][k] * d[2])
    }
}

impl Stations {
    /// The index of a point whose station is not known.
    pub const UNKNOWN: u16 = u16::MAX;

    /// The station from which a point was seen, if that is known.
    #[must_use]
    pub fn of(&self, point: usize) -> Option<&Station> {
        self.places.get(usize::from(*self.of_points.get(point)?))
    }
}

impl Attributes {
    /// Keeps those of the points whose mark is set.
    pub(crate) fn retain_marked(&mut self, marks: &[bool]) {
        retain_marked(&mut self.colours, marks);
        retain_marked(&mut self.intensities, marks);
        retain_marked(&mut self.stations.of_points, marks);
        retain_marked(&mut self.parts.of_points, marks);
        self.rounded.retain_marked(marks);
    }

    /// Those of some of the points.
    pub(crate) fn of_points(&self, points: &[u32]) -> Self {
        fn chosen<T: Copy>(values: &[T], points: &[u32]) -> Vec<T> {
            if values.is_empty() { Vec::new() } else { points.iter().map(|point| values[*point as usize]).collect() }
        }
        let of_points = chosen(&self.stations.of_points, points);
        let parts = ScanParts { paths: self.parts.paths.clone(), of_points: chosen(&self.parts.of_points, points) };
        Self {
            colours: chosen(&self.colours, points),
            intensities: chosen(&self.intensities, points),
            stations: Stations { places: self.stations.places.clone(), of_points },
            parts,
            rounded: Rounded {
                frames: self.rounded.frames.clone(),
                of_points: chosen(&self.rounded.of_points, points),
            },
        }
    }

    /// Those of the first point of each of `count` places, where `places` has the place of every point.
    pub(crate) fn merged(&self, places: &[u32], count: usize) -> Self {
        fn firsts<T: Copy + Default>(values: &[T], places: &[u32], count: usize) -> Vec<T> {
            let mut firsts = Vec::with_capacity(if values.is_empty() { 0 } else { count });
            for (place, value) in places.iter().zip(values) {
                // Places are numbered in the order in which they come first.
                if *place as usize == firsts.len() {
                    firsts.push(*value);
                }
            }
            firsts
        }
        let stations = Stations {
            places: self.stations.places.clone(),
            of_points: firsts(&self.stations.of_points, places, count),
        };
        Self {
            colours: firsts(&self.colours, places, count),
            intensities: firsts(&self.intensities, places, count),
            stations,
            parts: ScanParts {
                paths: self.parts.paths.clone(),
                of_points: firsts(&self.parts.of_points, places, count),
            },
            rounded: Rounded {
                frames: self.rounded.frames.clone(),
                of_points: firsts(&self.rounded.of_points, places, count),
            },
        }
    }
}
