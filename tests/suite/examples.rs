//! The examples. The commands of their READMEs draw the picture, scan the model with other parameters than its
//! defaults, and inspect the scan from the defaults. The fit must find the parameters of the scan.

use crate::support::{commands, copy, gmlc, gmlc_in, is_thorough, json, parameter, root, text};
use gml_compiler::program::{Options, Program, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use gml_runtime::mesh::TriangleMesh;
use gml_runtime::model::{Atlas, Fineness, Material, Model, Standing, Tessellation, Texels};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use tempfile::tempdir;

/// All but the cup, whose README scans another model than it fits: tests/suite/inspect.rs compares those.
const EXAMPLES: [&str; 19] = [
    "amphora",
    "bottle",
    "bowl",
    "bracket",
    "can",
    "column",
    "elbow",
    "flange",
    "fluted_bowl",
    "gear",
    "jar",
    "mug",
    "pan",
    "planter",
    "sign",
    "stair",
    "tee",
    "tree",
    "window",
];

/// Largest error of a fitted parameter, as a fraction of the difference between its truth and its default. By the
/// standard deviations that the fits state, the noise moves every parameter of every example by less; a parameter that
/// the fit leaves at its default, or finds by chance only, is off by more.
const RECOVERED: f64 = 0.1;

/// Least share of every example's texture that lies on the model. Texels are alike whose areas differ from the mean by
/// less than a tenth; largest share of the surface on which they are not, at poles and where parts narrow along a row;
/// and longest side of a texel, in mean widths.
///
/// A chart that is as long as the texture, as of the stair's rail, leaves no larger scale.
///
/// Flanks of a thread run obliquely over its patch: their texels have twice the area of those of the crests. The thread
/// of the bottle has 6 % of its surface.
const USED: f64 = 0.85;
const AS_LONG: f64 = 0.97;
const ALIKE: f64 = 0.1;
const UNLIKE: f64 = 0.05;
const UNLIKE_WITH_THREAD: f64 = 0.08;
const LONGEST: f64 = 4.0;

#[test]
fn textures_are_well_used_and_their_texels_alike() {
    for name in EXAMPLES.iter().chain(&["cup"]) {
        let program = example_program(name);
        let x: Vec<f64> = program.parameters().iter().map(|p| p.default).collect();
        let instance = Model::instantiate(&program, &x).expect("the defaults are a model");
        let atlas = Atlas::new(&program, &*instance, 1024).expect("it fits");
        let texels = Texels::of_model(&program, &*instance, &atlas).expect("a surface");
        let areas = || texels.area.iter().map(|area| f64::from(*area));
        let whole: f64 = areas().sum();
        let mean = whole / texels.len() as f64;
        let unlike = |area: &f64| (area / mean - 1.0).abs() > ALIKE;
        let share = areas().filter(unlike).sum::<f64>() / whole;
        let longest = texels.side.iter().map(|side| f64::from(*side)).fold(0.0, f64::max) / mean.sqrt();
        let [mut least, mut most] = [f64::INFINITY, 0.0_f64];
        areas().for_each(|area| (least, most) = (least.min(area / mean), most.max(area / mean)));
        println!(
            "{name}: {:.3} used; texels of {least:.3} to {most:.3} of the mean area, unlike it on {:.1} %; sides of up to {longest:.2}",
            atlas.used(),
            100.0 * share
        );
        let parts = 0..texels.part_names.len() as u32;
        for part in parts {
            let of_part = || (0..texels.len()).filter(|i| texels.part[*i] == part).map(|i| f64::from(texels.area[i]));
            let share = of_part().filter(unlike).sum::<f64>() / of_part().sum::<f64>();
            if share > UNLIKE {
                println!("    {}: unlike on {:.1} %", texels.part_names[part as usize], 100.0 * share);
            }
        }
        let longest_chart = atlas.charts.iter().map(|chart| chart.width.max(chart.height)).max().unwrap_or(0);
        let is_full = atlas.used() >= USED || f64::from(longest_chart) >= AS_LONG * f64::from(atlas.size);
        assert!(is_full, "{name}: {} used, charts of up to {longest_chart} texels", atlas.used());
        let unlike = if *name == "bottle" { UNLIKE_WITH_THREAD } else { UNLIKE };
        assert!(share <= unlike && longest <= LONGEST, "{name}: unlike on {share}, sides of up to {longest}");
    }
}

/// Every example at its defaults and at other shapes: walls do not pass through each other, and only what is meant to
/// end in a wall, or what a neighbour covers, is buried.
#[test]
fn walls_of_the_examples_do_not_pass_through_each_other() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let others = if is_thorough() { 12 } else { 1 };
    for name in EXAMPLES.iter().chain(&["cup"]) {
        let program = example_program(name);
        let defaults: Vec<f64> = program.parameters().iter().map(|p| p.default).collect();
        let shapes =
            std::iter::once(defaults.clone()).chain((0..others).map(|_| middle_half(&program, &defaults, &mut random)));
        let mut most = 0.0_f64;
        for x in shapes {
            // Shapes that a `require` rules out are no shapes.
            let Ok(instance) = Model::instantiate(&program, &x) else { continue };
            let atlas = Atlas::new(&program, &*instance, 256).expect("it fits");
            let texels = Texels::of_model(&program, &*instance, &atlas).expect("a surface");
            let material = Material::new(&program, &*instance).expect("a surface");
            let (mut whole, mut buried, mut passed) = (0.0, 0.0, 0.0);
            for (standing, area) in
                material.of_texels(&texels).iter().zip(&texels.area).map(|(s, a)| (s, f64::from(*a)))
            {
                whole += area;
                buried += if *standing == Standing::Buried { area } else { 0.0 };
                passed += if *standing == Standing::PassedThrough { area } else { 0.0 };
            }
            most = most.max(buried / whole);
            if *name == "mug" {
                // The inside's corner is on the rounding where this is 0; by less than a thousandth of the diagonal
                // it is not named.
                let parameter =
                    |wanted: &str| x[program.parameters().iter().position(|p| p.name == wanted).expect("it")];
                let beyond = parameter("rounding") * (1.0 - 0.5_f64.sqrt()) - parameter("wall");
                assert!(beyond < 0.5 || passed > 0.0, "the mug's inside has come out by {beyond} mm");
                if beyond > -0.1 {
                    continue;
                }
            }
            assert!(passed < 1e-3 * whole, "{name}: {passed} of {whole} mm2 have passed through a wall at {x:?}");
            if x == defaults {
                println!("{name}: {:.3} % buried", 100.0 * buried / whole);
            }
        }
        println!("{name}: at most {:.3} % buried", 100.0 * most);
        // The boughs of the tree begin within each other; the amphora's handles may be as wide as its neck.
        let expected = if *name == "tree" { 0.3 } else { 0.1 };
        assert!(most < expected, "{name}: {most}");
    }
}

