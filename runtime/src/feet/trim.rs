//! Facets of trimmed patches. The function that is positive where a patch is there is known at the facets' vertices;
//! between them it is taken for linear, and what lies beyond its zero is no part of a facet.

use super::gauge::Lines;
use super::tree::triangle_closest;
use super::tuning::{EDGE_ROUNDS, MOST_LINES, SLIVERS};
use crate::model::{EvaluationError, Instance, Partials};
use glam::{DVec2, DVec3};

/// The function of what is there at a vertex: positive where the patch is there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Keep {
    /// Millimetres, in the library's solids.
    pub(super) value: f64,
    /// Its derivatives by u and v, where a vertex of the same cell is level and this one is not; elsewhere 0.
    pub(super) slope: [f64; 2],
}

/// Values below this, in millimetres, say on which side of an edge a place is, but not how far from it: surfaces that
/// coincide are told apart a millionth of a millimetre beside them.
const LEVEL: f64 = 1e-5;

/// How much nearer to the corner that is there the edge is taken to be, as a part of a side: what is nearest to a point
/// is then a little within, where the function says where its zero is.
const WITHIN: f64 = 0.01;

/// The function bends in a cell if it is off a bilinear one by this share of its values at the corners. Along the edge
/// of a hole of radius r it is so by c^2 / (8 r) in a cell as wide as c: a fiftieth for 5 mm and 0.8 mm.
const BENT: f64 = 0.05;

impl Keep {
    /// Of a patch that is not trimmed.
    pub(super) const EVERYWHERE: Self = Self { value: f64::INFINITY, slope: [0.0; 2] };
    /// Of one that cannot be evaluated.
    pub(super) const NOWHERE: Self = Self { value: f64::NEG_INFINITY, slope: [0.0; 2] };

    pub(super) fn is_there(&self) -> bool {
        self.value > 0.0
    }

    fn is_level(&self) -> bool {
        self.value.abs() < LEVEL
    }

