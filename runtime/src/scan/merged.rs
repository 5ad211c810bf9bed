//! Several scans as one.

use super::attributes::{Attributes, ScanParts, Station, Stations};
use super::rounded::{self, Rounded};
use super::source::{Cleaning, ScanSource};
use super::{Scan, noise};
use crate::mesh::{Group, TriangleMesh};
use sha2::{Digest, Sha256};

impl Scan {
    /// Several scans of one object as one, each moved as its frame says. Nothing is thinned or averaged: where two
    /// scans show the same surface, there are two layers. The groups of its mesh are the scans, where all are meshes;
    /// what only some of them have beside the geometry is left out.
    ///
    /// # Panics
    /// If there are not as many frames as scans.
    #[must_use]
    pub fn merged(scans: &[Scan], frames: &[Station]) -> Self {
        assert_eq!(scans.len(), frames.len(), "every scan has a frame");
        let all_meshes = scans.iter().all(|scan| !scan.mesh.triangles.is_empty());
        let with_normals = scans.iter().all(|scan| scan.mesh.normals.len() == scan.mesh.positions.len());
        let mut mesh = TriangleMesh::default();
        for (scan, frame) in scans.iter().zip(frames) {
            let (first, start) = (mesh.positions.len() as u32, mesh.triangles.len());
            mesh.positions.extend(scan.mesh.positions.iter().map(|p| frame.point(*p)));
            if with_normals {
                mesh.normals.extend(scan.mesh.normals.iter().map(|n| frame.direction(*n)));
            }
            // Among clouds the corners of triangles would be all that is left of a mesh's surface.
            if all_meshes {
                mesh.triangles.extend(scan.mesh.triangles.iter().map(|t| t.map(|corner| first + corner)));
                mesh.groups.push(Group { name: scan.source.path.clone(), start, end: mesh.triangles.len() });
            }
        }
        let deviation = |scan: &Scan| scan.mesh.positions.len() as f64 * scan.noise.powi(2);
        let points = mesh.positions.len().max(1) as f64;
        let noise = (scans.iter().map(deviation).sum::<f64>() / points).sqrt();
        let source = source(scans, &mesh);
        let oriented = scans.iter().all(|scan| scan.oriented);
        let warnings = scans.iter().flat_map(|scan| named(scan, &scan.warnings)).collect();
        Self { attributes: attributes(scans, frames), mesh, oriented, source, noise, warnings }
    }

    /// Several scans that have one frame already, as one; its noise is estimated anew, for what they are off from each
    /// other is noise to all that comes after.
    #[must_use]
    pub fn in_one_frame(scans: &[Scan]) -> Self {
        let merged = Self::merged(scans, &vec![Station::at([0.0; 3]); scans.len()]);
        let noise = noise::estimate(&merged.mesh, merged.oriented).deviation;
        Self { noise: noise.max(merged.noise), ..merged }
    }
}

/// Sentences on a scan, with the name of its file.
fn named(scan: &Scan, sentences: &[String]) -> Vec<String> {
    sentences.iter().map(|sentence| format!("{}: {sentence}", scan.source.path)).collect()
}

/// The files of all scans as one source: what they have in common, and a sum of their sums.
fn source(scans: &[Scan], mesh: &TriangleMesh) -> ScanSource {
    let all = |of: &dyn Fn(&ScanSource) -> String| scans.iter().map(|scan| of(&scan.source)).collect::<Vec<String>>();
    let common = |values: Vec<String>| {
        let first = values.first().cloned().unwrap_or_default();
        if values.iter().all(|value| *value == first) { first } else { String::new() }
    };
    let sums = all(&|source| source.sha256.clone());
    let known = sums.iter().all(|sum| !sum.is_empty());
    let sum = |sums: Vec<String>| Sha256::digest(sums.join("\n")).iter().map(|byte| format!("{byte:02x}")).collect();
    ScanSource {
        path: all(&|source| source.path.clone()).join(", "),
        sha256: if known { sum(sums) } else { String::new() },
        points: mesh.positions.len(),
        triangles: mesh.triangles.len(),
        unit: common(all(&|source| source.unit.clone())),
        format: common(all(&|source| source.format.clone())),
        cleaning: Cleaning::default(),
    }
}

