//! Functions that generated code calls: the operations for which there is no instruction.
//!
//! They are the interpreter's own, so that native code gives the same bits. Each is there for one lane, and for two:
//! pairs of operands are in memory, and the pair of results replaces the first. Those of
//! [`elementary`](crate::ir::elementary) compute a pair at once, the others one number after the other.

#[cfg(target_arch = "x86_64")]
use super::pair::fused::Fused;
use super::pair::{Pair, Two};
use crate::ir::{Binary, Unary, arithmetic, elementary};

/// A function that generated code can call, C calling convention. None of them panics.
pub(super) struct HostFunction {
    /// Its symbol.
    pub(super) name: &'static str,
    /// Its address.
    pub(super) address: *const u8,
}

/// The symbols of a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Symbols {
    /// Doubles to a double.
    pub(super) one: &'static str,
    /// `(operands and results)`: pairs in memory.
    pub(super) two: &'static str,
}

/// Sine and cosine at once, in memory: where the number is comes the sine, and the cosine after it.
pub(super) const SIN_COS: Symbols = Symbols { one: "gml_sin_cos", two: "gml_sin_cos_2" };

/// One, two or three powers of the same number and its logarithm, in memory: the number becomes the logarithm, each
/// exponent its power.
pub(super) const POWERS: [Symbols; 3] = [
    Symbols { one: "gml_powers_1", two: "gml_powers_1_2" },
    Symbols { one: "gml_powers_2", two: "gml_powers_2_2" },
    Symbols { one: "gml_powers_3", two: "gml_powers_3_2" },
];

/// The functions for an operation; `None` where there are instructions for it.
pub(super) fn unary(op: Unary) -> Option<Symbols> {
    let symbols = |one, two| Some(Symbols { one, two });
    match op {
        Unary::Exp => symbols("gml_exp", "gml_exp_2"),
        Unary::Ln => symbols("gml_ln", "gml_ln_2"),
        Unary::Sin => symbols("gml_sin", "gml_sin_2"),
        Unary::Cos => symbols("gml_cos", "gml_cos_2"),
        Unary::Tan => symbols("gml_tan", "gml_tan_2"),
        Unary::Asin => symbols("gml_asin", "gml_asin_2"),
        Unary::Acos => symbols("gml_acos", "gml_acos_2"),
        Unary::Atan => symbols("gml_atan", "gml_atan_2"),
        Unary::Sinh => symbols("gml_sinh", "gml_sinh_2"),
        Unary::Cosh => symbols("gml_cosh", "gml_cosh_2"),
        Unary::Tanh => symbols("gml_tanh", "gml_tanh_2"),
        Unary::Round => symbols("gml_round", "gml_round_2"),
        _ => None,
    }
}

/// Likewise for an operation of two reals.
pub(super) fn binary(op: Binary) -> Option<Symbols> {
    let symbols = |one, two| Some(Symbols { one, two });
    match op {
        Binary::Rem => symbols("gml_remainder", "gml_remainder_2"),
        Binary::Pow => symbols("gml_pow", "gml_pow_2"),
        Binary::Atan2 => symbols("gml_atan2", "gml_atan2_2"),
        _ => None,
    }
}

/// All of them.
pub(super) fn all() -> Vec<HostFunction> {
    let mut all = one_by_one();
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx") && std::arch::is_x86_feature_detected!("fma") {
        all.extend(fused::all());
        return all;
    }
    all.extend(plain::all());
    all
}

