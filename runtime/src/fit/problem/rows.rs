//! The residual of every point with its row of the Jacobian, for the Gauss-Newton matrix and for the covariance.

use super::loss::PointLoss;
use super::objective::{Chunk, Correspondence, Matched, Objective, Placed};
use super::parameterization::Estimate;
use crate::fit::correspond::foot::{Foot, motions};
use crate::fit::tuning::{CHUNKS_AT_ONCE, KEPT_ROWS};
use crate::model::Instance;
use glam::DVec3;
use rayon::prelude::*;

/// Points of one patch that have a foot.
pub(crate) struct Rows {
    pub(crate) patch: u32,
    /// The variables of the columns: indices of parameters, then, if the motion varies, its shift and its turn.
    pub(crate) columns: Vec<usize>,
    pub(crate) points: Vec<RowPoint>,
    /// d(signed distance)/d(column), row after row.
    pub(crate) jacobian: Vec<f64>,
}

/// A point with its foot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowPoint {
    /// Index among the objective's points.
    pub(crate) index: u32,
    /// From the model's surface to the point, positive on the side of dS/du x dS/dv. Millimetres.
    pub(crate) distance: f64,
    /// The unit direction in which that is positive, in the model's frame.
    pub(crate) away: DVec3,
    /// See `PointLoss`.
    pub(crate) prior: f64,
    /// See `PointLoss`.
    pub(crate) weight: f64,
    /// See `PointLoss`.
    pub(crate) curvature: f64,
    /// The point says where the surface ends, and not where it is: it lies beyond the edge or the crease that its foot
    /// is on, or the scan's surface runs across the model's there. False where only the row was asked for.
    pub(crate) at_end: bool,
}

impl Rows {
    /// Every point with its row.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&RowPoint, &[f64])> {
        // Rows are empty if no parameter varies.
        let width = self.columns.len();
        self.points.iter().enumerate().map(move |(i, point)| (point, &self.jacobian[i * width..(i + 1) * width]))
    }
}

/// The rows of all points at one estimate, for those who go through them more than once.
pub(crate) struct AllRows<'o> {
    objective: &'o Objective<'o>,
    placed: Placed<'o>,
    /// By chunk; None for scans with more than `KEPT_ROWS` points.
    stored: Option<Vec<Vec<Rows>>>,
}

impl<'o> AllRows<'o> {
    /// None where the model does not exist.
    pub(crate) fn new(objective: &'o Objective<'o>, at: &Estimate) -> Option<Self> {
        let placed = objective.place(at).ok()?;
        let mut all = Self { objective, placed, stored: None };
        if objective.points.len() <= KEPT_ROWS {
            let mut stored = Vec::new();
            all.by_chunk(|rows| rows, |rows| stored.push(rows));
            all.stored = Some(stored);
        }
        Some(all)
    }

    /// Sums up the rows of every chunk of points, on all threads, and hands the sums to `each` in the points' order.
    pub(crate) fn fold<T: Send>(
        &self,
        none: impl Fn() -> T + Sync,
        add: impl Fn(&mut T, &Rows) + Sync,
        mut each: impl FnMut(T),
    ) {
        let sum = |rows: &[Rows]| {
            let mut sums = none();
            rows.iter().for_each(|rows| add(&mut sums, rows));
            sums
        };
        match &self.stored {
            Some(stored) => {
                for chunks in stored.chunks(CHUNKS_AT_ONCE) {
                    let made: Vec<T> = chunks.par_iter().map(|rows| sum(rows)).collect();
                    made.into_iter().for_each(&mut each);
                }
            }
            None => self.by_chunk(|rows| sum(&rows), each),
        }
    }

