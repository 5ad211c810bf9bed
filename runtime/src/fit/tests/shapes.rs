//! Models written by hand, and from scripts.

use super::number::{Dual, Jet, Number};
use crate::fit::FitOptions;
use crate::model::{EvaluationError, Instance, Model, Order, Partials, SecondPartials, Sites};
use gml_compiler::program::{BoundDerivative, Options, Parameter, Part, Program, Quantity, compile};
use gml_compiler::source::{NoFiles, SourceFile};
use std::f64::consts::TAU;

/// The model of a script. Panics with the diagnostics where there are errors.
pub(crate) fn program(text: &str) -> Program {
    let script = SourceFile { name: "m.gml".to_owned(), text: text.to_owned() };
    compile(script, &NoFiles, &Options::default()).unwrap_or_else(|e| panic!("{e}")).program
}

/// Parameters that a hand-written model may have.
const MOST: usize = 16;

/// A surface formula.
pub(crate) trait Formula: Sync {
    /// Patch `patch` at parameters x and (u, v).
    fn surface<T: Number>(&self, patch: usize, x: &[T], u: T, v: T) -> [T; 3];
}

/// A model from a formula. All parameters are active in all patches but where `active` says otherwise.
pub(crate) struct Handmade<F> {
    formula: F,
    parameters: Vec<Parameter>,
    parts: Vec<Part>,
    /// Bounds that depend on other parameters: (parameter, its upper bound's parameter).
    pub(crate) below: Vec<(usize, usize)>,
}

/// A parameter's name, quantity, bounds and default.
pub(crate) type Row = (&'static str, Quantity, f64, f64, f64);

impl<F: Formula> Handmade<F> {
    pub(crate) fn new(formula: F, rows: &[Row], parts: &[(&str, &[u32])]) -> Self {
        let parameters = rows
            .iter()
            .map(|(name, quantity, lower, upper, default)| Parameter {
                name: (*name).into(),
                doc: String::new(),
                quantity: *quantity,
                default: *default,
                lower: *lower,
                upper: *upper,
                span: Default::default(),
            })
            .collect();
        let part = |(name, active): &(&str, &[u32])| Part {
            name: (*name).into(),
            group: (*name).into(),
            active: active.to_vec(),
        };
        Self { formula, parameters, parts: parts.iter().map(part).collect(), below: Vec::new() }
    }

    pub(crate) fn set_bounds(&mut self, i: usize, lower: f64, upper: f64) {
        self.parameters[i].lower = lower;
        self.parameters[i].upper = upper;
    }
}

impl<F: Formula> Model for Handmade<F> {
    fn name(&self) -> &str {
        "handmade"
    }
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }
    fn parts(&self) -> &[Part] {
        &self.parts
    }
    fn bounds(&self, x: &[f64]) -> Vec<(f64, f64)> {
        let mut bounds: Vec<_> = self.parameters.iter().map(|p| (p.lower, p.upper)).collect();
        for (i, j) in &self.below {
            bounds[*i].1 = bounds[*i].1.min(x[*j]);
        }
        bounds
    }
    fn bounds_jacobian(&self, x: &[f64]) -> Vec<BoundDerivative> {
        let derivative = |(i, j): &(usize, usize)| {
            let follows = x[*j] < self.parameters[*i].upper;
            BoundDerivative { parameter: *i, by: *j, lower: 0.0, upper: if follows { 1.0 } else { 0.0 } }
        };
        self.below.iter().map(derivative).collect()
    }
    fn instantiate<'a>(&'a self, x: &[f64]) -> Result<Box<dyn Instance + 'a>, EvaluationError> {
        let jets = x.iter().map(|x| Jet::constant(*x)).collect();
        let duals = x
            .iter()
            .enumerate()
            .map(|(i, x)| Dual { value: *x, d: std::array::from_fn(|k| if k == i { 1.0 } else { 0.0 }) })
            .collect();
        Ok(Box::new(Made { model: self, x: x.to_vec(), jets, duals }))
    }
}

struct Made<'a, F> {
    model: &'a Handmade<F>,
    x: Vec<f64>,
    jets: Vec<Jet>,
    duals: Vec<Dual<MOST>>,
}