macro_rules! one_by_one {
    ($($one:ident, $two:ident($x:ident) = $unary:expr;)+ -- $($one2:ident, $two2:ident($a:ident, $b:ident) = $binary:expr;)+) => {
        $(
            extern "C" fn $one($x: f64) -> f64 { $unary }
            extern "C" fn $two(place: &mut [Two; 1]) { place[0] = place[0].map(|$x| $unary); }
        )+
        $(
            extern "C" fn $one2($a: f64, $b: f64) -> f64 { $binary }
            extern "C" fn $two2(place: &mut [Two; 2]) {
                let f = |$a: f64, $b: f64| $binary;
                place[0] = [f(place[0][0], place[1][0]), f(place[0][1], place[1][1])];
            }
        )+

        /// The functions that are the platform's, or small.
        fn one_by_one() -> Vec<HostFunction> {
            vec![
                $(
                    HostFunction { name: stringify!($one), address: $one as *const u8 },
                    HostFunction { name: stringify!($two), address: $two as *const u8 },
                )+
                $(
                    HostFunction { name: stringify!($one2), address: $one2 as *const u8 },
                    HostFunction { name: stringify!($two2), address: $two2 as *const u8 },
                )+
            ]
        }
    };
}

one_by_one! {
    gml_tan, gml_tan_2(x) = x.tan();
    gml_asin, gml_asin_2(x) = x.asin();
    gml_acos, gml_acos_2(x) = x.acos();
    gml_atan, gml_atan_2(x) = x.atan();
    gml_sinh, gml_sinh_2(x) = x.sinh();
    gml_cosh, gml_cosh_2(x) = x.cosh();
    gml_tanh, gml_tanh_2(x) = x.tanh();
    gml_round, gml_round_2(x) = x.round();
    --
    gml_remainder, gml_remainder_2(a, b) = arithmetic::remainder(a, b);
    gml_atan2, gml_atan2_2(a, b) = a.atan2(b);
}

