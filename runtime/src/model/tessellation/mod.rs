//! A model's surface as triangles whose vertices know their patch and parameters.
//!
//! A patch is divided at its breaks (`model::breaks`), and the intervals between them into steps: equal ones at first
//! (`intervals`), shorter ones where creases across u and v are dense (`resolve`) or where the surface bends within a
//! step (`grade`), and at edges of what is there (`along`). Borders that are the same curve in space are found and get
//! the same points (`borders`, `piece`), patches become grids (`grid`), and what leaves the surface by more than the
//! chord (`measure`) is divided further, first at creases across u and v (`crease`), then anywhere (`refine`).

mod adjacency;
mod along;
pub(super) mod borders;
mod corner;
mod crease;
mod folds;
mod grade;
mod grid;
mod hidden;
pub(super) mod intervals;
mod level;
mod measure;
mod piece;
mod refine;
mod resolve;
mod rim;
mod stand;
mod stitch;
#[cfg(test)]
mod tests;
mod trim;

use super::atlas::Atlas;
use super::breaks::Breaks;
use super::joints::bodies;
use super::{EvaluationError, Instance, Model, Partials};
use crate::mesh::{Group, TriangleMesh};
use crate::progress::{Progress, Silent};
use borders::Borders;
use glam::DVec3;
use grade::grade;
use grid::{Grid, PlacedInterval};
use intervals::{Axes, Interval};
use piece::Side;
use rayon::prelude::*;
use refine::Refinement;
use resolve::resolve;

/// A point of a model: a patch and its parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfacePoint {
    /// Index of the patch.
    pub patch: u32,
    /// First surface parameter, in [0, 1].
    pub u: f64,
    /// Second surface parameter, in [0, 1].
    pub v: f64,
}

/// The fineness of a tessellation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fineness {
    /// The largest distance between a chord and the surface. Millimetres.
    pub chord: f64,
    /// The longest edge along u or v. Millimetres. Surfaces that are displaced need short edges where they are flat,
    /// too.
    pub edge: f64,
    /// The most segments along either direction of a smooth piece of a patch.
    pub max_segments: u32,
    /// The most triangles: where the chord would take more, they are larger. A million takes a quarter of a gigabyte.
    pub max_triangles: usize,
}

/// The most triangles of the grids of all patches with creases across u and v: refinement follows these better, and a
/// triangle beside them takes 50 evaluations of the surface.
const MOST_OBLIQUE: usize = 200_000;
/// The least diagonal of a trimmed model, as a part of that of its untrimmed patches. Chords are parts of it: where
/// next to nothing is left they would ask for triangles without number.
const LEAST_OF_WHOLE: f64 = 0.01;
/// Triangles by which refinement may exceed the grids.
const MOST_ADDED: usize = 500_000;

/// Segments along u and v of patches whose extent is asked for.
const ROUGH: u32 = 8;

impl Default for Fineness {
    fn default() -> Self {
        Self { chord: 0.02, edge: f64::INFINITY, max_segments: 8192, max_triangles: 3_000_000 }
    }
}

/// A tessellated model.
#[derive(Clone, Debug, Default)]
pub struct Tessellation {
    /// Positions, unit normals of the exact surface (outward), texture coordinates in the atlas (where there is one);
    /// one group a patch, named like the part.
    pub mesh: TriangleMesh,
    /// The point of the model that every vertex is, so that any point of any triangle maps back to the exact surface.
    pub origins: Vec<SurfacePoint>,
    /// Vertices in order along the borders and the breaks of patches, those on either side of a break apart.
    pub lines: Vec<Vec<u32>>,
    /// The largest distance between triangles and surface that was measured. Millimetres.
    pub chord: f64,
    /// The largest distance by which vertices were put beside a trimmed patch, to close the gap between it and others
    /// that end there. Millimetres.
    pub stretch: f64,
}

