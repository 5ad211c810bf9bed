//! The files of the wrong uses: good ones, and every kind of bad ones.

use crate::support::ball::BALL;
use crate::support::{gmlc, json};
use serde_json::{Value, json as of};
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;
use tempfile::{TempDir, tempdir};

const DRUM: &str = "model drum {
  input knobs: int in 1..9 = 3
  input tall: bool = false
  input gap: length = 2mm
  param radius: length in 20mm..60mm = 40mm
  let h = if tall { 50mm } else { 30mm }
  part body = cylinder(radius, h)
  for i in 0..knobs {
    part knob = sphere(5mm).translate((i * 12mm, 0mm, h + gap))
  }
}
";

/// Anybody that owns nothing.
const NOBODY: u32 = 65_534;

fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}

/// Permissions do not hold for root.
pub(super) fn as_ordinary_user(command: &mut Command) {
    if is_root() {
        command.uid(NOBODY).gid(NOBODY);
    }
}

/// Whether the user of the commands may not write where nobody may.
pub(super) fn is_refused_writing(folder: &Path) -> bool {
    let mut command = Command::new("touch");
    command.arg(folder.join("readonly/new"));
    as_ordinary_user(&mut command);
    command.output().is_ok_and(|output| !output.status.success())
}

pub(super) fn inputs_are_whole(folder: &Path) {
    assert_eq!(fs::read_to_string(folder.join("ball.gml")).expect("read"), BALL);
    assert_eq!(
        fs::read(folder.join("scan.ply")).expect("read"),
        fs::read(folder.join("linked/unmatched.ply")).expect("read")
    );
    assert!(json(&folder.join("fit.json"))["parameters"].is_array());
}

pub(super) fn folder() -> TempDir {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    scripts(at);
    gmlc(at, &["scan", "ball.gml", "--spacing", "3mm", "-o", "scan.ply", "--truth", "truth.json"]);
    gmlc(at, &["fit", "ball.gml", "scan.ply", "-o", "fit.json"]);
    gmlc(at, &["mesh", "ball.gml", "-o", "ball.obj"]);
    gmlc(at, &["variance", "ball.gml", "scan.ply", "--params", "fit.json", "-o", "out", "--resolution", "64"]);
    fs::copy(at.join("out/variance.json"), at.join("variance.json")).expect("copied");
    others(at);
    scans(at);
    fits(at);
    write(at, "readonly/ugly.gml", BALL.replace("  ", ""));
    write(at, "out.ply/notes.txt", "");
    // Inputs under the names of results.
    fs::create_dir(at.join("linked")).expect("a folder");
    std::os::unix::fs::symlink("../scan.ply", at.join("linked/unmatched.ply")).expect("a link");
    fs::hard_link(at.join("cloud.ply"), at.join("linked/filled.ply")).expect("a link");
    fs::hard_link(at.join("cloud.ply"), at.join("hard.ply")).expect("a link");
    let opened = Command::new("chmod").args(["-R", "a+rwX"]).arg(at).status().expect("chmod");
    assert!(opened.success());
    fs::set_permissions(at.join("readonly"), fs::Permissions::from_mode(0o555)).expect("permissions");
    folder
}

fn write(at: &Path, name: &str, content: impl AsRef<[u8]>) {
    let path = at.join(name);
    fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    fs::write(path, content).expect("written");
}

fn scripts(at: &Path) {
    let without_parts = "model m {\n  param r: length in 5mm..50mm = 20mm\n}\n";
    for (name, script) in [
        ("ball", BALL.to_owned()),
        ("cube", BALL.replace("model ball", "model cube")),
        ("drum", DRUM.to_owned()),
        ("nomodel", "let a = 1mm\n".to_owned()),
        ("typo", BALL.replace("sphere(r)", "sphere(rr)")),
        ("units", BALL.replace("sphere(r)", "sphere(r * r)")),
        ("brace", BALL.replace("\n}", "")),
        ("bounds", BALL.replace("5mm..50mm", "50mm..5mm")),
        ("noparts", without_parts.to_owned()),
        ("noparams", "model m {\n  part p = sphere(20mm)\n}\n".to_owned()),
        ("uses", format!("use \"absent.gml\" (a)\n{BALL}")),
        ("outside", format!("use \"../up.gml\" (a)\n{BALL}")),
        ("division", BALL.replace("sphere(r)", "sphere(r / 0)")),
        ("foreign", "module ball() { sphere(20); }\n".to_owned()),
        ("huge", BALL.replace("= 20mm", "= 1e300mm")),
        ("wide-bounds", BALL.replace("50mm = 20mm", "1e300mm = 1e299mm")),
    ] {
        write(at, &format!("{name}.gml"), script);
    }
}

