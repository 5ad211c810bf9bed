//! Fits for every value of discrete inputs: no derivative leads from one value to the next, so that each is fitted, and
//! Schwarz's criterion (BIC) selects one.

use super::attempt::{Attempt, attempt};
use super::infer::compare::{Rival, compare};
use super::options::{FitError, FitOptions};
use super::problem::rigid::pose_parameters;
use super::result::{FitResult, Search, SearchCandidate};
use super::tuning::{CONVINCING_INLIERS, FINALISTS, SOME_EVIDENCE, STRONG_EVIDENCE};
use crate::model::Model;
use crate::progress::{Piece, Progress};
use crate::scan::Scan;
use std::collections::BTreeMap;
use thiserror::Error;

/// Values of the inputs that are searched, by name.
pub type InputValues = BTreeMap<String, i64>;

/// A model with its fit.
#[derive(Debug)]
#[non_exhaustive]
pub struct Selected<M> {
    /// The model with the selected inputs.
    pub model: M,
    /// Its fit, with the comparison in `search`.
    pub fit: FitResult,
}

/// Why no value was selected.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SearchError {
    /// No candidate could be fitted; the reason of the first.
    #[error("none of the values could be fitted: {0}")]
    NoneFitted(String),
    /// An option of the fits is wrong, or the fits cannot be compared.
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// How strongly a search's margin speaks for the winner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evidence {
    /// The runner-up is as likely.
    None,
    /// Some evidence.
    Some,
    /// Strong evidence.
    Strong,
}

impl Evidence {
    /// The evidence of a difference of BIC.
    #[must_use]
    pub fn of_margin(margin: f64) -> Self {
        match margin {
            m if m < SOME_EVIDENCE => Self::None,
            m if m < STRONG_EVIDENCE => Self::Some,
            _ => Self::Strong,
        }
    }
}

struct Candidate<M> {
    inputs: InputValues,
    model: M,
    options: FitOptions,
    fit: FitResult,
}

/// Fits a model for each of `values` and selects the one with the least BIC. `prepare` gives the model with some inputs
/// and the options of its fit, or the reason why there is none. If the user cancels, the candidates fitted so far are
/// compared.
///
/// # Errors
/// If no candidate can be fitted, or the scan has no points.
pub fn search<M: Model>(
    values: Vec<InputValues>,
    scan: &Scan,
    mut prepare: impl FnMut(&InputValues) -> Result<(M, FitOptions), String>,
    progress: &dyn Progress,
) -> Result<Selected<M>, SearchError> {
    let mut candidates: Vec<Candidate<M>> = Vec::new();
    let mut failed: Vec<SearchCandidate> = Vec::new();
    let count = values.len();
    let mut fits = Fits { progress, count: count + FINALISTS.min(count), begun: 0 };
    for (n, inputs) in values.into_iter().enumerate() {
        if progress.cancelled() && !candidates.is_empty() {
            break;
        }
        let piece = fits.next(format!("{} ({} of {count})", named(&inputs), n + 1));
        let failure = match prepare(&inputs) {
            Err(why) => why,
            Ok((model, options)) => match attempt(&model, scan, &options, &piece) {
                Ok(Attempt { result: fit, .. }) => {
                    candidates.push(Candidate { inputs, model, options, fit });
                    continue;
                }
                Err(error) if error.is_about_options() => return Err(error.into()),
                Err(error) => error.to_string(),
            },
        };
        failed.push(SearchCandidate { inputs, failed: Some(failure), ..SearchCandidate::default() });
    }
    if candidates.is_empty() {
        let why = failed.into_iter().next().and_then(|f| f.failed).unwrap_or_default();
        return Err(SearchError::NoneFitted(why));
    }
    let mut comparison = rank(&mut candidates, scan)?;
    let strong = comparison.margin.is_some_and(|m| Evidence::of_margin(m) == Evidence::Strong);
    if !(strong && candidates[0].fit.inliers > CONVINCING_INLIERS) {
        refit_best(&mut candidates, scan, &mut fits)?;
        comparison = rank(&mut candidates, scan)?;
    }
    comparison.candidates.extend(failed);
    let Candidate { model, fit, .. } = candidates.swap_remove(0);
    Ok(Selected { model, fit: FitResult { search: Some(comparison), ..fit } })
}

/// Sorts candidates by BIC.
fn rank<M: Model>(candidates: &mut Vec<Candidate<M>>, scan: &Scan) -> Result<Search, FitError> {
    let rivals: Vec<Rival> = candidates.iter().map(|c| Rival { model: &c.model, fit: &c.fit }).collect();
    let compared = compare(&rivals, scan)?;
    let figures = compared.bic.into_iter().zip(compared.objective);
    let mut ranked: Vec<((f64, f64), Candidate<M>)> = figures.zip(candidates.drain(..)).collect();
    ranked.sort_by(|((a, _), _), ((b, _), _)| a.total_cmp(b));
    let margin = ranked.get(1).map(|((second, _), _)| second - ranked[0].0.0);
    let mut search =
        Search { candidates: Vec::new(), margin, sigma: compared.sigma, effective_points: compared.effective_points };
    for ((bic, objective), candidate) in ranked {
        let inputs = candidate.inputs.clone();
        search.candidates.push(SearchCandidate { inputs, bic: Some(bic), objective: Some(objective), failed: None });
        candidates.push(candidate);
    }
    Ok(search)
}

fn named(inputs: &InputValues) -> String {
    inputs.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(" ")
}

/// The fits of a search as pieces of its progress, all of one length.
struct Fits<'a> {
    progress: &'a dyn Progress,
    /// Their number, with those that may be repeated.
    count: usize,
    begun: usize,
}

impl<'a> Fits<'a> {
    /// The next fit.
    fn next(&mut self, name: String) -> Piece<'a> {
        let at = |n: usize| n as f64 / self.count as f64;
        let range = (at(self.begun), at(self.begun + 1));
        self.begun += 1;
        Piece { whole: self.progress, name, range }
    }
}

/// Fits the best candidates again, each from the shape of the best other one, and keeps the better fit.
fn refit_best<M: Model>(candidates: &mut [Candidate<M>], scan: &Scan, fits: &mut Fits) -> Result<(), FitError> {
    let count = candidates.len().min(FINALISTS);
    for i in 0..count {
        let other = usize::from(i == 0);
        if fits.progress.cancelled() || other >= count {
            break;
        }
        let shape: Vec<(String, f64)> =
            candidates[other].fit.parameters.iter().map(|p| (p.name.clone(), p.value)).collect();
        let Candidate { inputs, model, options, fit: before, .. } = &mut candidates[i];
        let pose = pose_parameters(model, scan);
        let mut options = options.clone();
        for (name, value) in shape.into_iter().filter(|(name, _)| !pose.contains(name)) {
            options.start.entry(name).or_insert(value);
        }
        // If the other's shape does not exist with these inputs, there is nothing to try.
        let piece = fits.next(format!("{} again ({} of {count})", named(inputs), i + 1));
        let Ok(Attempt { result: again, .. }) = attempt(model, scan, &options, &piece) else { continue };
        let compared = compare(&[&*before, &again].map(|fit| Rival { model, fit }), scan)?;
        if compared.bic[1] < compared.bic[0] {
            *before = again;
        }
    }
    Ok(())
}
