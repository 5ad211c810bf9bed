//! The start of a fit in terms of the model's parameters: values, and which of them are fixed or tied to others.

use super::options::{FitError, FitOptions};
use super::room::{Room, range, shown};
use crate::model::Model;
use gml_compiler::program::Parameter;
use gml_compiler::suggest;

/// The start vector, and which parameters do not vary by themselves.
pub(crate) struct Start {
    /// All parameters in the model's order. Millimetres and radians.
    pub(crate) x: Vec<f64>,
    pub(crate) fixed: Vec<bool>,
    /// Pairs of a leader, which is free, and its follower, which has the leader's value.
    pub(crate) ties: Vec<(usize, usize)>,
}

impl Start {
    /// Parameters that neither are fixed nor follow another one, ascending.
    pub(crate) fn free(&self) -> impl Iterator<Item = usize> {
        (0..self.x.len()).filter(|i| !self.fixed[*i] && !self.ties.iter().any(|(_, follower)| follower == i))
    }

    /// Whether a parameter follows another one or is followed by one.
    pub(crate) fn is_tied(&self, i: usize) -> bool {
        self.ties.iter().any(|(leader, follower)| *leader == i || *follower == i)
    }
}

/// The index of a parameter.
fn index(name: &str, parameters: &[Parameter]) -> Result<usize, FitError> {
    parameters.iter().position(|p| p.name == name).ok_or_else(|| FitError::UnknownParameter {
        name: name.to_owned(),
        nearest: nearest_parameter(name, parameters),
    })
}

/// The parameter that a wrong name most likely means: the nearest one, or one with which the name begins.
fn nearest_parameter(name: &str, parameters: &[Parameter]) -> Option<String> {
    let names = || parameters.iter().map(|p| p.name.as_str());
    suggest::nearest(name, names()).or_else(|| names().find(|known| name.starts_with(known))).map(str::to_owned)
}

impl FitOptions {
    /// The options in terms of the model's parameters.
    ///
    /// # Errors
    /// Names that the model does not have, start values outside of their bounds or that leave other parameters none,
    /// and parameters that cannot be tied.
    pub(crate) fn resolve(&self, model: &dyn Model) -> Result<Start, FitError> {
        if let Some(sigma) = self.sigma
            && !(sigma > 0.0 && sigma.is_finite())
        {
            return Err(FitError::Sigma(sigma));
        }
        let parameters = model.parameters();
        let mut x: Vec<f64> = parameters.iter().map(|p| p.default).collect();
        // Where the bounds have changed, these values move into them: the user did not give them.
        for (name, value) in self.earlier.iter().flat_map(|earlier| &earlier.values) {
            x[index(name, parameters)?] = *value;
        }
        let mut given = vec![false; x.len()];
        for (name, value) in &self.start {
            let i = index(name, parameters)?;
            x[i] = *value;
            given[i] = true;
        }
        let bounds = model.bounds(&x);
        for i in 0..x.len() {
            let (low, high) = bounds[i];
            // Rounding of a value printed and read again is not the user's error.
            let slack = 1e-9 * (1.0 + x[i].abs());
            if given[i] && !(x[i].is_finite() && x[i] >= low - slack && x[i] <= high + slack) {
                return Err(out_of_bounds(model, &x, i));
            }
        }
        let mut fixed = vec![false; x.len()];
        for name in &self.fixed {
            fixed[index(name, parameters)?] = true;
        }
        let ties = self.ties(parameters, &fixed)?;
        let x = Room { model, fixed: &fixed, given: &given, ties: &ties }.start(&x)?;
        Ok(Start { x, fixed, ties })
    }

    /// The groups of equal parameters as pairs of a leader and a follower.
    fn ties(&self, parameters: &[Parameter], fixed: &[bool]) -> Result<Vec<(usize, usize)>, FitError> {
        let mut ties: Vec<(usize, usize)> = Vec::new();
        for group in &self.equal {
            let members = group.iter().map(|name| index(name, parameters)).collect::<Result<Vec<usize>, FitError>>()?;
            let Some((first, followers)) = members.split_first() else { continue };
            for follower in followers {
                let refuse =
                    |why| FitError::Equal(parameters[*first].name.clone(), parameters[*follower].name.clone(), why);
                if parameters[*first].quantity != parameters[*follower].quantity {
                    return Err(refuse("they measure different things"));
                }
                if first == follower {
                    return Err(refuse("they are the same parameter"));
                }
                // A member of an earlier group brings its leader along.
                let leader = ties.iter().find(|(_, follower)| follower == first).map_or(*first, |(leader, _)| *leader);
                let taken = |i: &usize| fixed[*i] || ties.iter().any(|(a, b)| a == i || b == i);
                if leader == *follower || taken(follower) || fixed[leader] {
                    return Err(refuse("one of them is fixed or tied already"));
                }
                ties.push((leader, *follower));
            }
        }
        Ok(ties)
    }
}

/// The error of a start value `x[i]` that is outside of its bounds.
fn out_of_bounds(model: &dyn Model, x: &[f64], i: usize) -> FitError {
    let parameters = model.parameters();
    let (low, high) = model.bounds(x)[i];
    let above = x[i] > high;
    let of_bound = |d: &f64, e: &f64| if above { *e != 0.0 } else { *d != 0.0 };
    let derivatives = model.bounds_jacobian(x);
    let on = derivatives.iter().filter(|d| d.parameter == i && of_bound(&d.lower, &d.upper)).map(|d| d.by);
    FitError::OutOfBounds {
        name: parameters[i].name.clone(),
        value: shown(x[i], parameters[i].quantity),
        bounds: range(low, high, parameters[i].quantity),
        above,
        at: on.map(|j| (parameters[j].name.clone(), shown(x[j], parameters[j].quantity))).collect(),
    }
}
