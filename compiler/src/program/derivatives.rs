//! The functions of a model: prelude and bodies, with their derivatives.

use super::compile::BuildError;
use crate::diff::{self, Entry};
use crate::ir::graph::References;
use crate::ir::split::{Body, Split, split_all};
use crate::ir::{
    self, Function, FunctionBuilder, FunctionId, LoweredModel, LoweredRequire, Module, Node, Op, Parameter, Type, Value,
};
use std::collections::BTreeMap;

/// Every function that is compiled, all in one module.
pub(super) struct ModelFunctions {
    pub(super) module: Module,
    /// `(params..) -> (lower, upper)..`.
    pub(super) bounds: FunctionId,
    /// To be tried in order, before the prelude.
    pub(super) requires: Vec<LoweredRequire>,
    /// `(params..) -> captures..`.
    pub(super) prelude: FunctionId,
    /// `(params..) -> slopes..`: the derivatives of captures by parameters that are not constant.
    pub(super) slopes: FunctionId,
    pub(super) parts: Vec<PartFunctions>,
}

/// The derivative of a capture by a parameter, where it is not zero.
#[derive(Clone, Copy, Debug)]
struct Slope {
    capture: u32,
    param: u32,
    value: SlopeValue,
}

/// Its value.
#[derive(Clone, Copy, Debug)]
pub(super) enum SlopeValue {
    /// Whatever the parameters.
    Constant(f64),
    /// Result of `ModelFunctions::slopes`.
    Computed(u32),
}

/// A part's functions. C stands for its captures, in order.
pub(super) struct PartFunctions {
    /// The whole, for texts and for the interpreter: `(params.., u, v) -> (x, y, z)`.
    pub(super) surface: FunctionId,
    /// Which captures it uses.
    pub(super) captures: Vec<u32>,
    /// `(C.., u, v) -> point`.
    pub(super) points: FunctionId,
    /// `(C.., u, v) -> (point, du, dv)`.
    pub(super) partials: FunctionId,
    /// `(C.., u, v) -> (point, du, dv, duu, duv, dvv)`.
    pub(super) second_partials: FunctionId,
    /// `(C.., slopes.., u, v) -> (point's derivative by each active parameter)..`.
    pub(super) jacobian: FunctionId,
    /// Which slopes `jacobian` takes.
    pub(super) jacobian_slopes: Vec<u32>,
    /// `(C.., u, v, w..) -> adjoints of C..`.
    pub(super) pullback: FunctionId,
    /// Parameters that the part depends on, ascending.
    pub(super) active: Vec<u32>,
    /// The slopes of its captures, for what `pullback` gives.
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
    /// Differentiates a model.
    pub(super) fn new(lowered: &LoweredModel) -> Result<ModelFunctions, BuildError> {
        let mut module = lowered.module.clone();
        let surfaces: Vec<FunctionId> = lowered.parts.iter().map(|p| p.surface).collect();
        let mut roots = surfaces.clone();
        roots.push(lowered.bounds);
        roots.extend(lowered.requires.iter().map(|r| r.function));
        diff::expand(&mut module, &roots)?;
        clean(&mut module, &roots)?;
        let n = lowered.params.len() as u32;
        let split = match surfaces[..] {
            [] => Split { prelude: nothing(&mut module, lowered), bodies: Vec::new() },
            _ => split_all(&mut module, &surfaces, &[n, n + 1]),
        };
        let wrt: Vec<u32> = (0..n).collect();
        let (jacobian, pattern) = diff::jacobian(&mut module, split.prelude, &wrt)?;
        let (slopes, slope_table) = slopes(&mut module, jacobian, &pattern);
        let mut parts = Vec::new();
        for (surface, part) in surfaces.iter().zip(split.bodies) {
            parts.push(PartFunctions::new(&mut module, *surface, part, &slope_table)?);
        }
        Ok(ModelFunctions {
            module,
            bounds: lowered.bounds,
            requires: lowered.requires.clone(),
            prelude: split.prelude,
            slopes,
            parts,
        })
    }
}

