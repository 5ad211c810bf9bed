//! Damaged files end in errors or points, never in a panic, and soon.

use super::collect;
use super::made::{Made, seal};
use crate::export::scan::ScanFormat;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Mutations of each file.
const MUTATIONS: usize = 400;

/// Changes some bytes. Half of the changes are where the file describes itself: `about`, a range.
fn mutate(bytes: &mut Vec<u8>, about: std::ops::Range<usize>, random: &mut ChaCha8Rng) {
    for _ in 0..random.random_range(1..4) {
        let at = if random.random() { random.random_range(about.clone()) } else { random.random_range(0..bytes.len()) };
        match random.random_range(0..6) {
            0 => bytes[at] = random.random(),
            1 => bytes[at] ^= 1 << random.random_range(0..8),
            2 => bytes[at..].iter_mut().take(4).for_each(|b| *b = 0xff),
            3 => bytes[at..].iter_mut().take(8).for_each(|b| *b = 0),
            4 => bytes[at] = b"0123456789-.e<\""[random.random_range(0..15)],
            _ if random.random_range(0..4) == 0 => bytes.truncate(at.max(about.end)),
            _ => bytes[at..].iter_mut().take(4).for_each(|b| *b = random.random()),
        }
    }
}

#[test]
fn damaged_files_are_survived() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let (mut read, mut failed) = (0, 0);
    for format in [ScanFormat::E57, ScanFormat::Las, ScanFormat::Laz] {
        let good = Made::new(150).to_bytes(format);
        let about = match format {
            // The XML section is at its end.
            ScanFormat::E57 => good.len() - 3 * 1024..good.len(),
            _ => 0..800,
        };
        for _ in 0..MUTATIONS {
            let mut bytes = good.clone();
            mutate(&mut bytes, about.clone(), &mut random);
            if format == ScanFormat::E57 {
                seal(&mut bytes);
            }
            match collect(&bytes, None) {
                Ok(_) => read += 1,
                Err(error) => {
                    assert!(!error.to_string().is_empty());
                    failed += 1;
                }
            }
        }
    }
    assert!(read > MUTATIONS / 4 && failed > MUTATIONS / 4, "{read} read, {failed} failed");
}
