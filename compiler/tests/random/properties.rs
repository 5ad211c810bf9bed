//! Properties of every script.

use crate::common::Random;
use crate::differences::{Slope, slopes};
use crate::oracle::Oracle;
use gml_compiler::diagnostic::Code;
use gml_compiler::program::{Compilation, Instance, Options, Order, Program, Sites, compile};
use gml_compiler::source::{NoFiles, SourceFile};

/// Counts of the comparisons.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    /// Scripts that are too large once they are differentiated.
    pub(crate) refused: usize,
    /// Derivatives that were compared with differences, and those among them that are not zero.
    pub(crate) compared: usize,
    pub(crate) nonzero: usize,
    pub(crate) compared_or_skipped: usize,
}

/// Number of points at which each part is evaluated.
const POINTS: usize = 3;

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    a == b || (a - b).abs() <= tolerance * (1.0 + a.abs() + b.abs())
}

fn all_close(what: &str, a: &[f64], b: &[f64], tolerance: f64) -> Result<(), String> {
    if a.len() == b.len() && a.iter().zip(b).all(|(a, b)| close(*a, *b, tolerance)) {
        return Ok(());
    }
    Err(format!("{what}: {a:?} and {b:?}"))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn along(x: &[f64], direction: &[f64], t: f64) -> Vec<f64> {
    x.iter().zip(direction).map(|(x, d)| x + t * d).collect()
}

impl Seen {
    /// Compares derivatives with finite differences where these exist.
    fn compare(&mut self, what: &str, exact: &[f64], approximate: &[Slope]) -> Result<(), String> {
        for (k, (exact, approximate)) in exact.iter().zip(approximate).enumerate() {
            self.compared_or_skipped += 1;
            let Some((slope, change)) = approximate else { continue };
            self.compared += 1;
            self.nonzero += usize::from(*exact != 0.0);
            // Errors of truncation and rounding are at most a few times the change by halving the step.
            let tolerance = 20.0 * change + 1e-6 * (1.0 + slope.abs());
            if !((exact - slope).abs() <= tolerance) {
                return Err(format!("{what}, number {k}: {exact}, but differences give {slope} (+- {change:e})"));
            }
        }
        Ok(())
    }
}

/// Checks that all evaluations of a script agree; an error names one that does not.
pub(crate) fn hold(text: &str, seen: &mut Seen) -> Result<(), String> {
    let script = SourceFile { name: "random.gml".to_owned(), text: text.to_owned() };
    let program = match compile(script, &NoFiles, &Options::default()) {
        Ok(Compilation { program, .. }) => program,
        Err(failed) if failed.diagnostics.iter().all(|d| d.code == Code::TooLarge) => {
            seen.refused += 1;
            return Ok(());
        }
        Err(failed) => return Err(failed.to_string()),
    };
    let mut oracle = Oracle::new(text)?;
    let mut random = Random(text.len() as u64);
    // The defaults would be too special: they have simple ratios.
    let x: Vec<f64> = program.defaults().iter().map(|x| x + random.between(-0.2, 0.2)).collect();
    let instance = program.instantiate(&x).map_err(|e| e.message)?;
    for part in 0..program.parts().len() {
        let at = Place { program: &program, part, x: &x };
        at.values(&oracle, &instance, &mut random)?;
        at.partials(&instance, seen, &mut random)?;
        at.derivatives(&mut oracle, &instance, seen, &mut random)?;
        at.grids(&instance, &mut random)?;
    }
    Ok(())
}

/// A part at some parameters.
struct Place<'p> {
    program: &'p Program,
    part: usize,
    x: &'p [f64],
}

