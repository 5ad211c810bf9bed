//! What `gmlc check` says of how the parts of a model meet.

use crate::table;
use gml_compiler::diagnostic::{Code, Diagnostic};
use gml_compiler::program::Program;
use gml_runtime::figures::overlap;
use gml_runtime::model::{Closedness, EvaluationError, Model, OpenBorder, Passages};
use std::collections::{BTreeMap, BTreeSet};

/// How the parts of a model meet.
pub(crate) struct Meeting {
    pub(crate) closedness: Closedness,
    /// What of them has passed through other walls.
    pub(crate) passages: Option<Passages>,
    /// A place at which closed bodies lie in each other. Millimetres.
    pub(crate) overlap: Option<[f64; 3]>,
}

/// How the parts of a model meet at some values of its parameters.
///
/// # Errors
/// The model cannot be evaluated there.
pub(crate) fn of(program: &Program, values: &[f64]) -> Result<Meeting, EvaluationError> {
    let instance = Model::instantiate(program, values)?;
    program.tolerances(values)?;
    let tessellation = Closedness::tessellation(program, &*instance)?;
    let closedness = Closedness::with_tessellation(program, &*instance, &tessellation)?;
    let passages = Passages::with_tessellation(program, &*instance, &tessellation)?;
    let overlap = match closedness.is_closed() {
        true => overlap(program, &*instance, &tessellation.mesh)?.and_then(|overlap| overlap.of_bodies),
        false => None,
    };
    Ok(Meeting { closedness, passages, overlap })
}

/// A warning of walls that pass through each other, said at the part that has most of it.
pub(crate) fn passage_warning(program: &Program, passages: &Passages) -> Diagnostic {
    let most = passages.parts.iter().max_by(|(_, a), (_, b)| a.total_cmp(b));
    let part = most.and_then(|(name, _)| program.parts().iter().position(|part| part.name == *name)).unwrap_or(0);
    Diagnostic::new(Code::PassedThrough, program.part_span(part), passages.sentence())
        .label("this has come out of the body that it belongs to, or that out of this")
        .hint("change the values, or say with 'require' what must hold: no real object is so")
}

/// Warnings of parts that are inside out, of parts that touch, and of solids of which nothing is left.
pub(crate) fn warnings(program: &Program, closedness: &Closedness) -> Vec<Diagnostic> {
    let mut warnings: Vec<Diagnostic> =
        closedness.inside_out.iter().map(|part| inside_out_warning(program, *part)).collect();
    warnings.extend(touching_warnings(program, &closedness.open));
    // That nothing is left of the whole model is said in the line.
    if !closedness.is_empty {
        warnings.extend(nothing_left_warnings(program, &closedness.gone));
    }
    warnings
}

fn inside_out_warning(program: &Program, part: usize) -> Diagnostic {
    let name = &program.parts()[part].name;
    let message = format!("the part '{name}' is inside out");
    Diagnostic::new(Code::InsideOut, program.part_span(part), message)
        .label("its normals point into what it encloses")
        .hint("turn it with `flip`")
}

/// That two parts touch, said where the first of them is declared.
fn touching_warnings(program: &Program, open: &[OpenBorder]) -> Vec<Diagnostic> {
    let touching = open.iter().filter(|open| open.touches).filter_map(|open| {
        let other = open.beside?;
        Some(([open.patch.min(other), open.patch.max(other)], open.at?))
    });
    let pairs: BTreeMap<[usize; 2], [f64; 3]> = touching.collect();
    let warning = |(patches, at): ([usize; 2], [f64; 3])| {
        let [first, second] = patches.map(|patch| &program.parts()[patch].name);
        let message = format!("'{first}' and '{second}' touch near {} without crossing", table::place(at));
        Diagnostic::new(Code::Touching, program.part_span(patches[0]), message)
            .label("what is left of them there depends on rounding, so that they are not closed")
            .hint("let one reach into the other, or end before it")
    };
    pairs.into_iter().map(warning).collect()
}

/// That nothing is left of solids: of the shortest names under which all parts are trimmed away.
fn nothing_left_warnings(program: &Program, gone: &[usize]) -> Vec<Diagnostic> {
    let parts = program.parts();
    let names = |patch: usize| {
        let name = parts[patch].name.as_str();
        let ends = name.match_indices(['.', '[']).map(|(end, _)| end);
        let whole = (!name.contains(['.', '['])).then_some(name);
        ends.map(move |end| &name[..end]).chain(whole)
    };
    let left: BTreeSet<&str> = (0..parts.len()).filter(|patch| !gone.contains(patch)).flat_map(names).collect();
    let mut said: BTreeSet<&str> = BTreeSet::new();
    let mut warnings = Vec::new();
    for patch in gone {
        let shortest = names(*patch).find(|name| !left.contains(name));
        let Some(name) = shortest.filter(|name| said.insert(name)) else { continue };
        let message = format!("nothing is left of '{name}'");
        let warning = Diagnostic::new(Code::NothingLeft, program.part_span(*patch), message)
            .label("it misses what it is cut from, or lies within what it is joined to")
            .hint("move it, or leave it out; '-p NAME=VALUE' looks at other values of the parameters");
        warnings.push(warning);
    }
    warnings
}

/// Words for where an open border is, with a blank before; none where that is not known.
pub(crate) fn near(open: &OpenBorder) -> String {
    open.at.map_or_else(String::new, |at| format!(" near {}", table::place(at)))
}

/// Whether the parts enclose something, in a line.
pub(crate) fn line(program: &Program, closedness: &Closedness, overlap: Option<[f64; 3]>) -> String {
    const MOST: usize = 8;
    if program.parts().is_empty() {
        return "the model has no parts\n".to_owned();
    }
    if closedness.is_empty {
        return "nothing is left of the model: `-` takes all of it away, or `&` has nothing in common\n".to_owned();
    }
    if let Some(flat) = closedness.flat.first().filter(|_| closedness.open.is_empty()) {
        let name = &program.parts()[*flat].name;
        return format!(
            "flat: the borders of all parts meet, but those of '{name}' and its neighbours enclose nothing\n"
        );
    }
    if closedness.is_closed() {
        let but = overlap.map_or_else(String::new, |at| {
            format!(
                "; but near {} bodies lie in each other, and have no volume together ('+' makes solids one)",
                table::place(at)
            )
        });
        return format!("closed: the borders of all parts meet{but}\n");
    }
    let place = |open: &OpenBorder| {
        format!("{} where {}{} ({:.3} mm)", program.parts()[open.patch].name, open.side, near(open), open.length)
    };
    let mut places: Vec<String> = closedness.open.iter().take(MOST).map(place).collect();
    if closedness.open.len() > MOST {
        places.push(format!("{} more", closedness.open.len() - MOST));
    }
    format!("open: {}\n", places.join(", "))
}
