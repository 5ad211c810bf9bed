//! Operations that are calls of the host's functions.

use super::host::{self, Symbols};
use super::lower::{Frame, Lowered, Lowering, TRUSTED};
use super::vector::PAIRS;
use crate::ir::hash::HashMap;
use crate::ir::{self, Binary, Function, Op, Type, Unary};
use cranelift_codegen::ir::{AbiParam, InstBuilder, MemFlagsData, Value, types};
use cranelift_module::{Linkage, Module as _};
use std::ops::Range;

/// Whether an operation is a call of a host function.
pub(super) fn is_libcall(op: &Op, ty: Type) -> bool {
    match op {
        Op::Unary(op, _) => host::unary(*op).is_some(),
        Op::Binary(op, ..) => ty == Type::Real && host::binary(*op).is_some(),
        _ => false,
    }
}

/// The nodes of a range that are sine and cosine of the same number, by that number.
pub(super) fn sincos_pairs(function: &Function, range: Range<usize>) -> HashMap<ir::Value, [ir::Value; 2]> {
    let mut sines = HashMap::default();
    let mut both = HashMap::default();
    for pass in [Unary::Sin, Unary::Cos] {
        for (i, node) in (range.start as u32..).zip(&function.nodes[range.clone()]) {
            match node.op {
                Op::Unary(Unary::Sin, a) if pass == Unary::Sin => drop(sines.insert(a, ir::Value(i))),
                Op::Unary(Unary::Cos, a) if pass == Unary::Cos => {
                    if let Some(sine) = sines.get(&a) {
                        both.insert(a, [*sine, ir::Value(i)]);
                    }
                }
                _ => {}
            }
        }
    }
    both
}

/// The nodes of a range that are powers and logarithms of the same number, of which there are several, by that number.
pub(super) fn powers(function: &Function, range: Range<usize>) -> HashMap<ir::Value, Vec<ir::Value>> {
    let mut powers: HashMap<ir::Value, Vec<ir::Value>> = HashMap::default();
    for (i, node) in (range.start as u32..).zip(&function.nodes[range]) {
        if let Op::Binary(Binary::Pow, base, _) | Op::Unary(Unary::Ln, base) = node.op {
            powers.entry(base).or_default().push(ir::Value(i));
        }
    }
    powers.retain(|_, nodes| nodes.len() > 1);
    powers
}

impl Lowering<'_, '_, '_> {
    /// Lowers a node, whose operands are lowered, with others of the same number by one call: sine and cosine; or
    /// powers and the logarithm, which powers are computed from. False where there are no others that can be had now.
    pub(super) fn joint_call(&mut self, frame: &mut Frame<'_>, node: ir::Value, op: &Op) -> bool {
        match op {
            Op::Unary(Unary::Sin | Unary::Cos, _) => self.sine_and_cosine(frame, op),
            Op::Unary(Unary::Ln, base) | Op::Binary(Binary::Pow, base, _) => {
                self.logarithm_and_powers(frame, node, *base)
            }
            _ => false,
        }
    }

    fn logarithm_and_powers(&mut self, frame: &mut Frame<'_>, node: ir::Value, base: ir::Value) -> bool {
        let Some(nodes) = frame.powers.get(&base) else { return false };
        let (mut logarithms, mut powers) = (Vec::new(), Vec::new());
        for other in nodes.iter().filter(|n| frame.is_missing(**n)) {
            match frame.function.op(*other) {
                Op::Binary(_, _, exponent) if !frame.is_missing(*exponent) => powers.push((*other, *exponent)),
                Op::Unary(..) => logarithms.push(*other),
                _ => {}
            }
        }
        powers.sort_by_key(|(power, _)| *power != node);
        powers.truncate(host::POWERS.len());
        if powers.is_empty() || logarithms.len() + powers.len() < 2 {
            return false;
        }
        let operands = std::iter::once(base).chain(powers.iter().map(|(_, exponent)| *exponent));
        let operands: Vec<Value> = operands.map(|v| self.value(&frame.values[v.0 as usize])).collect();
        let results = self.call_in_memory(host::POWERS[powers.len() - 1], &operands, operands.len());
        let logarithms = logarithms.into_iter().map(|node| (node, results[0]));
        for (node, value) in
            logarithms.chain(powers.iter().zip(&results[1..]).map(|((node, _), value)| (*node, *value)))
        {
            frame.values[node.0 as usize] = Lowered::One(value);
        }
        true
    }

    /// Lowers a sine and a cosine of the same number with one call; false where the operation is not one of two.
    fn sine_and_cosine(&mut self, frame: &mut Frame<'_>, op: &Op) -> bool {
        let Op::Unary(Unary::Sin | Unary::Cos, a) = op else { return false };
        let Some(nodes) = frame.sincos.get(a).copied() else { return false };
        let a = self.value(&frame.values[a.0 as usize]);
        for (node, value) in nodes.into_iter().zip(self.call_in_memory(host::SIN_COS, &[a], 2)) {
            frame.values[node.0 as usize] = Lowered::One(value);
        }
        true
    }

    /// Calls a host function of doubles, or of pairs.
    pub(super) fn host(&mut self, symbols: Symbols, arguments: &[Value]) -> Value {
        if self.two_lanes {
            return self.call_in_memory(symbols, arguments, 1)[0];
        }
        let function = self.host_function(symbols.one, &vec![types::F64; arguments.len()], Some(types::F64));
        let call = self.builder.ins().call(function, arguments);
        self.builder.inst_results(call)[0]
    }

    /// Calls a host function that takes numbers, or pairs, in memory and leaves its results there.
    fn call_in_memory(&mut self, symbols: Symbols, arguments: &[Value], results: usize) -> Vec<Value> {
        let (name, ty, flags, words): (_, _, MemFlagsData, _) =
            if self.two_lanes { (symbols.two, types::F64X2, PAIRS, 2) } else { (symbols.one, types::F64, TRUSTED, 1) };
        let slot = self.slot(false, words * arguments.len().max(results));
        let place = self.builder.ins().stack_addr(types::I64, slot, 0);
        let offset = |k: usize| (8 * words * k) as i32;
        for (k, argument) in arguments.iter().enumerate() {
            self.builder.ins().store(flags, *argument, place, offset(k));
        }
        let function = self.host_function(name, &[types::I64], None);
        self.builder.ins().call(function, &[place]);
        (0..results).map(|k| self.builder.ins().load(ty, flags, place, offset(k))).collect()
    }

    fn host_function(
        &mut self,
        name: &'static str,
        params: &[cranelift_codegen::ir::Type],
        result: Option<cranelift_codegen::ir::Type>,
    ) -> cranelift_codegen::ir::FuncRef {
        if let Some(function) = self.hosts.get(name) {
            return *function;
        }
        let module = self.compiler.memory.module_mut();
        let mut signature = module.make_signature();
        signature.params.extend(params.iter().copied().map(AbiParam::new));
        signature.returns.extend(result.map(AbiParam::new));
        let id = module.declare_function(name, Linkage::Import, &signature).expect("a host function has one signature");
        let function = module.declare_func_in_func(id, self.builder.func);
        self.hosts.insert(name, function);
        function
    }
}
