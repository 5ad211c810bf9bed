//! Figures of small files whose truth is known.

use super::*;
use crate::progress::Silent;

fn surveyed(name: &str, text: &str) -> Survey {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    survey(&path, &ReadOptions::default(), &Silent).unwrap()
}

/// A cube of edge 2, without some of its twelve triangles.
fn cube(edge: f64, without: usize) -> String {
    let vertex =
        |i: usize| format!("v {} {} {}\n", edge * (i & 1) as f64, edge * (i >> 1 & 1) as f64, edge * (i >> 2) as f64);
    let faces = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"];
    let triangles = faces.iter().flat_map(|face| {
        let v: Vec<&str> = face.split(' ').collect();
        [format!("f {} {} {}\n", v[0], v[1], v[2]), format!("f {} {} {}\n", v[0], v[2], v[3])]
    });
    (0..8).map(vertex).chain(triangles.skip(without)).collect()
}

#[test]
fn a_cube_is_closed_and_an_open_one_has_a_rim() {
    let closed = surveyed("a.obj", &cube(20.0, 0));
    let surface = closed.surface.unwrap();
    assert_eq!((surface.rims, surface.edges_of_many, surface.torn_edges), (0, 0, 0));
    assert!((surface.volume.unwrap() - 8000.0).abs() < 1e-9 && (surface.area - 2400.0).abs() < 1e-9);
    assert_eq!(
        (closed.pieces, closed.largest_piece, closed.normals, closed.unit_from),
        (1, 1.0, "triangles", "default")
    );
    assert!(closed.suspicions.is_empty(), "{:?}", closed.suspicions);
    let open = surveyed("a.obj", &cube(20.0, 2)).surface.unwrap();
    assert_eq!((open.rims, open.volume), (1, None));
    assert!((open.largest_rim - 20.0 * 2.0_f64.sqrt()).abs() < 1e-9);
}

#[test]
fn what_looks_wrong_is_said() {
    let said = |survey: &Survey, what: &str| survey.suspicions.iter().any(|s| s.contains(what));
    assert!(said(&surveyed("a.obj", &cube(0.1, 0)), "--unit m"));
    let torn = cube(20.0, 0).replace("f 1 3 4\n", "f 1 4 3\n");
    assert!(said(&surveyed("a.obj", &torn), "3 edges lie between triangles that face to different sides"));
    let moved = |line: &str| match line.strip_prefix("f ") {
        Some(face) => {
            let corners: Vec<String> = face.split(' ').map(|i| (i.parse::<u32>().unwrap() + 8).to_string()).collect();
            format!("f {}\n", corners.join(" "))
        }
        None => format!("{}\n", line.replacen("v ", "v 5", 1)),
    };
    // A 5 before the first digit: 50 and 520 for 0 and 20.
    let two = cube(20.0, 0) + &cube(20.0, 0).lines().map(moved).collect::<String>();
    let two = surveyed("a.obj", &two);
    assert_eq!(two.pieces, 2);
    assert!(said(&two, "it has 2 pieces"), "{:?}", two.suspicions);
    // All over a cube of 100 mm.
    let few: String = (0..60).map(|i| format!("v {} {} {}\n", i * 37 % 101, i * 53 % 97, i * 71 % 89)).collect();
    assert!(said(&surveyed("a.obj", &few), "so few points hardly tell noise from shape"));
    let flat: String = (0..100).map(|i| format!("v {} {} 7\n", i % 10, i / 10)).collect();
    assert!(said(&surveyed("a.obj", &flat), "the same z"));
}

#[test]
fn distances_of_neighbours_are_those_of_a_grid() {
    let up = |i: u32| 0.3 * (0.03 * f64::from(i % 50)).sin();
    let text: String = (0..2500).map(|i| format!("v {} {} {}\n", i % 50, i / 50, up(i))).collect();
    let found = surveyed("a.obj", &text);
    assert!(found.spacing.iter().all(|s| (s - 1.0).abs() < 1e-3), "{:?}", found.spacing);
    assert!(!found.oriented && found.normals == "neighbours" && found.surface.is_none());
    assert_eq!(found.precision, None);
}
