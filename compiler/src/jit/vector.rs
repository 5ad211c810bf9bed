//! Two lanes, a point in each: what differs when reals are pairs and truth values are pairs of masks.
//!
//! Every lane computes what the scalar code does, with the same operations: results are the same to the bit.

use super::lower::Lowering;
use crate::ir::{Function, Op, Type, Unary};
use cranelift_codegen::ir::{Endianness, InstBuilder, MemFlagsData, Value, types};

/// Memory of pairs: there and its own, but only aligned to its halves.
pub(super) const PAIRS: MemFlagsData = MemFlagsData::new().with_notrap();

/// Whether everything that differs between points has instructions or functions for pairs: all but integers, branches,
/// loops and calls.
pub(super) fn has_vector_form(function: &Function, varying: &[bool]) -> bool {
    let plain = |op: &Op, ty: Type| match op {
        Op::Param(_) | Op::Real(_) => ty == Type::Real,
        Op::Unary(op, a) => function.ty(*a) != Type::Int && !matches!(op, Unary::ToReal | Unary::ToInt),
        Op::Compare(_, a, _) => function.ty(*a) == Type::Real,
        Op::Binary(..) | Op::PowInt(..) | Op::Select(..) | Op::Guard { .. } => ty != Type::Int,
        Op::Int(_) | Op::Bool(_) | Op::If { .. } | Op::Loop { .. } => false,
        Op::Call { .. } | Op::Tangent { .. } | Op::Project(..) => false,
    };
    function.nodes.iter().zip(varying).all(|(node, varying)| !varying || plain(&node.op, node.ty))
}

impl Lowering<'_, '_, '_> {
    /// A real constant.
    pub(super) fn constant(&mut self, x: f64) -> Value {
        if !self.two_lanes {
            return self.builder.ins().f64const(x);
        }
        let bytes = [x.to_le_bytes(); 2].as_flattened().to_vec();
        let pair = self.builder.func.dfg.constants.insert(bytes.into());
        self.builder.ins().vconst(types::F64X2, pair)
    }

    /// A truth value.
    pub(super) fn truth(&mut self, holds: bool) -> Value {
        let one = self.builder.ins().iconst(types::I8, i64::from(holds));
        if self.two_lanes { self.splat(one) } else { one }
    }

    /// `if condition { a } else { b }`.
    pub(super) fn select(&mut self, condition: Value, a: Value, b: Value) -> Value {
        if !self.two_lanes {
            return self.builder.ins().select(condition, a, b);
        }
        let ty = self.builder.func.dfg.value_type(a);
        let condition = self.cast(ty, condition);
        self.builder.ins().bitselect(condition, a, b)
    }

    /// Whether a condition holds in both lanes.
    pub(super) fn in_all_lanes(&mut self, condition: Value) -> Value {
        if self.builder.func.dfg.value_type(condition).is_vector() {
            return self.builder.ins().vall_true(condition);
        }
        condition
    }

    /// A real or truth value in both lanes.
    pub(super) fn splat(&mut self, value: Value) -> Value {
        match self.builder.func.dfg.value_type(value) {
            types::F64 => self.builder.ins().splat(types::F64X2, value),
            types::I8 => {
                let mask = self.builder.ins().bmask(types::I64, value);
                self.builder.ins().splat(types::I64X2, mask)
            }
            _ => value,
        }
    }

    /// The first lanes of two pairs, all as bytes.
    pub(super) fn firsts(&mut self, a: Value, b: Value) -> Value {
        self.lanes(a, b, 0, 16)
    }

    /// The second lanes of two pairs, all as bytes.
    pub(super) fn seconds(&mut self, a: Value, b: Value) -> Value {
        self.lanes(a, b, 8, 24)
    }

    /// The first lane of one pair and the second of another, all as bytes.
    pub(super) fn outer_lanes(&mut self, a: Value, b: Value) -> Value {
        self.lanes(a, b, 0, 24)
    }

    /// Two lanes of two pairs, by the index of their first byte; those of b begin at 16.
    fn lanes(&mut self, a: Value, b: Value, first: u8, second: u8) -> Value {
        let bytes: Vec<u8> = (first..first + 8).chain(second..second + 8).collect();
        let mask = self.builder.func.dfg.immediates.push(bytes.into());
        self.builder.ins().shuffle(a, b, mask)
    }

    /// The bytes of a pair.
    pub(super) fn bytes(&mut self, pair: Value) -> Value {
        self.cast(types::I8X16, pair)
    }

    /// The same bits as another type.
    fn cast(&mut self, ty: cranelift_codegen::ir::Type, value: Value) -> Value {
        if self.builder.func.dfg.value_type(value) == ty {
            return value;
        }
        self.builder.ins().bitcast(ty, MemFlagsData::new().with_endianness(Endianness::Little), value)
    }
}
