//! Tables read back by another reader, and what a page may hold.

use super::*;
use crate::population::{Inspected, Measured, Outcome, PartRow, SCHEMA};
use ::parquet::file::reader::{FileReader, SerializedFileReader};
use ::parquet::record::Field;

/// Rows of scans with two parameters, a measure with a tolerance, and two parts; the last one has no result.
fn rows() -> Vec<Row> {
    let measured = |name: &str, unit: &str, value: f64, sd: f64| Measured {
        name: name.to_owned(),
        unit: unit.to_owned(),
        value: Some(value),
        sd: Some(sd),
        ..Measured::default()
    };
    let inspected = |i: u32| {
        let step = f64::from(i % 7) - 3.0;
        let part = |name: &str| PartRow {
            name: name.to_owned(),
            area: 100.0,
            coverage: 0.9,
            mean: Some(0.01 * step),
            rms: Some(0.1),
            p95: None,
            max: Some(f64::NAN),
            within: Some(1.0),
            verdict: Some("conforms".to_owned()),
        };
        let width = Measured {
            nominal: Some(30.0),
            tolerance: Some([-0.5, 0.5]),
            verdict: Some("conforms".to_owned()),
            ..measured("width", "mm", 30.0 + 0.02 * step, 0.005)
        };
        Inspected {
            points: 20_000,
            noise: 0.05,
            inliers: 0.99,
            converged: true,
            verdict: Some("conforms".to_owned()),
            parameters: vec![measured("r", "mm", 42.0 + 0.1 * step, 0.01), measured("tilt", "rad", 0.01 * step, 1e-4)],
            measures: vec![width],
            covariance: (vec!["r".into(), "tilt".into()], vec![vec![1e-4, 0.0], vec![0.0, 1e-8]]),
            surface: part(""),
            parts: vec![part("hole[0]"), part("wall")],
            warnings: vec!["a, \"quoted\"".to_owned(), "<b>two</b>".to_owned()],
            ..Inspected::default()
        }
    };
    let row = |i: u32, outcome| Row {
        schema: SCHEMA,
        scan: format!("scans/cup {i}.ply"),
        name: format!("cup {i}"),
        scan_sha256: "ab".to_owned(),
        key: "cd".to_owned(),
        tool: "gmlc".to_owned(),
        time: "2026-01-01T00:00:00Z".to_owned(),
        seconds: 0.5,
        outcome,
    };
    let mut rows: Vec<Row> = (0..25).map(|i| row(i, Outcome::Inspected(Box::new(inspected(i))))).collect();
    rows.push(row(25, Outcome::Failed { reason: "<script>alert(1)</script> & more".to_owned() }));
    rows
}

#[test]
fn parquet_and_csv_have_the_same_cells() {
    let rows = rows();
    let columns = columns::columns(&rows);
    let file = parquet::parquet(&columns, rows.len()).expect("a table");
    let reader = SerializedFileReader::new(bytes(file)).expect("it is Parquet");
    let notes = reader.metadata().file_metadata().key_value_metadata().expect("notes").clone();
    let note = |key: &str| notes.iter().find(|n| n.key == key).and_then(|n| n.value.clone()).unwrap_or_default();
    assert_eq!(note("gmlc.schema"), SCHEMA.to_string());
    let units: serde_json::Value = serde_json::from_str(&note("gmlc.units")).unwrap();
    assert_eq!((units["param.tilt"].as_str(), units["part.hole[0].rms"].as_str()), (Some("rad"), Some("mm")));
    let text = comma_separated(&columns, rows.len());
    let mut lines = text.split("\r\n");
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    for (record, line) in reader.get_row_iter(None).unwrap().zip(lines) {
        let record = record.unwrap();
        let cells: Vec<String> = record.get_column_iter().map(|(_, field)| shown(field)).collect();
        let names: Vec<&str> = record.get_column_iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, head);
        // A quoted cell has a comma of its own.
        let quoted = line.replace("\"a, \"\"quoted\"\" | <b>two</b>\"", "a; \"quoted\" | <b>two</b>");
        let expected: Vec<String> = quoted.split(',').map(|cell| cell.replace("a; ", "a, ")).collect();
        assert_eq!(cells, expected);
    }
    let find = |name: &str| head.iter().position(|h| *h == name).unwrap_or_else(|| panic!("no column {name}"));
    for name in ["param.r.sd", "measure.width.lower", "part.wall.verdict", "reliable", "scan_sha256", "warnings"] {
        find(name);
    }
}

