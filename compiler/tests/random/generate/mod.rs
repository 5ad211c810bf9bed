//! Random well-typed scripts. The text is made from bytes, so that fewer and smaller bytes make a smaller script.
//!
//! Values stay moderate: parameters are near 1, denominators are away from 0, repeated operations do not grow.
//! Therefore every script is smooth at almost all parameters, and finite differences show whether its derivatives are
//! right.

mod expressions;

/// The types of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ty {
    Real,
    Length,
    Angle,
    /// A whole number that is known when the script is compiled.
    Int,
    Point,
    /// `[real]` with three elements.
    Reals,
    /// `{a: real, b: length}`.
    Record,
    /// `real -> real`.
    Function,
    /// `(real, real) -> point3`.
    Surface,
}

/// A function of the script: its name, and how it is called.
#[derive(Clone, Debug)]
struct Callee {
    name: String,
    params: Vec<Ty>,
    result: Ty,
}

/// The script of some bytes. Without any bytes it is the smallest script.
pub(crate) fn script(bytes: &[u8]) -> String {
    let mut generator =
        Generator { bytes, at: 0, fuel: 90, names: 0, primes: 0, scope: Vec::new(), functions: Vec::new() };
    generator.script()
}

struct Generator<'b> {
    bytes: &'b [u8],
    at: usize,
    /// Number of expressions that may still be made.
    fuel: usize,
    names: usize,
    /// Number of derivatives around the present expression: each makes it several times as large.
    primes: usize,
    scope: Vec<(String, Ty)>,
    functions: Vec<Callee>,
}

