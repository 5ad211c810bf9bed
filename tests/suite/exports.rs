//! Files for other tools: `--export`, and the meshes of `gmlc mesh`.

use crate::support::{example, fails, gmlc, gmlc_in, json};
use std::collections::{HashMap, HashSet};
use std::io::Read;
use std::path::Path;
use tempfile::{TempDir, tempdir};

const CAN: &str = "use std.surface (cylinder, disc, flip)\nmodel can {\n\
    param r: length = 20mm\n param h: length = 50mm\n\
    part side = cylinder(r, h)\n\
    part lid = |u, v| disc(r)(u, v) + (0mm, 0mm, h)\n\
    part base = flip(disc(r))\n}\n";

/// A folder with a can, and a mesh of one that is a millimetre larger on all sides but at its base.
fn folder() -> TempDir {
    let folder = tempdir().expect("a folder");
    std::fs::write(folder.path().join("can.gml"), CAN).expect("written");
    gmlc(folder.path(), &["mesh", "can.gml", "-p", "r=21mm", "-p", "h=51mm", "-o", "scan.ply"]);
    folder
}

const MEASURE: [&str; 9] =
    ["variance", "can.gml", "scan.ply", "--max-distance", "5mm", "--resolution", "128", "--device", "cpu"];

/// The rows of a table without quotation marks, by their heads.
fn rows(path: &Path) -> Vec<HashMap<String, String>> {
    let text = std::fs::read_to_string(path).expect("a table");
    let mut lines = text.strip_suffix("\r\n").expect("ended lines").split("\r\n");
    let head: Vec<&str> = lines.next().expect("a head").split(',').collect();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), head.len(), "{line}");
        head.iter().zip(cells).map(|(head, cell)| ((*head).to_owned(), cell.to_owned())).collect()
    };
    lines.map(row).collect()
}

/// Requires a cell to be a figure of a JSON file, but for the last digit: the reader of that rounds it.
fn require_equal(cell: &str, expected: &serde_json::Value, head: &str) {
    let (cell, expected): (f64, f64) = (cell.parse().expect(head), expected.as_f64().expect(head));
    assert!((cell - expected).abs() <= f64::EPSILON * expected.abs(), "{head}: {cell}, not {expected}");
}

/// Bytes behind the header of a PLY file, and the header.
fn ply(path: &Path) -> (String, Vec<u8>) {
    let bytes = std::fs::read(path).expect("a file");
    let end = b"end_header\n";
    let header = bytes.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    (String::from_utf8_lossy(&bytes[..header]).into_owned(), bytes[header..].to_vec())
}

fn count(header: &str, element: &str) -> usize {
    let (_, rest) = header.split_once(&format!("element {element} ")).expect("the element");
    rest.split_whitespace().next().and_then(|n| n.parse().ok()).expect("a number")
}