    /// Where on the way to a corner that is not there the edge is, as a part of the way.
    fn cut(&self, absent: &Self, way: [f64; 2]) -> f64 {
        let change = |keep: &Self| keep.slope[0] * way[0] + keep.slope[1] * way[1];
        let s = match (self.is_level(), absent.is_level()) {
            (false, false) => self.value / (self.value - absent.value),
            (false, true) => -self.value / change(self),
            (true, false) => 1.0 - absent.value / change(absent),
            (true, true) => 0.5,
        };
        if s.is_finite() { (s - WITHIN).clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// A triangle of a facet that the edge crosses.
pub(super) struct Crossed {
    pub(super) keep: [Keep; 3],
    /// Of the corners.
    pub(super) uv: [[f64; 2]; 3],
}

impl Crossed {
    /// The point of what is there that is nearest to q, as weights of the corners, and its squared distance. None where
    /// nothing is there.
    pub(super) fn closest(&self, q: DVec3, corners: [DVec3; 3]) -> Option<([f64; 3], f64)> {
        let mut nearest: Option<([f64; 3], f64)> = None;
        for piece in self.pieces().iter().flatten() {
            let position = |w: [f64; 3]| corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2];
            let (weights, d2) = triangle_closest(q, position(piece[0]), position(piece[1]), position(piece[2]));
            if nearest.is_none_or(|(_, least)| d2 < least) {
                nearest = Some(([0, 1, 2].map(|c| (0..3).map(|k| weights[k] * piece[k][c]).sum()), d2));
            }
        }
        nearest
    }

    /// Triangles that make up what is there, by the weights of the corners.
    pub(super) fn pieces(&self) -> [Option<[[f64; 3]; 3]>; 2] {
        let corner = |k: usize| {
            let mut weights = [0.0; 3];
            weights[k % 3] = 1.0;
            weights
        };
        let is_there = self.keep.map(|keep| keep.is_there());
        let cut = |there: usize, absent: usize| {
            let (there, absent) = (there % 3, absent % 3);
            let way = [0, 1].map(|k| self.uv[absent][k] - self.uv[there][k]);
            let s = self.keep[there].cut(&self.keep[absent], way);
            let mut weights = [0.0; 3];
            (weights[there], weights[absent]) = (1.0 - s, s);
            weights
        };
        let alone = |there: bool| (0..3).find(|k| is_there[*k] == there).unwrap_or(0);
        match is_there.iter().filter(|there| **there).count() {
            0 => [None, None],
            1 => {
                let k = alone(true);
                [Some([corner(k), cut(k, k + 1), cut(k, k + 2)]), None]
            }
            2 => {
                let k = alone(false);
                let (first, last) = (cut(k + 1, k), cut(k + 2, k));
                [Some([corner(k + 1), corner(k + 2), last]), Some([corner(k + 1), last, first])]
            }
            _ => [Some([corner(0), corner(1), corner(2)]), None],
        }
    }
}

/// A patch that is trimmed, and the patch of the function of what is there.
#[derive(Clone, Copy)]
pub(super) struct Patches {
    pub(super) patch: usize,
    pub(super) keep: usize,
}

/// The function of what is there of a patch on a grid whose cells are divided.
struct Sampled {
    points: Vec<[f64; 3]>,
    keeps: Vec<Keep>,
    /// Of the lines of u and of v.
    at: [Vec<f64>; 2],
    /// Lines of u.
    width: usize,
    /// The first and the last line of every cell.
    ends: [Vec<[usize; 2]>; 2],
}

/// The function of what is there on a grid, u running fastest. Slopes are evaluated beside level vertices only, where
/// [`Keep::cut`] asks for them: they take twice the time of the values.
///
/// # Errors
/// It cannot be evaluated.
pub(super) fn keeps_on_grid(
    instance: &dyn Instance,
    keep: usize,
    u: &[f64],
    v: &[f64],
) -> Result<Vec<Keep>, EvaluationError> {
    let mut values = vec![[0.0; 3]; u.len() * v.len()];
    instance.points_grid(keep, u, v, &mut values)?;
    let mut keeps: Vec<Keep> = values.iter().map(|value| Keep { value: value[0], slope: [0.0; 2] }).collect();
    let beside = beside_level(&keeps, u.len());
    let (of_u, of_v): (Vec<f64>, Vec<f64>) = beside.iter().map(|k| (u[k % u.len()], v[k / u.len()])).unzip();
    let mut partials = vec![Partials::default(); beside.len()];
    instance.partials(keep, &of_u, &of_v, &mut partials)?;
    beside.into_iter().zip(&partials).for_each(|(k, p)| keeps[k].slope = [p.du[0], p.dv[0]]);
    Ok(keeps)
}

/// The vertices of a grid that are not level and share a cell with one that is.
fn beside_level(keeps: &[Keep], width: usize) -> Vec<usize> {
    let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
    let mut beside: Vec<usize> = Vec::new();
    for level in (0..keeps.len()).filter(|k| keeps[*k].is_level()) {
        let [i, j] = [level % width, level / width];
        let cells = around(j, keeps.len() / width).flat_map(|j| around(i, width).map(move |i| j * width + i));
        beside.extend(cells.filter(|k| !keeps[*k].is_level()));
    }
    beside.sort_unstable();
    beside.dedup();
    beside
}

/// One cell of it.
struct Cell<'s> {
    sampled: &'s Sampled,
    place: [usize; 2],
}

impl Sampled {
    /// None where the patch cannot be evaluated.
    fn new(instance: &dyn Instance, patches: Patches, lines: &[Lines; 2], parts: usize) -> Option<Self> {
        let fine = lines.each_ref().map(|lines| lines.finer(|cell| lines.has_facets[cell], parts));
        let width = fine[0].at.len();
        let mut points = vec![[0.0; 3]; width * fine[1].at.len()];
        instance.points_grid(patches.patch, &fine[0].at, &fine[1].at, &mut points).ok()?;
        let keeps = keeps_on_grid(instance, patches.keep, &fine[0].at, &fine[1].at).ok()?;
        let ends = lines.each_ref().map(|lines| lines.ends(parts));
        Some(Self { points, keeps, at: fine.map(|lines| lines.at), width, ends })
    }

    /// The cells that have facets.
    fn cells<'s>(&'s self, lines: &[Lines; 2]) -> Vec<Cell<'s>> {
        let [columns, rows] =
            lines.each_ref().map(|lines| (0..lines.has_facets.len()).filter(|k| lines.has_facets[*k]));
        let columns: Vec<usize> = columns.collect();
        rows.flat_map(|j| columns.iter().map(move |i| Cell { sampled: self, place: [*i, j] })).collect()
    }
}

