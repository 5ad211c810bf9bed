//! The work of `gmlc batch` on other machines: what travels to them is plain data.

use super::error::EmbeddedError;
use super::model::subject_of_texts;
use crate::batch::{self, Job, Plan};
use crate::cli::{BatchArgs, Cli, Command};
use crate::error::CommandError;
use crate::record;
use crate::saved::SavedFit;
use crate::subject::Subject;
use clap::FromArgMatches;
use gml_runtime::fit::FitResult;
use gml_runtime::population::CommonTexture;
use gml_runtime::progress::Progress;
use gml_runtime::record::Record;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// What all jobs of a batch share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Bundle {
    /// The command line.
    words: Vec<String>,
    /// Names and texts of the script and of what it uses.
    texts: Vec<(String, String)>,
    /// The fit of `--params`.
    params: Option<FitResult>,
    /// The record of the batch.
    record: Record,
    /// The folder of the results, which workers must be able to write to.
    output: PathBuf,
}

/// A batch as jobs: `bundle` is what all of them share. Both are JSON.
#[derive(Clone, Debug)]
pub struct BatchJobs {
    /// What all jobs share.
    pub bundle: String,
    /// The jobs that are not done: each is of one scan, or of several that follow one another.
    pub jobs: Vec<String>,
    /// The number of scans that are done.
    pub done: usize,
    /// The number of all scans.
    pub total: usize,
}

/// The arguments of a command line, whose first word is the program's name.
fn arguments(words: &[String]) -> Result<BatchArgs, EmbeddedError> {
    let matches = crate::cli::definition().try_get_matches_from(words);
    let cli = matches.and_then(|matches| Cli::from_arg_matches(&matches));
    match cli.map_err(|error| EmbeddedError::from(CommandError::usage(error)))?.command {
        Command::Batch(args) => Ok(args),
        _ => Err(CommandError::usage("the command is not batch").into()),
    }
}

/// The jobs of a command line that is not done, whose first word is the program's name.
///
/// # Errors
/// The command line is wrong, or the script.
pub fn batch_jobs(words: &[String]) -> Result<BatchJobs, EmbeddedError> {
    let args = arguments(words)?;
    let record = record::of_words(&args.report, &args.script.model, words)?;
    let (plan, scans) = batch::planned(&args, record)?;
    let (jobs, done) = batch::jobs(&plan, &scans)?;
    let output = args.output.canonicalize().map_err(EmbeddedError::failed)?;
    let bundle = Bundle {
        words: words.to_vec(),
        texts: super::model::texts(&plan.subject.program),
        params: plan.subject.saved.as_ref().map(|saved| saved.fit().clone()),
        record: plan.record.clone(),
        output,
    };
    let json = |job: &Job| serde_json::to_string(job).map_err(EmbeddedError::failed);
    Ok(BatchJobs {
        bundle: serde_json::to_string(&bundle).map_err(EmbeddedError::failed)?,
        jobs: jobs.iter().map(json).collect::<Result<_, _>>()?,
        done,
        total: scans.len(),
    })
}

/// What a worker keeps of a batch between two jobs.
struct Prepared {
    bundle: String,
    record: Record,
    args: BatchArgs,
    subject: Arc<Subject>,
    texture: Arc<CommonTexture>,
}

/// Of the process: a worker mostly has one batch after the other.
static PREPARED: Mutex<Option<Arc<Prepared>>> = Mutex::new(None);

fn prepared(text: &str) -> Result<Arc<Prepared>, EmbeddedError> {
    let mut kept = PREPARED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(prepared) = kept.as_ref().filter(|prepared| prepared.bundle == text) {
        return Ok(prepared.clone());
    }
    let bundle: Bundle = serde_json::from_str(text).map_err(EmbeddedError::failed)?;
    let mut args = arguments(&bundle.words)?;
    args.output = bundle.output;
    let mut subject = subject_of_texts(&bundle.texts, args.script.compile.clone())?;
    if let Some(fit) = bundle.params {
        let saved = SavedFit::of(fit);
        let compile = saved.with_inputs(&args.script.compile, &[])?;
        subject = subject_of_texts(&bundle.texts, compile)?;
        subject.saved = Some(saved);
    }
    let subject = Arc::new(subject);
    let texture = Plan::texture_of(&args, &subject)?;
    let prepared = Arc::new(Prepared { bundle: text.to_owned(), record: bundle.record, args, subject, texture });
    *kept = Some(prepared.clone());
    Ok(prepared)
}

/// Does a job: inspects its scans and writes their results. Returns their names, and whether each has a result. What is
/// done already, as by a worker that was lost after it, is not done again.
///
/// # Errors
/// Results cannot be written, or the work was ended by its caller.
pub fn batch_work(bundle: &str, job: &str, progress: &dyn Progress) -> Result<Vec<(String, bool)>, EmbeddedError> {
    let job: Job = serde_json::from_str(job).map_err(EmbeddedError::failed)?;
    let prepared = prepared(bundle)?;
    let Prepared { record, args, subject, texture, .. } = &*prepared;
    let plan = Plan::of(args, subject.clone(), texture.clone(), record.clone())?;
    Ok(batch::work_job(&plan, &job, progress)?)
}
