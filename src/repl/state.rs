//! The state of the dialogue, and the evaluation of a line.

use super::watch::Watch;
use super::{commands, show};
use crate::cli::{CompileArgs, ReplArgs};
use crate::diagnostics;
use crate::error::CommandError;
use crate::files::{self, FileLoader};
use crate::interrupt;
use crate::provenance::Provenance;
use crate::saved::SavedFit;
use crate::script;
use gml_compiler::session::{Limits, Options, Session};
use gml_compiler::source::SourceFile;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the dialogue continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Flow {
    Go,
    Quit,
}

/// A dialogue.
pub(crate) struct Repl {
    /// Shared with the editor, which completes names.
    pub(crate) session: Rc<RefCell<Session>>,
    /// Set by Ctrl-C.
    pub(crate) interrupt: Arc<AtomicBool>,
    /// Reads what is used: the scripts in the current folder, in those of loaded scripts, and below.
    pub(crate) loader: FileLoader,
    /// The fit of the command line.
    pub(crate) params: Option<PathBuf>,
    watch: Watch,
    interactive: bool,
    failed: bool,
}

impl Repl {
    /// Starts a dialogue with the model of the command line.
    pub(crate) fn new(args: &ReplArgs, interactive: bool) -> Result<Repl, CommandError> {
        let interrupt = interrupt::flag();
        // A user at a terminal ends what takes too long; nobody does so for scripts.
        let limits = Limits { steps: if interactive { u64::MAX } else { 1_000_000_000 }, ..Limits::default() };
        let fit = args.params.as_deref().map(SavedFit::read).transpose()?;
        let given = CompileArgs { inputs: args.inputs.clone(), ..CompileArgs::default() };
        let inputs = fit.as_ref().map_or(Ok(given.clone()), |fit| fit.with_inputs(&given, &[]))?.inputs;
        let inputs: BTreeMap<_, _> = inputs.into_iter().collect();
        let options = Options { limits, inputs: inputs.clone(), interrupt: interrupt.clone(), ..Options::default() };
        let session = Rc::new(RefCell::new(Session::new(options)));
        let mut loader = FileLoader::default();
        loader.allow(Path::new("."));
        loader.allow_all(&args.allowed)?;
        let params = args.params.clone();
        let mut repl = Repl { session, interrupt, loader, params, watch: Watch::default(), interactive, failed: false };
        if let Some(path) = &args.model {
            repl.load(path)?;
        }
        let known: Vec<String> = match repl.session.borrow().model() {
            Some(model) => model.inputs().iter().map(|i| i.name.clone()).collect(),
            None => Vec::new(),
        };
        if let Some((name, _)) = args.inputs.iter().find(|(name, _)| !known.contains(name)) {
            return Err(CommandError::usage(format!("--input {name}: the model has no input of that name")));
        }
        if let Some(fit) = fit {
            repl.take_values(&fit, &given, &known)?;
        }
        for (name, value) in &args.values {
            repl.session.borrow_mut().set(name, value, &repl.loader)?;
        }
        Ok(repl)
    }

    /// Gives the model, whose inputs are `known`, the values of a fit.
    fn take_values(&mut self, fit: &SavedFit, given: &CompileArgs, known: &[String]) -> Result<(), CommandError> {
        let mut session = self.session.borrow_mut();
        let name = session.model().map(|m| m.name().to_owned()).ok_or_else(commands::no_model)?;
        fit.require_inputs(&name, known)?;
        let program = session.compile(&script::compile_options())?.program;
        let provenance = Provenance::of(Path::new(&session.model_file().unwrap_or_default()), &program);
        fit.require_model(&program, &provenance, given)?;
        fit.without_pose();
        session.set_all(&fit.values_of(&program))?;
        Ok(())
    }

    /// Evaluates a line, or several that belong together. The dialogue continues after any error.
    pub(crate) fn take(&mut self, text: &str) -> Flow {
        self.interrupt.store(false, Ordering::Relaxed);
        if text.trim().is_empty() {
            return Flow::Go;
        }
        let result = match text.trim().strip_prefix(':') {
            Some(line) => commands::run(self, line),
            None => self.enter(text).map(|()| Flow::Go),
        };
        self.interrupt.store(false, Ordering::Relaxed);
        result.unwrap_or_else(|error| {
            self.failed = true;
            error.print();
            Flow::Go
        })
    }

    /// The result of the dialogue: an error if a line failed and nobody was there to see it.
    pub(crate) fn end(&self) -> Result<(), CommandError> {
        if self.failed && !self.interactive { Err(CommandError::Reported) } else { Ok(()) }
    }

    fn enter(&mut self, text: &str) -> Result<(), CommandError> {
        self.refresh()?;
        let answers = self.session.borrow_mut().enter(text, &self.loader)?;
        self.warn();
        self.watch.files(&self.session.borrow().files());
        print!("{}", show::answers(&answers, &self.session.borrow()));
        Ok(())
    }

    /// Loads a script.
    pub(crate) fn load(&mut self, path: &Path) -> Result<(), CommandError> {
        let file = SourceFile { name: path.display().to_string(), text: files::read_script(path)? };
        self.loader.allow(files::folder_of(path));
        let answers = self.session.borrow_mut().load(file, &self.loader)?;
        self.warn();
        self.watch.files(&self.session.borrow().files());
        print!("{}", show::answers(&answers, &self.session.borrow()));
        Ok(())
    }

    /// Reads all files again.
    pub(crate) fn reload(&mut self) -> Result<(), CommandError> {
        // Errors of a file are reported once for each change of it.
        self.watch.update();
        self.session.borrow_mut().reload(&self.loader)?;
        self.warn();
        self.watch.files(&self.session.borrow().files());
        Ok(())
    }

    /// Reads all files again if one has changed, with a notice.
    pub(crate) fn refresh(&mut self) -> Result<(), CommandError> {
        if let Some(name) = self.watch.changed() {
            println!("{name} has changed and is read again");
            self.reload()?;
        }
        Ok(())
    }

    fn warn(&self) {
        let session = self.session.borrow();
        diagnostics::print(session.warnings(), session.sources());
    }
}
