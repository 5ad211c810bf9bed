//! Packing of charts on a square texture: rows of charts of one height that fill the texture's width, like lines of
//! pictures in a gallery. Every chart keeps its area (so that a texel stands for the same area everywhere) and gives
//! way in its proportions, as little as the rows allow; it lies or stands, whichever suits the row better.

use super::atlas::Chart;

/// The number of texels left free around every chart, so that dilated colours of neighbours never meet.
pub(super) const GUTTER: u32 = 2;

/// The least side of a chart in texels: a patch without area is on the texture all the same.
const LEAST: f64 = 2.0;

/// Packs rectangles (width and height in millimetres) onto `side` x `side` texels at the largest common scale at which
/// they fit, by bisection. A rectangle may be turned (`Chart::transposed`). None where there are too many.
pub(super) fn largest_packing(sizes: &[[f64; 2]], side: u32) -> Option<Vec<Chart>> {
    // Each takes at least its least size and the gutters.
    let least = LEAST + f64::from(2 * GUTTER);
    if sizes.len() as f64 * least * least > f64::from(side).powi(2) {
        return None;
    }
    let area: f64 = sizes.iter().map(|s| s[0] * s[1]).sum();
    let mut low = 0.0;
    let mut best = pack(sizes, side, low)?;
    let mut high = if area > 0.0 { f64::from(side) / area.sqrt() } else { 0.0 };
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        match pack(sizes, side, middle) {
            Some(charts) => {
                best = charts;
                low = middle;
            }
            None => high = middle,
        }
    }
    Some(best)
}

/// A rectangle to be placed, in texels: laid down, its width is not less than its height.
#[derive(Clone, Copy)]
struct Item {
    index: usize,
    /// Whether it was turned to lie.
    turned: bool,
    width: f64,
    height: f64,
    /// Logarithms of the height and of the width: they are used very often.
    logarithms: [f64; 2],
    /// The root of its area.
    weight: f64,
}

impl Item {
    fn area(&self) -> f64 {
        self.width * self.height
    }

    /// The factors by which its proportions change in a row whose height has this logarithm, as logarithms without
    /// their signs: lying, and standing.
    fn changes(&self, height: f64) -> [f64; 2] {
        self.logarithms.map(|side| 2.0 * (height - side).abs())
    }

    /// Whether it had better stand in a row of this height.
    fn stands(&self, height: f64) -> bool {
        let [lying, standing] = self.changes(height.ln());
        standing < lying
    }
}

/// Charts at a scale of texels a millimetre, or None where they do not fit.
fn pack(sizes: &[[f64; 2]], side: u32, scale: f64) -> Option<Vec<Chart>> {
    let mut items: Vec<Item> = sizes
        .iter()
        .enumerate()
        .map(|(index, s)| {
            let [a, b] = s.map(|d| (d * scale).max(LEAST));
            let (width, height) = (a.max(b), a.min(b));
            Item {
                index,
                turned: b > a,
                width,
                height,
                logarithms: [height.ln(), width.ln()],
                weight: (width * height).sqrt(),
            }
        })
        .collect();
    // Charts that are high, or that are wide, next to each other: neither suits all models.
    let orders: [fn(&Item) -> f64; 2] = [|i| i.height, |i| i.width];
    let cut = orders.map(|key| {
        items.sort_by(|a, b| key(b).total_cmp(&key(a)).then(b.width.total_cmp(&a.width)).then(a.index.cmp(&b.index)));
        rows(&items, side).map(|(cost, rows)| (cost, rows, items.clone()))
    });
    let (_, rows, items) = cut.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let mut charts = vec![Chart::default(); sizes.len()];
    let mut y = 0;
    for row in rows {
        let height = place_row(&items[row], side, y, &mut charts)?;
        y += height + 2 * GUTTER;
        if y > side {
            return None;
        }
    }
    Some(charts)
}

/// Cuts the sorted items into rows so that the proportions change least, by dynamic programming: the cost is the sum
/// over charts of the root of the area (so that small charts count) times the squared logarithm of the change. Returns
/// the cost and the rows; none where a chart cannot have its least width.
fn rows(items: &[Item], side: u32) -> Option<(f64, Vec<std::ops::Range<usize>>)> {
    // A row of more charts than this would have charts narrower than they are high in a square texture.
    let most = 4 * (items.len() as f64).sqrt().ceil() as usize + 4;
    let mut cost = vec![f64::INFINITY; items.len() + 1];
    let mut first = vec![0; items.len() + 1];
    cost[0] = 0.0;
    let mut area = vec![0.0];
    area.extend(items.iter().scan(0.0, |sum, item| {
        *sum += item.area();
        Some(*sum)
    }));
    for end in 1..=items.len() {
        // The row that is one longer than the last one is a good one mostly, and rules most others out.
        let least = end.saturating_sub(most);
        let likely = first[end - 1].max(least);
        let others = (least..end).filter(|start| *start != likely);
        for start in std::iter::once(likely).chain(others) {
            let row = &items[start..end];
            let added = row_height(row, side, area[end] - area[start])
                .and_then(|height| distortion(row, height, cost[end] - cost[start]));
            if let Some(added) = added {
                cost[end] = cost[start] + added;
                first[end] = start;
            }
        }
    }
    let mut rows = Vec::new();
    let mut end = items.len();
    while end > 0 {
        if !cost[end].is_finite() {
            return None;
        }
        rows.push(first[end]..end);
        end = first[end];
    }
    rows.reverse();
    Some((cost[items.len()], rows))
}

