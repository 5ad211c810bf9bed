//! Feet on trimmed patches: where the foot on the whole patch is not there, the nearest point of the edge of what is
//! there. Steps along the edge, each led back to where the function of what is there is zero.

use super::domain::Domain;
use super::foot::Foot;
use super::tuning::{EDGE_BACKTRACK, EDGE_BISECTIONS, EDGE_ERRORS, EDGE_EVALUATIONS};
use crate::model::{EvaluationError, Instance, Partials};
use glam::{DVec2, DVec3};

/// Values of the function of what is there that may be on an edge: a tenth of what `std.solid` looks beside a surface
/// with which another one may coincide. Millimetres.
const ON_EDGE: f64 = 1e-7;

/// Limits of the second derivative of half of the squared distance along an edge, as the last step shows it: next to
/// the centre of a circle it is next to zero.
const LEAST_BEND: f64 = 0.002;
const MOST_BEND: f64 = 10.0;

/// The least sine of the angle between two surfaces that cross, by the slope of the function of what is there: along a
/// line that they touch the place of the edge says nothing, and its derivatives grow beyond all bounds.
const LEAST_SINE: f64 = 0.1;

/// A patch that is trimmed, with the patch of the function that is positive where it is there.
#[derive(Clone, Copy)]
pub(super) struct Trimmed<'a> {
    pub(super) instance: &'a dyn Instance,
    pub(super) patch: usize,
    pub(super) keep: usize,
    pub(super) domain: &'a Domain,
    /// u and v of the patch's facets.
    pub(super) lines: [&'a [f64]; 2],
    /// Feet are exact to this. Millimetres.
    pub(super) tolerance: f64,
}

/// The way of one point's foot along the edge.
struct Walk {
    index: usize,
    at: DVec2,
    best: Foot,
    /// At the best foot so far: the direction of the edge, and the step of a millimetre to what is there.
    along: DVec2,
    inward: DVec2,
    /// The step along the edge that led from there, and whether it leads inward as well.
    step: f64,
    inset: bool,
    /// The length of the direction there, and the slope of half of the squared distance along the edge. Millimetres.
    length: f64,
    pull: f64,
}

/// A surface and the function of what is there at a place.
struct Here {
    point: DVec3,
    du: DVec3,
    dv: DVec3,
    value: f64,
    slope: DVec2,
}

impl Here {
    fn new(surface: &Partials, keep: &Partials) -> Self {
        let [point, du, dv] = [surface.point, surface.du, surface.dv].map(DVec3::from_array);
        Self { point, du, dv, value: keep.point[0], slope: DVec2::new(keep.du[0], keep.dv[0]) }
    }

    /// The step within (u, v) along which the function grows the most, and how much it grows: by the square of its
    /// slope on the surface. Along one of both alone where the other is at its end.
    fn steepest(&self, held: [bool; 2]) -> (DVec2, f64) {
        let (e, f, g) = (self.du.dot(self.du), self.du.dot(self.dv), self.dv.dot(self.dv));
        let DVec2 { x, y } = self.slope;
        let step = match held {
            [false, false] => DVec2::new(g * x - f * y, e * y - f * x) / (e * g - f * f),
            [true, false] => DVec2::new(0.0, y / g),
            [false, true] => DVec2::new(x / e, 0.0),
            [true, true] => DVec2::ZERO,
        };
        (step, step.dot(self.slope))
    }

    /// The length of a step on the surface. Millimetres.
    fn length(&self, step: DVec2) -> f64 {
        (self.du * step.x + self.dv * step.y).length()
    }
}

