//! Models: inputs, groups of parts, models within models, files.

use super::support::{check_text, check_with, diagnosed, model, part, point, rendered};
use crate::check::{CheckOptions, InputValue, print};
use crate::program::check;
use crate::source::{Loader, SourceFile, Sources};
use std::collections::{BTreeMap, HashMap};

const FLANGE: &str = "model flange {
  input bolts: int in 3..16 = 6
  param r_out: length in 40mm..150mm = 80mm
  param r_in: length in 10mm..r_out = 30mm               // a bound may name an earlier parameter
  param r_circle: length in r_in..r_out = 60mm
  param d_bolt: length in 4mm..20mm = 9mm
  param thick: length in 4mm..30mm = 12mm
  require r_circle + d_bolt / 2 < r_out, \"the bolt holes break the rim\"
  part rim = cylinder(r_out, thick)
  for i in 0..bolts {
    part hole = cylinder(d_bolt / 2, thick).translate(polar(r_circle, i * 1turn / bolts))
  }
}";

fn names(model: &crate::check::typed::Model) -> Vec<(&str, &str)> {
    model.parts.iter().map(|p| (p.name.as_str(), p.group.as_str())).collect()
}

#[test]
fn the_flange_of_the_language_page() {
    assert_eq!(diagnosed(FLANGE), "");
    let model = model(FLANGE);
    assert_eq!(model.parts.len(), 7);
    assert_eq!(names(&model)[6], ("hole[5]", "hole"));
    let second = &model.params[1].declared;
    assert_eq!((second.lower, second.upper), (10.0, 80.0));
    assert_eq!(model.inputs[0].value, 6.0);
    let p = super::support::defaults(&model);
    let q = point(&model, part(&model, "hole[3]"), &p, 0.0, 0.5);
    assert!((q[0] + 60.0 - 4.5).abs() < 1e-9 && q[1].abs() < 1e-9 && (q[2] - 6.0).abs() < 1e-9, "{q:?}");
}

#[test]
fn inputs_are_given_from_outside() {
    let given = |name: &str, value| BTreeMap::from([(name.to_owned(), value)]);
    let run = |inputs: &BTreeMap<String, InputValue>| {
        let (model, sources, diagnostics) = check_with(FLANGE, inputs, &CheckOptions::default());
        (model.map(|m| m.parts.len()), rendered(&sources, &diagnostics))
    };
    assert_eq!(run(&given("bolts", InputValue::Int(4))).0, Some(5));
    for (inputs, message) in [
        (given("bolts", InputValue::Int(2)), "outside of its bounds 3 to 16"),
        (given("bolts", InputValue::Real(4.5)), "must be a whole number"),
        (given("bolts", InputValue::Int((1 << 53) + 1)), "a whole number has at most 53 bits"),
        (given("bolt", InputValue::Int(4)), "did you mean 'bolts'?"),
        (given("thick", InputValue::Real(4.0)), "'thick' is a param"),
    ] {
        let (parts, text) = run(&inputs);
        assert_eq!(parts, None);
        assert!(text.contains(message), "{text}");
    }
}

#[test]
fn parts_of_parts_have_names() {
    let model = model(
        "model column {
           param radius: length in 1mm..100mm = 10mm
           param height: length = 50mm
           input flutes: int = 2
           part shaft = cylinder(radius, height)
           for i in 0..flutes { part flute = sphere(1mm).translate((radius, 0mm, i * 1mm)) }
         }
         model table {
           param r: length = 20mm
           part leg = column(radius: r).translate((5mm, 0mm, 0mm))
           part balls = for i in 0..2 { sphere((i + 1) * r) }
           part pair = {left: sphere(r), right: [sphere(r), cylinder(r, r)]}
           part copy = balls[1].translate((1mm, 2mm, 3mm))
         }",
    );
    assert_eq!(model.name, "table");
    assert_eq!(model.params.len(), 1);
    let wanted = [
        ("leg.shaft", "leg.shaft"),
        ("leg.flute[0]", "leg.flute"),
        ("leg.flute[1]", "leg.flute"),
        ("balls[0]", "balls"),
        ("balls[1]", "balls"),
        ("pair.left", "pair.left"),
        ("pair.right[0]", "pair.right"),
        ("pair.right[1]", "pair.right"),
        ("copy", "copy"),
    ];
    assert_eq!(names(&model), wanted);
    let q = point(&model, part(&model, "leg.shaft"), &HashMap::from([("r".to_owned(), 20.0)]), 0.0, 1.0);
    assert!((q[0] - 25.0).abs() < 1e-12 && (q[2] - 50.0).abs() < 1e-12);
}

