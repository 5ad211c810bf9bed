//! What an operation uses: values, functions; and the tables of a module.

use super::{Failure, FailureId, Function, FunctionId, Module, Op, Parameter, Type, Value};

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
        match self {
            Op::Param(_) | Op::Real(_) | Op::Int(_) | Op::Bool(_) => {}
            Op::Unary(_, a) | Op::PowInt(a, _) | Op::Project(a, _) => f(*a),
            Op::Binary(_, a, b) | Op::Compare(_, a, b) => [a, b].into_iter().for_each(|v| f(*v)),
            Op::Select(c, a, b) => [c, a, b].into_iter().for_each(|v| f(*v)),
            Op::If { condition, args, .. } => std::iter::once(condition).chain(args).for_each(|v| f(*v)),
            Op::Loop { count, init, invariant, .. } => {
                std::iter::once(count).chain(init).chain(invariant).for_each(|v| f(*v));
            }
            Op::Call { args, .. } => args.iter().for_each(|v| f(*v)),
            Op::Tangent { args, seeds, .. } => {
                args.iter().chain(seeds.iter().map(|(_, v)| v)).for_each(|v| f(*v));
            }
            Op::Guard { value, condition, .. } => [value, condition].into_iter().for_each(|v| f(*v)),
        }
    }

    /// The same operation on other values.
    #[must_use]
    pub fn map_operands(&self, mut map: impl FnMut(Value) -> Value) -> Op {
        let mut op = self.clone();
        op.for_each_operand(|v| *v = map(*v));
        op
    }

    /// Hands every operand to `f`, in order, to be replaced.
    pub(super) fn for_each_operand(&mut self, mut f: impl FnMut(&mut Value)) {
        match self {
            Op::Param(_) | Op::Real(_) | Op::Int(_) | Op::Bool(_) => {}
            Op::Unary(_, a) | Op::PowInt(a, _) | Op::Project(a, _) => f(a),
            Op::Binary(_, a, b) | Op::Compare(_, a, b) => {
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
                args.iter_mut().for_each(f);
            }
            Op::Loop { count, init, invariant, .. } => {
                f(count);
                init.iter_mut().chain(invariant).for_each(f);
            }
            Op::Call { args, .. } => args.iter_mut().for_each(f),
            Op::Tangent { args, seeds, .. } => {
                args.iter_mut().for_each(&mut f);
                seeds.iter_mut().for_each(|(_, v)| f(v));
            }
            Op::Guard { value, condition, .. } => {
                f(value);
                f(condition);
            }
        }
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

    /// The same operation naming other functions.
    #[must_use]
    pub fn map_functions(&self, mut map: impl FnMut(FunctionId) -> FunctionId) -> Op {
        let mut op = self.clone();
        match &mut op {
            Op::If { then, otherwise, .. } => {
                *then = map(*then);
                *otherwise = map(*otherwise);
            }
            Op::Loop { body: f, .. } | Op::Call { function: f, .. } | Op::Tangent { function: f, .. } => *f = map(*f),
            _ => {}
        }
        op
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

    /// Adds a failure for [`Op::Guard`] to report.
    pub fn fail(&mut self, failure: Failure) -> FailureId {
        self.failures.push(failure);
        FailureId(u32::try_from(self.failures.len() - 1).expect("fewer than 2^32 failures"))
    }
}