#[test]
fn deviations_are_written_for_other_tools() {
    let folder = folder();
    let at = folder.path();
    gmlc(at, &[&MEASURE[..], &["--export", "ply,vtp", "--export", "glb,csv,svg", "-o", "out"]].concat());
    let (header, body) = ply(&at.join("out/deviations.ply"));
    let (vertices, record) = (count(&header, "vertex"), 24 + 12 + 3 + 12 + 4 + 1);
    assert_eq!(body.len(), vertices * record + count(&header, "face") * 13);
    let number = |record: &[u8], at: usize| f32::from_le_bytes(record[at..at + 4].try_into().expect("4 bytes"));
    let mut parts = HashSet::new();
    for vertex in body[..vertices * record].chunks_exact(record) {
        let (distance, part, class) = (number(vertex, 39), vertex[51], vertex[55]);
        parts.insert(part);
        // The chords of the side are up to 0.02 mm away from the cylinder; the base is where it was.
        let expected = if part == 2 { 0.0 } else { 0.99 };
        assert!(class == 1 && (distance - expected).abs() < 0.011, "{part}: {distance}, class {class}");
        assert!(number(vertex, 47) >= 0.0, "a level of detection");
    }
    assert_eq!(parts.len(), 3);
    let vtp = std::fs::read_to_string(at.join("out/deviations.vtp")).expect("text");
    assert!(vtp.contains(&format!("NumberOfPoints=\"{vertices}\"")) && vtp.ends_with("</VTKFile>\n"));
    let points = std::fs::read_to_string(at.join("out/points.vtp")).expect("text");
    let scanned = count(&ply(&at.join("out/points.ply")).0, "vertex");
    assert!(points.contains(&format!("NumberOfPoints=\"{scanned}\" NumberOfVerts=\"{scanned}\"")));
    assert!(std::fs::read(at.join("out/deviations.glb")).expect("a file").starts_with(b"glTF\x02\0\0\0"));

    let report = json(&at.join("out/variance.json"));
    let table = rows(&at.join("out/parts.csv"));
    assert_eq!(table.len(), 3);
    for (row, part) in table.iter().zip(report["parts"].as_array().expect("parts")) {
        assert_eq!(part["name"], row["part"].as_str());
        let figures = [
            ("area_mm2", &part["area"]),
            ("coverage", &part["coverage"]),
            ("p95_mm", &part["percentiles"]["p95"]),
            ("signed_mean_mm", &part["signed"]["mean"]),
            ("detection_mm", &part["detection"]["level"]),
            ("within_share", &part["agreement"]["within"]["share"]),
        ];
        for (head, expected) in figures {
            require_equal(&row[head], expected, head);
        }
    }
    let parameters = rows(&at.join("out/parameters.csv"));
    let [r, h] = &parameters[..] else { panic!("{parameters:?}") };
    assert_eq!((r["parameter"].as_str(), r["value"].as_str(), r["unit"].as_str()), ("r", "20", "mm"));
    assert_eq!((h["value"].as_str(), h["sd"].as_str(), h["without_sd"].as_str()), ("50", "", "not fitted"));
    assert_eq!(std::fs::read_dir(at.join("out")).expect("a folder").count(), 22, "with eleven for triangles");

    // They are files of that result, and go with it.
    std::fs::write(at.join("out/notes.csv"), "mine").expect("written");
    gmlc(at, &[&MEASURE[..], &["-o", "out"]].concat());
    for name in [
        "deviations.ply",
        "deviations.vtp",
        "points.vtp",
        "deviations.glb",
        "parts.csv",
        "parameters.csv",
        "labels.csv",
        "legend.svg",
        "histogram.svg",
        "section.svg",
    ] {
        assert!(!at.join("out").join(name).exists(), "{name}");
    }
    assert!(at.join("out/notes.csv").exists());
    let error = fails(at, &[&MEASURE[..], &["--export", "vtk", "-o", "out"]].concat(), 2);
    assert!(error.contains("--export") && error.contains("vtp"), "{error}");
}

/// Names of parts come from files; a spreadsheet must not take one for a formula.
#[test]
fn names_from_files_are_no_formulas_and_no_markup() {
    let folder = folder();
    let at = folder.path();
    let text = "v 0 0 0\nv 60 0 0\nv 60 60 0\nv 0 60 0\ng =1+1,\"<b>\"\nf 1 2 3\ng @x\nf 1 3 4\n";
    std::fs::write(at.join("plate.obj"), text).expect("written");
    let lifted = text.replace(" 0\n", " 0.5\n");
    std::fs::write(at.join("lifted.obj"), lifted).expect("written");
    let options = ["--max-distance", "2mm", "--resolution", "64", "--export", "ply,vtp,glb,csv", "-o", "out"];
    gmlc(at, &[&["variance", "plate.obj", "lifted.obj"][..], &options].concat());
    let table = std::fs::read_to_string(at.join("out/parts.csv")).expect("a table");
    let names: Vec<&str> = table.split("\r\n").skip(1).collect();
    assert!(names[0].starts_with("\"'=1+1,\"\"<b>\"\"\",") && names[1].starts_with("'@x,"), "{table}");
    let vtp = std::fs::read_to_string(at.join("out/deviations.vtp")).expect("text");
    assert!(!vtp.contains("<b>"));
    assert!(!at.join("out/parameters.csv").exists(), "a mesh has no parameters");
}

