//! The resolution that a patch's grid of facets needs.

use super::domain::{Domain, Stretch};
use super::trim::{Patches, divide_at_edges};
use super::tuning::{CELLS_OF_SIZE, CURVATURE_CELLS, LEAST_CURVATURE_CELLS, MOST_CELLS, MOST_STRETCHES, TRIMMED_CELLS};
use crate::model::{Breaks, Instance, Trail};
use glam::DVec3;

/// The lines of a patch's grid and how far its facets are off.
#[derive(Default)]
pub(super) struct Gauge {
    /// u of the columns and v of the rows.
    pub(super) lines: [Lines; 2],
    pub(super) domain: Domain,
    /// By which the domain's breaks are found again where parameters have moved them.
    pub(super) trail: Trail,
    /// The chord error of the cells, both directions together. Millimetres.
    pub(super) sagitta: f64,
    /// How far the edge of a trimmed patch may be from that of its facets, about. Millimetres.
    pub(super) edge_error: f64,
}

/// Lines of a grid along u or along v.
#[derive(Clone, Debug, Default)]
pub(super) struct Lines {
    /// The parameter's values, ascending.
    pub(super) at: Vec<f64>,
    /// For each cell between neighbouring lines whether there are facets: not between both sides of a step.
    pub(super) has_facets: Vec<bool>,
}

impl Lines {
    /// Even divisions of stretches: one line at a break, two at a step.
    fn new(stretches: &[Stretch], cells: &[usize]) -> Self {
        let mut lines = Self::default();
        for (s, cells) in stretches.iter().zip(cells) {
            if lines.at.is_empty() {
                lines.at.push(s.start);
            } else if s.after_step {
                lines.at.push(s.start);
                lines.has_facets.push(false);
            }
            for c in 1..*cells {
                lines.at.push(s.start + c as f64 / *cells as f64 * (s.end - s.start));
            }
            lines.at.push(s.end);
            lines.has_facets.resize(lines.at.len() - 1, true);
        }
        lines
    }

    /// The lines where the stretches between which they were made are now.
    pub(super) fn moved(&self, from: &[Stretch], to: &[Stretch]) -> Self {
        let moved = |t: &f64| {
            let number = from.partition_point(|stretch| stretch.end < *t).min(from.len() - 1);
            let (from, to) = (from[number], to[number]);
            to.clamp(to.start + (t - from.start) / (from.end - from.start) * (to.end - to.start))
        };
        Self { at: self.at.iter().map(moved).collect(), has_facets: self.has_facets.clone() }
    }

    /// The same with some cells divided.
    pub(super) fn finer(&self, divided: impl Fn(usize) -> bool, parts: usize) -> Self {
        let mut lines = Self { at: vec![self.at[0]], has_facets: Vec::new() };
        for (cell, ends) in self.at.windows(2).enumerate() {
            let parts = if divided(cell) { parts } else { 1 };
            lines.at.extend((1..parts).map(|c| ends[0] + c as f64 / parts as f64 * (ends[1] - ends[0])));
            lines.at.push(ends[1]);
            lines.has_facets.resize(lines.at.len() - 1, self.has_facets[cell]);
        }
        lines
    }

    /// One cell, with its facets.
    pub(super) fn cell(&self, number: usize) -> Self {
        Self { at: self.at[number..=number + 1].to_vec(), has_facets: vec![true] }
    }

    /// The first and the last line of every cell, among those after all cells with facets were divided.
    pub(super) fn ends(&self, parts: usize) -> Vec<[usize; 2]> {
        let mut first = 0;
        let ends = |has_facets: &bool| {
            let start = first;
            first += if *has_facets { parts } else { 1 };
            [start, first]
        };
        self.has_facets.iter().map(ends).collect()
    }
}

impl Gauge {
    /// Chord error h^2 |S''| / 8 from second differences on a coarse grid; beside it no cell longer than a tenth of the
    /// size, so that boxes stay small. Between breaks each stretch by itself. A patch that is trimmed has the patch
    /// `keep` of where it is there, and smaller cells.
    pub(super) fn of(
        instance: &dyn Instance,
        (patch, keep): (usize, Option<usize>),
        tolerance: f64,
        size: f64,
    ) -> Self {
        let whole = Self::of_whole(instance, patch, tolerance, size, CELLS_OF_SIZE);
        let Some(keep) = keep else { return whole };
        // The chord of an edge is about as far from it as that of the surface is.
        let cells = (TRIMMED_CELLS * (size / tolerance).sqrt()).clamp(CELLS_OF_SIZE, MOST_CELLS);
        let mut gauge = Self::of_whole(instance, patch, tolerance, size, cells);
        match divide_at_edges(instance, Patches { patch, keep }, &mut gauge.lines, size / cells) {
            Some(edge_error) => Self { edge_error, ..gauge },
            None => whole,
        }
    }

