//! L-BFGS (argmin) on the full objective, inside the bounds.

use super::gauss_newton::Minimum;
use super::in_box::pushed;
use crate::fit::problem::objective::{Objective, Order};
use crate::fit::problem::parameterization::Estimate;
use crate::fit::tuning::{
    LBFGS_COST, LBFGS_FIRST_STEP, LBFGS_GAIN, LBFGS_GRADIENT, LBFGS_ITERATIONS, LBFGS_MEMORY, LBFGS_ROUNDS,
};
use argmin::core::{CostFunction, Error, Executor, Gradient, State};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use std::cell::RefCell;

/// Minimises from `start`; None where the model does not exist there.
///
/// argmin has no bounds: coordinates that stand at a bound and are pushed against it are held while it runs on the
/// others, and what it tries beyond a bound is moved back to the bound. When that stops it, or a held coordinate is
/// pushed inwards again, a new round begins; a round that changes neither ends the minimisation.
pub(crate) fn minimise(objective: &Objective, start: Estimate) -> Option<Minimum> {
    let evaluation = objective.evaluate(&start, Order::Gradient)?;
    let mut at = Minimum { estimate: start, evaluation, iterations: 0, converged: false };
    for _ in 0..LBFGS_ROUNDS {
        let held = held(&at, objective);
        let before = at.evaluation.value;
        let projected =
            (0..held.len()).filter(|k| !held[*k]).map(|k| at.evaluation.gradient[k].abs()).fold(0.0, f64::max);
        at.converged = projected <= LBFGS_GRADIENT;
        if at.converged || at.iterations >= LBFGS_ITERATIONS {
            break;
        }
        round(objective, &mut at, &held);
        if !(before - at.evaluation.value > LBFGS_GAIN * before) {
            // The line search found no descent although the gradient is not small: this is a stall, no optimum.
            break;
        }
    }
    Some(at)
}

/// By coordinate, whether it stands at a bound and is pushed against it.
fn held(at: &Minimum, objective: &Objective) -> Vec<bool> {
    let room = objective.space.room(&at.estimate);
    room.iter().zip(at.evaluation.gradient.iter()).map(|(room, g)| pushed(*g, *room)).collect()
}

/// One run of argmin from `at`, over the coordinates that are not held.
fn round(objective: &Objective, at: &mut Minimum, held: &[bool]) {
    let free: Vec<usize> = (0..held.len()).filter(|k| !held[*k]).collect();
    let g: Vec<f64> = free.iter().map(|k| at.evaluation.gradient[*k]).collect();
    let norm = g.iter().map(|g| g * g).sum::<f64>().sqrt();
    // argmin's first step is the gradient itself: coordinates are stretched so that it moves the surface by a third of
    // sigma.
    let stretch = (objective.loss.sigma / LBFGS_FIRST_STEP / norm).sqrt();
    let problem =
        Restricted { objective, from: at.estimate.clone(), free, stretch, dim: held.len(), last: RefCell::new(None) };
    let begin = vec![0.0; problem.free.len()];
    let solver = LBFGS::new(MoreThuenteLineSearch::new(), LBFGS_MEMORY)
        .with_tolerance_grad(LBFGS_GRADIENT * stretch)
        .and_then(|solver| solver.with_tolerance_cost(LBFGS_COST * at.evaluation.value));
    let Ok(solver) = solver else { return };
    let run = Executor::new(problem, solver)
        .configure(|state| {
            state
                .param(begin)
                .cost(at.evaluation.value)
                .gradient(g.iter().map(|g| g * stretch).collect::<Vec<f64>>())
                .max_iters(u64::from(LBFGS_ITERATIONS - at.iterations))
        })
        .ctrlc(false)
        .run();
    // An error is a line search that found no descent; the round then changed nothing.
    let Ok(run) = run else { return };
    at.iterations += run.state.get_iter() as u32;
    let Some(best) = run.state.get_best_param() else { return };
    let from = at.estimate.clone();
    let y = expand(best, held, stretch);
    let estimate = objective.space.retract(&from, &y);
    if let Some(evaluation) = objective.evaluate(&estimate, Order::Gradient)
        && evaluation.value < at.evaluation.value
    {
        at.estimate = estimate;
        at.evaluation = evaluation;
        objective.note(&at.evaluation);
    }
}

fn expand(p: &[f64], held: &[bool], stretch: f64) -> Vec<f64> {
    let mut values = p.iter();
    held.iter().map(|h| if *h { 0.0 } else { values.next().map_or(0.0, |p| p * stretch) }).collect()
}

/// The value and the gradient at a point.
#[derive(Clone)]
struct Evaluated {
    point: Vec<f64>,
    value: f64,
    gradient: Vec<f64>,
}

/// The objective over some of its coordinates, as argmin takes it.
struct Restricted<'o, 's> {
    objective: &'o Objective<'s>,
    from: Estimate,
    free: Vec<usize>,
    stretch: f64,
    dim: usize,
    /// The last evaluation: argmin asks for the value and the gradient one after the other.
    last: RefCell<Option<Evaluated>>,
}

impl Restricted<'_, '_> {
    fn at(&self, p: &[f64]) -> Evaluated {
        if let Some(last) = self.last.borrow().as_ref().filter(|last| last.point == p) {
            return last.clone();
        }
        let evaluated = self.evaluate(p);
        *self.last.borrow_mut() = Some(evaluated.clone());
        evaluated
    }

    fn evaluate(&self, p: &[f64]) -> Evaluated {
        // NaN would hang the line search; infinity ends it.
        let absent = Evaluated { point: p.to_vec(), value: f64::INFINITY, gradient: vec![0.0; p.len()] };
        let mut y = vec![0.0; self.dim];
        for (k, p) in self.free.iter().zip(p) {
            y[*k] = p * self.stretch;
        }
        if !y.iter().all(|y| y.is_finite()) {
            return absent;
        }
        let room = self.objective.space.room(&self.from);
        let inside: Vec<f64> = y.iter().zip(&room).map(|(y, (low, high))| y.min(*high).max(*low)).collect();
        let estimate = self.objective.space.retract(&self.from, &inside);
        let Some(evaluation) = self.objective.evaluate(&estimate, Order::Gradient) else { return absent };
        let mut gradient = evaluation.gradient;
        self.objective.space.pull_to(&inside, &mut gradient);
        // Beyond a bound the objective goes on as a constant.
        let slope = |k: &usize| if inside[*k] == y[*k] { gradient[*k] * self.stretch } else { 0.0 };
        Evaluated { value: evaluation.value, gradient: self.free.iter().map(slope).collect(), ..absent }
    }
}

impl CostFunction for Restricted<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, p: &Vec<f64>) -> Result<f64, Error> {
        Ok(self.at(p).value)
    }
}

impl Gradient for Restricted<'_, '_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, p: &Vec<f64>) -> Result<Vec<f64>, Error> {
        Ok(self.at(p).gradient)
    }
}
