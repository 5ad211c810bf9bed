//! What a scan has beside its geometry: colours, intensities, and where the scanner stood.

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
        }
    }
}