/// A shape with every parameter in the middle half of its bounds, as far as these are constant; others keep their
/// defaults, moved into their bounds.
fn middle_half(program: &Program, defaults: &[f64], random: &mut ChaCha8Rng) -> Vec<f64> {
    let mut x = defaults.to_vec();
    for i in 0..x.len() {
        let (low, high) = Model::bounds(program, &x)[i];
        if low.is_finite() && high.is_finite() {
            x[i] = low + (0.25 + 0.5 * random.random_range(0.0..1.0)) * (high - low);
        }
    }
    x
}

fn example_program(name: &str) -> Program {
    let path = root().join(format!("examples/{name}/{name}.gml"));
    let text = fs::read_to_string(&path).expect("a script");
    let source = SourceFile { name: path.display().to_string(), text };
    compile(source, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
}

/// The inside of a mug comes out through its rounding where that is large: `check` and `scan` say so.
#[test]
fn walls_that_pass_through_each_other_are_said() {
    let folder = tempdir().expect("a folder");
    let mug = root().join("examples/mug/mug.gml").display().to_string();
    let passes = |rounding: &str| {
        let values = ["-p", rounding, "-p", "wall=1.3mm"];
        let check: Value =
            serde_json::from_str(&gmlc(folder.path(), &[&["check", &mug, "--json"], &values[..]].concat()))
                .expect("JSON");
        let warnings = check["diagnostics"].as_array().expect("warnings");
        let scan = [&["scan", &mug, "--spacing", "4mm", "-o", "mug.ply"], &values[..]].concat();
        let said = String::from_utf8(gmlc_in(folder.path(), &scan).stderr).expect("text");
        (
            warnings.iter().any(|d| d["code"] == "passed-through"),
            said.contains("the scan shows what no real object has"),
        )
    };
    assert_eq!(passes("rounding=4mm"), (false, false));
    // By 0.41 mm, of a diagonal of some 190 mm.
    assert_eq!(passes("rounding=5.5mm"), (true, true));
}

/// The largest picture in the repository, in bytes.
const LARGEST_PICTURE: u64 = 150_000;

/// Runs an example's README and compares the fitted parameters with the scanned ones.
fn recovers(name: &str) {
    let folder = tempdir().expect("a folder");
    copy(&root().join("examples"), &folder.path().join("examples"));
    let picture = folder.path().join(format!("examples/{name}/{name}.png"));
    fs::remove_file(&picture).expect("the example has a picture");
    let mut output = String::new();
    for command in commands(&root().join(format!("examples/{name}/README.md"))) {
        let mut args: Vec<&str> = command.split_whitespace().collect();
        if args[0] == "inspect" {
            args.extend(["--device", "cpu"]);
        }
        output.push_str(&gmlc(folder.path(), &args));
    }
    // Other computers may round differently, which changes single pixels.
    let stale = difference(&picture, &root().join(format!("examples/{name}/{name}.png")));
    assert!(stale < 0.5, "the picture differs by {stale}: draw it anew with examples/render.sh");

    let truth = json(&folder.path().join(format!("out/{name}_truth.json")));
    let fit = json(&folder.path().join(format!("out/{name}/fit.json")));
    let defaults = defaults(name);
    let truths = truth["parameters"].as_object().expect("parameters");
    assert_eq!(truths.len(), defaults.len());
    for (parameter_name, start) in defaults {
        let truth = truths[&parameter_name].as_f64().expect("a number");
        let off = parameter(&fit, &parameter_name) - truth;
        let moved = (truth - start).abs();
        assert!(moved > 0.0, "the README leaves {parameter_name} where the fit begins");
        assert!(off.abs() < RECOVERED * moved, "{parameter_name} was {truth} and is off by {off}\n{output}");
    }
    let variance = json(&folder.path().join(format!("out/{name}/variance.json")));
    let (noise, median) = (number(&truth["scanner"]["noise"]), number(&variance["median"]));
    // Half of all normally distributed values are within 0.67 standard deviations; triangles between noisy points are
    // nearer.
    assert!(median < noise, "half of the deviations are above {median} mm, with noise of {noise} mm\n{output}");
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("not a number: {value}"))
}