/// What all scans have beside the geometry. Stations keep their numbers, after those of the scans before.
fn attributes(scans: &[Scan], frames: &[Station]) -> Attributes {
    fn joined<T: Clone>(scans: &[Scan], of: impl Fn(&Scan) -> &[T]) -> Vec<T> {
        let all = scans.iter().all(|scan| of(scan).len() == scan.mesh.positions.len());
        if all { scans.iter().flat_map(|scan| of(scan).to_vec()).collect() } else { Vec::new() }
    }
    let mut stations = Stations::default();
    if scans.iter().any(|scan| !scan.attributes.stations.places.is_empty()) {
        for (scan, frame) in scans.iter().zip(frames) {
            let own = &scan.attributes.stations;
            let first = stations.places.len();
            let number = |n: u16| {
                let known = n != Stations::UNKNOWN;
                known.then(|| u16::try_from(first + usize::from(n)).ok()).flatten().unwrap_or(Stations::UNKNOWN)
            };
            stations.places.extend(own.places.iter().map(|station| moved(station, frame)));
            let of_points = own.of_points.iter().map(|n| number(*n));
            let lacking = scan.mesh.positions.len() - own.of_points.len();
            stations.of_points.extend(of_points.chain(std::iter::repeat_n(Stations::UNKNOWN, lacking)));
        }
    }
    let steps: Vec<&Rounded> = scans.iter().map(|scan| &scan.attributes.rounded).collect();
    let counts: Vec<usize> = scans.iter().map(|scan| scan.mesh.positions.len()).collect();
    Attributes {
        colours: joined(scans, |scan| &scan.attributes.colours),
        intensities: joined(scans, |scan| &scan.attributes.intensities),
        stations,
        parts: parts(scans),
        rounded: rounded::merged(&steps, frames, &counts),
    }
}

/// The number of the scan that each point comes from.
fn parts(scans: &[Scan]) -> ScanParts {
    let numbers = scans.iter().zip(0_u32..);
    ScanParts {
        paths: scans.iter().map(|scan| scan.source.path.clone()).collect(),
        of_points: numbers.flat_map(|(scan, number)| std::iter::repeat_n(number, scan.mesh.positions.len())).collect(),
    }
}

/// A station of a scan in the frame in which the scan was moved.
fn moved(station: &Station, frame: &Station) -> Station {
    let columns: [[f64; 3]; 3] = std::array::from_fn(|k| frame.direction(station.rotation.map(|row| row[k])));
    let rotation = std::array::from_fn(|i| columns.map(|column| column[i]));
    Station { place: frame.point(station.place), rotation }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(path: &str, x: f64) -> Scan {
        let positions = vec![[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]];
        Scan {
            mesh: TriangleMesh {
                positions,
                normals: vec![[0.0, 0.0, 1.0]; 3],
                triangles: vec![[0, 1, 2]],
                ..TriangleMesh::default()
            },
            attributes: Attributes {
                stations: Stations { places: vec![Station::at([x, 0.0, 9.0])], of_points: vec![0; 3] },
                rounded: Rounded::to([0.0, 0.0, 0.1 * x]),
                ..Attributes::default()
            },
            oriented: true,
            source: ScanSource { path: path.into(), sha256: path.into(), unit: "mm".into(), ..ScanSource::default() },
            noise: 0.1 * x,
            warnings: vec!["a fault".into()],
        }
    }

    #[test]
    fn scans_become_one_in_the_frame_of_the_first() {
        // The second one is turned by a quarter about z, and shifted.
        let frame = Station { place: [5.0, 0.0, 0.0], rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]] };
        let merged = Scan::merged(&[scan("a.ply", 1.0), scan("b.ply", 3.0)], &[Station::at([0.0; 3]), frame]);
        assert_eq!(merged.mesh.positions[..2], [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]);
        assert_eq!(merged.mesh.positions[3..5], [[5.0, 3.0, 0.0], [5.0, 4.0, 0.0]]);
        assert_eq!(merged.mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
        let groups: Vec<(&str, usize, usize)> =
            merged.mesh.groups.iter().map(|group| (group.name.as_str(), group.start, group.end)).collect();
        assert_eq!(groups, [("a.ply", 0, 1), ("b.ply", 1, 2)]);
        assert_eq!(merged.attributes.stations.of_points, [0, 0, 0, 1, 1, 1]);
        assert_eq!(merged.attributes.parts.of_points, [0, 0, 0, 1, 1, 1]);
        assert_eq!(merged.attributes.parts.paths, ["a.ply", "b.ply"]);
        assert_eq!(merged.attributes.stations.places[1].place, [5.0, 3.0, 9.0]);
        assert_eq!(merged.attributes.stations.of(4).unwrap().direction([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
        // The root of the mean of 0.01 and 0.09.
        assert!((merged.noise - 0.05_f64.sqrt()).abs() < 1e-12);
        assert_eq!(merged.attributes.rounded.largest(), 0.1 * 3.0);
        assert_eq!((merged.source.path.as_str(), merged.source.unit.as_str()), ("a.ply, b.ply", "mm"));
        assert!(merged.source.sha256.len() == 64 && merged.warnings == ["a.ply: a fault", "b.ply: a fault"]);
        let mixed = Scan { mesh: TriangleMesh { triangles: Vec::new(), ..scan("c", 0.0).mesh }, ..scan("c", 0.0) };
        let cloud = Scan::in_one_frame(&[scan("a.ply", 1.0), mixed]);
        assert!(cloud.mesh.triangles.is_empty() && cloud.mesh.positions.len() == 6);
    }
}