impl Cell<'_> {
    fn keep(&self, i: usize, j: usize) -> Keep {
        self.sampled.keeps[j * self.sampled.width + i]
    }

    fn ends(&self) -> [[usize; 2]; 2] {
        [0, 1].map(|k| self.sampled.ends[k][self.place[k]])
    }

    /// Its corners, counterclockwise in (u, v): their lines of u and of v.
    fn corners(&self) -> [[usize; 2]; 4] {
        let [[left, right], [low, high]] = self.ends();
        [[left, low], [right, low], [right, high], [left, high]]
    }

    /// All places in it as fractions, with the function of what is there.
    fn samples(&self) -> impl Iterator<Item = ([f64; 2], Keep)> {
        let [[left, right], [low, high]] = self.ends();
        let fraction = |at: usize, first: usize, last: usize| (at - first) as f64 / (last - first) as f64;
        (low..=high).flat_map(move |j| {
            let place = move |i: usize| ([fraction(i, left, right), fraction(j, low, high)], self.keep(i, j));
            (left..=right).map(place)
        })
    }

    /// All places in it as fractions, with whether something is there.
    fn inside(&self) -> impl Iterator<Item = ([f64; 2], bool)> {
        self.samples().map(|(at, keep)| (at, keep.is_there()))
    }

    /// Its sides along u and along v. Millimetres.
    fn sides(&self) -> [f64; 2] {
        let [a, b, c, d] = self.corners().map(|[i, j]| DVec3::from(self.sampled.points[j * self.sampled.width + i]));
        [a.distance(b).max(c.distance(d)), a.distance(d).max(b.distance(c))]
    }

    /// Something in it is there, or is not, that its corners do not show.
    fn hides_something(&self) -> bool {
        let there = self.corners().map(|[i, j]| self.keep(i, j).is_there());
        there.iter().all(|t| *t == there[0]) && self.is_mixed()
    }

    /// Something in it is there, and something is not.
    fn is_mixed(&self) -> bool {
        let [i, j] = self.corners()[0];
        let first = self.keep(i, j).is_there();
        self.inside().any(|(_, there)| there != first)
    }

    /// The function of what is there bends in it, as at a corner.
    fn is_bent(&self) -> bool {
        let corners = self.corners().map(|[i, j]| self.keep(i, j).value);
        let range = corners.iter().fold(0.0_f64, |range, value| range.max(value.abs()));
        self.samples().any(|([s, t], keep)| {
            let weights = [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t];
            let straight: f64 = weights.iter().zip(corners).map(|(weight, value)| weight * value).sum();
            (keep.value - straight).abs() > BENT * range
        })
    }

    /// How far the edge is from where its facet has it. Millimetres.
    fn error(&self) -> f64 {
        let corners = self.corners();
        let keep = corners.map(|[i, j]| self.keep(i, j));
        let uv = corners.map(|[i, j]| [self.sampled.at[0][i], self.sampled.at[1][j]]);
        let fraction = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let pieces: Vec<[[f64; 2]; 3]> = [[0, 1, 2], [0, 2, 3]]
            .into_iter()
            .flat_map(|k: [usize; 3]| {
                let place = move |w: [f64; 3]| [0, 1].map(|c| (0..3).map(|m| w[m] * fraction[k[m]][c]).sum::<f64>());
                let crossed = Crossed { keep: k.map(|k| keep[k]), uv: k.map(|k| uv[k]) };
                crossed.pieces().into_iter().flatten().map(move |piece| piece.map(place))
            })
            .collect();
        let wrong = self.inside().filter_map(|(at, there)| {
            let q = DVec2::from(at);
            let off = pieces.iter().map(|piece| from_triangle(q, piece.map(DVec2::from)));
            let off = off.fold(f64::INFINITY, f64::min);
            // Outside of the facet by so much, or inside: then by no more than to the nearest place that is there.
            match (there, off > 0.0) {
                (true, true) => Some(off),
                (false, false) => Some(self.to_there(at)),
                _ => None,
            }
        });
        let [along, across] = self.sides();
        wrong.fold(0.0, f64::max).min(1.0) * along.hypot(across)
    }

    /// The distance of a place in it to the nearest one that is there.
    fn to_there(&self, [s, t]: [f64; 2]) -> f64 {
        let there = self.inside().filter(|(_, there)| *there);
        there.map(|([x, y], _)| (x - s).hypot(y - t)).fold(1.0, f64::min)
    }
}

/// The distance of a place from a triangle.
fn from_triangle(q: DVec2, corners: [DVec2; 3]) -> f64 {
    let [a, b, c] = corners.map(|p| p.extend(0.0));
    triangle_closest(q.extend(0.0), a, b, c).1.sqrt()
}