/// Names and defaults of an example's parameters.
fn defaults(name: &str) -> Vec<(String, f64)> {
    let script = format!("examples/{name}/{name}.gml");
    let out = gmlc(root(), &["check", &script, "--format", "json"]);
    let check: Value = serde_json::from_str(&out).expect("JSON");
    let parameters = check["parameters"].as_array().expect("parameters");
    let text = |v: &Value| v.as_str().expect("text").to_owned();
    parameters.iter().map(|p| (text(&p["name"]), number(&p["default"]))).collect()
}

/// Mean difference of two pictures of one size, in levels of a channel; infinite where the sizes differ.
fn difference(a: &Path, b: &Path) -> f64 {
    let [a, b] = [a, b].map(|path| {
        let file = fs::File::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("a PNG");
        let mut data = vec![0; reader.output_buffer_size().expect("its size")];
        let frame = reader.next_frame(&mut data).expect("pixels");
        (frame.width, frame.height, data)
    });
    if (a.0, a.1) != (b.0, b.1) {
        return f64::INFINITY;
    }
    a.2.iter().zip(&b.2).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / a.2.len() as f64
}

macro_rules! examples {
    ($($name:ident)*) => { $(
        #[test]
        fn $name() {
            recovers(stringify!($name));
        }
    )* };
}

examples! {
    amphora bottle bowl bracket can column elbow flange fluted_bowl gear jar mug pan planter sign stair tee tree window
}

/// Every folder has a script, a README that shows its picture, and a small picture; and the list above is whole.
#[test]
fn every_example_is_complete() {
    let entries = fs::read_dir(root().join("examples")).expect("a folder").map(|e| e.expect("an entry").path());
    let mut names: Vec<String> =
        entries.filter(|p| p.is_dir()).map(|p| p.file_name().expect("a name").to_string_lossy().into_owned()).collect();
    names.sort();
    let mut known: Vec<&str> = EXAMPLES.to_vec();
    known.push("cup");
    known.sort_unstable();
    assert_eq!(names, known);
    let gallery = fs::read_to_string(root().join("README.md")).expect("the README");
    for name in names {
        let folder = root().join("examples").join(&name);
        let readme = fs::read_to_string(folder.join("README.md")).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(readme.contains(&format!("({name}.png)")), "{name}: the README does not show the picture");
        assert!(folder.join(format!("{name}.gml")).is_file(), "{name}");
        let picture = folder.join(format!("{name}.png")).metadata().map_or(0, |m| m.len());
        assert!((1000..LARGEST_PICTURE).contains(&picture), "{name}.png has {picture} bytes");
        assert!(gallery.contains(&format!("examples/{name}/{name}.png")), "{name} is not in the README's gallery");
    }
}

