//! Work that takes long: without the lock of the interpreter, with progress, and ended by Ctrl-C.

use crate::deviations::Deviations;
use crate::errors::raised;
use crate::model::Program;
use crate::processes::on_own_threads;
use crate::scan::Scan;
use gml_runtime::fit::FitResult;
use gml_runtime::progress::Progress;
use gmlc::embedded::{self, EmbeddedError, OptionName};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// How often the calling thread looks for signals: a tenth of what people notice as a delay.
const BETWEEN: Duration = Duration::from_millis(50);

/// As much as the main thread of most systems has.
const STACK: usize = 8 << 20;

/// What the working thread tells the calling one.
enum Message<T> {
    Progress(String, f64, String),
    Done(std::thread::Result<T>),
}

/// Progress that is told to the thread that called.
struct Told<T> {
    to: std::sync::Mutex<Sender<Message<T>>>,
    is_wanted: bool,
    cancelled: AtomicBool,
}

impl<T: Send> Progress for Told<T> {
    fn report(&self, stage: &str, done: f64, detail: &str) {
        if self.is_wanted
            && let Ok(to) = self.to.lock()
        {
            // Nobody listens any more where the work was cancelled.
            _ = to.send(Message::Progress(stage.to_owned(), done, detail.to_owned()));
        }
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// Does work on a thread of its own while this one, without the interpreter's lock, passes progress on and looks for
/// signals. What the callback or a signal raises ends the work, and is raised when that has ended.
pub(crate) fn with_progress<T: Send>(
    py: Python<'_>,
    callback: Option<Py<PyAny>>,
    work: impl FnOnce(&dyn Progress) -> Result<T, EmbeddedError> + Send,
) -> PyResult<T> {
    let (to, from) = channel();
    let told = Told {
        to: std::sync::Mutex::new(to.clone()),
        is_wanted: callback.is_some(),
        cancelled: AtomicBool::new(false),
    };
    let (done, raised_here) = py.detach(move || {
        let mut raised_here: Option<PyErr> = None;
        let done = std::thread::scope(|scope| {
            let work = || {
                let done = catch_unwind(AssertUnwindSafe(|| on_own_threads(|| work(&told))));
                _ = to.send(Message::Done(done));
            };
            if let Err(error) =
                std::thread::Builder::new().name("gmlc".to_owned()).stack_size(STACK).spawn_scoped(scope, work)
            {
                return Err(error.to_string());
            }
            loop {
                let result = match from.recv_timeout(BETWEEN) {
                    Ok(Message::Done(done)) => return Ok(done),
                    Ok(Message::Progress(stage, share, detail)) if raised_here.is_none() => Python::attach(|py| {
                        callback.as_ref().map_or(Ok(()), |call| call.call1(py, (stage, share, detail)).map(drop))
                    }),
                    Ok(Message::Progress(..)) => Ok(()),
                    Err(RecvTimeoutError::Timeout) if raised_here.is_none() => Python::attach(|py| py.check_signals()),
                    Err(RecvTimeoutError::Timeout) => Ok(()),
                    Err(RecvTimeoutError::Disconnected) => return Err("the work ended without a result".to_owned()),
                };
                if let Err(error) = result {
                    told.cancelled.store(true, Ordering::Relaxed);
                    raised_here.get_or_insert(error);
                }
            }
        });
        (done, raised_here)
    });
    if let Some(error) = raised_here {
        return Err(error);
    }
    match done {
        Ok(Ok(result)) => result.map_err(raised),
        Ok(Err(_)) => Err(PyRuntimeError::new_err("an error in gmlc itself; please report it, with the message above")),
        Err(text) => Err(PyRuntimeError::new_err(text)),
    }
}

/// A fit as JSON.
fn text(fit: &FitResult) -> PyResult<String> {
    serde_json::to_string(fit).map_err(|error| PyValueError::new_err(error.to_string()))
}

/// A fit from JSON.
pub(crate) fn parsed(json: &str) -> PyResult<FitResult> {
    serde_json::from_str(json).map_err(|error| PyValueError::new_err(format!("this is no fit of gmlc: {error}")))
}

/// The scans without the interpreter's lock.
fn taken(scans: Vec<PyRef<'_, Scan>>) -> Vec<gml_runtime::scan::Scan> {
    scans.iter().map(|scan| scan.scan.clone()).collect()
}

/// Fits a program to scans of one object; returns fit.json.
#[pyfunction]
#[pyo3(signature = (program, scans, words, earlier=None, progress=None))]
pub(crate) fn fit(
    py: Python<'_>,
    program: &Program,
    scans: Vec<PyRef<'_, Scan>>,
    words: Vec<String>,
    earlier: Option<&str>,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let (scans, earlier) = (taken(scans), earlier.map(parsed).transpose()?);
    let model = program.model.clone();
    let fit =
        with_progress(py, progress, move |progress| embedded::fit(&model, &scans, &words, earlier.as_ref(), progress))?;
    text(&fit)
}

/// Why the fit of fit.json cannot be relied on.
#[pyfunction]
pub(crate) fn shortcoming(json: &str) -> PyResult<Option<String>> {
    Ok(parsed(json)?.shortcoming())
}

/// Measures the deviations of a scan from a fitted program.
#[pyfunction]
#[pyo3(signature = (program, fit, scan, words, progress=None))]
pub(crate) fn measure(
    py: Python<'_>,
    program: &Program,
    fit: &str,
    scan: PyRef<'_, Scan>,
    words: Vec<String>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Deviations> {
    let (fit, scan, model) = (parsed(fit)?, scan.scan.clone(), program.model.clone());
    let measured =
        with_progress(py, progress, move |progress| embedded::measure(&model, &fit, &scan, &words, progress))?;
    Deviations::new(py, measured)
}

/// Fits, measures and documents into a folder; returns fit.json and variance.json.
#[pyfunction]
#[pyo3(signature = (program, scans, fit_words, measure_words, report_words, output, progress=None))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn inspect(
    py: Python<'_>,
    program: &Program,
    scans: Vec<PyRef<'_, Scan>>,
    fit_words: Vec<String>,
    measure_words: Vec<String>,
    report_words: Vec<String>,
    output: PathBuf,
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, String)> {
    let (scans, model) = (taken(scans), program.model.clone());
    let words = [fit_words, measure_words, report_words];
    let inspection = with_progress(py, progress, move |progress| {
        embedded::inspect(&model, &scans, words.each_ref().map(Vec::as_slice), &output, progress)
    })?;
    let report = serde_json::to_string(&inspection.measurement.report);
    Ok((text(&inspection.fit)?, report.map_err(|error| PyValueError::new_err(error.to_string()))?))
}

/// Does what a command line says; returns the exit status.
#[pyfunction]
pub(crate) fn command(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| on_own_threads(|| gmlc::command(words)))
}

/// The names of the options of reading, fitting, measuring and the virtual scanner, and those of their values.
#[pyfunction]
pub(crate) fn option_names() -> Vec<Vec<OptionName>> {
    embedded::names_of_options().to_vec()
}

/// The jobs of a command line of `gmlc batch`: what all of them share, the jobs, and the numbers of scans that are done
/// and of all.
#[pyfunction]
pub(crate) fn batch_jobs(py: Python<'_>, words: Vec<String>) -> PyResult<(String, Vec<String>, usize, usize)> {
    let jobs = with_progress(py, None, move |_| embedded::batch_jobs(&words))?;
    Ok((jobs.bundle, jobs.jobs, jobs.done, jobs.total))
}

/// Does a job of a batch; returns the names of its scans, and whether each has a result.
#[pyfunction]
pub(crate) fn batch_work(py: Python<'_>, bundle: String, job: String) -> PyResult<Vec<(String, bool)>> {
    with_progress(py, None, move |progress| embedded::batch_work(&bundle, &job, progress))
}
