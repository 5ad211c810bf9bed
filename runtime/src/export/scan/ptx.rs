//! PTX: for each station its matrix and the points that it saw, in its own frame. The format's unit is the metre.

use super::{Grid, Out, Recorded};
use crate::scan::{Station, Stations};
use std::io;

/// Millimetres.
const METRE: f64 = 1000.0;
/// The intensity of points that have none, and of cells without a point.
const NO_INTENSITY: f32 = 0.5;

/// Writes a scan in this format. Points whose station is not known are those of one at the origin.
pub(super) fn write(out: &mut dyn Out, scan: &Recorded<'_>) -> io::Result<()> {
    let count = scan.mesh.positions.len();
    let station = |i: usize| scan.attributes.stations.of_points.get(i).copied().unwrap_or(Stations::UNKNOWN);
    let mut start = 0;
    while start < count {
        let number = station(start);
        let end = (start..count).find(|i| station(*i) != number).unwrap_or(count);
        let stations = &scan.attributes.stations.places;
        let place = stations.get(usize::from(number)).copied().unwrap_or(Station::at([0.0; 3]));
        // A grid that has not all of its points would lose the others.
        let has_all = |grid: &&Grid| grid.cells.iter().filter(|cell| **cell != Grid::EMPTY).count() == end - start;
        match scan.grids.get(usize::from(number)).filter(has_all) {
            Some(grid) => {
                let cells = grid.cells.iter().map(|cell| (*cell != Grid::EMPTY).then_some(*cell as usize));
                write_scan(out, scan, &place, [grid.columns, grid.rows], cells)?;
            }
            None => write_scan(out, scan, &place, [1, end - start], (start..end).map(Some))?,
        }
        start = end;
    }
    Ok(())
}

/// A header, and a line for each cell.
fn write_scan(
    out: &mut dyn Out,
    scan: &Recorded<'_>,
    station: &Station,
    [columns, rows]: [usize; 2],
    cells: impl Iterator<Item = Option<usize>>,
) -> io::Result<()> {
    let (attributes, r) = (scan.attributes, station.rotation);
    let [x, y, z] = station.place.map(|c| c / METRE);
    writeln!(out, "{columns}\n{rows}\n{x} {y} {z}")?;
    // Points are rows here, and so are the scanner's axes.
    for k in 0..3 {
        writeln!(out, "{} {} {}", r[0][k], r[1][k], r[2][k])?;
    }
    for k in 0..3 {
        writeln!(out, "{} {} {} 0", r[0][k], r[1][k], r[2][k])?;
    }
    writeln!(out, "{x} {y} {z} 1")?;
    let coloured = !attributes.colours.is_empty();
    for cell in cells {
        let Some(i) = cell else {
            writeln!(out, "0 0 0 {NO_INTENSITY}{}", if coloured { " 0 0 0" } else { "" })?;
            continue;
        };
        let [x, y, z] = station.to_own(scan.mesh.positions[i]).map(|c| c / METRE);
        let intensity = attributes.intensities.get(i).copied().unwrap_or(NO_INTENSITY);
        write!(out, "{x} {y} {z} {intensity}")?;
        if let Some([red, green, blue]) = attributes.colours.get(i) {
            write!(out, " {red} {green} {blue}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}