/// The scripts are formatted as `gmlc fmt` does it, and compile without warnings.
#[test]
fn every_example_is_tidy() {
    gmlc(root(), &["fmt", "--check", "examples"]);
    for name in EXAMPLES.into_iter().chain(["cup"]) {
        let output = gmlc_in(root(), &["check", &format!("examples/{name}/{name}.gml")]);
        let warnings = text(&output.stderr);
        assert!(output.status.success() && warnings.is_empty(), "{name}\n{warnings}");
    }
}

/// The normals of every surface point from the inside of the solid to its outside. This shows in the winding number of
/// the model about a point, its solid angle as seen from there over that of the whole sphere (Jacobson, Kavan and
/// Sorkine-Hornung 2013): for a closed surface it is a whole number, falls by one across the surface, and is 0 outside
/// if the normals point outwards. Where one part runs into another (a handle in a wall) it is 1 or more.
#[test]
fn every_example_is_closed_and_faces_outwards() {
    for name in EXAMPLES.into_iter().chain(["cup"]) {
        let mesh = coarse(name);
        for (kind, triangles) in samples(&mesh) {
            let around: Vec<f64> = triangles.iter().map(|t| winding(&mesh, outside(&mesh, *t))).collect();
            let right = around.iter().filter(|w| **w > -0.25 && (**w - w.round()).abs() < 0.25).count();
            // Triangles of neighbouring parts overlap or leave slits, and parts that run into another one have open
            // ends.
            let share = right as f64 / around.len() as f64;
            assert!(share > 0.85, "{name}: {kind} has the winding numbers {around:.2?} outside");
        }
    }
}

/// Some triangles of every kind of part (`tree.left.wood` is `wood`).
fn samples(mesh: &TriangleMesh) -> BTreeMap<&str, Vec<[u32; 3]>> {
    let mut kinds: BTreeMap<&str, Vec<[u32; 3]>> = BTreeMap::new();
    for group in &mesh.groups {
        let last = group.name.rsplit('.').next().unwrap_or_default();
        let kind = kinds.entry(last.split('[').next().unwrap_or_default()).or_default();
        kind.extend(mesh.triangles[group.start..group.end].iter().filter(|t| mesh.triangle_area(**t) > 1e-6));
    }
    // Of a part that lies wholly within others there are none.
    kinds.retain(|_, triangles| !triangles.is_empty());
    for triangles in kinds.values_mut() {
        let step = triangles.len().div_ceil(24);
        *triangles = triangles.iter().copied().step_by(step).collect();
    }
    kinds
}

/// A point a little outside of a triangle's centre.
fn outside(mesh: &TriangleMesh, triangle: [u32; 3]) -> [f64; 3] {
    let corners = triangle.map(|v| mesh.positions[v as usize]);
    let normal = mesh.triangle_normal(triangle).expect("a triangle with an area");
    let step = 1e-3 * mesh.triangle_area(triangle).sqrt();
    [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 3.0 + step * normal[k])
}

/// A model at its defaults as a coarse mesh.
fn coarse(name: &str) -> TriangleMesh {
    let path = root().join(format!("examples/{name}/{name}.gml"));
    let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let script = SourceFile { name: path.display().to_string(), text };
    let program = compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program;
    let x: Vec<f64> = program.parameters().iter().map(|p| p.default).collect();
    let instance = Model::instantiate(&program, &x).expect("it exists");
    let positions = Tessellation::uniform(&program, &*instance, 4, 4).expect("it can be evaluated").mesh.positions;
    let size = positions.iter().flatten().fold(0.0f64, |m, c| m.max(c.abs()));
    let fineness = Fineness { chord: 1e-3 * size, ..Fineness::default() };
    Tessellation::new(&program, &*instance, fineness).expect("it can be evaluated").mesh
}

/// The winding number of a mesh about a point: the signed solid angles of its triangles (van Oosterom and Strackee
/// 1983) over 4 pi; positive inside of a closed surface that faces outwards.
fn winding(mesh: &TriangleMesh, p: [f64; 3]) -> f64 {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let angle = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|v| [0, 1, 2].map(|k| mesh.positions[v as usize][k] - p[k]));
        let [la, lb, lc] = [a, b, c].map(|v| dot(v, v).sqrt());
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        2.0 * dot(a, cross).atan2(la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)
    };
    mesh.triangles.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}
