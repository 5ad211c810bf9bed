//! Functions that generated code calls: the operations for which there is no instruction.
//!
//! They are the interpreter's own, so that native code gives the same bits.

use crate::ir::{Binary, Unary, arithmetic};

/// A function that generated code can call: doubles to a double, C calling convention. None of them panics.
pub(super) struct HostFunction {
    /// Its symbol.
    pub(super) name: &'static str,
    /// Its address.
    pub(super) address: *const u8,
}

macro_rules! host_functions {
    ($($name:ident($($x:ident),+) = $body:expr;)+) => {
        $(extern "C" fn $name($($x: f64),+) -> f64 { $body })+

        /// All of them.
        pub(super) fn all() -> Vec<HostFunction> {
            vec![$(HostFunction { name: stringify!($name), address: $name as *const u8 }),+]
        }
    };
}

host_functions! {
    gml_exp(x) = x.exp();
    gml_ln(x) = x.ln();
    gml_sin(x) = x.sin();
    gml_cos(x) = x.cos();
    gml_tan(x) = x.tan();
    gml_asin(x) = x.asin();
    gml_acos(x) = x.acos();
    gml_atan(x) = x.atan();
    gml_sinh(x) = x.sinh();
    gml_cosh(x) = x.cosh();
    gml_tanh(x) = x.tanh();
    gml_round(x) = x.round();
    gml_remainder(a, b) = arithmetic::remainder(a, b);
    gml_pow(a, b) = a.powf(b);
    gml_atan2(a, b) = a.atan2(b);
}

/// The symbol of the host function for an operation; `None` where there are instructions for it.
pub(super) fn unary(op: Unary) -> Option<&'static str> {
    Some(match op {
        Unary::Exp => "gml_exp",
        Unary::Ln => "gml_ln",
        Unary::Sin => "gml_sin",
        Unary::Cos => "gml_cos",
        Unary::Tan => "gml_tan",
        Unary::Asin => "gml_asin",
        Unary::Acos => "gml_acos",
        Unary::Atan => "gml_atan",
        Unary::Sinh => "gml_sinh",
        Unary::Cosh => "gml_cosh",
        Unary::Tanh => "gml_tanh",
        Unary::Round => "gml_round",
        _ => return None,
    })
}

/// Likewise for an operation of two reals.
pub(super) fn binary(op: Binary) -> Option<&'static str> {
    Some(match op {
        Binary::Rem => "gml_remainder",
        Binary::Pow => "gml_pow",
        Binary::Atan2 => "gml_atan2",
        _ => return None,
    })
}
