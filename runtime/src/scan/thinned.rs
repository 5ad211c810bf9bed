//! A random part of a scan's vertices: the distances between neighbours grow, the noise stays.

use crate::mesh::TriangleMesh;

/// The most vertices whose neighbourhoods are looked at: of more a random part is taken, so that large scans take no
/// longer.
const MOST_VERTICES: usize = 1 << 20;

/// Some of a scan's vertices.
pub(super) struct Thinned {
    pub(super) positions: Vec<[f64; 3]>,
    /// Their unit normals, as many as positions, or none.
    pub(super) normals: Vec<[f64; 3]>,
}

/// How far a scan is to be thinned at least: to one vertex in so many, a power of two.
pub(super) fn least_thinning(mesh: &TriangleMesh) -> usize {
    mesh.positions.len().div_ceil(MOST_VERTICES).max(1).next_power_of_two()
}

impl Thinned {
    /// One vertex in so many, each as likely as any other.
    pub(super) fn new(mesh: &TriangleMesh, one_in: usize) -> Self {
        let chosen = |i: &usize| mixed(*i as u64).is_multiple_of(one_in as u64);
        let indices: Vec<usize> = (0..mesh.positions.len()).filter(chosen).collect();
        let of = |list: &[[f64; 3]]| indices.iter().filter_map(|i| list.get(*i).copied()).collect();
        Self { positions: of(&mesh.positions), normals: of(&mesh.normals) }
    }
}

/// A number that looks random (the last steps of SplitMix64; Steele, Lea and Flood 2014).
pub(super) fn mixed(number: u64) -> u64 {
    let mut z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
