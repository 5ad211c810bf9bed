//! The functions of a model: prelude and bodies, with their derivatives by the parameters.

use super::compile::BuildError;
use crate::diff::{self, Directions, Entry, Rate};
use crate::ir::hash::HashMap;
use crate::ir::merge::merge_bodies;
use crate::ir::regroup::regroup;
use crate::ir::split::{Body, Whole, split_all};
use crate::ir::{self, Function, FunctionId, LoweredModel, LoweredRequire, Module, Node, Op, Parameter, Type, Value};

/// Every function that is compiled in any case, all in one module.
pub(super) struct ModelFunctions {
    pub(super) module: Module,
    /// `(params..) -> (lower, upper)..`.
    pub(super) bounds: FunctionId,
    /// To be tried in order, before the prelude.
    pub(super) requires: Vec<LoweredRequire>,
    /// `(params..) -> captures..`.
    pub(super) prelude: FunctionId,
    /// `(params..) -> slopes..`: the derivatives of captures by parameters, but for those that are 1 or -1.
    pub(super) slopes: FunctionId,
    /// The bodies of the parts. Parts that differ in what they capture only have one body: those of a loop.
    pub(super) bodies: Vec<BodyFunction>,
    pub(super) parts: Vec<PartFunctions>,
}

/// What is computed at every point of a part. C stands for its captures, in order.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyFunction {
    /// `(C.., u, v) -> point`.
    pub(super) points: FunctionId,
    /// How many C are.
    pub(super) captures: usize,
    /// How many of them, the first, are not constant.
    pub(super) varied: usize,
}

/// The derivative of a capture by a parameter, where it is not zero.
#[derive(Clone, Copy, Debug)]
struct Slope {
    param: u32,
    value: SlopeValue,
}

/// Its value.
#[derive(Clone, Copy, Debug)]
pub(super) enum SlopeValue {
    /// 1 or -1, whatever the parameters.
    Constant(f64),
    /// Result of `ModelFunctions::slopes`.
    Computed(u32),
}

/// A part's functions.
pub(super) struct PartFunctions {
    /// The whole, for texts and for the interpreter: `(the parameters that it takes.., u, v) -> (x, y, z)`.
    pub(super) surface: Whole,
    /// Its body's index.
    pub(super) body: usize,
    /// Its C among all captures.
    pub(super) captures: Vec<u32>,
    /// `(C.., slopes.., u, v) -> (point's derivative by each active parameter)..`.
    pub(super) jacobian: FunctionId,
    /// Which slopes `jacobian` takes.
    pub(super) jacobian_slopes: Vec<u32>,
    /// Parameters that the part depends on, ascending.
    pub(super) active: Vec<u32>,
    /// The slopes of its captures, for what the pullback gives.
    pub(super) slopes: Vec<PartSlope>,
}

/// The derivative of a part's capture by a parameter.
#[derive(Clone, Copy, Debug)]
pub(super) struct PartSlope {
    /// Which of the part's captures.
    pub(super) position: u32,
    pub(super) param: u32,
    pub(super) value: SlopeValue,
}

