//! Fits for every value of discrete inputs: no derivative leads from one value to the next, so that each is fitted, and
//! Schwarz's criterion (BIC) selects one. Of many values most are hopeless: a quick fit is enough to tell.

use super::attempt::{Attempt, attempt};
use super::infer::compare::{Rival, compare};
use super::measures::nominal;
use super::options::{FitError, FitOptions};
use super::problem::rigid::pose_parameters;
use super::quick::quick;
use super::result::{FitResult, Search, SearchCandidate};
use super::tuning::{
    CONVINCING_INLIERS, EXPLAINED, FINALISTS, QUICK_HOPELESS, QUICK_SHARE, RACED, SOME_EVIDENCE, STRONG_EVIDENCE,
};
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
    /// The fit is a quick one.
    quick: bool,
}

/// The candidates of a search.
struct Field<'a, M> {
    scan: &'a Scan,
    fits: Fits<'a>,
    candidates: Vec<Candidate<M>>,
    /// Those that could not be fitted.
    failed: Vec<SearchCandidate>,
}

/// Fits a model for each of `values` and selects the one with the least BIC. `prepare` gives the model with some inputs
/// and the options of its fit, or the reason why there is none. Of many values all but one are fitted quickly, from
/// where the fit of that one ended, and then the best wholly. If the user cancels, the candidates fitted so far are
/// compared.
///
/// # Errors
/// If no candidate can be fitted, or the scan has no points.
pub fn search<M: Model>(
    mut values: Vec<InputValues>,
    scan: &Scan,
    mut prepare: impl FnMut(&InputValues) -> Result<(M, FitOptions), String>,
    progress: &dyn Progress,
) -> Result<Selected<M>, SearchError> {
    let count = values.len();
    let raced = count >= RACED;
    if raced {
        // The pilot is in the middle of the range, where it is like most of the others.
        values.rotate_left(count / 2);
    }
    let mut field = Field { scan, fits: Fits::new(progress, count, raced), candidates: Vec::new(), failed: Vec::new() };
    for (n, inputs) in values.into_iter().enumerate() {
        if progress.cancelled() && !field.candidates.is_empty() {
            break;
        }
        let name = format!("{} ({} of {count})", named(&inputs), n + 1);
        match prepare(&inputs) {
            Err(why) => field.fail(inputs, why),
            Ok((model, options)) => field.enter(inputs, model, options, name, raced)?,
        }
    }
    let mut comparison = field.decide()?;
    let Field { mut candidates, failed, .. } = field;
    comparison.candidates.extend(failed);
    let Candidate { model, fit, options, .. } = candidates.swap_remove(0);
    let measures = fit.measured(&model, &nominal(&model, &options));
    Ok(Selected { model, fit: FitResult { search: Some(comparison), measures, ..fit } })
}