impl<F: Formula> Made<'_, F> {
    fn jet(&self, patch: usize, u: f64, v: f64) -> SecondPartials {
        let s = self.model.formula.surface(
            patch,
            &self.jets,
            Jet([u, 1.0, 0.0, 0.0, 0.0, 0.0]),
            Jet([v, 0.0, 1.0, 0.0, 0.0, 0.0]),
        );
        let pick = |k: usize| [s[0].0[k], s[1].0[k], s[2].0[k]];
        SecondPartials {
            first: Partials { point: pick(0), du: pick(1), dv: pick(2) },
            duu: pick(3),
            duv: pick(4),
            dvv: pick(5),
        }
    }

    fn dual(&self, patch: usize, u: f64, v: f64) -> [Dual<MOST>; 3] {
        self.model.formula.surface(patch, &self.duals, Dual::constant(u), Dual::constant(v))
    }
}

impl<F: Formula> Instance for Made<'_, F> {
    fn evaluate(
        &self,
        patch: usize,
        sites: Sites<'_>,
        order: Order<'_>,
        out: &mut [f64],
    ) -> Result<(), EvaluationError> {
        let active = &self.model.parts[patch].active;
        let (u, v) = sites.expanded();
        for (i, (u, v)) in u.into_iter().zip(v).enumerate() {
            let jet = || bytemuck::cast::<SecondPartials, [f64; 18]>(self.jet(patch, u, v));
            let width = order.width(&self.model.parts[patch]);
            match order {
                Order::Points => {
                    out[3 * i..3 * i + 3].copy_from_slice(&self.model.formula.surface(patch, &self.x, u, v));
                }
                Order::Partials | Order::SecondPartials => {
                    out[width * i..width * (i + 1)].copy_from_slice(&jet()[..width]);
                }
                Order::Jacobian => {
                    let s = self.dual(patch, u, v);
                    let by_param = active.iter().flat_map(|k| [0, 1, 2].map(|c| s[c].d[*k as usize]));
                    out[width * i..width * (i + 1)].iter_mut().zip(by_param).for_each(|(out, d)| *out = d);
                }
                Order::Decisions => out[width * i..width * (i + 1)].fill(0.0),
                Order::Pullback(w) => {
                    let s = self.dual(patch, u, v);
                    for (k, g) in out.iter_mut().enumerate() {
                        *g += w[i][0] * s[0].d[k] + w[i][1] * s[1].d[k] + w[i][2] * s[2].d[k];
                    }
                }
            }
        }
        Ok(())
    }
}

/// Rz(gamma) Ry(beta) Rx(alpha) p + t.
fn pose<T: Number>(t: &[T], angles: &[T], p: [T; 3]) -> [T; 3] {
    let turn = |a: T, p: T, q: T| (a.cos() * p - a.sin() * q, a.sin() * p + a.cos() * q);
    let [x, y, z] = p;
    let (y, z) = turn(angles[0], y, z);
    let (z, x) = turn(angles[1], z, x);
    let (x, y) = turn(angles[2], x, y);
    [x + t[0], y + t[1], z + t[2]]
}

/// LANGUAGE.md's cup.
pub(crate) struct Cup;

impl Formula for Cup {
    fn surface<T: Number>(&self, patch: usize, x: &[T], u: T, v: T) -> [T; 3] {
        let c = T::constant;
        let (shape, r, h) = (x[6], x[7], x[8]);
        let outer = |t: T| t.pow(c(3.0) + shape);
        let inner = |t: T| c(0.04) + (t + c(0.1)).pow(c(2.0) + shape);
        let rim = c(0.96).pow((c(2.0) + shape).recip()) - c(0.1);
        let turn = u * c(TAU);
        let revolve = |radius: T, height: T| [radius * turn.cos(), radius * turn.sin(), height];
        let local = match patch {
            0 => revolve(r * v, h * outer(v)),
            1 => revolve(r * rim * v, h * inner(rim * v)),
            2 => revolve(r * rim.mix(c(1.0), v), h),
            _ => {
                let p = [
                    (r * x[9], h * outer(x[9])),
                    (r * x[10], h * x[11]),
                    (r * x[12], h * x[13]),
                    (r * x[14], h * outer(x[14])),
                ];
                tube(p, v, turn)
            }
        };
        pose(&x[0..3], &x[3..6], local)
    }
}