    /// Computes the rows of every chunk, on all threads; what `made` makes of them goes to `each` in the points' order.
    fn by_chunk<T: Send>(&self, made: impl Fn(Vec<Rows>) -> T + Sync, mut each: impl FnMut(T)) {
        let Self { objective, placed, .. } = self;
        let mut cache = objective.follow(placed);
        for chunks in objective.chunks(cache.as_deref_mut()).chunks_mut(CHUNKS_AT_ONCE) {
            let made: Vec<T> =
                chunks.par_iter_mut().map(|chunk| made(objective.rows_of_chunk(placed, chunk))).collect();
            made.into_iter().for_each(&mut each);
        }
    }
}

/// The derivatives of where a trimmed patch is there, at feet on its edge.
struct Edges<'m> {
    /// Parameters, ascending; those of a patch, whether its feet are on an edge or not, so that all of its rows have
    /// the same columns.
    active: &'m [u32],
    /// Empty where no foot is on an edge.
    jacobian: Vec<f64>,
}

impl<'m> Edges<'m> {
    /// None where the function of what is there cannot be evaluated.
    fn new(objective: &Objective<'m>, instance: &dyn Instance, patch: usize, feet: &[Foot]) -> Option<Self> {
        let active = objective.space.model.keep_active(patch);
        let Some(keep) = objective.edge(patch, feet) else { return Some(Self { active, jacobian: Vec::new() }) };
        let (u, v): (Vec<f64>, Vec<f64>) = feet.iter().map(|f| (f.uv[0], f.uv[1])).unzip();
        let mut jacobian = vec![0.0; feet.len() * active.len() * 3];
        instance.jacobian(keep, &u, &v, &mut jacobian).ok()?;
        Some(Self { active, jacobian })
    }

    /// The slope at a foot by the parameter of a rank among those that are active.
    fn slope(&self, foot: usize, rank: usize) -> f64 {
        self.jacobian.get((foot * self.active.len() + rank) * 3).copied().unwrap_or(0.0)
    }
}

