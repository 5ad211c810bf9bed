//! Functions as text that reads like the language.

use super::expression::{self, Text};
use crate::ir::{Binary, Function, FunctionId, Module, Op, Type, Value};
use std::collections::BTreeSet;

/// An expression longer than this gets a name, even if it is used once.
const LONGEST_EXPRESSION: usize = 90;

/// A function as text that reads like the language: a value that is used more than once is named by `let`, any other
/// stands at the place of its use; branches are `if`, loops are `fold`. Functions that it calls by name (recursive
/// ones) follow it.
///
/// The text is exact with two exceptions: products and quotients are written in the order in which people write them;
/// and those that are zero where their first operand is, even at a pole, are written with the ordinary signs, which a
/// remark then mentions.
#[must_use]
pub(crate) fn gml(module: &Module, function: FunctionId) -> String {
    let mut text = String::new();
    let mut shown = BTreeSet::new();
    let mut left = vec![function];
    let mut or_zero = false;
    while let Some(id) = left.pop() {
        if !shown.insert(id) {
            continue;
        }
        let function = module.function(id);
        let mut printer = Printer { module, taken: BTreeSet::new(), names: 0, called: Vec::new(), or_zero: false };
        if !text.is_empty() {
            text.push('\n');
        }
        printer.function(function, &mut text);
        or_zero |= printer.or_zero;
        left.extend(printer.called);
    }
    if or_zero {
        let remark =
            "// Where the first factor or the numerator of a derivative is 0, so is the product or quotient.\n";
        text.insert_str(0, remark);
    }
    text
}

struct Printer<'m> {
    module: &'m Module,
    taken: BTreeSet<String>,
    names: usize,
    called: Vec<FunctionId>,
    or_zero: bool,
}

/// The text of a node.
enum Written {
    One(Text),
    Many(Vec<Text>),
}