#[test]
fn the_options_say_which_model_is_meant() {
    let script = "model a { part p = sphere(1mm) }\nmodel b { part q = sphere(1mm) }";
    let named = |name: &str| CheckOptions { model: Some(name.to_owned()), ..CheckOptions::default() };
    let (model, ..) = check_with(script, &BTreeMap::new(), &named("a"));
    assert_eq!(model.expect("a model").name, "a");
    let (model, sources, diagnostics) = check_with(script, &BTreeMap::new(), &named("c"));
    assert!(model.is_none() && rendered(&sources, &diagnostics).contains("no model 'c'"));
}

#[test]
fn a_library_has_no_model_and_no_errors() {
    let (model, _, diagnostics) = check_text("fn double(x: real) = 2 * x\nlet k = double(3)");
    assert!(model.is_none() && diagnostics.is_empty());
    assert!(diagnosed("fn double(x: real) = 2 * x + 1mm").contains("cannot be added"));
}

struct Folder(HashMap<&'static str, &'static str>);

impl Loader for Folder {
    fn load(&self, path: &str, _from: &str) -> Result<SourceFile, String> {
        match self.0.get(path) {
            Some(text) => Ok(SourceFile { name: path.to_owned(), text: (*text).to_owned() }),
            None => Err(format!("there is no file '{path}'")),
        }
    }
}

fn with_files(main: &str, files: &[(&'static str, &'static str)]) -> String {
    let mut sources = Sources::default();
    let id = sources.add("main.gml", main);
    let folder = Folder(files.iter().copied().collect());
    let (_, diagnostics) = check(&mut sources, &folder, id, &BTreeMap::new(), &CheckOptions::default());
    rendered(&sources, &diagnostics)
}

#[test]
fn files_use_files() {
    let main = "use \"lib/knob.gml\" (knob)\nuse \"lib/knob.gml\"\nmodel m { part p = knob(knob.size) }";
    let knob = ("lib/knob.gml", "let size = 3mm\nfn knob(r) = sphere(r)");
    assert_eq!(with_files(main, &[knob]), "");
    insta::assert_snapshot!(with_files(main, &[]), @"
    error[file-not-found] main.gml:1:5: there is no file 'lib/knob.gml'
      > \"lib/knob.gml\"
    error[file-not-found] main.gml:2:5: there is no file 'lib/knob.gml'
      > \"lib/knob.gml\"
    ");
    let a = ("a.gml", "use \"b.gml\" (g)\nfn f(x) = g(x)");
    let b = ("b.gml", "use \"a.gml\" (f)\nfn g(x) = f(x)");
    let text = with_files("use \"a.gml\" (f)\nmodel m { part p = sphere(1mm) }", &[a, b]);
    assert!(text.contains("in a circle: a.gml -> b.gml -> a.gml"), "{text}");
}

#[test]
fn the_typed_tree_can_be_printed() {
    let model = model("model m {\n  param r: length in 1mm..9mm = 2mm\n  part p = |u, v| (r * u, r * v, 0mm)\n}");
    insta::assert_snapshot!(print(&model), @"
    fn |u, v|@0[r#5: length](u#6: real, v#7: real) -> (length, length, length) = ((r#5 * u#6), (r#5 * v#7), 0.0)

    model m {
      param r#0: length in 1.0..9.0 = 2
      let p#1: |u, v| = |u, v|[r#0]
      part p = p#1 as |p#2: |u, v|, u#3: real, v#4: real| |u, v|@0[p#2](u#3, v#4)
    }
    ");
}

#[test]
fn measures_of_a_loop_name_the_parts_of_their_turn() {
    let part = "part floor = disc(3mm).translate((0mm, 0mm, 1mm * i))";
    let measure = "measure d of floor = 3mm";
    let within = |items: &str| format!("model m {{\n  for i in 0..3 {{\n{items}\n}}\n}}");
    let inner = |items: &str| format!("for k in 0..1 {{\n{items}\n}}");
    for items in [
        format!("{part}\n{measure}"),
        format!("{measure}\n{part}"),
        format!("{}\n{part}", inner(measure)),
        format!("{measure}\n{}", inner(part)),
        format!("{part}\n{}", inner(measure)),
    ] {
        let text = within(&items);
        assert_eq!(diagnosed(&text), "", "{text}");
        let measured: Vec<Vec<String>> = model(&text).measures.iter().map(|m| m.parts.clone()).collect();
        assert_eq!(measured, [["floor[0]"], ["floor[1]"], ["floor[2]"]], "{text}");
    }
}