/// The elementary functions, compiled for machines with certain instructions.
macro_rules! elementary_functions {
    ($module:ident, $load:expr, $(#[$attribute:meta])*) => {
        mod $module {
            use super::*;

            $(#[$attribute])*
            extern "C" fn sin(x: f64) -> f64 {
                elementary::sin_cos_of(x)[0]
            }

            $(#[$attribute])*
            extern "C" fn cos(x: f64) -> f64 {
                elementary::sin_cos_of(x)[1]
            }

            $(#[$attribute])*
            extern "C" fn sin_cos(place: &mut Two) {
                *place = elementary::sin_cos_of(place[0]);
            }

            $(#[$attribute])*
            extern "C" fn exp(x: f64) -> f64 {
                elementary::exp_of(x)
            }

            $(#[$attribute])*
            extern "C" fn pow(x: f64, y: f64) -> f64 {
                elementary::pow_of(x, y)
            }

            $(#[$attribute])*
            extern "C" fn sin_2(place: &mut [Two; 1]) {
                elementary::sin_cos_of($load(&place[0]))[0].store(&mut place[0]);
            }

            $(#[$attribute])*
            extern "C" fn cos_2(place: &mut [Two; 1]) {
                elementary::sin_cos_of($load(&place[0]))[1].store(&mut place[0]);
            }

            $(#[$attribute])*
            extern "C" fn sin_cos_2(place: &mut [Two; 2]) {
                let [sin, cos] = elementary::sin_cos_of($load(&place[0]));
                sin.store(&mut place[0]);
                cos.store(&mut place[1]);
            }

            $(#[$attribute])*
            extern "C" fn exp_2(place: &mut [Two; 1]) {
                elementary::exp_of($load(&place[0])).store(&mut place[0]);
            }

            $(#[$attribute])*
            extern "C" fn pow_2(place: &mut [Two; 2]) {
                elementary::pow_of($load(&place[0]), $load(&place[1])).store(&mut place[0]);
            }

            $(#[$attribute])*
            extern "C" fn ln(x: f64) -> f64 {
                elementary::ln_of(x)
            }

            $(#[$attribute])*
            extern "C" fn ln_2(place: &mut [Two; 1]) {
                elementary::ln_of($load(&place[0])).store(&mut place[0]);
            }

            $(#[$attribute])*
            extern "C" fn powers_1(place: &mut [f64; 2]) {
                let [x, exponents @ ..] = *place;
                place[0] = elementary::ln_of(x);
                (0..1).for_each(|k| place[k + 1] = elementary::pow_of(x, exponents[k]));
            }

            $(#[$attribute])*
            extern "C" fn powers_1_2(place: &mut [Two; 2]) {
                let x = $load(&place[0]);
                elementary::ln_of(x).store(&mut place[0]);
                elementary::pow_of(x, $load(&place[1])).store(&mut place[1]);
            }

            $(#[$attribute])*
            extern "C" fn powers_2(place: &mut [f64; 3]) {
                let [x, exponents @ ..] = *place;
                place[0] = elementary::ln_of(x);
                (0..2).for_each(|k| place[k + 1] = elementary::pow_of(x, exponents[k]));
            }

            $(#[$attribute])*
            extern "C" fn powers_2_2(place: &mut [Two; 3]) {
                let x = $load(&place[0]);
                elementary::ln_of(x).store(&mut place[0]);
                elementary::pow_of(x, $load(&place[1])).store(&mut place[1]);
                elementary::pow_of(x, $load(&place[2])).store(&mut place[2]);
            }

            $(#[$attribute])*
            extern "C" fn powers_3(place: &mut [f64; 4]) {
                let [x, exponents @ ..] = *place;
                place[0] = elementary::ln_of(x);
                (0..3).for_each(|k| place[k + 1] = elementary::pow_of(x, exponents[k]));
            }

            $(#[$attribute])*
            extern "C" fn powers_3_2(place: &mut [Two; 4]) {
                let x = $load(&place[0]);
                elementary::ln_of(x).store(&mut place[0]);
                elementary::pow_of(x, $load(&place[1])).store(&mut place[1]);
                elementary::pow_of(x, $load(&place[2])).store(&mut place[2]);
                elementary::pow_of(x, $load(&place[3])).store(&mut place[3]);
            }

            pub(super) fn all() -> [HostFunction; 18] {
                [
                    HostFunction { name: "gml_sin", address: sin as *const u8 },
                    HostFunction { name: "gml_cos", address: cos as *const u8 },
                    HostFunction { name: "gml_sin_cos", address: sin_cos as *const u8 },
                    HostFunction { name: "gml_exp", address: exp as *const u8 },
                    HostFunction { name: "gml_pow", address: pow as *const u8 },
                    HostFunction { name: "gml_sin_2", address: sin_2 as *const u8 },
                    HostFunction { name: "gml_cos_2", address: cos_2 as *const u8 },
                    HostFunction { name: "gml_sin_cos_2", address: sin_cos_2 as *const u8 },
                    HostFunction { name: "gml_exp_2", address: exp_2 as *const u8 },
                    HostFunction { name: "gml_pow_2", address: pow_2 as *const u8 },
                    HostFunction { name: "gml_ln", address: ln as *const u8 },
                    HostFunction { name: "gml_ln_2", address: ln_2 as *const u8 },
                    HostFunction { name: "gml_powers_1", address: powers_1 as *const u8 },
                    HostFunction { name: "gml_powers_2", address: powers_2 as *const u8 },
                    HostFunction { name: "gml_powers_3", address: powers_3 as *const u8 },
                    HostFunction { name: "gml_powers_1_2", address: powers_1_2 as *const u8 },
                    HostFunction { name: "gml_powers_2_2", address: powers_2_2 as *const u8 },
                    HostFunction { name: "gml_powers_3_2", address: powers_3_2 as *const u8 },
                ]
            }
        }
    };
}

elementary_functions!(plain, Pair::load,);

#[cfg(target_arch = "x86_64")]
elementary_functions!(fused, fused_pair, #[target_feature(enable = "avx,fma")]);

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn fused_pair(place: &Two) -> Fused {
    // SAFETY: only functions of the module `fused` come here, which generated code calls where `all` has seen that the
    // machine has the instructions.
    unsafe { Fused::load(place) }
}