/// The bytes as the reader takes them.
fn bytes(file: Vec<u8>) -> std::fs::File {
    let mut there = tempfile::tempfile().unwrap();
    std::io::Write::write_all(&mut there, &file).unwrap();
    there
}

fn shown(field: &Field) -> String {
    match field {
        Field::Null => String::new(),
        Field::Str(text) => text.clone(),
        Field::Double(x) => x.to_string(),
        Field::Long(n) => n.to_string(),
        Field::Bool(flag) => flag.to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_empty_table_is_a_table() {
    let columns = columns::columns(&[]);
    let reader = SerializedFileReader::new(bytes(parquet::parquet(&columns, 0).unwrap())).unwrap();
    assert_eq!(reader.metadata().file_metadata().num_rows(), 0);
}

#[test]
fn the_page_escapes_names_links_reports_and_says_what_failed() {
    let rows = rows();
    let summary = Summary::of("cup <&>", &rows, &[], None);
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join(SCANS).join("cup 3");
    std::fs::create_dir_all(&report).unwrap();
    std::fs::write(report.join("report.html"), "").unwrap();
    let documents = PopulationDocuments { rows: &rows, summary: &summary, map: None, origin: "Made." };
    documents.write(folder.path()).unwrap();
    let page = std::fs::read_to_string(folder.path().join(PAGE)).unwrap();
    assert!(page.contains("cup &lt;&amp;&gt;: 26 scans") && !page.contains("<script"), "escaped");
    assert!(page.contains("&lt;script&gt;alert(1)&lt;/script&gt; &amp; more"));
    assert!(page.contains("href=\"scans/cup%203/report.html\""));
    assert!(page.contains("1 of 26 scans have no result"));
    for name in [TABLE, PARQUET, FIGURES] {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
    let width = summary.series.iter().find(|s| s.name == "width").unwrap();
    let capability = width.capability.as_ref().expect("a tolerance");
    assert!(capability.ppk.value > 1.0 && page.contains("<h2>Capability</h2>"));
    let r = summary.series.iter().find(|s| s.name == "r").unwrap().effects.unwrap();
    assert!((r.mean - 42.0).abs() < 0.1 && (r.between - 0.2).abs() < 0.03, "{r:?}");
}

#[test]
fn maps_are_drawn_where_enough_was_measured() {
    let text = "use std.surface (plane)\nmodel plate { param w: length = 40mm\npart top = plane(w, 20mm) }";
    let script = gml_compiler::SourceFile { name: "plate.gml".into(), text: text.into() };
    let options = gml_compiler::Options::default();
    let compiled = gml_compiler::compile(script, &gml_compiler::NoFiles, &options);
    let program = compiled.unwrap_or_else(|e| panic!("{e}")).program;
    let texture = CommonTexture::of(&program, &[40.0], crate::variance::Resolution::Side(64)).expect("it exists");
    let mut map = DeviationMap::default();
    assert!(MapDocuments::of(&map, &texture).is_none());
    for step in [0.19_f32, 0.2, 0.21] {
        let mut distances = vec![f32::NAN; 64 * 64];
        texture.texels.index.iter().for_each(|i| distances[*i as usize] = step);
        map.add(&distances).unwrap();
    }
    let maps = MapDocuments::of(&map, &texture).expect("it was measured");
    let (name, [mean, rms, sd]) = &maps.parts[0];
    assert_eq!(name, "top");
    assert!((mean - 0.2).abs() < 1e-6 && (rms - 0.2).abs() < 1e-6 && (sd - 0.01).abs() < 1e-6);
    // 0.2 over 0.01 / sqrt(3) is a t of two degrees of freedom.
    assert_eq!(maps.clear, 1.0);
    let folder = tempfile::tempdir().unwrap();
    maps.write(folder.path()).unwrap();
    for name in [maps::MEAN[0], maps::MEAN[1], maps::SD[0], maps::SD[1], maps::VIEWS] {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
}
