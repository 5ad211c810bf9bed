//! The limits by name, as options of commands set them.

use super::Options;
use thiserror::Error;

/// Why a limit cannot be set.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LimitError {
    /// There is none of that name.
    #[error("there is no limit '{0}'; the limits are {names}", names = NAMES.join(", "))]
    Unknown(String),
    /// Nothing would be left to do with it.
    #[error("the limit '{0}' must be at least 1")]
    Zero(String),
}

const NAMES: [&str; 8] = ["steps", "depth", "nesting", "instances", "iterations", "parts", "nodes", "operations"];

impl Options {
    /// Sets the limit of that name:
    ///
    /// | name | bounds |
    /// |---|---|
    /// | `steps` | iterations of loops and calls in one evaluation, at one point |
    /// | `depth` | calls within calls in one evaluation |
    /// | `nesting` | calls within calls while functions are instantiated: recursion over known whole numbers |
    /// | `instances` | functions times the types of arguments that they are called with |
    /// | `iterations` | iterations of a `for` and elements of an array |
    /// | `parts` | parts of a model |
    /// | `nodes` | nodes of the typed program, which takes some hundred bytes of memory each |
    /// | `operations` | operations of all functions together, and of each derivative; 5/2 of it before unused ones go |
    ///
    /// # Errors
    /// If there is none, or it would be 0.
    pub fn set_limit(&mut self, name: &str, value: u64) -> Result<(), LimitError> {
        let (count, size) = (u32::try_from(value).unwrap_or(u32::MAX), usize::try_from(value).unwrap_or(usize::MAX));
        match name {
            _ if value == 0 && NAMES.contains(&name) => return Err(LimitError::Zero(name.to_owned())),
            "steps" => self.limits.steps = count,
            "depth" => self.limits.depth = count,
            "nesting" => self.check.depth = size,
            "instances" => self.check.instances = size,
            "iterations" => self.check.iterations = size,
            "parts" => self.check.parts = size,
            "nodes" => self.check.nodes = size,
            "operations" => self.operations = size,
            _ => return Err(LimitError::Unknown(name.to_owned())),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_limit_is_set_alone() {
        let values = |o: &Options| {
            let sizes =
                [o.check.depth, o.check.instances, o.check.iterations, o.check.parts, o.check.nodes, o.operations];
            [o.limits.steps as usize, o.limits.depth as usize].into_iter().chain(sizes).collect::<Vec<_>>()
        };
        for (k, name) in NAMES.into_iter().enumerate() {
            let mut options = Options::default();
            options.set_limit(name, 7).unwrap();
            let mut expected = values(&Options::default());
            expected[k] = 7;
            assert_eq!(values(&options), expected, "{name}");
        }
        assert_eq!(Options::default().set_limit("memory", 1), Err(LimitError::Unknown("memory".to_owned())));
        assert_eq!(Options::default().set_limit("steps", 0), Err(LimitError::Zero("steps".to_owned())));
    }
}
