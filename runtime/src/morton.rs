//! A curve through all cells of a grid, by which neighbours in space are mostly neighbours in order.

use glam::U64Vec3;

/// Interleaves the bits of a cell's coordinates (21 of each): neighbours in space come out near in order.
pub(crate) fn morton(cell: U64Vec3) -> u64 {
    let spread = |x: u64| {
        let mut x = x & 0x1f_ffff;
        x = (x | x << 32) & 0x001f_0000_0000_ffff;
        x = (x | x << 16) & 0x001f_0000_ff00_00ff;
        x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
        x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
        (x | x << 2) & 0x1249_2492_4924_9249
    };
    spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
}
