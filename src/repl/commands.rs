//! Commands: lines that begin with a colon.

use super::state::{Flow, Repl};
use super::{show, work};
use crate::error::CommandError;
use crate::script::compile_options;
use crate::values;
use gml_compiler::program::EmitStage;
use std::path::Path;

/// The argument of a command, for completion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Argument {
    Nothing,
    Expression,
    Parameter,
    /// A file with one of these extensions; any file if there are none.
    File(&'static [&'static str]),
    Name,
    Command,
}

/// A command.
pub(crate) struct Command {
    pub(crate) name: &'static str,
    /// The arguments as help shows them.
    pub(crate) arguments: &'static str,
    pub(crate) argument: Argument,
    /// A line of help.
    pub(crate) about: &'static str,
    /// More help, with examples; may be empty.
    pub(crate) more: &'static str,
    run: fn(&mut Repl, &str) -> Result<Flow, CommandError>,
}

/// Extensions of scripts.
pub(crate) const SCRIPTS: &[&str] = &["gml"];

/// Extensions of scans.
const SCANS: &[&str] = &["ply", "obj", "stl"];

/// All commands, in the order of help.
pub(crate) const COMMANDS: &[Command] = &[
    Command {
        name: "load",
        arguments: "FILE",
        argument: Argument::File(SCRIPTS),
        about: "Load a script; its last model is the current one",
        more: "Its definitions, and the model's parameters, values and parts are then in scope.",
        run: |repl, rest| repl.load(Path::new(&unquoted(argument(rest, ":load cup.gml")?))).map(|()| Flow::Go),
    },
    Command {
        name: "reload",
        arguments: "",
        argument: Argument::Nothing,
        about: "Read all files again; this is automatic when one has changed",
        more: "Everything that was entered is evaluated again. Parameters keep the values that were set.",
        run: |repl, _| reload(repl),
    },
    Command {
        name: "params",
        arguments: "",
        argument: Argument::Nothing,
        about: "Show the model's parameters with values and bounds, its inputs and parts",
        more: "",
        run: |repl, _| printed(repl, |repl| Ok(show::parameters(repl.session.borrow().model().ok_or_else(no_model)?))),
    },
    Command {
        name: "set",
        arguments: "NAME=VALUE",
        argument: Argument::Parameter,
        about: "Set a parameter or an input of the model",
        more: "The value is an expression:\n  :set r=42mm\n  :set h = 2 * r\nBounds and requirements must hold.",
        run: set,
    },
    Command {
        name: "type",
        arguments: "EXPR",
        argument: Argument::Expression,
        about: "Show the type of an expression",
        more: "  :type r * h\n  area (an area)",
        run: |repl, rest| {
            printed(repl, |repl| {
                let text = argument(rest, ":type r * h")?;
                let (words, written) = repl.session.borrow_mut().type_of(text, &repl.loader)?;
                Ok(format!("{written} ({words})\n"))
            })
        },
    },
    Command {
        name: "grad",
        arguments: "EXPR",
        argument: Argument::Expression,
        about: "Show an expression's derivatives with respect to every parameter, with units",
        more: "  :grad outer(0.5) * h\nThe derivatives are exact: the compiler differentiates the program. Angles count in radians.",
        run: |repl, rest| {
            printed(repl, |repl| {
                let text = argument(rest, ":grad r * h")?;
                Ok(show::gradient(&repl.session.borrow_mut().gradient(text, &repl.loader)?))
            })
        },
    },
    Command {
        name: "diff",
        arguments: "[PARAMETER | EXPR]",
        argument: Argument::Expression,
        about: "Print the derivative program of the model, for one parameter, or of an expression",
        more: "  :diff             every part, for every parameter\n  :diff r           every part, for r\n  :diff outer(0.5)  an expression",
        run: diff,
    },
    Command {
        name: "ir",
        arguments: "[EXPR]",
        argument: Argument::Expression,
        about: "Print the scalar functions of an expression, or of the model",
        more: "A part is a function: :ir outside(0.5, 0.5) shows the computation of one of its points.",
        run: |repl, rest| emit(repl, rest, EmitStage::Ir),
    },
    Command {
        name: "clif",
        arguments: "[EXPR]",
        argument: Argument::Expression,
        about: "Print Cranelift's intermediate representation of an expression, or of the model",
        more: "",
        run: |repl, rest| emit(repl, rest, EmitStage::Clif),
    },
    Command {
        name: "asm",
        arguments: "[EXPR]",
        argument: Argument::Expression,
        about: "Print the machine code of an expression, or of the model",
        more: "",
        run: |repl, rest| emit(repl, rest, EmitStage::Asm),
    },
    Command {
        name: "time",
        arguments: "EXPR",
        argument: Argument::Expression,
        about: "Measure how long an expression takes to compile to machine code and to run",
        more: "Both are repeated; the shortest times are shown.",
        run: |repl, rest| {
            let text = argument(rest, ":time r * h")?;
            repl.refresh()?;
            work::time(repl, text).map(|()| Flow::Go)
        },
    },
    Command {
        name: "mesh",
        arguments: "FILE",
        argument: Argument::File(&[]),
        about: "Write the model's surface as a mesh (.obj, .ply or .stl), or as a picture (.png)",
        more: "Options of `gmlc mesh` may follow the name: :mesh cup.ply --chord 0.005mm",
        run: |repl, rest| performed(repl, rest, work::mesh),
    },
    Command {
        name: "fit",
        arguments: "SCAN",
        argument: Argument::File(SCANS),
        about: "Fit the model to a scan and set the parameters to the fitted values",
        more: "The fit starts from the values that were set, or where an earlier one ended. Ctrl-C ends it.\n  :fit scan.ply\n  :fit scan.ply --params fit.json --coverage",
        run: |repl, rest| performed(repl, rest, work::fit),
    },
    Command {
        name: "inspect",
        arguments: "SCAN DIR",
        argument: Argument::File(SCANS),
        about: "Fit, measure and document: everything into one folder",
        more: "Like `gmlc inspect`, with the current model. Ctrl-C ends it.",
        run: |repl, rest| performed(repl, rest, work::inspect),
    },
    Command {
        name: "doc",
        arguments: "NAME",
        argument: Argument::Name,
        about: "Show the declaration of a name, and its doc comment",
        more: "  :doc revolve\n  :doc std.math.mix",
        run: |repl, rest| printed(repl, |repl| doc(repl, argument(rest, ":doc revolve")?)),
    },
    Command {
        name: "help",
        arguments: "[COMMAND]",
        argument: Argument::Command,
        about: "Show this list, or the help of a command",
        more: "",
        run: |_, rest| help(rest).map(|()| Flow::Go),
    },
    Command {
        name: "quit",
        arguments: "",
        argument: Argument::Nothing,
        about: "Leave (or press Ctrl-D)",
        more: "",
        run: |_, _| Ok(Flow::Quit),
    },
];