impl Place<'_> {
    fn name(&self) -> &str {
        &self.program.parts()[self.part].name
    }

    fn uvs(&self, random: &mut Random) -> (Vec<f64>, Vec<f64>) {
        (0..POINTS).map(|_| (random.between(0.05, 0.95), random.between(0.05, 0.95))).unzip()
    }

    /// One of the evaluations at all points, with `width` numbers a point.
    fn batch<E: std::fmt::Display>(
        &self,
        width: usize,
        n: usize,
        evaluate: impl FnOnce(&mut [f64]) -> Result<(), E>,
    ) -> Result<Vec<f64>, String> {
        let mut out = vec![0.0; width * n];
        evaluate(&mut out).map_err(|e| format!("{}: {e}", self.name()))?;
        Ok(out)
    }

    /// Native code against the interpreter; not to the bit, because simplification may reorder operations.
    fn values(&self, oracle: &Oracle, instance: &Instance<'_>, random: &mut Random) -> Result<(), String> {
        let (u, v) = self.uvs(random);
        let native =
            self.batch(3, u.len(), |out| instance.evaluate(self.part, Sites::Scattered(&u, &v), Order::Points, out))?;
        for (i, (u, v)) in u.iter().zip(&v).enumerate() {
            let expected = oracle.point(self.part, self.x, [*u, *v])?;
            all_close(&format!("points of {}", self.name()), &native[3 * i..3 * i + 3], &expected, 1e-10)?;
        }
        Ok(())
    }

    /// Grids against the evaluation point by point: the same operations, so the same bits.
    fn grids(&self, instance: &Instance<'_>, random: &mut Random) -> Result<(), String> {
        let (u, v) = self.uvs(random);
        let grid = Sites::Grid(&u, &v[..2]);
        let (all_u, all_v) = grid.expanded();
        let scattered = Sites::Scattered(&all_u, &all_v);
        for order in [Order::Points, Order::Partials, Order::SecondPartials, Order::Jacobian] {
            let width = order.width(&self.program.parts()[self.part]);
            let [grid, batch] = [grid, scattered]
                .map(|sites| self.batch(width, sites.count(), |out| instance.evaluate(self.part, sites, order, out)));
            let (grid, batch) = (grid?, batch?);
            if let Some(k) = (0..grid.len()).find(|k| grid[*k].to_bits() != batch[*k].to_bits()) {
                let name = self.name();
                return Err(format!("{order:?} of {name} on a grid: number {k} is {}, not {}", grid[k], batch[k]));
            }
        }
        Ok(())
    }

    /// First and second partial derivatives in u and v against differences of points and of partials.
    fn partials(&self, instance: &Instance<'_>, seen: &mut Seen, random: &mut Random) -> Result<(), String> {
        let (u, v) = (random.between(0.1, 0.9), random.between(0.1, 0.9));
        let all = self.batch(18, 1, |out| {
            instance.evaluate(self.part, Sites::Scattered(&[u], &[v]), Order::SecondPartials, out)
        })?;
        let first = |u: f64, v: f64| {
            self.batch(9, 1, |out| instance.evaluate(self.part, Sites::Scattered(&[u], &[v]), Order::Partials, out))
        };
        all_close("partials of two functions", &all[..9], &first(u, v)?, 1e-11)?;
        let by_u = slopes(9, |t| first(u + t, v).ok());
        let by_v = slopes(9, |t| first(u, v + t).ok());
        seen.compare(&format!("du of {}", self.name()), &all[3..6], &by_u[..3])?;
        seen.compare(&format!("dv of {}", self.name()), &all[6..9], &by_v[..3])?;
        seen.compare(&format!("duu of {}", self.name()), &all[9..12], &by_u[3..6])?;
        seen.compare(&format!("duv of {}", self.name()), &all[12..15], &by_u[6..9])?;
        seen.compare(&format!("dvv of {}", self.name()), &all[15..18], &by_v[6..9])
    }

    /// Derivatives with respect to the parameters: Jacobian and pullback in native code, tangent, gradient and Hessian
    /// in the interpreter.
    fn derivatives(
        &self,
        oracle: &mut Oracle,
        instance: &Instance<'_>,
        seen: &mut Seen,
        random: &mut Random,
    ) -> Result<(), String> {
        let x = self.x;
        let uv = [random.between(0.1, 0.9), random.between(0.1, 0.9)];
        let ([u], [v]) = ([uv[0]], [uv[1]]);
        let direction = |random: &mut Random| x.iter().map(|_| random.between(-1.0, 1.0)).collect::<Vec<f64>>();
        let (a, b) = (direction(random), direction(random));
        let w = [0; 3].map(|_| random.between(-1.0, 1.0));

        let active = &self.program.parts()[self.part].active;
        let jacobian = self.batch(3 * active.len(), 1, |out| {
            instance.evaluate(self.part, Sites::Scattered(&[u], &[v]), Order::Jacobian, out)
        })?;
        let times = |dx: &[f64]| -> [f64; 3] {
            [0, 1, 2].map(|c| active.iter().enumerate().map(|(k, p)| jacobian[3 * k + c] * dx[*p as usize]).sum())
        };
        let points = |t: f64| {
            let moved = self.program.instantiate(&along(x, &a, t)).ok()?;
            self.batch(3, 1, |out| moved.evaluate(self.part, Sites::Scattered(&[u], &[v]), Order::Points, out)).ok()
        };
        seen.compare(&format!("Jv of {}", self.name()), &times(&a), &slopes(3, points))?;

        let pulled = |x: &[f64]| {
            let moved = self.program.instantiate(x).map_err(|e| e.message)?;
            self.batch(x.len(), 1, |out| {
                moved.evaluate(self.part, Sites::Scattered(&[u], &[v]), Order::Pullback(&[w]), out)
            })
        };
        let gradient = pulled(x)?;
        // Relative to the size of the terms, which may cancel: the sum is computed in another order, by other formulas.
        let size: f64 = jacobian.iter().map(|j| j.abs()).sum();
        let difference = dot(&w, &times(&a)) - dot(&gradient, &a);
        if !(difference.abs() <= 1e-12 * (1.0 + size)) {
            return Err(format!("w.Jv - v.J^T w of {} is {difference:e} of {size}", self.name()));
        }

        let d = oracle.derivatives(self.part)?;
        all_close("tangent and Jacobian", &oracle.tangent(&d, x, uv, &a)?, &times(&a), 1e-9)?;
        all_close("gradients", &oracle.gradient(&d, x, uv, &w)?, &gradient, 1e-9)?;
        let (ha, hb) = (oracle.hessian(&d, (x, uv, &w), &a)?, oracle.hessian(&d, (x, uv, &w), &b)?);
        let size: f64 = ha.iter().chain(&hb).map(|h| h.abs()).sum();
        if !((dot(&b, &ha) - dot(&a, &hb)).abs() <= 1e-9 * (1.0 + size)) {
            return Err(format!("the Hessian of {} is not symmetric: {} {}", self.name(), dot(&b, &ha), dot(&a, &hb)));
        }
        let slopes = slopes(x.len(), |t| pulled(&along(x, &a, t)).ok());
        seen.compare(&format!("Hessian of {}", self.name()), &ha, &slopes)
    }
}
