//! Whether hits of rays that belong elsewhere on the model are refused, and what else is lost: virtual scans of all
//! examples, whose deviations are known. `cargo bench --bench matching -- [SCANS [NAME]...]` needs no data and prints,
//! for shapes as the script has them (`plain`), for scans with outliers (`outliers`) and for shapes with dents and
//! bumps of 2 mm (`dents`), the share of the area that is wrong (the distance is off by more than five standard
//! deviations of the noise), how much of that is refused, how much of the rest, how much of the rest although the ray
//! meets the texel's own surface, and figures before and after. `right` is the standard deviation of the distances that
//! are not wrong: what is left should have the same.

mod figures;
mod shape;

use figures::Figures;
use shape::Shape;
use std::path::Path;

/// The share of outliers that scans have by default.
const OUTLIERS: f64 = 0.001;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let scans = words.iter().find_map(|w| w.parse().ok()).unwrap_or(1);
    let chosen = |names: Vec<String>| -> Vec<String> {
        let named: Vec<String> = names.iter().filter(|name| words.contains(name)).cloned().collect();
        if named.is_empty() { names } else { named }
    };
    let names = chosen(names());
    for kind in chosen(["plain", "outliers", "dents"].map(str::to_owned).to_vec()) {
        let (is_dented, outliers) = (kind == "dents", if kind == "outliers" { OUTLIERS } else { 0.0 });
        println!("{kind}, {scans} scans\n{}", figures::HEADING);
        for name in &names {
            let shape = Shape::of(name, is_dented);
            let mut sum = Figures::default();
            (1..=scans).for_each(|seed| sum.add(&shape, &shape.scanned(seed, outliers)));
            println!("| {name} | {sum}");
        }
    }
}

/// A box, and every script of the examples: `mug`, or `cup/octagonal_cup` where a folder has several.
fn names() -> Vec<String> {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let entries = |folder: &Path| -> Vec<std::path::PathBuf> {
        let entries = std::fs::read_dir(folder).into_iter().flatten();
        entries.map(|entry| entry.unwrap_or_else(|e| panic!("{e}")).path()).collect()
    };
    let stem = |path: &Path| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let scripts = entries(&examples).into_iter().flat_map(|folder| {
        let inside = entries(&folder).into_iter().filter(|file| file.extension().is_some_and(|e| e == "gml"));
        inside.map(|file| (stem(&folder), stem(&file))).collect::<Vec<_>>()
    });
    let mut names: Vec<String> = scripts
        .map(|(folder, file)| if folder == file { file } else { format!("{folder}/{file}") })
        .chain(["box".to_owned()])
        .collect();
    names.sort();
    names
}
