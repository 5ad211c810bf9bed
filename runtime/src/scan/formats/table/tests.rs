//! Tests of tables.

use super::super::collected::{Collected, collect, mutate};
use super::*;
use crate::scan::cloud::Entry;

fn table(text: &str) -> Collected {
    collect(read, text.as_bytes(), None).unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn positions(text: &str) -> Vec<[f64; 3]> {
    table(text).points.iter().map(|point| point.position).collect()
}

fn error(text: &str) -> String {
    match collect(read, text.as_bytes(), None) {
        Ok(found) => panic!("{text}: {found:?}"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn separators_and_marks() {
    let expected = [[1.5, -2.5, 3.0], [1e3, 0.25, 7.0]];
    let tables = [
        "1.5 -2.5 3\n1e3 .25 7\n",
        "1.5,-2.5,3\n1000,0.25,7.",
        "1.5, -2.5, 3\n1000, 0.25, 7\n",
        "1.5;-2.5;3\n1000;0.25;7\n",
        "1,5;-2,5;3\n1000;0,25;7\n",
        "1,5 -2,5 3\n1000 0,25 7\n",
        "1,5, -2,5, 3,0\n1000,0, 0,25, 7,0\n",
        "1.5\t-2.5\t3\n1000\t0.25\t7\n",
        "1,5\t-2,5\t3\n1000\t0,25\t7\n",
        "  1.5   -2.5\t3  \r\n\r\n 1000 0.25 7\r\n",
        "1.5 -2.5 3\r1000 0.25 7\r",
        "\"1.5\",\"-2.5\",\"3\"\n\"1000\",\"0.25\",\"7\"\n",
        "\"1,5\",\"-2,5\",\"3\"\n\"1000\",\"0,25\",\"7\"\n",
        "1.5,-2.5,3,\n1000,0.25,7,\n",
        "\u{feff}1.5 -2.5 3\n1000 0.25 7\n",
        "# a remark\n1.5 -2.5 3\n// another\n! and\n; so\n1000 0.25 7\n",
        "2\n1.5 -2.5 3\n1000 0.25 7\n",
        "P1 1.5 -2.5 3\nP2 1000 0.25 7\n",
    ];
    for text in tables {
        assert_eq!(positions(text), expected, "{text}");
        assert!(recognise(text.as_bytes()), "{text}");
    }
    let utf16: Vec<u8> = "1,5;-2,5;3\r\n1000;0,25;7".encode_utf16().flat_map(u16::to_be_bytes).collect();
    let found = collect(read, &[b"\xfe\xff".as_slice(), &utf16].concat(), None).unwrap();
    assert_eq!(found.points[0].position, expected[0]);
    assert_eq!((found.points.len(), found.progress), (2, 1.0));
}

#[test]
fn names_say_what_columns_are() {
    let text = "id,Z [mm],Y [mm],X [mm],nx,ny,nz,r,g,b,Intensity\n\
        1,3,2,1,0,0,1,255,0,17,0.5\n2,6,5,4,0,1,0,0,0,0,\nlast,9,8,7,nan,0,1,,,,2\n\
        4,3,2,1,0,0,1,255,0,17,0.5\n5,3,2,1,0,0,1,255,0,17,0.5\n6,3,2,1,0,0,1,255,0,17,0.5\n\
        7,,2,1,0,0,1,255,0,17,0.5\n8,NaN,2,1,0,0,1,255,0,17,0.5\n";
    let found = table(text);
    assert_eq!((found.points.len(), found.empty, found.unit), (6, 2, Some(1.0)));
    assert_eq!(found.warnings, ["line 8: the point has only some of its coordinates and is left out (1 more like it)"]);
    assert_eq!(found.entries, Vec::<(Entry, usize)>::new());
    let first = found.points[0];
    assert_eq!((first.position, first.normal), ([1.0, 2.0, 3.0], Some([0.0, 0.0, 1.0])));
    assert_eq!((first.colour, first.intensity), (Some([255, 0, 17]), Some(0.5)));
    assert_eq!((found.points[1].intensity, found.points[2].normal, found.points[2].colour), (None, None, None));
    let fractions = table("//X Y Z Rf Gf Bf\n1 2 3 1 0.5 0\n4 5 6 0 0 1\n");
    assert_eq!(fractions.points[0].colour, Some([255, 128, 0]));
    let wide = table("x y z red green blue\n1 2 3 65535 257 0\n");
    assert_eq!(wide.points[0].colour, Some([255, 1, 0]));
    assert!(wide.warnings[0].contains("colours were taken for numbers from 0 to 65535"), "{:?}", wide.warnings);
    // Colours that are none do not keep a scan from being read.
    let odd = table("x y z red green blue\n1 2 3 -1 257 0\n");
    assert!(odd.points[0].colour.is_none() && odd.warnings[0].contains("colours are left out"));
}

#[test]
fn columns_without_names() {
    let colours = table("1 2 3 255 0 0\n4 5 6 0 17 255\n");
    assert_eq!(colours.points[1].colour, Some([0, 17, 255]));
    assert!(colours.warnings[0].contains("columns 4 to 6 are colours from 0 to 255"), "{:?}", colours.warnings);
    let fractions = table("1 2 3 0.5 0 1\n");
    assert_eq!(fractions.points[0].colour, Some([128, 0, 255]));
    let normals = table("1 2 3 0.6 0 0.8\n4 5 6 0 1 0\n");
    assert_eq!(normals.points[1].normal, Some([0.0, 1.0, 0.0]));
    assert!(normals.warnings[0].contains("normals"), "{:?}", normals.warnings);
    let neither = table("1 2 3 400 5 6\n");
    assert!((neither.points[0].normal, neither.points[0].colour) == (None, None) && neither.warnings.len() == 1);
    let four = table("1 1 1 25\n2 2 2 30\n3 3 3 35\n4 4 4 40\n5 5 5 45\n");
    assert_eq!((four.points[4].position, four.points[4].intensity), ([5.0; 3], Some(45.0)));
    let pts = table("1 2 3 -500 1 2 3\n4 5 6 70 4 5 6\n");
    assert_eq!((pts.points[0].intensity, pts.points[0].colour), (Some(-500.0), Some([1, 2, 3])));
    let behind = table("1 2 3 1 2 3 0.5\n4 5 6 70 4 5 0.25\n");
    assert_eq!((behind.points[0].intensity, behind.points[0].colour), (Some(0.5), Some([1, 2, 3])));
    let all = table("1 2 3 1 2 3 0 0 1 0.5\n4 5 6 70 4 5 0 1 0 0.25\n");
    assert_eq!((all.points[0].intensity, all.points[0].normal), (Some(0.5), Some([0.0, 0.0, 1.0])));
    let numbered = table("1 0.5 1 2\n2 0.5 3 4\n3 0.5 5 6\n4 0.5 7 8\n");
    assert_eq!(numbered.points[3].position, [0.5, 7.0, 8.0]);
    assert!(
        numbered.warnings[0].contains("column 1 counts the points, columns 2, 3 and 4 are coordinates"),
        "{:?}",
        numbered.warnings
    );
}

#[test]
fn rows_that_do_not_fit_are_named() {
    let cases = [
        ("1 2 3\n4 5\n6 7 8\n", "line 2: expected 3 columns as in line 1, found 2 in `4 5`"),
        ("1 2 3\n4 5 6 7 8 9\n6 7 8\n", "line 2: expected 3 columns as in line 1, found 6"),
        (
            "1,2,3\n1,2,3\n4,x,6\n1,2,3\n1,2,3\n1,2,3\n1,2,3\n1,2,3\n1,2,3\n1,2,3\n",
            "line 3: expected a number in column 2, found `4,x,6`",
        ),
        ("1,5;2;3\n1,5;2;3\n1,5;2.5;3\n", "line 3: expected a number with a decimal comma in column 2"),
        ("1 2 3 4\n1 x 3 4\n", "line 2: expected a number in column 2, found `1 x 3 4`"),
        ("1 y 3 4\n1 x 3 4\n1 2 3 4\n", "line 1: column 2 has numbers in some lines and text in others"),
        ("1 2 3 4\n1 2 3\n1 2 3\n", "line 1: expected 3 columns as in line 2 and others, found 4"),
        ("x y z\n1 2 3 # first\n4 5 6\n", "line 2: expected 3 columns as in line 3 and others, found 5"),
        ("X,Y,X\n0, 0, 0\n", "line 1: two columns are called `x`: expected x, y and z, found `X,Y,X`"),
        ("time,speed,level\n0, 0, 0\n", "line 1: expected columns called x, y and z, found `time,speed,level`"),
        ("x,y,z\n1,5,2,5,3,5\n", "line 1: the line names 3 columns, line 2 has 6: are commas decimal marks?"),
        ("x y z\n1 2 3 4\n", "line 1: the line names 3 columns, line 2 has 4"),
        ("3,\n1,2,3\n4,5,6\n", "line 1: the line announces 3 points, 2 follow"),
        ("3;;\n1;2;3\n4;5;6\n", "line 1: the line announces 3 points, 2 follow"),
        ("3 4\n1 2 3\n4 5 6\n", "line 1: `3 4` is no point"),
        ("7,,8\n1,2,3\n4,5,6\n", "line 1: expected three numbers as in line 2, found `7,,8`"),
        ("1,5,2,5,3,5\n4,25,5,5,6,125\n", "line 1: 6 whole numbers, or 3 with decimal commas?"),
        ("3\nx y z\n1 2 3\n4 5 6\n", "line 1: the line announces 3 points, 2 follow"),
        ("a,b\n1,2\n3,4\n", "line 2: expected points, at least three numbers in a line, found `1,2`"),
        (
            "x,y,z\n\"1,001.5\",\"2.5\",\"3.5\"\n\"1,002.5\",\"2.5\",\"3.5\"\n",
            "line 2: expected points, at least three numbers in a line, found `\"1,001.5\",\"2.5\",\"3.5\"` (write \
             thousands without separators)",
        ),
        ("x y z\n", "line 1: expected points"),
    ];
    for (text, expected) in cases {
        if expected.contains("is no point") {
            assert!(table(text).warnings[0].contains(expected));
            continue;
        }
        let error = error(text);
        assert!(error.contains(expected), "{text}: {error}");
    }
    let late = format!("x y z r g b\n{}1 2 3 4 5 300\n", "1 2 3 4 5 6\n".repeat(30_000));
    assert!(error(&late).contains("line 30002: expected a colour of numbers from 0 to 255"));
    assert!(matches!(collect(read, b"1 2 3\n", Some(1)), Err(ScanFault::NoSuchScan { count: 1 })));
}

#[test]
fn a_first_line_without_a_point_is_no_empty_point() {
    for text in ["2,,\n1,2,3\n4,5,6\n", "2;;;\n1;2;3;9\n4;5;6;9\n", "2 \n1 2 3\n4 5 6\n"] {
        let found = table(text);
        assert_eq!((found.points.len(), found.empty), (2, 0), "{text}");
    }
    let partial = table("1,2,,7,8\n1,2,3,7,8\n,,,7,8\n");
    assert_eq!((partial.points.len(), partial.empty), (1, 2));
    assert_eq!(partial.warnings.last().unwrap(), "line 1: the point has only some of its coordinates and is left out");
}

/// Lines of four whole numbers; the first of each by `first`.
fn rows(count: usize, first: impl Fn(usize) -> String) -> String {
    (0..count).map(|i| format!("{} {} {} {}\n", first(i), 70 - i % 7, 100 + i % 5, i % 11)).collect()
}

#[test]
fn a_first_column_that_counts_or_rises_is_said() {
    for from in [0, 1] {
        let counted = table(&rows(60, |i| (i + from).to_string()));
        assert_eq!(counted.points[1].position, [69.0, 101.0, 1.0]);
        let warning = &counted.warnings[0];
        assert!(warning.contains("column 1 counts the points, columns 2, 3 and 4 are coordinates"), "{warning}");
    }
    // A row of a raster, with an intensity.
    let raster: String = (0..60).map(|i| format!("{i} 5 {} {}\n", i % 7, i % 11)).collect();
    assert_eq!(table(&raster).points[59].position, [59.0, 5.0, 3.0]);
    let rising = table(&rows(60, |i| format!("{:.3}", 1.7e9 + i as f64 * 0.025)));
    assert_eq!(rising.points[1].position[0], 1.7e9 + 0.025);
    let warning = &rising.warnings[0];
    assert!(warning.contains("column 1 is x, although it rises from line to line like a time"), "{warning}");
    assert!(warning.contains("such as `t x y z`") && warning.contains("column 4 is the intensity"), "{warning}");
    let named = table(&format!("t x y z\n{}", rows(60, |i| i.to_string())));
    assert!(named.points[1].position == [69.0, 101.0, 1.0] && named.warnings.is_empty(), "{:?}", named.warnings);
    let falls = table(&rows(60, |i| format!("{}.5", i % 59)));
    assert!(!falls.warnings[0].contains("rises"), "{:?}", falls.warnings);
}

#[test]
fn commas_are_decimal_marks_only_where_nothing_else_is_meant() {
    // A sign, a point, a name or another number of columns says that the numbers are whole.
    for text in ["1,-5,2,5,3,5\n", "1,5,2,5,3,5.5\n", "x,y,z,red,green,blue\n1,5,2,5,3,5\n", "1,5,2,5,3,5,4\n"] {
        assert_eq!(table(text).points[0].position[0], 1.0, "{text}");
    }
}

#[test]
fn other_texts_are_no_tables() {
    let licence = "Permission is hereby granted, free of charge, to any person\nobtaining a copy\n\n1 2 3 go\n";
    let texts = [
        licence,
        "# A project\n\nIt has\n\n- 1 thing\n- 2 things\n",
        "model Cup { radius: length = 40mm; }\nlet a = [1, 2, 3]\n",
        "1 2\n3 4\n",
        "2020-01-01,5,6\n2020-01-02,7,8\n",
        "",
        "\n\n",
        "a b c\nd e f\n1 2 3\ng h i\n",
        "1.5 2, 3\n4.5 5, 6\n",
    ];
    for text in texts {
        assert!(!recognise(text.as_bytes()), "{text}");
    }
    assert!(recognise(b"X,Y,X\n0, 0, 0\n"));
}

#[test]
fn faulty_files_do_no_harm() {
    let seeds: [&[u8]; 5] = [
        b"x,y,z,nx,ny,nz,r,g,b,i\n1,2,3,0,0,1,255,0,7,0.5\n4,5,6,0,1,0,1,2,3,0.25\n",
        b"# x y z\n1.5 2.5 3\n4 5 6\n7 8 9\n",
        b"1,5;2,5;3,5\n4,5;5,5;6,5\n",
        b"\xff\xfe1\0 \x002\0 \x003\0\n\x004\0 \x005\0 \x006\0",
        b"2\n\"X [mm]\"\t\"Y [mm]\"\t\"Z [mm]\"\n1\t2\t3\n4\t5\t6\n",
    ];
    mutate(read, &seeds, 5_000);
}

#[test]
fn units_in_front_of_the_points() {
    let unit = |text: &str| table(text).unit;
    assert_eq!(unit("Exported today\nUnits: inches\nX Y Z\n1 2 3\n4 5 6\n"), Some(25.4));
    assert_eq!(unit("# GOM\n# unit = m\n# X Y Z\n1 2 3\n4 5 6\n"), Some(1000.0));
    assert_eq!(unit("# gmlc, unit: cm\nx y z\n1 2 3\n4 5 6\n"), Some(10.0));
    let both = table("# Units: mm\nx [m],y [m],z [m]\n1,2,3\n4,5,6\n");
    assert_eq!(both.unit, Some(1000.0));
    let said = "line 1 states mm, and the columns are named with m in line 2: m is taken; --unit says otherwise";
    assert_eq!(both.warnings, [said]);
    assert!(table("# Units: m\nx [m],y [m],z [m]\n1,2,3\n").warnings.is_empty());
    for text in ["X [mil];Y [mil];Z [mil]\n1;2;3\n4;5;6\n", "Units: mil\nx y z\n1 2 3\n4 5 6\n"] {
        let found = table(text);
        assert!(
            found.unit.is_none() && found.warnings[0].contains("the unit `mil` is not known"),
            "{:?}",
            found.warnings
        );
    }
}

#[test]
fn marks_that_may_group_thousands_are_said() {
    let rows = |last: &str| (0..12).map(|i| format!("{i}.182;4{i}.046;{last}\n")).collect::<String>();
    let says = |text: &str| table(text).warnings.iter().any(|w| w.contains("group thousands"));
    let with_zero = rows("643").replace("0.182", "1.182");
    assert!(says(&with_zero));
    assert!(!says(&rows("643")) && !says(&rows("643.25")) && !says(&rows("643.250")));
}
