//! Answers as text.

use crate::check::{shown, summary, unit};
use crate::table;
use gml_compiler::program::Quantity;
use gml_compiler::session::{Answer, CurrentModel, Gradient, Session};
use std::fmt::Write as _;

/// Values are cut after so many characters.
const LONGEST: usize = 4000;

/// What was entered, line by line. A `use` has nothing to say.
pub(crate) fn answers(answers: &[Answer], session: &Session) -> String {
    let mut out = String::new();
    for answer in answers {
        let _ = match answer {
            Answer::Value(value) => writeln!(out, "{}", cut(&value.to_string())),
            Answer::Let { names, value } if names.contains(',') => {
                writeln!(out, "({names}) = {}", cut(&value.to_string()))
            }
            Answer::Let { names, value } => writeln!(out, "{names} = {}", cut(&value.to_string())),
            Answer::Function { signature, .. } => writeln!(out, "{signature}"),
            Answer::Derivative { function, .. } => writeln!(out, "deriv {function}"),
            Answer::Use { .. } => Ok(()),
            Answer::Model { name, .. } => match session.model().filter(|m| m.name() == name) {
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
pub(crate) fn headline(model: CurrentModel<'_>) -> String {
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let mut counts = vec![count(model.parameters().len(), "parameter")];
    if !model.inputs().is_empty() {
        counts.push(count(model.inputs().len(), "input"));
    }
    counts.push(count(model.parts().len(), "part"));
    format!("model {}: {}", model.name(), counts.join(", "))
}

/// `:params`.
pub(crate) fn parameters(model: CurrentModel<'_>) -> String {
    let bounds = model.bounds();
    let rows: Vec<Vec<String>> = model
        .parameters()
        .iter()
        .zip(model.values().iter().zip(bounds))
        .map(|(p, (value, (low, high)))| {
            let of = |x: f64| shown(x, p.quantity);
            vec![p.name.clone(), of(*value), of(low), of(high), unit(p).into(), summary(&p.doc)]
        })
        .collect();
    let mut out = format!("model {}\n\n", model.name());
    out.push_str(&table::render(&["parameter", "value", "from", "to", "unit", ""], &rows));
    if !model.inputs().is_empty() {
        let rows: Vec<Vec<String>> = model
            .inputs()
            .iter()
            .map(|i| {
                let value = match i.quantity {
                    Quantity::Bool => (i.value != 0.0).to_string(),
                    quantity => shown(i.value, quantity),
                };
                vec![i.name.clone(), value, summary(&i.doc)]
            })
            .collect();
        out.push('\n');
        out.push_str(&table::render(&["input", "value", ""], &rows));
    }
    let _ = writeln!(out, "\nparts: {}", model.parts().join(", "));
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