impl Tessellation {
    /// Tessellates every patch so that the triangles keep to the chord and to the length of edges: between its breaks
    /// on a grid, and finer where that is not enough. Borders of patches that are the same curve have the same
    /// vertices, to the bit. `chord` of the result is what was reached: it is larger than what was asked for only where
    /// the surface jumps, or where that would take too many triangles.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn new(model: &dyn Model, instance: &dyn Instance, fineness: Fineness) -> Result<Self, EvaluationError> {
        Self::with_progress(model, instance, fineness, &Silent)
    }

    /// As [`new`](Self::new), with a chord that is a part of the model's diagonal.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn relative(model: &dyn Model, instance: &dyn Instance, chord: f64) -> Result<Self, EvaluationError> {
        let lines = Lines::find(model, instance)?;
        let diagonal = Self::diagonal_by(model, instance, ROUGH, &lines)?;
        let fineness = Fineness { chord: chord * diagonal, ..Fineness::default() };
        Self::along_lines(model, instance, fineness, &lines, &Silent)
    }

    /// As [`new`](Self::new), and reports how far it is.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn with_progress(
        model: &dyn Model,
        instance: &dyn Instance,
        fineness: Fineness,
        progress: &dyn Progress,
    ) -> Result<Self, EvaluationError> {
        progress.report("meshing", f64::NAN, "");
        let fineness = Self::no_coarser_than_edges(model, instance, fineness)?;
        Self::along_lines(model, instance, fineness, &Lines::find(model, instance)?, progress)
    }

    /// The same, with grids along some lines.
    fn along_lines(
        model: &dyn Model,
        instance: &dyn Instance,
        fineness: Fineness,
        lines: &Lines,
        progress: &dyn Progress,
    ) -> Result<Self, EvaluationError> {
        let Lines { breaks, edges, .. } = lines;
        let mut axes = divided(instance, breaks, fineness)?;
        edges.iter().zip(&mut axes).for_each(|(edges, axes)| along::insert_all(edges, axes));
        limit(&mut axes, breaks, fineness.max_triangles);
        let mut borders = Borders::find(instance, &axes)?;
        borders.keep_open(&mut axes);
        let (mut points, mut leaving) = grid::border_points(instance, &borders)?;
        while !leaving.is_empty() {
            borders.part(&leaving);
            (points, leaving) = grid::border_points(instance, &borders)?;
        }
        let mut of_patch: Vec<Vec<PlacedInterval<'_>>> = vec![Vec::new(); axes.len()];
        let pieces: Vec<_> = borders.pieces.iter().zip(points).collect();
        for of_interval in pieces.chunk_by(|(a, _), (b, _)| a.is_beside(b)) {
            let (first, points) = &of_interval[0];
            let mut all = points.clone();
            of_interval[1..].iter().for_each(|(_, points)| all.extend_from_slice(&points[1..]));
            of_patch[first.patch].push((first, all));
        }
        let mut tessellation = Self::of_axes(instance, &axes, &of_patch, borders.tolerance)?;
        tessellation.refine(instance, &axes, lines, borders.poles(axes.len()), fineness, progress)?;
        tessellation.group(model, &axes);
        Ok(tessellation)
    }

    /// The fineness, or that of the edges of trimmed patches, where it is less: gaps between surfaces that leave their
    /// common edge by more would not be closed.
    fn no_coarser_than_edges(
        model: &dyn Model,
        instance: &dyn Instance,
        fineness: Fineness,
    ) -> Result<Fineness, EvaluationError> {
        // An infinite chord is given where only the extent of the model is asked for.
        if !model.is_trimmed() || fineness.chord == f64::INFINITY {
            return Ok(fineness);
        }
        let whole = Self::uniform(model, instance, ROUGH, ROUGH)?.mesh.bounds().diagonal();
        Ok(Fineness { chord: fineness.chord.min(trim::COARSEST * whole), ..fineness })
    }

    /// As [`new`](Self::new), but every patch by itself and on its grid only: nothing is measured, and borders do not
    /// have the same vertices.
    pub(crate) fn on_grids(
        model: &dyn Model,
        instance: &dyn Instance,
        fineness: Fineness,
    ) -> Result<Self, EvaluationError> {
        let axes = divided(instance, &breaks_of(model, instance)?, fineness)?;
        let mut tessellation = Self::of_axes(instance, &axes, &vec![Vec::new(); axes.len()], 0.0)?;
        tessellation.group(model, &axes);
        Ok(tessellation)
    }

    /// The diagonal of the box around a model, by grids of the same number of segments for every patch; around what is
    /// there, where patches are trimmed, unless that is nothing, and no less than a hundredth of the other.
    /// Millimetres.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn rough_diagonal(model: &dyn Model, instance: &dyn Instance, segments: u32) -> Result<f64, EvaluationError> {
        Self::diagonal_by(model, instance, segments, &Lines::find(model, instance)?)
    }

    /// The same, with grids along some lines.
    fn diagonal_by(
        model: &dyn Model,
        instance: &dyn Instance,
        segments: u32,
        lines: &Lines,
    ) -> Result<f64, EvaluationError> {
        let whole = Self::uniform(model, instance, segments, segments)?.mesh.bounds().diagonal();
        if !model.is_trimmed() {
            return Ok(whole);
        }
        let fineness = Fineness { chord: f64::INFINITY, max_segments: segments, ..Fineness::default() };
        let there = Self::along_lines(model, instance, fineness, lines, &Silent)?.mesh;
        if there.triangles.is_empty() {
            return Ok(whole);
        }
        Ok(there.bounds().diagonal().max(LEAST_OF_WHOLE * whole))
    }

    /// Tessellates every patch on a grid of the same number of segments, whatever its shape.
    ///
    /// # Errors
    /// The surface cannot be evaluated.
    pub fn uniform(model: &dyn Model, instance: &dyn Instance, nu: u32, nv: u32) -> Result<Self, EvaluationError> {
        let axis = |segments: u32| vec![Interval::even(0.0, 1.0, segments.max(1))];
        let axes = vec![[axis(nu), axis(nv)]; model.parts().len()];
        let mut tessellation = Self::of_axes(instance, &axes, &vec![Vec::new(); axes.len()], 0.0)?;
        tessellation.group(model, &axes);
        Ok(tessellation)
    }

    /// Evaluates all patches, several at once, on grids of some intervals, with given points of their borders, and
    /// joins them in their order.
    fn of_axes(
        instance: &dyn Instance,
        axes: &[Axes],
        borders: &[Vec<PlacedInterval<'_>>],
        tolerance: f64,
    ) -> Result<Self, EvaluationError> {
        let grid = |(patch, axes): (usize, &Axes)| Grid::new(instance, patch, axes, &borders[patch], tolerance);
        let grids: Vec<_> = axes.par_iter().enumerate().map(grid).collect();
        let mut tessellation = Self::default();
        for grid in grids {
            let grid = grid?;
            let first = tessellation.mesh.positions.len() as u32;
            tessellation.mesh.positions.extend(grid.positions.iter().map(|p| p.to_array()));
            tessellation.mesh.normals.extend(grid.normals.iter().map(|n| n.to_array()));
            tessellation.origins.extend(grid.origins);
            tessellation.mesh.triangles.extend(grid.triangles.iter().map(|t| t.map(|i| first + i)));
        }
        Ok(tessellation)
    }

    /// Divides triangles that do not keep to the chord.
    fn refine(
        &mut self,
        instance: &dyn Instance,
        axes: &[Axes],
        Lines { breaks, keeps, bodies, .. }: &Lines,
        poles: Vec<Vec<Side>>,
        fineness: Fineness,
        progress: &dyn Progress,
    ) -> Result<(), EvaluationError> {
        let patch = |t: &[u32; 3]| self.origins[t[0] as usize].patch;
        let patches = self.mesh.triangles.iter().map(patch).collect();
        let most_triangles = self.mesh.triangles.len() + MOST_ADDED;
        let mut refinement = Refinement {
            instance,
            patches,
            mesh: &mut self.mesh,
            origins: &mut self.origins,
            ends: axes.iter().map(ends).collect(),
            poles,
            bodies,
            oblique: breaks.iter().map(|b| b.oblique).collect(),
            chord: fineness.chord,
            finest_level: 0.0,
            most_triangles,
            jump: 0.0,
            stretch: 0.0,
        };
        let chord = refinement.run(progress)?;
        refinement.trim(keeps)?;
        folds::unfold(&mut refinement);
        self.stretch = refinement.stretch;
        self.chord = chord;
        if keeps.iter().any(Option::is_some) {
            self.drop_unused();
        }
        Ok(())
    }

    /// Drops vertices that no triangle has.
    fn drop_unused(&mut self) {
        let mut used = vec![false; self.origins.len()];
        self.mesh.triangles.iter().flatten().for_each(|i| used[*i as usize] = true);
        let mut place = vec![u32::MAX; used.len()];
        let kept: Vec<usize> = (0..used.len()).filter(|i| used[*i]).collect();
        kept.iter().enumerate().for_each(|(new, old)| place[*old] = new as u32);
        self.origins = kept.iter().map(|i| self.origins[*i]).collect();
        self.mesh.positions = kept.iter().map(|i| self.mesh.positions[*i]).collect();
        self.mesh.normals = kept.iter().map(|i| self.mesh.normals[*i]).collect();
        self.mesh.triangles.iter_mut().flatten().for_each(|i| *i = place[*i as usize]);
    }

    /// Puts vertices and triangles in the order of the patches, which become groups, and finds the lines.
    fn group(&mut self, model: &dyn Model, axes: &[Axes]) {
        let mut order: Vec<u32> = (0..self.origins.len() as u32).collect();
        order.sort_by_key(|i| self.origins[*i as usize].patch);
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(new, old)| place[*old as usize] = new as u32);
        self.origins = order.iter().map(|i| self.origins[*i as usize]).collect();
        self.mesh.positions = order.iter().map(|i| self.mesh.positions[*i as usize]).collect();
        self.mesh.normals = order.iter().map(|i| self.mesh.normals[*i as usize]).collect();
        let triangles = &mut self.mesh.triangles;
        triangles.iter_mut().flatten().for_each(|i| *i = place[*i as usize]);
        let patch = |t: &[u32; 3]| self.origins[t[0] as usize].patch as usize;
        triangles.sort_by_key(patch);
        for (k, part) in model.parts().iter().enumerate() {
            let start = self.mesh.triangles.partition_point(|t| patch(t) < k);
            let end = self.mesh.triangles.partition_point(|t| patch(t) <= k);
            self.mesh.groups.push(Group { name: part.name.clone(), start, end });
        }
        self.lines = lines(&self.origins, axes);
    }

    /// Sets the texture coordinates of every vertex to its place in the atlas.
    #[must_use]
    pub fn with_atlas(mut self, atlas: &Atlas) -> Self {
        self.mesh.texcoords = self.origins.iter().map(|o| atlas.texcoord(o.patch as usize, o.u, o.v)).collect();
        self
    }
}