/// The height at which charts of this area in all fill a row; none where they do not have their least widths in it.
fn row_height(items: &[Item], side: u32, area: f64) -> Option<f64> {
    let room = f64::from(side) - f64::from(2 * GUTTER) * items.len() as f64;
    (room >= LEAST * items.len() as f64).then(|| area / room)
}

/// The distortion of a row, if it is below the bound.
fn distortion(items: &[Item], height: f64, bound: f64) -> Option<f64> {
    let logarithm = height.ln();
    let mut sum = 0.0;
    for item in items {
        let [lying, standing] = item.changes(logarithm);
        sum += item.weight * lying.min(standing).powi(2);
        // Written so that NaN ends here.
        if !(sum < bound) {
            return None;
        }
    }
    Some(sum)
}

/// Places a row at height `y`; returns its height in texels.
fn place_row(items: &[Item], side: u32, y: u32, charts: &mut [Chart]) -> Option<u32> {
    let exact = row_height(items, side, items.iter().map(Item::area).sum())?;
    // Written so that NaN ends here, and no whole number overflows.
    if !(exact <= f64::from(side)) {
        return None;
    }
    let height = exact.floor().max(LEAST) as u32;
    let mut x = 0;
    for item in items {
        // Widths are rounded down, which leaves room for those that are raised to the least width.
        let width = (item.width * item.height / exact.max(LEAST)).floor().max(LEAST) as u32;
        let transposed = item.turned != item.stands(exact);
        charts[item.index] = Chart { x: x + GUTTER, y: y + GUTTER, width, height, transposed };
        x += width + 2 * GUTTER;
    }
    (x <= side).then_some(height)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_do_not_overlap_and_keep_their_gutters() {
        let sizes: Vec<[f64; 2]> = (1..40).map(|i| [f64::from(i % 7 + 1), f64::from(i % 11 + 1) * 3.0]).collect();
        let charts = largest_packing(&sizes, 512).expect("they fit");
        for (i, a) in charts.iter().enumerate() {
            assert!(a.x >= GUTTER && a.y >= GUTTER);
            assert!(a.x + a.width + GUTTER <= 512 && a.y + a.height + GUTTER <= 512);
            for b in &charts[i + 1..] {
                let apart_x = a.x + a.width + 2 * GUTTER <= b.x || b.x + b.width + 2 * GUTTER <= a.x;
                let apart_y = a.y + a.height + 2 * GUTTER <= b.y || b.y + b.height + 2 * GUTTER <= a.y;
                assert!(apart_x || apart_y, "{a:?} and {b:?} overlap");
            }
        }
    }

    /// The charts of a cup: two walls, a thin lip, a handle.
    #[test]
    fn most_of_the_texture_is_used_and_texels_have_equal_areas() {
        let sizes = [[215.0, 101.0], [190.0, 92.0], [248.0, 4.1], [88.0, 31.4]];
        let charts = largest_packing(&sizes, 1024).expect("they fit");
        let texels: Vec<f64> = charts.iter().map(|c| f64::from(c.width) * f64::from(c.height)).collect();
        assert!(texels.iter().sum::<f64>() > 0.9 * 1024.0 * 1024.0, "{charts:?}");
        let density: Vec<f64> = texels.iter().zip(&sizes).map(|(t, s)| t / (s[0] * s[1])).collect();
        for d in &density {
            assert!((d / density[0] - 1.0).abs() < 0.1, "{density:?}");
        }
        for (c, s) in charts.iter().zip(&sizes) {
            let (across, down) = if c.transposed { (c.height, c.width) } else { (c.width, c.height) };
            let proportions = f64::from(across) / f64::from(down) / (s[0] / s[1]);
            // The handle stands beside the inner wall, as high as that lies; texels are at most 1.6 times as long as
            // wide.
            assert!((1.0 / 1.6..1.6).contains(&proportions), "{proportions} in {c:?}");
        }
    }

    /// A surface may be of any size and proportions.
    #[test]
    fn extreme_proportions_stay_on_the_texture() {
        for sizes in [vec![[1e38, 8.0]], vec![[1e300, 1e-300], [1.0, 1.0]], vec![[1e20, 1e20], [1e-20, 1e20]]] {
            let charts = largest_packing(&sizes, 512).expect("they fit");
            for chart in charts {
                assert!(chart.x + chart.width + GUTTER <= 512 && chart.y + chart.height + GUTTER <= 512, "{chart:?}");
            }
        }
    }

    #[test]
    fn too_many_patches_are_refused() {
        assert_eq!(largest_packing(&vec![[1.0, 1.0]; 1000], 64), None);
        let begun = std::time::Instant::now();
        assert_eq!(largest_packing(&vec![[1.0, 1.0]; 1_000_000], 4096), None);
        // A mesh of a noisy scan falls into thousands of charts.
        let many: Vec<[f64; 2]> = (0..8000).map(|i| [1.0 + f64::from(i % 13), 1.0 + f64::from(i % 7)]).collect();
        assert_eq!(largest_packing(&many, 1024).expect("they fit").len(), 8000);
        assert!(begun.elapsed().as_secs() < 20, "{:?}", begun.elapsed());
    }

    #[test]
    fn many_charts_and_charts_without_area_are_packed() {
        let sizes: Vec<[f64; 2]> = (0..3000).map(|i| [f64::from(i % 13), f64::from(i % 5)]).collect();
        assert_eq!(largest_packing(&sizes, 1024).map(|c| c.len()), Some(3000));
        assert_eq!(largest_packing(&[[0.0, 0.0]], 16).map(|c| c.len()), Some(1));
    }
}
