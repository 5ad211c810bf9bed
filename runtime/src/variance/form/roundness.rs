//! Roundness of sections at right angles to an axis, and straightness of the lines along it.
//!
//! The deviation of a point is its distance perpendicular to the surface: ISO 1101 requires the direction to be stated
//! for surfaces that are neither cylinders nor spheres, and the scan's noise does not grow on a surface that is steep
//! to its axis. In the plane of the section, as ISO 12181-1 defines its profile, the same deviations are longer by one
//! over the cosine of the angle between normal and plane; both are computed.

use super::grid::{Grid, SECTIONS, Section};
use super::linear::{self, MOST, Row};
use super::noise::Spread;
use std::f64::consts::TAU;

/// The shares of the places around a section, and along a generator (which ends in edges), that must have a value.
const AROUND: f64 = 0.92;
const ALONG: f64 = 0.75;
/// Generators that are examined.
const GENERATORS: usize = 72;

/// The width of a zone about the curve of least squares, and where that curve makes it narrowest. Millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Widths {
    pub(super) least_squares: f64,
    pub(super) minimum_zone: f64,
}

/// The equations of a section's places, by the angle around the axis. A slightly shifted circle has the deviation
/// a + b cos t + c sin t (a limacon: exact but for the square of the shift over twice the radius); perpendicular to the
/// surface b and c count with `outward`, the component of its normal away from the axis. None where parts of the
/// section have no values.
fn rows(values: &[Option<f64>], outward: f64) -> Option<Vec<Row>> {
    let row = |(j, value): (usize, &Option<f64>)| {
        let (sin, cos) = (TAU * j as f64 / values.len() as f64).sin_cos();
        Some(Row { factors: [1.0, outward * cos, outward * sin, 0.0, 0.0, 0.0], value: (*value)? })
    };
    let rows: Vec<Row> = values.iter().enumerate().filter_map(row).collect();
    (rows.len() as f64 >= AROUND * values.len() as f64).then_some(rows)
}

/// The widths of the rings that contain a section's points, perpendicular to the surface.
pub(super) fn rings(grid: &Grid, section: &Section, values: &[Option<f64>]) -> Option<Widths> {
    widths(&rows(grid.of_section(values, section), section.outward)?, 3)
}

/// How far the sections' values lie from their circles of least squares: the widest ring. None where there are none.
pub(super) fn spread_of_rings(grid: &Grid, values: &[Option<f64>]) -> Option<Spread> {
    let of_section = |section: &Section| rows(grid.of_section(values, section), section.outward);
    together(grid.even().filter_map(of_section), 3)
}

/// The generators that are examined.
pub(super) fn generators(grid: &Grid) -> impl Iterator<Item = usize> {
    (0..grid.angles).step_by((grid.angles / GENERATORS).max(1))
}

/// The widths between two parallel lines that contain the values along a generator.
pub(super) fn straightness(grid: &Grid, values: &[Option<f64>], angle: usize) -> Option<Widths> {
    widths(&line(grid, values, angle)?, 2)
}

/// How far the generators' values lie from their lines of least squares: the least straight one. None where there are
/// none.
pub(super) fn spread_of_lines(grid: &Grid, values: &[Option<f64>]) -> Option<Spread> {
    together(generators(grid).filter_map(|angle| line(grid, values, angle)), 2)
}

/// The largest width and the mean square of all curves' rows.
fn together(curves: impl Iterator<Item = Vec<Row>>, unknowns: usize) -> Option<Spread> {
    let (mut largest, mut sum, mut count) = (0.0_f64, 0.0, 0);
    for rows in curves {
        let (curve, _) = linear::least_squares(rows.iter().copied(), unknowns)?;
        largest = largest.max(width(&rows, &curve));
        sum += rows.iter().map(|row| row.error(&curve).powi(2)).sum::<f64>();
        count += rows.len();
    }
    (count > 0).then(|| Spread { width: largest, mean_square: sum / count as f64 })
}

fn line(grid: &Grid, values: &[Option<f64>], angle: usize) -> Option<Vec<Row>> {
    let row = |(height, value)| Row { factors: [1.0, height, 0.0, 0.0, 0.0, 0.0], value };
    let rows: Vec<Row> = grid.of_generator(values, angle).map(row).collect();
    (rows.len() as f64 >= ALONG * SECTIONS as f64).then_some(rows)
}

fn widths(rows: &[Row], unknowns: usize) -> Option<Widths> {
    let least_squares = width(rows, &linear::least_squares(rows.iter().copied(), unknowns)?.0);
    let minimum_zone = least_squares.min(width(rows, &linear::chebyshev(rows, unknowns)));
    Some(Widths { least_squares, minimum_zone })
}

/// The width of the zone about a curve that contains all rows.
fn width(rows: &[Row], curve: &[f64; MOST]) -> f64 {
    let errors = rows.iter().map(|r| r.error(curve));
    let (low, high) = errors.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), e| (l.min(e), h.max(e)));
    high - low
}
