//! The Jacobians of parts by parameters: of bodies, in the directions of the prelude's Jacobian.

use super::functions::{BodyFunction, EntryValue, PreludeEntry, pick, positions};
use super::pipeline::BuildError;
use crate::diff::{self, Directions, Rate};
use crate::ir::hash::HashMap;
use crate::ir::{FunctionId, Module, Parameter};
use crate::workers::Workers;

/// A part's Jacobian.
#[derive(Clone)]
pub(super) struct Jacobian {
    /// `(C.., entries.., u, v) -> (point's derivative by each active parameter)..`.
    pub(super) function: FunctionId,
    /// The results of the prelude's Jacobian that it takes.
    pub(super) entries: Vec<u32>,
    /// Parameters that the part depends on, ascending.
    pub(super) active: Vec<u32>,
}

/// The properties of a part that determine its Jacobian.
#[derive(Clone, PartialEq, Eq, Hash)]
struct Kind {
    body: usize,
    entries: Vec<RankedEntry>,
}

/// An entry of the prelude's Jacobian, as far as parts that differ in their parameters may share it.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct RankedEntry {
    capture: u32,
    /// The parameter's rank among those that have entries.
    rank: u32,
    /// The bits of its value, where that is constant.
    constant: Option<u64>,
}

/// A part's kind, with its parameters.
struct PartKind {
    kind: Kind,
    /// The parameter of each rank.
    params: Vec<u32>,
    /// The results of the prelude's Jacobian that it takes.
    taken: Vec<u32>,
}

/// The Jacobian of a kind.
struct Made {
    function: FunctionId,
    /// The ranks of the parameters by which the derivative is not always zero.
    active: Vec<u32>,
}

/// Nodes of bodies that are worth a group of their own.
const GROUP: usize = 300;

/// Most groups. They do not depend on the number of workers, so that the result does not.
const MOST_GROUPS: usize = 8;

/// The Jacobian of each part, of which the body and the entries of the prelude's Jacobian are given.
pub(super) fn of_parts(
    module: &mut Module,
    bodies: &[BodyFunction],
    parts: &[(usize, Vec<PreludeEntry>)],
    workers: Workers,
) -> Result<Vec<Jacobian>, BuildError> {
    let mut kinds = Vec::new();
    let mut places: HashMap<Kind, usize> = HashMap::default();
    let mut of_part = Vec::new();
    for (body, entries) in parts {
        let PartKind { kind, params, taken } = part_kind(*body, entries);
        let place = *places.entry(kind).or_insert_with_key(|kind| {
            kinds.push(kind.clone());
            kinds.len() - 1
        });
        of_part.push((place, params, taken));
    }
    let made = differentiate(module, bodies, &kinds, workers)?;
    let jacobian = |(place, params, entries): (usize, Vec<u32>, Vec<u32>)| Jacobian {
        function: made[place].function,
        entries,
        active: made[place].active.iter().map(|rank| params[*rank as usize]).collect(),
    };
    Ok(of_part.into_iter().map(jacobian).collect())
}

fn part_kind(body: usize, entries: &[PreludeEntry]) -> PartKind {
    let mut params: Vec<u32> = entries.iter().map(|s| s.param).collect();
    params.sort_unstable();
    params.dedup();
    let rank = |param: u32| params.binary_search(&param).map_or(u32::MAX, |rank| rank as u32);
    let mut taken = Vec::new();
    let pattern = entries.iter().map(|entry| {
        let constant = match entry.value {
            EntryValue::Constant(x) => Some(x.to_bits()),
            EntryValue::Computed(k) => {
                taken.push(k);
                None
            }
        };
        RankedEntry { capture: entry.capture, rank: rank(entry.param), constant }
    });
    let entries = pattern.collect();
    PartKind { kind: Kind { body, entries }, params, taken }
}

/// The derivatives of all kinds: in groups, each of which works on a copy of what it needs of the module.
fn differentiate(
    module: &mut Module,
    bodies: &[BodyFunction],
    kinds: &[Kind],
    workers: Workers,
) -> Result<Vec<Made>, BuildError> {
    let groups = groups(module, bodies, kinds);
    let shared = module.functions.len();
    let whole: &Module = module;
    let made = workers.map(&groups, |kinds| -> Result<_, BuildError> {
        let roots: Vec<FunctionId> = kinds.iter().map(|k| bodies[k.body].points).collect();
        let mut own = whole.reached(&roots);
        let made: Vec<Made> =
            kinds.iter().map(|kind| jacobian(&mut own, bodies[kind.body], &kind.entries)).collect::<Result<_, _>>()?;
        Ok((own, made))
    });
    let mut all = Vec::new();
    for group in made {
        let (own, made) = group?;
        let shift = module.adopt(own, shared);
        all.extend(made.into_iter().map(|m| Made { function: shift(m.function), ..m }));
    }
    Ok(all)
}

/// Consecutive kinds, of about as many nodes.
fn groups<'k>(module: &Module, bodies: &[BodyFunction], kinds: &'k [Kind]) -> Vec<&'k [Kind]> {
    let size = |kind: &Kind| module.function(bodies[kind.body].points).nodes.len();
    let all: usize = kinds.iter().map(size).sum();
    let each = (all / MOST_GROUPS).max(GROUP);
    let mut filled = 0;
    kinds
        .chunk_by(|kind, _| {
            filled += size(kind);
            let goes_on = filled < each;
            filled = if goes_on { filled } else { 0 };
            goes_on
        })
        .collect()
}

/// The derivative of a body in the directions of the entries.
fn jacobian(module: &mut Module, body: BodyFunction, entries: &[RankedEntry]) -> Result<Made, BuildError> {
    let n = body.captures as u32;
    let old = &module.function(body.points).params;
    let mut params = old[..body.captures].to_vec();
    let mut rates = vec![Vec::new(); old.len()];
    for RankedEntry { capture, rank, constant } in entries {
        let rate = match constant {
            Some(bits) => Rate::Constant(f64::from_bits(*bits)),
            None => {
                params.push(Parameter::real(format!("entry{}", params.len() - body.captures)));
                Rate::Param(params.len() as u32 - 1)
            }
        };
        rates[*capture as usize].push((*rank, rate));
    }
    let uv = params.len() as u32;
    params.extend_from_slice(&old[body.captures..]);
    let args = (0..n).chain(uv..uv + 2).collect();
    let (function, pattern) = diff::directional(module, body.points, &Directions { params, args, rates })?;
    let mut active: Vec<u32> = pattern.iter().map(|e| e.param).collect();
    active.sort_unstable();
    active.dedup();
    let entries = positions(&pattern, 0);
    let coordinates = |rank: &u32| [0, 1, 2].map(|result| entries.get(&(result, *rank)).copied());
    let picks: Vec<Option<usize>> = active.iter().flat_map(coordinates).collect();
    let picked = pick(module.function(function), "jacobian", &picks);
    module.define(function, picked);
    Ok(Made { function, active })
}
