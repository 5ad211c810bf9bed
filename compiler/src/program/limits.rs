//! The limits by name, as options of commands set them.

use super::Options;
use thiserror::Error;

/// A limit.
#[derive(Clone, Copy, Debug)]
pub struct Limit {
    /// Its name in options.
    pub name: &'static str,
    /// A description of the quantity that it bounds.
    pub bounds: &'static str,
    get: fn(&Options) -> u64,
    set: fn(&mut Options, u64),
}

/// Why a limit cannot be set.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LimitError {
    /// There is none of that name.
    #[error("there is no limit '{0}'; the limits are {names}", names = LIMITS.map(|l| l.name).join(", "))]
    Unknown(String),
    /// Nothing would be left to do with it.
    #[error("the limit '{0}' must be at least 1")]
    Zero(String),
}

/// All of them.
pub const LIMITS: [Limit; 7] = [
    Limit {
        name: "steps",
        bounds: "iterations of loops and calls in one evaluation, at one point",
        get: |o| o.limits.steps.into(),
        set: |o, n| o.limits.steps = u32::try_from(n).unwrap_or(u32::MAX),
    },
    Limit {
        name: "depth",
        bounds: "calls within calls in one evaluation",
        get: |o| o.limits.depth.into(),
        set: |o, n| o.limits.depth = u32::try_from(n).unwrap_or(u32::MAX),
    },
    Limit {
        name: "nesting",
        bounds: "calls within calls while functions are instantiated: recursion over known whole numbers",
        get: |o| o.check.depth as u64,
        set: |o, n| o.check.depth = size(n),
    },
    Limit {
        name: "instances",
        bounds: "functions times the types of arguments that they are called with",
        get: |o| o.check.instances as u64,
        set: |o, n| o.check.instances = size(n),
    },
    Limit {
        name: "iterations",
        bounds: "iterations of a `for` and elements of an array",
        get: |o| o.check.iterations as u64,
        set: |o, n| o.check.iterations = size(n),
    },
    Limit {
        name: "nodes",
        bounds: "nodes of the typed program, which takes some hundred bytes of memory each",
        get: |o| o.check.nodes as u64,
        set: |o, n| o.check.nodes = size(n),
    },
    Limit {
        name: "operations",
        bounds: "operations of each function that is compiled, derivatives included: memory and time of the compiler",
        get: |o| o.operations as u64,
        set: |o, n| o.operations = size(n),
    },
];

fn size(n: u64) -> usize {
    usize::try_from(n).unwrap_or(usize::MAX)
}

impl Limit {
    /// Its value in some options.
    #[must_use]
    pub fn value(&self, options: &Options) -> u64 {
        (self.get)(options)
    }
}

impl Options {
    /// Sets the limit of that name.
    ///
    /// # Errors
    /// If there is none, or it would be 0.
    pub fn set_limit(&mut self, name: &str, value: u64) -> Result<(), LimitError> {
        let limit = LIMITS.iter().find(|l| l.name == name).ok_or_else(|| LimitError::Unknown(name.to_owned()))?;
        if value == 0 {
            return Err(LimitError::Zero(name.to_owned()));
        }
        (limit.set)(self, value);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_limit_is_set_alone() {
        for limit in LIMITS {
            let mut options = Options::default();
            options.set_limit(limit.name, 7).unwrap();
            assert_eq!(limit.value(&options), 7);
            for other in LIMITS.iter().filter(|o| o.name != limit.name) {
                assert_eq!(
                    other.value(&options),
                    other.value(&Options::default()),
                    "{} moves {}",
                    limit.name,
                    other.name
                );
            }
        }
        assert_eq!(Options::default().set_limit("memory", 1), Err(LimitError::Unknown("memory".to_owned())));
        assert_eq!(Options::default().set_limit("steps", 0), Err(LimitError::Zero("steps".to_owned())));
    }
}