impl Objective<'_> {
    fn rows_of_chunk(&self, placed: &Placed, chunk: &mut Chunk) -> Vec<Rows> {
        let inverse = placed.motion.rotation.inverse();
        let at_end = |foot: &Foot, point: &Correspondence| {
            let around = self.points.around.get(point.index).map_or(DVec3::ZERO, |n| inverse * *n);
            !self.is_above(foot, point.q) || runs_across(foot, around)
        };
        let rows = |m: &Matched| self.rows_by(&*placed.instance, m, Self::away_by_normal, at_end);
        self.matched(placed, chunk).iter().filter_map(rows).collect()
    }

    /// The patch of the function of what is there of one that holds some of the feet on it at its edge.
    pub(super) fn edge(&self, patch: usize, feet: &[Foot]) -> Option<usize> {
        self.layout.keep(patch).filter(|_| feet.iter().any(|foot| foot.hold != 0.0))
    }

    /// The rows of points that have their feet on one patch; None where that cannot be evaluated.
    pub(crate) fn rows(&self, instance: &dyn Instance, matched: &Matched) -> Option<Rows> {
        self.rows_by(instance, matched, Self::away, |_, _| false)
    }

    /// The same with the direction and the distance from a foot to its point, and whether that is at an end, by
    /// functions.
    fn rows_by(
        &self,
        instance: &dyn Instance,
        matched: &Matched,
        away: impl Fn(&Self, &Foot, DVec3) -> (DVec3, f64),
        at_end: impl Fn(&Foot, &Correspondence) -> bool,
    ) -> Option<Rows> {
        let Matched { patch, points: matches, feet, losses } = matched;
        let active = &self.space.model.parts()[*patch].active;
        let slopes = motions(instance, *patch, feet, active.len()).ok()?;
        let edges = Edges::new(self, instance, *patch, feet)?;
        // Columns of parameters that do not vary would be summed in vain.
        let mut varied: Vec<u32> = active.iter().chain(edges.active).copied().collect();
        varied.sort_unstable();
        varied.dedup();
        varied.retain(|p| self.space.varies(*p as usize));
        // The places of the columns among the derivatives of the surface, and of its edge.
        let place = |p: &u32| (active.binary_search(p).ok(), edges.active.binary_search(p).ok());
        let places: Vec<(Option<usize>, Option<usize>)> = varied.iter().map(place).collect();
        let n = self.space.model.parameters().len();
        let motion = if self.space.moving { n..n + 6 } else { n..n };
        let columns: Vec<usize> = varied.iter().map(|p| *p as usize).chain(motion).collect();
        let mut jacobian = Vec::with_capacity(feet.len() * columns.len());
        let mut points = Vec::with_capacity(feet.len());
        for (i, ((foot, point), loss)) in feet.iter().zip(matches).zip(losses).enumerate() {
            let (away, distance) = away(self, foot, point.q);
            let PointLoss { prior, weight, curvature, .. } = *loss;
            let at_end = at_end(foot, point);
            points.push(RowPoint { index: point.index as u32, distance, away, prior, weight, curvature, at_end });
            let slopes = &slopes[i * active.len() * 3..(i + 1) * active.len() * 3];
            // The surface moving outwards brings it nearer to a point outside. At the edge of a trimmed patch as much
            // of the distance changes as the edge moves towards the point; a point above its foot is at no edge.
            let hold = if away == foot.normal.normalize_or_zero() { 0.0 } else { foot.hold / distance };
            jacobian.extend(places.iter().map(|(of_surface, of_edge)| {
                let surface = of_surface.map_or(0.0, |a| away.dot(DVec3::from_slice(&slopes[3 * a..])));
                -surface - of_edge.map_or(0.0, |a| hold * edges.slope(i, a))
            }));
            if self.space.moving {
                let turn = (foot.point - self.space.centre).cross(away);
                jacobian.extend([-away.x, -away.y, -away.z, -turn.x, -turn.y, -turn.z]);
            }
        }
        Some(Rows { patch: *patch as u32, columns, points, jacobian })
    }

    /// As `away`, but along the surface's normal where the two hardly differ: that is the error of the foot, and must
    /// not pass for information on what moves the surface within itself.
    fn away_by_normal(&self, foot: &Foot, q: DVec3) -> (DVec3, f64) {
        let (away, distance) = self.away(foot, q);
        (if self.is_above(foot, q) { foot.normal.normalize_or_zero() } else { away }, distance)
    }

    /// Whether a point lies above its foot, along the surface's normal, or so near that the foot's error decides.
    fn is_above(&self, foot: &Foot, q: DVec3) -> bool {
        let above = (q - foot.point).dot(foot.normal.normalize_or_zero()).powi(2) >= ABOVE * foot.d2;
        above || foot.d2 < (FOOT_ERRORS * self.tolerance).powi(2)
    }

    /// The unit direction from the foot to the point, turned to the normal's side, and the signed distance. Near zero
    /// the direction is noise, and the surface's normal takes its place.
    fn away(&self, foot: &Foot, q: DVec3) -> (DVec3, f64) {
        let normal = foot.normal.normalize_or_zero();
        let d = foot.d2.sqrt();
        let along = (q - foot.point).dot(normal);
        if d > 1e-6 * self.loss.sigma {
            let sign = if along < 0.0 { -1.0 } else { 1.0 };
            ((q - foot.point) * (sign / d), sign * d)
        } else {
            (normal, along)
        }
    }
}

/// The squared cosine between the normal and the way to a point that lies above its foot, and not beyond an edge.
const ABOVE: f64 = 0.99;

/// Distances below so many of the feet's tolerance are no direction.
const FOOT_ERRORS: f64 = 10.0;

/// The cosine between the normals of scan and model below which the one's surface runs across the other's: where a scan
/// is cut off, its last points lie a little beyond the model's end face, which nothing else shows.
const ACROSS: f64 = 0.5;

/// Whether the scan's surface, by its normal about a point (zero where there is none), runs across the model's at the
/// point's foot.
fn runs_across(foot: &Foot, normal: DVec3) -> bool {
    normal != DVec3::ZERO && normal.dot(foot.normal.normalize_or_zero()).abs() < ACROSS
}
