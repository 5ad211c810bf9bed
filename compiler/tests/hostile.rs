//! Scripts that somebody damaged: nothing panics, hangs or is accepted into invalid functions.

use gml_compiler::check::{CheckOptions, check};
use gml_compiler::ir::lower::lower;
use gml_compiler::ir::validate::validate;
use gml_compiler::source::{NoFiles, Sources};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;

/// The cases of the language tests, without their comments.
static CASES: LazyLock<Vec<String>> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/language");
    let mut paths: Vec<_> = std::fs::read_dir(folder)
        .expect("the folder of the language tests")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|e| e == "gml"))
        .collect();
    paths.sort();
    let texts = paths.iter().map(|path| std::fs::read_to_string(path).expect("a readable test"));
    texts.flat_map(|text| text.split("// ---").map(without_comments).collect::<Vec<_>>()).collect()
});

fn without_comments(text: &str) -> String {
    text.lines().skip(1).filter(|line| !line.trim_start().starts_with("//")).map(|line| format!("{line}\n")).collect()
}

/// Splits where a token may begin or end.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut last = None;
    for c in text.chars() {
        let word = c.is_alphanumeric() || c == '_';
        match words.last_mut() {
            Some(w) if word && last == Some(true) => w.push(c),
            _ => words.push(c.to_string()),
        }
        last = Some(word);
    }
    words
}

#[derive(Clone, Debug)]
enum Damage {
    Remove,
    Repeat,
    /// With a word of another place, perhaps of another case.
    Replace(prop::sample::Index, prop::sample::Index),
}

fn damage() -> impl Strategy<Value = (prop::sample::Index, Damage)> {
    let replace = (any::<prop::sample::Index>(), any::<prop::sample::Index>()).prop_map(|(a, b)| Damage::Replace(a, b));
    (any::<prop::sample::Index>(), prop_oneof![Just(Damage::Remove), Just(Damage::Repeat), replace])
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_scripts_are_survived(
        case in any::<prop::sample::Index>(),
        damages in prop::collection::vec(damage(), 0..5),
    ) {
        let case: &String = case.get(&CASES);
        let mut text = words(case);
        for (at, damage) in damages {
            if text.is_empty() {
                break;
            }
            let at = at.index(text.len());
            match damage {
                Damage::Remove => drop(text.remove(at)),
                Damage::Repeat => text.insert(at, text[at].clone()),
                Damage::Replace(other, word) => {
                    let other: &String = other.get(&CASES);
                    let other = words(other);
                    if !other.is_empty() {
                        text[at].clone_from(word.get(&other));
                    }
                }
            }
        }
        survive(&text.concat())?;
    }
}

fn survive(text: &str) -> Result<(), TestCaseError> {
    let options = CheckOptions { instances: 500, nodes: 100_000, ..CheckOptions::default() };
    let mut sources = Sources::default();
    let main = sources.add("test.gml", text);
    let (model, diagnostics) = check(&mut sources, &NoFiles, main, &BTreeMap::new(), &options);
    for d in &diagnostics {
        let file = sources.get(d.span.file).expect("a finding lies in a file");
        prop_assert!(file.text.get(d.span.start as usize..d.span.end as usize).is_some(), "{d:?} lies outside");
    }
    if let Some(model) = model
        && let Ok(lowered) = lower(&model)
    {
        prop_assert!(validate(&lowered.module).is_ok(), "{:?} in {text}", validate(&lowered.module));
    }
    Ok(())
}
