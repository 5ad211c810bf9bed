//! Lines of a grid where its even steps leave the surface: of a bead on a rod, or of a narrow bump.
//!
//! Second derivatives at some places do not see what is narrow. What all of a row or a column needs takes far fewer
//! triangles as lines of the grid than as divided triangles; and the triangles of cells that are much longer than wide
//! become slivers when they are divided.

use super::intervals::{Axes, Interval};
use super::piece::scattered;
use crate::model::{EvaluationError, Instance};
use glam::{DVec2, DVec3};
use std::collections::{BTreeMap, BTreeSet};

/// Places of a patch, and of a whole model at most: what is wider than a thousandth along u or v is met.
const PLACES: usize = 20_000;
const MOST_PLACES: usize = 2_000_000;
/// Of small patches fewer, for each chord of the longest line: what leaves the surface clearly over less than half a
/// chord, of which this leaves 20 places, is steeper than any bead is.
const PLACES_A_CHORD: f64 = 50.0;
/// The most cells of a patch's grid that steps are halved for.
const MOST_CELLS: usize = 10_000_000;
/// Places in every step that is new.
const FRESH: usize = 24;
/// Rounds of halving: to less than a ten thousandth of an even step.
const ROUNDS: usize = 14;
/// Steps are halved where they leave the surface by so many chords; what leaves it less is left to refinement.
const CLEARLY: f64 = 2.0;
/// Steps are halved if this part of their places leaves the surface clearly ...
const COMMON: f64 = 0.25;
/// ... or if only one does, in a cell that is longer than wide by this factor.
const ELONGATED: f64 = 4.0;

/// A place of a patch.
pub(super) struct Place {
    uv: DVec2,
    /// Whether it counts in the part of a step's places.
    is_fresh: bool,
}

/// A place at (u, v).
pub(super) fn place(uv: DVec2) -> Place {
    Place { uv, is_fresh: true }
}

/// A step of u (0) or of v (1): of an interval.
type Step = (usize, usize, usize);

/// Halves steps of u and of v that leave the surface. Beside creases across u and v (`oblique`) only cells that are
/// long: all of them may leave it there.
///
/// # Errors
/// The surface cannot be evaluated.
pub(super) fn grade(
    instance: &dyn Instance,
    patch: usize,
    axes: &mut Axes,
    oblique: bool,
    chord: f64,
    patches: usize,
) -> Result<(), EvaluationError> {
    let of_length = (PLACES_A_CHORD * longest_line(instance, patch)? / chord).ceil() as usize;
    let count = (MOST_PLACES / patches).min(PLACES).min(of_length);
    let mut scattered = (1..).map(|k| DVec2::from_array(scattered(f64::from(k), [0.0; 2])));
    let mut places: Vec<Place> = scattered.by_ref().take(count).map(place).collect();
    for _ in 0..ROUNDS {
        let cells = cells(axes, &places);
        let departures = departures(instance, patch, axes, &places, &cells)?;
        let mut tally: BTreeMap<Step, [usize; 2]> = BTreeMap::new();
        let mut halved: BTreeSet<Step> = BTreeSet::new();
        for ((place, cell), departure) in places.iter().zip(&cells).zip(&departures) {
            for k in 0..2 {
                let clear = departure.along[k] > CLEARLY * chord;
                if place.is_fresh && !oblique {
                    let [all, leaving] = tally.entry(cell[k]).or_default();
                    *all += 1;
                    *leaving += usize::from(clear);
                }
                if clear && departure.is_elongated(k) {
                    halved.insert(cell[k]);
                }
            }
        }
        let common =
            tally.into_iter().filter(|(_, [all, leaving])| *leaving as f64 >= COMMON.mul_add(*all as f64, 1.0));
        halved.extend(common.map(|(step, _)| step));
        let lines = axes.each_ref().map(|axis| axis.iter().map(Interval::segments).sum::<usize>() + halved.len());
        if halved.is_empty() || lines[0].saturating_mul(lines[1]) > MOST_CELLS {
            break;
        }
        let mut departures = departures.iter();
        places.retain_mut(|place| {
            place.is_fresh = false;
            departures.next().is_some_and(|d| d.along.iter().any(|along| *along > CLEARLY * chord))
        });
        // From behind, so that the steps before keep their numbers.
        for (k, interval, step) in halved.into_iter().rev() {
            let values = &mut axes[k][interval].values;
            let (start, end) = (values[step], values[step + 1]);
            values.insert(step + 1, 0.5 * (start + end));
            places.extend(scattered.by_ref().take(2 * FRESH).map(|mut uv| {
                uv[k] = start + uv[k] * (end - start);
                place(uv)
            }));
        }
    }
    Ok(())
}

