//! The functions of a model: prelude and bodies, with their derivatives by the parameters.

use super::bounds::BoundsJacobian;
use super::compile::BuildError;
use super::jacobians::{self, Jacobian};
use crate::diff::{self, Entry};
use crate::ir::hash::HashMap;
use crate::ir::hoist::prelude::{Body, Whole, split_all};
use crate::ir::merge::merge_bodies;
use crate::ir::reassociate::reassociate;
use crate::ir::separable::decompose;
use crate::ir::{self, Function, FunctionId, LoweredModel, LoweredRequire, Module, Node, Op, Parameter, Type, Value};
use crate::workers::Workers;

/// Every function that is compiled in any case, all in one module.
pub(super) struct ModelFunctions {
    pub(super) module: Module,
    /// `(params..) -> (lower, upper)..`.
    pub(super) bounds: FunctionId,
    pub(super) bounds_jacobian: BoundsJacobian,
    /// To be tried in order, before the prelude.
    pub(super) requires: Vec<LoweredRequire>,
    /// `(params..) -> captures..`.
    pub(super) prelude: FunctionId,
    /// `(params..) -> slopes..`: the derivatives of captures by parameters, but for those that are 1 or -1.
    pub(super) slopes: FunctionId,
    /// The bodies of the parts. Parts that differ in what they capture only have one body: those of a loop.
    pub(super) bodies: Vec<BodyFunction>,
    pub(super) parts: Vec<PartFunctions>,
    /// `(params..) -> length` of the parts that have a tolerance of their own.
    pub(super) tolerances: Vec<Option<FunctionId>>,
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
    pub(super) jacobian: Jacobian,
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
    pub(super) fn new(lowered: &mut LoweredModel, workers: Workers) -> Result<ModelFunctions, BuildError> {
        let mut module = std::mem::take(&mut lowered.module);
        let surface = |p: &ir::LoweredPart| Whole { function: p.surface, uniform: p.params.clone() };
        let surfaces: Vec<Whole> = lowered.parts.iter().map(surface).collect();
        let mut roots: Vec<FunctionId> = surfaces.iter().map(|s| s.function).collect();
        roots.push(lowered.bounds);
        roots.extend(lowered.requires.iter().map(|r| r.function));
        let tolerances: Vec<Option<FunctionId>> = lowered.parts.iter().map(|p| p.tolerance).collect();
        roots.extend(tolerances.iter().flatten());
        diff::expand(&mut module, &roots)?;
        ir::inline(&mut module, &roots)?;
        ir::simplify(&mut module, &roots);
        for surface in &surfaces {
            reassociate(&mut module, surface.function, surface.uniform.len());
        }
        let params = lowered.params.iter().map(|p| Parameter::real(p.name.clone())).collect();
        let wholes = for_grids(&mut module, &surfaces);
        let mut split = split_all(&mut module, params, &wholes);
        merge_bodies(&mut module, &mut split);
        decompose_bodies(&mut module, &mut split.bodies);
        let wrt: Vec<u32> = (0..lowered.params.len() as u32).collect();
        let (jacobian, pattern) = diff::jacobian(&mut module, split.prelude, &wrt)?;
        let (slopes, table) = slopes(&mut module, jacobian, &pattern);
        let (bodies, of_part) = bodies(&split.bodies);
        let of_parts = split.bodies.iter().map(|part| part_slopes(&part.captures, &table));
        let of_parts: Vec<(usize, Vec<PartSlope>)> = of_part.into_iter().zip(of_parts).collect();
        let jacobians = jacobians::of_parts(&mut module, &bodies, &of_parts, workers)?;
        let mut parts = Vec::new();
        for (((surface, part), (body, slopes)), jacobian) in
            surfaces.into_iter().zip(split.bodies).zip(of_parts).zip(jacobians)
        {
            parts.push(PartFunctions { surface, body, captures: part.captures, jacobian, slopes });
        }
        let bounds_jacobian = BoundsJacobian::new(&mut module, lowered.bounds, lowered.params.len())?;
        let (bounds, requires) = (lowered.bounds, std::mem::take(&mut lowered.requires));
        let prelude = split.prelude;
        let mut functions =
            ModelFunctions { module, bounds, bounds_jacobian, requires, prelude, slopes, bodies, parts, tolerances };
        functions.drop_unreached();
        Ok(functions)
    }

    /// Drops the functions that were made on the way.
    fn drop_unreached(&mut self) {
        let mut named: Vec<&mut FunctionId> = vec![&mut self.bounds, &mut self.prelude, &mut self.slopes];
        named.push(&mut self.bounds_jacobian.function);
        named.extend(self.requires.iter_mut().map(|r| &mut r.function));
        named.extend(self.bodies.iter_mut().map(|b| &mut b.points));
        named.extend(self.parts.iter_mut().flat_map(|p| [&mut p.surface.function, &mut p.jacobian.function]));
        named.extend(self.tolerances.iter_mut().flatten());
        let mut roots: Vec<FunctionId> = named.iter().map(|f| **f).collect();
        self.module.drop_unreached(&mut roots);
        named.into_iter().zip(roots).for_each(|(f, id)| *f = id);
    }
}

/// Surfaces as they are best evaluated: those that people read stay as they are.
fn for_grids(module: &mut Module, surfaces: &[Whole]) -> Vec<Whole> {
    let decomposed = |s: &Whole| Whole { function: decompose(module, s.function, s.uniform.len()), ..s.clone() };
    surfaces.iter().map(decomposed).collect()
}

/// Again, as constants were not captured and came back to the points.
fn decompose_bodies(module: &mut Module, bodies: &mut [Body]) {
    let mut known: HashMap<FunctionId, FunctionId> = HashMap::default();
    for body in bodies {
        let uniforms = body.captures.len();
        body.function = *known.entry(body.function).or_insert_with(|| decompose(module, body.function, uniforms));
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
