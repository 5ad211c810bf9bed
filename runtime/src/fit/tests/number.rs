//! Numbers that carry derivatives, for models written by hand: an oracle that shares nothing with the compiler.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// What a surface formula needs.
pub(crate) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    fn constant(x: f64) -> Self;
    fn value(self) -> f64;
    /// f(self) from f's value, first and second derivative there.
    fn apply(self, f: f64, f1: f64, f2: f64) -> Self;

    fn sin(self) -> Self {
        let x = self.value();
        self.apply(x.sin(), x.cos(), -x.sin())
    }
    fn cos(self) -> Self {
        let x = self.value();
        self.apply(x.cos(), -x.sin(), -x.cos())
    }
    fn sqrt(self) -> Self {
        let r = self.value().sqrt();
        self.apply(r, 0.5 / r, -0.25 / (r * r * r))
    }
    fn exp(self) -> Self {
        let e = self.value().exp();
        self.apply(e, e, e)
    }
    fn ln(self) -> Self {
        let x = self.value();
        self.apply(x.ln(), 1.0 / x, -1.0 / (x * x))
    }
    fn recip(self) -> Self {
        let r = 1.0 / self.value();
        self.apply(r, -r * r, 2.0 * r * r * r)
    }
    /// self^p for self >= 0 and p > 2.
    fn pow(self, p: Self) -> Self {
        if self.value() <= 0.0 { Self::constant(0.0) } else { (self.ln() * p).exp() }
    }
    fn mix(self, to: Self, t: Self) -> Self {
        self + (to - self) * t
    }
}

impl Number for f64 {
    fn constant(x: f64) -> Self {
        x
    }
    fn value(self) -> f64 {
        self
    }
    fn apply(self, f: f64, _: f64, _: f64) -> Self {
        f
    }
}

/// Value, first and second derivatives by u and v: v, u, v, uu, uv, vv.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jet(pub(crate) [f64; 6]);

impl Jet {
    fn zip(self, b: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Jet(std::array::from_fn(|i| f(self.0[i], b.0[i])))
    }
}

impl Number for Jet {
    fn constant(x: f64) -> Self {
        Jet([x, 0.0, 0.0, 0.0, 0.0, 0.0])
    }
    fn value(self) -> f64 {
        self.0[0]
    }
    fn apply(self, f: f64, f1: f64, f2: f64) -> Self {
        let [_, u, v, uu, uv, vv] = self.0;
        Jet([f, f1 * u, f1 * v, f1 * uu + f2 * u * u, f1 * uv + f2 * u * v, f1 * vv + f2 * v * v])
    }
}

/// Value and derivatives by up to N parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dual<const N: usize> {
    pub(crate) value: f64,
    pub(crate) d: [f64; N],
}

impl<const N: usize> Number for Dual<N> {
    fn constant(value: f64) -> Self {
        Dual { value, d: [0.0; N] }
    }
    fn value(self) -> f64 {
        self.value
    }
    fn apply(self, f: f64, f1: f64, _: f64) -> Self {
        Dual { value: f, d: self.d.map(|d| d * f1) }
    }
}

impl<const N: usize> Dual<N> {
    fn linear(self, b: Self, value: f64, ka: f64, kb: f64) -> Self {
        Dual { value, d: std::array::from_fn(|i| ka * self.d[i] + kb * b.d[i]) }
    }
}

macro_rules! arithmetic {
    ([$($generics:tt)*] $type:ty, $add:expr, $sub:expr, $mul:expr) => {
        impl $($generics)* Add for $type {
            type Output = Self;
            fn add(self, b: Self) -> Self { $add(self, b) }
        }
        impl $($generics)* Sub for $type {
            type Output = Self;
            fn sub(self, b: Self) -> Self { $sub(self, b) }
        }
        impl $($generics)* Mul for $type {
            type Output = Self;
            fn mul(self, b: Self) -> Self { $mul(self, b) }
        }
        #[allow(clippy::suspicious_arithmetic_impl)]
        impl $($generics)* Div for $type {
            type Output = Self;
            fn div(self, b: Self) -> Self { self * b.recip() }
        }
        impl $($generics)* Neg for $type {
            type Output = Self;
            fn neg(self) -> Self { Self::constant(0.0) - self }
        }
    };
}

arithmetic!([] Jet, |a: Jet, b| a.zip(b, |a, b| a + b), |a: Jet, b| a.zip(b, |a, b| a - b), |a: Jet, b: Jet| {
    let ([a, au, av, auu, auv, avv], [b, bu, bv, buu, buv, bvv]) = (a.0, b.0);
    Jet([
        a * b,
        au * b + a * bu,
        av * b + a * bv,
        auu * b + 2.0 * au * bu + a * buu,
        auv * b + au * bv + av * bu + a * buv,
        avv * b + 2.0 * av * bv + a * bvv,
    ])
});
arithmetic!([<const N: usize>] Dual<N>,
    |a: Self, b: Self| a.linear(b, a.value + b.value, 1.0, 1.0),
    |a: Self, b: Self| a.linear(b, a.value - b.value, 1.0, -1.0),
    |a: Self, b: Self| a.linear(b, a.value * b.value, b.value, a.value));