/// Divides columns and rows of a grid in which something of a patch is there, or is not, that the vertices do not show:
/// the rim of a thin wall, a small hole; and those through which an edge passes and that are wider than `cell`. Returns
/// how far the edge is from that of the facets, about; None where all of the patch is there, or nothing. Millimetres.
pub(super) fn divide_at_edges(
    instance: &dyn Instance,
    patches: Patches,
    lines: &mut [Lines; 2],
    cell: f64,
) -> Option<f64> {
    for _ in 0..EDGE_ROUNDS {
        let sampled = Sampled::new(instance, patches, lines, SLIVERS)?;
        let mut divided = lines.each_ref().map(|lines| vec![false; lines.has_facets.len()]);
        for of_grid in sampled.cells(lines).iter().filter(|cell| cell.is_mixed()) {
            let (hides, sides) = (of_grid.hides_something(), of_grid.sides());
            (0..2).filter(|k| hides || sides[*k] > 2.0 * cell).for_each(|k| divided[k][of_grid.place[k]] = true);
        }
        let added = divided.each_ref().map(|d| d.iter().filter(|d| **d).count() * (SLIVERS - 1));
        let fits = (0..2).all(|k| lines[k].at.len() + added[k] <= MOST_LINES);
        if added == [0; 2] || !fits {
            break;
        }
        for (lines, divided) in lines.iter_mut().zip(&divided) {
            *lines = lines.finer(|cell| divided[cell], SLIVERS);
        }
    }
    let sampled = Sampled::new(instance, patches, lines, 2)?;
    // A corner of what is there hides between the middle of a cell and its corners.
    let closer = |cell: &Cell<'_>| {
        let [i, j] = cell.place;
        let alone = [lines[0].cell(i), lines[1].cell(j)];
        let sampled = Sampled::new(instance, patches, &alone, SLIVERS)?;
        sampled.cells(&alone).first().map(Cell::error)
    };
    let error = |cell: &Cell<'_>| {
        let closer = if cell.is_bent() { closer(cell) } else { None };
        cell.error().max(closer.unwrap_or(0.0))
    };
    let cells = sampled.cells(lines);
    cells.iter().filter(|cell| cell.is_mixed()).map(error).reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle in the plane of x and y, with a function that is linear there.
    fn crossed(values: [f64; 3]) -> Crossed {
        let slope = [values[1] - values[0], values[2] - values[0]];
        Crossed { keep: values.map(|value| Keep { value, slope }), uv: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]] }
    }

    const CORNERS: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn what_is_there_of_a_triangle_is_nearest_a_little_within_its_edge() {
        // There where x + y < 1/2.
        let (weights, d2) = crossed([0.5, -0.5, -0.5]).closest(DVec3::new(0.5, 0.5, 1.0), CORNERS).unwrap();
        let within = 0.5 - WITHIN;
        assert!((weights[1] - within / 2.0).abs() < 1e-12 && (weights[2] - within / 2.0).abs() < 1e-12);
        assert!((d2 - (1.0 + 2.0 * (0.5 - within / 2.0).powi(2))).abs() < 1e-12, "{d2}");
        // There where x + y > 1/2: above what is there the foot is that of the triangle.
        let there = crossed([-0.5, 0.5, 0.5]);
        let (weights, d2) = there.closest(DVec3::new(0.4, 0.4, 1.0), CORNERS).unwrap();
        assert!((d2 - 1.0).abs() < 1e-12 && (weights[1] - 0.4).abs() < 1e-12, "{d2} {weights:?}");
        assert!(crossed([-1.0; 3]).closest(DVec3::ZERO, CORNERS).is_none());
    }

    #[test]
    fn beside_a_level_side_the_edge_is_where_the_other_side_says() {
        // x - 0.4 where that is positive, and level beyond, as at the flush end of a hole.
        let keep =
            [(-1e-6, [0.0; 2]), (0.6, [1.0, 0.0]), (-1e-6, [0.0; 2])].map(|(value, slope)| Keep { value, slope });
        let pieces = Crossed { keep, uv: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]] }.pieces();
        let least = pieces.iter().flatten().flatten().map(|w| w[1]).fold(1.0, f64::min);
        assert!((least - (0.4 + WITHIN)).abs() < 1e-12, "{least}");
    }

    #[test]
    fn the_pieces_have_the_area_of_what_is_there() {
        let area = |values: [f64; 3]| -> f64 {
            let of = |p: [[f64; 3]; 3]| {
                let [a, b, c] = p.map(|w| (w[1], w[2]));
                (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)
            };
            crossed(values).pieces().into_iter().flatten().map(of).sum()
        };
        for k in 0..3 {
            let mut values = [-1.0; 3];
            values[k] = 1.0;
            // A quarter, and the rest, both turned as the triangle.
            let (quarter, rest) = ((0.5 - WITHIN).powi(2), 1.0 - (0.5 + WITHIN).powi(2));
            assert!((area(values) - quarter).abs() < 1e-12, "{}", area(values));
            assert!((area(values.map(|v| -v)) - rest).abs() < 1e-12);
        }
    }
}