impl Generator<'_> {
    /// A number below n; 0 when the bytes are used up.
    fn below(&mut self, n: usize) -> usize {
        let byte = self.bytes.get(self.at).copied().unwrap_or(0);
        self.at += 1;
        usize::from(byte) % n
    }

    fn fresh(&mut self, start: &str) -> String {
        self.names += 1;
        format!("{start}{}", self.names)
    }

    /// A name in scope of that type, later ones more often.
    fn named(&mut self, ty: Ty) -> Option<String> {
        let names: Vec<String> = self.scope.iter().filter(|(_, t)| *t == ty).map(|(n, _)| n.clone()).collect();
        if names.is_empty() {
            return None;
        }
        let back = self.below(names.len()).min(self.below(names.len()));
        Some(names[names.len() - 1 - back].clone())
    }

    /// Runs a generator with more names in scope.
    fn within<T>(&mut self, names: &[(&str, Ty)], make: impl FnOnce(&mut Self) -> T) -> T {
        let mark = self.scope.len();
        self.scope.extend(names.iter().map(|(n, t)| ((*n).to_owned(), *t)));
        let made = make(self);
        self.scope.truncate(mark);
        made
    }

    fn script(&mut self) -> String {
        let mut text = String::new();
        for _ in 0..self.below(5) {
            text += &self.function();
        }
        let part_model = self.below(6) == 1;
        if part_model {
            text += "model piece {\n  param w: length in 1mm..9mm = 3mm\n  param k: real = 0.5\n";
            let names = [("w", Ty::Length), ("k", Ty::Real)];
            let surface = self.within(&names, |g| g.surface(2));
            text += &format!("  part side = {surface}\n}}\n");
        }
        text += "model m {\n";
        text += &self.model(part_model);
        text + "}\n"
    }

    fn model(&mut self, with_piece: bool) -> String {
        let mut text = String::new();
        for i in 0..1 + self.below(4) {
            let value = [0.75, -0.5, 1.25, 0.3][self.below(4)];
            let (name, line, ty) = match self.below(3) {
                0 => (format!("a{i}"), format!("real in -3..3 = {value}"), Ty::Real),
                1 => (format!("l{i}"), format!("length in 0mm..9mm = {}mm", value + 2.0), Ty::Length),
                _ => (format!("t{i}"), format!("angle in -2rad..2rad = {value}rad"), Ty::Angle),
            };
            text += &format!("  param {name}: {line}\n");
            self.scope.push((name, ty));
        }
        if self.below(3) == 1 {
            text += "  input n: int in 0..4 = 2\n";
            self.scope.push(("n".to_owned(), Ty::Int));
        }
        for _ in 0..self.below(4) {
            let ty = [Ty::Real, Ty::Length, Ty::Angle, Ty::Point, Ty::Reals, Ty::Record, Ty::Function, Ty::Surface]
                [self.below(8)];
            let (value, name) = (self.of(ty, 3), self.fresh("x"));
            text += &format!("  let {name} = {value}\n");
            self.scope.push((name, ty));
        }
        if self.below(4) == 1 {
            text += "  require 1 < 2, \"it holds\"\n";
        }
        match self.below(6) {
            1 => {
                let body = self.within(&[("i", Ty::Int)], |g| g.surface(3));
                text += &format!("  for i in 0..2 {{ part p = {body} }}\n");
            }
            2 if with_piece => {
                let (width, by) = (self.length(1), self.point(1));
                text += &format!("  part p = piece(w: 5mm + 4mm * tanh(({width}) / 1mm)).translate({by})\n");
            }
            3 => {
                let (first, second) = (self.surface(2), self.surface(2));
                text += &format!("  part p = {{inner: {first}, outer: {second}}}\n");
            }
            _ => {
                let surface = self.surface(4);
                text += &format!("  part p = {surface}\n");
            }
        }
        text
    }

    /// A function at the top of the file.
    fn function(&mut self) -> String {
        let name = self.fresh("f");
        let (params, result, text) = match self.below(9) {
            0 => {
                let body = self.within(&[("x", Ty::Real), ("y", Ty::Length)], |g| g.real(3));
                (vec![Ty::Real, Ty::Length], Ty::Real, format!("fn {name}(x: real, y: length) -> real = {body}"))
            }
            1 => {
                let body = self.within(&[("x", Ty::Real), ("y", Ty::Real)], |g| g.real(3));
                (vec![Ty::Real, Ty::Real], Ty::Real, format!("fn {name}(x, y = 0.5) = {body}"))
            }
            2 => {
                let body = self.within(&[("g", Ty::Function), ("x", Ty::Real)], |g| g.real(2));
                (vec![Ty::Function, Ty::Real], Ty::Real, format!("fn {name}(g, x) = g(x) + {body}"))
            }
            3 => {
                let body = self.within(&[("k", Ty::Real), ("t", Ty::Real)], |g| g.real(3));
                (vec![Ty::Real], Ty::Function, format!("fn {name}(k) = |t| {body}"))
            }
            4 => {
                let end = self.within(&[("x", Ty::Real)], |g| g.real(2));
                let text = format!(
                    "fn {name}(x: real, n: int) -> real = if n < 1 {{ {end} }} else {{ 0.5 * {name}(0.9 * x + 0.1, n - 1) }}"
                );
                (vec![Ty::Real, Ty::Int], Ty::Real, text)
            }
            5 => {
                let end = self.within(&[("x", Ty::Real)], |g| g.real(2));
                let text = format!(
                    "fn {name}(x: real) -> real = if x < 0.4 {{ {end} }} else {{ 0.3 + 0.5 * {name}(0.5 * x) }}"
                );
                (vec![Ty::Real], Ty::Real, text)
            }
            6 => {
                let text = match self.below(2) {
                    0 => format!("fn {name}(x) = sin(1rad * x)\nderiv {name}(x; dx) = cos(1rad * x) * dx"),
                    _ => format!(
                        "fn {name}(x: real) -> real = exp(-x ^ 2)\nderiv {name}(x; dx) {{ let y = {name}(x); -2 * x * y * dx }}"
                    ),
                };
                (vec![Ty::Real], Ty::Real, text)
            }
            7 => {
                let body = self.within(&[("xs", Ty::Reals), ("r", Ty::Record)], |g| g.length(3));
                (
                    vec![Ty::Reals, Ty::Record],
                    Ty::Length,
                    format!("fn {name}(xs, r) -> length {{\n  let y = 1mm\n  y + {body}\n}}"),
                )
            }
            _ => {
                let names = [("k", Ty::Length), ("u", Ty::Real), ("v", Ty::Real)];
                let body = self.within(&names, |g| g.point(2));
                (vec![Ty::Length], Ty::Surface, format!("fn {name}(k: length) = |u, v| {body}"))
            }
        };
        self.functions.push(Callee { name, params, result });
        text + "\n"
    }
}