    fn of_whole(instance: &dyn Instance, patch: usize, tolerance: f64, size: f64, cells_of_size: f64) -> Self {
        let breaks = Breaks::of_patch(instance, patch).unwrap_or_default();
        let domain = Domain::new(&breaks);
        let trail = Trail::new(instance, patch, breaks).unwrap_or_default();
        let whole = [Stretch::default()];
        let stretches = [0, 1].map(|k| {
            let all = domain.along(k);
            if all.len() <= MOST_STRETCHES { all } else { &whole }
        });
        let Some(lattice) = Lattice::new(instance, patch, stretches) else {
            let even = Lines::new(&whole, &[CURVATURE_CELLS]);
            return Self { lines: [even.clone(), even], domain, trail, ..Self::default() };
        };
        let (mut lines, mut closed, mut sagitta) = (<[Lines; 2]>::default(), [false; 2], 0.0);
        for k in 0..2 {
            let (bends, gap) = lattice.bends(k);
            let need = |b: &Bend| {
                let by_bend = b.cells as f64 * (b.difference / (8.0 * tolerance)).sqrt();
                let by_length = cells_of_size * b.length / size;
                by_bend.max(by_length).ceil().clamp(1.0, MOST_CELLS) as usize
            };
            let mut cells: Vec<usize> = bends.iter().map(need).collect();
            limit(&mut cells);
            let error = |(b, n): (&Bend, &usize)| b.difference / 8.0 * (b.cells as f64 / *n as f64).powi(2);
            sagitta += bends.iter().zip(&cells).map(error).fold(0.0, f64::max);
            let is_long = bends.iter().any(|b| b.length > 0.0);
            let is_bent = bends.len() > 1 || bends[0].difference > 0.0;
            closed[k] = is_long && gap < 1e-9 * size && is_bent;
            lines[k] = Lines::new(stretches[k], &cells);
        }
        Self { lines, domain: domain.closing(closed), trail, sagitta, ..Self::default() }
    }
}

/// Makes the cells of all stretches no more than `MOST_CELLS`, or one each.
fn limit(cells: &mut [usize]) {
    let (count, total) = (cells.len(), cells.iter().sum::<usize>());
    let share = (MOST_CELLS - count as f64).max(0.0) / (total - count).max(1) as f64;
    if share < 1.0 {
        cells.iter_mut().for_each(|n| *n = 1 + (share * (*n - 1) as f64) as usize);
    }
}

/// Points of a patch on a coarse grid: in every stretch the same number of cells.
struct Lattice {
    points: Vec<[f64; 3]>,
    /// Cells of a stretch of u, and of v.
    cells: [usize; 2],
    /// Lines of u, and of v.
    lines: [usize; 2],
}

/// The most that a stretch bends on any line of the other parameter, and its greatest length.
struct Bend {
    /// The cells on which it was measured.
    cells: usize,
    /// Second difference. Millimetres.
    difference: f64,
    /// Millimetres.
    length: f64,
}

impl Lattice {
    /// None where the patch cannot be evaluated.
    fn new(instance: &dyn Instance, patch: usize, stretches: [&[Stretch]; 2]) -> Option<Self> {
        let cells = stretches.map(|s| (4 * CURVATURE_CELLS / s.len()).clamp(LEAST_CURVATURE_CELLS, CURVATURE_CELLS));
        let [u, v] = [0, 1].map(|k| {
            let fraction = |i: usize| i as f64 / cells[k] as f64;
            let at = |s: &Stretch, i: usize| s.clamp(s.start + fraction(i) * (s.end - s.start));
            let all = stretches[k].iter().flat_map(|s| (0..=cells[k]).map(move |i| at(s, i)));
            all.collect::<Vec<f64>>()
        });
        let mut points = vec![[0.0; 3]; u.len() * v.len()];
        instance.points_grid(patch, &u, &v, &mut points).ok()?;
        Some(Self { points, cells, lines: [u.len(), v.len()] })
    }

    /// The bend of every stretch of u (0) or of v (1), and how far apart the ends of all are.
    fn bends(&self, k: usize) -> (Vec<Bend>, f64) {
        let [along, across] = [self.lines[k], self.lines[1 - k]];
        let [step, jump] = if k == 0 { [1, self.lines[0]] } else { [self.lines[0], 1] };
        let at = |i: usize, j: usize| DVec3::from_array(self.points[i * step + j * jump]);
        let cells = self.cells[k];
        let of_stretch = |first: usize| {
            let mut bend = Bend { cells, difference: 0.0, length: 0.0 };
            for j in 0..across {
                let mut length = 0.0;
                for i in first + 1..=first + cells {
                    length += at(i, j).distance(at(i - 1, j));
                    if i < first + cells {
                        let difference = at(i + 1, j) - 2.0 * at(i, j) + at(i - 1, j);
                        bend.difference = bend.difference.max(difference.length());
                    }
                }
                bend.length = bend.length.max(length);
            }
            bend
        };
        let bends = (0..along).step_by(cells + 1).map(of_stretch).collect();
        let gap = (0..across).map(|j| at(0, j).distance(at(along - 1, j))).fold(0.0, f64::max);
        (bends, gap)
    }
}
