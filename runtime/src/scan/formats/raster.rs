//! Whether the cells of a grid are a raster of angles about the origin, as a scanner that stands there makes it: along
//! a column the elevation goes on by equal steps and the azimuth stays, along a row the other way round.

/// The fewest pairs of neighbouring cells with echoes that tell.
const FEWEST: usize = 100;
/// The share of the pairs that follow the raster, if there is one: neither edges nor empty cells disturb it.
const FOLLOW: f64 = 0.8;
/// How much an angle that stays may change, in steps of the other one, and how much a step may differ from the median.
const STAYS: f64 = 0.2;
const EQUAL: f64 = 0.5;

/// Whether cells, in the order of a file, are a raster of angles about the origin. None are empty ones.
pub(super) fn is_of_angles(cells: &[Option<[f64; 3]>]) -> bool {
    let pairs = cells.windows(2).filter_map(|pair| Some([pair[0]?, pair[1]?]));
    let steps: Vec<[f64; 2]> = pairs.map(|[a, b]| step(angles(a), angles(b))).collect();
    steps.len() >= FEWEST && (0..2).any(|fast| follow(&steps, fast))
}

/// Azimuth and elevation.
fn angles([x, y, z]: [f64; 3]) -> [f64; 2] {
    [y.atan2(x), z.atan2(x.hypot(y))]
}

/// What the angles change from one cell to the next.
fn step(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let turn = (b[0] - a[0] + 3.0 * std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
    [turn * a[1].cos(), b[1] - a[1]]
}

/// Whether one of the angles goes on by equal steps, and the other one stays.
fn follow(steps: &[[f64; 2]], fast: usize) -> bool {
    let mut along: Vec<f64> = steps.iter().map(|step| step[fast]).collect();
    let half = along.len() / 2;
    let usual = *along.select_nth_unstable_by(half, f64::total_cmp).1;
    let follows = |step: &&[f64; 2]| {
        (step[fast] - usual).abs() < EQUAL * usual.abs() && step[1 - fast].abs() < STAYS * usual.abs()
    };
    steps.iter().filter(follows).count() as f64 > FOLLOW * steps.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a scanner at the origin sees of a room of 8 x 6 x 3 m, moved.
    fn room(columns: u32, rows: u32, shift: [f64; 3]) -> Vec<Option<[f64; 3]>> {
        let cell = |i: u32| {
            let (azimuth, elevation) =
                (f64::from(i / rows) * 0.01, f64::from(i % rows) * 0.01 - 0.9 + 1e-3 * f64::from(i * 7 % 3));
            let d = [azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin()];
            let range = (0..3).map(|k| [4.0, 3.0, 1.5][k] / d[k].abs()).fold(f64::INFINITY, f64::min);
            (!i.is_multiple_of(11)).then(|| std::array::from_fn(|k| range * d[k] + shift[k]))
        };
        (0..columns * rows).map(cell).collect()
    }

    #[test]
    fn a_raster_is_one_about_the_place_of_the_scanner_only() {
        assert!(is_of_angles(&room(60, 180, [0.0; 3])));
        assert!(!is_of_angles(&room(60, 180, [0.5, 1.0, 0.2])));
        let mut shuffled = room(60, 180, [0.0; 3]);
        shuffled.sort_by_key(|cell| cell.map(|p| (p[0] * 1e6) as i64 % 1009));
        assert!(!is_of_angles(&shuffled) && !is_of_angles(&[Some([1.0; 3]); 50]));
    }
}
