//! Points far from all others: places that stand for what was not measured, such as -9999, and stray echoes. One in a
//! thousand of them makes a scan of a cup as large as a house: its radius, its orientation, its unit and the scale of
//! the loss are then those of nothing.

use super::raw::{RawMesh, is_usable};
use crate::mesh::retain_marked;
use gml_compiler::number::plain;

/// Fewer points have no others to be far from.
const FEWEST: usize = 50;
/// The share of the points, those nearest to the middle, that are of the scan: of a scan with more of something else
/// nothing tells which is which.
const BULK: f64 = 0.75;
/// Points are far if between them and the farthest before them there is a gap by this factor (distances from the
/// middle). The two parts of a scene that a scan shows are nearer: a table is five times as large as an object, a room
/// hangs together.
const GAP: f64 = 10.0;
/// The same for points of which a coordinate is one of those that stand for nothing in raster and range images.
const GAP_OF_MARKS: f64 = 2.0;
const MARKS: [f64; 7] = [999.0, 9999.0, 99_999.0, 999_999.0, 32_767.0, 32_768.0, 65_535.0];

/// Leaves out the points of a cloud that are far from all others. `unit` is that of its coordinates in millimetres.
/// Returns their number and a sentence on them, if there are any.
pub(super) fn leave_out(raw: &mut RawMesh, unit: f64, path: &str) -> Option<(u64, String)> {
    if !raw.triangles.is_empty() || !raw.positions.iter().flatten().all(|c| is_usable(*c)) {
        return None;
    }
    let Far { kept, reach, gap } = far(&raw.positions)?;
    let gone = kept.iter().filter(|kept| !**kept).count();
    let mark = common_mark(&raw.positions, &kept).map_or_else(String::new, |(axis, value)| {
        format!(" (their {axis} is {}, which stands for what was not measured)", plain(value))
    });
    retain_marked(&mut raw.positions, &kept);
    retain_marked(&mut raw.normals, &kept);
    raw.attributes.retain_marked(&kept);
    let length = |x: f64| format!("{:.2e}", x * unit).parse().map_or_else(|_| plain(x * unit), plain);
    let sentence = format!(
        "`{path}`: {gone} of its points are left out{mark}: they are {} mm or more from the middle of the others, which reach {} mm",
        length(gap),
        length(reach)
    );
    Some((gone as u64, sentence))
}

/// Points that are far from others, in the unit of these.
struct Far {
    /// By point, whether it is one of the others.
    kept: Vec<bool>,
    /// The distance of the farthest of the others from the middle, along an axis.
    reach: f64,
    /// That of the nearest far one.
    gap: f64,
}

fn far(positions: &[[f64; 3]]) -> Option<Far> {
    if positions.len() < FEWEST {
        return None;
    }
    let half = positions.len() / 2;
    let middle: [f64; 3] = std::array::from_fn(|k| {
        let mut values: Vec<f64> = positions.iter().map(|p| p[k]).collect();
        *values.select_nth_unstable_by(half, f64::total_cmp).1
    });
    let distance = |p: &[f64; 3]| (0..3).map(|k| (p[k] - middle[k]).abs()).fold(0.0, f64::max);
    let is_mark = |p: &[f64; 3]| p.iter().any(|c| MARKS.contains(&c.abs()));
    let mut sorted: Vec<(f64, bool)> = positions.iter().map(|p| (distance(p), is_mark(p))).collect();
    sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let bulk = (BULK * sorted.len() as f64) as usize;
    let is_gap = |pair: &&[(f64, bool)]| {
        let factor = if pair[1].1 { GAP_OF_MARKS } else { GAP };
        pair[0].0 > 0.0 && pair[1].0 > factor * pair[0].0
    };
    let gap = sorted[bulk - 1..].windows(2).find(is_gap)?;
    let (reach, gap) = (gap[0].0, gap[1].0);
    Some(Far { kept: positions.iter().map(|p| distance(p) <= reach).collect(), reach, gap })
}

/// The axis and the value of the mark that all far points have.
fn common_mark(positions: &[[f64; 3]], kept: &[bool]) -> Option<(&'static str, f64)> {
    let first = positions.iter().zip(kept).find(|(_, kept)| !**kept)?.0;
    let is_common = |k: &usize| positions.iter().zip(kept).all(|(p, kept)| *kept || p[*k] == first[*k]);
    let axis = (0..3).filter(|k| MARKS.contains(&first[*k].abs())).find(is_common)?;
    Some((["x", "y", "z"][axis], first[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::thinned::mixed;

    /// Points in a cuboid of 60 x 40 x 20.
    fn cuboid(count: u64) -> Vec<[f64; 3]> {
        let at = |i: u64, size: u64| (mixed(i) % 1000 * size) as f64 / 1000.0;
        (0..count).map(|i| [at(3 * i, 60), at(3 * i + 1, 40), at(3 * i + 2, 20)]).collect()
    }

    fn left(extra: &[[f64; 3]]) -> (usize, Option<String>) {
        let mut raw = RawMesh { positions: [cuboid(1000), extra.to_vec()].concat(), ..RawMesh::default() };
        let said = leave_out(&mut raw, 1.0, "a.xyz").map(|(_, sentence)| sentence);
        (raw.positions.len(), said)
    }

    #[test]
    fn marks_and_stray_echoes_are_left_out_and_said() {
        assert_eq!(left(&[]), (1000, None));
        // What lies beside an object is a part of its scene.
        assert_eq!(left(&[[150.0, 0.0, 0.0], [0.0, -250.0, 0.0]]), (1002, None));
        let marks: Vec<[f64; 3]> = cuboid(100).iter().map(|p| [p[0], p[1], -9999.0]).collect();
        let (count, said) = left(&marks);
        assert!(count == 1000 && said.is_some_and(|s| s.contains("100 of") && s.contains("their z is -9999")));
        let (count, said) = left(&[[1e6, 2e6, 3.0], [150.0, 0.0, 0.0]]);
        assert!(count == 1001 && said.is_some_and(|s| s.contains("`a.xyz`: 1 of") && !s.contains("their")));
        // Where there are as many as of the object, nothing tells which is which.
        assert_eq!(left(&vec![[0.0, 0.0, -9999.0]; 500]).0, 1500);
    }
}