/// Runs a command, given without its colon. Its name may be abbreviated to an unambiguous prefix.
pub(crate) fn run(repl: &mut Repl, line: &str) -> Result<Flow, CommandError> {
    let (name, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    (find(name)?.run)(repl, rest.trim())
}

fn find(name: &str) -> Result<&'static Command, CommandError> {
    if name == "?" {
        return find("help");
    }
    let fitting: Vec<&Command> =
        COMMANDS.iter().filter(|c| c.name == name || (!name.is_empty() && c.name.starts_with(name))).collect();
    match &fitting[..] {
        [] => Err(CommandError::usage(format!("there is no command :{name}; :help lists them"))),
        [one] => Ok(one),
        several => match several.iter().find(|c| c.name == name) {
            Some(exact) => Ok(exact),
            None => {
                let names: Vec<String> = several.iter().map(|c| format!(":{}", c.name)).collect();
                Err(CommandError::usage(format!(":{name} may be {}", names.join(" or "))))
            }
        },
    }
}

pub(super) fn no_model() -> CommandError {
    CommandError::Failed("there is no model: load one (:load cup.gml) or enter one".into())
}

fn argument<'r>(rest: &'r str, example: &str) -> Result<&'r str, CommandError> {
    if rest.is_empty() {
        Err(CommandError::usage(format!("an argument is missing, as in {example}")))
    } else {
        Ok(rest)
    }
}

