//! Raw range scans in the form of Stanford's archive: `obj_info num_cols` and `num_rows`, and an element `range_grid`
//! that names the vertex of each cell, row by row, or none.

use super::header::{Element, INDICES};
use super::{FORMAT, Reader, list};
use crate::scan::error::ScanFault;
use crate::scan::raw::RawMesh;
use glam::DVec3;

/// Triangles whose longest side is longer than so many times the median distance of neighbours reach over a step of
/// the surface: nothing was seen there.
const LONGEST: f64 = 4.0;
/// A cell without a vertex.
const EMPTY: u32 = u32::MAX;

/// A range image.
pub(super) struct Grid {
    columns: usize,
    /// Row by row, the vertex of each cell.
    cells: Vec<u32>,
}

/// A number that the header has as `obj_info NAME NUMBER`.
fn info(header: &str, name: &str) -> Option<usize> {
    let value = |line: &str| match line.split_whitespace().collect::<Vec<_>>()[..] {
        ["obj_info", found, number] if found == name => number.parse().ok(),
        _ => None,
    };
    header.lines().find_map(value)
}

impl Reader<'_> {
    pub(super) fn read_grid(&mut self, element: &Element, header: &str) -> Result<(), ScanFault> {
        self.textured = false;
        let [columns, rows] = ["num_cols", "num_rows"].map(|name| info(header, name));
        let size = columns.zip(rows).and_then(|(columns, rows)| columns.checked_mul(rows));
        let mut cells = Vec::new();
        self.read_rows(element, 1, |reader, element, number, row| {
            let vertices = reader.checked(list(element, row, &INDICES), "cell", number)?;
            if vertices.len() > 1 {
                let message = format!("a cell has one vertex or none, this has {}", vertices.len());
                return Err(ScanFault::malformed(FORMAT, format!("cell {number} (counted from 1)"), message));
            }
            cells.push(vertices.first().copied().unwrap_or(EMPTY));
            Ok(())
        })?;
        match (columns, size) {
            (Some(columns @ 1..), Some(size)) if size == cells.len() => self.grid = Some(Grid { columns, cells }),
            _ => self.raw.warnings.push(format!(
                "its range grid has {} cells, and its header has no `obj_info num_cols` and `num_rows` whose product that is: \
                 it is read as points",
                cells.len()
            )),
        }
        Ok(())
    }
}

impl Grid {
    /// Adds triangles between neighbouring cells that have vertices: of four that with the shorter diagonal. They face
    /// +z as a whole: the archive's scanner stands there.
    pub(super) fn triangulate(&self, raw: &mut RawMesh) {
        let at = |cell: u32| DVec3::from(raw.positions[cell as usize]);
        let Some(longest) = self.median_step(at).map(|step| LONGEST * step) else { return };
        let apart = |a: u32, b: u32| at(a).distance(at(b));
        let (mut triangles, mut upward) = (Vec::new(), 0.0);
        let mut add = |[a, b, c]: [u32; 3]| {
            if ![a, b, c].contains(&EMPTY) && apart(a, b).max(apart(b, c)).max(apart(c, a)) <= longest {
                triangles.push([a, b, c]);
                upward += (at(b) - at(a)).cross(at(c) - at(a)).z;
            }
        };
        let rows: Vec<&[u32]> = self.cells.chunks_exact(self.columns).collect();
        for (row, next) in rows.iter().zip(rows.iter().skip(1)) {
            for ((a, b), (d, c)) in row.iter().zip(&row[1..]).zip(next.iter().zip(&next[1..])) {
                let [a, b, c, d] = [*a, *b, *c, *d];
                let diagonal = |p: u32, q: u32| if p == EMPTY || q == EMPTY { f64::INFINITY } else { apart(p, q) };
                if diagonal(a, c) <= diagonal(b, d) {
                    add([a, b, c]);
                    add([a, c, d]);
                } else {
                    add([a, b, d]);
                    add([b, c, d]);
                }
            }
        }
        if upward < 0.0 {
            triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        raw.triangles.extend(triangles);
    }

    /// The median distance of neighbours in a row; none where there are no neighbours.
    fn median_step(&self, at: impl Fn(u32) -> DVec3) -> Option<f64> {
        let steps = self.cells.chunks_exact(self.columns).flat_map(|row| row.iter().zip(&row[1..]));
        let mut steps: Vec<f64> = steps
            .filter(|(a, b)| **a != EMPTY && **b != EMPTY)
            .map(|(a, b)| at(*a).distance(at(*b)))
            .filter(|step| step.is_finite())
            .collect();
        crate::robust::median(&mut steps)
    }
}