impl ModelFunctions {
    /// Differentiates a model, whose functions it takes.
    pub(super) fn new(lowered: &mut LoweredModel) -> Result<ModelFunctions, BuildError> {
        let mut module = std::mem::take(&mut lowered.module);
        let surface = |p: &ir::LoweredPart| Whole { function: p.surface, uniform: p.params.clone() };
        let surfaces: Vec<Whole> = lowered.parts.iter().map(surface).collect();
        let mut roots: Vec<FunctionId> = surfaces.iter().map(|s| s.function).collect();
        roots.push(lowered.bounds);
        roots.extend(lowered.requires.iter().map(|r| r.function));
        diff::expand(&mut module, &roots)?;
        let limits = module.limits;
        ir::inline(&mut module, &roots, limits)?;
        ir::simplify(&mut module, &roots);
        for surface in &surfaces {
            regroup(&mut module, surface.function, surface.uniform.len());
        }
        let params = lowered.params.iter().map(|p| Parameter::real(p.name.clone())).collect();
        let mut split = split_all(&mut module, params, &surfaces);
        merge_bodies(&mut module, &mut split);
        let wrt: Vec<u32> = (0..lowered.params.len() as u32).collect();
        let (jacobian, pattern) = diff::jacobian(&mut module, split.prelude, &wrt)?;
        let (slopes, table) = slopes(&mut module, jacobian, &pattern);
        let (bodies, of_part) = bodies(&split.bodies);
        let mut jacobians = Jacobians::default();
        let mut parts = Vec::new();
        for ((surface, body), part) in surfaces.into_iter().zip(of_part).zip(split.bodies) {
            let slopes = part_slopes(&part.captures, &table);
            let jacobian = jacobians.of(&mut module, body, bodies[body], &slopes)?;
            parts.push(PartFunctions { surface, body, captures: part.captures, slopes, ..jacobian });
        }
        let (bounds, requires) = (lowered.bounds, std::mem::take(&mut lowered.requires));
        let mut functions = ModelFunctions { module, bounds, requires, prelude: split.prelude, slopes, bodies, parts };
        functions.drop_unreached();
        Ok(functions)
    }

    /// Drops the functions that were made on the way.
    fn drop_unreached(&mut self) {
        let mut named: Vec<&mut FunctionId> = vec![&mut self.bounds, &mut self.prelude, &mut self.slopes];
        named.extend(self.requires.iter_mut().map(|r| &mut r.function));
        named.extend(self.bodies.iter_mut().map(|b| &mut b.points));
        named.extend(self.parts.iter_mut().flat_map(|p| [&mut p.surface.function, &mut p.jacobian]));
        let mut roots: Vec<FunctionId> = named.iter().map(|f| **f).collect();
        self.module.drop_unreached(&mut roots);
        named.into_iter().zip(roots).for_each(|(f, id)| *f = id);
    }
}

/// Different bodies, and the one of each part.
fn bodies(parts: &[Body]) -> (Vec<BodyFunction>, Vec<usize>) {
    let mut bodies = Vec::new();
    let mut indices: HashMap<FunctionId, usize> = HashMap::default();
    let mut of_part = Vec::new();
    for part in parts {
        let index = *indices.entry(part.function).or_insert_with(|| {
            let captures = part.captures.len();
            bodies.push(BodyFunction { points: part.function, captures, varied: captures - part.constants });
            bodies.len() - 1
        });
        of_part.push(index);
    }
    (bodies, of_part)
}

/// Separates what is 1 or -1 from the prelude's Jacobian, `(params..) -> (captures.., entries..)`: such factors vanish.
/// Other constants stay, lest parts in a loop differ in them. Returns the slopes of each capture, by parameter.
fn slopes(module: &mut Module, jacobian: FunctionId, pattern: &[Entry]) -> (FunctionId, Vec<Vec<Slope>>) {
    let function = module.function(jacobian);
    let first = function.results.len() - pattern.len();
    let mut picks = Vec::new();
    let mut table = vec![Vec::new(); first];
    for (entry, result) in pattern.iter().zip(first..) {
        let value = match function.op(function.results[result]) {
            Op::Real(bits) if f64::from_bits(*bits).abs() == 1.0 => SlopeValue::Constant(f64::from_bits(*bits)),
            _ => {
                picks.push(Some(result));
                SlopeValue::Computed(picks.len() as u32 - 1)
            }
        };
        table[entry.result as usize].push(Slope { param: entry.param, value });
    }
    let picked = pick(function, "slopes", &picks);
    (module.add(picked), table)
}

/// The slopes of the captures that a part takes.
fn part_slopes(captures: &[u32], table: &[Vec<Slope>]) -> Vec<PartSlope> {
    let mut slopes = Vec::new();
    for (position, capture) in (0..).zip(captures) {
        let own = table[*capture as usize].iter();
        slopes.extend(own.map(|s| PartSlope { position, param: s.param, value: s.value }));
    }
    slopes
}

