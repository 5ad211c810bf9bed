//! Outlines that texts of a script name: SVG paths, and lines of letters in a font's shapes, as polygons.

mod font;
mod svg;

pub(crate) use font::glyphs;
pub(crate) use svg::svg_path;

use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::solver::Solver;
use i_overlay::float::overlay::OverlayOptions;
use i_overlay::float::simplify::SimplifyShape;
use kurbo::{CubicBez, ParamCurve, Point, QuadBez};

/// The corners of a closed line in the plane, what it bounds on its left; the last one is joined to the first.
pub(crate) type Polygon = Vec<[f64; 2]>;

/// The reason why there are no outlines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum OutlineError {
    /// More points than are allowed.
    TooManyPoints,
    /// Another reason: a sentence without a full stop, and a fix.
    Other(String, Option<String>),
}

impl OutlineError {
    fn new(message: impl Into<String>) -> OutlineError {
        OutlineError::Other(message.into(), None)
    }

    fn with_fix(message: impl Into<String>, fix: impl Into<String>) -> OutlineError {
        OutlineError::Other(message.into(), Some(fix.into()))
    }
}

/// The largest coordinate: with it and the least tolerance a curve has some million chords at most.
const LARGEST: f64 = 1e6;

/// Curves being turned into polygons.
struct Flattening {
    /// Distance of a chord from its curve.
    tolerance: f64,
    /// The number of points that may still be added.
    left: usize,
    too_many: bool,
    polygons: Vec<Polygon>,
}

impl Flattening {
    fn new(tolerance: f64, limit: usize) -> Flattening {
        Flattening { tolerance, left: limit, too_many: false, polygons: Vec::new() }
    }

    /// Begins a polygon.
    fn move_to(&mut self, to: Point) {
        self.polygons.push(Vec::new());
        self.line_to(to);
    }

    fn line_to(&mut self, to: Point) {
        match (self.left.checked_sub(1), self.polygons.last_mut()) {
            (Some(left), Some(polygon)) => {
                self.left = left;
                polygon.push([to.x, to.y]);
            }
            _ => self.too_many = true,
        }
    }

    /// Adds the chords of a quadratic Bezier curve.
    fn quadratic_to(&mut self, curve: QuadBez) {
        self.chords(&curve, 2.0 * second_difference(curve.p0, curve.p1, curve.p2));
    }

    /// Adds the chords of a cubic Bezier curve.
    fn cubic_to(&mut self, curve: CubicBez) {
        let [first, second] = [[curve.p0, curve.p1, curve.p2], [curve.p1, curve.p2, curve.p3]];
        let largest = [first, second].map(|[a, b, c]| second_difference(a, b, c)).into_iter().fold(0.0, f64::max);
        self.chords(&curve, 6.0 * largest);
    }

    /// Adds chords of a curve whose second derivative is nowhere larger than `second`: over a step h of the parameter a
    /// chord is nowhere further from the curve than h^2 / 8 of it (Wang's formula).
    fn chords(&mut self, curve: &impl ParamCurve, second: f64) {
        let count = (second / (8.0 * self.tolerance)).sqrt().ceil().max(1.0);
        if !(count <= self.left as f64) {
            self.too_many = true;
            return;
        }
        (1..count as usize).for_each(|k| self.line_to(curve.eval(k as f64 / count)));
        self.line_to(curve.end());
    }

    /// The boundary of what the polygons enclose by the nonzero rule: each encloses something on its left, and none
    /// crosses another or itself.
    fn resolved(self) -> Result<Vec<Polygon>, OutlineError> {
        if self.too_many {
            return Err(OutlineError::TooManyPoints);
        }
        let coordinates = || self.polygons.iter().flatten().flatten();
        if coordinates().any(|x| !(x.abs() <= LARGEST)) {
            return Err(OutlineError::new(format!("a coordinate of the outline is larger than {LARGEST}")));
        }
        let polygons: Vec<Polygon> = self.polygons.into_iter().filter(|p| p.len() > 2).collect();
        let mut options = OverlayOptions::<f64, i64>::default();
        // Slivers between curves that were to coincide.
        options.min_output_area = self.tolerance * self.tolerance;
        let shapes = polygons.simplify_shape_custom_as::<i64>(FillRule::NonZero, options, Solver::default());
        let resolved: Vec<Polygon> = shapes.into_iter().flatten().filter(|p| p.len() > 2).collect();
        if resolved.is_empty() {
            let text = format!("the outline encloses nothing that is larger than its tolerance, {} mm", self.tolerance);
            return Err(OutlineError::new(text));
        }
        Ok(resolved)
    }
}

fn second_difference(a: Point, b: Point, c: Point) -> f64 {
    ((a - b) + (c - b)).hypot()
}

#[cfg(test)]
mod tests;
