//! Real scans and other projects' awkward files, where the test data is at hand.

use super::{Collected, collect};
use std::path::PathBuf;

fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("GMLC_TEST_DATA").map(PathBuf::from);
    if folder.is_none() {
        println!("skipped: GMLC_TEST_DATA is not set");
    }
    folder
}

/// Points, those that are left out, and warnings; or a part of the error.
type Outcome = Result<(usize, u64, usize), &'static str>;

/// Awkward files and the outcomes of reading them. The numbers of points are those of laspy 2.7 and pye57 0.4.
const AWKWARD: [(&str, Outcome); 16] = [
    // Files without points: what comes after the reader says so.
    ("InvalidCVHeader.e57", Ok((0, 0, 0))),
    ("ZeroPoints.e57", Ok((0, 0, 0))),
    ("ZeroPointsInvalid.e57", Ok((0, 0, 0))),
    ("empty.e57", Ok((0, 0, 0))),
    ("empty_pc.e57", Ok((0, 0, 0))),
    ("bad-crc.e57", Err("byte 0: the checksum")),
    ("corrupt_crc.e57", Err("byte 33792: the checksum")),
    ("las2e57_no_images_tag.e57", Ok((153, 0, 0))),
    ("no_ext_namespace.e57", Ok((1, 0, 0))),
    // All ranges are 0.
    ("read_error.e57", Ok((0, 2651, 0))),
    ("garbage_nVariableLength.las", Err("byte 14601: the header announces 719 points, the file ends after 718")),
    ("interesting.las", Ok((1065, 0, 0))),
    ("lots_of_vlr.las", Ok((1, 0, 0))),
    ("noise-dirty.las", Ok((1065, 0, 1))),
    ("spurious.las", Err("degrees of longitude and latitude")),
    // Most of its points are withheld.
    ("wontcompress3.las", Ok((105, 895, 0))),
];

#[test]
fn awkward_files_of_other_projects() {
    let Some(data) = data() else { return };
    for (name, expected) in AWKWARD {
        let bytes = std::fs::read(data.join("nasty/las_e57").join(name)).unwrap();
        match (collect(&bytes, None), expected) {
            (Ok(read), Ok(expected)) => {
                assert_eq!((read.points.len(), read.marked + read.empty, read.warnings.len()), expected, "{name}");
            }
            (Err(error), Err(expected)) => assert!(error.to_string().contains(expected), "{error}, not: {expected}"),
            (found, expected) => panic!("{name}: {expected:?} was expected: {:?}", found.map(|read| read.points.len())),
        }
    }
}

fn mean(read: &Collected) -> [f64; 3] {
    let sum = |k: usize| read.points.iter().map(|p| p.position[k]).sum::<f64>();
    [0, 1, 2].map(|k| sum(k) / read.points.len() as f64)
}

#[test]
fn real_clouds() {
    let Some(data) = data() else { return };
    let read = |name: &str| collect(&std::fs::read(data.join("clouds").join(name)).unwrap(), None).unwrap();
    let (double, integer) = (read("bunnyDouble.e57"), read("bunnyInt19.e57"));
    assert_eq!(double.points.len(), 30_571);
    // Integers count millionths of a metre, and so do the doubles.
    let error = |k: usize, c: usize| (double.points[k].position[c] - integer.points[k].position[c]).abs();
    assert!((0..30_571).all(|k| (0..3).all(|c| error(k, c) < 1e-12)));

    // Means by pye57 0.4 and laspy 2.7.
    let pump = read("pump.e57");
    assert_eq!((pump.points.len(), pump.entries[0].name.as_str(), pump.entries[0].station), (155_201, "pumpA", None));
    for (mean, expected) in
        mean(&pump).into_iter().zip([-0.48268574270140013, -2.6360147583971747, -0.9471621357723211])
    {
        assert!((mean - expected).abs() < 1e-9, "{mean}, not {expected}");
    }
    let colour = pump.points.iter().map(|p| u64::from(p.colour.unwrap()[0])).sum::<u64>();
    assert!((colour as f64 / 155_201.0 - 32.36491388586414).abs() < 1e-9);
    let star = read("lone-star.laz");
    assert_eq!((star.points.len(), star.unit, star.warnings.len()), (518_862, Some(1000.0), 1));
    for (mean, expected) in mean(&star).into_iter().zip([515392.1213511811, 4918365.954509309, 2328.6744374043583]) {
        // Sums of half a million numbers of 5e6.
        assert!((mean - expected).abs() < 1e-7, "{mean}, not {expected}");
    }
}
