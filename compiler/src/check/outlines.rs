//! `svg_path` and `glyphs`: outlines that become arrays of points while compiling.

use super::constants::constant;
use super::context::{Checker, error};
use super::iteration::ITERATIONS_HINT;
use super::typed::{Expr, ExprKind, Type};
use super::types::Dimension;
use crate::diagnostic::{Code, Diagnostic};
use crate::outline::{self, OutlineError, Polygon};
use crate::source::Span;
use std::sync::Arc;

/// Distance of a chord from its curve where none is given, in millimetres.
const TOLERANCE: f64 = 0.01;

/// The tolerances that may be given.
const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-6..=1e6;

impl Checker<'_> {
    /// `svg_path(path, tolerance)`: the outlines of a path.
    pub(super) fn svg_path(&mut self, path: Expr, tolerance: Option<Expr>, span: Span) -> Expr {
        let Some(text) = self.text_for("svg_path", &path) else { return error(span) };
        let tolerance = match tolerance {
            Some(tolerance) => match self.tolerance(tolerance) {
                Some(tolerance) => tolerance,
                None => return error(span),
            },
            None => TOLERANCE,
        };
        let polygons = outline::svg_path(&text, tolerance, self.options.iterations);
        self.outlines(polygons, path.span, span)
    }

    /// `glyphs(text, font)`: the outlines of a line of letters.
    pub(super) fn glyphs(&mut self, text: &Expr, font: &Expr, span: Span) -> Expr {
        let (Some(letters), Some(path)) = (self.text_for("glyphs", text), self.text_for("glyphs", font)) else {
            return error(span);
        };
        match self.modules[self.env.module].fonts.and_then(|fonts| fonts.get(&*path)) {
            Some(Ok(bytes)) => {
                let polygons = outline::glyphs(&letters, bytes, self.options.iterations);
                self.outlines(polygons, span, span)
            }
            Some(Err(reason)) => self.fail(Diagnostic::new(Code::FileNotFound, font.span, reason.clone())),
            None => {
                let message = "the font must be named where 'glyphs' is called";
                let error = Diagnostic::new(Code::NotConstant, font.span, message);
                self.fail(error.hint("write its file in quotes: glyphs(text, \"font.ttf\")"))
            }
        }
    }

    /// The text of an argument; or it is reported that it is none, or not known.
    fn text_for(&mut self, function: &str, e: &Expr) -> Option<Arc<str>> {
        match &e.ty {
            Type::Text(Some(text)) => return Some(text.clone()),
            Type::Text(None) => {
                let message = format!("'{function}' needs a text that is known at compile time");
                let error = Diagnostic::new(Code::NotConstant, e.span, message);
                self.report(error.hint("choose between texts by inputs of the types int and bool only"));
            }
            other => {
                let message = format!("'{function}' expects a text, but this is {}", self.describe(other));
                self.report(Diagnostic::new(Code::TypeMismatch, e.span, message).hint("write it in quotes"));
            }
        }
        None
    }

    fn tolerance(&mut self, e: Expr) -> Option<f64> {
        let span = e.span;
        let (e, dimension) = self.number(e, "'svg_path'")?;
        if dimension != Dimension::LENGTH {
            let message = format!("the tolerance of 'svg_path' must be a length, but this is {dimension}");
            let error = Diagnostic::new(Code::DimensionMismatch, span, message);
            self.report(error.suggestion(self.unit_advice(&e, Dimension::LENGTH)));
            return None;
        }
        let Some(value) = constant(&e) else {
            let message = "the tolerance of 'svg_path' must be written out";
            self.report(Diagnostic::new(Code::NotConstant, span, message).hint("write a length, such as 0.01mm"));
            return None;
        };
        if TOLERANCES.contains(&value) {
            return Some(value);
        }
        let message = "the tolerance of 'svg_path' must be from 1e-6mm to 1e6mm";
        self.report(Diagnostic::new(Code::Outline, span, message));
        None
    }

    /// Arrays of points, one for each polygon.
    fn outlines(&mut self, polygons: Result<Vec<Polygon>, OutlineError>, at: Span, span: Span) -> Expr {
        let polygons = match polygons {
            Ok(polygons) => polygons,
            Err(OutlineError::TooManyPoints) => {
                let limit = self.options.iterations;
                let message = format!("the outlines have more than {limit} points");
                return self.fail(Diagnostic::new(Code::TooLarge, at, message).hint(ITERATIONS_HINT));
            }
            Err(OutlineError::Other(message, fix)) => {
                let mut error = Diagnostic::new(Code::Outline, at, message);
                error.hint = fix;
                return self.fail(error);
            }
        };
        let length = |x: f64| Expr { kind: ExprKind::Real(x), ty: Type::LENGTH, span };
        let mut arrays = Vec::new();
        for polygon in polygons {
            let points = polygon.into_iter().map(|[x, y]| self.make_tuple(vec![length(x), length(y)], span)).collect();
            arrays.push(self.array(points, span));
        }
        self.array(arrays, span)
    }
}
