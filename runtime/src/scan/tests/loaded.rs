//! Clouds that are loaded as they are, and what is made of them on request.

use super::*;

/// A square grid of 900 points 1 mm apart in the plane z = 0, in ASCII PLY, with normals of length 2, a red level a
/// point, and the first point once more.
fn grid() -> String {
    let mut text = String::from("ply\nformat ascii 1.0\nelement vertex 901\n");
    for name in ["x", "y", "z", "nx", "ny", "nz"] {
        text += &format!("property double {name}\n");
    }
    text += "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    for k in (0..900).chain([0]) {
        text += &format!("{} {} 0 0 0 2 {} 0 0\n", k % 30, k / 30, k % 200);
    }
    text
}

fn loaded(bytes: &str, options: &ReadOptions) -> Result<Loaded, String> {
    let (_folder, path) = file("grid.ply", bytes);
    load(&path, options, &Silent).map_err(|error| error.to_string())
}

#[test]
fn a_surface_is_made_of_a_cloud_whose_points_stay_as_they_are() {
    let options = ReadOptions { surface: true, ..ReadOptions::default() };
    let Loaded { mesh, attributes, cleaning, warnings, .. } = loaded(&grid(), &options).unwrap();
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (900, 2 * 29 * 29));
    assert!((mesh.area() - 29.0 * 29.0).abs() < 1e-9, "{}", mesh.area());
    assert_eq!((cleaning.equal_points, cleaning.unused), (1, 0));
    assert_eq!(mesh.normals, vec![[0.0, 0.0, 2.0]; 900]);
    for (p, colour) in mesh.positions.iter().zip(&attributes.colours) {
        assert_eq!(f64::from(colour[0]), (p[0] + 30.0 * p[1]) % 200.0);
    }
    assert!(mesh.triangles.iter().all(|t| mesh.triangle_normal(*t).unwrap().z > 0.0), "the normals tell the sides");
    assert!(warnings.iter().any(|w| w.contains("1682 triangles were made of its 900 points")), "{warnings:?}");
}

#[test]
fn points_without_a_surface_are_refused() {
    let line = "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
        end_header\n0 0 0\n1 0 0\n2 0 0\n3 0 0\n";
    let options = ReadOptions { surface: true, ..ReadOptions::default() };
    assert!(loaded(line, &options).unwrap_err().contains("no triangles can be made of its 4 points"));
}

#[test]
fn points_that_are_drawn_of_a_cloud_keep_their_normals() {
    let options = ReadOptions { decimate: Some(100), ..ReadOptions::default() };
    let Loaded { mesh, cleaning, .. } = loaded(&grid(), &options).unwrap();
    assert_eq!((mesh.normals, cleaning.decimated), (vec![[0.0, 0.0, 2.0]; 100], 801));
}