/// A file's name without quotes.
fn unquoted(text: &str) -> String {
    text.strip_prefix('"').and_then(|t| t.strip_suffix('"')).unwrap_or(text).to_owned()
}

/// Prints the text of a command, after reading changed files again.
fn printed(repl: &mut Repl, f: impl FnOnce(&mut Repl) -> Result<String, CommandError>) -> Result<Flow, CommandError> {
    repl.refresh()?;
    let text = f(repl)?;
    print!("{text}");
    Ok(Flow::Go)
}

fn performed(
    repl: &mut Repl,
    rest: &str,
    f: fn(&mut Repl, &str) -> Result<(), CommandError>,
) -> Result<Flow, CommandError> {
    repl.refresh()?;
    f(repl, rest).map(|()| Flow::Go)
}

fn reload(repl: &mut Repl) -> Result<Flow, CommandError> {
    if repl.session.borrow().files().is_empty() {
        return Err(CommandError::Failed("no file has been loaded: load one (:load cup.gml)".into()));
    }
    repl.reload()?;
    if let Some(model) = repl.session.borrow().model() {
        println!("{}", show::headline(model));
    }
    Ok(Flow::Go)
}

fn set(repl: &mut Repl, rest: &str) -> Result<Flow, CommandError> {
    repl.refresh()?;
    let (name, value) = values::assignment(rest).map_err(|why| CommandError::Usage(format!(":set {rest}: {why}")))?;
    repl.session.borrow_mut().set(&name, &value, &repl.loader)?;
    Ok(Flow::Go)
}

fn diff(repl: &mut Repl, rest: &str) -> Result<Flow, CommandError> {
    printed(repl, |repl| {
        let mut session = repl.session.borrow_mut();
        let parameter = session.model().is_some_and(|m| m.parameters().iter().any(|p| p.name == rest));
        if !rest.is_empty() && !parameter {
            return Ok(session.derivative_text(rest, &repl.loader)?);
        }
        let compiled = session.compile(&compile_options())?;
        Ok(compiled.program.derivative_text(Some(rest).filter(|r| !r.is_empty())))
    })
}

fn emit(repl: &mut Repl, rest: &str, stage: EmitStage) -> Result<Flow, CommandError> {
    printed(repl, |repl| {
        let mut session = repl.session.borrow_mut();
        if rest.is_empty() {
            return Ok(session.compile(&compile_options())?.program.emit(stage));
        }
        Ok(session.emit(rest, stage, &repl.loader)?)
    })
}

fn doc(repl: &Repl, name: &str) -> Result<String, CommandError> {
    let known = repl.session.borrow().known(name);
    let known = known.ok_or_else(|| CommandError::Failed(format!("there is no '{name}' here")))?;
    let mut out = known.declaration;
    if !known.module.is_empty() {
        out.push_str(&format!("   ({})", known.module));
    }
    out.push('\n');
    if !known.doc.is_empty() {
        out.push_str(&format!("\n{}\n", known.doc.trim_end()));
    }
    Ok(out)
}

fn help(rest: &str) -> Result<(), CommandError> {
    if !rest.is_empty() {
        let command = find(rest.trim_start_matches(':'))?;
        println!(":{}\n\n{}.", format!("{} {}", command.name, command.arguments).trim_end(), command.about);
        if !command.more.is_empty() {
            println!("\n{}", command.more);
        }
        if let Some(options) = work::options_of(command.name) {
            println!("\n{options}");
        }
        return Ok(());
    }
    println!("Expressions, definitions and models are evaluated as they are entered. Commands:\n");
    let width = COMMANDS.iter().map(|c| c.name.len() + c.arguments.len()).max().unwrap_or(0) + 1;
    for command in COMMANDS {
        println!("  :{:<width$}  {}", format!("{} {}", command.name, command.arguments).trim_end(), command.about);
    }
    Ok(())
}