impl<M: Model> Field<'_, M> {
    fn fail(&mut self, inputs: InputValues, why: String) {
        self.failed.push(SearchCandidate { inputs, failed: Some(why), ..SearchCandidate::default() });
    }

    /// Fits another candidate: quickly if the search is a race, and the first one shows where the object is.
    fn enter(
        &mut self,
        inputs: InputValues,
        model: M,
        options: FitOptions,
        name: String,
        raced: bool,
    ) -> Result<(), FitError> {
        let pilot = self.candidates.first().filter(|pilot| raced && pilot.fit.inliers > EXPLAINED);
        if let Some(pilot) = pilot {
            let piece = self.fits.next(name.clone(), QUICK_SHARE);
            if let Some(fit) = quick(&model, self.scan, &options, &pilot.fit, &piece) {
                self.candidates.push(Candidate { inputs, model, options, fit, quick: true });
                return Ok(());
            }
        }
        let piece = self.fits.next(name, 1.0);
        match attempt(&model, self.scan, &options, &piece) {
            Ok(Attempt { result: fit, .. }) => {
                self.candidates.push(Candidate { inputs, model, options, fit, quick: false });
            }
            Err(error) if error.is_about_options() => return Err(error),
            Err(error) => self.fail(inputs, error.to_string()),
        }
        Ok(())
    }

    /// Sorts the candidates; the best ones have whole fits then.
    fn decide(&mut self) -> Result<Search, SearchError> {
        if self.fits.progress.cancelled() {
            self.candidates.retain(|c| !c.quick);
        }
        if self.candidates.is_empty() {
            let why = self.failed.first().and_then(|f| f.failed.clone()).unwrap_or_default();
            return Err(SearchError::NoneFitted(why));
        }
        let mut comparison = rank(&mut self.candidates, self.scan)?;
        loop {
            let next = self.incomplete(&comparison);
            let Some(next) = next.filter(|_| !self.fits.progress.cancelled()) else { break };
            self.complete(next)?;
            comparison = rank(&mut self.candidates, self.scan)?;
        }
        let strong = comparison.margin.is_some_and(|m| Evidence::of_margin(m) == Evidence::Strong);
        if !(strong && self.candidates[0].fit.inliers > CONVINCING_INLIERS) {
            refit_best(&mut self.candidates, self.scan, &mut self.fits)?;
            comparison = rank(&mut self.candidates, self.scan)?;
        }
        Ok(comparison)
    }

    /// The best candidate that is still to have a whole fit: the winner and the runner-up, others of the finalists that
    /// may still win, and all where the winner does not convince.
    fn incomplete(&self, comparison: &Search) -> Option<usize> {
        let convincing = self.candidates[0].fit.inliers > CONVINCING_INLIERS;
        let most = if convincing { FINALISTS } else { self.candidates.len() };
        let loss = |i: usize| comparison.candidates[i].objective.unwrap_or(f64::INFINITY);
        let hopeless = |i: usize| convincing && i > 1 && loss(i) > QUICK_HOPELESS * loss(0);
        (0..self.candidates.len().min(most)).find(|i| self.candidates[*i].quick && !hopeless(*i))
    }

    /// Gives a candidate a whole fit instead of its quick one.
    fn complete(&mut self, i: usize) -> Result<(), FitError> {
        let Candidate { inputs, model, options, .. } = &self.candidates[i];
        let piece = self.fits.next(format!("{} in full", named(inputs)), 1.0);
        match attempt(model, self.scan, options, &piece) {
            Ok(Attempt { result: fit, .. }) => {
                self.candidates[i].fit = fit;
                self.candidates[i].quick = false;
            }
            Err(error) if error.is_about_options() => return Err(error),
            Err(error) => {
                let Candidate { inputs, .. } = self.candidates.remove(i);
                self.fail(inputs, error.to_string());
            }
        }
        Ok(())
    }
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
        let quick = candidate.quick;
        search.candidates.push(SearchCandidate {
            inputs,
            bic: Some(bic),
            objective: Some(objective),
            quick,
            failed: None,
        });
        candidates.push(candidate);
    }
    Ok(search)
}

fn named(inputs: &InputValues) -> String {
    inputs.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(" ")
}

/// The fits of a search as pieces of its progress.
struct Fits<'a> {
    progress: &'a dyn Progress,
    /// Their time, with those that may be repeated, where a whole fit takes 1.
    whole: f64,
    begun: f64,
}

impl<'a> Fits<'a> {
    fn new(progress: &'a dyn Progress, count: usize, raced: bool) -> Self {
        let finalists = FINALISTS.min(count) as f64;
        let first = if raced { 1.0 + QUICK_SHARE * (count - 1) as f64 + finalists } else { count as f64 };
        Self { progress, whole: first + finalists, begun: 0.0 }
    }

    /// The next fit, which takes this share of a whole one.
    fn next(&mut self, name: String, share: f64) -> Piece<'a> {
        let at = |begun: f64| (begun / self.whole).min(1.0);
        let range = (at(self.begun), at(self.begun + share));
        self.begun += share;
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
        let piece = fits.next(format!("{} again ({} of {count})", named(inputs), i + 1), 1.0);
        let Ok(Attempt { result: again, .. }) = attempt(model, scan, &options, &piece) else { continue };
        let compared = compare(&[&*before, &again].map(|fit| Rival { model, fit }), scan)?;
        if compared.bic[1] < compared.bic[0] {
            *before = again;
        }
    }
    Ok(())
}