/// The properties of patches that tessellations of any fineness follow.
struct Lines {
    /// By patch.
    breaks: Vec<Breaks>,
    /// By patch, the patch of the function of where it is there, if it is trimmed.
    keeps: Vec<Option<usize>>,
    /// By patch, the values of u and of v along which edges of what is there run.
    edges: Vec<[Vec<f64>; 2]>,
    /// By patch, the number of the part that it is one of the surfaces of.
    bodies: Vec<usize>,
}

impl Lines {
    fn find(model: &dyn Model, instance: &dyn Instance) -> Result<Self, EvaluationError> {
        let keeps: Vec<Option<usize>> = (0..model.parts().len()).map(|patch| model.keep(patch)).collect();
        let bodies = bodies(model.parts().iter().map(|part| part.name.as_str()));
        Ok(Self { breaks: breaks_of(model, instance)?, edges: along::edges(instance, &keeps)?, keeps, bodies })
    }
}

/// The breaks of all patches.
fn breaks_of(model: &dyn Model, instance: &dyn Instance) -> Result<Vec<Breaks>, EvaluationError> {
    let of_patch = |patch| Breaks::of_patch(instance, patch);
    (0..model.parts().len()).into_par_iter().map(of_patch).collect::<Vec<_>>().into_iter().collect()
}

