//! Operands and callees of operations; access to functions and to the tables of a module.

use super::{Failure, FailureId, Function, FunctionId, Module, Op, Parameter, Type, Value};

/// Hands every operand of an operation to a closure, in order: as `&Value` or as `&mut Value`, like the operation.
macro_rules! for_each_operand {
    ($op:expr, $f:expr) => {{
        let mut f = $f;
        match $op {
            Op::Param(_) | Op::Real(_) | Op::Int(_) | Op::Bool(_) => {}
            Op::Unary(_, a) | Op::PowInt(a, _) | Op::Project(a, _) => f(a),
            Op::Binary(_, a, b) | Op::Compare(_, a, b) | Op::Guard { value: a, condition: b, .. } => {
                f(a);
                f(b);
            }
            Op::Select(c, a, b) => {
                f(c);
                f(a);
                f(b);
            }
            Op::If { condition, args, .. } => {
                f(condition);
                args.into_iter().for_each(f);
            }
            Op::Loop { count, init, invariant, .. } => {
                f(count);
                init.into_iter().chain(invariant).for_each(f);
            }
            Op::Call { args, .. } => args.into_iter().for_each(f),
            Op::Tangent { args, seeds, .. } => {
                args.into_iter().for_each(&mut f);
                seeds.into_iter().for_each(|(_, v)| f(v));
            }
        }
    }};
}

impl Op {
    /// The values that it uses, in order; a value used twice comes twice.
    #[must_use]
    pub fn operands(&self) -> Vec<Value> {
        let mut operands = Vec::new();
        self.visit_operands(|v| operands.push(v));
        operands
    }

    /// Hands every operand to `f`, in order.
    pub fn visit_operands(&self, mut f: impl FnMut(Value)) {
        for_each_operand!(self, |v: &Value| f(*v));
    }

    /// Whether all operands satisfy a predicate.
    #[must_use]
    pub fn all_operands(&self, mut predicate: impl FnMut(Value) -> bool) -> bool {
        let mut all = true;
        self.visit_operands(|v| all &= predicate(v));
        all
    }

    /// The same operation on other values.
    #[must_use]
    pub fn map_operands(&self, map: impl FnMut(Value) -> Value) -> Op {
        let mut op = self.clone();
        op.replace_operands(map);
        op
    }

    /// Replaces every operand, in order.
    pub(super) fn replace_operands(&mut self, mut map: impl FnMut(Value) -> Value) {
        for_each_operand!(self, |v: &mut Value| *v = map(*v));
    }

    /// Whether it is a constant.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        matches!(self, Op::Real(_) | Op::Int(_) | Op::Bool(_))
    }

    /// Whether it runs functions and so has several results, which [`Op::Project`] takes apart.
    #[must_use]
    pub fn is_structured(&self) -> bool {
        matches!(self, Op::If { .. } | Op::Loop { .. } | Op::Call { .. } | Op::Tangent { .. })
    }

    /// The functions that it names.
    #[must_use]
    pub fn functions(&self) -> Vec<FunctionId> {
        match self {
            Op::If { then, otherwise, .. } => vec![*then, *otherwise],
            Op::Loop { body, .. } => vec![*body],
            Op::Call { function, .. } | Op::Tangent { function, .. } => vec![*function],
            _ => Vec::new(),
        }
    }

    /// Replaces every function that it names.
    pub(super) fn replace_functions(&mut self, map: impl Fn(FunctionId) -> FunctionId) {
        match self {
            Op::If { then, otherwise, .. } => (*then, *otherwise) = (map(*then), map(*otherwise)),
            Op::Loop { body: f, .. } | Op::Call { function: f, .. } | Op::Tangent { function: f, .. } => *f = map(*f),
            _ => {}
        }
    }
}

impl Function {
    /// The operation that makes a value.
    #[must_use]
    pub fn op(&self, value: Value) -> &Op {
        &self.nodes[value.0 as usize].op
    }

    /// The type of a value.
    #[must_use]
    pub fn ty(&self, value: Value) -> Type {
        self.nodes[value.0 as usize].ty
    }

    /// The types of the results.
    #[must_use]
    pub fn result_types(&self) -> Vec<Type> {
        self.results.iter().map(|r| self.ty(*r)).collect()
    }

    /// Values in order.
    pub fn values(&self) -> impl DoubleEndedIterator<Item = Value> + use<> {
        (0..self.nodes.len() as u32).map(Value)
    }
}

impl Parameter {
    /// A parameter of type Real.
    pub fn real(name: impl Into<String>) -> Parameter {
        Parameter { name: name.into(), ty: Type::Real }
    }

    /// A parameter of any type.
    pub fn new(name: impl Into<String>, ty: Type) -> Parameter {
        Parameter { name: name.into(), ty }
    }
}

impl Module {
    /// Adds a function.
    pub fn add(&mut self, function: Function) -> FunctionId {
        self.functions.push(function);
        FunctionId(u32::try_from(self.functions.len() - 1).expect("fewer than 2^32 functions"))
    }

    /// An id for a function that is still to be made (a recursive one must name itself); put it there by
    /// [`Module::define`].
    pub fn reserve(&mut self) -> FunctionId {
        self.add(Function::default())
    }

    /// Puts a function in the place of its id.
    pub fn define(&mut self, id: FunctionId, function: Function) {
        self.functions[id.0 as usize] = function;
    }

    /// The function of an id of this module.
    #[must_use]
    pub fn function(&self, id: FunctionId) -> &Function {
        &self.functions[id.0 as usize]
    }

    /// Adds a failure that an [`Op::Guard`] can report.
    pub fn fail(&mut self, failure: Failure) -> FailureId {
        self.failures.push(failure);
        FailureId(u32::try_from(self.failures.len() - 1).expect("fewer than 2^32 failures"))
    }
}