/// The length of the longest of some lines of a patch along u and along v, by chords. Millimetres.
fn longest_line(instance: &dyn Instance, patch: usize) -> Result<f64, EvaluationError> {
    const ACROSS: usize = 5;
    const ALONG: usize = 24;
    let part = |i: usize, n: usize| i as f64 / n as f64;
    let line = |k: usize, line: usize| {
        (0..=ALONG).map(move |i| {
            let (along, across) = (part(i, ALONG), part(line, ACROSS - 1));
            if k == 0 { (along, across) } else { (across, along) }
        })
    };
    let (u, v): (Vec<f64>, Vec<f64>) = (0..2).flat_map(|k| (0..ACROSS).flat_map(move |i| line(k, i))).unzip();
    let mut points = vec![[0.0; 3]; u.len()];
    instance.points(patch, &u, &v, &mut points)?;
    let length = |line: &[[f64; 3]]| -> f64 {
        line.windows(2).map(|w| DVec3::from_array(w[0]).distance(DVec3::from_array(w[1]))).sum()
    };
    Ok(points.chunks_exact(ALONG + 1).map(length).fold(0.0, f64::max))
}

/// Whether the surface leaves the cells of some places by more than a distance (millimetres) anywhere.
///
/// # Errors
/// The surface cannot be evaluated.
pub(super) fn departs(
    instance: &dyn Instance,
    patch: usize,
    axes: &Axes,
    places: &[Place],
    distance: f64,
) -> Result<bool, EvaluationError> {
    let departures = departures(instance, patch, axes, places, &cells(axes, places))?;
    Ok(departures.iter().any(|d| d.along.iter().any(|along| *along > distance)))
}

/// The steps of u and of v around places.
fn cells(axes: &Axes, places: &[Place]) -> Vec<[Step; 2]> {
    places.iter().map(|p| [0, 1].map(|k| step_around(&axes[k], k, p.uv[k]))).collect()
}

fn step_around(axis: &[Interval], k: usize, t: f64) -> Step {
    let interval = axis.partition_point(|i| i.end() < t).min(axis.len() - 1);
    let step = axis[interval].values.partition_point(|value| *value <= t).clamp(1, axis[interval].segments()) - 1;
    (k, interval, step)
}

/// How far the surface is from a cell at a place of it.
struct Departure {
    /// From the chord through the place along u, and along v, at right angles to the surface. Millimetres.
    along: [f64; 2],
    /// The lengths of these chords. Millimetres.
    length: [f64; 2],
    /// The lengths of the two sides of the cell along u, and of those along v. Millimetres.
    sides: [[f64; 2]; 2],
}

impl Departure {
    /// Whether the cell is long along u (0) or v (1) for what it is wide. Beside a pole all cells are, however short.
    fn is_elongated(&self, k: usize) -> bool {
        let [a, b] = self.sides[1 - k];
        self.length[k] > ELONGATED * a.max(b) && a.max(b) < ELONGATED * a.min(b)
    }
}

fn departures(
    instance: &dyn Instance,
    patch: usize,
    axes: &Axes,
    places: &[Place],
    cells: &[[Step; 2]],
) -> Result<Vec<Departure>, EvaluationError> {
    // The place, the ends of the chords through it, and the corners.
    const EACH: usize = 9;
    let sites = places.iter().zip(cells).flat_map(|(place, cell)| {
        let [u, v] = cell.map(|(k, interval, step)| {
            let values = &axes[k][interval].values;
            [values[step], values[step + 1]]
        });
        let at = DVec2::new(place.uv.x.clamp(u[0], u[1]), place.uv.y.clamp(v[0], v[1]));
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j): (usize, usize)| DVec2::new(u[i], v[j]));
        let chords = [(u[0], at.y), (u[1], at.y), (at.x, v[0]), (at.x, v[1])].map(|(u, v)| DVec2::new(u, v));
        [at].into_iter().chain(chords).chain(corners)
    });
    let (u, v): (Vec<f64>, Vec<f64>) = sites.map(|s| (s.x, s.y)).unzip();
    let mut points = vec![[0.0; 3]; u.len()];
    instance.points(patch, &u, &v, &mut points)?;
    let departure = |points: &[[f64; 3]]| {
        let [p, a, b, c, d] = [0, 1, 2, 3, 4].map(|k: usize| DVec3::from_array(points[k]));
        let chords = [(a, b), (c, d)];
        let normal = (b - a).cross(d - c).try_normalize();
        let along = chords.map(|(from, to)| {
            let chord = to - from;
            let s = ((p - from).dot(chord) / chord.length_squared()).clamp(0.0, 1.0);
            let gap = p - if s.is_finite() { from + s * chord } else { from };
            normal.map_or(gap.length(), |normal| gap.dot(normal).abs())
        });
        let side = |i: usize, j: usize| DVec3::from_array(points[i]).distance(DVec3::from_array(points[j]));
        let sides = [[side(5, 6), side(7, 8)], [side(5, 7), side(6, 8)]];
        Departure { along, length: chords.map(|(from, to)| from.distance(to)), sides }
    };
    Ok(points.chunks_exact(EACH).map(departure).collect())
}