impl Printer<'_> {
    fn function(&mut self, function: &Function, text: &mut String) {
        self.taken.extend(function.params.iter().map(|p| p.name.clone()));
        let params: Vec<String> = function.params.iter().map(|p| format!("{}: {}", p.name, p.ty)).collect();
        let args: Vec<Text> = function.params.iter().map(|p| Text::atom(&p.name)).collect();
        let (lines, results) = self.body(function, &args);
        let types: Vec<String> = function.result_types().iter().map(Type::to_string).collect();
        let types = if types.len() == 1 { types[0].clone() } else { format!("({})", types.join(", ")) };
        text.push_str(&format!("fn {}({}) -> {types}", function.name, params.join(", ")));
        if let ([], [result]) = (&lines[..], &results[..]) {
            text.push_str(&format!(" = {}\n", result.text));
            return;
        }
        text.push_str(" {\n");
        for line in lines {
            text.push_str(&format!("  {line}\n"));
        }
        match &results[..] {
            [result] => text.push_str(&format!("  {}\n", result.text)),
            results => {
                text.push_str("  (\n");
                for (name, result) in function.result_names.iter().zip(results) {
                    text.push_str(&format!("    {name}: {},\n", result.text));
                }
                text.push_str("  )\n");
            }
        }
        text.push_str("}\n");
    }

    /// The lines of a function's body and its results, for these arguments.
    fn body(&mut self, function: &Function, args: &[Text]) -> (Vec<String>, Vec<Text>) {
        let uses = count_uses(function);
        let mut lines = Vec::new();
        let mut written: Vec<Written> = Vec::with_capacity(function.nodes.len());
        for (i, node) in function.nodes.iter().enumerate() {
            if node.op.is_structured() {
                let many = self.structured(function, &node.op, &written, &mut lines);
                written.push(Written::Many(many));
                continue;
            }
            let text = self.simple(&node.op, &written, args);
            let trivial = node.op.is_constant() || matches!(node.op, Op::Param(_) | Op::Project(..));
            let named = !trivial && (uses[i] > 1 || text.text.chars().count() > LONGEST_EXPRESSION);
            written.push(Written::One(if named {
                let name = self.name();
                lines.push(format!("let {name} = {}", text.text));
                Text::atom(name)
            } else {
                text
            }));
        }
        let results = function.results.iter().map(|r| one(&written, *r).clone()).collect();
        (lines, results)
    }

    fn simple(&mut self, op: &Op, written: &[Written], args: &[Text]) -> Text {
        let get = |v: &Value| one(written, *v);
        match op {
            Op::Param(i) => args[*i as usize].clone(),
            Op::Real(bits) => expression::number(f64::from_bits(*bits)),
            Op::Int(i) => expression::number(*i as f64),
            Op::Bool(b) => Text::atom(b.to_string()),
            Op::Unary(op, a) => expression::unary(*op, get(a)),
            Op::Binary(op, a, b) => {
                self.or_zero |= matches!(op, Binary::MulOrZero | Binary::DivOrZero);
                expression::binary(*op, get(a), get(b))
            }
            Op::PowInt(a, n) => {
                let power = expression::power(get(a), &expression::number(f64::from(n.unsigned_abs())));
                if *n < 0 { expression::binary(Binary::Div, &expression::number(1.0), &power) } else { power }
            }
            Op::Compare(op, a, b) => expression::compare(*op, get(a), get(b)),
            Op::Select(c, a, b) => expression::select(get(c), get(a), get(b)),
            Op::Guard { value, condition, .. } => expression::call("guard", &[get(value), get(condition)]),
            Op::Project(multi, k) => match &written[multi.0 as usize] {
                Written::Many(results) => results[*k as usize].clone(),
                Written::One(text) => text.clone(),
            },
            Op::If { .. } | Op::Loop { .. } | Op::Call { .. } | Op::Tangent { .. } => Text::atom("..."),
        }
    }

    /// Writes a structured operation as a `let`; the names of its results.
    fn structured(&mut self, function: &Function, op: &Op, written: &[Written], lines: &mut Vec<String>) -> Vec<Text> {
        let get = |v: &Value| one(written, *v).clone();
        let all = |vs: &[Value]| vs.iter().map(get).collect::<Vec<_>>();
        let module = self.module;
        match op {
            Op::If { condition, then, otherwise, args } => {
                let (then, otherwise) = (module.function(*then), module.function(*otherwise));
                let (args, condition) = (all(args), get(condition));
                let (a, b) = (self.block(then, &args), self.block(otherwise, &args));
                let names = self.names(then.results.len());
                lines.push(format!("let {} = if {} {{", tuple(&names), condition.text));
                lines.extend(a);
                lines.push("} else {".to_owned());
                lines.extend(b);
                lines.push("}".to_owned());
                names
            }
            Op::Loop { count, body, init, invariant } => {
                let (inner, index) = (self.names(init.len()), self.name());
                let args = [vec![Text::atom(&index)], inner.clone(), all(invariant)].concat();
                let block = self.block(module.function(*body), &args);
                let names = self.names(init.len());
                let (start, carried) = (tuple(&all(init)), tuple(&inner));
                let count = get(count).text;
                lines.push(format!("let {} = fold({start}, 0..{count}, |{carried}, {index}| {{", tuple(&names)));
                lines.extend(block);
                lines.push("})".to_owned());
                names
            }
            Op::Call { function: callee, args } => {
                self.called.push(*callee);
                let callee = module.function(*callee);
                let names = self.names(callee.results.len());
                let args = all(args);
                let call = expression::call(&callee.name, &args.iter().collect::<Vec<_>>());
                lines.push(format!("let {} = {}", tuple(&names), call.text));
                names
            }
            Op::Tangent { function: callee, args, seeds } => {
                self.called.push(*callee);
                let callee = module.function(*callee);
                let names = self.names(callee.results.len());
                let seeds =
                    seeds.iter().map(|(i, v)| format!("d{} = {}", callee.params[*i as usize].name, get(v).text));
                let args = all(args).into_iter().map(|a| a.text).chain(seeds).collect::<Vec<_>>();
                lines.push(format!("let {} = {}'({})", tuple(&names), callee.name, args.join(", ")));
                names
            }
            _ => vec![Text::atom("..."); function.results.len()],
        }
    }

    /// A body as indented lines that end with its results.
    fn block(&mut self, function: &Function, args: &[Text]) -> Vec<String> {
        let (mut lines, results) = self.body(function, args);
        lines.push(tuple(&results));
        lines.into_iter().map(|line| format!("  {line}")).collect()
    }

    fn names(&mut self, count: usize) -> Vec<Text> {
        (0..count).map(|_| Text::atom(self.name())).collect()
    }

    fn name(&mut self) -> String {
        loop {
            self.names += 1;
            let name = format!("s{}", self.names);
            if self.taken.insert(name.clone()) {
                return name;
            }
        }
    }
}

fn one(written: &[Written], v: Value) -> &Text {
    match &written[v.0 as usize] {
        Written::One(text) => text,
        // Only projections use a structured node; they take the name.
        Written::Many(names) => &names[0],
    }
}

fn tuple(texts: &[Text]) -> String {
    match texts {
        [one] => one.text.clone(),
        several => format!("({})", several.iter().map(|t| t.text.as_str()).collect::<Vec<_>>().join(", ")),
    }
}

/// The number of times that the text of every node would be written.
fn count_uses(function: &Function) -> Vec<usize> {
    let mut uses = vec![0; function.nodes.len()];
    let mut count = |v: Value, times: usize| uses[v.0 as usize] += times;
    for node in &function.nodes {
        // An argument stands wherever the body uses it.
        let passed: &[Value] = match &node.op {
            Op::If { args, .. } => args,
            Op::Loop { invariant, .. } => invariant,
            _ => &[],
        };
        passed.iter().for_each(|v| count(*v, 1));
        node.op.visit_operands(|v| count(v, 1));
    }
    function.results.iter().for_each(|r| count(*r, 1));
    uses
}
