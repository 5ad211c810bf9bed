//! Rebuilding a function node by node: the frame of every pass.

use super::FunctionBuilder;
use crate::ir::{Function, Node, Op, Parameter, Value};

/// The values that a node of a rebuilt function has become.
#[derive(Clone, Debug)]
pub(crate) enum Image {
    /// One value; a structured node may stay structured.
    One(Value),
    /// The results of a structured node that was replaced by others.
    Many(Vec<Value>),
}

/// A function on its way through a [`FunctionBuilder`]: a pass takes one node after the other, with its operands mapped
/// to the builder's values, and says what becomes of it.
pub(crate) struct Rebuild<'f> {
    function: &'f Function,
    args: &'f [Value],
    images: Vec<Image>,
}

/// A node whose turn it is.
pub(crate) struct Step<'f> {
    pub(crate) index: Value,
    pub(crate) node: &'f Node,
    /// Its operation on values of the builder.
    pub(crate) op: Op,
}

impl<'f> Rebuild<'f> {
    /// Starts with the values of the builder that stand for the function's parameters.
    pub(crate) fn new(function: &'f Function, args: &'f [Value]) -> Rebuild<'f> {
        Rebuild { function, args, images: Vec::with_capacity(function.nodes.len()) }
    }

    /// The next node that is neither a parameter nor a result of a replaced node; the builder gets its span. The caller
    /// must [`push`](Rebuild::push) its image.
    pub(crate) fn next(&mut self, builder: &mut FunctionBuilder) -> Option<Step<'f>> {
        loop {
            let index = Value(self.images.len() as u32);
            let node = self.function.nodes.get(self.images.len())?;
            let known = match node.op {
                Op::Param(i) => Some(self.args[i as usize]),
                Op::Project(multi, k) => match &self.images[multi.0 as usize] {
                    Image::Many(results) => Some(results[k as usize]),
                    Image::One(_) => None,
                },
                _ => None,
            };
            let Some(value) = known else {
                builder.set_span(node.span);
                return Some(Step { index, node, op: node.op.map_operands(|v| self.value(v)) });
            };
            self.images.push(Image::One(value));
        }
    }

    /// Says what the node that [`next`](Rebuild::next) gave has become.
    pub(crate) fn push(&mut self, image: Image) {
        self.images.push(image);
    }

    /// The value that a node has become; only projections use one that was replaced by several.
    pub(crate) fn value(&self, node: Value) -> Value {
        match &self.images[node.0 as usize] {
            Image::One(value) => *value,
            Image::Many(_) => Value::NONE,
        }
    }

    /// The values that the function's results have become.
    pub(crate) fn results(&self) -> Vec<Value> {
        self.function.results.iter().map(|r| self.value(*r)).collect()
    }
}

impl FunctionBuilder {
    /// Puts the nodes of a function here, in the place of a call of it; returns its results.
    pub fn splice(&mut self, function: &Function, args: &[Value]) -> Vec<Value> {
        self.splice_nodes(function, args).results()
    }

    /// [`splice`](FunctionBuilder::splice), with the values of all nodes.
    pub(crate) fn splice_nodes<'f>(&mut self, function: &'f Function, args: &'f [Value]) -> Rebuild<'f> {
        let mut rebuild = Rebuild::new(function, args);
        while let Some(Step { node, op, .. }) = rebuild.next(self) {
            rebuild.push(Image::One(self.emit(&op, node.ty)));
        }
        rebuild
    }
}

impl Function {
    /// The function with other parameters. `args` are the values of the old ones; `replace` gives the values of the
    /// nodes that become something else, in terms of the new parameters.
    pub(crate) fn with_params(
        &self,
        params: Vec<Parameter>,
        args: &[Value],
        mut replace: impl FnMut(&mut FunctionBuilder, Value) -> Option<Value>,
    ) -> Function {
        let mut builder = FunctionBuilder::new(self.name.clone(), params);
        let mut rebuild = Rebuild::new(self, args);
        while let Some(Step { index, node, op }) = rebuild.next(&mut builder) {
            let value = replace(&mut builder, index).unwrap_or_else(|| builder.emit(&op, node.ty));
            rebuild.push(Image::One(value));
        }
        builder.finish_like(self, rebuild.results())
    }
}