/// The intervals between the breaks of all patches, divided.
fn divided(instance: &dyn Instance, breaks: &[Breaks], fineness: Fineness) -> Result<Vec<Axes>, EvaluationError> {
    let patches = breaks.len();
    let of_patch = |(patch, breaks): (usize, &Breaks)| {
        let mut axes = intervals::of_patch(instance, patch, breaks)?;
        // One step each keeps to any chord.
        if fineness.chord == f64::INFINITY && fineness.edge == f64::INFINITY {
            return Ok(axes);
        }
        intervals::divide(instance, patch, &mut axes, fineness)?;
        if breaks.oblique {
            resolve(instance, patch, &mut axes, fineness.chord)?;
        }
        grade(instance, patch, &mut axes, breaks.oblique, fineness.chord, patches)?;
        Ok(axes)
    };
    breaks.par_iter().enumerate().map(of_patch).collect::<Vec<_>>().into_iter().collect()
}

/// Makes grids coarser where all of them would have too many triangles, or those of patches with creases across.
fn limit(axes: &mut [Axes], breaks: &[Breaks], most: usize) {
    let coarser = |axes: &mut [&mut Axes], most: usize| {
        let segments = |axis: &Vec<Interval>| axis.iter().map(|i| i.segments() as f64).sum::<f64>();
        let triangles: f64 = axes.iter().map(|[u, v]| 2.0 * segments(u) * segments(v)).sum();
        let share = (most as f64 / triangles).sqrt();
        if share < 1.0 {
            for interval in axes.iter_mut().flat_map(|axes| axes.iter_mut()).flatten() {
                interval.divide(((interval.segments() as f64 * share) as usize).max(1));
            }
        }
    };
    let oblique = axes.iter_mut().zip(breaks).filter(|(_, breaks)| breaks.oblique);
    coarser(&mut oblique.map(|(axes, _)| axes).collect::<Vec<_>>(), MOST_OBLIQUE);
    coarser(&mut axes.iter_mut().collect::<Vec<_>>(), most);
}

