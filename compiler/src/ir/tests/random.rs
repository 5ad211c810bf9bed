//! Random functions made from bytes, so that shrinking the bytes shrinks the function. Values stay moderate and
//! derivatives exist almost everywhere: poles are kept away from (`a / (1 + b^2)`), growth is tamed by sines.

use crate::ir::*;

/// A source of choices; zero when it is used up.
pub(crate) struct Choices<'a>(pub(crate) &'a [u8]);

impl Choices<'_> {
    fn below(&mut self, n: usize) -> usize {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first as usize % n
    }

    fn more(&self) -> bool {
        !self.0.is_empty()
    }
}

/// A function `(n: Int, params reals) -> results reals`, with all that it calls, in a module.
pub(crate) fn random_function(bytes: &[u8], params: usize, results: usize) -> (Module, FunctionId) {
    let mut random = Random { module: Module::default(), choices: Choices(bytes) };
    random.module.fail(Failure { span: Default::default(), message: "never".to_owned() });
    let id = random.function("f", params, results, 3, 24);
    (random.module, id)
}

struct Random<'a> {
    module: Module,
    choices: Choices<'a>,
}

impl Random<'_> {
    /// `depth` bounds the nesting, `steps` the operations.
    fn function(&mut self, name: &str, params: usize, results: usize, depth: usize, steps: usize) -> FunctionId {
        let mut all = vec![Parameter::new("n", Type::Int)];
        all.extend((0..params).map(|i| Parameter::real(format!("x{i}"))));
        let mut b = FunctionBuilder::new(name, all);
        let mut values = b.params()[1..].to_vec();
        for _ in 0..1 + self.choices.below(steps) {
            if !self.choices.more() {
                break;
            }
            let new = if depth > 0 && self.choices.below(4) == 0 {
                self.structured(&mut b, &values, depth - 1)
            } else {
                vec![self.simple(&mut b, &values)]
            };
            values.extend(new);
        }
        let results: Vec<Value> = (0..results).map(|k| values[values.len() - 1 - k % values.len()]).collect();
        let named: Vec<_> = results.into_iter().enumerate().map(|(k, v)| (format!("r{k}"), v)).collect();
        self.module.add(b.finish(named))
    }

    fn pick(&mut self, values: &[Value]) -> Value {
        // Recent values more often, so that functions get deep.
        let back = self.choices.below(values.len()).min(self.choices.below(values.len()));
        values[values.len() - 1 - back]
    }

    fn picks(&mut self, values: &[Value], count: usize) -> Vec<Value> {
        (0..count).map(|_| self.pick(values)).collect()
    }

    fn structured(&mut self, b: &mut FunctionBuilder, values: &[Value], depth: usize) -> Vec<Value> {
        let n = b.param(0);
        let width = 1 + self.choices.below(3);
        let results = 1 + self.choices.below(2);
        let args = self.picks(values, width);
        let all = [&[n], &args[..]].concat();
        match self.choices.below(4) {
            0 => {
                let f = self.function("called", width, results, depth, 6);
                b.call(f, all, &vec![Type::Real; results])
            }
            1 => {
                let condition = self.condition(b, values);
                let then = self.function("then", width, results, depth, 6);
                let otherwise = self.function("otherwise", width, results, depth, 6);
                b.if_(condition, then, otherwise, all, &vec![Type::Real; results])
            }
            2 => {
                let fixed = self.choices.below(width + 1).min(width - 1);
                let carried = width - fixed;
                let body = self.function("body", width, carried, depth, 8);
                let body = self.tamed(body, carried);
                let count = if self.choices.below(2) == 0 { n } else { b.int(self.choices.below(5) as i64) };
                b.loop_(count, body, args[..carried].to_vec(), args[carried..].to_vec())
            }
            _ => {
                let f = self.recursive(width, depth);
                b.call(f, all, &vec![Type::Real; width])
            }
        }
    }

    /// `f(n, x..) = if n <= 0 { x } else { f(n - 1, step(x)) }`.
    fn recursive(&mut self, width: usize, depth: usize) -> FunctionId {
        let step = self.function("step", width, width, depth, 5);
        let step = self.tamed(step, width);
        let itself = self.module.reserve();
        let types = vec![Type::Real; width];
        let mut params = vec![Parameter::new("n", Type::Int)];
        params.extend((0..width).map(|i| Parameter::real(format!("x{i}"))));
        let name = |values: Vec<Value>| values.into_iter().enumerate().map(|(k, v)| (format!("r{k}"), v));
        let mut b = FunctionBuilder::new("base", params.clone());
        let xs = b.params()[1..].to_vec();
        let base = if self.choices.below(2) == 0 { xs } else { xs.iter().map(|x| b.neg(*x)).collect() };
        let base = self.module.add(b.finish(name(base)));
        let mut b = FunctionBuilder::new("again", params.clone());
        let one = b.int(1);
        let less = b.sub(b.param(0), one);
        let stepped = b.call(step, b.params(), &types);
        let results = b.call(itself, [&[less], &stepped[..]].concat(), &types);
        let again = self.module.add(b.finish(name(results)));
        let mut b = FunctionBuilder::new("recursive", params);
        let zero = b.int(0);
        let last = b.compare(Compare::Le, b.param(0), zero);
        let results = b.if_(last, base, again, b.params(), &types);
        self.module.define(itself, b.finish(name(results)));
        itself
    }

    /// The function with its results in -1..1, so that repeating it does not blow up.
    fn tamed(&mut self, f: FunctionId, results: usize) -> FunctionId {
        let old = self.module.function(f).clone();
        let mut b = FunctionBuilder::new(old.name.clone(), old.params.clone());
        let values = b.call(f, b.params(), &vec![Type::Real; results]);
        let values: Vec<Value> = values.into_iter().map(|v| b.unary(Unary::Sin, v)).collect();
        self.module.add(b.finish(old.result_names.into_iter().zip(values)))
    }

    fn condition(&mut self, b: &mut FunctionBuilder, values: &[Value]) -> Value {
        let (x, y) = (self.pick(values), self.pick(values));
        let op = [Compare::Lt, Compare::Le, Compare::Gt, Compare::Ge, Compare::Eq, Compare::Ne];
        let op = op[self.choices.below(6)];
        let c = b.compare(op, x, y);
        let (n, two) = (b.param(0), b.int(2));
        match self.choices.below(6) {
            0 => b.unary(Unary::Not, c),
            1 => {
                let d = b.compare(op, n, two);
                b.binary(Binary::And, c, d)
            }
            2 => {
                let d = b.compare(op, n, two);
                b.binary(Binary::Or, d, c)
            }
            _ => c,
        }
    }

    fn simple(&mut self, b: &mut FunctionBuilder, values: &[Value]) -> Value {
        let (x, y) = (self.pick(values), self.pick(values));
        match self.choices.below(30) {
            0..=11 => self.smooth(b, x, y),
            12 => {
                let constants = [0.0, 1.0, -1.0, 2.0, 0.5, -3.0, 0.1];
                b.real(constants[self.choices.below(7)])
            }
            13 => {
                let (s, n) = (b.unary(Unary::Sin, x), self.choices.below(6) as i32 - 2);
                let c = b.real(1.5);
                let positive = b.add(s, c);
                b.pow_int(if n < 1 { positive } else { s }, n)
            }
            14 | 15 => {
                let (base, exponent) = (above_one(b, x), b.unary(Unary::Sin, y));
                b.pow(base, exponent)
            }
            16 => {
                let positive = above_one(b, y);
                b.binary(Binary::Atan2, x, positive)
            }
            17 => {
                let positive = above_one(b, x);
                b.binary(Binary::Atan2, y, positive)
            }
            18 => b.binary(Binary::Min, x, y),
            19 => b.binary(Binary::Max, x, y),
            20 => {
                let positive = above_one(b, y);
                b.binary(Binary::Rem, x, positive)
            }
            21 | 22 => {
                let c = self.condition(b, values);
                b.select(c, x, y)
            }
            23 => {
                let s = b.unary(Unary::Cos, y);
                b.binary(Binary::MulOrZero, x, s)
            }
            24 => {
                let positive = above_one(b, y);
                b.binary(Binary::DivOrZero, x, positive)
            }
            25 => {
                let square = b.mul(y, y);
                let minus_one = b.real(-1.0);
                let condition = b.compare(Compare::Le, minus_one, square);
                b.guard(x, condition, FailureId(0))
            }
            26 => {
                // Not stop, whose derivative differs from the differences.
                let steps = [Unary::Floor, Unary::Ceil, Unary::Round, Unary::Sign];
                let step = b.unary(steps[self.choices.below(4)], x);
                b.add(step, y)
            }
            27 => {
                let (i, n) = (b.unary(Unary::ToInt, x), b.param(0));
                let ops = [Binary::Add, Binary::Sub, Binary::Mul, Binary::Div, Binary::Rem, Binary::Min, Binary::Max];
                let j = b.binary(ops[self.choices.below(7)], n, i);
                let real = b.unary(Unary::ToReal, j);
                let tame = b.unary(Unary::Sin, real);
                b.mul(tame, y)
            }
            _ => {
                let op = [Binary::Add, Binary::Sub, Binary::Mul][self.choices.below(3)];
                let r = b.binary(op, x, y);
                // Products of products would grow without bound.
                if op == Binary::Mul { b.unary(Unary::Sin, r) } else { r }
            }
        }
    }

    fn smooth(&mut self, b: &mut FunctionBuilder, x: Value, y: Value) -> Value {
        let (s, most) = (b.unary(Unary::Sin, x), b.real(0.9));
        let inside = b.mul(most, s);
        match self.choices.below(16) {
            0 => b.neg(x),
            1 => b.unary(Unary::Abs, x),
            2 => {
                let positive = above_one(b, x);
                b.unary(Unary::Sqrt, positive)
            }
            3 => b.unary(Unary::Exp, s),
            4 => {
                let positive = above_one(b, x);
                b.unary(Unary::Ln, positive)
            }
            5 => s,
            6 => b.unary(Unary::Cos, x),
            7 => b.unary(Unary::Tan, inside),
            8 => b.unary(Unary::Asin, inside),
            9 => b.unary(Unary::Acos, inside),
            10 => b.unary(Unary::Atan, x),
            11 => b.unary(Unary::Sinh, s),
            12 => b.unary(Unary::Cosh, s),
            13 => b.unary(Unary::Tanh, x),
            14 => {
                let positive = above_one(b, y);
                b.div(x, positive)
            }
            _ => {
                let positive = above_one(b, y);
                b.div(s, positive)
            }
        }
    }
}

/// 1 + x^2.
fn above_one(b: &mut FunctionBuilder, x: Value) -> Value {
    let (one, square) = (b.real(1.0), b.mul(x, x));
    b.add(one, square)
}
