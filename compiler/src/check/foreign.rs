//! Names that other languages have for what is called otherwise here: those of OpenSCAD, build123d, Python and C.

/// The advice for a name from another language.
pub(super) enum Foreign {
    /// The name can be replaced by this one.
    Name(&'static str),
    /// The meaning is expressed in another way.
    Hint(&'static str),
}

/// The advice for a foreign name, if it is a known one.
pub(super) fn meaning(name: &str) -> Option<Foreign> {
    use Foreign::{Hint, Name};
    Some(match name {
        "PI" | "Pi" | "π" => Name("pi"),
        "TAU" => Name("tau"),
        "log" => Name("ln"),
        "arcsin" => Name("asin"),
        "arccos" => Name("acos"),
        "arctan" => Name("atan"),
        "arctan2" => Name("atan2"),
        "fabs" => Name("abs"),
        "fmin" => Name("min"),
        "fmax" => Name("max"),
        "ceiling" => Name("ceil"),
        "lerp" => Name("mix"),
        "length" | "magnitude" => {
            Hint("the length of a vector is norm(v); the number of elements of an array is len(xs)")
        }
        "size" | "count" => Name("len"),
        "rotate_extrude" => Name("revolve"),
        "reduce" => Name("fold"),
        "True" => Name("true"),
        "False" => Name("false"),
        "None" | "null" | "nil" | "undef" => {
            Hint("there is no empty value; a default or another branch takes its place")
        }
        "yes" | "on" => Name("true"),
        "no" | "off" => Name("false"),
        "math" | "Math" | "np" | "numpy" => Hint("built-in names are written without a module: 'sin(30deg)', 'pi'"),
        "diff" | "derivative" | "gradient" | "grad" => Hint("the derivative of a function f is f': f'(2)"),
        "enumerate" => Hint("run over the numbers: for i in 0..len(xs) { ... xs[i] ... }"),
        "pow" | "power" => Hint("a power is written a ^ b"),
        "mod" => Hint("a remainder is written a % b"),
        "range" => Hint("a range is written from..to, without to"),
        "lambda" => Hint("a function without a name is written |x| x + 1"),
        "return" => Hint("the last line of a block is its value; no `return` is needed"),
        "self" | "this" => Hint("there are no methods: a.f(b) is another way to write f(a, b)"),
        "print" | "println" | "printf" | "echo" => {
            Hint("a script cannot print; use `gmlc repl` to see the values of expressions")
        }
        "cube" => Hint("the surfaces are in std.surface; a box is made of parts"),
        "union" | "difference" | "intersection" => Hint(
            "solids, as those of std.solid, are joined and cut by operators: a + b, a - b, a & b; arrays of them by \
             `union` and `intersection` of std.solid",
        ),
        "hull" | "minkowski" => Hint("solids, as those of std.solid, are only joined and cut: a + b, a - b, a & b"),
        "linear_extrude" => Name("extrude"),
        _ => return None,
    })
}
