//! Paths as the attribute `d` of SVG's `path` has them (SVG 2, section 9.3).

use super::{Flattening, LARGEST, OutlineError, Polygon};
use kurbo::{Arc, CubicBez, Point, QuadBez, SvgArc, Vec2};
use svgtypes::{Error, PathParser, PathSegment};

/// The polygons of a path, y upwards; curves are replaced by chords that are not further than the tolerance from them.
///
/// # Errors
/// The text is not a path, the path encloses nothing, or it has more points than the limit.
pub(crate) fn svg_path(path: &str, tolerance: f64, limit: usize) -> Result<Vec<Polygon>, OutlineError> {
    let mut pen = Pen { out: Flattening::new(tolerance, limit), start: Point::ZERO, at: Point::ZERO, control: None };
    for segment in PathParser::from(path) {
        let segment = segment.map_err(|e| unreadable(path, &e))?;
        pen.draw(segment)?;
        if pen.out.too_many {
            return Err(OutlineError::TooManyPoints);
        }
    }
    if pen.out.polygons.is_empty() {
        return Err(OutlineError::with_fix(
            "the SVG path is empty",
            "write the attribute 'd' of a path, such as \"M 0 0 H 8 V 5 Z\"",
        ));
    }
    let mut polygons = pen.out.resolved()?;
    // Turned over, what is bounded would lie on the right.
    polygons.iter_mut().for_each(|polygon| {
        polygon.iter_mut().for_each(|point| point[1] = 0.0 - point[1]);
        polygon.reverse();
    });
    Ok(polygons)
}

fn unreadable(path: &str, error: &Error) -> OutlineError {
    let at = match error {
        Error::UnexpectedData(at)
        | Error::InvalidChar(_, at)
        | Error::InvalidString(_, at)
        | Error::InvalidNumber(at) => *at,
        _ => return OutlineError::new("the SVG path ends within a command"),
    };
    // Positions count characters from 1.
    let rest: String = path.chars().skip(at.saturating_sub(1)).take(12).collect();
    match rest.trim().is_empty() {
        true => OutlineError::new("the SVG path ends within a command"),
        false => OutlineError::new(format!("the SVG path cannot be read from its character {at} on: '{rest}'")),
    }
}

/// The control point of the curve before, which a smooth one mirrors.
#[derive(Clone, Copy)]
enum Control {
    Cubic(Point),
    Quadratic(Point),
}

struct Pen {
    out: Flattening,
    /// The first point of the polygon.
    start: Point,
    at: Point,
    control: Option<Control>,
}

impl Pen {
    fn draw(&mut self, segment: PathSegment) -> Result<(), OutlineError> {
        let origin = if segment.is_abs() { Vec2::ZERO } else { self.at.to_vec2() };
        let place = |x: f64, y: f64| {
            let point = Point::new(x, y) + origin;
            let fits = point.x.abs() <= LARGEST && point.y.abs() <= LARGEST;
            fits.then_some(point)
                .ok_or_else(|| OutlineError::new(format!("a coordinate of the SVG path is larger than {LARGEST}")))
        };
        // The mirrored control point, where the curve before was of the same kind.
        let control = self.control.take();
        match segment {
            PathSegment::MoveTo { x, y, .. } => {
                self.start = place(x, y)?;
                self.at = self.start;
                self.out.move_to(self.at);
            }
            PathSegment::LineTo { x, y, .. } => self.line_to(place(x, y)?),
            PathSegment::HorizontalLineTo { x, .. } => self.line_to(Point::new(place(x, 0.0)?.x, self.at.y)),
            PathSegment::VerticalLineTo { y, .. } => self.line_to(Point::new(self.at.x, place(0.0, y)?.y)),
            PathSegment::CurveTo { x1, y1, x2, y2, x, y, .. } => {
                self.cubic_to(place(x1, y1)?, place(x2, y2)?, place(x, y)?);
            }
            PathSegment::SmoothCurveTo { x2, y2, x, y, .. } => {
                let first = match control {
                    Some(Control::Cubic(before)) => self.at + (self.at - before),
                    _ => self.at,
                };
                self.cubic_to(first, place(x2, y2)?, place(x, y)?);
            }
            PathSegment::Quadratic { x1, y1, x, y, .. } => self.quadratic_to(place(x1, y1)?, place(x, y)?),
            PathSegment::SmoothQuadratic { x, y, .. } => {
                let middle = match control {
                    Some(Control::Quadratic(before)) => self.at + (self.at - before),
                    _ => self.at,
                };
                self.quadratic_to(middle, place(x, y)?);
            }
            PathSegment::EllipticalArc { rx, ry, x_axis_rotation, large_arc, sweep, x, y, .. } => {
                let to = place(x, y)?;
                let radii = Vec2::new(rx.abs().min(LARGEST), ry.abs().min(LARGEST));
                let x_rotation = x_axis_rotation.to_radians();
                self.arc_to(&SvgArc { from: self.at, to, radii, x_rotation, large_arc, sweep });
            }
            // A command that follows without M begins at the same point.
            PathSegment::ClosePath { .. } => {
                self.at = self.start;
                self.out.move_to(self.start);
            }
        }
        Ok(())
    }

    fn line_to(&mut self, to: Point) {
        self.out.line_to(to);
        self.at = to;
    }

    fn cubic_to(&mut self, first: Point, second: Point, to: Point) {
        self.out.cubic_to(CubicBez::new(self.at, first, second, to));
        (self.at, self.control) = (to, Some(Control::Cubic(second)));
    }

    fn quadratic_to(&mut self, middle: Point, to: Point) {
        self.out.quadratic_to(QuadBez::new(self.at, middle, to));
        (self.at, self.control) = (to, Some(Control::Quadratic(middle)));
    }

    /// The corners of an arc lie on it, evenly in the angle: no chord is further from an ellipse than one of the same
    /// angle from the circle of its larger radius.
    fn arc_to(&mut self, svg: &SvgArc) {
        if let Some(arc) = Arc::from_svg_arc(svg) {
            let radius = arc.radii.x.max(arc.radii.y);
            let step = 2.0 * (1.0 - (self.out.tolerance / radius).min(1.0)).acos();
            let count = (arc.sweep_angle.abs() / step).ceil().max(1.0);
            if !(count <= self.out.left as f64) {
                self.out.too_many = true;
                return;
            }
            for k in 1..count as usize {
                let angle = arc.start_angle + arc.sweep_angle * (k as f64 / count);
                let on_axes = Vec2::new(arc.radii.x * angle.cos(), arc.radii.y * angle.sin());
                let (sin, cos) = arc.x_rotation.sin_cos();
                let from_center = Vec2::new(cos * on_axes.x - sin * on_axes.y, sin * on_axes.x + cos * on_axes.y);
                self.out.line_to(arc.center + from_center);
            }
        }
        self.line_to(svg.to);
    }
}