/// The Jacobians made so far.
#[derive(Default)]
struct Jacobians {
    made: HashMap<JacobianKey, Jacobian>,
}

/// A body's index and, for each slope, the position of the capture, the parameter's rank among those with slopes, and the
/// bits of its value where it is constant.
type JacobianKey = (usize, Vec<(u32, u32, Option<u64>)>);

#[derive(Clone)]
struct Jacobian {
    function: FunctionId,
    /// The ranks of the parameters by which the derivative is not always zero.
    active: Vec<u32>,
}

impl Jacobians {
    /// A part's Jacobian; the rest of the part is left empty.
    fn of(
        &mut self,
        module: &mut Module,
        body: usize,
        function: BodyFunction,
        slopes: &[PartSlope],
    ) -> Result<PartFunctions, BuildError> {
        let mut params: Vec<u32> = slopes.iter().map(|s| s.param).collect();
        params.sort_unstable();
        params.dedup();
        let rank = |param: u32| params.binary_search(&param).map_or(u32::MAX, |rank| rank as u32);
        let (mut jacobian_slopes, mut pattern) = (Vec::new(), Vec::new());
        for slope in slopes {
            let constant = match slope.value {
                SlopeValue::Constant(x) => Some(x.to_bits()),
                SlopeValue::Computed(k) => {
                    jacobian_slopes.push(k);
                    None
                }
            };
            pattern.push((slope.position, rank(slope.param), constant));
        }
        let key = (body, pattern);
        let jacobian = match self.made.get(&key) {
            Some(known) => known.clone(),
            None => {
                let made = jacobian(module, function, &key.1)?;
                self.made.entry(key).or_insert(made).clone()
            }
        };
        Ok(PartFunctions {
            surface: Whole { function: function.points, uniform: Vec::new() },
            body,
            captures: Vec::new(),
            jacobian: jacobian.function,
            jacobian_slopes,
            active: jacobian.active.iter().map(|rank| params[*rank as usize]).collect(),
            slopes: Vec::new(),
        })
    }
}

/// `(C.., slopes.., u, v) -> derivatives by active parameters`, with the ranks of these.
fn jacobian(
    module: &mut Module,
    body: BodyFunction,
    slopes: &[(u32, u32, Option<u64>)],
) -> Result<Jacobian, BuildError> {
    let n = body.captures as u32;
    let old = &module.function(body.points).params;
    let mut params = old[..body.captures].to_vec();
    let mut rates = vec![Vec::new(); old.len()];
    for (position, rank, constant) in slopes {
        let rate = match constant {
            Some(bits) => Rate::Constant(f64::from_bits(*bits)),
            None => {
                params.push(Parameter::real(format!("slope{}", params.len() - body.captures)));
                Rate::Param(params.len() as u32 - 1)
            }
        };
        rates[*position as usize].push((*rank, rate));
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
    Ok(Jacobian { function, active })
}

/// Where the entries of a Jacobian are among a function's results, after some others, by result and parameter.
pub(super) fn positions(pattern: &[Entry], first: usize) -> HashMap<(u32, u32), usize> {
    pattern.iter().zip(first..).map(|(e, position)| ((e.result, e.param), position)).collect()
}

/// A function with some of another's results; zero where nothing is picked.
pub(super) fn pick(function: &Function, name: &str, picks: &[Option<usize>]) -> Function {
    let mut picked = Function { name: name.to_owned(), ..function.clone() };
    let zero = Value(picked.nodes.len() as u32);
    picked.nodes.push(Node { op: Op::Real(0), ty: Type::Real, span: crate::source::Span::default() });
    picked.results = picks.iter().map(|p| p.map_or(zero, |k| function.results[k])).collect();
    picked.result_names =
        picks.iter().map(|p| p.map_or_else(|| "zero".to_owned(), |k| function.result_names[k].clone())).collect();
    picked.drop_unused();
    picked
}
