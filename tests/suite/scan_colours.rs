//! What a scan has beside its geometry, its colours and intensities, comes back at the places of the model.

use crate::support::{gmlc, json};
use std::fmt::Write;
use std::fs::{self, File};
use std::path::Path;

pub(crate) const PLATE: &str = "model plate { param a: length = 40mm\n  part top = |u, v| (u * a, v * a, 0mm) }\n";

/// Side of the plate, and its points along it.
const SIDE: f64 = 40.0;
const POINTS: usize = 101;

/// Red grows along x, and green along y.
fn colour([x, y]: [f64; 2]) -> [f64; 3] {
    [255.0 * x / SIDE, 255.0 * y / SIDE, 100.0]
}

/// Four bumps, whose tops are the largest deviations.
fn height([x, y]: [f64; 2]) -> f64 {
    let bump = |cx: f64, cy: f64| (-((x - cx).powi(2) + (y - cy).powi(2)) / 8.0).exp();
    0.8 * (bump(8.0, 9.0) + 0.9 * bump(30.0, 7.0) + 0.8 * bump(9.0, 31.0) + 0.7 * bump(33.0, 28.0))
}

/// Writes a scan of the plate with its bumps as PLY: a mesh or a cloud, with colours or intensities.
pub(crate) fn write_plate(path: &Path, is_mesh: bool, with_colours: bool) {
    let faces = if is_mesh { 2 * (POINTS - 1).pow(2) } else { 0 };
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", POINTS * POINTS);
    text += "property double x\nproperty double y\nproperty double z\n";
    text += match with_colours {
        true => "property uchar red\nproperty uchar green\nproperty uchar blue\n",
        false => "property float intensity\n",
    };
    let _ = writeln!(text, "element face {faces}\nproperty list uchar int vertex_indices\nend_header");
    for i in 0..POINTS * POINTS {
        let place = [i % POINTS, i / POINTS].map(|k| SIDE * k as f64 / (POINTS - 1) as f64);
        let [r, g, b] = colour(place).map(f64::round);
        // Of a cloud the points scatter by 0.01 mm.
        let z = height(place) + if is_mesh { 0.0 } else { 0.01 * ((7919 * i % 101) as f64 / 50.0 - 1.0) };
        let _ = write!(text, "{} {} {z} ", place[0], place[1]);
        let _ = if with_colours { writeln!(text, "{r} {g} {b}") } else { writeln!(text, "{}", 1000.0 + r) };
    }
    for i in (0..faces / 2).map(|i| i / (POINTS - 1) * POINTS + i % (POINTS - 1)) {
        let [right, above] = [i + 1, i + POINTS];
        let _ = writeln!(text, "3 {i} {right} {}\n3 {i} {} {above}", above + 1, above + 1);
    }
    fs::write(path, text).expect("written");
}

fn pixels(path: &Path) -> (usize, Vec<[u8; 3]>) {
    let file = File::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("a picture");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
    let frame = reader.next_frame(&mut bytes).expect("pixels");
    (frame.width as usize, bytes[..frame.buffer_size()].chunks(3).map(|p| [p[0], p[1], p[2]]).collect())
}

/// The texels of the largest deviations, whose places variance.json states, have the colours of these places.
#[test]
fn colours_are_at_their_texels_and_points_keep_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("plate.gml"), PLATE).expect("written");
    for (is_mesh, with_colours) in [(true, true), (false, true), (true, false), (false, false)] {
        write_plate(&at.join("scan.ply"), is_mesh, with_colours);
        let options = ["--resolution", "256", "--max-distance", "3mm", "--points", "--device", "cpu", "-o", "out"];
        gmlc(at, &[&["variance", "plate.gml", "scan.ply"][..], &options].concat());
        let out = at.join("out");
        let report = json(&out.join("variance.json"));
        let (width, texture) = pixels(&out.join("colour.png"));
        assert_eq!((width, texture.len()), (256, 256 * 256));
        let of = &report["colour"];
        assert_eq!(of["source"], if with_colours { "colours" } else { "intensities" });
        let peaks = report["peaks"].as_array().expect("peaks");
        assert!(peaks.len() >= 4, "{peaks:?}");
        for peak in peaks {
            let number = |value: &serde_json::Value| value.as_f64().expect("a number");
            let place = [0, 1].map(|k| number(&peak["place"][k]));
            let [column, row] = [0, 1].map(|k| number(&peak["texel"][k]) as usize);
            let found = texture[row * width + column].map(f64::from);
            let expected = match with_colours {
                true => colour(place),
                false => {
                    let [black, white] = ["black", "white"].map(|name| number(&of[name]));
                    // The 1st and the 99th percentile of 1000 to 1255.
                    assert!((black - 1002.5).abs() < 2.0 && (white - 1252.5).abs() < 2.0, "{of}");
                    [255.0 * ((1000.0 + colour(place)[0] - black) / (white - black)).clamp(0.0, 1.0); 3]
                }
            };
            // A level is 0.16 mm, a texel as wide; bytes are rounded twice, and the stretch has 1.02 of a level.
            let off = (0..3).map(|k| (found[k] - expected[k]).abs()).fold(0.0, f64::max);
            assert!(off < 2.5, "{place:?}: {found:?}, not {expected:?}");
        }
        let points = fs::read(out.join("points.ply")).expect("the points");
        let header = String::from_utf8_lossy(&points[..points.len().min(2000)]).into_owned();
        assert_eq!(header.contains("property uchar red\n"), with_colours);
        assert_eq!(header.contains("property float intensity\n"), !with_colours);
        assert_eq!(out.join("uncertainty.png").exists(), !is_mesh);
        assert_eq!(out.join("uncertainty.tif").exists(), !is_mesh);
        let page = fs::read_to_string(out.join("report.html")).expect("the report");
        assert!(page.contains("id=\"scan-coloured\"") && page.contains("id=\"scan-colours\""));
        assert_eq!(page.contains("Uncertainty of the distances"), !is_mesh);
        if !is_mesh {
            let [median, p95] =
                ["uncertainty_median", "uncertainty_p95"].map(|name| report["cylinder"][name].as_f64().expect(name));
            assert!(0.0 < median && median < p95 && p95 < 0.02, "{}", report["cylinder"]);
        }
    }
}
