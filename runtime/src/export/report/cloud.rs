//! Points of the scan for the view: enough to see its shape, few enough to be mailed.

use super::pack::Planes;
use crate::mesh::{Bounds, TriangleMesh};

/// Most points. Twenty thousand take some 100 kB of the page.
const POINTS: usize = 20_000;

/// Every how manieth of the scan's points is shown.
fn stride(mesh: &TriangleMesh) -> usize {
    mesh.positions.len().div_ceil(POINTS).max(1)
}

/// The number of points that are shown.
pub(super) fn count(mesh: &TriangleMesh) -> usize {
    mesh.positions.len().div_ceil(stride(mesh))
}

/// The points as data.js reads them: in the order of a curve that fills space, so that one is near the next, by their
/// differences; 16 bits a coordinate, in shares of the scan's box.
pub(super) fn points(mesh: &TriangleMesh) -> String {
    let bounds = mesh.bounds();
    let mut shares: Vec<[u16; 3]> = mesh.positions.iter().step_by(stride(mesh)).map(|p| share(&bounds, *p)).collect();
    shares.sort_by_key(|share| interleaved(*share));
    let mut planes = Planes::default();
    for k in 0..3 {
        let mut before = 0;
        let step = |p: &[u16; 3]| i32::from(p[k].wrapping_sub(std::mem::replace(&mut before, p[k])) as i16);
        planes.numbers(&shares.iter().map(step).collect::<Vec<_>>(), 2);
    }
    planes.text()
}

fn share(bounds: &Bounds, p: [f64; 3]) -> [u16; 3] {
    let (centre, size) = (bounds.centre(), bounds.size());
    [0, 1, 2].map(|k| {
        let share = if size[k] > 0.0 { 0.5 + (p[k] - centre[k]) / size[k] } else { 0.5 };
        (share.clamp(0.0, 1.0) * 65535.0).round() as u16
    })
}

/// The bits of three numbers by turns: Morton's order.
fn interleaved(share: [u16; 3]) -> u64 {
    let bit = |i: u32, k: usize| (u64::from(share[k] >> i) & 1) << (3 * i + k as u32);
    (0..16).flat_map(|i| (0..3).map(move |k| bit(i, k))).sum()
}
