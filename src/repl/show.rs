//! Answers of the session as text.

use crate::{check, table};
use gml_compiler::session::{Answer, CurrentModel, Gradient, Line, Session};
use std::fmt::Write as _;

/// The longest value in characters; more is cut off.
const LONGEST: usize = 4000;

/// The answers to what was entered, one per line; a `use` has none.
pub(crate) fn answers(answers: &[Answer], session: &Session) -> String {
    let mut out = String::new();
    for answer in answers {
        let value = || answer.value.as_ref().map_or_else(String::new, |value| cut(&value.to_string()));
        let _ = match &answer.line {
            Line::Value => writeln!(out, "{}", value()),
            Line::Let(names) if names.contains(',') => writeln!(out, "({names}) = {}", value()),
            Line::Let(names) => writeln!(out, "{names} = {}", value()),
            Line::Function(signature) => writeln!(out, "{signature}"),
            Line::Derivative(function) => writeln!(out, "deriv {function}"),
            Line::Use(_) => Ok(()),
            Line::Model(name) => match session.model().filter(|m| m.name() == name) {
                Some(model) => writeln!(out, "{}", headline(model)),
                None => writeln!(out, "model {name}"),
            },
        };
    }
    out
}

fn cut(text: &str) -> String {
    if text.chars().count() <= LONGEST {
        return text.to_owned();
    }
    let shown: String = text.chars().take(LONGEST).collect();
    format!("{shown} ... (take an element or a component to see more)")
}

/// `model cup: 15 parameters, 4 parts`.
pub(crate) fn headline(model: &CurrentModel) -> String {
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let mut counts = vec![count(model.parameters().len(), "parameter")];
    if !model.inputs().is_empty() {
        counts.push(count(model.inputs().len(), "input"));
    }
    counts.push(count(model.parts().count(), "part"));
    let measures = model.measures().count();
    counts.extend((measures > 0).then(|| count(measures, "measure")));
    format!("model {}: {}", model.name(), counts.join(", "))
}

/// `:params`.
pub(crate) fn parameters(model: &CurrentModel) -> String {
    let mut out = format!(
        "model {}\n{}{}\nparts: {}\n",
        model.name(),
        check::parameter_table("value", model.parameters(), model.values(), &model.bounds()),
        check::input_table(model.inputs()),
        model.parts().collect::<Vec<_>>().join(", ")
    );
    let measures: Vec<&str> = model.measures().collect();
    if !measures.is_empty() {
        let _ = writeln!(out, "measures: {}", measures.join(", "));
    }
    out
}

/// `:grad`.
pub(crate) fn gradient(gradient: &Gradient) -> String {
    let mut out = format!("{}\n", cut(&gradient.value.to_string()));
    let several = gradient.components.len() > 1;
    let mut headings = vec!["by".to_owned()];
    headings.extend(gradient.components.iter().map(|c| if several { c.clone() } else { "derivative".to_owned() }));
    let rows: Vec<Vec<String>> = gradient
        .slopes
        .iter()
        .map(|slope| {
            let mut row = vec![slope.parameter.clone()];
            row.extend(slope.shown());
            row
        })
        .collect();
    let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
    out.push_str(&table::render(&headings, &rows));
    out
}
