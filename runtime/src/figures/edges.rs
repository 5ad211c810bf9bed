//! The edges of trimmed patches: what lies between them and their chords, and how fast they move.

use super::places::{apart, keeps_at, partials_at};
use crate::model::{Bracket, EvaluationError, Instance, Partials, narrow};
use glam::{DVec2, DVec3};

/// The largest value, at a vertex on an edge, of the function of where a patch is there. Millimetres: surfaces that
/// coincide are told apart by 1e-6 mm, by which the vertices of either side of an edge may lie beside that of the
/// other.
const ON_EDGE: f64 = 2e-6;

/// Distances beside an edge at which its slope is asked for, in millimetres: farther than surfaces that coincide are
/// told apart; and, where the function is level there, between the edge and where that begins, from wherever a vertex
/// may be.
const BESIDE_EDGE: [f64; 4] = [2e-5, 5e-7, 1e-6, 1.5e-6];

/// The least change by a millimetre of a function that says where its edge is. At the border of a patch a short piece
/// may end where the function is level; where a fillet of a metre is tangent to a wall it is 4e-5.
const LEVEL: f64 = 1e-6;

/// A piece of an edge in (u, v): its ends and its middle, and by how much of it each stands for the piece.
#[derive(Debug)]
pub(super) struct Edge {
    places: [DVec2; 3],
    steps: [DVec2; 3],
}

impl Edge {
    /// Over a chord; without a middle along it.
    fn over([a, b]: [DVec2; 2], middle: Option<DVec2>) -> Self {
        let chord = b - a;
        // An edge without a middle near the chord is no arc over it, but has a corner, or meets another edge.
        let Some(middle) = middle else {
            return Self { places: [a, 0.5 * (a + b), b], steps: [0.5 * chord, DVec2::ZERO, 0.5 * chord] };
        };
        // Simpson's rule along the parabola.
        let sagitta = middle - 0.5 * (a + b);
        let steps = [(chord + 4.0 * sagitta) / 6.0, chord * 4.0 / 6.0, (chord - 4.0 * sagitta) / 6.0];
        Self { places: [a, middle, b], steps }
    }

    pub(super) fn chord(&self) -> DVec2 {
        self.places[2] - self.places[0]
    }

    /// A place between the chord and the parabola over it, and the area there; none of an edge along its chord.
    pub(super) fn segment(&self) -> Option<(DVec2, f64)> {
        let [a, middle, b] = self.places;
        let sagitta = middle - 0.5 * (a + b);
        let at = 0.5 * (a + b) + 0.4 * sagitta;
        (sagitta != DVec2::ZERO).then(|| (at, -2.0 / 3.0 * self.chord().perp_dot(sagitta)))
    }
}

/// The edges over those borders of a patch that are edges. Borders run counterclockwise about what is there.
pub(super) fn along(
    instance: &dyn Instance,
    [patch, keep]: [usize; 2],
    borders: &[[DVec2; 2]],
) -> Result<Vec<Edge>, EvaluationError> {
    let values = keeps_at(instance, keep, borders.as_flattened())?;
    // Where surfaces of two solids coincide the value is as small along the whole border.
    let on_border =
        |[a, b]: &[DVec2; 2]| [0, 1].iter().any(|axis| a[*axis] == b[*axis] && (a[*axis] == 0.0 || a[*axis] == 1.0));
    let on_edge =
        |k: &usize| values[2 * k..2 * k + 2].iter().all(|value| value.abs() <= ON_EDGE) && !on_border(&borders[*k]);
    let edges: Vec<[DVec2; 2]> = (0..borders.len()).filter(on_edge).map(|k| borders[k]).collect();
    let middles = middles(instance, patch, keep, &edges)?;
    Ok(edges.into_iter().zip(middles).map(|(chord, middle)| Edge::over(chord, middle)).collect())
}

/// How the area of a patch grows as its edges move outwards, by the parameters that the function of where it is there
/// depends on.
pub(super) fn flux(
    edges: &[Edge],
    instance: &dyn Instance,
    [patch, keep]: [usize; 2],
    active: &[u32],
) -> Result<Vec<(u32, f64)>, EvaluationError> {
    let places: Vec<DVec2> = edges.iter().flat_map(|edge| edge.places).collect();
    let steps: Vec<DVec2> = edges.iter().flat_map(|edge| edge.steps).collect();
    let surface = partials_at(instance, patch, &places)?;
    let across: Vec<DVec2> = steps.iter().zip(&surface).map(|(step, p)| left_of(*step, p)).collect();
    let beside = slopes_beside(instance, keep, [&places, &steps, &across])?;
    let chosen: Vec<DVec2> = beside.iter().map(|beside| beside.place).collect();
    let (u, v) = apart(&chosen);
    let mut motions = vec![0.0; places.len() * active.len() * 3];
    instance.jacobian(keep, &u, &v, &mut motions)?;
    let mut flux: Vec<(u32, f64)> = active.iter().map(|parameter| (*parameter, 0.0)).collect();
    for (i, step) in steps.iter().enumerate() {
        // The patch is on the left of its edge.
        let slope = beside[i].slope;
        let stretch = DVec3::from(surface[i].du).cross(DVec3::from(surface[i].dv)).length();
        let by_value = stretch * step.perp_dot(slope) / slope.length_squared();
        if by_value.is_finite() {
            for (a, (_, sum)) in flux.iter_mut().enumerate() {
                *sum += by_value * motions[(i * active.len() + a) * 3];
            }
        }
    }
    Ok(flux)
}