impl PartFunctions {
    fn new(
        module: &mut Module,
        surface: FunctionId,
        body: Body,
        slope_table: &[Slope],
    ) -> Result<PartFunctions, BuildError> {
        let n = body.captures.len() as u32;
        let (partials, second_partials) = partials(module, body.function, n)?;
        let slopes = part_slopes(&body, slope_table);
        let (jacobian, jacobian_slopes, active) = jacobian(module, &body, &slopes)?;
        let wrt: Vec<u32> = (0..n).collect();
        let pullback = diff::pullback(module, body.function, &wrt, false)?;
        Ok(PartFunctions {
            surface,
            captures: body.captures,
            points: body.function,
            partials,
            second_partials,
            jacobian,
            jacobian_slopes,
            pullback,
            active,
            slopes,
        })
    }
}

/// The prelude of a model without parts.
fn nothing(module: &mut Module, lowered: &LoweredModel) -> FunctionId {
    let params = lowered.params.iter().map(|p| Parameter::real(p.name.clone())).collect();
    module.add(FunctionBuilder::new("prelude", params).finish([]))
}

fn clean(module: &mut Module, roots: &[FunctionId]) -> Result<(), BuildError> {
    ir::inline(module, roots, module.limits)?;
    ir::simplify(module, roots);
    Ok(())
}

/// Separates the constants from the prelude's Jacobian, `(params..) -> (captures.., entries..)`.
fn slopes(module: &mut Module, jacobian: FunctionId, pattern: &[Entry]) -> (FunctionId, Vec<Slope>) {
    let function = module.function(jacobian);
    let first = function.results.len() - pattern.len();
    let mut picks = Vec::new();
    let mut table = Vec::new();
    for (entry, result) in pattern.iter().zip(first..) {
        let value = match function.op(function.results[result]) {
            Op::Real(bits) => SlopeValue::Constant(f64::from_bits(*bits)),
            _ => {
                picks.push(Some(result));
                SlopeValue::Computed(picks.len() as u32 - 1)
            }
        };
        table.push(Slope { capture: entry.result, param: entry.param, value });
    }
    let picked = pick(function, "slopes", &picks);
    (module.add(picked), table)
}

/// The slopes of the captures that a body takes.
fn part_slopes(body: &Body, table: &[Slope]) -> Vec<PartSlope> {
    let position = |slope: &Slope| body.captures.binary_search(&slope.capture).ok();
    table
        .iter()
        .filter_map(|s| Some(PartSlope { position: position(s)? as u32, param: s.param, value: s.value }))
        .collect()
}

/// `(C.., u, v) -> (point, du, dv)`, and the same with second partials.
fn partials(module: &mut Module, body: FunctionId, captures: u32) -> Result<(FunctionId, FunctionId), BuildError> {
    let uv = [captures, captures + 1];
    let (first, pattern) = diff::jacobian(module, body, &uv)?;
    let entry = |pattern: &[Entry], results: usize, result: u32, param: u32| {
        pattern.iter().position(|e| e.result == result && e.param == param).map(|i| results + i)
    };
    let mut picks: Vec<Option<usize>> = (0..3).map(Some).collect();
    picks.extend(uv.iter().flat_map(|p| (0..3).map(|r| entry(&pattern, 3, r, *p)).collect::<Vec<_>>()));
    let partials = pick(module.function(first), "partials", &picks);
    let partials = module.add(partials);

    let (second, pattern) = diff::jacobian(module, partials, &uv)?;
    let mut picks: Vec<Option<usize>> = (0..9).map(Some).collect();
    // The partials of du are duu and duv; of those of dv, dvv is new.
    for (results, param) in [(3..6, uv[0]), (3..6, uv[1]), (6..9, uv[1])] {
        picks.extend(results.map(|r| entry(&pattern, 9, r, param)));
    }
    let second = pick(module.function(second), "second_partials", &picks);
    Ok((partials, module.add(second)))
}