/// A tube of radius 5 around a cubic Bezier curve in the (x, z) half plane.
fn tube<T: Number>(p: [(T, T); 4], t: T, turn: T) -> [T; 3] {
    let c = T::constant;
    let s = c(1.0) - t;
    let point = |f: &dyn Fn((T, T)) -> T| {
        s * s * s * f(p[0]) + c(3.0) * s * s * t * f(p[1]) + c(3.0) * s * t * t * f(p[2]) + t * t * t * f(p[3])
    };
    let slope = |f: &dyn Fn((T, T)) -> T| {
        c(3.0) * (s * s * (f(p[1]) - f(p[0])) + c(2.0) * s * t * (f(p[2]) - f(p[1])) + t * t * (f(p[3]) - f(p[2])))
    };
    let (x, z) = (point(&|p| p.0), point(&|p| p.1));
    let (dx, dz) = (slope(&|p| p.0), slope(&|p| p.1));
    let length = (dx * dx + dz * dz).sqrt();
    let side = c(5.0) * turn.cos() / length;
    [x - dz * side, c(5.0) * turn.sin(), z + dx * side]
}

/// The cup with LANGUAGE.md's bounds and defaults.
pub(crate) fn cup() -> Handmade<Cup> {
    use Quantity::{Angle, Length, Real};
    const ALL: f64 = f64::INFINITY;
    let rows: [Row; 15] = [
        ("x", Length, -ALL, ALL, 0.0),
        ("y", Length, -ALL, ALL, 0.0),
        ("z", Length, -ALL, ALL, 0.0),
        ("alpha", Angle, -ALL, ALL, 0.0),
        ("beta", Angle, -ALL, ALL, 0.0),
        ("gamma", Angle, -ALL, ALL, 0.0),
        ("shape", Real, -1.0, 12.0, 1.0),
        ("r", Length, 15.0, 80.0, 40.0),
        ("h", Length, 30.0, 200.0, 90.0),
        ("h1", Real, 0.3, 1.0, 0.95),
        ("h2a", Real, 1.0, 3.0, 1.9),
        ("h2b", Real, 0.0, 1.5, 0.95),
        ("h3a", Real, 1.0, 3.0, 1.8),
        ("h3b", Real, -0.5, 1.0, 0.2),
        ("h4", Real, 0.3, 1.0, 0.8),
    ];
    let body = [0, 1, 2, 3, 4, 5, 6, 7, 8];
    let all: Vec<u32> = (0..15).collect();
    Handmade::new(Cup, &rows, &[("outside", &body), ("inside", &body), ("lip", &body), ("handle", &all)])
}

/// A sphere, a cylinder, a plane, a cone or a torus in a fixed place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Simple {
    /// Radius.
    Sphere,
    /// Radius, height.
    Cylinder,
    /// Side.
    Plane,
    /// Radius at the bottom, height; the tip is at the top.
    Cone,
    /// Radius of the circle, radius of the tube.
    Torus,
}

impl Formula for Simple {
    fn surface<T: Number>(&self, _: usize, x: &[T], u: T, v: T) -> [T; 3] {
        let c = T::constant;
        let turn = u * c(TAU);
        let revolve = |radius: T, height: T| [radius * turn.cos(), radius * turn.sin(), height];
        match self {
            Simple::Sphere => {
                let latitude = (v - c(0.5)) * c(TAU / 2.0);
                revolve(x[0] * latitude.cos(), x[0] * latitude.sin())
            }
            Simple::Cylinder => revolve(x[0], x[1] * v),
            Simple::Plane => [x[0] * (u - c(0.5)), x[0] * (v - c(0.5)), c(0.0)],
            Simple::Cone => revolve(x[0] * (c(1.0) - v), x[1] * v),
            Simple::Torus => {
                let around = v * c(TAU);
                revolve(x[0] + x[1] * around.cos(), x[1] * around.sin())
            }
        }
    }
}

/// A simple shape; parameters are lengths between 1 and 200.
pub(crate) fn simple(shape: Simple, defaults: &[f64]) -> Handmade<Simple> {
    const NAMES: [&str; 2] = ["a", "b"];
    let rows: Vec<Row> = NAMES.iter().zip(defaults).map(|(n, d)| (*n, Quantity::Length, 1.0, 200.0, *d)).collect();
    let active: Vec<u32> = (0..defaults.len() as u32).collect();
    Handmade::new(shape, &rows, &[("all", &active)])
}

/// Options of a fit that begins at `x`.
pub(crate) fn beginning_at(model: &dyn Model, x: &[f64]) -> FitOptions {
    let start = model.parameters().iter().zip(x).map(|(p, x)| (p.name.clone(), *x)).collect();
    FitOptions { start, ..FitOptions::default() }
}