/// A fit's parameters have their standard deviations in the table.
#[test]
fn parameters_of_an_inspection_have_standard_deviations() {
    let folder = folder();
    let at = folder.path();
    let scan = ["scan", "can.gml", "-p", "r=21mm", "--spacing", "2mm", "--noise", "0.05mm", "-o", "noisy.ply"];
    gmlc(at, &scan);
    gmlc(at, &["inspect", "can.gml", "noisy.ply", "--resolution", "128", "--export", "csv", "-o", "out"]);
    let fit = json(&at.join("out/fit.json"));
    let table = rows(&at.join("out/parameters.csv"));
    assert_eq!(table.len(), 2);
    for (row, parameter) in table.iter().zip(fit["parameters"].as_array().expect("parameters")) {
        assert_eq!(parameter["name"], row["parameter"].as_str());
        for head in ["value", "sd"] {
            require_equal(&row[head], &parameter[head], head);
        }
        assert!(row["sd"].parse::<f64>().is_ok_and(|sd| sd > 0.0 && sd < 0.1) && row["without_sd"].is_empty());
    }
}

/// Triangles by index: every edge has exactly two, which run along it in opposite directions, and all hang together.
fn require_closed(name: &str, triangles: &[[u32; 3]]) {
    let mut edges: HashMap<(u32, u32), Vec<bool>> = HashMap::new();
    let mut component: Vec<u32> = (0..=triangles.iter().flatten().copied().max().expect("triangles")).collect();
    fn root(component: &mut [u32], mut i: u32) -> u32 {
        while component[i as usize] != i {
            component[i as usize] = component[component[i as usize] as usize];
            i = component[i as usize];
        }
        i
    }
    for t in triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            assert_ne!(a, b, "{name}");
            edges.entry((a.min(b), a.max(b))).or_default().push(a < b);
            let (a, b) = (root(&mut component, a), root(&mut component, b));
            component[a as usize] = b;
        }
    }
    for (edge, sides) in edges {
        assert!(sides.len() == 2 && sides[0] != sides[1], "{name}: {edge:?} has {} triangles", sides.len());
    }
    let roots: HashSet<u32> = triangles.iter().map(|t| root(&mut component, t[0])).collect();
    assert_eq!(roots.len(), 1, "{name}: components");
}

/// The mesh of a closed model is closed by the indices of its file; STL, which has none, by the bits of its positions.
#[test]
fn meshes_of_closed_models_are_welded() {
    let folder = folder();
    let at = folder.path();
    for script in ["can.gml", &example("bowl/bowl.gml"), &example("planter/planter.gml")] {
        for format in ["obj", "ply", "stl"] {
            gmlc(at, &["mesh", script, "-o", &format!("made.{format}")]);
        }
        let obj = std::fs::read_to_string(at.join("made.obj")).expect("text");
        let corner = |word: &str| word.split('/').next().and_then(|n| n.parse::<u32>().ok()).expect("an index");
        let face = |line: &str| <[u32; 3]>::try_from(line.split(' ').skip(1).map(corner).collect::<Vec<_>>()).ok();
        let faces: Vec<[u32; 3]> = obj.lines().filter(|l| l.starts_with("f ")).filter_map(face).collect();
        require_closed("obj", &faces);

        let (header, body) = ply(&at.join("made.ply"));
        assert!(!header.contains("texcoord") && header.contains("property float nz\nelement face"), "{header}");
        let (vertices, triangles) = (count(&header, "vertex"), count(&header, "face"));
        let index =
            |bytes: &[u8], k: usize| u32::from_le_bytes(bytes[1 + 4 * k..5 + 4 * k].try_into().expect("4 bytes"));
        let indices: Vec<[u32; 3]> =
            body[vertices * 36..].chunks_exact(13).map(|face| [0, 1, 2].map(|k| index(face, k))).collect();
        assert_eq!((indices.len(), triangles), (faces.len(), faces.len()));
        require_closed("ply", &indices);

        let stl = std::fs::read(at.join("made.stl")).expect("a file");
        let mut places: HashMap<&[u8], u32> = HashMap::new();
        let mut place = |bytes: &'static [u8]| {
            let next = places.len() as u32;
            *places.entry(bytes).or_insert(next)
        };
        let stl: &'static [u8] = stl.leak();
        let corners: Vec<[u32; 3]> =
            stl[84..].chunks_exact(50).map(|t| [0, 1, 2].map(|k| place(&t[12 + 12 * k..24 + 12 * k]))).collect();
        require_closed("stl", &corners);
        assert_eq!(places.len(), vertices);
    }
}

