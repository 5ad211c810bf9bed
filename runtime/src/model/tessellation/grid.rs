//! Patches as grids of vertices between their breaks, with common points along common borders.

use super::borders::Borders;
use super::intervals::{Axes, Interval};
use super::piece::Piece;
use super::{SurfacePoint, unit_normals};
use crate::mesh::Bounds;
use crate::model::{EvaluationError, Instance, Partials, Sites};
use glam::DVec3;
use std::collections::HashMap;

/// How far the points of a curve may be from a piece that is the same one, in tolerances: several roundings add up.
const NEAR: f64 = 10.0;

/// A patch's vertices: at every u of its lines for every v of its lines, u running fastest; a break has two lines, one
/// on either side.
#[derive(Default)]
pub(super) struct Grid {
    pub(super) positions: Vec<DVec3>,
    pub(super) normals: Vec<DVec3>,
    pub(super) origins: Vec<SurfacePoint>,
    /// Triangles by the indices of these vertices.
    pub(super) triangles: Vec<[u32; 3]>,
}

/// The values of a parameter at which a grid has lines.
struct Lines {
    at: Vec<f64>,
    /// The first line of each interval; one more than its segments belong to it.
    first: Vec<usize>,
}

impl Lines {
    fn of(axis: &[Interval]) -> Self {
        let mut lines = Self { at: Vec::new(), first: Vec::new() };
        for interval in axis {
            lines.first.push(lines.at.len());
            lines.at.extend(&interval.values);
        }
        lines
    }

    /// The number of segments of an interval.
    fn segments(&self, interval: usize) -> usize {
        self.first.get(interval + 1).unwrap_or(&self.at.len()) - self.first[interval] - 1
    }

    /// Lines with a cell between them and the next one.
    fn cells<'a>(&'a self) -> impl Iterator<Item = usize> + Clone + 'a {
        let ends = self.first[1..].iter().map(|f| f - 1).chain([self.at.len() - 1]);
        self.first.iter().copied().zip(ends).flat_map(|(first, end)| first..end)
    }
}

/// The points of all borders: for each piece the parameters and positions of its vertices.
pub(super) type BorderPoints = Vec<Vec<(f64, DVec3)>>;

/// Vertices between two neighbours of the border of a grid, by these two.
type Chains = HashMap<(u32, u32), Vec<u32>>;

/// An interval of a border, by a piece of it, with the parameters and positions of all of its vertices.
pub(super) type PlacedInterval<'a> = (&'a Piece, Vec<(f64, DVec3)>);

/// Places the vertices of all pieces of borders: those that are the same curve have the points of the one that is
/// divided most. Also returns the pieces that leave their curve, after all, at one of these points.
///
/// # Errors
/// The surface cannot be evaluated.
pub(super) fn border_points(
    instance: &dyn Instance,
    borders: &Borders,
) -> Result<(BorderPoints, Vec<usize>), EvaluationError> {
    let finest = borders.finest();
    let mut points: BorderPoints = vec![Vec::new(); borders.pieces.len()];
    for (i, piece) in borders.pieces.iter().enumerate().filter(|(i, _)| finest[*i] == *i) {
        let own = &piece.span.values;
        let (u, v): (Vec<f64>, Vec<f64>) = own.iter().map(|t| piece.side.uv(*t)).unzip();
        let mut positions = vec![[0.0; 3]; own.len()];
        instance.points(piece.patch, &u, &v, &mut positions)?;
        points[i] = own.iter().copied().zip(positions.into_iter().map(DVec3::from_array)).collect();
        snap_ends(&mut points[i], piece, borders);
    }
    let mut leaving = Vec::new();
    for (i, piece) in borders.pieces.iter().enumerate().filter(|(i, _)| finest[*i] != *i) {
        let source = &borders.pieces[finest[i]];
        let of_source = &source.span;
        let own = &piece.span;
        let length = of_source.end() - of_source.start();
        let fraction = |t: f64| (t - of_source.start()) / length;
        let mut placed: Vec<(f64, DVec3)> = points[finest[i]].iter().map(|(t, p)| (fraction(*t), *p)).collect();
        if piece.reversed != source.reversed {
            placed = placed.into_iter().rev().map(|(f, p)| (1.0 - f, p)).collect();
        }
        let targets: Vec<DVec3> = placed.iter().map(|p| p.1).collect();
        let guesses: Vec<f64> = placed.iter().map(|p| own.fraction(p.0)).collect();
        let mut found = piece.project(instance, &targets, guesses.clone())?;
        // A guess may lead to another place.
        let near = |found: &[(f64, f64)]| found.iter().all(|f| f.1 <= NEAR * borders.tolerance);
        if !near(&found) {
            found = piece.nearest(instance, &targets)?;
        }
        if !near(&found) {
            leaving.push(i);
        }
        let parameter = |(found, guess): ((f64, f64), f64)| {
            // Equal steps of both are the rule; others are rounding.
            if (found.0 - guess).abs() <= 1e-9 * (own.end() - own.start()) { guess } else { found.0 }
        };
        let mut parameters: Vec<f64> = found.into_iter().zip(guesses).map(parameter).collect();
        let last = parameters.len() - 1;
        (parameters[0], parameters[last]) = (own.start(), own.end());
        points[i] = parameters.into_iter().zip(targets).collect();
    }
    Ok((points, leaving))
}

