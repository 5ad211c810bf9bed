//! Real scans and other projects' awkward files, where the test data is at hand.

use crate::progress::Silent;
use crate::scan::{Unit, read};
use std::path::PathBuf;

fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("GMLC_TEST_DATA").map(PathBuf::from);
    if folder.is_none() {
        println!("skipped: GMLC_TEST_DATA is not set");
    }
    folder
}

/// Points and triangles, or a part of the error.
type Outcome = Result<(usize, usize), &'static str>;

/// Awkward files and the outcomes of reading them.
const AWKWARD: [(&str, Outcome); 53] = [
    ("pdal/LICENSE", Err("text that begins")),
    ("pdal/badheader.txt", Err("line 1: two columns are called `x`")),
    ("pdal/crlf_test.txt", Ok((10, 0))),
    ("pdal/hyper_box.obj", Ok((8, 13))),
    ("pdal/issue_2421.ply", Ok((1, 0))),
    ("pdal/largescan.txt", Ok((6, 0))),
    ("pdal/mesh.ply", Ok((4, 2))),
    ("pdal/missingheader.pcd", Err("line 1: expected the header of a PCD file")),
    ("pdal/missingheader.txt", Ok((5, 0))),
    ("pdal/no_vertex.obj", Err("has no vertices")),
    ("pdal/no_vertex.ply", Err("has no vertices")),
    ("pdal/quoted.txt", Ok((9, 0))),
    ("pdal/simple_binary.obj", Ok((3, 0))),
    ("pdal/sized_dims.ply", Err("no property `z`")),
    ("pdal/text_extradim.ply", Ok((1, 0))),
    ("pdal/unsized_dims.ply", Err("no property `z`")),
    ("pdal/utm17_comma.pcd", Ok((10, 0))),
    ("pdal/utm17_tab.pcd", Ok((10, 0))),
    ("trimesh/LICENSE", Err("text that begins `The MIT License")),
    ("trimesh/busted.STL", Ok((1941, 3878))),
    ("trimesh/comments.off", Ok((8, 12))),
    ("trimesh/empty.obj", Err("has no vertices")),
    ("trimesh/empty.ply", Err("has no vertices")),
    ("trimesh/empty.stl", Err("has no vertices")),
    ("trimesh/face_in_group_name.obj", Ok((1, 0))),
    ("trimesh/face_in_group_name_mid_file.obj", Ok((5, 2))),
    ("trimesh/jacked.obj", Ok((8, 12))),
    ("trimesh/joined_tetrahedra.obj", Ok((5, 7))),
    ("trimesh/metadata.ply", Ok((4, 2))),
    ("trimesh/mirror.ply", Ok((143, 286))),
    ("trimesh/multi.ply", Ok((4, 2))),
    ("trimesh/multibody.stl", Ok((20, 32))),
    ("trimesh/nancolor.obj", Ok((8, 12))),
    ("trimesh/negative_indices.obj", Ok((8, 12))),
    ("trimesh/not_convex.obj", Ok((44, 96))),
    ("trimesh/notenoughindices.obj", Ok((3, 1))),
    ("trimesh/obj_empty.obj", Err("has no vertices")),
    ("trimesh/obj_points.obj", Ok((8, 0))),
    ("trimesh/obj_wireframe.obj", Ok((8, 0))),
    ("trimesh/obj_with_no_face_in_chunk.obj", Ok((3, 1))),
    ("trimesh/ply_empty_ascii.ply", Err("has no vertices")),
    ("trimesh/ply_empty_bin.ply", Err("has no vertices")),
    ("trimesh/ply_empty_header.ply", Err("has no vertices")),
    ("trimesh/points_ascii_with_lists.ply", Ok((5, 0))),
    ("trimesh/points_emptyface.ply", Ok((1024, 0))),
    ("trimesh/polygonfaces.obj", Ok((5, 3))),
    ("trimesh/singlevn.obj", Ok((4, 2))),
    ("trimesh/soup.stl", Ok((300, 100))),
    ("trimesh/stl_empty_ascii.stl", Err("has no vertices")),
    ("trimesh/stl_empty_bin.stl", Err("has no vertices")),
    ("trimesh/two_objects_mixed_case_names.stl", Ok((16, 24))),
    // Walls with windows, faces of 11 corners that are not convex: 721.4 mm2, as fans 741.7.
    ("trimesh/wallhole.obj", Ok((34, 57))),
    ("trimesh/whitespace.off", Ok((8, 12))),
];

#[test]
fn awkward_files_of_other_projects() {
    let Some(data) = data() else { return };
    for (name, expected) in AWKWARD {
        let found = read(&data.join("nasty").join(name), &Unit::Mm.into(), &Silent);
        match (found, expected) {
            (Ok(scan), Ok(expected)) => assert_eq!((scan.source.points, scan.source.triangles), expected, "{name}"),
            (Err(error), Err(expected)) => assert!(error.to_string().contains(expected), "{error}, not: {expected}"),
            (found, expected) => panic!("{name}: {expected:?} was expected: {:?}", found.map(|scan| scan.source)),
        }
    }
}

/// Name, unit, points, triangles, noise, largest extent of the box.
const SCANS: [(&str, Unit, usize, usize, f64, f64); 5] = [
    ("cup/cup_scan.ply", Unit::Mm, 66_191, 131_679, 0.300, 109.0),
    ("scans/ycb_025_mug.ply", Unit::M, 8_185, 16_375, 0.163, 116.9),
    ("scans/ycb_005_tomato_soup_can.obj", Unit::M, 7_850, 15_728, 0.0596, 102.0),
    ("scans/ycb_024_bowl.obj", Unit::M, 8_191, 16_375, 0.174, 161.5),
    ("scans/ggg_sea_vase.ply", Unit::Mm, 18_063, 35_483, 0.270, 449.0),
];

#[test]
fn real_scans() {
    let Some(data) = data() else { return };
    let mut wrong = Vec::new();
    for (name, unit, points, triangles, noise, extent) in SCANS {
        let scan = read(&data.join(name), &unit.into(), &Silent).unwrap();
        assert_eq!((scan.source.points, scan.source.triangles), (points, triangles), "{name}");
        // The cup's is known (0.3); the others' guard against changes.
        if (scan.noise / noise - 1.0).abs() > 0.05 {
            wrong.push(format!("{name}: noise {}", scan.noise));
        }
        let largest = scan.mesh.bounds().size().max_element();
        assert!((largest - extent).abs() < 0.5, "{name}: extent {largest}");
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
