//! Random expressions of a type.

use super::{Callee, Generator, Ty};

impl Generator<'_> {
    pub(super) fn of(&mut self, ty: Ty, depth: usize) -> String {
        match ty {
            Ty::Real => self.real(depth),
            Ty::Length => self.length(depth),
            Ty::Angle => self.angle(depth),
            Ty::Int => match self.named(Ty::Int) {
                Some(name) if self.below(2) == 1 => name,
                _ => self.below(4).to_string(),
            },
            Ty::Point => self.point(depth),
            Ty::Reals => self.reals(depth),
            Ty::Record => self.record(depth),
            Ty::Function => self.lambda(depth),
            Ty::Surface => self.surface(depth),
        }
    }

    /// A call of a function of the script that gives this type, if there is one.
    pub(super) fn call(&mut self, result: Ty, depth: usize) -> Option<String> {
        let fitting: Vec<Callee> = self.functions.iter().filter(|f| f.result == result).cloned().collect();
        if fitting.is_empty() || depth == 0 {
            return None;
        }
        let callee = fitting[self.below(fitting.len())].clone();
        let args: Vec<String> = callee.params.iter().map(|ty| self.of(*ty, depth - 1)).collect();
        let (first, rest) = args.split_first()?;
        Some(if callee.params[0] != Ty::Function && self.below(4) == 1 {
            format!("({first}).{}({})", callee.name, rest.join(", "))
        } else {
            format!("{}({})", callee.name, args.join(", "))
        })
    }

    /// Whether no more large expressions may be made.
    pub(super) fn is_leaf(&mut self, depth: usize) -> bool {
        self.fuel = self.fuel.saturating_sub(1);
        depth == 0 || self.fuel == 0
    }

    pub(super) fn literal(&mut self) -> String {
        ["0.5", "2", "-0.75", "1.25", "0", "1", "0.1", "3"][self.below(8)].to_owned()
    }

    pub(super) fn real(&mut self, depth: usize) -> String {
        if self.is_leaf(depth) {
            return match self.named(Ty::Real) {
                Some(name) if self.below(3) != 1 => name,
                _ => self.literal(),
            };
        }
        let d = depth - 1;
        match self.below(26) {
            0 => self.named(Ty::Real).unwrap_or_else(|| "0.5".to_owned()),
            1 => format!("({} + {})", self.real(d), self.real(d)),
            2 => format!("({} - {})", self.real(d), self.real(d)),
            3 => format!("tanh({} * {})", self.real(d), self.real(d)),
            4 => format!("{} / (1.5 + {} ^ 2)", self.parenthesised(d), self.parenthesised(d)),
            5 => format!("{}({})", ["sin", "cos"][self.below(2)], self.angle(d)),
            6 => self.elementary(d),
            7 => self.power(d),
            8 => format!("{}({}, {})", ["min", "max"][self.below(2)], self.real(d), self.real(d)),
            9 => format!("abs({})", self.real(d)),
            10 => format!("({} / {})", self.length(d), ["2mm", "1cm", "0.25in"][self.below(3)]),
            11 => format!("(if {} {{ {} }} else {{ {} }})", self.condition(d), self.real(d), self.real(d)),
            12 => {
                let (value, name) = (self.real(d), self.fresh("y"));
                let body = self.within(&[(&name, Ty::Real)], |g| g.real(d));
                format!("{{ let {name} = {value}; {body} }}")
            }
            13 | 14 => self.call(Ty::Real, depth).unwrap_or_else(|| self.real(d)),
            15 => format!("({})({})", self.lambda(d), self.real(d)),
            16 | 17 => self.derivative(d),
            18 => self.fold(d),
            19 => {
                let body = self.within(&[("i", Ty::Int)], |g| g.real(d));
                format!("sum(for i in 0..{} {{ {body} }}) / 2", 1 + self.below(3))
            }
            20 => format!("{}[{}]", self.reals(d), self.below(3)),
            21 => format!("({}).a", self.record(d)),
            22 => format!("real({})", self.of(Ty::Int, 0)),
            23 => format!("(-{})", self.real(d)),
            24 => format!("({} / 1mm).x", self.point(d)),
            _ => format!("norm(({}, {}, 1.5))", self.real(d), self.real(d)),
        }
    }

    pub(super) fn parenthesised(&mut self, depth: usize) -> String {
        format!("({})", self.real(depth))
    }

    pub(super) fn elementary(&mut self, d: usize) -> String {
        let x = self.real(d);
        let sine = format!("sin(1rad * {x})");
        match self.below(9) {
            0 => format!("exp({sine})"),
            1 => format!("ln(1.5 + ({x}) ^ 2)"),
            2 => format!("sqrt(1.5 + ({x}) ^ 2)"),
            3 => format!("tan(0.7rad * {sine})"),
            4 => format!("(asin(0.9 * {sine}) / 1rad)"),
            5 => format!("(acos(0.9 * {sine}) / 2rad)"),
            6 => format!("sinh({sine})"),
            7 => format!("cosh({sine})"),
            _ => format!("tanh({x})"),
        }
    }

    pub(super) fn power(&mut self, d: usize) -> String {
        match self.below(4) {
            0 => format!("tanh({}) ^ {}", self.real(d), ["2", "3", "5"][self.below(3)]),
            1 => format!("(1.5 + {} ^ 2) ^ {}", self.parenthesised(d), ["0.5", "-1", "1.7", "-2"][self.below(4)]),
            2 => format!("(1.5 + {} ^ 2) ^ tanh({})", self.parenthesised(d), self.real(d)),
            _ => format!("({} % 2.5)", self.real(d)),
        }
    }

    /// A derivative of the language.
    pub(super) fn derivative(&mut self, d: usize) -> String {
        if self.primes == 2 {
            return self.real(d);
        }
        self.primes += 1;
        let text = match self.below(5) {
            0 => format!("({})'({})", self.lambda(d.min(2)), self.real(d)),
            1 => format!("tanh(({})''({}))", self.lambda(1), self.real(d)),
            2 => {
                let (body, by) = (self.within(&[("p", Ty::Real), ("q", Ty::Real)], |g| g.real(2)), self.below(2));
                format!("(|p, q| {body})'{}({}, {})", ["p", "q"][by], self.real(d), self.real(d))
            }
            3 => {
                let body = self.within(&[("p", Ty::Real), ("q", Ty::Real)], |g| g.real(1));
                format!("(|p, q| {body})'p'q({}, {})", self.real(d), self.real(d))
            }
            _ => match self.call(Ty::Function, d) {
                Some(call) => format!("{call}'({})", self.real(d)),
                None => format!("({})'({})", self.lambda(1), self.real(d)),
            },
        };
        self.primes -= 1;
        format!("tanh({text})")
    }

    pub(super) fn fold(&mut self, d: usize) -> String {
        let init = self.real(d);
        let turns = match self.below(5) {
            4 if self.scope.iter().any(|(name, _)| name == "n") => "n",
            k => ["3", "2", "100", "70", "5"][k],
        };
        let body = self.within(&[("s", Ty::Real), ("i", Ty::Int)], |g| g.real(d.min(2)));
        match self.below(4) {
            1 => {
                let xs = self.reals(d);
                format!("fold({init}, {xs}, |s, i| tanh(0.5 * s + i + {}))", self.literal())
            }
            2 => format!("fold(({init}, 1), 0..{turns}, |(s, t), i| (0.5 * s + t, 0.5 * tanh({body}))).x"),
            _ => format!("fold({init}, 0..{turns}, |s, i| 0.5 * s + 0.1 * tanh({body}))"),
        }
    }

    pub(super) fn condition(&mut self, d: usize) -> String {
        match self.below(9) {
            0 => {
                format!("{} {} {}", self.parenthesised(d), ["<", ">", "<=", ">="][self.below(4)], self.parenthesised(d))
            }
            1 => format!("{} < {}", self.length(d), self.length(d)),
            2 => format!("not ({} < {})", self.real(d), self.real(d)),
            3 => format!("({} < 0.3 and {} > -1)", self.parenthesised(d), self.parenthesised(d)),
            4 => format!("({} < 0.3 or {} > 1)", self.parenthesised(d), self.parenthesised(d)),
            // Of what is not a number.
            6 => {
                let op = ["==", "!=", "<", "<=", ">", ">="][self.below(6)];
                let nan = format!("sqrt(-1.5 - {} ^ 2)", self.parenthesised(d));
                format!("{nan} {op} {}", if self.below(2) == 0 { nan.clone() } else { self.parenthesised(d) })
            }
            // Of whole numbers near their end.
            7 => format!("9223372036854775800 + {} % 4 < 9223372036854775802", self.of(Ty::Int, 0)),
            8 => format!("sum([9223372036854775800, {} % 4, 2]) % 3 == 1", self.of(Ty::Int, 0)),
            _ => format!("{} == {}", self.of(Ty::Int, 0), self.of(Ty::Int, 0)),
        }
    }

    pub(super) fn length(&mut self, depth: usize) -> String {
        if self.is_leaf(depth) {
            return match self.named(Ty::Length) {
                Some(name) if self.below(3) != 1 => name,
                _ => ["2mm", "0.1cm", "1.5mm"][self.below(3)].to_owned(),
            };
        }
        let d = depth - 1;
        match self.below(13) {
            0 => self.named(Ty::Length).unwrap_or_else(|| "2mm".to_owned()),
            1 | 2 => format!("({} * {})", self.parenthesised(d), ["1mm", "2mm"][self.below(2)]),
            3 => format!("({} + {})", self.length(d), self.length(d)),
            4 => format!("({} - {})", self.length(d), self.length(d)),
            5 => format!("sqrt({} ^ 2 + {} ^ 2 + 1mm * 1mm)", self.wrapped_length(d), self.wrapped_length(d)),
            6 => format!("({} * {} / (2mm + abs({})))", self.length(d), self.length(d), self.length(d)),
            7 => format!("(1mm * tanh({}) * {})", self.real(d), self.angle(d)),
            8 => format!("({}).b", self.record(d)),
            9 => format!("({}).{}", self.point(d), ["x", "y", "z"][self.below(3)]),
            10 => format!("norm({} + (0mm, 0mm, 3mm))", self.point(d)),
            11 => format!("(if {} {{ {} }} else {{ {} }})", self.condition(d), self.length(d), self.length(d)),
            _ => self.call(Ty::Length, depth).unwrap_or_else(|| self.length(d)),
        }
    }

    pub(super) fn wrapped_length(&mut self, depth: usize) -> String {
        format!("({})", self.length(depth))
    }

    pub(super) fn angle(&mut self, depth: usize) -> String {
        if self.is_leaf(depth) {
            return match self.named(Ty::Angle) {
                Some(name) if self.below(3) != 1 => name,
                _ => ["30deg", "0.5rad", "0.1turn"][self.below(3)].to_owned(),
            };
        }
        let d = depth - 1;
        match self.below(6) {
            0 => self.named(Ty::Angle).unwrap_or_else(|| "30deg".to_owned()),
            1 | 2 => format!("({} * 1rad)", self.parenthesised(d)),
            3 => format!("atan2({}, 2mm + abs({}))", self.length(d), self.length(d)),
            4 => format!("({} + {})", self.angle(d), self.angle(d)),
            _ => format!("atan({})", self.real(d)),
        }
    }

    pub(super) fn point(&mut self, depth: usize) -> String {
        if self.is_leaf(depth) {
            return self.named(Ty::Point).unwrap_or_else(|| "(1mm, 2mm, 0mm)".to_owned());
        }
        let d = depth - 1;
        match self.below(7) {
            0 | 1 => format!("({}, {}, {})", self.length(d), self.length(d), self.length(d)),
            2 => format!("({} + {})", self.point(d), self.point(d)),
            3 => format!("({} * tanh({}))", self.point(d), self.real(d)),
            4 => format!("axis_angle((0, 0.6, 0.8), {})({})", self.angle(d), self.point(d)),
            5 => match self.named(Ty::Surface) {
                Some(surface) => format!("{surface}(tanh({}), 0.25)", self.real(d)),
                None => self.point(d),
            },
            _ => format!("(if {} {{ {} }} else {{ {} }})", self.condition(d), self.point(d), self.point(d)),
        }
    }

    pub(super) fn reals(&mut self, depth: usize) -> String {
        if let Some(name) = self.named(Ty::Reals)
            && self.below(2) == 1
        {
            return name;
        }
        if self.is_leaf(depth) {
            return "[0.5, 1, -0.5]".to_owned();
        }
        let d = depth - 1;
        match self.below(3) {
            0 => format!("[{}, {}, {}]", self.real(d), self.real(d), self.real(d)),
            1 => format!("(for i in 0..3 {{ {} }})", self.within(&[("i", Ty::Int)], |g| g.real(d))),
            _ => {
                let (xs, body) = (self.reals(d), self.within(&[("x", Ty::Real)], |g| g.real(d)));
                format!("(for x in {xs} {{ {body} }})")
            }
        }
    }

    pub(super) fn record(&mut self, depth: usize) -> String {
        if let Some(name) = self.named(Ty::Record)
            && self.below(2) == 1
        {
            return name;
        }
        let d = depth.saturating_sub(1);
        format!("{{a: {}, b: {}}}", self.real(d), self.length(d))
    }

    pub(super) fn lambda(&mut self, depth: usize) -> String {
        if self.below(3) == 1
            && let Some(name) = self.named(Ty::Function).or_else(|| self.call(Ty::Function, depth))
        {
            return name;
        }
        let name = self.fresh("z");
        let body = self.within(&[(&name, Ty::Real)], |g| g.real(depth));
        format!("|{name}| {body}")
    }

    pub(super) fn surface(&mut self, depth: usize) -> String {
        if self.is_leaf(depth) {
            return match self.named(Ty::Surface) {
                Some(name) => name,
                None => "|u, v| (u * 1mm, v * 2mm, 1mm)".to_owned(),
            };
        }
        let d = depth - 1;
        match self.below(8) {
            1 => self.call(Ty::Surface, depth).unwrap_or_else(|| self.surface(d)),
            2 => format!("({}).translate({})", self.surface(d), self.point(d)),
            3 => format!("({}).rotate({}, (0.6, 0, 0.8))", self.surface(d), self.angle(d)),
            4 if self.primes < 2 => {
                self.primes += 1;
                let (surface, by) = (self.surface(d), self.below(2));
                self.primes -= 1;
                format!("{{ let s = {surface}; |u, v| s(u, v) + 0.3 * s'{}(u, v) }}", ["u", "v"][by])
            }
            5 => format!(
                "tube(|t| (t * 9mm, {}, 4mm * t ^ 2), radius: 1mm)",
                self.within(&[("t", Ty::Real)], |g| g.length(1))
            ),
            6 => format!("revolve(|t| (5mm + {}, 9mm * t))", self.within(&[("t", Ty::Real)], |g| g.length(1))),
            _ => {
                let body = self.within(&[("u", Ty::Real), ("v", Ty::Real)], |g| g.point(depth));
                format!("|u, v| {body}")
            }
        }
    }
}