fn snap_ends(placed: &mut [(f64, DVec3)], piece: &Piece, borders: &Borders) {
    let last = placed.len() - 1;
    placed[0].1 = borders.ends[piece.ends[0] as usize];
    placed[last].1 = borders.ends[piece.ends[1] as usize];
    if piece.is_point {
        placed.iter_mut().for_each(|p| p.1 = borders.ends[piece.ends[0] as usize]);
    }
}

impl Grid {
    /// The grid of a patch, whose pieces of border are given with their points.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub(super) fn new(
        instance: &dyn Instance,
        patch: usize,
        axes: &Axes,
        border: &[PlacedInterval<'_>],
        tolerance: f64,
    ) -> Result<Self, EvaluationError> {
        let [u, v] = axes.each_ref().map(|axis| Lines::of(axis));
        let mut partials = vec![Partials::default(); u.at.len() * v.at.len()];
        instance.partials_grid(patch, &u.at, &v.at, &mut partials)?;
        let (at_u, at_v) = Sites::Grid(&u.at, &v.at).expanded();
        let normals = unit_normals(instance, patch, &at_u, &at_v, &partials)?;
        let mut grid = Self {
            positions: partials.iter().map(|p| DVec3::from_array(p.point)).collect(),
            // A vertex of a patch without area has no normal at all; up is as good as any.
            normals: normals.iter().map(|n| n.unwrap_or(DVec3::Z)).collect(),
            origins: at_u.iter().zip(&at_v).map(|(&u, &v)| SurfacePoint { patch: patch as u32, u, v }).collect(),
            triangles: Vec::new(),
        };
        grid.close_breaks(&u, &v, tolerance);
        let chains = grid.place_border(instance, patch, [&u, &v], border)?;
        grid.triangulate(instance, patch, [&u, &v], &chains)?;
        Ok(if grid.has_area() { grid } else { Self::default() })
    }

    /// Whether it is more than a line or a point: the rim of a thickened surface at a pole is not.
    fn has_area(&self) -> bool {
        const LEAST: f64 = 1e-9;
        let corners = |t: &[u32; 3]| t.map(|i| self.positions[i as usize]);
        let area = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
        let extent = self.positions.iter().copied().collect::<Bounds>().diagonal();
        self.triangles.iter().map(|t| area(corners(t))).sum::<f64>() > LEAST * extent * extent
    }

    /// Gives both lines of a break the same points, unless the surface jumps there.
    fn close_breaks(&mut self, u: &Lines, v: &Lines, tolerance: f64) {
        let width = u.at.len();
        let mut close = |from: usize, to: usize| {
            if self.positions[from].distance(self.positions[to]) <= tolerance {
                self.positions[to] = self.positions[from];
            }
        };
        for first in &u.first[1..] {
            (0..v.at.len()).for_each(|j| close(j * width + first - 1, j * width + first));
        }
        for first in &v.first[1..] {
            (0..width).for_each(|i| close((first - 1) * width + i, first * width + i));
        }
    }

