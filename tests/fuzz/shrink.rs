//! Reduction of cases that fail.

use crate::case::{Base, Case};
use crate::verdict;
use std::time::{Duration, Instant};

/// How long a case is reduced.
const TIME: Duration = Duration::from_secs(20);

/// Leaves out pieces of a case's files and standard input, ever smaller ones, without which it still fails alike.
pub(crate) fn shrunk(base: &Base, mut case: Case, reason: &str) -> Case {
    let (class, begun) = (verdict::class(reason), Instant::now());
    let fails = |case: &Case| case.run(base).failure.is_some_and(|why| verdict::class(&why) == class);
    let names: Vec<Option<String>> = case.files.keys().cloned().map(Some).chain([None]).collect();
    for name in names {
        let content = |case: &Case| match &name {
            Some(name) => case.files[name].clone(),
            None => case.input.clone(),
        };
        let mut size = content(&case).len().div_ceil(2);
        while size > 0 && begun.elapsed() < TIME {
            let mut from = 0;
            while from < content(&case).len() && begun.elapsed() < TIME {
                let mut without = content(&case);
                without.drain(from..(from + size).min(without.len()));
                let mut smaller = case.clone();
                match &name {
                    Some(name) => drop(smaller.files.insert(name.clone(), without)),
                    None => smaller.input = without,
                }
                if fails(&smaller) {
                    case = smaller;
                } else {
                    from += size;
                }
            }
            size /= 2;
        }
    }
    case
}