/// At an edge a position has a normal for each side in OBJ.
#[test]
fn edges_keep_the_normals_of_both_sides() {
    let folder = folder();
    gmlc(folder.path(), &["mesh", "can.gml", "-o", "can.obj"]);
    let obj = std::fs::read_to_string(folder.path().join("can.obj")).expect("text");
    let numbers = |line: &str| line.split(' ').skip(1).filter_map(|w| w.parse().ok()).collect::<Vec<f64>>();
    let of = |kind: &str| obj.lines().filter(|l| l.starts_with(kind)).map(numbers).collect::<Vec<_>>();
    let (positions, normals) = (of("v "), of("vn "));
    let mut facing: HashMap<usize, HashSet<[i64; 3]>> = HashMap::new();
    for word in obj.lines().filter(|l| l.starts_with("f ")).flat_map(|l| l.split(' ').skip(1)) {
        let indices: Vec<usize> = word.split('/').filter_map(|n| n.parse().ok()).collect();
        let normal = [0, 1, 2].map(|k| (1e6 * normals[indices[2] - 1][k]).round() as i64);
        facing.entry(indices[0] - 1).or_default().insert(normal);
    }
    let mut rim = 0;
    for (position, normals) in facing {
        let [x, y, z] = positions[position][..] else { panic!("no position") };
        if (x.hypot(y) - 20.0).abs() < 1e-9 && z == 50.0 {
            rim += 1;
            let radial = [x / 20.0, y / 20.0, 0.0].map(|c| (1e6 * c).round() as i64);
            assert!(normals.contains(&[0, 0, 1_000_000]) && normals.contains(&radial), "{x} {y}: {normals:?}");
        }
    }
    assert!(rim > 20, "{rim} places on the rim");
}

/// The scale of colours follows a tolerance that all parts with one share, or is the user's, and is recorded.
#[test]
fn the_colour_scale_follows_the_tolerance_or_the_user() {
    let folder = folder();
    let at = folder.path();
    let end = |options: &[&str], out: &str| {
        gmlc_in(at, &[&MEASURE[..], &["--export", "ply", "-q", "-o", out], options].concat());
        let (header, _) = ply(&at.join(out).join("deviations.ply"));
        header.split_once("colours end at ").expect("the scale").1.lines().next().expect("a line").to_owned()
    };
    // All but the base, an eighth of the area, is off by 1 mm, less the chords of the scan: the next step is 1.
    assert_eq!(end(&[], "robust"), "1 mm");
    assert_eq!(
        end(&["--tolerance", "+0.5/-0.25mm"], "followed"),
        "1.5 mm, are neutral from -0.25 to 0.5 mm, and have 4 steps beyond"
    );
    assert_eq!(end(&["--scale", "0.025cm"], "given"), "0.25 mm");
    assert_eq!(
        end(&["--scale", "2mm", "--tolerance", "0.5mm"], "both"),
        "2 mm, are neutral from -0.5 to 0.5 mm, and have 4 steps beyond"
    );
    let settings = json(&at.join("given/variance.json"))["provenance"]["settings"].clone();
    let scale = settings.as_array().expect("settings").iter().find(|setting| setting["name"] == "scale");
    assert_eq!(scale.expect("the scale")["values"][0], "0.025cm");
    std::fs::write(at.join("gmlc.toml"), "[variance]\nscale = \"0.3mm\"\n").expect("written");
    assert_eq!(end(&[], "set"), "0.3 mm");
    for (wrong, said) in [("0mm", "is not above zero"), ("-1mm", "is below zero"), ("inf", "mm"), ("3", "unit")] {
        let error = fails(at, &[&MEASURE[..], &[&format!("--scale={wrong}"), "-o", "out"]].concat(), 2);
        assert!(error.contains("--scale") && error.contains(said), "{wrong}: {error}");
    }
}