/// A place beside an edge, and the slope there of the function that is zero on it.
#[derive(Clone, Copy, Default)]
struct Beside {
    place: DVec2,
    slope: DVec2,
}

/// The slopes of where a patch is there at places on its edges, beside which the ways are across the edge, by a
/// millimetre. Where solids coincide the function is level on one side of an edge, and where two do, as where a bore
/// ends flush with a pipe and its flange, on both.
fn slopes_beside(
    instance: &dyn Instance,
    keep: usize,
    [places, steps, across]: [&[DVec2]; 3],
) -> Result<Vec<Beside>, EvaluationError> {
    let mut found: Vec<Beside> = places.iter().map(|place| Beside { place: *place, ..Beside::default() }).collect();
    let mut wanted: Vec<usize> = (0..places.len()).filter(|i| across[*i].is_finite()).collect();
    // At a corner it is the slope of the one edge on this side, and of the other on that: the function does not change
    // along its own edge.
    let mut turned = vec![f64::INFINITY; places.len()];
    for distance in BESIDE_EDGE {
        for distance in [distance, -distance] {
            let beside = |i: &usize| (places[*i] + distance * across[*i]).clamp(DVec2::ZERO, DVec2::ONE);
            let beside: Vec<DVec2> = wanted.iter().map(beside).collect();
            for ((i, place), keep) in wanted.iter().zip(&beside).zip(partials_at(instance, keep, &beside)?) {
                let slope = DVec2::new(keep.du[0], keep.dv[0]);
                let (along, out) = (slope.dot(steps[*i]).abs(), slope.dot(across[*i]).abs());
                if out > LEVEL && along / out < turned[*i] {
                    turned[*i] = along / out;
                    found[*i] = Beside { place: *place, slope };
                }
            }
        }
        wanted.retain(|i| turned[*i].is_infinite());
    }
    Ok(found)
}

/// The width to which the place of an edge is narrowed, as a part of the way that is looked at from a chord: rounding.
const EXACT: f64 = 3e-14;

/// The middles of the edges over chords: across the chord from its middle, at most a quarter of its length away.
fn middles(
    instance: &dyn Instance,
    patch: usize,
    keep: usize,
    edges: &[[DVec2; 2]],
) -> Result<Vec<Option<DVec2>>, EvaluationError> {
    let starts: Vec<DVec2> = edges.iter().map(|[a, b]| 0.5 * (*a + *b)).collect();
    let surface = partials_at(instance, patch, &starts)?;
    let across = |([a, b], p): (&[DVec2; 2], &Partials)| {
        let chord = *b - *a;
        left_of(chord, p) * (0.25 * in_space(p, chord).length())
    };
    let across: Vec<DVec2> = edges.iter().zip(&surface).map(across).collect();
    let beside = |s: f64| -> Vec<DVec2> {
        starts.iter().zip(&across).map(|(start, way)| (*start + s * *way).clamp(DVec2::ZERO, DVec2::ONE)).collect()
    };
    let [outside, here, inside] = [
        keeps_at(instance, keep, &beside(-1.0))?,
        keeps_at(instance, keep, &starts)?,
        keeps_at(instance, keep, &beside(1.0))?,
    ];
    // From where the surface is not there to where it is.
    let bracket = |i: usize| {
        let ends = match [outside[i] > 0.0, here[i] > 0.0, inside[i] > 0.0] {
            [_, false, true] => Bracket { from: 0.0, to: 1.0, values: [here[i], inside[i]] },
            [false, true, _] => Bracket { from: -1.0, to: 0.0, values: [outside[i], here[i]] },
            _ => return None,
        };
        across[i].is_finite().then_some((i, ends))
    };
    let at = |i: usize, s: f64| (starts[i] + s * across[i]).clamp(DVec2::ZERO, DVec2::ONE);
    let (bracketed, mut zeros): (Vec<usize>, Vec<Bracket>) = (0..edges.len()).filter_map(bracket).unzip();
    narrow(&mut zeros, EXACT, |which, s| {
        let places: Vec<DVec2> = which.iter().zip(s).map(|(k, s)| at(bracketed[*k], *s)).collect();
        keeps_at(instance, keep, &places)
    })?;
    let mut middles = vec![None; edges.len()];
    bracketed.into_iter().zip(zeros).for_each(|(i, zero)| middles[i] = Some(at(i, zero.to)));
    Ok(middles)
}

/// A way in (u, v) as one in space.
fn in_space(p: &Partials, way: DVec2) -> DVec3 {
    DVec3::from(p.du) * way.x + DVec3::from(p.dv) * way.y
}

/// To the left of a way in (u, v), at right angles to it in space, by a millimetre.
fn left_of(way: DVec2, p: &Partials) -> DVec2 {
    let (along, left) = (in_space(p, way), in_space(p, way.perp()));
    let square = way.perp() - way * (left.dot(along) / along.length_squared());
    square / in_space(p, square).length()
}