/// `(C.., slopes.., u, v) -> derivatives by active parameters`, with the slopes that it takes and the parameters.
///
/// Two ways lead there: the body's tangent in the direction of each parameter, or its Jacobian by the captures, times
/// the slopes. The one with fewer operations is taken.
fn jacobian(
    module: &mut Module,
    body: &Body,
    slopes: &[PartSlope],
) -> Result<(FunctionId, Vec<u32>, Vec<u32>), BuildError> {
    let wrapper = Wrapper::new(body, slopes);
    let by_tangents = wrapper.by_tangents(module)?;
    let by_captures = wrapper.by_captures(module)?;
    let smaller = if size(module, by_tangents) <= size(module, by_captures) { by_tangents } else { by_captures };
    // What turned out to be zero in all three coordinates is no influence.
    let function = module.function(smaller);
    let is_zero = |k: usize| *function.op(function.results[k]) == Op::Real(0);
    let active: Vec<usize> = (0..wrapper.by_param.len()).filter(|a| (0..3).any(|c| !is_zero(3 * a + c))).collect();
    let picks: Vec<Option<usize>> = active.iter().flat_map(|a| (0..3).map(move |c| Some(3 * a + c))).collect();
    let picked = pick(function, "jacobian", &picks);
    let params: Vec<u32> = wrapper.by_param.keys().copied().collect();
    let active = active.into_iter().map(|a| params[a]).collect();
    Ok((module.add(picked), wrapper.computed, active))
}

/// A function around a body: `(C.., slopes.., u, v)`.
struct Wrapper<'b> {
    body: &'b Body,
    /// For every parameter with slopes: the position among C of the capture, and its slope.
    by_param: BTreeMap<u32, Vec<(u32, SlopeValue)>>,
    /// The slopes that are parameters of the function.
    computed: Vec<u32>,
}