/// The values of u and of v at which intervals end, ascending.
fn ends(axes: &Axes) -> [Vec<f64>; 2] {
    axes.each_ref().map(|axis| {
        let mut ends: Vec<f64> = axis.iter().flat_map(|i| [i.start(), i.end()]).collect();
        ends.dedup();
        ends
    })
}

/// The vertices along every line of u or v at which an interval ends, in order.
fn lines(origins: &[SurfacePoint], axes: &[Axes]) -> Vec<Vec<u32>> {
    let mut lines = Vec::new();
    let mut first = 0;
    for (patch, axes) in axes.iter().enumerate() {
        let count = origins[first..].partition_point(|o| o.patch as usize <= patch);
        let ends = ends(axes);
        for k in 0..2 {
            let value = |o: &SurfacePoint| [o.u, o.v][k];
            let mut on_line: Vec<Vec<u32>> = vec![Vec::new(); ends[k].len()];
            for i in first..first + count {
                if let Ok(line) = ends[k].binary_search_by(|e| e.total_cmp(&value(&origins[i]))) {
                    on_line[line].push(i as u32);
                }
            }
            for mut line in on_line {
                let along = |i: &u32| [origins[*i as usize].v, origins[*i as usize].u][k];
                line.sort_by(|a, b| along(a).total_cmp(&along(b)));
                lines.push(line);
            }
        }
        first += count;
    }
    lines
}

/// Unit normals `du x dv / |du x dv|`; where that vanishes (a pole) the limit from a little inside the patch, and
/// `None` where the patch has no area there either.
///
/// # Errors
/// The surface cannot be evaluated.
pub(crate) fn unit_normals(
    instance: &dyn Instance,
    patch: usize,
    u: &[f64],
    v: &[f64],
    partials: &[Partials],
) -> Result<Vec<Option<DVec3>>, EvaluationError> {
    let mut normals: Vec<_> = partials.iter().map(|p| normal(p).map(|n| n.0)).collect();
    for step in [1e-6, 1e-4, 1e-3, 1e-2] {
        let missing: Vec<usize> = (0..normals.len()).filter(|&i| normals[i].is_none()).collect();
        if missing.is_empty() {
            break;
        }
        let inward = |t: f64| t + (0.5 - t) * step;
        let (nu, nv): (Vec<f64>, Vec<f64>) = missing.iter().map(|&i| (inward(u[i]), inward(v[i]))).unzip();
        let mut near = vec![Partials::default(); missing.len()];
        instance.partials(patch, &nu, &nv, &mut near)?;
        for (&i, p) in missing.iter().zip(&near) {
            normals[i] = normal(p).map(|n| n.0);
        }
    }
    Ok(normals)
}

/// The unit normal and the length of `du x dv`, unless the partial derivatives are parallel to rounding.
#[inline]
pub(in crate::model) fn normal(p: &Partials) -> Option<(DVec3, f64)> {
    let (du, dv) = (DVec3::from_array(p.du), DVec3::from_array(p.dv));
    let n = du.cross(dv);
    let size = n.length();
    // Rounding of the cross product is some 1e-16 of the product of the lengths; a factor of 1e4 above it the
    // direction is still good to 1e-4. The second bound catches partials that vanish altogether.
    let scale = (du.length_squared() * dv.length_squared()).sqrt();
    (size > 1e-12 * scale && size > 1e-12 && size.is_finite()).then(|| (n * (1.0 / size), size))
}