/// Files of other kinds, and what is no file.
fn others(at: &Path) {
    for ending in ["gml", "ply", "obj", "stl", "json"] {
        write(at, &format!("page.{ending}"), "<!DOCTYPE html>\n<html><body>404</body></html>\n");
        write(at, &format!("pointer.{ending}"), "version https://git-lfs.github.com/spec/v1\noid sha256:01\nsize 9\n");
        write(at, &format!("empty.{ending}"), "");
    }
    let utf_16 = |text: &str| -> Vec<u8> {
        [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
    };
    write(at, "wide.gml", utf_16(BALL));
    write(at, "wide.obj", utf_16("v 0 0 0\n"));
    write(at, "binary.gml", b"\x7fELF\0\0\xff\xfe");
    write(at, "latin.gml", [b"// gr\xf6\xdfe\n", BALL.as_bytes()].concat());
    write(at, "notes.txt", "Notes on the ball.\n");
    write(at, "scan.las", b"LASF\0\0");
    write(at, "scan", "x y z\n0 0 0\n");
    write(at, "scripts/ball.gml", BALL);
    let pipes = ["pipe.gml", "pipe.ply", "pipe.json", "scripts/pipe.gml"].map(|name| at.join(name));
    assert!(Command::new("mkfifo").args(pipes).status().expect("mkfifo").success());
}

fn ply(vertices: usize, more: &str, rows: &str) -> String {
    let properties = "property float x\nproperty float y\nproperty float z\n";
    format!("ply\nformat ascii 1.0\nelement vertex {vertices}\n{properties}{more}end_header\n{rows}")
}

fn stl(vertices: &[&str]) -> String {
    let vertices: String = vertices.iter().map(|v| format!("vertex {v}\n")).collect();
    format!("solid a\nfacet normal 0 0 1\nouter loop\n{vertices}endloop\nendfacet\nendsolid a\n")
}

fn scans(at: &Path) {
    let scan = fs::read(at.join("scan.ply")).expect("read");
    write(at, "cut.ply", &scan[..scan.len() / 2]);
    write(at, "cut.stl", [&[0; 80][..], &50_u32.to_le_bytes(), &[0; 500]].concat());
    let face = "element face 1\nproperty list uchar int vertex_indices\n";
    let flat: String = (0..100).map(|i| format!("{} {} 0\n", i % 10, i / 10)).collect();
    let round = |i: u32| {
        let (a, b) = (f64::from(i % 30) / 5.0, f64::from(i / 30) / 9.6);
        format!("{:.3} {:.3} {:.3}\n", 20.0 * a.cos() * b.sin(), 20.0 * a.sin() * b.sin(), 20.0 * b.cos())
    };
    for (name, text) in [
        ("none.ply", ply(0, "", "")),
        ("one.ply", ply(1, "", "1 2 3\n")),
        ("same.ply", ply(40, "", &"1 2 3\n".repeat(40))),
        ("flat.ply", ply(100, "", &flat)),
        ("cloud.ply", ply(900, "", &(0..900).map(round).collect::<String>())),
        ("word.ply", ply(3, "", "0 0 0\n0 zero 0\n1 0 0\n")),
        ("short.ply", ply(3, "", "0 0 0\n0 1\n1 0 0\n")),
        ("index.ply", ply(3, face, "0 0 0\n0 1 0\n1 0 0\n3 0 1 7\n")),
        ("nan.ply", ply(3, "", &"nan nan nan\n".repeat(3))),
        ("header.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n".to_owned()),
        ("format.ply", "ply\nformat ascii 2.0\nend_header\n".to_owned()),
        ("nameless.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float a\nend_header\n1\n".to_owned()),
        ("many.ply", ply(1_000_000_000_000_000_000, "", "0 0 0\n")),
        ("twice.ply", ply(1, "element vertex 1\nproperty float x\n", "0 0 0\n0\n")),
        ("stl.ply", "solid ball\nendsolid ball\n".to_owned()),
        ("word.obj", "v 0 0 0\nv 1 zero 0\nv 0 1 0\nf 1 2 3\n".to_owned()),
        ("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n".to_owned()),
        ("two.obj", "v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n".to_owned()),
        ("huge.obj", "v 0 0 0\nv 1e300 0 0\nv 0 1e-300 0\nf 1 2 3\n".to_owned()),
        ("word.stl", stl(&["0 0 zero", "1 0 0", "0 1 0"])),
        ("short.stl", stl(&["0 0 0", "1 0 0"])),
    ] {
        write(at, name, text);
    }
}

fn fits(at: &Path) {
    let text = fs::read_to_string(at.join("fit.json")).expect("read");
    let end = text.find("\"unit\"").expect("a parameter's unit");
    write(at, "cut.json", &text[..end]);
    write(at, "list.json", "[]");
    write(at, "object.json", "{}");
    write(at, "comma.json", text.replacen(',', "", 1));
    let edited = |name: &str, change: fn(&mut Value)| {
        let mut fit: Value = serde_json::from_str(&text).expect("JSON");
        change(&mut fit);
        write(at, name, serde_json::to_string_pretty(&fit).expect("JSON"));
    };
    edited("text.json", |fit| fit["sigma"] = of!("x"));
    edited("enum.json", |fit| fit["loss"] = of!("cauchy"));
    edited("other.json", |fit| fit["parameters"][0]["name"] = of!("radius"));
    edited("mirrored.json", |fit| fit["pose"]["rotation"].as_array_mut().expect("rows").swap(0, 1));
    edited("unit.json", |fit| fit["parameters"][0]["unit"] = of!("cm"));
    edited("huge.json", |fit| fit["parameters"][0]["value"] = of!(1e200));
    edited("moved.json", |fit| fit["script"] = of!("absent.gml"));
}