impl<'b> Wrapper<'b> {
    fn new(body: &'b Body, slopes: &[PartSlope]) -> Wrapper<'b> {
        let mut by_param: BTreeMap<u32, Vec<(u32, SlopeValue)>> = BTreeMap::new();
        let mut computed = Vec::new();
        for slope in slopes {
            by_param.entry(slope.param).or_default().push((slope.position, slope.value));
            if let SlopeValue::Computed(k) = slope.value {
                computed.push(k);
            }
        }
        Wrapper { body, by_param, computed }
    }

    /// The parameters of the function.
    fn params(&self, module: &Module) -> Vec<Parameter> {
        let body = module.function(self.body.function);
        let n = self.body.captures.len();
        let mut params = body.params[..n].to_vec();
        params.extend(self.computed.iter().map(|k| Parameter::real(format!("slope{k}"))));
        params.extend(body.params[n..].iter().cloned());
        params
    }

    /// The body's arguments among the parameters.
    fn body_args(&self, builder: &FunctionBuilder) -> Vec<Value> {
        let n = self.body.captures.len();
        let uv = n + self.computed.len();
        (0..n).chain(uv..uv + 2).map(|i| builder.param(i)).collect()
    }

    fn slope(&self, builder: &mut FunctionBuilder, value: SlopeValue) -> Value {
        match value {
            SlopeValue::Constant(x) => builder.real(x),
            SlopeValue::Computed(k) => {
                let position = self.computed.iter().position(|c| *c == k).expect("it was listed");
                builder.param(self.body.captures.len() + position)
            }
        }
    }

    /// The body where each capture c has moved by the sum of slope times t over the parameters, differentiated by all t
    /// at once, at t = 0.
    fn by_tangents(&self, module: &mut Module) -> Result<FunctionId, BuildError> {
        let (moved, wrt) = self.moved(module);
        let (jacobian, pattern) = diff::jacobian(module, moved, &wrt)?;
        let mut builder = FunctionBuilder::new("jacobian", self.params(module));
        let mut args = builder.params();
        let zero = builder.real(0.0);
        args.extend(wrt.iter().map(|_| zero));
        let types = vec![Type::Real; module.function(jacobian).results.len()];
        let entries = builder.call(jacobian, args, &types);
        let mut results = Vec::new();
        for t in &wrt {
            for coordinate in 0..3 {
                let entry = pattern.iter().position(|e| e.result == coordinate && e.param == *t);
                results.push(entry.map_or(zero, |entry| entries[3 + entry]));
            }
        }
        let id = module.add(builder.finish(named(results)));
        clean(module, &[id])?;
        Ok(id)
    }

    /// `(C.., slopes.., u, v, t..) -> point`, and the indices of the t.
    fn moved(&self, module: &mut Module) -> (FunctionId, Vec<u32>) {
        let mut params = self.params(module);
        let first = params.len();
        params.extend(self.by_param.keys().map(|p| Parameter::real(format!("t{p}"))));
        let mut builder = FunctionBuilder::new("moved", params);
        let mut args = self.body_args(&builder);
        for (t, slopes) in (first..).zip(self.by_param.values()) {
            for (capture, value) in slopes {
                let slope = self.slope(&mut builder, *value);
                let product = builder.mul(slope, builder.param(t));
                args[*capture as usize] = builder.add(args[*capture as usize], product);
            }
        }
        let point = builder.call(self.body.function, args, &[Type::Real; 3]);
        let id = module.add(builder.finish(named(point)));
        (id, (first as u32..).take(self.by_param.len()).collect())
    }

    fn by_captures(&self, module: &mut Module) -> Result<FunctionId, BuildError> {
        let wrt: Vec<u32> = (0..self.body.captures.len() as u32).collect();
        let (jacobian, pattern) = diff::jacobian(module, self.body.function, &wrt)?;
        let mut builder = FunctionBuilder::new("jacobian", self.params(module));
        let args = self.body_args(&builder);
        let types = vec![Type::Real; module.function(jacobian).results.len()];
        let entries = builder.call(jacobian, args, &types);
        let mut results = Vec::new();
        for slopes in self.by_param.values() {
            for coordinate in 0..3 {
                let mut sum = builder.real(0.0);
                for (capture, value) in slopes {
                    let entry = pattern.iter().position(|e| e.result == coordinate && e.param == *capture);
                    if let Some(entry) = entry {
                        let slope = self.slope(&mut builder, *value);
                        let product = builder.mul(slope, entries[3 + entry]);
                        sum = builder.add(sum, product);
                    }
                }
                results.push(sum);
            }
        }
        let id = module.add(builder.finish(named(results)));
        clean(module, &[id])?;
        Ok(id)
    }
}

fn named(results: Vec<Value>) -> impl Iterator<Item = (String, Value)> {
    results.into_iter().enumerate().map(|(i, v)| (format!("d{i}"), v))
}

/// Operations of a function and of all that it names.
fn size(module: &Module, id: FunctionId) -> usize {
    References::new(module, &[id]).order.iter().map(|f| module.function(*f).nodes.len()).sum()
}

/// A function with some of another's results; zero where nothing is picked.
fn pick(function: &Function, name: &str, picks: &[Option<usize>]) -> Function {
    let mut picked = Function { name: name.to_owned(), ..function.clone() };
    let zero = Value(picked.nodes.len() as u32);
    picked.nodes.push(Node { op: Op::Real(0), ty: Type::Real, span: crate::source::Span::default() });
    picked.results = picks.iter().map(|p| p.map_or(zero, |k| function.results[k])).collect();
    picked.result_names =
        picks.iter().map(|p| p.map_or_else(|| "zero".to_owned(), |k| function.result_names[k].clone())).collect();
    picked.drop_unused();
    picked
}