/// Drawings are XML without scripts and requests, whatever the files are called.
#[test]
fn drawings_are_valid_and_load_nothing() {
    let folder = folder();
    let at = folder.path();
    std::fs::rename(at.join("scan.ply"), at.join("a&b <i>.ply")).expect("renamed");
    let args: Vec<&str> = MEASURE.iter().map(|word| if *word == "scan.ply" { "a&b <i>.ply" } else { *word }).collect();
    gmlc(at, &[&args[..], &["--export", "svg", "-o", "out"]].concat());
    for name in ["legend.svg", "histogram.svg", "section.svg"] {
        let path = at.join("out").join(name);
        let text = std::fs::read_to_string(&path).expect("text");
        assert!(text.contains("<title>can compared with a&amp;b &lt;i&gt;.ply: "), "{name}: {text}");
        assert!(text.contains("mm") && text.ends_with("</svg>\n"), "{name}");
        let without_namespace = text.replacen("http://www.w3.org/2000/svg", "", 1);
        for word in ["<script", "href", "url(", "http", "@import", "NaN", "inf"] {
            assert!(!without_namespace.contains(word), "{name}: {word}");
        }
        if let Ok(checked) = std::process::Command::new("xmllint").args(["--nonet", "--noout"]).arg(&path).output() {
            assert!(checked.status.success(), "{name}: {}", String::from_utf8_lossy(&checked.stderr));
        }
    }
    // The can is cut along its axis: a rectangle of 40 x 50 mm, drawn 520 units high, with whiskers of about 1 mm.
    let section = std::fs::read_to_string(at.join("out/section.svg")).expect("text");
    assert!(section.contains("viewBox=\"0 0 860 ") && section.contains("times as long"), "{section}");
    assert!(section.contains("stroke=\"#1d2127\"") && section.contains("<g transform"), "{section}");
}

/// The compressed scene holds what the plain one does, and takes its place; both follow the tolerance.
#[test]
fn the_scene_is_compressed_if_that_is_asked_for() {
    let folder = folder();
    let at = folder.path();
    let run = |options: &[&str]| {
        gmlc_in(at, &[&MEASURE[..], &["--tolerance", "0.5mm", "-q", "-o", "out"], options].concat());
    };
    run(&[]);
    let plain = std::fs::read_to_string(at.join("out/model.x3d")).expect("text");
    run(&["--scene", "x3dz"]);
    assert!(!at.join("out/model.x3d").exists(), "the folder is that of one run");
    let packed = std::fs::read(at.join("out/model.x3dz")).expect("a scene");
    assert!(5 * packed.len() < 3 * plain.len(), "{} of {}", packed.len(), plain.len());
    let mut text = String::new();
    flate2::read::GzDecoder::new(&*packed).read_to_string(&mut text).expect("gzip");
    // But for the time of the run.
    let rest = |text: &str| text.lines().filter(|line| !line.contains("name='time'")).collect::<Vec<_>>().join("\n");
    assert!(rest(&text) == rest(&plain), "the scenes differ");
    for field in ["'lowerLimit' value='-0.5'", "'upperLimit' value='0.5'", "'colourRange' value='1.5'"] {
        assert!(text.contains(&format!("name={field}")), "{field}");
    }
    assert!(text.len() < 4_000_000, "{}", text.len());
    let error = fails(at, &[&MEASURE[..], &["--scene", "x3db", "-o", "out"]].concat(), 2);
    assert!(error.contains("x3d, x3dz"), "{error}");
}