impl Trimmed<'_> {
    /// Moves feet that are not there to the edge, beginning from `start`; those of which no edge is found are
    /// infinitely far.
    ///
    /// # Errors
    /// The patch cannot be evaluated.
    pub(super) fn onto_what_is_there(
        &self,
        q: &[DVec3],
        start: &[[f64; 2]],
        feet: &mut [Foot],
    ) -> Result<(), EvaluationError> {
        let (u, v): (Vec<f64>, Vec<f64>) = feet.iter().map(|foot| (foot.uv[0], foot.uv[1])).unzip();
        let mut keep = vec![[0.0; 3]; feet.len()];
        self.instance.points(self.keep, &u, &v, &mut keep)?;
        // Where the end of a hole is flush with a border of the patch, the function is zero along that, and nothing is
        // there beside it.
        let absent: Vec<usize> = (0..feet.len()).filter(|i| !(keep[*i][0] > ON_EDGE)).collect();
        if absent.is_empty() {
            return Ok(());
        }
        // From the foot on the whole patch the edge beside it is found; from the facet the one that leads around what
        // is not there. Beside a tangent edge the function may lead from either to another edge.
        let mut beside: Vec<Foot> = feet.to_vec();
        let from: Vec<(usize, DVec2)> = absent.iter().map(|i| (*i, DVec2::from_array(feet[*i].uv))).collect();
        self.walk(&from, q, &mut beside)?;
        let from: Vec<(usize, DVec2)> = absent.iter().map(|i| (*i, DVec2::from_array(start[*i]))).collect();
        self.walk(&from, q, feet)?;
        for i in &absent {
            if beside[*i].d2 < feet[*i].d2 {
                feet[*i] = beside[*i];
            }
        }
        let lost: Vec<usize> = absent.into_iter().filter(|i| !feet[*i].d2.is_finite()).collect();
        let from = self.edges_near(&lost, q, feet)?;
        self.walk(&from, q, feet)
    }

    /// Walks along the edge from places near it. Feet of which no edge is found are infinitely far and keep their
    /// places.
    fn walk(&self, from: &[(usize, DVec2)], q: &[DVec3], feet: &mut [Foot]) -> Result<(), EvaluationError> {
        let begin = |(index, at): &(usize, DVec2)| Walk {
            index: *index,
            at: *at,
            best: Foot { d2: f64::INFINITY, ..feet[*index] },
            along: DVec2::ZERO,
            inward: DVec2::ZERO,
            step: 0.0,
            inset: false,
            length: 0.0,
            pull: 0.0,
        };
        let mut walks: Vec<Walk> = from.iter().map(begin).collect();
        for _ in 0..EDGE_EVALUATIONS {
            if walks.is_empty() {
                break;
            }
            let here = self.here(&walks)?;
            let mut goes_on = Vec::with_capacity(walks.len());
            for (mut walk, here) in walks.into_iter().zip(here) {
                let q = q[walk.index];
                if self.advance(&mut walk, &here, q) {
                    goes_on.push(walk);
                } else {
                    feet[walk.index] = walk.best;
                }
            }
            walks = goes_on;
        }
        walks.into_iter().for_each(|walk| feet[walk.index] = walk.best);
        Ok(())
    }

    fn here(&self, walks: &[Walk]) -> Result<Vec<Here>, EvaluationError> {
        let (u, v): (Vec<f64>, Vec<f64>) = walks.iter().map(|walk| (walk.at.x, walk.at.y)).unzip();
        let mut surface = vec![Partials::default(); walks.len()];
        self.instance.partials(self.patch, &u, &v, &mut surface)?;
        let mut keep = vec![Partials::default(); walks.len()];
        self.instance.partials(self.keep, &u, &v, &mut keep)?;
        Ok(surface.iter().zip(&keep).map(|(surface, keep)| Here::new(surface, keep)).collect())
    }

    /// Takes a step; false where the walk ends.
    fn advance(&self, walk: &mut Walk, here: &Here, q: DVec3) -> bool {
        let (step, gain) = here.steepest(self.held(walk.at, -here.value.signum() * here.slope));
        let onto = step * (-here.value / gain);
        // What is there beside an edge is not beyond the patch.
        let (_, beside) = here.steepest(self.held(walk.at, here.slope));
        if !(gain > 0.0 && beside > 0.0 && onto.is_finite()) {
            return self.off_level(walk, here);
        }
        walk.inset = false;
        if here.length(onto) > EDGE_ERRORS * self.tolerance {
            walk.at = self.within(walk.at + onto);
            return true;
        }
        let r = here.point - q;
        let d2 = r.length_squared();
        if d2 >= walk.best.d2 {
            return self.step_back(walk, here);
        }
        let along = here.slope.perp();
        let tangent = here.du * along.x + here.dv * along.y;
        let (length, pull) = (tangent.length(), r.dot(tangent) / tangent.length());
        // The second derivative along the edge is 1 on a straight one; elsewhere the last step tells.
        let bend = (pull - walk.pull) / (walk.step * walk.length);
        let bend = if bend > 0.0 { bend.clamp(LEAST_BEND, MOST_BEND) } else { 1.0 };
        let step = -pull / (bend * length);
        let held = self.held(walk.at, along * step);
        let ends = held != [false; 2] || !step.is_finite();
        let (steepest, gain) = here.steepest(if ends { held } else { [false; 2] });
        let gradient = DVec2::new(r.dot(here.du), r.dot(here.dv));
        let hold = if gain > LEAST_SINE * LEAST_SINE { gradient.dot(steepest) / gain } else { 0.0 };
        let normal = here.du.cross(here.dv);
        walk.best = Foot { uv: walk.at.to_array(), point: here.point, normal, d2, hold, ..Foot::default() };
        (walk.along, walk.inward, walk.step) = (along, steepest / gain.sqrt(), step);
        (walk.length, walk.pull) = (length, pull);
        walk.at = self.within(walk.at + along * step);
        !ends && here.length(along * step) > self.tolerance
    }

    /// From a place where the function does not change, as where surfaces of two solids coincide: to what is there as
    /// far as the step along the edge was long, from where the function leads to its zero.
    fn off_level(&self, walk: &mut Walk, here: &Here) -> bool {
        if !walk.best.d2.is_finite() {
            return false;
        }
        if walk.inset {
            walk.inset = false;
            return self.step_back(walk, here);
        }
        walk.inset = true;
        let along = walk.along * walk.step;
        walk.at = self.within(DVec2::from_array(walk.best.uv) + along + walk.inward * here.length(along));
        true
    }

    /// A shorter step from the best foot so far.
    fn step_back(&self, walk: &mut Walk, here: &Here) -> bool {
        walk.step *= EDGE_BACKTRACK;
        walk.at = self.within(DVec2::from_array(walk.best.uv) + walk.along * walk.step);
        here.length(walk.along * walk.step) > self.tolerance
    }

    /// Places on the edge between the feet of points on the whole patch and what is there of the facets' vertices next
    /// to the points; none of points of which nothing is there.
    fn edges_near(&self, lost: &[usize], q: &[DVec3], whole: &[Foot]) -> Result<Vec<(usize, DVec2)>, EvaluationError> {
        if lost.is_empty() {
            return Ok(Vec::new());
        }
        let [u, v] = self.lines;
        let (mut keeps, mut points) = (vec![[0.0; 3]; u.len() * v.len()], vec![[0.0; 3]; u.len() * v.len()]);
        self.instance.points_grid(self.keep, u, v, &mut keeps)?;
        self.instance.points_grid(self.patch, u, v, &mut points)?;
        let place = |k: usize| DVec2::new(u[k % u.len()], v[k / u.len()]);
        let there: Vec<usize> = (0..keeps.len()).filter(|k| keeps[*k][0] > 0.0).collect();
        let nearest = |i: usize| {
            let off = |k: &usize| DVec3::from_array(points[*k]).distance_squared(q[i]);
            there.iter().min_by(|a, b| off(a).total_cmp(&off(b))).map(|k| place(*k))
        };
        let mut ways: Vec<(usize, DVec2, DVec2)> =
            lost.iter().filter_map(|i| Some((*i, nearest(*i)?, DVec2::from_array(whole[*i].uv)))).collect();
        for _ in 0..EDGE_BISECTIONS {
            let middle = |(_, a, b): &(usize, DVec2, DVec2)| (0.5 * (a.x + b.x), 0.5 * (a.y + b.y));
            let (u, v): (Vec<f64>, Vec<f64>) = ways.iter().map(middle).unzip();
            let there = self.instance.is_there(Some(self.keep), &u, &v)?;
            for (k, (_, inside, outside)) in ways.iter_mut().enumerate() {
                *if there[k] { inside } else { outside } = DVec2::new(u[k], v[k]);
            }
        }
        Ok(ways.into_iter().map(|(i, inside, _)| (i, inside)).collect())
    }

    /// Which of u and v are at their ends, beyond which a step would lead.
    fn held(&self, at: DVec2, step: DVec2) -> [bool; 2] {
        [0, 1].map(|k| {
            let (t, step) = (at[k], step[k]);
            !self.domain.closed[k] && ((t <= 0.0 && step < 0.0) || (t >= 1.0 && step > 0.0))
        })
    }

    /// A place within the patch.
    fn within(&self, at: DVec2) -> DVec2 {
        let inside = |k: usize| if self.domain.closed[k] { at[k].rem_euclid(1.0) } else { at[k].clamp(0.0, 1.0) };
        DVec2::new(inside(0), inside(1))
    }
}