    /// Moves the vertices of the border to their common points, and takes their normals there. Where a border has more
    /// points than the grid has lines, the others become vertices between those of the grid: the result has them by
    /// the two between which they are.
    fn place_border(
        &mut self,
        instance: &dyn Instance,
        patch: usize,
        lines: [&Lines; 2],
        border: &[PlacedInterval<'_>],
    ) -> Result<Chains, EvaluationError> {
        let width = lines[0].at.len();
        let (mut moved, mut chains) = (Vec::new(), Chains::new());
        for (piece, points) in border {
            let first = lines[piece.side.along].first[piece.interval];
            let count = lines[piece.side.along].segments(piece.interval);
            let across = &lines[1 - piece.side.along].at;
            let line = across.partition_point(|at| *at < piece.side.at).min(across.len() - 1);
            let vertex = |k: usize| {
                if piece.side.along == 0 { line * width + first + k } else { (first + k) * width + line }
            };
            let nearest = nearest_points(&lines[piece.side.along].at[first..=first + count], points);
            for k in 0..=count {
                let (t, position) = points[nearest[k]];
                let (u, v) = piece.side.uv(t);
                let vertex = vertex(k);
                self.positions[vertex] = position;
                let origin = &mut self.origins[vertex];
                if (origin.u, origin.v) != (u, v) {
                    (origin.u, origin.v) = (u, v);
                    moved.push(vertex);
                }
            }
            for k in 0..count {
                let between = &points[nearest[k] + 1..nearest[k + 1].max(nearest[k] + 1)];
                if between.is_empty() {
                    continue;
                }
                let chain = between.iter().map(|(t, position)| {
                    let (u, v) = piece.side.uv(*t);
                    moved.push(self.positions.len());
                    self.positions.push(*position);
                    self.normals.push(DVec3::Z);
                    self.origins.push(SurfacePoint { patch: patch as u32, u, v });
                    self.positions.len() as u32 - 1
                });
                let chain: Vec<u32> = chain.collect();
                chains.insert((vertex(k) as u32, vertex(k + 1) as u32), chain);
            }
        }
        let (u, v): (Vec<f64>, Vec<f64>) = moved.iter().map(|i| (self.origins[*i].u, self.origins[*i].v)).unzip();
        let mut partials = vec![Partials::default(); moved.len()];
        instance.partials(patch, &u, &v, &mut partials)?;
        let normals = unit_normals(instance, patch, &u, &v, &partials)?;
        for (vertex, normal) in moved.into_iter().zip(normals) {
            self.normals[vertex] = normal.unwrap_or(DVec3::Z);
        }
        Ok(chains)
    }

    /// Two triangles a cell, over the diagonal that is nearer to the surface, or the shorter one; those that collapse
    /// (at a pole) are left out.
    fn triangulate(
        &mut self,
        instance: &dyn Instance,
        patch: usize,
        [u, v]: [&Lines; 2],
        chains: &Chains,
    ) -> Result<(), EvaluationError> {
        let middle =
            |lines: &Lines| -> Vec<f64> { lines.cells().map(|i| 0.5 * (lines.at[i] + lines.at[i + 1])).collect() };
        let (middle_u, middle_v) = (middle(u), middle(v));
        let mut middles = vec![[0.0; 3]; middle_u.len() * middle_v.len()];
        instance.points_grid(patch, &middle_u, &middle_v, &mut middles)?;
        let mut middles = middles.into_iter().map(DVec3::from_array);
        for j in v.cells() {
            for i in u.cells() {
                let a = (j * u.at.len() + i) as u32;
                let above = a + u.at.len() as u32;
                let cell = [a, a + 1, above + 1, above];
                let middle = middles.next().unwrap_or_default();
                let split = Self::split(cell.map(|i| self.positions[i as usize]), middle);
                for triangle in split.map(|t| t.map(|k: usize| cell[k])) {
                    for triangle in over_chains(triangle, chains) {
                        let [p, q, r] = triangle.map(|i| self.positions[i as usize]);
                        if p != q && q != r && r != p {
                            self.triangles.push(triangle);
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// The corners of the triangles of a cell with a middle.
    fn split([a, b, c, d]: [DVec3; 4], middle: DVec3) -> [[usize; 3]; 2] {
        let normal = (c - a).cross(d - b).normalize_or_zero();
        let [first, second] = [(a, c), (b, d)].map(|(p, q)| (middle - 0.5 * (p + q)).dot(normal).abs());
        let (ac, bd) = (a.distance(c), b.distance(d));
        // Rounding does not choose.
        let rounding = 1e-9 * (ac + bd);
        let over_ac = if (first - second).abs() > rounding { first < second } else { ac <= bd };
        if over_ac { [[0, 1, 2], [0, 2, 3]] } else { [[0, 1, 3], [1, 2, 3]] }
    }
}

/// For every line that meets a border the point of it whose parameter is nearest; the first and the last one at the
/// ends. As far as there are enough, they are different ones.
fn nearest_points(lines: &[f64], points: &[(f64, DVec3)]) -> Vec<usize> {
    let last = points.len() - 1;
    let mut nearest: Vec<usize> = Vec::with_capacity(lines.len());
    for (k, line) in lines.iter().enumerate() {
        let above = points.partition_point(|p| p.0 < *line).min(last);
        let below = above.saturating_sub(1);
        let closest = if points[above].0 - line < line - points[below].0 { above } else { below };
        let least = nearest.last().map_or(0, |previous| (previous + 1).min(last));
        let most = last.saturating_sub(lines.len() - 1 - k);
        nearest.push(if k == 0 { 0 } else { closest.clamp(least.min(most), most) });
    }
    nearest
}

/// The triangles of a triangle whose edges have vertices between their ends: fans from the corner opposite of each.
fn over_chains(triangle: [u32; 3], chains: &Chains) -> Vec<[u32; 3]> {
    let mut triangles = vec![triangle];
    for k in 0..3 {
        let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
        let between: Vec<u32> = match (chains.get(&(a, b)), chains.get(&(b, a))) {
            (Some(chain), _) => chain.clone(),
            (None, Some(chain)) => chain.iter().rev().copied().collect(),
            (None, None) => continue,
        };
        let has_edge = |t: &[u32; 3]| (0..3).find(|c| t[*c] == a && t[(c + 1) % 3] == b);
        let Some((place, corner)) = triangles.iter().enumerate().find_map(|(i, t)| Some((i, has_edge(t)?))) else {
            continue;
        };
        let apex = triangles.swap_remove(place)[(corner + 2) % 3];
        let all: Vec<u32> = [a].into_iter().chain(between).chain([b]).collect();
        triangles.extend(all.windows(2).map(|pair| [pair[0], pair[1], apex]));
    }
    triangles
}
